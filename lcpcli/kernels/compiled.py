"""The compiled form of `methods.direct`, by the extra `fast`: to import it takes half a
second, or seconds if numba has to compile its kernels, once on a machine."""

from __future__ import annotations

from functools import cache
from types import ModuleType

import numpy as np

from lcpcli.basis import free_variables, tableau
from lcpcli.clock import imports
from lcpcli.errors import OptionError
from lcpcli.kernels.loading import load
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.linalg.units import Units
from lcpcli.methods.direct import CERTAIN, MAX_COMPILED, DirectAnswer
from lcpcli.methods.lemke import MIN_REFRESHED, seeded_cover
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Indices, Mask, States, Vector
from lcpcli.verify.acceptance import AS_IT_IS, Acceptance, Extent, accepted
from lcpcli.verify.measure import Rows
from lcpcli.verify.point import Criterion, Point

Vectors = tuple[Vector, ...]
# In the systems that are solved before Ctrl-C can take effect.
NUMBERS_AT_ONCE = 1 << 18
# The covering vector of any number of unknowns is its beginning.
COVER = seeded_cover(0, 2 * MAX_COMPILED)
# Bounds of LCPs.
LOWEST, HIGHEST = np.zeros(MAX_COMPILED), np.full(MAX_COMPILED, np.inf)
# Of a sparse M: for more, Ctrl-C would have to wait for the end of the judgement.
MAX_JUDGED_ENTRIES = 1_000_000
# What is asked of a point that meets the criterion, by a kernel.
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
    compressed,
    judgement,
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
    """Return the answer of the kernels, as `direct.exchanges` that of numpy."""
    start = problem.q < 0 if basic is None else basic
    M = np.ascontiguousarray(problem.M)
    found, steps, z = solve_one(
        M, problem.q, start, basic is not None, problem.largest, tol
    )
    return DirectAnswer(z, found == CERTAIN, steps) if found else None


def lemke(
    problem: Problem, tol: float, basic: Mask | None = None
) -> DirectAnswer | None:
    """Return the solution of an LCP at a basis, if it is one, or else at the end of
    Lemke's path; None where neither is one beyond doubt, or M is in units that
    `Reduction` would change."""
    M, q = np.ascontiguousarray(problem.M), problem.q
    if not (powers := exponents(M)).size or powers.any():
        return None
    box = LOWEST[: q.size], HIGHEST[: q.size]
    if basic is not None:
        found = _at(problem, M, box, tol, of_masks(basic), "newton", 1)
        if found is not None:
            return found
    if not (q < 0).any():
        return None
    end, pivots, states = path(
        M, q, HIGHEST[: q.size], COVER[: q.size], max(MIN_REFRESHED, q.size)
    )
    return (
        _at(problem, M, box, tol, states, "lemke", pivots)
        if end == tableau.SOLVED
        else None
    )


@cache
def _of_mixed() -> ModuleType | None:
    """Return the module of the kernels that LCPs do not need; None if it cannot be
    loaded."""
    with imports:
        try:
            load("mixed_kernels")
            from lcpcli.kernels import mixed_kernels
        except (ImportError, OptionError):
            return None
    return mixed_kernels


def mixed(problem: Problem, tol: float) -> DirectAnswer | None:
    """Return the solution of a mixed problem of few unknowns at which newton or Lemke's
    path ends; None where neither is one beyond doubt, or a bound is far from 0."""
    rows, q, kernels = rows_of(problem), problem.q, _of_mixed()
    if kernels is None:
        return None
    box = lower, upper = (
        np.ascontiguousarray(problem.lower),
        np.ascontiguousarray(problem.upper),
    )
    is_solution, reference, t = reference_of(*rows, q, lower, upper)
    if not t.size:
        return None
    if is_solution and surely_solves(*rows, q, lower, upper, tol, reference):
        return DirectAnswer(reference, True, 0)
    steps, z = pivot_blocks(*rows, q, lower, upper, t)
    found = _accepted(problem, rows, box, z, tol) if z.size else None
    if found is not None:
        return DirectAnswer(found.point.z, True, steps, point=found.point)
    M = np.ascontiguousarray(dense(problem.M))
    own = kernels.kept(M, lower, upper)
    try:
        K, k, d = kernels.reduced(
            M, q, lower, upper, own, *free_variables.scaled(own.A, exponents(own.A))
        )
    except np.linalg.LinAlgError:
        return None
    made = max(-steps, 0)
    end, pivots, states = path(K, k, d, COVER[: k.size], max(MIN_REFRESHED, k.size))
    if end != tableau.SOLVED:
        return None
    return _at(
        problem,
        M,
        box,
        tol,
        kernels.given_states(own, q.size, states),
        "lemke",
        pivots + made,
        made,
    )


def _at(
    problem: Problem,
    M: Vector,
    box: Vectors,
    tol: float,
    states: States,
    method: str,
    evaluations: int,
    made: int = 0,
) -> DirectAnswer | None:
    """Return the basic solution of these states, after `made` others, if it is a
    solution beyond doubt."""
    z = basic_solution(M, problem.q, *box, states)
    found = _accepted(problem, rows_of(problem), box, z, tol, states)
    if found is None:
        return None
    point, end = found.point, found.basis
    return DirectAnswer(point.z, True, 1 + made, method, evaluations, end, point)


def rows_of(problem: Problem) -> Vectors:
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
    states: States | None = None,
) -> Acceptance | None:
    """Return what a z within the box is worth if it is a solution beyond doubt, or if
    it is one but for distances from bounds that may be rounding of 0; else None. rows :
    those of M."""
    if not surely_solves(*rows, problem.q, *box, tol, z):
        z = on_bounds(*box, z)
        if not surely_solves(*rows, problem.q, *box, tol, z):
            return None
    point = Point.of_solution(Criterion(problem, tol), z)
    found = accepted(problem, [point], tol, EXACT, states)
    return found if found is not None and found.solved else None


def solves(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether a z >= 0 solves an LCP beyond doubt, or a z within its bounds a
    problem with sparse M."""
    if is_sparse(problem.M) and problem.M.nnz > MAX_JUDGED_ENTRIES:
        return False
    lower, upper = conditions_of(problem)[2:]
    return bool(
        surely_solves(
            *rows_of(problem), problem.q, lower, upper, tol, np.ascontiguousarray(z)
        )
    )


def judged_by_entries(
    problem: Problem, z: Vector, tol: float
) -> tuple[bool | None, Rows | None]:
    """Return whether a z within its bounds solves a problem with sparse M and moderate
    numbers, None if that is in doubt; and the rows of z, if they are known."""
    if problem.M.nnz > MAX_JUDGED_ENTRIES:
        return None, None
    ends = conditions_of(problem)[2:]
    answer, rows, found = judgement(
        *rows_of(problem), problem.q, *ends, tol, np.ascontiguousarray(z)
    )
    if found[-1]:
        rho, gamma, parts, count = found
        problem.facts.units = Units(
            rho, gamma, parts[: problem.n], parts[problem.n :], count
        )
    return {SOLVES: True, FAILS: False}.get(answer), Rows(*rows) if len(rows) else None


def direct_many(
    M: Vector, Q: Vector, largest: Vector, tol: float
) -> tuple[Vector, Indices]:
    """Return for LCPs what `direct.direct_many` returns; M and `largest` may have one
    row for all problems."""
    M, Z, found = (
        np.ascontiguousarray(M),
        np.empty(Q.shape),
        np.empty((len(Q), 2), dtype=np.int64),
    )
    size = max(NUMBERS_AT_ONCE // max(Q.shape[1] ** 2, 1), 1)
    for rows in (slice(first, first + size) for first in range(0, len(Q), size)):
        own = rows if len(M) == len(Q) else slice(1)
        solve_rows(M[own], Q[rows], largest[own], tol, Z[rows], found[rows])
    return Z, found
