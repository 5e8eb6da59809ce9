"""What happens along a path, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lcpcli.errors import count
from lcpcli.model.box import BASIC, LOWER, UPPER, WORDS
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program
from lcpcli.parametric.path import Path, StateChange
from lcpcli.report import wording


def verified(path: Path) -> str:
    """Return whether the path is verified."""
    return f"{'' if path.verified else 'not '}verified{' in fractions' * (path.verified and path.exact is not None)}"


def title(path: Path) -> str:
    """Return the names of both problems, and their size."""
    ends = [wording.title(problem) or "problem" for problem in (path.problem, path.to)]
    return f"{' to '.join(dict.fromkeys(ends))}: {wording.size(path.problem)}"


def verdict(path: Path, breakpoints: int) -> str:
    """Return how the path ends, its breakpoints, and whether it is verified."""
    return f"{path.message}; {count(breakpoints, 'breakpoint')}, {verified(path)}" if breakpoints else path.message


def changes(path: Path) -> list[list[StateChange]]:
    """Return the changes at each breakpoint, none at the first and at the last."""
    return [[], *path.changes, []][: path.t.size]


def notes(path: Path, names: Sequence[str], most: float) -> list[str]:
    """Return for each breakpoint what happens there: which variables enter and leave the basis, a jump to it, a turn
    at it, and the end."""
    mixed, reversed_ones = path.problem.is_mixed, _reversed(path.problem)
    notes = [_in_words(each, names, mixed, most, reversed_ones) for each in changes(path)]
    for k in path.jumps:
        notes[k + 1].insert(0, "jump")
    for k in turns(path):
        notes[k].append("turn")
    if notes:
        notes[-1].append(path.end.replace("_", " "))
    return [", ".join(note) for note in notes]


def _reversed(problem: Problem) -> range:
    """Return the components that are shown with the other sign: the multipliers of a maximization."""
    return problem.origin.reversed(problem.n) if isinstance(problem.origin, Program) else range(0)


def _in_words(
    changes: Sequence[StateChange], names: Sequence[str], is_mixed: bool, most: float, reversed_ones: range
) -> list[str]:
    words = {word: f"to {word}" if is_mixed else "leaves" for word in WORDS.values()} | {WORDS[BASIC]: "enters"}
    others = words | {WORDS[LOWER]: words[WORDS[UPPER]], WORDS[UPPER]: words[WORDS[LOWER]]}
    shown = changes if len(changes) <= most else changes[: int(most) - 1]
    texts = [f"{names[i]} {(others if i in reversed_ones else words)[after]}" for i, _, after in shown]
    return [*texts, *[f"{len(changes) - len(shown)} more"] * (len(changes) > len(shown))]


def turns(path: Path) -> list[int]:
    """Return the breakpoints at which t turns."""
    moves = np.sign(np.diff(path.t))
    found, last = [], 0.0
    for k, move in enumerate(moves.tolist()):
        if move and last and move != last:
            found.append(k)
        last = move or last
    return found
