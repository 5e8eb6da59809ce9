"""A path in terms of its problem: the names of the variables, the number that varies, the objective of a program, and
what happens along it, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import count
from lcpcli.model.box import BASIC, LOWER, UPPER, WORDS
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import SENSES, Program, ProgramData
from lcpcli.parametric.path import Path, StateChange
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import shortest_decimal
from lcpcli.report import wording
from lcpcli.typing import Vector


def verified(path: Path) -> str:
    return f"{'' if path.verified else 'not '}verified{' in fractions' * (path.verified and path.exact is not None)}"


def title(path: Path) -> str:
    ends = [wording.title(problem) or "problem" for problem in (path.problem, path.to)]
    return f"{' to '.join(dict.fromkeys(ends))}: {wording.size(path.problem)}"


def verdict(path: Path, breakpoints: int) -> str:
    """Return how the path ends, its breakpoints, and whether it is verified."""
    return f"{path.message}; {count(breakpoints, 'breakpoint')}, {verified(path)}" if breakpoints else path.message


def line(path: Path) -> str:
    span = f", t from {path.t[0]:.7g} to {path.t[-1]:.7g}" if path.t.size else ""
    proof = f", {verified(path)}" if path.t.size else ""
    return f"<Path: {count(path.t.size, 'breakpoint')}{span}: {path.message}{proof}>"


def changes(path: Path) -> list[list[StateChange]]:
    """Return the changes at each breakpoint, none at the first and at the last."""
    return [[], *path.changes, []][: path.t.size]


def notes(path: Path, names: Sequence[str], most: float) -> list[str]:
    """Return for each breakpoint what happens there: which variables enter and leave the basis, a jump to it, a turn
    at it, and the end."""
    notes = [_in_words(path.problem, each, names, most) for each in changes(path)]
    for k in path.jumps:
        notes[k + 1].insert(0, "jump")
    for k in turns(path):
        notes[k].append("turn")
    if notes:
        notes[-1].append(path.end.replace("_", " "))
    return [", ".join(note) for note in notes]


def _in_words(problem: Problem, changes: Sequence[StateChange], names: Sequence[str], most: float) -> list[str]:
    """Return the changes in words; multipliers of a maximization are shown with the other sign."""
    reversed_ones = problem.origin.reversed(problem.n) if isinstance(problem.origin, Program) else range(0)
    words = {word: f"to {word}" if problem.is_mixed else "leaves" for word in WORDS.values()} | {WORDS[BASIC]: "enters"}
    others = words | {WORDS[LOWER]: words[WORDS[UPPER]], WORDS[UPPER]: words[WORDS[LOWER]]}
    shown = changes if len(changes) <= most else changes[: int(most) - 1]
    texts = [f"{names[i]} {(others if i in reversed_ones else words)[after]}" for i, _, after in shown]
    return [*texts, *[f"{len(changes) - len(shown)} more"] * (len(changes) > len(shown))]


def turns(path: Path) -> list[int]:
    moves = np.sign(np.diff(path.t))
    found, last = [], 0.0
    for k, move in enumerate(moves.tolist()):
        if move and last and move != last:
            found.append(k)
        last = move or last
    return found


RELATIONS = {  # for a number that moves: an entry of a vector of this name, or both sides of a row that is an equation
    "row": "equal to",
    "row_lower": "at least",
    "row_upper": "at most",
    "c": "objective coefficient",
    "q": "",
    "lower": "at least",
    "upper": "at most",
}


class Points(NamedTuple):
    """Points of a path: m values of t, and z and w of each, in doubles or in fractions."""

    t: Sequence[Any]
    z: Sequence[Any]
    w: Sequence[Any]


class Moving(NamedTuple):
    """The only number that differs between two problems: the name of the row or variable, what the number is for it, a
    key of RELATIONS, and its values in both problems."""

    name: str
    what: str
    first: float
    last: float

    def __str__(self) -> str:
        return f"{self.name}: {f'{self.word} ' * bool(self.word)}{self.first:.7g} to {self.last:.7g}"

    @property
    def word(self) -> str:
        return RELATIONS[self.what]

    @property
    def label(self) -> str:
        return f"{self.what} {self.name}" if self.what in ("c", "lower", "upper") else self.name


class Ends:
    """The two problems of a path, with the names by which they are reported, and the program behind both, if there is
    one."""

    def __init__(self, *ends: Problem) -> None:
        self._ends = ends
        self._programs = [each.origin for each in self._ends if isinstance(each.origin, Program)]
        kinds = {(each.sense, each.variables, each.ranges) for each in self._programs}
        self.program = self._programs[0] if len(self._programs) == 2 and len(kinds) == 1 else None

    def names(self, most: float = math.inf) -> list[str]:
        """Return the names of the components of z by `short_names`; those of a program's multipliers begin with y."""
        if self.program is None:
            return wording.headings(self._ends[0], most)
        (data, _), rows = self._data, self.program.rows or [""] * (self._ends[0].n - self.program.variables)
        rows = rows[: data.row_lower.size]
        sides = [rows[i] for i in np.flatnonzero(data.ranges)]
        y, s = ([f"{letter} {row}" if row else "" for row in own] for letter, own in (("y", rows), ("s", sides)))
        columns = wording.short_names(self.program.columns or [""] * self.program.variables, most, "x")
        return [*columns, *wording.short_names(y, most, "y"), *wording.short_names(s, most, "s")]

    @cached_property
    def _data(self) -> tuple[ProgramData, ProgramData]:
        assert self.program is not None
        first, last = (self.program.program(conditions_of(each)) for each in self._ends)
        assert first is not None
        assert last is not None
        return first, last


class Terms(Ends):
    def __init__(self, path: Path) -> None:
        super().__init__(path.problem, path.to)
        self.path = path

    @property
    def points(self) -> Points:
        """Return the breakpoints, in fractions if the path has them."""
        exact, path = self.path.exact, self.path
        return Points(*exact) if exact else Points(path.t.tolist(), list(path.z), list(path.w))

    def at_all(self, values: Sequence[float | Fraction]) -> Points:
        """Return the points of the path at several values of t; there are none where it does not come."""
        points, found = self.points, list[tuple[Any, Any, Any]]()
        for t in values:
            own = list[tuple[Any, Any]]()
            for k in range(max(len(points.t) - 1, 1)) if points.t else ():
                for pair in _on_piece(Points(*(part[k : k + 2] for part in points)), t):
                    own += [pair] * (pair not in own)
            found += [(t, *pair) for pair in own]
        return Points(*map(list, zip(*found, strict=True))) if found else Points([], [], [])

    def values(self, z: Sequence[Any]) -> Sequence[Any]:
        """Return z, of a program x, y and s, with the multipliers y in its own sense."""
        turned = range(0) if self.program is None else self.program.reversed(len(z))
        return [0 - value if i in turned else value for i, value in enumerate(z)] if turned else z

    def objective(self, t: Any, z: Sequence[Any]) -> Any:
        """Return the objective of the program at t, in its own sense and with its constant."""
        assert self.program is not None
        share, ends = self._share(t), list[Any]()
        if isinstance(t, Fraction) and self._exact:
            from lcpcli.enumeration.search import objective

            ends = [objective(data, program, z) for data, program in zip(self._exact, self._programs, strict=True)]
        else:
            share, x = float(share), np.array(self.program.parts(z)[0], dtype=float)
            for data, program in zip(self._data, self._programs, strict=True):
                ends.append(SENSES[program.sense] * data.objective(x) + program.constant)
        return (1 - share) * ends[0] + share * ends[1]

    @cached_property
    def _exact(self) -> tuple[ExactProblem, ExactProblem] | None:
        """Return the problems whose solutions the fractions are: their doubles as they are, or as decimals."""
        points = self.points
        for read in (ExactProblem.of_decimals, ExactProblem.of_floats) if self.path.exact and points.t else ():
            first, last = map(read, self._ends)
            if first.w(points.z[0]) == points.w[0]:
                return first, last
        return None

    @property
    def is_quadratic(self) -> bool:
        return self.program is not None and bool((self._data[0].Q != 0).sum())

    @cached_property
    def moving(self) -> Moving | None:
        """Return the number that differs, in the program's own sense, if it is one only; else None."""
        found = list(islice(self._differences(), 2))
        return found[0] if len(found) == 1 else None

    def moved(self, t: Any) -> Any:
        assert self.moving is not None
        share, ends = self._share(t), self.moving[2:]
        first, last = map(shortest_decimal, ends) if isinstance(share, Fraction) else ends
        return (1 - share) * first + share * last

    def _share(self, t: Any) -> Any:
        family = self.path.family
        if not isinstance(t, Fraction):
            return family.share(t)
        start, stop = Fraction(family.start), Fraction(family.stop)
        return (t - start) / (stop - start)

    def _differences(self) -> Iterator[Moving]:
        """Yield the numbers that differ; both sides of an equation are one."""
        if self.program is None:
            ends: list[Any] = [conditions_of(each) for each in self._ends]
            names = [f"q {name}" if name else "" for name in self.path.problem.names]
            yield from _moving(wording.short_names(names, math.inf, "q"), "q", *(each.q for each in ends))
        else:
            ends = list(self._data)
            yield from _moving(self.names(), "c", *(SENSES[self.program.sense] * each.c for each in ends))
        for key in ("lower", "upper"):
            yield from _moving(self.names(), key, *(getattr(each, key) for each in ends))
        if self.program is None:
            return
        one, two = self._data
        rows = self.program.rows or [f"row {i}" for i in range(1, one.row_lower.size + 1)]
        equal = (one.row_lower == one.row_upper) & (two.row_lower == two.row_upper)
        yield from _moving(rows, "row", one.row_lower, two.row_lower, equal)
        for key in ("row_lower", "row_upper"):
            yield from _moving(rows, key, getattr(one, key), getattr(two, key), ~equal)


def _moving(names: Sequence[str], what: str, first: Vector, last: Vector, among: Any = True) -> Iterator[Moving]:
    for i in np.flatnonzero((first != last) & among).tolist():
        yield Moving(names[i], what, float(first[i]), float(last[i]))


def _on_piece(ends: Points, t: Any) -> list[tuple[list[Any], list[Any]]]:
    """Return the points at t of a piece, whose ends are two points, or of a path of one point: z and w of each."""
    if not min(ends.t) <= t <= max(ends.t):
        return []
    if t in ends.t:
        return [(list(z), list(w)) for own, z, w in zip(*ends, strict=True) if own == t]
    share = (t - ends.t[0]) / (ends.t[1] - ends.t[0])
    z, w = ([(1 - share) * a + share * b for a, b in zip(*pair, strict=True)] for pair in (ends.z, ends.w))
    return [(z, w)]
