"""Lemke's method: complementary pivoting from a covering vector, with the lexicographic minimum ratio test.

C. E. Lemke, Bimatrix equilibrium points and mathematical programming, Management Science 11 (1965) 681-689; scheme I,
algorithm 4.4.5 of R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, Academic Press (1992);
the lexicographic rule after B. C. Eaves, The linear complementarity problem, Management Science 17 (1971) 612-634.
"""

from __future__ import annotations

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.interrupts import check
from lcpcli.linalg import factors, matrices
from lcpcli.methods.newton import finish
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import Breakdown, Finished, Iterate, NoSolution, Stage, Stalled, advance, ended, limited
from lcpcli.methods.tableau import Tableau
from lcpcli.model.box import Basis
from lcpcli.model.problem import Problem
from lcpcli.rational.integer_lemke import IntegerTableau
from lcpcli.typing import Indices, Vector
from lcpcli.verify.basic_solution import BasicSolutions
from lcpcli.verify.certificate import RAY, Certificate, proves_infeasible

MAX_UNKNOWNS = METHODS["lemke"].max_unknowns or 0  # since the inverse of the basis is dense
MAX_INTEGER_UNKNOWNS = 13  # largest n for integer pivoting: 2^14 pivots exceed the usual limit
MOST_EXCHANGED = 1000  # unknowns, since the exchanged problem is dense
OTHER_STARTS = 8  # that are tried; from any of them the path of a nondegenerate game ends at a solution
MAX_PIVOTS = 5  # per unknown and start: paths that end at a solution usually take about one
PATH_TOLERANCE = 1e-6  # of the largest |q|: the size of F up to which the end of a path is worth finishing


def lemke(problem: Problem, x0: Vector) -> Stage:  # noqa: ARG001 (every method has it)
    """Follow the path of almost complementary basic solutions of w = M z + e z_0 + q from a large z_0 down to z_0 = 0.

    For every M it ends after finitely many pivots, at a solution or on a ray. If M is copositive-plus (Lemke 1965)
    or row sufficient, or has nonnegative principal minors and a solution for every feasible q (M. Aganagić and R. W.
    Cottle, A constructive characterization of Q0-matrices with nonnegative principal minors, Mathematical Programming
    37 (1987) 223-231), a ray means that the problem is infeasible; otherwise it means nothing. The number of pivots is
    usually of order n, at worst exponential.

    With k of the z basic, a pivot costs a few passes over the k columns of the n-by-n inverse that are not unit
    vectors. They are dense, however sparse M is. If M and q are integers up to 2^20 and n <= MAX_INTEGER_UNKNOWNS, all
    pivoting is in integers, so that the path is the same on every machine, even with ties.

    problem : the LCP, n <= 5000 unknowns. x0 : not used: the method starts from z = 0.

    Yields (z - w) / 2 after every pivot, with F = M z - w + q = -z_0 e, at no cost. The last one is recomputed from M
    and q. `evaluations` counts the pivots. Finished : at a solution. NoSolution : the path ended on a ray; the
    certificate is "farkas" if the ray proves that no z >= 0 has M z + q >= 0, otherwise "ray". Stalled : the last
    basis is complementary, but ill-conditioned: its solution does not solve the problem. Breakdown : there are too
    many unknowns, or numbers overflow.
    """
    n = problem.n
    if (problem.q >= 0).all():
        yield Iterate(-0.5 * problem.q, np.zeros(n), "", 0)
        return Finished()
    if n > MAX_UNKNOWNS:
        return Breakdown(f"it keeps a dense inverse and takes at most {MAX_UNKNOWNS} unknowns; this problem has {n}")
    if n <= MAX_INTEGER_UNKNOWNS and problem.has_small_integers:
        return (yield from _integer_path(problem))
    return (yield from _path(problem, Tableau(problem)))


def _integer_path(problem: Problem) -> Stage:
    M = [{j: int(a) for j, a in enumerate(row) if a} for row in matrices.dense(problem.M).tolist()]
    tableau = IntegerTableau(M, list(map(int, problem.q.tolist())))
    for pivots, _ in enumerate(tableau.path(), 1):
        cover = float(tableau.value_of(2 * problem.n))
        yield Iterate(tableau.x(), np.full(problem.n, -cover), "", pivots)
    if tableau.ray is not None:
        return NoSolution(_certificate(problem, tableau.direction(), tableau.multipliers()))
    return Finished()


def _path(problem: Problem, tableau: Tableau) -> Stage:
    n, auxiliary = problem.n, 2 * problem.n
    pivots, entering = 0, auxiliary
    column, row, tied = tableau.first_pivot()
    while True:
        leaving = tableau.pivot(column, row, tied, entering)
        if not np.isfinite(tableau.values).all():
            return Breakdown("the basic solution has overflowed")
        pivots += 1
        yield Iterate(tableau.x(), np.full(n, -tableau.value_of(auxiliary)), "", pivots)
        entering = leaving - n if leaving >= n else leaving + n
        column, row, tied = tableau.next_pivot(entering)
        if row == tableau.row_of[auxiliary]:
            x, F, solves = _solution(problem, tableau.support(entering))
            if not solves and tableau.age:
                tableau.invert()
                column, row, tied = tableau.next_pivot(entering)
            if row == tableau.row_of[auxiliary]:
                yield Iterate(x, F, "", pivots + 1)
                if solves:
                    return Finished()
                return Stalled("the last basis is complementary, but too ill-conditioned to give a solution")
        if row < 0:
            return NoSolution(_certificate(problem, tableau.direction(column, entering), tableau.multipliers()))


def _solution(problem: Problem, support: Indices) -> tuple[Vector, Vector, bool]:
    """Return x = (z - w) / 2 of a complementary basis, F at x, and whether x is a solution up to rounding."""
    basic = np.zeros(problem.n, dtype=bool)
    basic[support] = True
    try:
        solutions = BasicSolutions(problem)
        found = solutions.at(Basis(basic))
    except factors.SingularMatrix:
        return -0.5 * problem.q, np.minimum(problem.q, 0.0), False
    x = found.x
    z = problem.box.z_of(x)
    return x, problem.w(z) - (z - 2 * x), not solutions.violated(found).any()


def _certificate(problem: Problem, z: Vector, multipliers: Vector) -> Certificate:
    """Return what a ray with z_0 basic proves; z is the direction of the ray in z.

    Candidates for Farkas' y are this z, which is a proof if M is copositive-plus, and the multipliers of the row of
    z_0, which are a proof if z_0 is at its minimum over all z, w, z_0 >= 0.
    """
    for y in (z, np.maximum(multipliers, 0.0)):
        if proves_infeasible(problem, y):
            statement = "no z >= 0 has Mz + q >= 0, as M'y <= 0 and q'y < 0 for a y >= 0 from Lemke's method"
            return Certificate("farkas", statement, y)
    return Certificate("ray", RAY, z)


def restarts(problem: Problem, x0: Vector) -> Stage:  # noqa: ARG001 (as for a method)
    """Run Lemke's method from other starts, on the problem with some pairs (z_i, w_i) exchanged; yield the end of the
    path from each start if it is a solution.

    In M = [0 A; B' 0], q = -e, the bimatrix games, the path from the covering vector e ends at once, on a ray. With z_k
    and one w_j exchanged it is a path as in C. E. Lemke and J. T. Howson, Equilibrium points of bimatrix games, SIAM
    Journal 12 (1964) 413-423, where z_k is the label that is dropped.
    """
    if problem.n > MOST_EXCHANGED or not (problem.q < 0).any():
        return Finished()
    M, evaluations = matrices.dense(problem.M), 0
    for k in np.random.default_rng(0).permutation(problem.n)[:OTHER_STARTS]:
        rows = np.flatnonzero((M[:, k] > 0) & (problem.q < 0))
        if not rows.size:
            continue
        pair = np.unique([k, rows[np.argmax(-problem.q[rows] / M[rows, k])]])
        last = _end_of_path(M, problem.q, pair)
        if last is None or last.F is None or np.abs(last.F).max() > PATH_TOLERANCE * np.abs(problem.q).max():
            continue
        x = last.x.copy()
        x[pair] *= -1
        evaluations += last.evaluations
        end = last._replace(x=x, F=None, step="restart", evaluations=evaluations)
        yield from finish(problem, None, ended(Finished(), end))
    return Stalled("no path from another start ends at a solution")


def _end_of_path(M: Vector, q: Vector, pair: Indices) -> Iterate | None:
    """Return the solution at which Lemke's path ends for the exchanged problem; None if it ends at no solution."""
    try:
        path = limited(lemke(_exchanged(M, q, pair), np.zeros(q.size)), MAX_PIVOTS * q.size)
        last = None
        while isinstance(step := advance(path), Iterate):
            last = step
            check()
    except (ProblemError, FloatingPointError, factors.SingularMatrix):
        return None
    return last if isinstance(step, Finished) else None


def _exchanged(M: Vector, q: Vector, pair: Indices) -> Problem:
    """Return the principal pivot transform, with the pairs z_i, w_i exchanged; raise ProblemError if it overflows."""
    inverse = np.linalg.inv(M[np.ix_(pair, pair)])
    columns = M[:, pair] @ inverse
    T = M - columns @ M[pair]
    T[:, pair] = columns
    T[pair] = -inverse @ M[pair]
    T[np.ix_(pair, pair)] = inverse
    shifted = q - columns @ q[pair]
    shifted[pair] = -inverse @ q[pair]
    return Problem(T, shifted)
