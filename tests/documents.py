"""Documents in a folder: what is typed, and what is printed has to be the same text.

A change that is meant to change them writes them again: LCP_WRITE_DOCUMENTS=1 pytest
FILE. What is typed stands in lines that begin with $, as in a shell: commands of lcp,
mkdir, cat of a file, and printf of a text into a file or into a command. `| head -N`,
`| tail -N` and `| grep [-o] [-v] PATTERN` show a part, `2>&1` of the messages too.
"""

import os
import re
import shlex
from pathlib import Path
from typing import NamedTuple

from lcpcli.version import VERSION

FOLDER = Path(__file__).with_name("documents")


class Typed(NamedTuple):
    """A line that is typed: its words between the signs | and >, without 2>&1."""

    line: str
    parts: list[list[str]]
    signs: list[str]
    joined: bool


def typed_in(name):
    for line in (FOLDER / f"{name}.txt").read_text(encoding="utf-8").split("\n"):
        if line.startswith("$ "):
            typed = Typed(line, [[]], [], " 2>&1" in line)
            for word in shlex.split(line[2:].replace(" 2>&1", "")):
                if word in ("|", ">"):
                    typed.signs.append(word)
                    typed.parts.append([])
                else:
                    typed.parts[-1].append(word)
            yield typed


def printf(text):
    """What printf %b prints."""
    return re.sub(
        r"(?:\\[nrt\\]|\\x[0-9a-f]{2})+",
        lambda escapes: escapes[0].encode().decode("unicode_escape"),
        text,
    ).encode()


def shown(text, command, *arguments):
    """The part of a text that head, tail or grep shows."""
    lines = text.splitlines(keepends=True)
    if command == "head":
        (number,) = arguments
        return "".join(lines[: -int(number)])
    if command == "tail":
        (number,) = arguments
        return "".join(lines[int(number) :])
    assert command == "grep", command
    *options, pattern = arguments
    # Alternatives and groups of basic patterns have a backslash.
    pattern = re.sub(
        r"\\([|()])|([(){}])", lambda sign: sign[1] or rf"\{sign[2]}", pattern
    )
    if options == ["-o"]:
        return "".join(f"{match[0]}\n" for match in re.finditer(pattern, text))
    without = options == ["-v"]
    return "".join(line for line in lines if bool(re.search(pattern, line)) != without)


def assert_as_before(name, text):
    """Compare a text with the document of this name, but for the version and the last
    digits of numbers."""
    lines = (
        line if line.startswith("$ ") else _kept(line) for line in text.split("\n")
    )
    text, document = "\n".join(lines), FOLDER / f"{name}.txt"
    if os.environ.get("LCP_WRITE_DOCUMENTS"):
        document.write_text(text, encoding="utf-8")
    assert text == document.read_text(encoding="utf-8")


def _rounded(number):
    value = round(float(number[0]), 9)
    return f"{value:g}" if value else "0.0"


def _kept(line):
    line = re.sub(r"-?\d+\.\d{10,}(e-\d+)?", _rounded, line)
    # Condition numbers of matrices that are singular up to rounding.
    line = re.sub(r"\d\.\de\+1[6-9]", "HUGE", line)
    # Residuals and bounds that are last digits.
    line = re.sub(r"\b\d\.\de-1[4-9]\b", "TINY", line)
    return line.replace(VERSION, "VERSION")
