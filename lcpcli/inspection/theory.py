"""A priori theory: which methods are guaranteed for which class of M, the rate of
convergence of `fixed-point`, the smoothing error of `shi`, and facts about M that
determine difficulty and cost: scaling, condition number, spectrum, and the size of its
factors.

A method is guaranteed to find a solution, or a proof that there is none. The statements
are those of the modules of the methods, which name the sources, and hold in exact
arithmetic. For `fixed-point`, |T|_2 < 1 holds for every omega > 0 if v'Mv > 0 for all v
!= 0, since |(omega I + M)v|^2 exceeds |(omega I - M)v|^2 by 4 omega v'Mv; and Bai
(2010) proves convergence for H+-matrices if omega is at least the largest diagonal
entry. For `shi`, level sets are bounded for P-matrices, whose F is a homeomorphism.

With bounds, z - x for mid(l, u, 2x) has the Lipschitz constant of |x|, so that the
statements about fixed-point and shi still hold, and newton returns to no basis with the
same last index, as w_n increases with z_n, as for an LCP. Without free variables lemke
follows the path of the standard form, whose matrix is row sufficient if M is, and
copositive-plus if M is and all variables have a lower bound. With free variables it is
positive semidefinite if M is.

With T = (omega I + M)^-1 (omega I - M), Schäfer's fixed point iteration is x' = T |x| -
(omega I + M)^-1 q. As | |x| - |y| | <= |x - y|, each step reduces the Euclidean
distance to the solution at least by the factor |T|_2, which for symmetric M is the
maximum of |omega - lambda| / |omega + lambda| over its eigenvalues (van Bokhoven 1981).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.inspection.classes import ends_at_solution
from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Verdict, called
from lcpcli.linalg import factors, krylov, matrices
from lcpcli.linalg.factors import SingularMatrix, finite
from lcpcli.linalg.patterns import Band, affordable
from lcpcli.methods.fixed_point import best_omega
from lcpcli.methods.registry import ANY, METHODS, OMEGA, Method
from lcpcli.methods.shi import default_p
from lcpcli.methods.shi import error as smoothing_error
from lcpcli.model.changes import shifted
from lcpcli.model.problem import Problem
from lcpcli.options import AUTO, TOL
from lcpcli.typing import Matrix

# Unknowns up to which the exhaustive search of milp always terminates, see
# milp.MAX_NODES.
MAX_CERTAIN_MILP_UNKNOWNS = 12
# Unknowns up to which the iteration matrix T is formed for its norm, which costs
# O(n^3).
MAX_WITH_NORM = 500


class Guarantee(NamedTuple):
    """Whether the success of a method is guaranteed. word : YES, NO, or UNDECIDED as
    the classes on which it depends. reason : why, as a clause.
    """

    word: str
    reason: str


@dataclass(frozen=True)
class Rate:
    """The convergence rate of the modulus iteration for one omega: the factor |T|_2,
    which bounds the reduction of the error by each iteration, and the number of
    iterations that reduce it by the default tolerance; None if it is unknown or not
    below 1.
    """

    omega: float
    factor: float | None
    iterations: int | None


def guarantees(
    classes: Mapping[str, Verdict], problem: Problem
) -> dict[str, Guarantee]:
    """Return for each of `methods.registry.METHODS` whether its success is guaranteed
    by the known classes of M."""
    guarantee_of = {
        name: _guarantee(method, classes, problem) for name, method in METHODS.items()
    }
    # interior is the only attempt of auto without a limit.
    if problem.n > MAX_CERTAIN_MILP_UNKNOWNS and guarantee_of["interior"].word == YES:
        guarantee_of[AUTO] = Guarantee(
            YES, f"as interior: {guarantee_of['interior'].reason}"
        )
    elif problem.n > MAX_CERTAIN_MILP_UNKNOWNS:
        named = " and ".join(
            name for name in ("newton", "lemke") if guarantee_of[name].word == YES
        )
        remark = f"; without limits {named} would do" if named else ""
        reason = f"above {MAX_CERTAIN_MILP_UNKNOWNS} unknowns its attempts have limits"
        guarantee_of[AUTO] = Guarantee(NO, reason + remark)
    return guarantee_of


def _guarantee(
    method: Method, classes: Mapping[str, Verdict], problem: Problem
) -> Guarantee:
    n, largest = problem.n, float(problem.M.diagonal().max(initial=0.0))
    if method.max_unknowns is not None and n > method.max_unknowns:
        return Guarantee(NO, f"it is limited to {method.max_unknowns} unknowns")
    if ANY in method.guaranteed:
        large = Guarantee(
            NO, f"above {MAX_CERTAIN_MILP_UNKNOWNS} unknowns its tree may be too large"
        )
        return (
            large
            if n > MAX_CERTAIN_MILP_UNKNOWNS
            else Guarantee(YES, method.guaranteed[ANY])
        )
    only_h_plus = (
        classes["h_plus"].word == YES and classes["positive_definite"].word != YES
    )
    if method is METHODS["fixed-point"] and only_h_plus:
        above = (
            f"M is H+, guaranteed with omega=auto: {largest:.6g}, the largest "
            "diagonal entry"
        )
        below = "M is an H+-matrix with no diagonal entry above 1"
        return Guarantee(YES, below) if largest <= OMEGA.value else Guarantee(NO, above)
    gains = sufficient_classes(method, problem)
    if not gains:
        return Guarantee(UNDECIDED, "no theorem about it is known here")
    for name, gain in gains.items():  # the first class to which M belongs decides
        if classes[name].word == YES:
            return Guarantee(YES, f"M is {called(name)}: {gain}")
    if method is METHODS["lemke"] and _is_copositive_for_q(classes, problem):
        reason = (
            "M is copositive, and q'v >= 0 wherever v >= 0 and v'Mv = 0: it finds a "
            "solution"
        )
        return Guarantee(YES, reason)
    if undecided := [called(name) for name in gains if classes[name].word == UNDECIDED]:
        return Guarantee(
            UNDECIDED, f"whether M is {' or '.join(undecided)} is not decided"
        )
    return Guarantee(
        NO,
        f"M is {'not' if len(gains) == 1 else 'neither'} "
        f"{' nor '.join(map(called, gains))}",
    )


def sufficient_classes(method: Method, problem: Problem) -> Mapping[str, str]:
    """Return the classes of M for which a method is guaranteed to solve a problem with
    these bounds or to prove that it has no solution, with what is known for each."""
    gains = method.guaranteed
    kinds = problem.box.kinds
    if method is not METHODS["lemke"]:
        return gains
    if "free" in kinds:
        gain = gains.get("row_sufficient")
        return {"positive_semidefinite": gain} if gain else {}
    if "upper bound" in kinds:
        # The classes that are invariant under sign changes of variables.
        invariant = ("p_matrix", "row_sufficient")
        return {name: gain for name, gain in gains.items() if name in invariant}
    return gains


def _is_copositive_for_q(classes: Mapping[str, Verdict], problem: Problem) -> bool:
    """Return whether Lemke's method is proved to yield a solution for this q, as for
    contact with friction."""
    if classes["copositive"].word != YES or problem.is_mixed:
        return False
    return ends_at_solution(problem.M, problem.q, interrupts.raise_if_timed_out)


def rates(M: Matrix, spectrum: Spectrum | None) -> tuple[Rate, Rate | None]:
    """Return the rates for omega = 1, as published, and for `fixed_point.best_omega`,
    which is None for a symmetric M that is too expensive to factorize.

    spectrum : the extreme eigenvalues of a positive definite M; if they are None, the
        rates are known only for small M.
    """
    omega = best_omega(M) if affordable(M) or not matrices.is_symmetric(M) else math.inf
    return _rate(M, OMEGA.value, spectrum), _rate(
        M, omega, spectrum
    ) if omega < math.inf else None


def _rate(M: Matrix, omega: float, spectrum: Spectrum | None) -> Rate:
    """Return the rate for one omega. Its factor |T|_2, for T = (omega I + M)^-1 (omega
    I - M), is unknown if omega I + M is singular, T overflows, or M has more than
    MAX_WITH_NORM rows and no spectrum is known.
    """
    factor: float | None = None
    if spectrum is not None and spectrum.smallest > 0:
        factor = max(
            abs(omega - eigenvalue) / (omega + eigenvalue)
            for eigenvalue in (spectrum.smallest, spectrum.largest)
        )
    elif M.shape[0] <= MAX_WITH_NORM:
        dense, shift = matrices.dense(M), omega * np.eye(M.shape[0])
        with (
            suppress(np.linalg.LinAlgError),
            np.errstate(over="ignore", invalid="ignore"),
        ):
            factor = float(
                np.linalg.norm(finite(np.linalg.solve(shift + dense, shift - dense)), 2)
            )
    if factor is None or not factor < 1:
        return Rate(omega, factor, None)
    tol = TOL.value
    return Rate(
        omega,
        factor,
        1 if factor <= tol else math.ceil(math.log(tol) / math.log(factor)),
    )


def smoothing(problem: Problem) -> tuple[float, float]:
    """Return the default p of `shi`, which runs with mid(l, u, 0) moved to 0; it has
    the dimension of 1 / z. And return the bound (ln 3 / p) |M - I|_inf of |F~ - F| for
    it, with the dimension of q.
    """
    problem = shifted(problem).problem
    return (p := default_p(problem)), smoothing_error(problem, p)


# Condition number from which a hint warns: at most 4 of 16 digits are correct.
BAD_CONDITION = 1e12
# Ratio of the largest entries of rows or columns, in decades, from which a hint advises
# to scale.
BAD_SPREAD = 4.0
# Unknowns up to which all eigenvalues are computed, in a fraction of a second.
MAX_WITH_SPECTRUM = 500


class Spread(NamedTuple):
    """The ratio, in decades, of the largest to the smallest of the row maxima of
    nonzero rows, and the same for columns.
    """

    rows: float
    columns: float


class Spectrum(NamedTuple):
    """The smallest and the largest eigenvalue of a symmetric M. Estimates, by a few
    steps of inverse and of power iteration, are accurate to a factor of about 3.
    """

    smallest: float
    largest: float
    estimated: bool


@dataclass(frozen=True)
class Cost:
    """The storage of M in bytes, and the cost of its triangular factors in entries and
    operations; the factors of a sparse M lie within a band of width `bandwidth` after
    reordering.
    """

    bytes: int
    bandwidth: int | None
    factor_entries: int
    factor_operations: int


def spread(M: Matrix) -> Spread:
    """Return the spread of the entries of M."""
    used = [
        sizes[sizes > 0]
        for sizes in (matrices.row_maxima(M), matrices.column_maxima(M))
    ]
    return Spread(
        *(
            float(np.log10(sizes.max()) - np.log10(sizes.min())) if sizes.size else 0.0
            for sizes in used
        )
    )


def condition(M: Matrix) -> float:
    """Return |M|_1 |M^-1|_1, a lower bound of it for more than factors.MAX_NUMPY_ROWS
    rows; infinite if M is singular.
    """
    small = not matrices.is_sparse(M) and M.shape[0] <= factors.MAX_NUMPY_ROWS
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            value = float(np.linalg.cond(M, 1)) if small else _estimated_condition(M)
        except SingularMatrix:
            return math.inf
    return value if value >= 1 else math.inf


def _estimated_condition(M: Matrix) -> float:
    """Return a lower bound on |M|_1 |M^-1|_1 by factors of M (Higham's estimator);
    infinite if M is singular."""
    with imports:
        from scipy.sparse.linalg import LinearOperator, onenormest
    if matrices.is_sparse(M):
        lu = factors.sparse_lu(matrices.is_symmetric(M))(M)
        solve, transposed = lu.solve, partial(lu.solve, trans="T")
    else:
        solve = factors.dense_factors().lu(M, overwrite=False)
        transposed = partial(solve, transposed=True)
    if not np.isfinite(solve(np.ones(M.shape[0]))).all():
        return math.inf
    inverse = LinearOperator(
        M.shape, matvec=solve, rmatvec=transposed, dtype=np.float64
    )
    # With one column the estimator uses no random vector, so that it is reproducible.
    return float(onenormest(inverse, t=1)) * float(abs(M).sum(axis=0).max())


def eigenvalues(M: Matrix, definite: bool) -> Spectrum | None:
    """Return the extreme eigenvalues of a symmetric M: estimates if it is large,
    positive definite and affordable to factorize; None for other large M.
    """
    if M.shape[0] <= MAX_WITH_SPECTRUM:
        values = np.linalg.eigvalsh(matrices.dense(M))
        return Spectrum(float(values[0]), float(values[-1]), estimated=False)
    extremes = krylov.extreme_eigenvalues(M) if definite and affordable(M) else None
    return (
        None
        if extremes is None or not np.isfinite(extremes).all()
        else Spectrum(*extremes, estimated=True)
    )


def cost(M: Matrix, definite: bool) -> Cost:
    """Return the storage of M and the cost of its factorization; half of it for a
    symmetric positive definite dense M.
    """
    n = int(M.shape[0])
    if matrices.is_sparse(M):
        band, size = Band(M), M.data.nbytes + M.indices.nbytes + M.indptr.nbytes
        return Cost(
            size,
            band.width,
            min(band.entries, n * n),
            min(band.operations, 2 * n**3 // 3),
        )
    return Cost(M.nbytes, None, n * n, n**3 // 3 if definite else 2 * n**3 // 3)
