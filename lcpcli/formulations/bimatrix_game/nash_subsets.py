"""All equilibria of a game: the extreme ones, the maximal Nash subsets that they span,
and the components of these.

The pieces of the LCP of a game are its maximal Nash subsets, all convex combinations of
some strategies of each player, and their vertices its extreme equilibria; subsets that
share one of these form one component (D. Avis, G. Rosenberg, R. Savani and B. von
Stengel, Enumeration of Nash equilibria for two-player games, Economic Theory 42 (2010)
9-37).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.enumeration.meaning import (
    Arrangement,
    InPayoffs,
    Listing,
    Meaning,
    Payoff,
    Values,
)
from lcpcli.enumeration.pieces import Piece
from lcpcli.errors import count
from lcpcli.formulations.bimatrix_game.game import Game
from lcpcli.formulations.bimatrix_game.strategies import (
    PLAYERS,
    lines_of,
    names_of,
    payoff_headings,
)
from lcpcli.linalg.patterns import connected
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.dictionary import RationalPoint, Vertex
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import over_one_denominator, zeros
from lcpcli.report import wording
from lcpcli.report.result_formats import plain

MEANS = (
    "any average of the row strategies of one with any of its column strategies is an "
    "equilibrium"
)
HEADER = ("equilibrium", "player", "strategy", "probability", "payoff")


@dataclass(frozen=True)
class ExactEquilibrium:
    """An extreme equilibrium.

    row, column : the strategies, exact probabilities. payoffs : the payoffs of the row
        and the column player.
    pure : whether both players play one strategy only.
    index : 1 or -1; None if the game is degenerate there: a strategy has more pure best
        replies than its support has elements. If no equilibrium is degenerate, the
        indices of all add up to 1.
    """

    row: RationalPoint
    column: RationalPoint
    payoffs: tuple[Fraction, Fraction]
    pure: bool
    index: int | None = None


@dataclass(frozen=True)
class NashSubset:
    """A maximal Nash subset: all convex combinations of these strategies of each
    player, in any pairing; and the extreme equilibria that its strategies form, counted
    from 0."""

    rows: tuple[RationalPoint, ...]
    columns: tuple[RationalPoint, ...]
    extreme: tuple[int, ...]


@dataclass(frozen=True)
class Equilibria:
    """The equilibria of a two-player game, as far as they are known.

    extreme : the extreme equilibria. subsets : the maximal Nash subsets, each of them
        complete; if all are listed, their union is the set of equilibria. complete :
        whether they are proved to be all. components : which subsets are connected,
        counted from 0; None if there may be others, which might connect them.
        is_degenerate : whether the game is degenerate at an equilibrium (see
        `ExactEquilibrium`), which then need not be isolated; None if not known.
    """

    extreme: tuple[ExactEquilibrium, ...]
    subsets: tuple[NashSubset, ...]
    components: tuple[tuple[int, ...], ...] | None
    is_degenerate: bool | None
    complete: bool

    @classmethod
    def of(
        cls,
        extreme: Sequence[ExactEquilibrium],
        subsets: Sequence[Sequence[int]],
        complete: bool,
    ) -> Equilibria:
        """Return the equilibria with these extreme ones; each subset consists of the
        indices of its extreme equilibria.
        """
        maximal = tuple(
            NashSubset(
                tuple(dict.fromkeys(extreme[k].row for k in part)),
                tuple(dict.fromkeys(extreme[k].column for k in part)),
                tuple(part),
            )
            for part in subsets
        )
        is_degenerate = False if complete else None
        if any(each.index is None for each in extreme):
            is_degenerate = True
        first: dict[int, int] = {}
        edges = [
            (first.setdefault(shared, k), k)
            for k, part in enumerate(subsets)
            for shared in part
        ]
        components = None
        if complete:
            components = tuple(map(tuple, connected(len(maximal), edges)))
        return cls(tuple(extreme), maximal, components, is_degenerate, complete)


class Players(Meaning):
    """The players of a game, with the equilibria that solutions of its LCP
    represent.
    """

    def __init__(self, data: ExactProblem, game: Game) -> None:
        super().__init__(data)
        self._game, self._rows = game, len(game.A)
        self._constants = game.cost_constants()
        self._found: dict[RationalPoint, ExactEquilibrium] = {}
        # Each strategy is stored once, as many equilibria may share it.
        self._strategies: dict[Vertex, Vertex] = {}

    def payoffs(self) -> Mapping[str, Payoff]:
        """Return the payoffs in terms of the costs u and v, the last unknowns of
        `in_payoffs`.
        """
        unknowns = (self.data.n, self.data.n + 1)
        return {
            player: Payoff(i, Fraction(1), constant)
            for player, i, constant in zip(
                PLAYERS, unknowns, self._constants, strict=True
            )
        }

    def in_payoffs(self) -> InPayoffs:
        """Return the problem whose unknowns are the strategies x and y, instead of x /
        v and y / u, and the costs u and v of the row and the column player:

        0 <= x,  R y - u e >= 0,  u free,  e'x = 1, 0 <= y,  C'x - v e >= 0,  v free,
        e'y = 1.
        """
        m, n = self._rows, self.data.n
        costs, one = (n, n + 1), Fraction(1)
        rows = [{**row, costs[i >= m]: -one} for i, row in enumerate(self.data.M)]
        rows += [dict.fromkeys(part, one) for part in (range(m), range(m, n))]
        M = np.zeros((n + 2, n + 2))
        for i, row in enumerate(rows):
            M[i, list(row)] = list(map(float, row.values()))
        q, free = np.repeat([0.0, -1.0], [n, 2]), np.repeat([0.0, -np.inf], [n, 2])
        data = ExactProblem(
            Problem(M, q, lower=free, upper=np.full(n + 2, np.inf)),
            rows,
            list(map(Fraction, q.tolist())),
            [*zeros(n), None, None],
        )

        def z_of(solution: Values) -> list[Fraction]:
            *both, u, v = solution
            return [value / (v if i < m else u) for i, value in enumerate(both)]

        return InPayoffs(data, z_of)

    def take(
        self, vertices: Sequence[RationalPoint], check: Callable[[], None]
    ) -> None:
        """Compute the equilibria of extreme solutions."""
        for z in vertices:
            if z not in self._found:
                check()
                self._found[z] = self._equilibrium(z)

    def equilibrium(self, z: Values) -> ExactEquilibrium:
        equilibrium = self._found.get(tuple(z))
        return self._equilibrium(z) if equilibrium is None else equilibrium

    def best(
        self, z: Values, cell: Callable[[Fraction], str]
    ) -> tuple[list[str], list[Any]]:
        return lines_of(self._game, self.equilibrium(z), cell), []

    def arranged(self, pieces: Sequence[Piece], complete: bool) -> EquilibriaInOrder:
        return EquilibriaInOrder(self._game, self._found, pieces, complete)

    def _equilibrium(self, z: Values) -> ExactEquilibrium:
        """Return the equilibrium of the strategies in z; best replies have w = 0, and
        payoffs follow from the sums of z.
        """
        m, (r, c) = self._rows, self._constants
        x, y = (
            self._strategies.setdefault(strategy, strategy)
            for strategy in map(_strategy, (z[:m], z[m:]))
        )
        replies = [i for i, value in enumerate(self.data.w(z)) if not value]
        rows, columns = [i for i in replies if i < m], [j for j in replies if j >= m]
        is_regular = replies == [i for i, value in enumerate(z) if value] and len(
            rows
        ) == len(columns)
        payoffs = r - 1 / sum(z[m:], Fraction(0)), c - 1 / sum(z[:m], Fraction(0))
        index = self._index(rows, columns) if is_regular else None
        return ExactEquilibrium(x, y, payoffs, max(x) == 1 == max(y), index)

    def _index(self, rows: Sequence[int], columns: Sequence[int]) -> int:
        """Return the index: the sign of the determinants of the costs on the supports,
        times -1 for each strategy but one in the supports (L. S. Shapley, Mathematical
        Programming Study 1 (1974) 175-189, where the determinants are of positive
        payoffs, each with that factor); 1 for a pure equilibrium.
        """
        M, pairs = self.data.rows, ((rows, columns), (columns, rows))
        costs = (
            [[M[i][j] for j in others] for i in indices] for indices, others in pairs
        )
        first, second = (elimination.determinant(each) > 0 for each in costs)
        return 1 if (len(rows) % 2 == 1) == (first == second) else -1


class EquilibriaInOrder(Arrangement):
    """Pieces and their vertices in the order of their equilibria. equilibria : the
    equilibrium of each vertex.
    """

    equilibria: Equilibria

    def __init__(
        self,
        game: Game,
        equilibria: Mapping[RationalPoint, ExactEquilibrium],
        pieces: Sequence[Piece],
        complete: bool,
    ) -> None:
        self._game = game
        points = sorted(
            {z for piece in pieces for z in piece.vertices},
            key=lambda z: (equilibria[z].row, equilibria[z].column),
            reverse=True,
        )
        position = {z: k for k, z in enumerate(points)}
        pieces_in_order = [
            replace(
                piece, vertices=tuple(sorted(piece.vertices, key=position.__getitem__))
            )
            for piece in pieces
        ]
        pieces_in_order.sort(key=lambda piece: [position[z] for z in piece.vertices])
        super().__init__(pieces_in_order, complete)
        self.points = points
        self.equilibria = Equilibria.of(
            [equilibria[z] for z in points],
            [[position[z] for z in piece.vertices] for piece in pieces_in_order],
            complete,
        )

    def count(self) -> str:
        held = self.equilibria
        extreme = len(held.extreme)
        if len(self.pieces) == sum(piece.is_point for piece in self.pieces):
            return f"{extreme} {'equilibrium' if extreme == 1 else 'equilibria'}"
        joined = ""
        if held.components is not None:
            joined = f" in {count(len(held.components), 'component')}"
        return (
            f"infinitely many equilibria: {extreme} extreme ones, "
            f"{count(len(held.subsets), 'maximal Nash subset')}{joined}"
        )

    def record(self) -> dict[str, Any]:
        held = self.equilibria
        return {"components": held.components, "degenerate": held.is_degenerate}

    def table(
        self,
        kept_columns: Sequence[int],
        max_width: float,
        cell: Callable[[Fraction], str],
    ) -> Listing:
        """Return a row for each extreme equilibrium; the rows of a component form a
        group.
        """
        extreme, subsets = self.equilibria.extreme, self.equilibria.subsets
        names = names_of(self._game, max_width)
        is_indexed = any(each.index is not None for each in extreme)
        header = ["", *(names[i] for i in kept_columns), *payoff_headings(self._game)]
        header += ["index", "pure"] if is_indexed else ["pure"]

        def row(k: int) -> list[str]:
            each = extreme[k]
            probabilities = (*each.row, *each.column)
            numbers = map(
                cell, (*(probabilities[i] for i in kept_columns), *each.payoffs)
            )
            cells = [str(k + 1), *numbers]
            if is_indexed:
                cells.append("" if each.index is None else f"{each.index:+d}")
            return [*cells, "pure" if each.pure else ""]

        if all(len(subset.extreme) == 1 for subset in subsets):
            indices = [each.index or 0 for each in extreme]
            summed = self.complete and all(indices) and len(indices) > 1
            remarks = [f"the indices sum to {sum(indices)}"] if summed else []
            groups = [map(row, range(len(extreme)))]
            return Listing(header, groups, len(extreme), remarks)
        joined = self.equilibria.components
        parts = [range(len(subsets))] if joined is None else joined
        connected_ones = (
            map(row, sorted({k for s in part for k in subsets[s].extreme}))
            for part in parts
        )
        named = wording.vector(
            subsets,
            lambda subset: f"{{{', '.join(str(k + 1) for k in subset.extreme)}}}",
        )[1:-1]
        remark = f"maximal Nash subsets {named}: {MEANS}"
        return Listing(header, connected_ones, len(extreme), [remark])

    def cells(self, *, exact: bool) -> tuple[Sequence[str], Iterator[tuple[Any, ...]]]:
        """Return a row for each strategy in each extreme equilibrium: its probability,
        and the expected payoff of its player."""
        rows = (
            (number, player, i, probability, payoff)
            for number, each in enumerate(self.equilibria.extreme, 1)
            for player, payoff in zip(PLAYERS, plain(each.payoffs, exact), strict=True)
            for i, probability in enumerate(plain(getattr(each, player), exact), 1)
        )
        return HEADER, rows


def _strategy(multiple: Sequence[Fraction]) -> Vertex:
    """Return a multiple of a strategy divided by its sum."""
    weights, _ = over_one_denominator(multiple)
    total = sum(weights)
    return Vertex(Fraction(weight, total) for weight in weights)
