"""Nothing on a terminal, or in a pipe with COLUMNS, is wider than that, and what has no room gives way in its order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.files import contents

FIRST, SECOND = map(contents.shipped_path, contents.PAPER_EXAMPLES)
TRIDIAGONAL, BIMATRIX = map(contents.shipped_path, ("tridiagonal-100.json", "bimatrix.json"))
COMMANDS = {
    "solve": ("solve", FIRST),
    "solve, stalled": ("solve", SECOND, "--method", "shi", "--p", "10"),
    "solve, proved": ("solve", BIMATRIX, "--exact", "--bound"),
    "solve, large": ("solve", TRIDIAGONAL, "--method", "fixed-point", "--max-iterations", "20"),
    "solve, long": ("solve", BIMATRIX, "--method", "shi", "--max-iterations", "50"),
    "compare": ("compare", SECOND),
    "compare, large": ("compare", TRIDIAGONAL),
    "compare, a sweep": ("compare", FIRST, "--method", "shi", "--sweep", "p=10,1e5"),
    "check": ("check", FIRST, "1,0,1,0.5"),
    "inspect": ("inspect", SECOND),
    "bench": ("bench", FIRST, "--budget", "0", "--method", "newton", "--method", "shi"),
    "list": ("make", "--list"),
    **{f"help of {name}": (name, "--help") for name in ("solve", "compare", "bench", "check", "inspect", "make")},
}

Lcp = Callable[..., Any]
Terminal = Callable[[int, bool], None]


@pytest.mark.parametrize("width", [50, 80])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_is_wider_than_the_screen(name: str, width: int, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = lcp(*COMMANDS[name]).out.splitlines()
    assert lines
    examples = [line for line in lines if line.startswith("  lcp ")]  # they are copied, and so are not broken
    assert [line for line in lines if len(line) > width and line not in examples] == []


def test_a_narrow_pipe_keeps_the_finest_levels_and_the_end_in_one_row(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "55")
    rows = [line.split() for line in lcp("compare", FIRST).out.splitlines()]
    headers = [row[1:] for row in rows if row[-1:] == ["status"]]
    words = [[word for word in header if word[-1] != "s"] for header in headers]
    assert words == [["to", "1e-9", "end", "error"]]


@pytest.mark.parametrize(("width", "levels"), [(100, 3), (74, 2), (60, 1)])
def test_a_narrow_terminal_drops_levels_and_splits_no_row_of_the_summary(
    width: int, levels: int, lcp: Lcp, terminal: Terminal
) -> None:
    terminal(width, False)
    header = next(line for line in lcp("compare", FIRST).out.splitlines() if line.endswith("status"))
    assert header.startswith("method")
    assert header.count(" to ") == levels


def heading_and_first(lcp: Lcp, file: str) -> tuple[list[str], str]:
    """The words of the heading of the iterates and the line of the first."""
    lines = lcp("solve", file, "--method", "fixed-point").out.split("\n\n", 1)[1].splitlines()
    return lines[0].split(), lines[2]


@pytest.mark.parametrize(("width", "method"), [(120, "fixed-point "), (80, "fixed-point "), (40, "fixed- ")])
def test_the_name_of_a_method_is_written_down_only_where_a_table_is_too_wide(
    width: int, method: str, lcp: Lcp, terminal: Terminal
) -> None:
    terminal(width, False)
    heading, first = heading_and_first(lcp, FIRST)
    assert first.startswith(method)
    assert "..." not in heading or width < 80


@pytest.mark.parametrize(("width", "shown"), [(50, 2), (60, 3), (80, 4), (200, 15), (None, 12)])
def test_large_n_shows_the_first_and_the_last_components(
    width: int | None, shown: int, lcp: Lcp, terminal: Terminal
) -> None:
    if width is not None:
        terminal(width, False)
    heading, _ = heading_and_first(lcp, TRIDIAGONAL)
    names = heading[2 : heading.index("error")]
    assert names[-2:] == ["...", "z100"]
    assert names[0] == ("z1" if width != 50 else "...")
    assert len(names) == shown
