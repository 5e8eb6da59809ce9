"""Convex linear and quadratic programs by PIQP, whose minimizer and multipliers have
the active set of a basic solution.

The problem is that of a program if signs S = +-1 make S M symmetric, where z_i is a
variable if S_i = 1 and the multiplier of a constraint if S_i = -1: see
`block_form.Blocks.conditions`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.sparse import block_array, csc_matrix, diags_array, eye_array

from lcpcli.clock import imports
from lcpcli.errors import ProblemError
from lcpcli.interrupts import remaining
from lcpcli.linalg.compressed_rows import block, of_arrays
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import (
    column_maxima,
    is_sparse,
    may_be_stiff,
    scaled,
    stack,
    thinned,
)
from lcpcli.linalg.programs import ConvexProgram, PiqpResult, convex_minimum
from lcpcli.linalg.rank_one_blocks import rank_one_blocks
from lcpcli.linalg.shifted_systems import operations, systems
from lcpcli.methods.direct import MAX_AS_DENSE, MAX_NARROW_AS_DENSE, with_M
from lcpcli.methods.interior import (
    CLOSE_MERIT,
    EXCHANGE_ROUNDS,
    FAR_RESIDUAL,
    LARGER_SHIFT,
    PROXIMAL_SHIFT,
    Run,
)
from lcpcli.methods.interior_steps import slack_form
from lcpcli.methods.stages import Breakdown, Finished, Stage, Stalled
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Indices, Mask, Matrix, Vector

# Tolerance of PIQP's residuals: with a larger one, the active set is wrong for a few
# programs in a hundred.
TOLERANCE = 1e-13
# Largest duality gap of PIQP: rounding may keep it from falling further long before the
# residuals.
MAX_GAP = 1e-11
# Numbers in dense matrices for each entry of sparse ones, up to which PIQP is faster
# with dense ones.
MAX_PER_ENTRY = 4.0
INFINITE = 1e30  # PIQP treats numbers of this size and larger ones as infinite
MAX_STEPS = 60  # of PIQP: about twice as many as it usually takes
# Steps on linear programs, for which the simplex method is the other choice; and on
# those that are not large and sparse, up to so many operations of a factorization with
# dense matrices, for which further steps take less time than other methods.
MAX_LINEAR_STEPS = 40
MAX_SMALL_LINEAR_STEPS, MAX_SMALL_OPERATIONS = 100, 3e7
# Condition number of a definite M, scaled to diagonal 1, up to which PIQP is run:
# beyond, the active set of its minimizer is wrong for 36 of 59 beams and frames, below
# for 4 of 57.
MAX_CONDITION = 5e12
# Operations of a factorization with which PIQP, which cannot be interrupted, stops in
# about a second.
MAX_OPERATIONS = 6e7
# Operations with dense matrices in the time of one with sparse ones.
DENSE_SPEEDUP = 15.0
# Operations with dense matrices, in those with sparse ones, with which PIQP usually
# takes less than two seconds; and the seconds that have to remain for each, as PIQP may
# take three times as many steps as usual.
MAX_DENSE_OPERATIONS, SECONDS_OF_OPERATION = 1e8, 5e-8
# Operations with sparse matrices are counted, to compare them with those with dense
# ones, where their bound is above MIN_COUNTED, M has MIN_PER_ROW entries in a row, and
# the bound is MIN_EXCESS times those with dense ones: elsewhere counting, which takes
# up to 0.1 s, may cost more than it saves.
MIN_COUNTED, MIN_PER_ROW, MIN_EXCESS = 1.2e7, 20, 3.0
# How many times as many operations `elimination_operations` counts as factors take:
# more for grids alone.
MAX_EXCESS = 5.0
# On a large linear program, by `patterns.elimination_operations`, for each constraint
# and in all: beyond, the simplex method takes less time, even with eight iterations for
# each constraint, as for qap8, where it usually takes one or two.
MAX_LINEAR_OPERATIONS_PER_ROW = 1e5
MAX_LINEAR_OPERATIONS = 6e8


def convex_program(problem: Problem, max_steps: int | None = None) -> Stage:
    """Yield PIQP's point, if only rounding keeps it from solving the problem, then the
    basic solution of its active set, and those after block pivots on infeasibilities.
    max_steps : steps of PIQP, by default MAX_STEPS, or for a linear program
    MAX_LINEAR_STEPS, or MAX_SMALL_LINEAR_STEPS if it is small.

    Finished : one of them has no infeasibility beyond rounding. Breakdown : the problem
    is not that of a convex program, or too large for PIQP, or a linear program that the
    simplex method solves in less time, or PIQP finds no minimum.
    Stalled : no basic solution solves it.
    """
    is_large = is_sparse(problem.M) and problem.n > MAX_AS_DENSE
    given = problem.M
    problem = with_M(problem, thinned(problem.M, problem.M.size))
    S = problem.signs
    if S is not None and (S > 0).all() and may_be_stiff(problem.M):
        return (yield from _bounded(problem))
    diagonal = problem.M.diagonal()
    if S is None or not (S < 0).any() or diagonal.min() < 0:
        return Breakdown("the problem is not that of a convex program")
    # With other M, the simplex method is no early attempt.
    may_take_simplex = is_large and not diagonal.any() and _is_linear(problem.M, S)
    if may_take_simplex and _takes_longer_than_simplex(problem, S):
        return Breakdown("the simplex method takes less time")
    try:
        run = Run(problem, by_units=True)
        within = run.within
        counted = cache(lambda: operations(systems(within.problem.M, within.S)))
        max_operations = _operation_bound(problem.M, S < 0, MAX_OPERATIONS)
        is_dense = _is_faster_if_dense(problem, S, max_operations, counted)
        if (
            max_operations > MAX_OPERATIONS
            and not is_dense
            and counted() > MAX_OPERATIONS
        ):
            return Breakdown("a factorization takes long")
    except (ProblemError, SingularMatrix):
        return Breakdown("no factorization succeeded")
    # A semidefinite Q with a diagonal of zeros is 0.
    if max_steps is None and not diagonal.any():
        is_small = _dense_operations(S) <= MAX_SMALL_OPERATIONS and (
            not is_large or _is_filled(problem.M, S)
        )
        max_steps = MAX_SMALL_LINEAR_STEPS if is_small else MAX_LINEAR_STEPS
    is_array = problem.n <= MAX_NARROW_AS_DENSE and not is_sparse(given)
    filled = given if is_array and _is_filled(problem.M, S) else None
    minimizer = _minimizer(problem, S, max_steps or MAX_STEPS, is_dense, filled)
    if minimizer is None:
        return Breakdown("PIQP returned no minimizer")
    z, is_accurate = minimizer
    if not (is_accurate or run.residual(z) <= CLOSE_MERIT):
        return Breakdown("PIQP returned no minimizer")
    x = (z - problem.w(z)) / 2
    # With the first shift, pivoting stays closer to z where there are several
    # solutions.
    for shift in (LARGER_SHIFT, PROXIMAL_SHIFT):
        ending = yield from run.at_point(x, EXCHANGE_ROUNDS, FAR_RESIDUAL, z, shift)
    return ending


def _bounded(problem: Problem) -> Stage:
    """Yield the basic solution of the active set of PIQP's minimizer within bounds, for
    a definite M, if it has no infeasibility after a few block pivots.

    Other basic solutions of a stiff M are not yielded, as they may meet the tolerance
    with a wrong active set. PIQP is several times as fast as `definite`, which follows
    where residuals in double precision do not show the active set."""
    with imports:
        from lcpcli.linalg.definite_systems import condition
        from lcpcli.methods.definite import Exchanges
    try:
        within = slack_form(problem, "diagonal")
        inner = within.problem
        if condition(inner.M) > MAX_CONDITION:
            return Breakdown(
                "PIQP's accuracy in double precision does not determine the basis"
            )
        exchanges = Exchanges(within)
        Q, n = csc_matrix(inner.M), inner.n
        empty, none = csc_matrix((0, n)), np.zeros(0)
        program = ConvexProgram(
            Q, inner.q, (empty, none), (empty, none, none), inner.box.vectors(n)
        )
        ended = convex_minimum(program, TOLERANCE, MAX_STEPS, MAX_GAP)
        if ended.status != "PIQP_SOLVED":
            return Breakdown("PIQP returned no minimizer")
        x = (ended.x - ended.of_bounds) / 2
        for basic_solution in exchanges.from_states(inner.box.basis_of(x)):
            if basic_solution.signs_final:
                yield basic_solution
                return Finished()
    except (ProblemError, SingularMatrix):
        return Breakdown("no factorization succeeded")
    return Stalled("the basis of PIQP's minimizer is not that of the solution")


def _is_linear(M: Matrix, S: Vector) -> bool:
    """Return whether the program is linear: whether M, for which S M is symmetric, has
    no entry of two variables, or of two multipliers."""
    owners = np.repeat(S, np.diff(M.indptr))
    return bool((owners != S[M.indices]).all())


def _takes_longer_than_simplex(problem: Problem, S: Vector) -> bool:
    """Return whether PIQP takes longer on a linear program than the simplex method."""
    most = min(
        MAX_LINEAR_OPERATIONS_PER_ROW * float(np.count_nonzero(S < 0)),
        MAX_LINEAR_OPERATIONS,
    )
    max_operations = _operation_bound(problem.M, S < 0, 2 * most)
    # For most programs the bound, which takes less time than counting, is enough.
    return (
        max_operations > 2 * most
        and problem.facts.elimination_operations > most
        and not _is_faster_if_dense(problem, S, max_operations, lambda: 0.0)
    )


def _is_faster_if_dense(
    problem: Problem,
    S: Vector,
    max_operations: float,
    counted: Callable[[], float],
) -> bool:
    """Return whether PIQP takes less time with dense matrices than with sparse ones,
    and no more than remains until the time limit.

    max_operations, counted : a bound on the operations with sparse matrices, and their
    number, or 0 to leave this open.
    """
    M, n = problem.M, S.size
    of_dense = _dense_operations(S)
    has_long_rows = M.nnz >= MIN_PER_ROW * n
    if (
        max_operations <= (MIN_COUNTED if has_long_rows else MAX_OPERATIONS)
        or of_dense > MAX_DENSE_OPERATIONS
        or MIN_EXCESS * of_dense > max_operations
        or SECONDS_OF_OPERATION * of_dense > remaining()
        or rank_one_blocks(M, S) is not None
    ):
        return False
    # The operations are the sum of the squares of the lengths of n columns of L, which
    # are at least n times the square of their mean; and L has the entries of M below
    # the diagonal.
    if ((M.nnz - n) / 2) ** 2 / n >= of_dense:
        return True
    by_length = problem.facts.elimination_operations
    return by_length >= of_dense and (
        by_length >= MAX_EXCESS * of_dense or counted() >= of_dense
    )


def _is_filled(M: Matrix, S: Vector) -> bool:
    """Return whether the matrices of the program have so few zeros that dense ones are
    faster: at least half of the entries of M are theirs."""
    k = np.count_nonzero(S > 0)
    return bool(S.size * k <= MAX_PER_ENTRY * M.nnz / 2)


def _dense_operations(S: Vector) -> float:
    """Return the operations of a factorization of Q + G'DG with dense matrices, in
    those with sparse ones that take as long."""
    rows = int(np.count_nonzero(S < 0))
    k = S.size - rows
    return (k / 3 + rows) * k**2 / DENSE_SPEEDUP


def _operation_bound(M: Matrix, is_row: Mask, enough: float) -> float:
    """Return a bound, but for lower terms, on the operations of a factorization: one
    that eliminates the constraints first, or the variables without entries of Q off the
    diagonal, and fills the rest; if that takes more than `enough`, one that fills the
    envelope of the rest in the reverse Cuthill-McKee order."""
    counts = np.diff(M.indptr)
    n = M.shape[0]
    rows = int(np.count_nonzero(is_row))
    operations_of_rows = float(np.square(counts, dtype=np.float64).sum())
    operations: float = operations_of_rows + (n - rows) ** 3 / 3
    if operations <= enough:
        return operations
    of_Q = counts - np.bincount(M.indices[np.repeat(is_row, counts)], minlength=n)
    first = ~is_row & (of_Q <= (M.diagonal() != 0))
    operations = operations_of_rows + (n - int(np.count_nonzero(first))) ** 3 / 3
    if operations <= enough:
        return operations
    with imports:
        from scipy.sparse.csgraph import reverse_cuthill_mckee
    order = reverse_cuthill_mckee(M, symmetric_mode=True)
    order = order[~first[order]]
    positions = np.full(n, n)
    positions[order] = np.arange(order.size)

    def least_of_rows(values: Indices) -> Indices:
        minima = np.minimum.reduceat(np.append(values[M.indices], n), M.indptr[:-1])
        return np.asarray(np.where(counts > 0, minima, n))

    nearest = least_of_rows(np.where(first, least_of_rows(positions), positions))
    widths = np.maximum(positions - nearest, 0)[order] + 1
    return float(
        np.square(np.concatenate((widths, counts[first])), dtype=np.float64).sum()
    )


def _has_others(problem: Problem, is_row: Mask) -> bool:
    """Return whether M has entries in rows and columns of constraints, which no program
    has."""
    multipliers = is_row.nonzero()[0]
    return (
        problem.block_form is None
        and block(problem.M, multipliers, multipliers)[1].size > 0
    )


def _range_rows(problem: Problem) -> tuple[Indices, Indices]:
    """Return the unknowns that are values of rows between two bounds, and these rows,
    which PIQP takes without further variables."""
    form, M, n = problem.block_form, problem.M, problem.n
    count = 0 if form is None else form.ranges
    rows = M.indices[M.indptr[n - count] :]
    count = count if rows.size == count else 0
    return np.arange(n - count, n), rows[:count]


def _with_even_ranges(G: Matrix, is_range: Mask) -> tuple[Matrix, Vector]:
    """Return FG and the diagonal of F, with which the largest entry of a row between
    two bounds is about 1: PIQP's tolerance grows with the largest side of a row, and
    large entries have large sides."""
    factors = np.ones(is_range.size)
    if not is_range.any():
        return G, factors
    sizes = column_maxima(G.T)
    is_range = is_range & (sizes > 0)
    factors[is_range] = np.exp2(-np.rint(np.log2(sizes[is_range])))
    return scaled(G.T, np.ones(G.shape[1]), factors).T, factors


def _minimizer(
    problem: Problem,
    S: Vector,
    max_steps: int,
    is_dense: bool,
    filled: Matrix | None,
) -> tuple[Vector, bool] | None:
    """Return the minimizer and the multipliers, both approximate, and whether PIQP
    reached its tolerance; None if there are none, or M has more entries than that of a
    program, or PIQP would take a bound for none.

    is_dense : whether PIQP is given dense matrices even if they have many zeros.
    filled : M as an array, if PIQP is given parts of this; else None.
    """
    M, q, lower, upper = conditions_of(problem)
    is_row, is_equation = S < 0, (S < 0) & np.isinf(lower) & np.isinf(upper)
    values, ranged = _range_rows(problem)
    is_equation[ranged] = False
    # A multiplier from its only bound; fixed variables would have no interior.
    z: Vector = np.where(lower == upper, lower, 0.0)
    for one, other in ((lower, upper), (upper, lower)):
        is_only = is_row & np.isfinite(one) & np.isinf(other)
        z[is_only] = one[is_only]
    sides = lower[is_row] - z[is_row], upper[is_row] - z[is_row]
    if not all(((side == 0) | np.isinf(side)).all() for side in sides):
        return None
    q = problem.w(z) if z.any() else q
    low = np.where(upper > z, -q, -np.inf)
    high = np.where(lower < z, -q, np.inf)
    low[ranged] += lower[values]
    high[ranged] += upper[values]
    # PIQP prints a line about other rows.
    has_side = is_row & ~is_equation & (np.isfinite(low) | np.isfinite(high))
    is_x = ~is_row & (lower < upper)
    finite_bounds = (v[is_x & np.isfinite(v)] for v in (lower, upper))
    is_x[values] = False
    x, equations, rows = (each.nonzero()[0] for each in (is_x, is_equation, has_side))
    largest = max(float(np.abs(v).max(initial=0.0)) for v in (q, *finite_bounds))
    if not largest < INFINITE or not x.size or _has_others(problem, is_row):
        return None
    if filled is not None:
        Q, A, G = (filled[np.ix_(each, x)] for each in (x, equations, rows))
    else:
        blocks = [block(M, x, each) for each in (x, equations, rows)]
        Q, A, G = (
            of_arrays((each.size, x.size), indptr, indices, sign * data, csc_matrix)
            for sign, each, (indptr, indices, data) in zip(
                (1, -1, -1), (x, equations, rows), blocks, strict=True
            )
        )
    G, factors = _with_even_ranges(G, np.isin(rows, ranged))
    program = ConvexProgram(
        Q=Q,
        c=q[x],
        equations=(A, -q[equations]),
        rows=(G, factors * low[rows], factors * high[rows]),
        bounds=(lower[x], upper[x]),
    )
    ended = _minimum(program, max_steps, is_dense)
    z[x], z[equations] = ended[:2]
    z[rows] += factors * ended.of_rows
    if values.size:
        z[values] = np.clip(problem.w(z)[ranged], lower[values], upper[values])
    has_minimum = "INFEASIBLE" not in ended.status and bool(np.isfinite(z).all())
    return (z, ended.status == "PIQP_SOLVED") if has_minimum else None


def _minimum(program: ConvexProgram, max_steps: int, is_dense: bool) -> PiqpResult:
    """Return the result of `convex_minimum` for arrays or csc_matrices. With blocks U D
    U' of rank one in these, the sums v = U'x are further variables, with the costs v'Dv
    / 2."""
    Q, c, equations, rows, bounds = program
    A, b = equations
    G, *sides = rows
    n = c.size
    if not is_sparse(Q):
        return convex_minimum(program, TOLERANCE, max_steps, MAX_GAP)
    blocks = rank_one_blocks(Q, np.ones(n))
    if blocks is not None:
        zeros = np.zeros(blocks.D.size)
        sums = blocks.U.T, -eye_array(zeros.size)
        Q = block_array([[blocks.rest, None], [None, diags_array(blocks.D)]])
        A = stack([[A, csc_matrix((b.size, zeros.size))], [*sums]])
        G = stack([[G, csc_matrix((sides[0].size, zeros.size))]])
        Q, A, G = (csc_matrix(each) for each in (Q, A, G))
        c, b = (np.concatenate((each, zeros)) for each in (c, b))
        bounds = (
            np.concatenate((bounds[0], zeros - np.inf)),
            np.concatenate((bounds[1], zeros + np.inf)),
        )
    lines = c.size + b.size + sides[0].size
    if is_dense or lines * c.size <= MAX_PER_ENTRY * (Q.nnz + A.nnz + G.nnz):
        Q, A, G = (each.toarray() for each in (Q, A, G))
    program = ConvexProgram(Q, c, (A, b), (G, *sides), bounds)
    ended = convex_minimum(program, TOLERANCE, max_steps, MAX_GAP)
    of_equations = ended.of_equations[: equations[1].size]
    return ended._replace(x=ended.x[:n], of_equations=of_equations)
