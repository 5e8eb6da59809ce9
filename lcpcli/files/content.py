"""What the content of a file must be before it is parsed: text in UTF-8, arrays that fit into memory."""

from __future__ import annotations

import codecs
import gzip
import math
import os
import zlib

from lcpcli.errors import ProblemError


def without_mark(content: bytes) -> bytes:
    """The content without a byte order mark, and in UTF-8 if the mark is that of UTF-16, as of Excel's Unicode text."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            return content.decode("utf-16").encode()
        except UnicodeError:
            return content
    return content.removeprefix(codecs.BOM_UTF8)


def decode(content: bytes) -> str:
    """The text in UTF-8 bytes, or a ProblemError."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise ProblemError("", "is not UTF-8 text", "save it as UTF-8")
    return text


def unpacked(content: bytes) -> bytes:
    """The content, uncompressed if it was by gzip, or a ProblemError."""
    if not content.startswith(b"\x1f\x8b"):
        return content
    try:
        return gzip.decompress(content)
    except (OSError, EOFError, zlib.error) as error:
        fault = "is cut off" if isinstance(error, EOFError) else "is damaged"
        raise ProblemError("", f"cannot be uncompressed, as it {fault}", "compress it again") from None


def refuse_beyond_memory(field: str, shape: tuple[int, ...], itemsize: int = 8) -> None:
    """Raise ProblemError if an array of the shape that a file declares is larger than the memory of this machine."""
    size = math.prod(shape) * itemsize
    if size > _memory():
        declared = " x ".join(map(str, shape))
        raise ProblemError(
            field, f"is {declared}, {size / 1e9:.3g} GB, more than this machine's memory", "give it in sparse form"
        )


def _memory() -> float:
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # systems that do not provide it
        return math.inf
