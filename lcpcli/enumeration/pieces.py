"""The pieces of the solution set of a problem, each verified from the data and yielded
once, when it is complete; and proofs that there is at most one piece.

If M is positive semidefinite, the solutions form one polyhedron; if all principal
minors are positive, there is at most one solution (R. W. Cottle, J.-S. Pang and R. E.
Stone, The Linear Complementarity Problem, SIAM 2009, sections 3.1 and 3.3; the same
holds with bounds). The minors are positive if those of the strongly connected
components of M are, and these are if a component is positive definite after scaling its
rows, or diagonally dominant after scaling its columns. If the payoffs of a bimatrix
game sum to a constant, the equilibria form one polyhedron too (J. von Neumann,
Mathematische Annalen 100 (1928) 295-320).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from itertools import chain, product
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.enumeration.bimatrix import MAX_REMEMBERED, nash_subsets
from lcpcli.interrupts import TimeIsUp, in_time, remaining
from lcpcli.linalg import matrices
from lcpcli.model.box import BASIC, LOWER, UPPER, WORDS
from lcpcli.rational import elimination
from lcpcli.rational.dictionary import Direction, RationalPoint, generators
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import brief, over_one_denominator, zeros
from lcpcli.rational.tree import Node, Unknowns, explored
from lcpcli.typing import Vector
from lcpcli.verify.error_theorems import row_scalings, scaling

FIXED = "fixed"
# The most numbers of a point, and points, that are printed, so that they fit on a line.
SHOWN_PARTS = 6
# A piece that takes more bases than this is listed after all other pieces.
MAX_BASES_AT_FIRST = 1000
# Unknowns up to which branch and bound finds a first solution as fast as a method in
# floating-point arithmetic does.
MAX_FOR_TREE = 10
# Vertices of a polyhedron of a game up to which they are enumerated at once, which
# takes less than a tenth of a second.
MAX_VERTICES_AT_FIRST = 1000
# The steps of branch and bound before more vertices are enumerated, times the n^2
# entries of a dictionary: they take about two seconds.
ENTRIES_AT_FIRST = 20_000_000
# Vertices up to which they are enumerated in less time than branch and bound takes.
MAX_VERTICES = 15_000
POINT, PIECE = "a point", "a piece"
# Unknowns up to which branch and bound is faster than testing components for scalings
# d.
MAX_WITHOUT_THEOREM = 10
# Bits of the smallest component of d as an integer, so that integers stay short.
MULTIPLIER_BITS = 30

Rows = list[list[int]]
Words = tuple[tuple[str, ...], ...]  # the statuses that hold, for each unknown
Points = tuple[RationalPoint, ...]


@dataclass(frozen=True)
class Piece:
    """A maximal polyhedron of solutions: the convex hull of its vertices, plus rays,
    plus lines.

    vertices, rays, lines : each of length n, exact; rays and lines are directions. An
        isolated solution is a piece with one vertex and nothing else. If there are
        lines, the vertices are points, one on each minimal face.
    states : for each unknown, the statuses that it has everywhere on the piece, which
        is the set of all z with one of these statuses for each: "lower" (z_i = l_i and
        w_i >= 0), "basic" (w_i = 0), "upper" (z_i = u_i and w_i <= 0), "fixed" (l_i =
        u_i).
    """

    vertices: Points
    rays: Points
    lines: Points
    states: Words

    def __str__(self) -> str:
        """Return the piece in one line: its vertices, rays and lines; if there are
        many, only the first ones and the last.
        """
        generators = (self.vertices, self.rays, self.lines)
        vertices, rays, lines = (
            _elided([_short(point) for point in each]) for each in generators
        )
        hull = ", ".join(vertices)
        if len(vertices) > 1:
            hull = f"hull of {hull}"
        return " + ".join(
            [hull, *(f"ray {ray}" for ray in rays), *(f"line {line}" for line in lines)]
        )

    @property
    def is_point(self) -> bool:
        """Return whether the piece is an isolated solution."""
        return len(self.vertices) == 1 and not self.rays and not self.lines

    @classmethod
    def of(
        cls,
        states: Iterable[Words],
        vertices: Points,
        rays: Points = (),
        lines: Points = (),
    ) -> Piece:
        """Return the piece with these generators and the `states_of` each; raise
        ArithmeticError if an unknown has no status on the whole piece, so that it does
        not consist of solutions.
        """
        common = (
            tuple(
                name
                for name in unknown_states[0]
                if all(name in each for each in unknown_states)
            )
            for unknown_states in in_time(zip(*states, strict=True))
        )
        piece = cls(vertices, rays, lines, tuple(common))
        if not all(piece.states):
            raise ArithmeticError(
                "a piece that was treated as a set of solutions is not one"
            )
        return piece


def states_of(
    data: ExactProblem, z: RationalPoint, is_direction: bool = False
) -> Words:
    """Return the statuses that each unknown has at a point, or keeps in a direction,
    for the data of a problem.
    """
    Z, d = over_one_denominator(z)
    used = [(j, value) for j, value in enumerate(Z) if value]
    lower = data.lower
    upper = data.upper
    constants = data.constants
    if is_direction:
        constants = [0] * data.n
        lower, upper = (
            [None if bound is None else Fraction(0) for bound in bounds]
            for bounds in (lower, upper)
        )
    statuses = list[tuple[str, ...]]()
    for k, (row, value, low, high) in enumerate(
        zip(data.rows, z, lower, upper, strict=True)
    ):
        # w_k up to a positive factor.
        w = sum(row.get(j, 0) * factor for j, factor in used) + constants[k] * d
        if low is not None and data.lower[k] == data.upper[k]:
            statuses.append((FIXED,) if value == low else ())
            continue
        is_within = (low is None or value >= low) and (high is None or value <= high)
        conditions = (
            (LOWER, w >= 0 and value == low),
            (BASIC, w == 0 and is_within),
            (UPPER, w <= 0 and high is not None and value == high),
        )
        statuses.append(tuple(WORDS[state] for state, holds in conditions if holds))
    return tuple(statuses)


def combined(
    pieces: Sequence[Piece],
    positions: Sequence[Sequence[int]],
    n: int,
    check: Callable[[], None],
) -> Piece:
    """Return the product of pieces of independent blocks, with these indices among n;
    `check` may raise.
    """
    zero: list[Any] = zeros(n)

    def put(parts: Iterable[tuple[Sequence[int], Sequence[Any]]]) -> tuple[Any, ...]:
        check()
        z = list(zero)
        for indices, part in parts:
            for i, value in zip(indices, part, strict=True):
                z[i] = value
        return tuple(z)

    pairs = list(zip(positions, pieces, strict=True))
    return Piece(
        tuple(
            put(zip(positions, chosen, strict=True))
            for chosen in product(*(piece.vertices for piece in pieces))
        ),
        tuple(put([(indices, ray)]) for indices, piece in pairs for ray in piece.rays),
        tuple(
            put([(indices, line)]) for indices, piece in pairs for line in piece.lines
        ),
        put((indices, piece.states) for indices, piece in pairs),
    )


def _short(point: RationalPoint) -> str:
    """Return a point in a short form; most of many numbers are omitted."""
    return f"({', '.join(_elided([brief(value) for value in point]))})"


def _elided(parts: list[str]) -> list[str]:
    """Return texts, of many only the first ones and the last."""
    return (
        parts
        if len(parts) <= SHOWN_PARTS
        else [*parts[: SHOWN_PARTS - 1], "...", parts[-1]]
    )


def pieces(data: ExactProblem, check: Callable[[], None]) -> Iterator[Piece]:
    """Yield every maximal piece of the solution set once. Those of a bimatrix game with
    few vertices are combined from these. Other problems are searched by branch and
    bound; if this does not end soon, the vertices of a game are enumerated after all,
    unless there are too many. It does not begin with them, as no piece is known before
    all vertices are.

    `check` is called before each step and may raise.
    """
    m = _strategies(data)
    entries = 0

    def check_and_count() -> None:
        nonlocal entries
        entries += data.n**2
        check()

    late: list[Callable[[], Piece | None]] = []
    branches = _by_branches(data, m, late, check_and_count)
    yielded = set[frozenset[RationalPoint]]()
    subsets = nash_subsets(data, m, MAX_VERTICES_AT_FIRST, check)
    if subsets is None:
        for piece in branches:
            if piece is not None:
                yielded.add(frozenset(piece.vertices))
                yield piece
            if entries > ENTRIES_AT_FIRST:
                break
        else:
            if not late:
                return
        subsets = nash_subsets(data, m, MAX_VERTICES, check)
    if subsets is None:
        yield from filter(None, branches)
        yield from filter(None, (piece_of_node() for piece_of_node in late))
        return
    by_vertices = _by_vertices(data, subsets, check)
    yield from (
        piece for piece in by_vertices if frozenset(piece.vertices) not in yielded
    )


def _by_vertices(
    data: ExactProblem,
    subsets: Iterable[Iterable[RationalPoint]],
    check: Callable[[], None],
) -> Iterator[Piece]:
    """Yield the pieces with these vertices."""
    remembered = lru_cache(MAX_REMEMBERED)(partial(states_of, data))
    for subset in subsets:
        vertices, statuses = [], []
        for vertex in subset:
            check()
            vertices.append(vertex)
            statuses.append(remembered(vertex))
        yield Piece.of(statuses, tuple(vertices))


def _by_branches(
    data: ExactProblem,
    m: int,
    late: list[Callable[[], Piece | None]],
    check: Callable[[], None],
) -> Iterator[Piece | None]:
    """Yield the pieces in the order in which branch and bound finds them, and None
    after each other node.

    m : the number of strategies of the row player of a game; otherwise 0. late : to it
    a function is appended that returns a piece for each one that takes many bases.
    """
    shape = shape_of(data, check)
    # A bimatrix game is known to have a solution.
    is_quick = data.n <= MAX_FOR_TREE or not (shape or m)
    z = None if is_quick else _solution(data, check)
    if z is not None and shape == POINT:
        yield Piece.of([states_of(data, tuple(z))], (tuple(z),))
        return
    unknowns = Unknowns(data, check)
    # Branching on the last statuses first takes fewer nodes if there are many pieces.
    unknowns.allow([statuses[::-1] for statuses in unknowns.choices])
    root = unknowns.root()
    if root is None:
        return
    starts = [root.copy(), root.copy()]
    if z is not None:
        statuses = states_of(data, tuple(z))
        bits = sum(
            bit
            for bit, (k, state) in unknowns.meaning.items()
            if WORDS[state] in statuses[k]
        )
        _choose_common(unknowns, starts[0], bits)
    max_bases = math.inf if shape and not m else MAX_BASES_AT_FIRST

    @lru_cache(MAX_REMEMBERED)
    def states_at(values: Direction) -> tuple[RationalPoint, Words]:
        vertex = unknowns.vertex(values)
        return vertex, states_of(data, vertex)

    for leaf, is_leaf in chain.from_iterable(
        explored(unknowns, [start]) for start in starts[z is None :]
    ):
        if not is_leaf:
            yield None
            continue
        node, common = _largest(unknowns, root, leaf)
        unknowns.cover.add(common)
        piece = _listed(unknowns, node, states_at, max_bases)
        if piece is None:
            late.append(partial(_listed, unknowns, node, states_at))
        yield piece
        if shape:
            return


def _listed(
    unknowns: Unknowns,
    node: Node,
    states_at: Callable[[Direction], tuple[RationalPoint, Words]],
    max_bases: float = math.inf,
) -> Piece | None:
    """Return the piece of a node, or None if it takes more than `max_bases` bases."""
    listed = generators(node.dictionary, range(unknowns.n), max_bases)
    if listed is None:
        return None
    points, *others = listed
    rays, lines = (tuple(map(unknowns.direction, each)) for each in others)
    directions = [*rays, *lines, *(tuple(-value for value in line) for line in lines)]
    statuses = [
        states_of(unknowns.data, each, is_direction=True) for each in directions
    ]
    vertices = []
    for values in points:
        unknowns.check()
        vertex, vertex_states = states_at(values)
        vertices.append(vertex)
        statuses.append(vertex_states)
    return Piece.of(statuses, tuple(vertices), rays, lines)


def _largest(unknowns: Unknowns, root: Node, node: Node) -> tuple[Node, int]:
    """Return a maximal node that contains a node of solutions, and the statuses that
    hold on it, as bits. Every node with these statuses contains it, so that any leaf
    with them that does not lie in it is larger.
    """
    while True:
        common = unknowns.common_states(node)
        larger = None
        if any((common & mask).bit_count() > 1 for mask in unknowns.masks):
            start = root.copy()
            _choose_common(unknowns, start, common)
            larger = next(unknowns.restricted(common).leaves(start), None)
        if larger is None:
            return node, common
        node = larger


def _choose_common(unknowns: Unknowns, node: Node, bits: int) -> None:
    """Choose the status of each unknown with only one status among these bits; the node
    must have solutions with these statuses.
    """
    for k, mask in enumerate(unknowns.masks):
        if (bits & mask).bit_count() == 1 and node.statuses[k] is None:
            chosen = unknowns.choose(node, *unknowns.meaning[bits & mask])
            assert chosen


def _solution(data: ExactProblem, check: Callable[[], None]) -> list[Fraction] | None:
    """Return an exact solution: the one close to a solution in floating-point
    arithmetic, or else the last vertex of Lemke's path in rational arithmetic; None
    if neither is reached.
    """
    with imports:
        from lcpcli.rational import pivoting
        from lcpcli.solving import driver
        from lcpcli.solving.result import Status
        from lcpcli.verify.exact_solution import from_point
    result = driver.run(data.problem, "auto", observe=lambda *_: check())
    if result.interrupted:
        raise KeyboardInterrupt
    if result.status is Status.TIME_LIMIT and remaining() > 0:
        raise TimeIsUp  # by `check`
    effort = elimination.Effort()
    z = from_point(data, result.z, effort) if result.solved else None
    return z or pivoting.solve(data, effort)


def shape_of(data: ExactProblem, check: Callable[[], None]) -> str:
    """Return what the solution set is proved to be at most: POINT, PIECE or, if nothing
    is proved, "".
    """
    if m := _strategies(data):
        return PIECE if _is_constant_sum(data, m) else ""
    common, doubles = math.lcm(*data.scales), matrices.dense(data.problem.M)
    scaled_rows = zip(
        data.rows, (common // scale for scale in data.scales), strict=True
    )
    # A multiple of M in integers.
    M = [[row.get(j, 0) * k for j in range(data.n)] for row, k in scaled_rows]
    indices = _strong_parts(data) if all(M[i][i] > 0 for i in range(data.n)) else []
    parts = [
        ([[M[i][j] for j in part] for i in part], doubles[np.ix_(part, part)])
        for part in indices
    ]
    if parts and all(_is_dominant(*part) for part in parts):
        return POINT
    definiteness = elimination.definiteness(elimination.symmetrized(M), check)
    if definiteness.negative is None:
        return PIECE if definiteness.zero else POINT
    if not parts or data.n <= MAX_WITHOUT_THEOREM:
        return ""
    return (
        POINT
        if all(_is_dominant(*part) or _is_definite(*part, check) for part in parts)
        else ""
    )


def _strategies(data: ExactProblem) -> int:
    """Return the number m of the row player's strategies if the solutions are the
    equilibria of a bimatrix game: M = [0 R; C' 0] with m rows, R > 0 and C > 0, q < 0
    and z >= 0; otherwise 0.
    """
    n, m = data.n, min(data.rows[0], default=0)
    if not m or max(data.constants) >= 0 or any(data.lower):
        return 0
    if any(high is not None for high in data.upper) or None in data.lower:
        return 0
    others = [range(m, n) if i < m else range(m) for i in range(n)]
    is_game = all(
        len(row) == len(other) and min(row) == other[0] and max(row) == other[-1]
        for row, other in zip(data.rows, others, strict=True)
    )
    return m if is_game and all(min(row.values()) > 0 for row in data.rows) else 0


def _is_constant_sum(data: ExactProblem, m: int) -> bool:
    """Return whether the costs of both players have the same sum everywhere, after
    scaling the rows to q = -1. m : the number of strategies of the row player.
    """
    sums = (
        Fraction(data.rows[i][j], -data.constants[i])
        + Fraction(data.rows[j][i], -data.constants[j])
        for i in range(m)
        for j in range(m, data.n)
    )
    first = next(sums)
    return all(each == first for each in sums)


def _is_definite(M: Rows, doubles: Vector, check: Callable[[], None]) -> bool:
    """Return whether diag(d) M is positive definite for some d > 0 (G. W. Cross, Lin.
    Alg. Appl. 20 (1978) 253-263)."""
    for d in filter(None, map(_whole, row_scalings(doubles))):
        S = elimination.symmetrized(
            [[v * a for a in row] for v, row in zip(d, M, strict=True)]
        )
        definiteness = elimination.definiteness(S, check)
        if definiteness.zero is None and definiteness.negative is None:
            return True
    return False


def _is_dominant(M: Rows, doubles: Vector) -> bool:
    """Return whether M_ii d_i > sum of |M_ij| d_j over j != i, for some d > 0, which is
    computed in floating point and verified in integers.
    """

    def is_dominant(proposed: Vector) -> bool:
        d = _whole(proposed)
        return all(
            2 * row[i] * d[i] > sum(abs(a) * v for a, v in zip(row, d, strict=True))
            for i, row in enumerate(M)
        )

    return scaling(doubles, is_dominant) is not None


def _whole(d: Vector) -> list[int]:
    """Return numbers multiplied by a common factor and rounded down to integers; an
    empty list if they are not all positive and finite.
    """
    if not (np.isfinite(d).all() and d.min() > 0):
        return []
    values = fractions_of(d)
    unit = min(values) / 2**MULTIPLIER_BITS
    return [int(value / unit) for value in values]


def _strong_parts(data: ExactProblem) -> list[Sequence[int]]:
    """Return the unknowns of each strongly connected component of M; all unknowns of a
    small problem, for which scipy is not loaded.
    """
    if data.n <= MAX_WITHOUT_THEOREM:
        return [range(data.n)]
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import connected_components
    pattern = np.zeros((data.n, data.n))
    for i, row in enumerate(data.rows):
        pattern[i, list(row)] = 1
    count, part = connected_components(csr_array(pattern), connection="strong")
    return [np.flatnonzero(part == k).tolist() for k in range(count)]
