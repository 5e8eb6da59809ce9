"""Lemke's method: complementary pivoting from a covering vector, for problems with bounds and free variables.

C. E. Lemke, Bimatrix equilibrium points and mathematical programming, Management Science 11 (1965) 681-689; scheme I,
algorithm 4.4.5 of R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, Academic Press (1992);
with bounds, R. W. H. Sargent, Mathematical Programming Study 7 (1978) 36-54; the lexicographic rule after B. C. Eaves,
The linear complementarity problem, Management Science 17 (1971) 612-634.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.free_variables import CANCELLED, Reduction
from lcpcli.basis.tableau import PAUSED, RAY, SOLVED
from lcpcli.linalg import matrices
from lcpcli.methods.direct import as_dense
from lcpcli.methods.lemke_path import Follow, LemkePath, settled, solution_at
from lcpcli.methods.registry import LARGEST, LEXICOGRAPHIC, METHODS, ONES
from lcpcli.methods.stages import Breakdown, Finished, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.rational.pivoting import IntegerTableau
from lcpcli.typing import Vector
from lcpcli.verify.certificate import RAY as PROVES_NOTHING
from lcpcli.verify.certificate import Certificate, infeasible, is_clear, proves_infeasible

MAX_UNKNOWNS = METHODS["lemke"].max_unknowns or 0  # since the tableau is dense
MAX_INTEGER_UNKNOWNS = 13  # largest n for integer pivoting: 2^14 pivots exceed the usual limit
MAX_PIVOTS, MORE_PIVOTS = 5, 50  # per unknown of a path, and besides: those that end at a solution take about one
FEW_PIVOTS = 2  # per unknown of the first path of `auto`, before other methods
FEWER_PIVOTS, FEW_MORE_PIVOTS = 1, 20  # per unknown and besides, if it is not sure to end at a solution
VANISHED = 1e-9  # relative to q: a z_0 so small may be rounding, and the point a solution but for that
SINGULAR_BASIS = "a basis is singular"


def lemke(problem: Problem, x0: Vector, *, cover: int | str = 0, ties: str = LARGEST) -> Stage:  # noqa: ARG001
    """Follow the path of almost complementary basic solutions of w = M z + c z_0 + q from a large z_0 down to z_0 = 0.

    For every M it ends after finitely many pivots, unless ties make it cycle, at a solution or on a ray. If M is
    copositive-plus (Lemke 1965) or row sufficient, or has nonnegative principal minors and a solution for every
    feasible q (M. Aganagić and R. W. Cottle, A constructive characterization of Q0-matrices with nonnegative principal
    minors, Mathematical Programming 37 (1987) 223-231), a ray means that the problem is infeasible; otherwise it means
    nothing. The number of pivots is usually of order n, at worst exponential; each costs two passes over a dense
    tableau. Free variables are eliminated first (see `free_variables`).

    problem : the LCP or mixed problem, n <= 5000 unknowns. x0 : not used: the method starts with all variables at
        bounds.
    cover : the covering vector c: "ones" in the units of the rows, Lemke's, or a whole number, the seed of a vector
        with entries between 1/2 and 3/2 in equilibrated units. As c > 0 is arbitrary, the theory is the same; entries
        that differ keep rows from blocking at once.
    ties : which of the rows leaves that block within rounding of each other: the one with the "largest" pivot, the
        stable choice, or the "lexicographic" minimum, with which the path cannot cycle (Eaves 1971). With this, a cover
        of "ones", and integers up to 2^20 for M and q of at most MAX_INTEGER_UNKNOWNS, all pivoting is in integers, so
        that the path is the same on every machine.

    Yields (z - w) / 2 after every pivot, with F = M z - w + q, and at the end recomputed from M and q, without F; the
    step is named by the variables that enter and leave the basis, but with free variables.
    `evaluations` counts the pivots. Finished : at a solution. NoSolution : the path ended on a ray; the certificate is
    "farkas" if the ray proves that there is no solution, otherwise "ray". Breakdown : there are too many unknowns, a
    basis is singular, or numbers overflow.
    """
    n, is_lexicographic = problem.n, ties == LEXICOGRAPHIC
    if problem.box.is_orthant and (problem.q >= 0).all():
        yield Iterate(-0.5 * problem.q, np.zeros(n), "", 0)
        return Finished()
    if n > MAX_UNKNOWNS:
        return Breakdown(f"it keeps a dense tableau and takes at most {MAX_UNKNOWNS} unknowns; this problem has {n}")
    if cover == ONES and is_lexicographic and n <= MAX_INTEGER_UNKNOWNS and _is_integer(problem):
        return (yield from _integer_path(problem))
    problem = as_dense(problem)
    path = LemkePath(reduced(problem), problem.q, cover, is_lexicographic)
    return (yield from _along(problem, path, is_published=cover == ONES))


def reduced(problem: Problem) -> Reduction:
    """Return a mixed problem in bounded variables."""
    return Reduction(matrices.dense(problem.M), problem.box)


def pivoted(
    problem: Problem,
    follow: Follow = tableau.follow,
    reduction: Reduction | None = None,
    is_sure: Callable[[], bool] = lambda: True,
) -> Stage:
    """Follow the path to its end, at most FEW_PIVOTS per unknown; yield only the solution at which it ends, or the
    point where z_0 is all but 0. A ray may prove that there is no solution, also for slightly different data.

    is_sure : whether the path ends at a solution if there is one; if not, long paths rarely do, and are given up.
    """
    path = path_to_end(problem, follow, reduction or reduced(problem), is_sure)
    if path.end == SOLVED:
        return (yield from _last(problem, path))
    if path.end == RAY:
        certificate = _certificate(problem, *path.ray(), False)
        if certificate.vector is not None and is_clear(problem, certificate.vector):
            return NoSolution(certificate)
    if path.cover_value <= VANISHED * np.abs(path.k).max():
        z, w, _ = path.point()
        yield Iterate(problem.box.x_of(z, w), None, "", path.pivots, signs_final=False)
    return Stalled("the path does not end at a solution")


def path_to_end(
    problem: Problem, follow: Follow, reduction: Reduction, is_sure: Callable[[], bool] = lambda: True
) -> LemkePath:
    """Return the path at its end, or where a basis is singular or it has taken too many pivots."""
    path = LemkePath(reduction, problem.q, 0, False, follow)
    most = FEW_PIVOTS * path.k.size + MORE_PIVOTS
    with suppress(np.linalg.LinAlgError):
        path.advance(FEWER_PIVOTS * path.k.size + FEW_MORE_PIVOTS)
        if path.end == PAUSED and is_sure():
            path.advance(most - path.pivots)
    return path


def _last(problem: Problem, path: LemkePath, step: str = "", z0: float | None = None) -> Stage:
    """Yield the solution at which the path ends."""

    def solve(left: Problem) -> Vector | None:
        own = path_to_end(left, path.follow, reduced(left))
        near, _, basis = own.point()
        return solution_at(left, own.reduction.M, near, basis)[0] if own.end == SOLVED else None

    near, _, basis = path.point()
    z, is_settled = solution_at(problem, path.reduction.M, near, basis)
    z = z if is_settled else settled(problem, z, solve)
    x = problem.box.x_within(z, problem.w(z), problem.box.basis_at(z))
    yield Iterate(x, None, step, path.pivots, basis=basis, z0=z0)
    return Finished()


def _is_integer(problem: Problem) -> bool:
    return problem.box.is_orthant and problem.has_small_integers


def _integer_path(problem: Problem) -> Stage:
    n, M = problem.n, [{j: int(a) for j, a in enumerate(row) if a} for row in matrices.dense(problem.M).tolist()]
    integers = IntegerTableau(M, list(map(int, problem.q.tolist())))
    for pivots, pivot in enumerate(integers.path(), 1):
        cover = float(integers.value_of(integers.parameter))
        step = _pivot_of(n, *(form - n if form >= n else form + n for form in pivot[:2]))
        yield Iterate(integers.x(), np.full(n, -cover), step, pivots, z0=cover)
    if integers.ray is not None:
        return NoSolution(_certificate(problem, integers.direction(), integers.multipliers(), True))
    return Finished()


def _along(problem: Problem, path: LemkePath, is_published: bool) -> Stage:
    """Follow the path by one pivot after another."""
    n, basic = problem.n, path.tableau.basic
    is_named = n == path.k.size  # the bounded variables are those of the problem
    step = _pivot_of(n, 2 * n, path.row) if is_named else ""
    while path.end == PAUSED:
        z, w, _ = path.point()
        yield Iterate(problem.box.x_of(z, w), problem.w(z) - w, step, path.pivots, z0=path.cover_value)
        before = basic.copy()
        try:
            path.advance(1)
        except np.linalg.LinAlgError:
            return Breakdown(SINGULAR_BASIS)
        if not np.isfinite(path.tableau.values).all():
            return Breakdown("the basic solution has overflowed")
        rows = (before != basic).nonzero()[0]
        step = _pivot_of(n, int(basic[rows[0]]), int(before[rows[0]])) if is_named and rows.size else ""
    if path.end == RAY:
        return NoSolution(_certificate(problem, *path.ray(), is_published))
    return (yield from _last(problem, path, step, 0.0))


def _pivot_of(n: int, entering: int, leaving: int) -> str:
    """Return which variable enters the basis for which one, by their numbers in `tableau`."""
    enters, leaves = (f"w{k + 1}" if k < n else f"z{(k - n + 1) % (n + 1)}" for k in (entering, leaving))
    return f"{enters} for {leaves}"


def _certificate(problem: Problem, z: Vector, multipliers: Vector, is_published: bool) -> Certificate:
    """Return what a ray with z_0 basic proves; z is the direction of the ray in z.

    Candidates for Farkas' y are this z, which is a proof if M is copositive-plus, and the multipliers of the row of
    z_0, which are a proof if z_0 is at its minimum over all z, w, z_0 within their bounds. That z is the direction of a
    ray can be verified if the covering vector is e.
    """
    for own in (z, np.maximum(multipliers, 0.0) if problem.box.is_orthant else multipliers):
        y = np.where(np.abs(own) <= CANCELLED * np.abs(own).max(), 0.0, own)
        if proves_infeasible(problem, y):
            how = "as M'y <= 0 and q'y < 0 for a y >= 0 from Lemke's method"
            return infeasible(problem, y, f"no z >= 0 has Mz + q >= 0, {how}" if problem.box.is_orthant else "")
    return Certificate("ray", PROVES_NOTHING, z if is_published and problem.box.is_orthant else None)
