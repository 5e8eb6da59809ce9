"""Derivatives of solutions: how z and w = M z + q change with M, q and the bounds.

With B the variables strictly between their bounds and N those at a bound with w != 0,
the basis does not change under small changes of the data, and for changes dM, dq, dl,
du

    dz_N = dl_N or du_N,    dz_B = -M_BB^-1 ((dM z + dq)_B + M_BN dz_N),
    dw = dM z + dq + M dz.

For a function of z with gradient g, one system yields the derivatives with respect to
all data: with lambda_B = -M_BB'^-1 g_B, and 0 elsewhere, they are lambda z' for M,
lambda for q, and (g + M' lambda)_N for the bounds.

If M_BB is singular, as that of redundant contacts is, z is one of several solutions,
which differ by v with M_BB v_B = 0. They have the same J z if J v = 0 for all such v.
The derivative of J z is then J dz, by any generalized inverse of M_BB, for changes that
leave the equations consistent; and for g = J'h there is a lambda.

Variables K at a bound with w = 0 are at a kink. If the solution is strongly regular,
which means that the Schur complement S = M_KK - M_KB M_BB^-1 M_BK is a P-matrix, the
solution close to z is a piecewise smooth function of the data, and its directional
derivative solves a mixed problem in dz with dz_N as above and, for K, bounds dl_K or
du_K on the side of the bound: S. M. Robinson, Strongly regular generalized equations,
Mathematics of Operations Research 5 (1980) 43-62; R. W. Cottle, J.-S. Pang, R. E.
Stone, The Linear Complementarity Problem (1992), section 7.3; F. Facchinei, J.-S. Pang,
Finite-Dimensional Variational Inequalities and Complementarity Problems (2003), chapter
5.

The solution is recomputed for its basis, with a correction by w_B, so that its errors
are those of rounding. A component is considered to be at a kink if it is at a bound and
w is 0, both up to rounding: up to the largest change that it undergoes when each row of
M z + q changes by ROW_ROUNDING times its terms |M| |z| + |q|, with SAMPLES random
choices of the signs. Like these terms, this does not depend on the scaling of the data,
and it grows with the condition number of M_BB.

In a batch, the solutions that a crude bound proves to have no kinks and a nonsingular
M_BB are treated all at once, with the inverses of M_BB embedded in matrices of shape
(n, n); the others are treated one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import product as product_of
from typing import Any, NamedTuple, TypeVar

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import DerivativeError, ParameterError, ProblemError, unknown
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING, distinct, generic
from lcpcli.linalg.factors import (
    SingularMatrix,
    TwoWay,
    each_product,
    principal_inverses,
    solver,
)
from lcpcli.linalg.matrices import (
    absolute_product,
    dense,
    product,
    scaled,
)
from lcpcli.linalg.programs import Pair, minimized
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.linalg.units import (
    MIN_DIGITS,
    MIN_SINGULAR_VALUE,
    PseudoInverse,
    largest_growth,
)
from lcpcli.model.arrays import FROM_0, as_matrix, as_square, as_vector, by_names
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.model.right_hand_sides import Stack, as_stack
from lcpcli.solving.derivatives import (
    BatchDerivative,
    BatchGradient,
    Derivative,
    Gradient,
    OneDerivative,
    OneGradient,
)
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Mask, Matrix, Vector, VectorLike
from lcpcli.verify.digits import signs, state_slacks

# Kinks up to which S is classified before M: its principal minors take milliseconds.
FEW_KINKS = 10
# Kinks whose choices are examined one by one, to see whether solutions differ there.
FEW_CHOICES = 6
# J_i v of directions v of size 1, relative to |J_i|_1, from which on it is not 0: the
# linear programs have a tolerance of 1e-10.
MOVED = 1e-6
MAX_MINORS = 20_000  # limit on principal minors and other steps of an inspection of S
# Limit on corrections of the basis, if the corrected z violates its conditions: a
# verified z needs few of them.
MAX_EXCHANGES = 10
# The number of corrections of z; a change smaller than this, relatively, has an error
# at the level of rounding.
CORRECTIONS, SMALL_CHANGE = 2, 1e-8
# Variables of a singular block up to which a dense generalized inverse is computed.
MAX_DENSE = 2000
# Components whose distance from a kink exceeds a crude bound on rounding errors by this
# factor need no accurate bound.
CLEAR = 1e3
UNSOLVED = ("raise", "nan")

BatchRecord = TypeVar("BatchRecord", BatchGradient, BatchDerivative)


@with_limited_threads
@np.errstate(all="ignore")
def gradient(
    problem: Problem, result: Result, g: VectorLike, J: Any = None
) -> OneGradient:
    """Return the derivatives of a function of z with the gradient g, shape (n,), at a
    result of the problem; if J is not None, of a function of J z with the gradient g,
    shape (k,).
    """
    rows = None if J is None else _rows(J, problem.n)
    if rows is None:
        (g,) = by_names(lambda: problem.names, g=g)
    g_of_z = as_vector(
        "g",
        g,
        problem.n if rows is None else rows.shape[0],
        "unknown" if rows is None else "row of J",
    )
    if not g_of_z.any():  # the derivatives are 0 even if the solution has none
        zeros, none = np.zeros(problem.n), np.zeros(problem.n, dtype=bool)
        return Gradient(zeros, problem.M, zeros, zeros, none, none, [])
    at = linearization(result, J is not None)
    if rows is not None:
        _refuse_undetermined(at, rows)
        g_of_z = product(rows.T, g_of_z)
    by_q, basic = np.zeros(problem.n), np.zeros(problem.n, dtype=bool)
    by_q[at.basic] = 0.0 - at.solve(g_of_z[at.basic], transposed=True)
    basic[at.basic] = True
    return Gradient(
        finite(by_q), problem.M, at.z, g_of_z, basic, at.upper, at.kinks.tolist()
    )


@with_limited_threads
@np.errstate(all="ignore")
def derivative(
    problem: Problem,
    result: Result,
    changes: Mapping[str, Any],
    one_sided: bool,
    J: Any,
) -> OneDerivative:
    """Return the derivative of the solution, or of J z, in the direction of these
    changes, each of which may be None for no change.
    """
    (dM,) = by_names(lambda: problem.names, dM=changes["dM"])
    (dM,) = by_names(lambda: problem.names, "columns", dM=dM)
    at = linearization(result, J is not None)
    rows = None if J is None else _rows(J, problem.n)
    if rows is not None:
        _refuse_undetermined(at, rows)
    dq, *bound_changes = by_names(
        lambda: problem.names,
        **{name: changes[name] for name in ("dq", "dlower", "dupper")},
    )
    change = (
        np.zeros(problem.n) if dq is None else as_vector("dq", dq, problem.n).copy()
    )
    if dM is not None:
        change += product(as_square("dM", dM, problem.n)[0], at.z)
    names = "dlower", "dupper"
    moves = [
        d if d is None else as_vector(name, d, problem.n)
        for name, d in zip(names, bound_changes, strict=True)
    ]
    dz = moved_bounds(problem.box, at.upper, *moves)
    dz[at.basic] = 0.0
    right = product(problem.M, dz) + change
    leaves_kinks = one_sided and at.kinks.size > 0
    if rows is not None and not leaves_kinks:
        terms = absolute_product(problem.M, np.abs(dz)) + np.abs(change)
        if dM is not None:
            terms += absolute_product(as_square("dM", dM, problem.n)[0], np.abs(at.z))
        at.refuse_contradiction(right, terms)
    dz[at.basic] = 0.0 - at.solve(right[at.basic])
    regular = True if at.block is None else None
    if at.kinks.size:
        same_M = rows if dM is None else None  # another M may not be monotone
        regular = _leave_kinks(at, dz, change, same_M) if one_sided else None
    dw = product(problem.M, dz) + change
    dw[at.basic] = 0.0
    if rows is not None:
        dz, dw = product(rows, dz), np.where(at.determines(problem.M), dw, np.nan)
    return Derivative(finite(dz), dw, at.kinks.tolist(), regular)


def _rows(J: Any, n: int) -> Matrix:
    """Return J, of shape (k, n), or raise ProblemError."""
    rows = as_matrix("J", J)
    if rows.shape[1] != n:
        raise ProblemError(
            "J",
            f"has shape {tuple(rows.shape)}",
            f"give rows of {n} numbers, one for each unknown",
        )
    return rows


def _refuse_undetermined(at: Linearization, J: Matrix) -> None:
    """Raise DerivativeError if J z differs among the solutions."""
    is_determined = at.determines(J)
    if is_determined.all() and at.kinks.size:
        is_determined = ~at.differs_beyond_kinks(J)
    for i in (~is_determined).nonzero()[0][:1].tolist():
        reason = f"z is one of several solutions, which differ in J z, in row {i} of J"
        raise DerivativeError("", f"no derivative: {reason} {FROM_0}")


def _cones(A: Vector, n_basic: int) -> Iterator[tuple[Vector, Pair, Pair]]:
    """Yield the directions u of `differs_beyond_kinks`, up to a size of 1, as rows with
    their sides and the bounds of u: u is free for the first variables, with (A u)_i =
    0, and u_i >= 0 and (A u)_i >= 0 for the others, one of which is 0."""
    size = A.shape[0]
    is_kink = np.arange(size) >= n_basic
    low = np.where(is_kink, 0.0, -1.0)
    with imports:
        from lcpcli.inspection.classes import definiteness
        from lcpcli.inspection.verdict import YES
    if definiteness(A + A.T).semidefinite == YES:
        high = np.append(np.where(is_kink, np.inf, 0.0), np.zeros(size))
        rows = np.concatenate((A, A + A.T))
        yield rows, (np.zeros(2 * size), high), (low, np.ones(size))
        return
    if size - n_basic > FEW_CHOICES:
        return
    for choice in product_of((False, True), repeat=size - n_basic):
        stays = np.append(np.zeros(n_basic, dtype=bool), choice).astype(bool)
        sides = np.zeros(size), np.where(stays, np.inf, 0.0)
        yield A, sides, (low, np.where(stays, 0.0, 1.0))


def moved_bounds(
    box: Box, upper: Mask, dlower: Vector | None, dupper: Vector | None
) -> Vector:
    """Return the changes of upper bounds for z at them, and of lower bounds otherwise;
    raise ProblemError if an infinite bound changes, or equal bounds change differently.
    """
    low, high = (
        np.zeros(upper.shape) if moves is None else moves for moves in (dlower, dupper)
    )
    for name, moves, bound in (("lower", low, box.lower), ("upper", high, box.upper)):
        for at in np.argwhere(np.isinf(bound) & (moves != 0))[:1].tolist():
            reason = f"is {moves[tuple(at)]:g}, but there is no such bound"
            raise ProblemError(
                f"d{name}{_position_text(at)}", reason, f"give 0 {FROM_0}"
            )
    for at in np.argwhere(box.fixed & (low != high))[:1].tolist():
        position, values = _position_text(at), (low[tuple(at)], high[tuple(at)])
        reason = (
            f"is {values[0]:g} and dupper{position} is {values[1]:g}, but "
            f"lower{position} = upper{position}"
        )
        raise ProblemError(
            f"dlower{position}", reason, f"move both by the same {FROM_0}"
        )
    return np.where(upper, high, low)


def _position_text(indices: list[int]) -> str:
    return "".join(f"[{i}]" for i in indices)


def _leave_kinks(
    at: Linearization, dz: Vector, change: Vector, J: Matrix | None
) -> bool | None:
    """Change dz from the derivative with all kinks held at their bounds to the
    one-sided one. Return True if S is proved to be a P-matrix, so that this is the only
    one, otherwise None. Raise DerivativeError if S is no P-matrix and J z need not be
    the same for all solutions, or if no derivative was computed.

    With dz_K = (change of the bound) + D y for the signs D = 1 at lower bounds and -1
    at upper ones, y solves the LCP with the matrix D S D and the vector D (dw)_K, where
    dw is that for y = 0. All this is equilibrated by powers of two R, C, as R S C is a
    P-matrix if and only if S is.
    """
    M = at.problem.M
    B = at.basic
    K = at.kinks
    if at.block is not None:  # there is no S, but J z may be unique
        _move_together(at, dz, change)
        return None
    R, C = at.problem.units.diagonals()
    columns, D = dense(M[:, K]) * C[K], np.where(at.upper[K], -1.0, 1.0)
    through = at.solve(columns[B])
    S = R[K, np.newaxis] * (columns[K] - at.image(through)[K])
    regular: bool | None = True
    both = distinct(np.concatenate((B, K)))
    if K.size <= FEW_KINKS or not _is_p_matrix(
        scaled(M[both][:, both], R[both], C[both])
    ):  # then S is one too
        regular = _is_p_matrix(S, R[K] * _rounding(at, columns, through))
    if regular is False and (J is None or not at.has_one_image(J)):
        several = (
            "so that problems close to this one have several solutions close to z, "
            "or none"
        )
        raise DerivativeError(
            "", f"no derivative, as the solution is not strongly regular, {several}"
        )
    if not regular:  # S may be singular, and then its rounding may decide
        _move_together(at, dz, change)
        return None
    y = _solution(
        Problem(D[:, np.newaxis] * S * D, D * R[K] * (product(M, dz) + change)[K])
    )
    dz[K] += D * C[K] * y
    dz[B] -= through @ (D * y)
    return regular


def _move_together(at: Linearization, dz: Vector, change: Vector) -> None:
    """Change dz to a one-sided derivative by the mixed problem for B and K at once;
    raise DerivativeError if there is none.

    If equations w_B = 0 follow from others, which may hold kinks at their bounds,
    rounding would make them independent: they are dropped, with their variables. This
    loses nothing for a monotone M: if u has (u_B)'M_BP = 0 for P, the union of B and K,
    then u'M_PP u = 0, and (M_PP + M_PP')u = 0, so that M_PP u = 0, and z + u is a
    solution as well.
    """
    problem, B = at.problem, at.basic
    left_out = B[:0] if at.block is None else at.dependent_equations()
    dz[B] = 0.0
    is_free, is_moved = np.zeros((2, problem.n), dtype=bool)
    is_free[B] = is_moved[B] = is_moved[at.kinks] = True
    is_moved[left_out] = False
    P = np.flatnonzero(is_moved)
    is_free = is_free[P]
    R, C = (D[P] for D in problem.units.diagonals())
    D = np.where(at.upper[P] & ~is_free, -1.0, 1.0)
    rows = (product(problem.M, dz) + change)[P]
    lower = np.where(is_free, -np.inf, 0.0)
    M = scaled(problem.M[P][:, P], D * R, D * C)
    dz[P] += D * C * _solution(Problem(M, D * R * rows, lower=lower))
    remainder = np.abs(product(problem.M, dz) + change)
    terms = absolute_product(problem.M, np.abs(dz)) + np.abs(change)
    if (remainder > SMALL_CHANGE * terms)[left_out].any():
        raise contradiction()


def _solution(problem: Problem) -> Vector:
    """Return the solution of a problem whose unknowns are changes; raise
    DerivativeError if there is none.
    """
    with imports:
        from lcpcli.solving.call import run
    result = run(problem)
    if not result.solved:
        raise DerivativeError(
            "", f"no derivative could be computed in this direction: {result.message}"
        )
    return result.z


def _rounding(at: Linearization, columns: Vector, through: Vector) -> Vector:
    """Return the effect of rounding errors on the rows of M_KK - M_KB M_BB^-1 M_BK,
    estimated with random signs.
    """
    M = at.problem.M
    B = at.basic
    K = at.kinks
    if not B.size:
        return np.zeros(K.size)
    full = np.zeros_like(columns)
    full[B] = np.abs(through)
    terms = ROW_ROUNDING * absolute_product(M, full)
    moved = at.solve(
        (terms + ROW_ROUNDING * np.abs(columns))[B] * signs(B.size, K.size)
    )
    return np.asarray((terms[K] + np.abs(at.image(moved)[K])).sum(axis=1))


def _is_p_matrix(S: Matrix, rounding: Vector | None = None) -> bool | None:
    """Return whether S is a P-matrix, if that is proved for all changes of its diagonal
    up to `rounding`; otherwise None.
    """
    with imports:
        from lcpcli.inspection.verdict import NO, YES, classify
    cases = (
        [S]
        if rounding is None or not rounding.any()
        else [S - np.diag(rounding), S + np.diag(rounding)]
    )
    words = [classify(case, "p_matrix", MAX_MINORS)["p_matrix"].word for case in cases]
    if words[0] == YES:
        return True
    return False if words[-1] == NO else None


def finite(dz: Vector) -> Vector:
    """Return a derivative; raise DerivativeError if it overflows."""
    if not np.isfinite(dz).all():
        raise DerivativeError(
            "", "the derivative is beyond the range of double precision"
        )
    return dz


def linearization(result: Result, or_singular: bool) -> Linearization:
    """Return the linearization at a solution, which is stored in the result; raise
    DerivativeError if there is none. or_singular : whether M_BB may be singular.
    """
    stored: Linearization
    for stored in result.linearizations:
        if or_singular or stored.block is None:
            return stored
    if not result.solved:
        raise DerivativeError(
            "",
            f"no derivative, as the problem is not solved: {result.message}",
            result.advice,
        )
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        new = Linearization(result.problem, result.z, or_singular)
    result.linearizations.append(new)
    return new


def contradiction() -> DerivativeError:
    """Return the error for changes that make the equations w_B = 0 inconsistent."""
    reason = "M, q and the bounds change so that equations w = 0 contradict each other"
    return DerivativeError(
        "",
        f"no derivative in this direction: {reason}, and one of them has to give way",
    )


class Linearization:
    """A solution with its basis, and systems with M_BB.

    z : the solution, shape (n,), corrected.
    basic : the indices B of the components between their bounds, where w = 0 and
        remains 0.
    kinks : the indices of those at a bound with w = 0, up to rounding, which may leave
        the bound or not.
    upper : whether z is at its upper bound, shape (n,); for equal bounds, whether w <
        0.
    block : the generalized inverse of M_BB if that is singular, and allowed to be;
        otherwise None.
    """

    block: PseudoInverse | None = None
    _factors: TwoWay

    def __init__(self, problem: Problem, z: Vector, or_singular: bool) -> None:
        self.problem = problem
        self.z = z
        self._or_singular = or_singular
        self._low, self._high = problem.box.lower, problem.box.upper
        basic = (z > self._low) & (z < self._high)
        kinks = np.zeros(problem.n, dtype=bool)
        for _ in range(MAX_EXCHANGES):
            at_kink, infeasible = self._corrected(basic)
            kinks |= at_kink
            infeasible &= ~kinks
            if not (infeasible.any() or (kinks & basic).any()):
                break
            basic = (basic ^ infeasible) & ~kinks
        else:
            raise DerivativeError(
                "",
                "no derivative, as rounding leaves open which variables are at a bound",
            )
        self.kinks = kinks.nonzero()[0]
        self.upper = ~basic & np.where(
            problem.box.fixed, self._w < 0, self.z == self._high
        )

    def _corrected(self, basic: Mask) -> Vector:
        """Compute z for this basis; return which components satisfy their conditions
        only up to rounding, and which violate them, shape (2, n).
        """
        upper = self._high - self.z < self.z - self._low
        start = np.where(basic, self.z, np.where(upper, self._high, self._low))
        self.z, self.block = start.copy(), None
        B = self.basic = basic.nonzero()[0]
        try:
            stored_factors = self.problem.latest.stored_factors
            if not B.size:
                self._factors = lambda b, _=False: b
            elif stored_factors is not None and np.array_equal(stored_factors[0], B):
                self._factors = stored_factors[1]
            else:
                self._factors = solver(self.problem.M[B][:, B])
            return self._kinks_and_infeasible(basic)
        except SingularMatrix:
            block = self._generalized(B) if self._or_singular else None
            if block is None or not block.is_singular:
                reason = (
                    f"the principal submatrix of the {B.size} variables between "
                    "their bounds is singular"
                )
                several = "so that z is one of several solutions, or may jump"
                raise DerivativeError(
                    "", f"no derivative: {reason}, {several}"
                ) from None
        self.z = start
        self._factors = block
        self.block = block
        return self._kinks_and_infeasible(basic)

    def _kinks_and_infeasible(self, basic: Mask) -> Vector:
        """Correct z, and return which components satisfy their conditions only up to
        rounding, and which violate them, shape (2, n); raise SingularMatrix.
        """
        problem = self.problem
        z = self.z
        B = self.basic
        w = self._w = problem.w(z)
        change = self._factors(w[B])
        z[B] -= change
        if self.block is None:
            moves = self._factors(generic(B.size))
            full = np.zeros((2, z.size))
            full[:, B] = np.abs((change, moves))
            slacks = state_slacks(problem.box, z, w, basic)
            corrected = Corrected(z, basic, slacks, full[0], full[1])
            if are_clear(corrected, problem.largest, problem.sizes_of_q[1]):
                return np.zeros((2, problem.n), dtype=bool)
        for _ in range(CORRECTIONS):
            self._w = problem.w(z)
            change = self._factors(self._w[B])
            z[B] -= change
        noise, slacks = self._noise(), state_slacks(problem.box, z, self._w, basic)
        return np.array((np.abs(slacks) <= noise, slacks < -noise))

    def _noise(self) -> Vector:
        """Return the effect of rounding errors on basic z_i and on the other w_i, shape
        (n,); raise SingularMatrix if M_BB is singular to working precision.
        """
        M = self.problem.M
        q = self.problem.q
        z = self.z
        B = self.basic
        changes = (
            ROW_ROUNDING
            * (absolute_product(M, np.abs(z)) + np.abs(q))[:, np.newaxis]
            * signs(z.size)
        )
        if B.size and self.block is None:
            growth = largest_growth(M[B][:, B], self._factors)
            if not growth * ROW_ROUNDING < MIN_DIGITS:
                raise SingularMatrix
        if B.size:
            moved = self._factors(changes[B])
            changes -= self.image(moved)
            changes[B] = np.abs(moved) + EPS * np.abs(z[B, np.newaxis])
        return np.asarray(np.abs(changes).max(axis=1))

    def solve(self, b: Vector, transposed: bool = False) -> Vector:
        """Return M_BB^-1 b, or M_BB'^-1 b, with one step of refinement, for b of shape
        (k,) or (k, m)."""
        x = self._factors(b, transposed)
        return np.asarray(
            x + self._factors(b - self.image(x, transposed)[self.basic], transposed)
        )

    def image(self, x: Vector, transposed: bool = False) -> Vector:
        """Return M v, or M'v, shape (n,) or (n, m), for v_B = x and 0 elsewhere."""
        v = np.zeros((self.problem.n, *x.shape[1:]))
        v[self.basic] = x
        return product(self.problem.M.T if transposed else self.problem.M, v)

    @cached_property
    def _active(self) -> tuple[Indices, PseudoInverse | None]:
        """Return the variables with w = 0 and, if their block of M is singular, its
        generalized inverse, else None.
        """
        if not self.kinks.size:
            return self.basic, self.block
        S = distinct(np.concatenate((self.basic, self.kinks)))
        inverse = self._generalized(S)
        return S, inverse if inverse is not None and inverse.is_singular else None

    def _generalized(self, P: Indices) -> PseudoInverse | None:
        """Return the generalized inverse of M_PP; None if it is too large, or
        overflows.
        """
        with suppress(SingularMatrix):
            return (
                PseudoInverse(np.asarray(dense(self.problem.M[P][:, P])))
                if P.size <= MAX_DENSE
                else None
            )
        return None

    def determines(self, J: Any) -> Mask:
        """Return for which rows J_i of J, shape (k, n), J_i z is the same for all
        solutions that have w = 0 at the same indices as z.
        """
        S, block = self._active
        return (
            np.ones(J.shape[0], dtype=bool)
            if block is None
            else block.determines(dense(J[:, S]))
        )

    def differs_beyond_kinks(self, J: Any) -> Mask:
        """Return for which rows J_i of J, shape (k, n), J_i z differs among the
        solutions, as these leave z in a direction v in which some kinks stop to be
        kinks.

        With D = 1 at lower and -1 at upper bounds, D v_K >= 0, D (M v)_K >= 0, (M v)_B
        = 0 and v'M v = 0, and v is 0 elsewhere: a homogeneous mixed LCP. If M + M' is
        positive semidefinite on these variables, v'M v = 0 is (M + M')v = 0, which
        makes the directions a polyhedral cone (Cottle, Pang, Stone, theorem 3.1.7).
        Otherwise each choice of v_i = 0 or w_i = 0 at kinks has one, which is examined
        for at most FEW_CHOICES kinks.
        """
        B, K = self.basic, self.kinks
        P = np.concatenate((B, K))
        differs = np.zeros(J.shape[0], dtype=bool)
        if P.size > MAX_DENSE:
            return differs
        R, C = self.problem.units.diagonals()
        M = np.asarray(dense(scaled(self.problem.M[P][:, P], R[P], C[P])))
        if _is_p_matrix(M):
            return differs
        D = np.append(np.ones(B.size), np.where(self.upper[K], -1.0, 1.0))
        rows = dense(J[:, P]) * C[P] * D
        sizes = np.abs(rows).sum(axis=1)
        for cone in _cones(D[:, np.newaxis] * M * D, B.size):
            for i, sign in product_of(range(J.shape[0]), (-1.0, 1.0)):
                optimum = minimized(sign * rows[i], *cone)
                moved = 0.0 if optimum is None else float(rows[i] @ optimum.x)
                differs[i] |= abs(moved) > MOVED * sizes[i]
        return differs

    def dependent_equations(self) -> Indices:
        """Return the indices of B whose equations w_i = 0 follow from others, up to
        rounding, as functions of the variables of B and of kinks.
        """
        with imports:
            from scipy.linalg import qr
        B, P = self.basic, distinct(np.concatenate((self.basic, self.kinks)))
        R, C = self.problem.units.diagonals()
        rows = dense(scaled(self.problem.M[B][:, P], R[B], C[P]))
        T, order = qr(np.asarray(rows).T, mode="r", pivoting=True)
        pivots = np.abs(T.diagonal())
        rank = np.count_nonzero(pivots > MIN_SINGULAR_VALUE * pivots[0])
        return np.asarray(B[order[rank:]])

    def has_one_image(self, J: Any) -> bool:
        """Return whether J z, for J of shape (k, n), is proved to be the same for all
        solutions close to z of all problems close to this one with the same M.

        (z - z')'M(z - z') <= 0 for any two solutions z and z'. If M is monotone, (M +
        M')(z - z') = 0 follows: Cottle, Pang, Stone, theorem 3.1.7. So x of a program
        is unique if Q is positive definite, even if its multipliers are not.
        """
        with imports:
            from lcpcli.inspection.classes import definiteness
            from lcpcli.inspection.verdict import YES
        P = distinct(np.concatenate((self.basic, self.kinks)))
        M = self.problem.M[P][:, P]
        S = M + M.T
        if P.size > MAX_DENSE or definiteness(S).semidefinite != YES:
            return False
        try:
            block = PseudoInverse(np.asarray(dense(S)))
        except SingularMatrix:
            return False
        return bool(block.determines(dense(J[:, P])).all())

    def refuse_contradiction(self, change: Vector, terms: Vector) -> None:
        """Raise DerivativeError unless w = 0 can be solved for these changes, up to
        rounding of the terms that they are sums of.
        """
        for P, block in ((self.basic, self.block), self._active):
            if block is not None and not block.is_consistent(change[P], terms[P]):
                raise contradiction()


class Corrected(NamedTuple):
    """A basic solution after a correction by its residual, shapes (n,), or (n, m) for
    those of m problems.

    slacks : the margins of all conditions. change : how far z has moved since w and the
        slacks were computed.
    moves : |M_BB^-1 v| for a generic v, as one of signs might be orthogonal to the null
        vectors of a singular M_BB', and would not show that. Both are 0 for nonbasic
        variables.
    """

    z: Vector
    basic: Mask
    slacks: Vector
    change: Vector
    moves: Vector


def are_clear(corrected: Corrected, largest: Any, largest_q: Any) -> Mask:
    """Return whether all conditions hold with a margin far larger than a crude bound on
    rounding errors; shape () for one problem or (m,) for many.

    largest, largest_q : the largest |M_ij| and |q_i|.
    """
    _, basic, slacks, change, moves = corrected
    z, crude = np.abs(corrected.z), CLEAR * ROW_ROUNDING
    largest_z, total = z.max(axis=0, initial=0.0), largest * moves.sum(axis=0)
    row = crude * (largest * z.sum(axis=0) + largest_q)
    of_others = row * (1 + total) + largest * change.sum(axis=0)
    needed = np.where(
        basic, row * moves.max(axis=0, initial=0.0) + crude * largest_z, of_others
    )
    is_converged = change.max(axis=0, initial=0.0) <= SMALL_CHANGE * largest_z
    return np.asarray(
        is_converged & (slacks > needed).all(axis=0) & (crude * total < MIN_DIGITS)
    )


class Linearizations:
    """The solutions of a stack with their bases, as in `Linearization`, for those that
    are clear of kinks.

    z, basic, upper, inverse : shapes (b, n), (b, n), (b, n) and (b, n, n). clear :
        shape (b,).
    """

    @np.errstate(all="ignore")
    def __init__(self, stack: Stack, z: Vector, solved: Mask) -> None:
        self.stack, box = stack, stack.box
        self.basic = (z > box.lower) & (z < box.upper)
        w = stack.w(z)
        self.inverse = principal_inverses(stack.M, self.basic)
        change = each_product(self.inverse, w)
        moves = np.abs(
            each_product(self.inverse, np.broadcast_to(generic(stack.n), z.shape))
        )
        self.z = z - change
        rows = (
            self.z,
            self.basic,
            state_slacks(box, self.z, w, self.basic),
            np.abs(change),
            moves,
            np.abs(stack.q),
        )
        # Contiguous columns, for fast maxima.
        *columns, q = (np.ascontiguousarray(values.T) for values in rows)
        largest_q = q.max(axis=0, initial=0.0)
        clear = are_clear(Corrected(*columns), stack.largest, largest_q)
        self.clear = clear & solved & stack.are_moderate
        self.upper = ~self.basic & np.where(box.fixed, w < 0, self.z == box.upper)

    def solve(self, b: Vector, transposed: bool = False) -> Vector:
        """Return M_BB^-1 b_B, or M_BB'^-1 b_B, and 0 elsewhere, with one step of
        refinement, for b of shape (b, n).
        """
        inverse, M = (
            A.swapaxes(1, 2) if transposed else A for A in (self.inverse, self.stack.M)
        )
        x = each_product(inverse, b)
        return x + each_product(inverse, b - each_product(M, x))


@np.errstate(all="ignore")
def gradients(
    results: Sequence[Result],
    at: Linearizations,
    g: Any,
    J: Any,
    unsolved: str,
) -> BatchGradient:
    """Return the gradients of all results, each as `gradient` does; those not clear of
    kinks are computed one by one.
    """
    m, n = at.stack.q.shape
    rows = None if J is None else as_stack("J", J, (m, None, n))
    g_rows = as_stack("g", g, (m, n if rows is None else rows.shape[1]))
    of_z = np.array(
        g_rows if rows is None else each_product(rows.swapaxes(1, 2), g_rows)
    )
    gradient: BatchGradient = Gradient(
        0.0 - at.solve(of_z, transposed=True),
        at.stack.M,
        at.z.copy(),
        of_z,
        at.basic.copy(),
        at.upper.copy(),
        {},
    )

    def one(i: int) -> OneGradient:
        return results[i].gradient(g_rows[i], J=None if rows is None else rows[i])

    clear = at.clear & np.isfinite(gradient.q).all(axis=1)
    return _completed(
        gradient, ("q", "_z", "_g", "_basic", "_upper"), clear, one, unsolved
    )


@np.errstate(all="ignore")
def derivatives(
    results: Sequence[Result],
    at: Linearizations,
    changes: Any,
    one_sided: bool,
    J: Any,
    unsolved: str,
) -> BatchDerivative:
    """Return the derivatives of all results, each as `derivative` does; those not clear
    of kinks are computed one by one.
    """
    stack = at.stack
    m, n = stack.q.shape
    rows = None if J is None else as_stack("J", J, (m, None, n))
    explicit_changes: dict[str, Any] = {
        name: as_stack(name, change, (m, n, n) if name == "dM" else (m, n))
        for name, change in changes.items()
        if change is not None
    }
    change = np.array(explicit_changes.get("dq", np.zeros((m, n))))
    if "dM" in explicit_changes:
        change += each_product(explicit_changes["dM"], at.z)
    dz = np.where(
        at.basic,
        0.0,
        moved_bounds(
            stack.box,
            at.upper,
            explicit_changes.get("dlower"),
            explicit_changes.get("dupper"),
        ),
    )
    dz -= at.solve(each_product(stack.M, dz) + change)
    dw = np.where(at.basic, 0.0, each_product(stack.M, dz) + change)
    dz = dz if rows is None else each_product(rows, dz)
    derivative: BatchDerivative = Derivative(dz, dw, {}, [True] * m)

    def one(i: int) -> OneDerivative:
        changes_of_one = {name: change[i] for name, change in explicit_changes.items()}
        return results[i].derivative(
            **changes_of_one, one_sided=one_sided, J=None if rows is None else rows[i]
        )

    clear = at.clear & np.isfinite(dz).all(axis=1)
    return _completed(derivative, ("z", "w", "strongly_regular"), clear, one, unsolved)


def _completed(
    batch: BatchRecord,
    names: tuple[str, ...],
    clear: Mask,
    one: Callable[[int], Any],
    unsolved: str,
) -> BatchRecord:
    """Set the entries of these arrays for the problems that are not clear to the
    results of `one`: None or NaN if it raises DerivativeError and `unsolved` is "nan".
    """
    if unsolved not in UNSOLVED:
        raise ParameterError("unsolved", unknown(unsolved), 'give "raise" or "nan"')
    for i in (~clear).nonzero()[0].tolist():
        single = None
        try:
            single = one(i)
        except DerivativeError as error:
            if unsolved == "raise":
                raise error.inside(f"batch[{i}]") from None
        for name in names:
            getattr(batch, name)[i] = getattr(single, name, None)
        if single is not None and single.kinks:
            batch.kinks[i] = single.kinks
    return batch
