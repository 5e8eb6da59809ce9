"""The compiled form of `methods.direct`, for the extra `fast`: importing it takes half
a second, or many seconds if numba has to compile its kernels, once on a machine.
"""

from __future__ import annotations

import math
from functools import cache
from importlib import import_module
from types import ModuleType

import numpy as np

from lcpcli.basis import free_variables, tableau
from lcpcli.clock import imports
from lcpcli.errors import OptionError
from lcpcli.kernels.loading import load
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.linalg.units import Base, Units
from lcpcli.methods.direct import (
    CERTAIN,
    DOUBTFUL,
    MAX_COMPILED,
    NOTHING,
    DirectAnswer,
    without_doubtful_terms,
)
from lcpcli.methods.lemke import MIN_REFRESHED, seeded_cover
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import BasisStatus, Indices, Mask, Vector
from lcpcli.verify.acceptance import AS_IT_IS, Acceptance, Extent, accepted
from lcpcli.verify.measure import Rows
from lcpcli.verify.point import Criterion, Point

Vectors = tuple[Vector, ...]
Sizes = tuple[float, float]
# Numbers in the systems that are solved in one call, during which Ctrl-C has to wait.
NUMBERS_AT_ONCE = 1 << 18
# The first n components of this vector are the covering vector for n unknowns.
COVER = seeded_cover(0, 2 * MAX_COMPILED)
# The bounds of LCPs.
LOWEST, HIGHEST = np.zeros(MAX_COMPILED), np.full(MAX_COMPILED, np.inf)
NO_UNITS = np.zeros(0), np.zeros(0, dtype=np.int64), 0.0
NO_MATRIX = np.zeros((0, 0))
# Entries of a sparse M up to which a kernel tests points: Ctrl-C has to wait until it
# returns.
MAX_JUDGED_ENTRIES = 1_000_000
# The decisions on a point that meets the tolerance by a kernel.
EXACT = Extent(AS_IT_IS, is_exact=True)

load("kernels", "measure_kernels", "pivoting_kernels")
from lcpcli.kernels.kernels import (  # noqa: E402
    pivot_blocks,
    solve_one,
    solve_rows,
)
from lcpcli.kernels.measure_kernels import (  # noqa: E402
    FAILS,
    SOLVES,
    acceptance_test,
    compressed,
    dense_units_of,
    on_bounds,
    reference_of,
)
from lcpcli.kernels.measure_kernels import (  # noqa: E402
    surely_solves as surely_solves,
)
from lcpcli.kernels.pivoting_kernels import (  # noqa: E402
    basic_solution,
    exponents,
    path,
)
from lcpcli.kernels.pivoting_kernels import follow as follow  # noqa: E402


def direct(
    problem: Problem, tol: float, basic: Mask | None = None
) -> DirectAnswer | None:
    """Return the result of the kernels for block pivoting, as the functions of `direct`
    do by numpy.
    """
    start = problem.q < 0 if basic is None else basic
    M = np.ascontiguousarray(problem.M)
    verdict_code, steps, z = solve_one(
        M, problem.q, start, basic is not None, problem.largest, tol
    )
    if verdict_code == NOTHING:
        return None
    answer = DirectAnswer(z, verdict_code == CERTAIN, steps)
    is_doubtful = verdict_code == DOUBTFUL
    return without_doubtful_terms(problem, answer) if is_doubtful else answer


def lemke(
    problem: Problem, tol: float, basic: Mask | None = None
) -> DirectAnswer | None:
    """Return the solution of an LCP at a basis, if it is one, or otherwise the last
    vertex of Lemke's path; None if neither is a solution by a margin larger than
    rounding errors, if q >= 0, for which there is no path, or if `Reduction` would
    scale M.
    """
    M, q = np.ascontiguousarray(problem.M), problem.q
    if not (powers := exponents(M)).size or powers.any():
        return None
    box = LOWEST[: q.size], HIGHEST[: q.size]
    if basic is not None:
        acceptance = _at(problem, M, box, tol, of_masks(basic))
        if acceptance is not None:
            return _answer(acceptance, "newton", 1)
    if not (q < 0).any():
        return None
    termination, pivots, statuses = path(
        M, q, HIGHEST[: q.size], COVER[: q.size], max(MIN_REFRESHED, q.size)
    )
    if termination != tableau.SOLVED:
        return None
    acceptance = _at(problem, M, box, tol, statuses)
    return None if acceptance is None else _answer(acceptance, "lemke", pivots)


@cache
def _module(name: str) -> ModuleType | None:
    """Return a module of kernels that only some problems need; None if it cannot be
    loaded.
    """
    with imports:
        try:
            load(name)
            return import_module(f"lcpcli.kernels.{name}")
        except (ImportError, OptionError):
            return None


def mixed(problem: Problem, tol: float) -> DirectAnswer | None:
    """Return the solution of a mixed problem with few unknowns that newton or Lemke's
    path reaches; None if neither is a solution by a margin larger than rounding errors,
    or a bound is far from 0.
    """
    rows, q, kernels = rows_of(problem), problem.q, _module("mixed_kernels")
    if kernels is None:
        return None
    box = lower, upper = (
        np.ascontiguousarray(problem.lower),
        np.ascontiguousarray(problem.upper),
    )
    is_solution, reference, t = reference_of(rows, q, lower, upper)
    if not t.size:
        return None
    if is_solution and surely_solves(rows, q, lower, upper, tol, reference):
        return DirectAnswer(reference, True, 0)
    steps, z = pivot_blocks(rows, q, lower, upper, t)
    acceptance = _accepted(problem, rows, box, z, tol) if z.size else None
    if acceptance is not None:
        return DirectAnswer(acceptance.point.z, True, steps, point=acceptance.point)
    M = np.ascontiguousarray(dense(problem.M))
    nonfixed = kernels.nonfixed_variables(M, lower, upper)
    try:
        factors = free_variables.scaled(nonfixed.A, exponents(nonfixed.A))
        K, k, d = kernels.reduced(M, q, lower, upper, nonfixed, factors)
    except np.linalg.LinAlgError:
        return None
    n_basic_solutions = max(-steps, 0)
    termination, pivots, statuses = path(
        K, k, d, COVER[: k.size], max(MIN_REFRESHED, k.size)
    )
    if termination != tableau.SOLVED:
        return None
    statuses = kernels.recovered_basis(nonfixed, q.size, statuses)
    acceptance = _at(problem, M, box, tol, statuses)
    if acceptance is None:
        return None
    evaluations = pivots + n_basic_solutions
    return _answer(acceptance, "lemke", evaluations, n_basic_solutions)


def _at(
    problem: Problem, M: Vector, box: Vectors, tol: float, statuses: BasisStatus
) -> Acceptance | None:
    """Return the decision on the basic solution of this basis, if it is a solution by
    a margin larger than rounding errors; otherwise None.
    """
    z = basic_solution(M, problem.q, *box, statuses)
    return _accepted(problem, rows_of(problem), box, z, tol, statuses)


def _answer(
    acceptance: Acceptance, method: str, evaluations: int, n_basic_solutions: int = 0
) -> DirectAnswer:
    """Return the answer of a method that has ended at a solution. n_basic_solutions :
    the number of basic solutions computed before.
    """
    point, final_basis = acceptance.point, acceptance.basis
    return DirectAnswer(
        point.z, True, 1 + n_basic_solutions, method, evaluations, final_basis, point
    )


def rows_of(problem: Problem) -> Vectors:
    """Return M in compressed sparse rows, for kernels."""
    M = problem.M
    if is_sparse(M):
        return M.indptr.astype(np.uint32), M.indices.astype(np.uint32), M.data
    begin, columns, values = compressed(np.ascontiguousarray(M))
    return begin, columns, values


def _accepted(
    problem: Problem,
    rows: Vectors,
    box: Vectors,
    z: Vector,
    tol: float,
    statuses: BasisStatus | None = None,
) -> Acceptance | None:
    """Return the decision on a z within its bounds if it is a solution by a margin
    larger than rounding errors, perhaps after distances from bounds are removed that
    may be rounding errors of 0; otherwise None. rows : M in compressed sparse rows.
    """
    if not surely_solves(rows, problem.q, *box, tol, z):
        z = on_bounds(*box, z)
        if not surely_solves(rows, problem.q, *box, tol, z):
            return None
    point = Point.of_solution(Criterion(problem, tol), z)
    acceptance = accepted(problem, [point], tol, EXACT, statuses)
    return acceptance if acceptance is not None and acceptance.solved else None


def solves(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether a z within its bounds solves an LCP, or a problem with sparse M,
    by a margin larger than rounding errors.
    """
    if is_sparse(problem.M) and problem.M.nnz > MAX_JUDGED_ENTRIES:
        return False
    lower, upper = conditions_of(problem)[2:]
    return bool(
        surely_solves(
            rows_of(problem), problem.q, lower, upper, tol, np.ascontiguousarray(z)
        )
    )


def compact_form(
    contacts: Vectors, before: Vector | None, base: Base | None
) -> tuple[Vector | None, Vector, Sizes, Sizes, float] | None:
    """Return M and q of the compact form of contacts, read-only, their sizes and the
    change of M as the kernel of this name does, if all numbers are finite; else None. M
    is None if A is that of the step before.

    before : this A; None if the friction is not that of the step before.
    base : the M whose scaling factors are known, if there is one.
    """
    kernels = _module("contact_kernels")
    if kernels is None:
        return None
    contacts = _contiguous(*contacts)
    m = contacts[1].size + contacts[-1].size
    M, q = np.empty((m, m)), np.empty(m)
    compared = NO_MATRIX if base is None else np.ascontiguousarray(base.M)
    A_before = NO_MATRIX if before is None else np.ascontiguousarray(before)
    is_same, sizes_of_M, sizes_of_q, change = kernels.compact_form(
        contacts, A_before, compared, M, q
    )
    if not (sizes_of_M[1] < math.inf and sizes_of_q[1] < math.inf):
        return None
    M.setflags(write=False)
    q.setflags(write=False)
    return None if is_same else M, q, sizes_of_M, sizes_of_q, change


def _contiguous(A: Vector, b: Vector, *friction: Vector) -> Vectors:
    """Return contacts for kernels; the arrays of friction are contiguous."""
    return np.ascontiguousarray(A), np.ascontiguousarray(b), *friction


def contact_step(
    problem: Problem,
    contacts: Vectors,
    basis: BasisStatus,
    systems: tuple[int, int, float],
    tol: float,
) -> tuple[int, bool, tuple[Vector, Vector, BasisStatus]] | None:
    """Return what the kernel of this name returns for the LCP of contacts, with z, the
    motion and the basis that it writes; None if it cannot be loaded.
    """
    kernels = _module("contact_kernels")
    if kernels is None:
        return None
    M, near = np.ascontiguousarray(problem.M), problem.facts.near_units
    if near is None:
        _set_units(problem, *dense_units_of(M))
        near = problem.facts.near_units
    units = NO_UNITS
    if near is not None:
        of_rows, digits = near
        parts = of_rows.row_part.astype(np.int64, copy=False)
        units = np.ascontiguousarray(of_rows.rows), parts, digits
    contacts = _contiguous(*contacts)
    m, n = len(M), len(contacts[0])
    new_step = np.empty(m), np.empty((3, n)), np.empty(m, np.int8)
    number, is_certain = kernels.contact_step(
        contacts, basis, systems, M, problem.q, units, tol, new_step
    )
    return number, is_certain, new_step


def _set_units(
    problem: Problem, rho: Vector, gamma: Vector, parts: Indices, count: int
) -> None:
    """Let a problem have the scaling factors that a kernel has computed, unless it has
    not: then there are no components."""
    if count:
        n = problem.n
        problem.facts.units = Units(rho, gamma, parts[:n], parts[n:], count)


def test_sparse(
    problem: Problem, z: Vector, tol: float
) -> tuple[bool | None, Rows | None]:
    """Return whether a z within its bounds solves a problem with sparse M and moderate
    numbers, None if that is not decided; and the rows of z, if they are known.
    """
    if problem.M.nnz > MAX_JUDGED_ENTRIES:
        return None, None
    bounds = conditions_of(problem)[2:]
    answer, rows, unit_arrays = acceptance_test(
        rows_of(problem), problem.q, *bounds, tol, np.ascontiguousarray(z)
    )
    _set_units(problem, *unit_arrays)
    return {SOLVES: True, FAILS: False}.get(answer), Rows(*rows) if len(rows) else None


def direct_many(
    M: Vector, Q: Vector, largest: Vector, tol: float
) -> tuple[Vector, Indices]:
    """Return for many LCPs what `direct.direct_many` returns; M and `largest` may have
    one row for all problems.
    """
    M = np.ascontiguousarray(M)
    Z = np.empty(Q.shape)
    outcomes = np.empty((len(Q), 2), dtype=np.int64)
    size = max(NUMBERS_AT_ONCE // max(Q.shape[1] ** 2, 1), 1)
    for rows in (slice(first, first + size) for first in range(0, len(Q), size)):
        rows_of_M = rows if len(M) == len(Q) else slice(1)
        solve_rows(
            M[rows_of_M], Q[rows], largest[rows_of_M], tol, Z[rows], outcomes[rows]
        )
    return Z, outcomes
