"""Names that a file may hold and that must do nothing to whoever reads them."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

HOSTILE = {
    "clipboard": "\x1b]52;c;aGk=\x07",
    "break": "a\nlcp: forged",
    "return": "b\rforged\x0b\x0c\x1c\x85",
    "c1": "\x9b31m\x7f\0\t",
    "override": "\u202ertl\u2066\u2069",
    "separators": "x\u2028y\u2029",
    "half": "\ud800",
    "no character": "\ufffe\ufdd0\U0010ffff",
    "markup": "[bold]b[/bold] :smile:",
    "signs": r"a|b\c $x$ %d 100% & ~~s~~ `t` *u* _v_ #{} --",
    "tag": "<script>x</script>&amp;",
    "quotes": "\"q\", 'r'; #s",
    "formula": "=1+1",
    "ordinary": "Süd 中文 \U0001f600 👩\u200d👧 עברית",
}
WHOLE = "".join(HOSTILE.values())
TURNS = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
PROGRAM = {"Q": [[2, 0], [0, 2]], "c": [-1, -2], "A": [[1, 1]], "row_lower": [1]}
ABOVE_AND_BELOW = {"A": [[1, 1], [1, 1]], "row_lower": [3, None], "row_upper": [None, 1]}


def two(name: str, first: str = "1") -> list[str]:
    return [f"{first}{name}", name]


KINDS: dict[str, Callable[[str], dict[str, Any]]] = {
    "lcp": lambda name: {"M": [[2, 1], [1, 2]], "q": [-5, -6], "names": two(name)},
    "game": lambda name: {"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": two(name), "columns": two(name, "2")},
    "program": lambda name: {**PROGRAM, "rows": [name], "columns": two(name)},
    "without minimum": lambda name: {"c": [-1, -2], **ABOVE_AND_BELOW, "rows": two(name), "columns": two(name)},
}


def is_unseen(mark: str) -> bool:
    """Whether a character is one of those that people must not get, by the tables of Unicode."""
    is_none = ord(mark) & 0xFFFE == 0xFFFE or 0xFDD0 <= ord(mark) <= 0xFDEF
    return unicodedata.category(mark) in ("Cc", "Cs", "Zl", "Zp") or unicodedata.bidirectional(mark) in TURNS or is_none


def unseen(text: str) -> set[str]:
    return {mark for mark in text if is_unseen(mark) and mark != "\n"}


def put(kind: str, name: str, file: str = "p.json", **changed: Any) -> None:
    Path(file).write_text(json.dumps({"name": name, **KINDS[kind](name), **changed}))
