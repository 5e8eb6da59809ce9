"""A kind of bad input: a command line, the files that it meets, and what the line about it must contain."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest

GOOD = '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}'
LONG = "a" * 100_000


@dataclass(frozen=True)
class Kind:
    """A bad command line, the files and the standard input that it meets, and what the line must contain."""

    arguments: tuple[str, ...]
    words: tuple[str, ...]
    files: dict[str, str | bytes] = field(default_factory=dict)
    stdin: bytes = b""


def of_line(name: str, line: str, *words: str, stdin: bytes = b"", **files: str | bytes) -> Any:
    """A command line in a folder with good.json, M.csv, q.csv, results/ and loop -> loop; files by their stems."""
    named = {f"{stem}.csv": content for stem, content in files.items()}
    return pytest.param(Kind(tuple(line.split(" ")), words, named, stdin), id=name)


def of_json(name: str, content: str | bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.json"), ("bad.json: ", *words), {"bad.json": content}), id=name)


def of_csv(name: str, content: str | bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.csv"), ("bad.csv: ", *words), {"bad.csv": content}), id=name)


def of_stdin(name: str, content: bytes, *words: str, line: str = "solve -") -> Any:
    return of_line(name, line, "standard input", *words, stdin=content)


def of_solving(name: str, options: str, *words: str, **files: str | bytes) -> Any:
    return of_line(name, f"solve good.json {options}", *words, **files)


def of_file(name: str, content: str | bytes, line: str, *words: str) -> Any:
    """A command line in a folder that holds one more file."""
    return pytest.param(Kind(tuple(line.split(" ")), words, {name: content}), id=f"{line}-{'-'.join(words)}"[:60])
