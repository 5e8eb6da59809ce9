"""A piece of the solution set, verified from the data of the problem."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from lcpcli.rational.numbers import brief
from lcpcli.rational.polyhedra import Point
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.sums import over_one_denominator

LOWER, BASIC, UPPER = NAMES = ("lower", "basic", "upper")
FIXED = "fixed"
SHOWN = 6  # numbers of a point, and points, that are printed

States = tuple[tuple[str, ...], ...]  # of each unknown, those that hold
Points = tuple[Point, ...]


@dataclass(frozen=True)
class Piece:
    """A polyhedron of solutions that lies in no other one: the convex hull of its vertices, plus rays, plus lines.

    vertices, rays, lines : each of length n, exact; rays and lines are directions. An isolated solution is a piece with
        one vertex and nothing else. Where there are lines, the vertices are points, one on each smallest face.
    states : for each unknown those that it has in all of the piece, which is the set of all z with one of them each:
        "lower" (z_i = l_i and w_i >= 0), "basic" (w_i = 0), "upper" (z_i = u_i and w_i <= 0), "fixed" (l_i = u_i).
    """

    vertices: Points
    rays: Points
    lines: Points
    states: States

    def __str__(self) -> str:
        """In one line: its vertices, rays and lines, without those in the middle where they are many."""
        vertices, rays, lines = (_elided([_short(point) for point in each]) for each in self._generators)
        hull = "hull of " * (len(vertices) > 1) + ", ".join(vertices)
        return " + ".join([hull, *(f"ray {ray}" for ray in rays), *(f"line {line}" for line in lines)])

    @property
    def _generators(self) -> tuple[Points, Points, Points]:
        return self.vertices, self.rays, self.lines

    @property
    def is_point(self) -> bool:
        """Whether it is an isolated solution."""
        return len(self.vertices) == 1 and not self.rays and not self.lines

    @classmethod
    def of(cls, data: ExactProblem, vertices: Points, rays: Points = (), lines: Points = ()) -> Piece:
        """The piece with these generators, whose states are found from the data; ArithmeticError if it is none."""
        return cls._verified(vertices, rays, lines, common_states(data, vertices, rays, lines))

    @classmethod
    def spanned(cls, solutions: Sequence[tuple[Point, States]]) -> Piece:
        """The bounded piece with these vertices, each with its `common_states`; ArithmeticError if it is none."""
        vertices, states = zip(*solutions, strict=True)
        common = (
            tuple(name for name in held[0] if all(name in each for each in held)) for held in zip(*states, strict=True)
        )
        return cls._verified(vertices, (), (), tuple(common))

    @classmethod
    def _verified(cls, vertices: Points, rays: Points, lines: Points, states: States) -> Piece:
        if not all(states):
            raise ArithmeticError("a piece that was found is not one of solutions")
        return cls(vertices, rays, lines, states)


def common_states(
    data: ExactProblem, vertices: Sequence[Point], rays: Sequence[Point] = (), lines: Sequence[Point] = ()
) -> States:
    """The states that each unknown has in all of the polyhedron with these generators, by M, q and the bounds."""
    w = [_multiples(data, vertex, data.constants) for vertex in vertices]
    directions = [*rays, *lines, *(tuple(-value for value in line) for line in lines)]
    slopes = [_multiples(data, each, [0] * data.n) for each in directions]
    states = []
    for i, (low, high) in enumerate(zip(data.lower, data.upper, strict=True)):
        at = [(vertex[i], value[i]) for vertex, value in zip(vertices, w, strict=True)]
        along = [(direction[i], slope[i]) for direction, slope in zip(directions, slopes, strict=True)]
        still = not any(dz for dz, _ in along)
        if low is not None and low == high:
            held = [FIXED] * (still and all(z == low for z, _ in at))
        else:
            held = [LOWER] * (still and all(z == low and v >= 0 for z, v in at) and all(dv >= 0 for _, dv in along))
            held += [BASIC] * (not any(v for _, v in [*at, *along]) and _is_within(at, along, low, high))
            held += [UPPER] * (still and all(z == high and v <= 0 for z, v in at) and all(dv <= 0 for _, dv in along))
        states.append(tuple(held))
    return tuple(states)


def _multiples(data: ExactProblem, z: Point, constants: Sequence[int]) -> list[int]:
    """Positive multiples of each row of M z plus a constant: they have its sign."""
    Z, d = over_one_denominator(z)
    used = [(j, value) for j, value in enumerate(Z) if value]
    return [
        sum(row.get(j, 0) * value for j, value in used) + constant * d
        for row, constant in zip(data.rows, constants, strict=True)
    ]


def combined(pieces: Sequence[Piece], places: Sequence[Sequence[int]], n: int, check: Callable[[], None]) -> Piece:
    """The product of pieces of independent blocks, whose unknowns are at these places among n.

    `check` is called before each vertex and may raise: there are as many as combinations of theirs.
    """
    zero = [Fraction(0)] * n

    def put(parts: Iterable[tuple[Sequence[int], Sequence[Fraction]]]) -> Point:
        check()
        z = list(zero)
        for indices, part in parts:
            for i, value in zip(indices, part, strict=True):
                z[i] = value
        return tuple(z)

    states: list[tuple[str, ...]] = [()] * n
    for piece, indices in zip(pieces, places, strict=True):
        for i, held in zip(indices, piece.states, strict=True):
            states[i] = held
    pairs = list(zip(places, pieces, strict=True))
    return Piece(
        tuple(put(zip(places, chosen, strict=True)) for chosen in product(*(piece.vertices for piece in pieces))),
        tuple(put([(indices, ray)]) for indices, piece in pairs for ray in piece.rays),
        tuple(put([(indices, line)]) for indices, piece in pairs for line in piece.lines),
        tuple(states),
    )


def _is_within(
    at: Sequence[tuple[Fraction, int]],
    along: Sequence[tuple[Fraction, int]],
    low: Fraction | None,
    high: Fraction | None,
) -> bool:
    above = low is None or (all(z >= low for z, _ in at) and all(dz >= 0 for dz, _ in along))
    return above and (high is None or (all(z <= high for z, _ in at) and all(dz <= 0 for dz, _ in along)))


def _short(point: Point) -> str:
    return f"({', '.join(_elided([brief(value) for value in point]))})"


def _elided(parts: list[str]) -> list[str]:
    return parts if len(parts) <= SHOWN else [*parts[: SHOWN - 1], "...", parts[-1]]
