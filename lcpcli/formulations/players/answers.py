"""What a z says about a game of players with quadratic costs: what each player does,
its cost, and what it would gain by a best response, which is computed by solving the
problem of that player alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.enumeration.meaning import MeaningToPlayers, Values
from lcpcli.formulations.equilibria import PER_UNKNOWN, Profile
from lcpcli.formulations.players.quadratic import Players
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import YES
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.matrices import absolute_product, dense, product
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.options import TOL
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import brief, rounded, zeros
from lcpcli.report import wording
from lcpcli.solving import driver
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify import blocks as verification
from lcpcli.verify.verification import Proposed, Verification


@dataclass(frozen=True, eq=False)
class PlayersEquilibrium(Profile):
    """What the players do.

    players : their names.
    x : shape (k,), the unknowns of all players; None if the conditions are not solved,
        as are strategies, costs and y.
    strategies : the parts of x that belong to each player.
    costs : the cost of each player.
    gains : by how much a best response of each player, within its constraints and with
        the others as they are, would lower its cost; 0 if that is only rounding error
        or if z is proved, infinite if its cost is unbounded below, nan if that is not
        decided.
    statement : whether x is an equilibrium, or that this is not decided.
    y : the multipliers of the rows; a row with several multipliers has them one after
        the other.
    exact : strategies and costs as fractions if z is proved, otherwise None.
    """

    players: Sequence[str]
    x: Vector | None
    strategies: Sequence[Any] | None
    costs: tuple[Any, ...] | None
    gains: tuple[Any, ...]
    statement: str = ""
    y: Vector | None = None
    exact: Mapping[str, Any] | None = None
    columns: Sequence[Sequence[str]] = field(default=(), repr=False)

    def record(self) -> Mapping[str, Any]:
        names = ("players", "x", "strategies", "costs", "gains", "statement", "y")
        return {name: getattr(self, name) for name in (*names, "exact")}

    def lines(self) -> list[str]:
        if self.x is None:
            return [self.statement]
        shown: Any = self.exact or {"strategies": self.strategies, "costs": self.costs}
        cell = brief if self.exact else wording.plain_number
        parts = zip(self.players, shown["strategies"], self.columns, strict=True)
        lines = [f"{who} = {wording.named(list(x), of, cell)}" for who, x, of in parts]
        pairs = zip(self.players, shown["costs"], strict=True)
        costs = ", ".join(f"{who} {cell(cost)}" for who, cost in pairs)
        return [*lines, f"costs: {costs}", self.statement]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        if self.x is None:
            return {"player": (), "cost": ()}
        shown: Any = self.exact or {"strategies": self.strategies, "costs": self.costs}
        rows = [
            (who, cost)
            for who, part, cost in zip(
                self.players, shown["strategies"], shown["costs"], strict=True
            )
            for _ in part
        ]
        return dict(zip(("player", "cost"), zip(*rows, strict=True), strict=True))


class _BestResponse(NamedTuple):
    """gain : what a player would gain by it; infinite if its cost is unbounded below,
    nan if that is not decided. terms : the sum of the sizes of the terms of which the
    gain is computed."""

    gain: float
    terms: float


UNDECIDED = _BestResponse(math.nan, math.inf)


class _Examination:
    """The players at a point x, in floating-point numbers.

    blocks : the problem of the game. g, sizes : the gradients of the costs, and the
        sums of the sizes of their terms. tolerance : up to this, relative to its terms,
        a gain is tolerated.
    """

    def __init__(self, game: Players, problem: Problem, x: Vector, tol: float) -> None:
        blocks = game.blocks(conditions_of(problem))
        assert blocks is not None
        self.game = game
        self.blocks = blocks
        self.x = x
        self.g = product(blocks.Q, x) + blocks.c
        self.sizes = absolute_product(blocks.Q, np.abs(x)) + np.abs(blocks.c)
        self.tolerance = max(PER_UNKNOWN * x.size * tol, ROW_ROUNDING)

    def profile(self, is_proved: bool) -> tuple[PlayersEquilibrium, bool | None]:
        """Return what the players do, and whether no gain exceeds the tolerance, None
        if that is not decided.

        is_proved : whether x and multipliers satisfy the conditions exactly, so that a
            player with a convex cost gains nothing.
        """
        game, x = self.game, self.x
        parts = game.parts_of_players()
        costs = list[float]()
        gains = list[float]()
        is_refuted = False
        for player, part in enumerate(parts):
            H = dense(self.blocks.Q[part, part])
            costs.append(float(x[part] @ self.g[part] - x[part] @ H @ x[part] / 2))
            if is_proved and definiteness(H).semidefinite == YES:
                gains.append(0.0)
                continue
            gain, terms = self.best(player, part, costs[-1])
            gains.append(0.0 if gain <= ROW_ROUNDING * terms else gain)
            is_refuted |= gain > self.tolerance * terms
        is_decided = is_refuted or not any(map(math.isnan, gains))
        is_best = not is_refuted if is_decided else None
        profile = PlayersEquilibrium(
            game.names_of_players(),
            x,
            [x[part] for part in parts],
            tuple(costs),
            tuple(gains),
            columns=[game.columns[part] for part in parts],
        )
        return replace(profile, statement=profile.verdict(is_best)), is_best

    def best(self, player: int, part: slice, cost: float) -> _BestResponse:
        """Return the best response of a player with this cost to the decisions of the
        others."""
        blocks, copies, x = self.blocks, self.game.copies, self.x
        H, numbers = dense(blocks.Q[part, part]), [i for i, _ in copies]
        rows = [
            numbers.index(i)
            for i, owner in enumerate(self.game.owner)
            if owner in (None, player)
        ]
        A, c = dense(blocks.A[rows])[:, part], self.g[part] - H @ x[part]
        own_terms, all_of_it = A @ x[part], product(blocks.A[rows], x)
        others, matters = all_of_it - own_terms, A.any(axis=1)
        # x is feasible up to rounding; the row bounds are widened to make it feasible.
        sides = (
            np.minimum(blocks.row_lower[rows] - others, own_terms)[matters],
            np.maximum(blocks.row_upper[rows] - others, own_terms)[matters],
        )
        bounds = blocks.lower[part], blocks.upper[part]
        alone = Blocks(H, c, A[matters], *sides, *bounds)
        M, q, low, high = alone.conditions()
        result = driver.run(Problem(M, q, lower=low, upper=high), "auto")
        if result.status.has_no_solution:
            return self.without_minimum(part, c, result)
        if not result.solved:
            return UNDECIDED
        best_x, y = np.split(result.z[: c.size + sides[0].size], [c.size])
        sizes = np.maximum(np.abs(x[part]), np.abs(best_x))
        # Rounding of an active row changes the cost by its multiplier times this.
        of_rows = absolute_product(blocks.A[rows], np.abs(x)) + np.abs(A) @ sizes
        terms = sizes @ self.sizes[part] + np.abs(y) @ of_rows[matters]
        return _BestResponse(cost - float(best_x @ (H @ best_x / 2 + c)), float(terms))

    def without_minimum(self, part: slice, c: Vector, result: Result) -> _BestResponse:
        """Return that a cost with the linear part c is unbounded below, unless its
        slope in the direction of the proof may be the rounding of x or of its terms.
        """
        proof = result.certificate
        if proof is None or proof.vector is None:
            return UNDECIDED
        direction = proof.vector[: c.size]
        terms = np.abs(direction) @ self.sizes[part]
        if not -(c @ direction) > self.tolerance * terms:
            return UNDECIDED
        return _BestResponse(math.inf, float(terms))


@np.errstate(all="ignore")
def answer(game: Players, result: Result) -> PlayersEquilibrium:
    names = game.names_of_players()
    if not result.solved:
        return PlayersEquilibrium(names, None, None, None, (), UNSOLVED)
    x, y = game.parts(result.z + 0.0)
    is_proved = result.exact is not None and result.exact.status is Status.SOLVED
    profile, _ = _Examination(game, result.problem, x, result.tol).profile(is_proved)
    exact = None
    if result.exact is not None and result.exact.z is not None:
        exact_x = game.parts(result.exact.z)[0]
        data = ExactProblem.of_decimals(result.problem)
        strategies = [list(exact_x[part]) for part in game.parts_of_players()]
        exact = {"strategies": strategies, "costs": costs_at(game, data, exact_x)}
    return replace(profile, y=y, exact=exact)


UNSOLVED = "not solved, so there is no equilibrium"


def verified(game: Players, proposed: Proposed) -> Verification:
    """Verify z, x and y, or x alone, for which multipliers are sought; and compute what
    the players would gain by best responses.
    """
    verification_of_x = verification.verified(game, proposed)
    x = rounded(map(Fraction, proposed.values))[: game.variables]
    is_solution = verification_of_x.accepted
    profile, is_best = _Examination(
        game, proposed.problem, x, proposed.tol or TOL.value
    ).profile(is_solution and verification_of_x.exact)
    joint = (
        "; as strategies, "
        if is_best in (None, is_solution)
        else ", but as strategies, "
    )
    message = f"{verification_of_x.message}{joint}{profile.statement}"
    return replace(verification_of_x, message=message, strategies=profile)


def costs_at(
    game: Players, data: ExactProblem, x: Sequence[Fraction]
) -> list[Fraction]:
    """Return the costs of all players in fractions."""
    rows, costs = data.M[: game.variables], list[Fraction]()
    constants = data.w(zeros(data.n))
    for part in game.parts_of_players():
        indices = range(part.start, part.stop)
        total = Fraction(0)
        for i in indices:
            terms = (
                a * x[j] / (2 if j in indices else 1)
                for j, a in rows[i].items()
                if j < game.variables
            )
            total += x[i] * (constants[i] + sum(terms, Fraction(0)))
        costs.append(total)
    return costs


class Costs(MeaningToPlayers):
    """What solutions mean: the costs of the players."""

    heading = "cost of {}"

    def at_vertex(self, z: Values) -> tuple[Values, Sequence[Any]]:
        return z, costs_at(self._game, self.data, z)

    def equilibrium(self, z: Values) -> dict[str, Any]:
        strategies = [list(z[part]) for part in self._game.parts_of_players()]
        costs = costs_at(self._game, self.data, z)
        return {"strategies": strategies, "costs": costs}

    def best(
        self,
        z: Values,
        cell: Callable[[Fraction], str],  # noqa: ARG002
    ) -> tuple[list[str], list[Any]]:
        costs = costs_at(self._game, self.data, z)
        pairs = zip(self._players, costs, strict=True)
        return [
            f"costs: {', '.join(f'{who} {brief(cost)}' for who, cost in pairs)}"
        ], []
