"""Farkas' lemma by linear programs: either a point that satisfies a system of
inequalities, or multipliers that may prove that there is none.

The system is A z + b >= 0 with z >= 0, or with bounds on z and the corresponding signs
of A z + b. A small dense system is first solved by a dual simplex method. Otherwise up
to three linear programs yield candidates for the multipliers y, as floating-point
solutions need not be proofs: y of minimal total, y from the elastic program, which
minimizes the sum of violations, and y with large margins. `farkas.refutes` verifies
them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.basis.dual_simplex import MARGIN, MAX_DENSE, DualSimplex
from lcpcli.linalg.matrices import is_sparse, stack, unit_columns
from lcpcli.linalg.programs import Optimum, minimized
from lcpcli.model.box import ORTHANT, Box
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector
from lcpcli.verify.farkas import SNAP, sides

# One candidate is y rounded to multiples of its largest entry divided by this.
GRID = 2.0**20
# Once a y is known, linear programs for better ones may take this many times the effort
# of the first one.
PATIENCE = 4
# Rows or columns up to which a dense dictionary takes less time than an LP solver for
# any problem.
MAX_DENSE_DICTIONARY_SIZE = 100
# Multiples of the largest |A_ij| that are added to the nonzero A_ij, such that a proof
# for the larger matrix remains one when y is rounded.
ENTRY_MARGINS = 0.3, 0.1, 0.03, 0.01, 0.001
LARGEST_SHIFT = 1000  # b is multiplied by at most 2^1000, which is finite


class Alternative(NamedTuple):
    """The result of Farkas' lemma: a point z with A z + b >= 0, z >= 0 up to the
    tolerance of the LP solver, which proves nothing, or a proof y; both are None if
    neither was established.

    approximate_proofs : then the multipliers that are no proofs as computed, but may be
        up to rounding.
    system : the dual simplex method that computed the point, or None.
    """

    point: Vector | None
    proof: Vector | None
    approximate_proofs: Sequence[Vector] = ()
    system: DualSimplex | None = None


def alternative(
    A: Matrix, b: Vector, holds: Callable[[Vector], bool], effort: float = math.inf
) -> Alternative:
    """Return a point with A z + b >= 0, z >= 0, or a proof that there is none, by at
    most three linear programs, each with at most half of the effort; a small dense
    system is first solved by a dual simplex method, which takes less time.

    A : should be equilibrated; nothing is established unless it is finite. holds :
        whether a y is a proof.
    """
    near_proofs = list[Vector]()
    for result in _searched(A, b, ORTHANT, effort, MAX_DENSE):
        if result.proof is None or holds(result.proof):
            return result
        near_proofs.append(result.proof)
    return Alternative(None, None, near_proofs)


def farkas_multipliers(problem: Problem, effort: float = math.inf) -> Iterator[Vector]:
    """Yield vectors y that may prove that a problem is infeasible, the most likely
    first; none if the problem is feasible to the tolerance of the LP solver. At most
    three linear programs, each with half of the effort, are solved for the equilibrated
    problem R M C, R q, whose multipliers y' yield y = R y'.
    """
    with np.errstate(all="ignore"):
        units = scale(problem)
    inner = units.problem
    for result in _searched(
        inner.M, inner.q, inner.box, effort, MAX_DENSE_DICTIONARY_SIZE
    ):
        if result.proof is not None:
            yield units.multipliers(result.proof)


def _searched(
    A: Matrix, b: Vector, box: Box, effort: float, max_dense_size: int
) -> Iterator[Alternative]:
    """Yield multipliers y that may be proofs, the most likely first, and finally a
    point if one is computed.

    max_dense_size : rows or columns up to which a dense system is first solved by a
        dictionary.
    """
    if not _are_finite(A, b):
        return
    if box.is_orthant and not is_sparse(A) and max(A.shape) <= max_dense_size:
        for system, point, y in dictionaries(A, b):
            if point is not None:
                yield Alternative(point, None, system=system)
                return
            yield from (
                Alternative(None, each) for each in (*reversed([*simplest(y)]), y)
            )
    programs = FarkasSystem(A, b, box, effort)
    if not programs.is_finite or (programs.low & programs.high).all():
        return
    if (first := programs.least_total()) is not None and first.value > -0.5:
        yield Alternative(
            np.ldexp(np.maximum(-first.y[:-1], 0.0), programs.power), None
        )
        return
    yield from (
        Alternative(None, each)
        for y in programs.multipliers(first)
        for each in (*simplest(y), y)
    )


def _are_finite(A: Matrix, b: Vector) -> bool:
    """Return whether A and b are finite, and the sum of A does not overflow."""
    return bool(np.isfinite(b).all() and np.isfinite(A.sum()))


# Without it: y of random M in two unknowns is no vector of integers.
def with_margin(problem: Problem) -> Iterator[Vector]:
    """Yield multipliers that prove that a small LCP is infeasible even with larger
    entries of M, so that they remain proofs when they are rounded.
    """
    if (
        not problem.box.is_orthant
        or is_sparse(problem.M)
        or problem.n > MAX_DENSE_DICTIONARY_SIZE
    ):
        return
    with np.errstate(all="ignore"):
        units = scale(problem)
        A, b = units.problem.M, units.problem.q
        size = np.where(A, np.abs(A).max(initial=0.0), 0.0)
    if _are_finite(A, b):
        for margin in ENTRY_MARGINS:
            if (
                y := DualSimplex(A + margin * size, b, margin=0.0).feasible()
            ) is not None and (y > 0).any():
                yield units.multipliers(np.maximum(y, 0.0))


def dictionaries(
    A: Matrix, b: Vector
) -> Iterator[tuple[DualSimplex, Vector | None, Vector]]:
    """Yield the results of the dual simplex method for a dense A, once with a margin
    for rounding and once without: the method, a point or None, and multipliers.
    """
    for margin in (MARGIN, 0.0):
        simplex = DualSimplex(A, b, margin)
        y = simplex.feasible()
        point = simplex.point() if y is None else None
        multipliers = np.maximum(0 * b if y is None else y, 0.0)
        yield simplex, None if point is None else np.maximum(point[0], 0.0), multipliers


class FarkasSystem:
    """The system of A z + b with l <= z <= u and the signs that `farkas.refutes`
    defines, and linear programs for its multipliers y.

    b and the bounds are divided by a power of two. Each linear program takes at most
    half of the effort, or PATIENCE times that. In the programs for y, A'y = v - v' with
    v, v' >= 0, whose costs are the bounds; for a dense A, compared with which an
    identity would be as large, inequalities replace the v_j or v'_j whose bound is 0.
    """

    def __init__(self, A: Matrix, b: Vector, box: Box, effort: float) -> None:
        self._A, self._effort = A, effort / 2
        self.power = max(math.frexp(np.abs(b).max())[1], -LARGEST_SHIFT)
        *_, self.low, self.high = sides(box, b.size)
        *bounds, low, high = sides(box, A.shape[1])
        with np.errstate(all="ignore"):
            self._b, lower, upper = (np.ldexp(v, -self.power) for v in (b, *bounds))
        self._columns = lower, upper, low, high
        may_fall = (not is_sparse(A)) & (lower == 0)
        may_rise = (not is_sparse(A)) & (upper == 0)
        self._image_bounds = (
            np.where(may_fall, -np.inf, 0.0),
            np.where(may_rise, np.inf, 0.0),
        )
        self._positive = np.flatnonzero(~self.high)
        self._negative = np.flatnonzero(~self.low)
        self._above = np.flatnonzero(high & ~may_rise)
        self._below = np.flatnonzero(low & ~may_fall)
        of_y = self._b[self._positive], -self._b[self._negative]
        self._cost = np.concatenate((*of_y, upper[self._above], -lower[self._below]))
        self.is_finite = bool(
            np.isfinite(self._b).all()
            and np.isfinite(self._cost).all()
            and np.isfinite(A.sum())
        )

    def multipliers(self, first: Optimum | None) -> Iterator[Vector]:
        """Yield vectors that may be proofs, the most likely first: the y of
        `least_total`, if there is one; the multipliers of the least violation, as the y
        of systems that almost have a solution are large; and the y with total at most
        -1 and the largest sum of margins. A margin, of at most 1, is the distance by
        which a component of A'y lies beyond 0 where that has no cost: at a vertex many
        of them are 0 up to rounding, and rounding may reverse their signs.
        """
        if first is not None:
            self._effort *= PATIENCE
            yield self._y(first)
        if (least_violation := self._least_violation()) is not None:
            yield least_violation.y
        lower, upper, low, high = self._columns
        single = np.flatnonzero((low != high) & (np.where(low, lower, upper) == 0))
        objective = np.append(0 * self._cost, -np.ones(single.size))
        if (
            first is not None
            and (strict := self._minimum(objective, single, (-np.inf, -1.0)))
            is not None
        ):
            yield self._y(strict)

    def least_total(self) -> Optimum | None:
        """Return the minimum of b'y + u'v - l'v' >= -1 over the y with the signs of
        multipliers, where v_j = 0 if u_j is infinite, and v'_j = 0 if l_j is infinite.
        The minimum is -1 if there is a proof, otherwise 0; then the multipliers of this
        program are minus a point z.
        """
        return self._minimum(self._cost, np.empty(0, dtype=int), (-1.0, np.inf))

    def _minimum(
        self, objective: Vector, margins: Indices, total: tuple[float, float]
    ) -> Optimum | None:
        """Return the minimum of an objective over y, v, v' and the margins of these
        columns, where the total b'y + u'v - l'v' lies between two numbers.
        """
        transposed, low = self._A.T, self._columns[2]
        parts, columns = (self._above, self._below, margins), self._A.shape[1]
        above, below, slopes = (
            unit_columns(columns, part, is_sparse(self._A)) for part in parts
        )
        y = transposed[:, self._positive], -transposed[:, self._negative]
        rows = stack([[*y, -above, below, slopes * np.where(low[margins], 1.0, -1.0)]])
        A = stack([[rows], [np.append(self._cost, 0 * margins)[np.newaxis]]])
        row_bounds = (
            np.append(self._image_bounds[0], total[0]),
            np.append(self._image_bounds[1], total[1]),
        )
        upper = np.append(np.full(self._cost.size, np.inf), np.ones(margins.size))
        return minimized(
            objective, A, row_bounds, (np.zeros(upper.size), upper), self._effort
        )

    def _y(self, optimum: Optimum) -> Vector:
        """Return y from its positive and negative parts in a program's solution."""
        y = np.zeros(self._b.size)
        positive = self._positive
        negative = self._negative
        y[positive] += optimum.x[: positive.size]
        y[negative] -= optimum.x[positive.size : positive.size + negative.size]
        return y

    # Without it: the linear program cplex2, which is infeasible, is not decided.
    def _least_violation(self) -> Optimum | None:
        """Return the least sum of violations of the signs of A z + b, whose multipliers
        are at most 1 in size: the elastic program (J. W. Chinneck and E. W. Dravnieks,
        ORSA Journal on Computing 3 (1991) 157-168).
        """
        parts = self._positive, self._negative
        added, subtracted = (
            unit_columns(self._b.size, part, is_sparse(self._A)) for part in parts
        )
        elastic = stack([[self._A, added, -subtracted]])
        zero = np.zeros(elastic.shape[1] - self._A.shape[1])
        row_bounds = (
            np.where(self.high, -np.inf, -self._b),
            np.where(self.low, np.inf, -self._b),
        )
        bounds = (
            np.append(self._columns[0], zero),
            np.append(self._columns[1], zero + np.inf),
        )
        return minimized(
            np.append(np.zeros(self._A.shape[1]), zero + 1),
            elastic,
            row_bounds,
            bounds,
            self._effort,
        )


def simplest(y: Vector) -> Iterator[Vector]:
    """Yield y without its small entries, and with entries rounded to fractions or
    integers, as the exact proof often has simple numbers.
    """
    largest = float(np.abs(y).max())
    snapped = np.where(np.abs(y) < SNAP * largest, 0.0, y)
    if snapped.any():
        yield snapped
        yield np.rint(GRID * (snapped / largest)) / GRID
        yield np.rint(snapped / np.abs(snapped[snapped != 0]).min())
