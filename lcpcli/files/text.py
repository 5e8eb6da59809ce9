"""Decoding of files."""

from __future__ import annotations

from lcpcli.errors import ProblemError


def decode(content: bytes) -> str:
    """The text in UTF-8 bytes, or a ProblemError."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise ProblemError("", "is not UTF-8 text", "save it as UTF-8")
    return text
