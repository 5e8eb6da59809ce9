"""Solutions that a point approximates except for small entries, which have no correct
digit.

If a solution decays, as along a chain, in a diffusion or for an option far out of the
money, it has entries of 1e-200 together with others of 1. The criterion compares each
row with its terms, and rejects a z that is correct to the last digit of its largest
entry, as the rows of small entries are violated completely. So a point is also accepted
if an exact solution z* is proved to exist with |z - z*|_j at most tol times the largest
|z* - z_ref| in the connected component of M to which z_j belongs.

No such z* exists for points that tend to infinity in problems without solution. But the
largest entry of a component is a measure of the others only if all of them are of one
kind: in a program whose data are spread over 16 powers of ten, a variable of 1 may
matter most although another one is 1e16.

So a row with a nonzero datum q_ref has to meet the tolerance relative to its terms,
unless that datum decays along with the solution: a neighbour with a larger entry
contributes to the row, as in the tail of a source that decays itself.

Entries are of one kind if M is an H+-matrix, and u = <M>^-1 L e, with L its diagonal,
varies little. <M> u > 0 implies a maximum principle: the largest |z_i| / u_i in rows
without data is that of a neighbour, and the inverse decays away from the diagonal (S.
Demko, W. F. Moss and P. W. Smith, Decay rates for inverses of band matrices,
Mathematics of Computation 43 (1984) 491-499). Entries are then compared without
scaling.

For any other M, entries are compared after scaling by the C of the columns of M, which
do not depend on the scaling of the data; every row with a datum has to meet the
tolerance; and the sum of |z - z*|_j t_j, with the terms t of the rows, is at most tol
times that of |z* - z_ref|_j t_j in each component. For programs this bounds the change
of the objective.

z* is the result of block principal pivoting from the basis of z, in which a variable is
basic unless w_i has the sign required at a bound even if z has an error of tol: the
basis that z itself shows is wrong where small entries have been cut off. It is proved
by the theorem of Chen and Xiang (`error_theorems`), which needs an H+-matrix and holds
for any signs, by the enclosure of a system (`enclosure`), or in rational arithmetic.
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
from lcpcli.typing import BasisStatus, Vector
from lcpcli.verify import enclosure, error_theorems, farkas
from lcpcli.verify.exact_solution import exact_basis
from lcpcli.verify.measure import Measure, quotients
from lcpcli.verify.point import Point

EFFORT = 2.0  # limit on an exact solution, in seconds that it usually takes
# Steps of block pivoting from the basis of z: a few suffice if it is almost right.
MAX_STEPS = 12
# The largest ratio of the u_i in a component whose entries are compared without
# scaling.
MAX_UNEVENNESS = 1e4
# A datum decays along with the solution if larger neighbours contribute at least this
# fraction of it to its row.
MIN_SHARE = 1e-4
# Entries with a larger relative error have fewer than three correct digits.
FEW_DIGITS = 5e-4


class SmallEntriesSolution(NamedTuple):
    """An exact solution that a z approximates except for small entries.

    z : that solution, rounded, shape (n,). distance : the largest |z - z*|_j, relative
        to the largest entry of its component.
    uncertain : the sizes of the entries that have fewer than three correct digits.
    is_stable : whether there is a solution for all entries of M and q that differ by
        their rounding errors.
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
    """The scaling in which entries are compared. columns : the scale of each z_j, shape
    (n,). is_even : whether M is an H+-matrix with a u that varies little.
    """

    columns: Vector
    is_even: bool


@np.errstate(all="ignore")
def solution_up_to_small_entries(point: Point) -> SmallEntriesSolution | None:
    """Return the exact solution that a point approximates except for small entries;
    None if the conditions above are not proved.
    """
    problem, tol = point.criterion.problem, point.criterion.tol
    # Large numbers might overflow; small ones only underflow, which the bounds include.
    sizes = problem.largest, problem.sizes_of_q[1], size(point.z)
    if not max(sizes) <= FAR_FROM_ONE:
        return None
    z = problem.box.project(point.z)
    even = Comparison(np.ones(problem.n), is_even=True)
    comparison = Comparison(np.exp2(problem.units.columns), is_even=False)
    allowed = [tol * _sizes(problem, z, each) for each in (even, comparison)]
    # Most points are too far from a solution in either scaling: two products show it.
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
    """Return a function that bounds the distance from the solution by the theorem for
    H+-matrices; None if M is not proved to be one, or out of range.
    """
    if not error_theorems.takes(problem):
        return None
    return error_theorems.h_plus_distances(problem)


def _is_even(problem: Problem) -> bool:
    """Return whether some u > 0 with <M> u >= 0, for an H+-matrix M, varies by at most
    MAX_UNEVENNESS in each component.
    """
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
    """Return, for each z_j, the largest distance from the reference point in its
    component of M, after scaling, in the scale of z_j.
    """
    units, columns = problem.units, comparison.columns
    relative = np.abs(problem.from_reference(z)) / columns
    largest = units.largest(relative, units.column_part)
    return np.asarray(columns * np.maximum(largest, 0.0)[units.column_part])


def _states(problem: Problem, z: Vector, error: Vector) -> BasisStatus | None:
    """Return the basis that a solution may have which differs by at most `error` from a
    z within its bounds; variables are basic if both are possible. None if there is no
    such solution.
    """
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
    problem: Problem, basis: BasisStatus, z: Vector
) -> Iterator[Vector]:
    """Yield the solutions to which block pivoting leads from this basis, and from the
    one that z shows, as the first may be singular.
    """
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
    """Return a z close to an exact solution, with bounds on its distances from that;
    None if none is proved.
    """
    if theorem is not None:
        small = np.abs(candidate) < error_theorems.SMALLEST_ENTRY
        y = np.where(small, 0.0, candidate)
        w = error_theorems.residual(problem, y)
        if w is not None:
            return candidate, theorem(y, w) * (1 + 8 * EPS) + np.abs(candidate - y)
    change, why_unproved = enclosure.distances(problem, candidate)
    if not why_unproved:
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
    """Return the solution close to a point if the distances and the data meet the
    conditions above, otherwise None.

    clean : the point, with the components at bounds that the solution has there.
    """
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
    """Return whether, in each row with a datum, neighbours with larger entries
    contribute at least MIN_SHARE of it.
    """
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
    """Return whether the sum of the distances, each weighted with the terms of its row,
    is at most tol times that of the solution, in each component.
    """
    units, moved = problem.units, np.abs(problem.from_reference(solution))
    terms = np.abs(problem.q_ref) + absolute_product(problem.M, moved)
    weights = np.exp2(units.rows - units.columns) * terms
    lost, whole = (
        np.bincount(units.column_part, weights * each, units.parts)
        for each in (distance, moved)
    )
    return bool((lost <= tol * whole).all())
