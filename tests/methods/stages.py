"""Methods at work, taken apart: their iterates and how they ended; and scripts in the
place of methods."""

from __future__ import annotations

from collections.abc import Iterable

from lcpcli.methods.stages import Ending, Finished, Iterate, Stage, advance


def through(stage: Stage) -> tuple[list[Iterate], Ending]:
    """All iterates of a stage, and how it ended."""
    iterates: list[Iterate] = []
    while isinstance(step := advance(stage), Iterate):
        iterates.append(step)
    return iterates, step


def scripted(iterates: Iterable[Iterate], ending: Ending | None = None) -> Stage:
    """A method that yields these iterates and then ends, by default as one that has
    finished."""
    yield from iterates
    return ending or Finished()
