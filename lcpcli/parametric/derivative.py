"""Derivatives of solutions: how z and w = M z + q change with M, q and the bounds.

With B the variables between their bounds and N those at a bound with w != 0, the states of all variables stay as they
are when the data change a little, and for changes dM, dq, dl, du

    dz_N = dl_N or du_N,    dz_B = -M_BB^-1 ((dM z + dq)_B + M_BN dz_N),    dw = dM z + dq + M dz.

For a function with gradient g of z, one system gives the derivatives by all data: with lambda_B = -M_BB'^-1 g_B, and 0
elsewhere, they are lambda z' by M, lambda by q, and (g + M' lambda)_N by the bounds.

Variables K at a bound with w = 0 are at a kink. If the solution is strongly regular, which means that the Schur
complement S = M_KK - M_KB M_BB^-1 M_BK is a P-matrix, the solution near z is a piecewise smooth function of the data,
and its directional derivative solves a mixed problem in dz with dz_N as above and, for K, bounds dl_K or du_K on the
side of the bound: S. M. Robinson, Strongly regular generalized equations, Mathematics of Operations Research 5 (1980)
43-62; R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem (1992), section 7.3; F. Facchinei,
J.-S. Pang, Finite-Dimensional Variational Inequalities and Complementarity Problems (2003), chapter 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import DerivativeError, ProblemError
from lcpcli.linalg.doubles import ROW_ROUNDING, distinct
from lcpcli.linalg.matrices import absolute_product, dense, is_sparse, product, scaled
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.model.arrays import FROM_0, as_square, as_vector
from lcpcli.model.problem import Problem
from lcpcli.parametric.linearization import Linearization
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Mask, Matrix, Vector, VectorLike
from lcpcli.verify.digits import signs

FEW_KINKS = 10  # up to which S is classified before M: by its principal minors in milliseconds
MOST_MINORS = 20_000  # and other steps of an inspection of S


@dataclass(frozen=True, eq=False)
class Derivative:
    """The derivative of a solution in a direction in which the data change.

    z, w : the derivatives of z and of w = M z + q, shape (n,).
    kinks : the indices of the components that are at a bound while w is 0, up to rounding. If there are any, z and w
        are the derivatives where these stay at their bounds; or the one-sided ones, for a small positive step in this
        direction, if these are asked for.
    strongly_regular : whether the solution is proved to be unique near z, and Lipschitz continuous, for all data near
        these, which makes it differentiable where there is no kink, and one-sidedly so in every direction. At kinks
        None, if that is not proved, or was not asked for: then one-sided derivatives are only a direction in which
        solutions may go, to first order.
    """

    z: Vector
    w: Vector
    kinks: list[int]
    strongly_regular: bool | None


@dataclass(frozen=True, eq=False)
class Gradient:
    """The derivatives of a function of z with respect to all data, of which each is computed when it is read.

    q : with respect to q, shape (n,); 0 at bounds.
    M : with respect to M, shape (n, n); for a sparse M a csr_array of those with respect to its stored entries.
    lower, upper : with respect to the bounds, shape (n,), 0 where z is not at that bound. For l_i = u_i only their sum
        counts, as both have to move together.
    kinks : as of `Derivative`; variables there are held at their bounds.
    """

    q: Vector
    kinks: list[int]
    _M: Matrix = field(repr=False)
    _z: Vector = field(repr=False)
    _g: Vector = field(repr=False)
    _basic: Indices = field(repr=False)
    _upper: Mask = field(repr=False)

    @cached_property
    @np.errstate(all="ignore")
    def M(self) -> Matrix:
        M, z = self._M, self._z
        if not is_sparse(M):
            return np.outer(self.q, z)
        of_entries = M.copy()
        of_entries.data = np.repeat(self.q, np.diff(M.indptr)) * z[M.indices]
        return of_entries

    @property
    def lower(self) -> Vector:
        return np.where(self._upper, 0.0, self._by_bounds)

    @property
    def upper(self) -> Vector:
        return np.where(self._upper, self._by_bounds, 0.0)

    @cached_property
    @np.errstate(all="ignore")
    def _by_bounds(self) -> Vector:
        total: Vector = self._g + product(self._M.T, self.q)
        total[self._basic] = 0.0
        return total


@with_limited_threads
@np.errstate(all="ignore")
def gradient(problem: Problem, result: Result, g: VectorLike) -> Gradient:
    """Return the derivatives of a function of z with the gradient g, shape (n,), at a result of the problem."""
    at, own = result.linearization, as_vector("g", g, problem.n)
    by_q = np.zeros(own.size)
    by_q[at.basic] = 0.0 - at.solve(own[at.basic], transposed=True)
    return Gradient(_finite(by_q), at.kinks.tolist(), problem.M, at.z, own, at.basic, at.upper)


@with_limited_threads
@np.errstate(all="ignore")
def derivative(
    problem: Problem,
    result: Result,
    dM: Any = None,
    dq: VectorLike | None = None,
    dlower: VectorLike | None = None,
    dupper: VectorLike | None = None,
    one_sided: bool = False,
) -> Derivative:
    """Return the derivative of the solution in the direction of these changes of the data, None for no change."""
    at = result.linearization
    change = np.zeros(problem.n) if dq is None else as_vector("dq", dq, problem.n).copy()
    if dM is not None:
        change += product(as_square("dM", dM, problem.n)[0], at.z)
    dz = _with_bounds(at, dlower, dupper)
    dz[at.basic] = 0.0 - at.solve((product(problem.M, dz) + change)[at.basic])
    regular: bool | None = True
    if at.kinks.size:
        regular = _leave_kinks(at, dz, change) if one_sided else None
    dw = product(problem.M, dz) + change
    dw[at.basic] = 0.0
    return Derivative(_finite(dz), dw, at.kinks.tolist(), regular)


def _with_bounds(at: Linearization, dlower: VectorLike | None, dupper: VectorLike | None) -> Vector:
    """Return dz where z is at a bound, 0 elsewhere."""
    box, n = at.problem.box, at.problem.n
    moves = []
    for name, given, bound in zip(("lower", "upper"), (dlower, dupper), box.vectors(n), strict=True):
        moves.append(np.zeros(n) if given is None else as_vector(f"d{name}", given, n))
        for i in np.flatnonzero(np.isinf(bound) & (moves[-1] != 0))[:1].tolist():
            raise ProblemError(f"d{name}[{i}]", f"is {moves[-1][i]:g}, but there is no such bound", f"give 0 {FROM_0}")
    low, high = moves
    for i in np.flatnonzero(box.fixed & (low != high))[:1].tolist():
        fault = f"is {low[i]:g} and dupper[{i}] is {high[i]:g}, but lower[{i}] = upper[{i}]"
        raise ProblemError(f"dlower[{i}]", fault, f"move both by the same {FROM_0}")
    dz = np.where(at.upper, high, low)
    dz[at.basic] = 0.0
    return dz


def _leave_kinks(at: Linearization, dz: Vector, change: Vector) -> bool | None:
    """Change dz from that with all kinks at their bounds to the one-sided one; return whether S is proved to be a
    P-matrix, so that this is the only one, or None. Raise DerivativeError if S is no P-matrix, or if none was found.

    With dz_K = its bound + D y for the signs D = 1 at lower bounds and -1 at upper ones, y solves the LCP with D S D
    and D (dw)_K, where dw is that for y = 0. All this is in the units R, C that M suggests, powers of two, as R S C is
    a P-matrix if and only if S is.
    """
    M, B, K = at.problem.M, at.basic, at.kinks
    units = at.problem.units
    R, C = np.exp2(np.rint((units.rows, units.columns)))
    columns, D = dense(M[:, K]) * C[K], np.where(at.upper[K], -1.0, 1.0)
    through = at.solve(columns[B])
    S = R[K, np.newaxis] * (columns[K] - at.image(through)[K])
    regular: bool | None = True
    both = distinct(np.concatenate((B, K)))
    if K.size <= FEW_KINKS or not _is_p_matrix(scaled(M[both][:, both], R[both], C[both])):  # then S is one too
        regular = _is_p_matrix(S, R[K] * _rounding(at, columns, through))
    several = "so that problems near this one have several solutions near z, or none"
    if regular is False:
        raise DerivativeError("", f"no derivative, as the solution is not strongly regular, {several}")
    with imports:
        from lcpcli.solving.call import run
    found = run(Problem(D[:, np.newaxis] * S * D, D * R[K] * (product(M, dz) + change)[K]))
    if not found.solved:
        raise DerivativeError("", f"no derivative was found in this direction: {found.message}")
    dz[K] += D * C[K] * found.z
    dz[B] -= through @ (D * found.z)
    return regular


def _rounding(at: Linearization, columns: Vector, through: Vector) -> Vector:
    """Return what rounding does to the rows of M_KK - M_KB M_BB^-1 M_BK, estimated with random signs."""
    M, B, K = at.problem.M, at.basic, at.kinks
    if not B.size:
        return np.zeros(K.size)
    full = np.zeros_like(columns)
    full[B] = np.abs(through)
    terms = ROW_ROUNDING * absolute_product(M, full)
    moved = at.solve((terms + ROW_ROUNDING * np.abs(columns))[B] * signs(B.size, K.size))
    return np.asarray((terms[K] + np.abs(at.image(moved)[K])).sum(axis=1))


def _is_p_matrix(S: Matrix, rounding: Vector | None = None) -> bool | None:
    """Return whether S is proved to be a P-matrix or not, even if rounding changes its diagonal by this; None if
    neither is proved."""
    with imports:
        from lcpcli.inspection.classify import classify
        from lcpcli.inspection.verdict import NO, YES
    cases = [S] if rounding is None or not rounding.any() else [S - np.diag(rounding), S + np.diag(rounding)]
    words = [classify(case, math.inf, "p_matrix", MOST_MINORS)["p_matrix"].word for case in cases]
    return True if words[0] == YES else False if words[-1] == NO else None


def _finite(dz: Vector) -> Vector:
    """Return a derivative, or raise DerivativeError if it overflows."""
    if not np.isfinite(dz).all():
        raise DerivativeError("", "the derivative is beyond the range of double precision")
    return dz
