"""Documents that are kept in a folder: what a test prints has to be the same text.

A change that is meant to change them writes them again: LCP_WRITE_DOCUMENTS=1 pytest
FILE. What was typed stands in lines that begin with $: commands of lcp, printf of a
text into a file or into a command, and cat of a file.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from lcpcli.version import VERSION

FOLDER = Path(__file__).with_name("documents")


class Typed(NamedTuple):
    """A line that is typed: the arguments of lcp with its input, or a file with its
    content, None to show it."""

    line: str
    arguments: list[str]
    content: bytes | None = b""
    file: str = ""


def typed_in(name: str) -> Iterator[Typed]:
    for line in (FOLDER / f"{name}.txt").read_text(encoding="utf-8").split("\n"):
        if line.startswith("$ "):
            program, *words = shlex.split(line[2:])
            if program == "lcp":
                yield Typed(line, words)
            elif program == "cat":
                yield Typed(line, [], None, words[0])
            else:
                # Printf %b TEXT > FILE, or | lcp ARGUMENTS.
                _, text, sign, last, *arguments = words
                content = text.encode().decode("unicode_escape").encode("latin-1")
                yield Typed(line, arguments, content, last if sign == ">" else "")


def assert_as_before(name: str, text: str) -> None:
    """Compare a text with the document of this name, but for the version and the last
    digits of numbers."""
    lines = (
        line if line.startswith(("$ ", ">>> ")) else _kept(line)
        for line in text.split("\n")
    )
    text, document = "\n".join(lines), FOLDER / f"{name}.txt"
    if os.environ.get("LCP_WRITE_DOCUMENTS"):
        document.write_text(text, encoding="utf-8")
    assert text == document.read_text(encoding="utf-8")


def _rounded(number: re.Match[str]) -> str:
    value = round(float(number[0]), 9)
    return f"{value:g}" if value else "0.0"


def _kept(line: str) -> str:
    line = re.sub(r"-?\d+\.\d{10,}(e-\d+)?", _rounded, line)
    # Condition numbers of matrices that are singular up to rounding.
    line = re.sub(r"\d\.\de\+1[6-9]", "HUGE", line)
    # Residuals and bounds that are last digits.
    line = re.sub(r"\b\d\.\de-1[4-9]\b", "TINY", line)
    return line.replace(VERSION, "VERSION")
