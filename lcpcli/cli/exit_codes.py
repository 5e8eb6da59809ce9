"""Exit codes of lcp."""

from __future__ import annotations

from collections.abc import Iterable

SOLVED = 0
NOT_SOLVED = 1
BAD_INPUT = 2
NO_SOLUTION = 3
INTERRUPTED = 130  # as shells report SIGINT
TERMINATED = 143  # as shells report SIGTERM
CLOSED_PIPE = 141  # as shells report SIGPIPE
FIRST = (INTERRUPTED, BAD_INPUT, NOT_SOLVED, NO_SOLUTION, SOLVED)  # which of them a run of several problems has


def of_several(codes: Iterable[int]) -> int:
    """The exit code of a run in which there were these."""
    return min(codes, key=FIRST.index)
