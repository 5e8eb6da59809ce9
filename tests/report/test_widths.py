"""Nothing that is shown on a terminal, or in a pipe with COLUMNS, is wider than that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.files import contents

FIRST, SECOND = map(contents.shipped_path, contents.PAPER_EXAMPLES)
COMMANDS = {
    "solve": ("solve", FIRST),
    "solve, stalled": ("solve", SECOND, "--method", "shi", "--p", "10"),
    "solve, proved": ("solve", contents.shipped_path("bimatrix.json"), "--exact", "--bound"),
    "compare": ("compare",),
    "compare, a sweep": ("compare", FIRST, "--method", "shi", "--sweep", "p=1,10,1e5"),
    "check": ("check", FIRST, "1,0,1,0.5"),
    "inspect": ("inspect", SECOND),
    "bench": ("bench", FIRST, "--budget", "0", "--method", "newton", "--method", "shi"),
    "list": ("make", "--list"),
    **{f"help of {name}": (name, "--help") for name in ("solve", "compare", "bench", "check", "inspect", "make")},
}

Lcp = Callable[..., Any]


@pytest.mark.parametrize("width", [50, 80, 120])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_is_wider_than_the_screen(name: str, width: int, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = lcp(*COMMANDS[name]).out.splitlines()
    assert lines
    examples = [line for line in lines if line.startswith("  lcp ")]  # they are copied, and so are not broken
    assert [line for line in lines if len(line) > width and line not in examples] == []


def test_narrow_pipe_keeps_the_finest_levels_and_the_end_in_one_row(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "55")
    rows = [line.split() for line in lcp("compare", FIRST).out.splitlines()]
    headers = [row[1:] for row in rows if row[-1:] == ["status"]]
    words = [[word for word in header if word[-1] != "s"] for header in headers]
    assert words == [["to", "1e-9", "end", "error"]]
