"""Solutions beside a point whose small entries have no correct digit.

Where a solution decays, as along a chain, in a diffusion or for an option far out of
the money, entries of 1e-200 stand beside others of 1. The criterion measures each row
by its own terms, and refuses a z that is right to the last digit of its largest entry,
as the rows of small entries are violated completely. So a point also counts where an
exact solution z* is proved to exist, with |z - z*|_j at most tol times the largest
|z* - z_ref| in the connected part of M to which z_j belongs.

No such z* exists for points that tend to infinity in problems without a solution. But
the largest entry of a part is a measure of the others only where all of them are of one
kind: in a program whose data are spread over 16 powers of ten, a variable of 1 may be
all that matters beside one of 1e16.

So a row with a datum of its own, q_ref, has to be satisfied by its own terms, unless
that datum decays along with the solution: a neighbour with a larger entry contributes
to the row, as in the tail of a source that decays itself.

Entries are of one kind if M is an H+-matrix, and u = <M>^-1 L e, with L its diagonal,
is even: <M> u > 0 is a maximum principle, by which the largest |z_i| / u_i without data
of its own is that of a neighbour, and the inverse decays away from the diagonal (S.
Demko, W. F. Moss and P. W. Smith, Decay rates for inverses of band matrices,
Mathematics of Computation 43 (1984) 491-499). Entries are then compared as they are
given.

For any other M, entries are compared in the units C of the columns of M
(`linalg.units`), which do not depend on the units of the data; every row with a datum
has to be satisfied; and the sum of |z - z*|_j t_j, with the terms t of the rows, is at
most tol times that of |z* - z_ref|_j t_j in each part. For programs this bounds the
change of the objective.

z* is the end of block principal pivoting from the states of z, in which a component is
basic unless w_i, beyond what an error of tol may make of it, has the sign of a bound:
the states of z themselves are wrong where its small entries have been cut off. It is
proved by the theorem of Chen and Xiang (`error_theorems`), which takes M to be H+ and
does not mind signs that rounding decides, by the enclosure of a system (`enclosure`),
or in fractions.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from typing import NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.errors import count
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import (
    EPS,
    FAR_FROM_ONE,
    ROUNDING,
    ROW_ROUNDING,
    SMALLEST_NORMAL,
    size,
)
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import absolute_product, is_sparse
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded
from lcpcli.typing import States, Vector
from lcpcli.verify import enclosure, error_theorems, farkas
from lcpcli.verify.exact_solution import exact_basis
from lcpcli.verify.measure import Measure, quotients
from lcpcli.verify.point import Point

EFFORT = 2.0  # of an exact solution, by the seconds that it usually takes
# Basic solutions from the states of z: a few where these are nearly right.
MAX_STEPS = 12
# By how much u may vary in a part in which entries are compared as they are given.
MAX_UNEVENNESS = 1e4
# Of a datum that decays along with the solution: what neighbours contribute to its row.
MIN_SHARE = 1e-4
# Entries with a larger relative error have fewer than three correct digits.
FEW_DIGITS = 5e-4


class SmallEntriesSolution(NamedTuple):
    """An exact solution beside a z.

    z : that solution, rounded, shape (n,). distance : the largest |z - z*|_j, relative
        to the largest entry of its part.
    uncertain : the sizes of those entries that have fewer than three correct digits.
    is_stable : whether there is a solution for all entries of M and q that differ by
        their rounding.
    """

    z: Vector
    distance: float
    uncertain: Vector
    is_stable: bool

    @property
    def statement(self) -> str:
        """Return how z differs from the exact solution, as a clause."""
        said = (
            "z differs from an exact solution by no more than "
            f"{self.distance:.1e} of its largest entry"
        )
        if not self.uncertain.size:
            return said
        entries = count(self.uncertain.size, "entry")
        return (
            f"{said}; {entries} of z, of up to {self.uncertain.max():.1e}, with fewer "
            "than three correct digits"
        )


class Comparison(NamedTuple):
    """In which units entries are compared. columns : the unit of each z_j, shape (n,).
    is_even : whether M is an H+-matrix with an even u."""

    columns: Vector
    is_even: bool


@np.errstate(all="ignore")
def solution_up_to_small_entries(point: Point) -> SmallEntriesSolution | None:
    """Return the exact solution beside a point, if all that is said above holds."""
    problem, tol = point.criterion.problem, point.criterion.tol
    # Small numbers only underflow.
    sizes = problem.largest, problem.sizes_of_q[1], size(point.z)
    if not max(sizes) <= FAR_FROM_ONE:
        return None
    z = problem.box.project(point.z)
    even = Comparison(np.ones(problem.n), is_even=True)
    comparison = Comparison(np.exp2(problem.units.columns), is_even=False)
    allowed = [tol * _sizes(problem, z, each) for each in (even, comparison)]
    # Most points are too far off for either, which takes two products to see.
    if _states(problem, z, np.maximum(*allowed)) is None:
        return None
    distances = _theorem(problem)
    if distances is not None and _is_even(problem):
        comparison = even
    basis = _states(problem, z, allowed[0 if comparison is even else 1])
    if basis is None:
        return None
    on_bounds = np.where(basis == BASIC, z, problem.box.nonbasic(basis))
    clean = Point(point.criterion, on_bounds)
    for candidate in _solutions_by_pivoting(problem, basis, z):
        proved = _proved(problem, candidate, distances)
        if proved is None:
            continue
        solution = _compared(point, clean, *proved, comparison)
        if solution is not None and distances is None:
            is_stable = enclosure.is_stable(problem, solution.z)
            solution = solution._replace(is_stable=is_stable)
        return solution
    return None


def _theorem(problem: Problem) -> error_theorems.Distances | None:
    """Return bounds on the distance from the solution by H+-matrices; None if M is not
    one, or is out of range."""
    if not error_theorems.takes(problem):
        return None
    return error_theorems.h_plus_distances(problem)


def _is_even(problem: Problem) -> bool:
    """Return whether some u > 0 with <M> u >= 0, for an H+-matrix M, varies little in
    each part."""
    M = problem.M
    diagonal = problem.M.diagonal()
    units = problem.units
    others = absolute_product(M, np.ones(problem.n)) - diagonal
    if (others <= diagonal * (1 + problem.n * EPS)).all():
        return True
    with suppress(SingularMatrix):
        indices = np.arange(problem.n)
        u = PrincipalSolver(matrices.comparison(M)).solve(indices, diagonal)
        if np.isfinite(u).all() and (u > 0).all():
            powers = np.log2(u)
            max_powers = units.largest(powers, units.column_part)
            min_powers = -units.largest(-powers, units.column_part)
            used = max_powers > -np.inf
            return bool(
                (max_powers - min_powers <= np.log2(MAX_UNEVENNESS))[used].all()
            )
    return False


def _sizes(problem: Problem, z: Vector, comparison: Comparison) -> Vector:
    """Return the largest distance from the reference point in the part of each z_j, in
    the unit of z_j."""
    units, columns = problem.units, comparison.columns
    relative = np.abs(problem.from_reference(z)) / columns
    largest = units.largest(relative, units.column_part)
    return np.asarray(columns * np.maximum(largest, 0.0)[units.column_part])


def _states(problem: Problem, z: Vector, error: Vector) -> States | None:
    """Return the states that a solution may have which differs by no more than `error`
    from an admissible z, basic where both are possible; None if there is none."""
    box, M = problem.box, problem.M
    low, high = box.vectors(problem.n)
    w, is_fixed = problem.w(z), low == high
    terms = absolute_product(M, np.abs(z)) + np.abs(problem.q)
    noise = 2 * absolute_product(M, error) + ROW_ROUNDING * terms
    noise += SMALLEST_NORMAL * problem.n
    at_lower, at_upper = (w > noise) | is_fixed, (w < -noise) & ~is_fixed
    if (at_lower & (z - low > 2 * error) & ~is_fixed).any():
        return None
    if (at_upper & (high - z > 2 * error)).any():
        return None
    return np.where(at_lower, LOWER, np.where(at_upper, UPPER, BASIC)).astype(np.int8)


def _solutions_by_pivoting(
    problem: Problem, basis: States, z: Vector
) -> Iterator[Vector]:
    """Yield the ends of block pivoting from these states, and from those of z where
    that leads to none, as where a system is singular."""
    states_of_z = problem.box.basis_at(z)
    for start in (basis, np.where(basis == BASIC, states_of_z, basis)):
        with suppress(SingularMatrix):
            solutions = BasicSolutions(problem)
            for basic_solution in islice(
                solutions.block_principal_pivoting(start), MAX_STEPS
            ):
                raise_if_timed_out()
                if not solutions.count_violations(basic_solution):
                    yield problem.box.project(basic_solution.z)
                    break


def _proved(
    problem: Problem, candidate: Vector, theorem: error_theorems.Distances | None
) -> tuple[Vector, Vector] | None:
    """Return a z near an exact solution, with bounds on its distances from that; None
    if none is proved."""
    if theorem is not None:
        small = np.abs(candidate) < error_theorems.SMALLEST_ENTRY
        y = np.where(small, 0.0, candidate)
        w = error_theorems.residual(problem, y)
        if w is not None:
            return candidate, theorem(y, w) * (1 + 8 * EPS) + np.abs(candidate - y)
    change, fault = enclosure.distances(problem, candidate)
    if not fault:
        return candidate, change
    basis = problem.box.basis_at(candidate)
    if np.count_nonzero(basis == BASIC) > farkas.max_exact_unknowns():
        return None
    data = ExactProblem.of_basis(problem, basis)
    exact = exact_basis(data, basis, Effort(EFFORT))
    if exact is None or not (exact.unique and exact.solves):
        return None
    candidate = rounded(exact.z)
    return (
        (candidate, ROUNDING * np.abs(candidate))
        if np.isfinite(candidate).all()
        else None
    )


def _compared(
    point: Point, clean: Point, solution: Vector, change: Vector, comparison: Comparison
) -> SmallEntriesSolution | None:
    """Return the solution near a point if it is as near as is required. clean : the
    point, with components on the bounds at which the solution is."""
    problem = point.criterion.problem
    z = point.z
    tol = point.criterion.tol
    sizes = _sizes(problem, solution, comparison)
    distance = np.abs(z - solution) + change
    if (distance > tol * sizes + ROUNDING * np.abs(z)).any():
        return None
    is_violated = clean.relative_residuals > max(tol, ROUNDING)
    data = np.where(is_violated, np.abs(Measure(problem).reference_w), 0.0)
    if not comparison.is_even:
        if data.any() or not _is_worth_little(problem, distance, solution, tol):
            return None
    elif (data > 0).any() and not _decays(problem, solution, data):
        return None
    differs = (z != solution) | (solution != 0)
    is_uncertain = differs & (distance > FEW_DIGITS * np.abs(solution))
    uncertain = np.maximum(np.abs(z), np.abs(solution))[is_uncertain]
    largest = float(quotients(distance, sizes).max(initial=0.0))
    return SmallEntriesSolution(solution, largest, uncertain, is_stable=True)


def _decays(problem: Problem, solution: Vector, data: Vector) -> bool:
    """Return whether in each row with such a datum neighbours with larger entries
    contribute to it."""
    moved, rows = np.abs(problem.from_reference(solution)), data.nonzero()[0]
    M = problem.M[rows]
    if not is_sparse(M):
        inward = np.where(moved > moved[rows][:, np.newaxis], moved, 0.0)
        received = (np.abs(M) * inward).sum(axis=1)
    else:
        number = np.repeat(np.arange(rows.size), np.diff(M.indptr))
        values = moved[M.indices]
        inward = np.where(values > moved[rows][number], values, 0.0)
        received = np.bincount(number, np.abs(M.data) * inward, rows.size)
    return bool((received >= MIN_SHARE * data[rows]).all())


def _is_worth_little(
    problem: Problem, distance: Vector, solution: Vector, tol: float
) -> bool:
    """Return whether the distances, each times the terms of its row, are small beside
    the solution, in each part."""
    units, moved = problem.units, np.abs(problem.from_reference(solution))
    terms = np.abs(problem.q_ref) + absolute_product(problem.M, moved)
    weights = np.exp2(units.rows - units.columns) * terms
    lost, whole = (
        np.bincount(units.column_part, weights * each, units.parts)
        for each in (distance, moved)
    )
    return bool((lost <= tol * whole).all())
