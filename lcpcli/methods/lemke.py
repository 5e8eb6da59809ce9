"""Lemke's method: complementary pivoting from a covering vector, for problems with
bounds and free variables.

C. E. Lemke, Bimatrix equilibrium points and mathematical programming, Management
Science 11 (1965) 681-689; scheme I, algorithm 4.4.5 of R. W. Cottle, J.-S. Pang and R.
E. Stone, The Linear Complementarity Problem, Academic Press (1992); with bounds, R. W.
H. Sargent, Mathematical Programming Study 7 (1978) 36-54; the lexicographic rule after
B. C. Eaves, The linear complementarity problem, Management Science 17 (1971) 612-634.

Where the path terminates, the solution at its basis is computed from M and q, and small
components are refined by further problems: a path terminates once z_0 is within
rounding of the largest numbers, before numbers matter that are smaller by sixteen
digits, as those of bodies at rest: momenta of 1e-17 next to impulses of 1. At its last
point z, M (z + s d) + q = s (M d + (M z + q) / s): for violations of size s this is a
problem in d with the bounds (l - z) / s, in which components far inside their bounds
are free, and those with a large w stay where they are.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial
from itertools import islice
from typing import NamedTuple, TypeAlias

import numpy as np

from lcpcli.basis import tableau
from lcpcli.basis.exchanges import CorrectedSolutions
from lcpcli.basis.free_variables import CANCELLED, Reduction
from lcpcli.basis.tableau import PAUSED, RAY, SOLVED, begin, refactorize, tableau_of
from lcpcli.errors import ProblemError
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import SIGN_ROUNDING, generator
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import absolute_product
from lcpcli.methods.direct import as_dense
from lcpcli.methods.newton import from_states
from lcpcli.methods.registry import LARGEST, LEXICOGRAPHIC, ONES
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    NoSolution,
    Stage,
    Stalled,
)
from lcpcli.model.problem import Problem
from lcpcli.rational.pivoting import IntegerTableau
from lcpcli.typing import BasisStatus, Mask, Vector
from lcpcli.verify.certificate import RAY as PROVES_NOTHING
from lcpcli.verify.certificate import Proof, first_proof

OF_LEMKE = (
    "no z >= 0 has Mz + q >= 0, as M'y <= 0 and q'y < 0 for a y >= 0 from Lemke's "
    "method"
)
# Largest n for integer pivoting: 2^14 pivots exceed the usual limit.
MAX_INTEGER_UNKNOWNS = 13
# Pivots of a path for each unknown, and in addition: paths that lead to a solution take
# about one for each unknown.
MAX_PIVOTS, MORE_PIVOTS = 5, 50
FEW_PIVOTS = 2  # for each unknown on the first path of `auto`, before other methods
# Pivots for each unknown, and in addition, if the path is not sure to lead to a
# solution.
FEWER_PIVOTS, FEW_MORE_PIVOTS = 1, 20
COVERS = 8  # covering vectors whose paths `paths` follows
# Relative to q: a z_0 of this size may be rounding, so that the point may be a
# solution.
VANISHED = 1e-9
# Unknowns up to which a path from the usual start takes no longer than a few systems.
SHORT_PATH = 50
SINGULAR_BASIS = "a basis is singular"


def lemke(
    problem: Problem,
    x0: Vector,  # noqa: ARG001
    *,
    cover: int | str = 0,
    ties: str = LARGEST,
) -> Stage:
    """Follow the path of almost complementary basic solutions of w = M z + c z_0 + q
    from a large z_0 down to z_0 = 0.

    For every M it terminates after finitely many pivots, unless ties make it cycle, at
    a solution or on a ray. If M is copositive-plus (Lemke 1965) or row sufficient, or
    has nonnegative principal minors and a solution for every feasible q (M. Aganagić
    and R. W. Cottle, A constructive characterization of Q0-matrices with nonnegative
    principal minors, Mathematical Programming 37 (1987) 223-231), a ray means that the
    problem is infeasible; otherwise it proves nothing. The number of pivots is usually
    of order n, at worst exponential; each costs two passes over a dense tableau. Free
    variables are eliminated first (see `free_variables`).

    x0 is not used: the method starts with all variables at bounds. A cover of "ones",
    scaled as the rows, is Lemke's; the theory is the same for every other c > 0. With
    the "lexicographic" minimum the path cannot cycle (Eaves 1971); with this, a cover
    of "ones", and integers up to 2^20 for M and q of at most MAX_INTEGER_UNKNOWNS, all
    pivoting is in integers, so that the path is the same on every machine.

    Yields (z - w) / 2 after every pivot, with F = M z - w + q, and as the last one the
    point recomputed from M and q, without F; the step is named by the variables that
    enter and leave the basis, but with free variables. `evaluations` counts the pivots.
    NoSolution : the path ended on a ray; the certificate is "farkas" if the ray proves
    that there is no solution, otherwise "ray".
    """
    n, is_lexicographic = problem.n, ties == LEXICOGRAPHIC
    if problem.box.is_orthant and (problem.q >= 0).all():
        yield Iterate(-0.5 * problem.q, np.zeros(n), "", 0)
        return Finished()

    is_published = cover == ONES
    is_small = (
        n <= MAX_INTEGER_UNKNOWNS
        and problem.box.is_orthant
        and problem.has_small_integers
    )
    if is_published and is_lexicographic and is_small:
        return (yield from _integer_path(problem))
    problem = as_dense(problem)
    path = LemkePath(reduced(problem), problem.q, cover, is_lexicographic)
    return (yield from _along(problem, path, is_published))


def reduced(problem: Problem) -> Reduction:
    """Return a mixed problem in bounded variables."""
    return Reduction(matrices.dense(problem.M), problem.box)


def lemke_stage(
    problem: Problem,
    follow: Follow,
    reduction: Reduction | None,
    is_sure: Callable[[], bool],
) -> Stage:
    """Follow the whole path, with at most FEW_PIVOTS per unknown; yield only the
    solution to which it leads, or the point where z_0 is almost 0. A ray may prove that
    there is no solution, also for slightly different data.

    is_sure : whether the path leads to a solution if there is one; if not, long paths
        rarely do, and are not followed completely.
    """
    path = path_to_end(problem, follow, reduction or reduced(problem), is_sure)
    if path.end == SOLVED:
        yield _at_end_of(problem, path)
        return Finished()
    if path.end == RAY:
        certificate = _certificate(problem, *path.ray(), False)
        if certificate.vector is not None and certificate.is_clear(problem):
            return NoSolution(certificate)
    if path.cover_value <= VANISHED * np.abs(path.k).max():
        z, _ = path.point()
        yield Iterate(
            problem.box.x_of(z, path.w()), None, "", path.pivots, signs_final=False
        )
    return Stalled("the path does not lead to a solution")


def paths(problem: Problem, follow: Follow) -> Stage:
    """Follow the paths of several covering vectors, one after another, up to MAX_PIVOTS
    per unknown; yield the point where each terminates, whether it is a solution or not.

    Where rounding ends one path on a ray, another one is likely to lead to a solution.
    """
    reduction, pivots = reduced(problem), 0
    for cover in range(COVERS):
        path = LemkePath(reduction, problem.q, cover, False, follow)
        with suppress(np.linalg.LinAlgError):
            path.advance(MAX_PIVOTS * path.k.size + MORE_PIVOTS)
        pivots += path.pivots
        if path.end == SOLVED:
            yield _at_end_of(problem, path)._replace(evaluations=pivots)
        else:
            x = problem.box.x_of(path.point()[0], path.w())
            yield Iterate(x, None, "", pivots, signs_final=False)
    return Stalled("no path leads to a solution")


def end_of_path(problem: Problem, follow: Follow) -> Stage:
    """Yield the last point of the path, whether it is a solution or not.

    It has the rounding of the pivots: a step of a nonlinear run needs no more digits,
    and the solution of its basis would cost another factorization.
    """
    path = path_to_end(problem, follow, reduced(problem))
    z, basis = path.point()
    yield _at(problem, z, path.pivots, basis)
    return Finished()


def path_to_end(
    problem: Problem,
    follow: Follow,
    reduction: Reduction,
    is_sure: Callable[[], bool] = lambda: True,
) -> LemkePath:
    """Return the path where it terminates, or where a basis is singular or it has taken
    too many pivots."""
    path = LemkePath(reduction, problem.q, 0, False, follow)
    max_pivots = FEW_PIVOTS * path.k.size + MORE_PIVOTS
    with suppress(np.linalg.LinAlgError):
        path.advance(FEWER_PIVOTS * path.k.size + FEW_MORE_PIVOTS)
        if path.end == PAUSED and is_sure():
            path.advance(max_pivots - path.pivots)
    return path


def _at_end_of(problem: Problem, path: LemkePath) -> Iterate:
    """Return the iterate at the solution to which the path leads."""
    x, basis = _end_of(problem, path)
    return Iterate(x, None, "", path.pivots, basis=basis)


def _end_of(problem: Problem, path: LemkePath) -> tuple[Vector, BasisStatus]:
    """Return x and the basis of the solution to which the path leads."""
    z_on_path, basis = path.point()
    z, is_accurate = solution_of_basis(problem, path.reduction.M, z_on_path, basis)
    if not is_accurate:
        z = refine_small_components(problem, z, path.follow)
    return problem.box.x_within(z, problem.w(z), problem.box.basis_at(z)), basis


# Without it: of 1500 problems in a few small integers, six rays are not verified.
def _integer_path(problem: Problem) -> Stage:
    n = problem.n
    M = [
        {j: int(a) for j, a in enumerate(row) if a}
        for row in matrices.dense(problem.M).tolist()
    ]
    integers = IntegerTableau(M, list(map(int, problem.q.tolist())))
    for pivots, pivot in enumerate(integers.path(), 1):
        cover = float(integers.value_of(integers.parameter))
        variables = _variables(
            n,
            *(
                variable - n if variable >= n else variable + n
                for variable in pivot[:2]
            ),
        )
        yield _iterate(integers.x(), np.full(n, -cover), variables, pivots, cover)
    if integers.ray is not None:
        return NoSolution(
            _certificate(problem, integers.direction(), integers.multipliers(), True)
        )
    return Finished()


def _along(problem: Problem, path: LemkePath, is_published: bool) -> Stage:
    """Follow the path by one pivot after another."""
    n, basic = problem.n, path.tableau.basic
    is_named = n == path.k.size  # the bounded variables are those of the problem
    variables = _variables(n, 2 * n, path.row) if is_named else UNNAMED
    while path.end == PAUSED:
        z, w = path.point()[0], path.w()
        yield _iterate(
            problem.box.x_of(z, w),
            problem.w(z) - w,
            variables,
            path.pivots,
            path.cover_value,
        )
        before = basic.copy()
        try:
            path.advance(1)
        except np.linalg.LinAlgError:
            return Breakdown(SINGULAR_BASIS)
        if not np.isfinite(path.tableau.values).all():
            return Breakdown("the basic solution has overflowed")
        rows = (before != basic).nonzero()[0]
        variables = (
            _variables(n, int(basic[rows[0]]), int(before[rows[0]]))
            if is_named and rows.size
            else UNNAMED
        )
    if path.end == RAY:
        return NoSolution(_certificate(problem, *path.ray(), is_published))
    x, at_end = _end_of(problem, path)
    yield _iterate(x, None, variables, path.pivots, 0.0, at_end)
    return Finished()


class Pivot(NamedTuple):
    """The quantities of a pivot: the names of the variables that enter and leave the
    basis, None where free variables have been eliminated, and the value of z_0."""

    entering: str | None
    leaving: str | None
    z0: float


UNNAMED = None, None


def _variables(n: int, *numbers: int) -> tuple[str | None, ...]:
    """Return the names of variables by their numbers in `tableau`."""
    return tuple(f"w{k + 1}" if k < n else f"z{(k - n + 1) % (n + 1)}" for k in numbers)


def _iterate(
    x: Vector,
    F: Vector | None,
    variables: tuple[str | None, ...],
    pivots: int,
    z0: float,
    basis: BasisStatus | None = None,
) -> Iterate:
    """Return the iterate after a pivot, whose step names the variables that enter and
    leave the basis."""
    entering, leaving = variables
    return Iterate(
        x,
        F,
        "" if entering is None else f"{entering} for {leaving}",
        pivots,
        basis=basis,
        z0=z0,
        quantities=partial(Pivot, entering, leaving, z0),
    )


def _certificate(
    problem: Problem, z: Vector, multipliers: Vector, is_published: bool
) -> Proof:
    """Return what a ray with z_0 basic proves; z is the direction of the ray in z.

    Candidates for Farkas' y are this z, which is a proof if M is copositive-plus, and
    the multipliers of the row of z_0, which are a proof if z_0 is at its minimum over
    all z, w, z_0 within their bounds. That z is the direction of a ray can be verified
    if the covering vector is e.
    """
    is_orthant = problem.box.is_orthant
    of_row = np.maximum(multipliers, 0.0) if is_orthant else multipliers
    ys = (
        np.where(np.abs(y) <= CANCELLED * np.abs(y).max(), 0.0, y) for y in (z, of_row)
    )
    statement = OF_LEMKE if is_orthant else ""
    proof = first_proof(problem, ys, statement)
    direction = z if is_published and is_orthant else None
    return proof or Proof("ray", direction, PROVES_NOTHING)


Follow: TypeAlias = Callable[..., tuple[int, int, int, float]]
# Pivots, or n if that is more, after which the tableau is computed again.
MIN_REFRESHED = 50


@lru_cache(maxsize=16)
def seeded_cover(seed: int, size: int) -> Vector:
    """Return a covering vector of numbers between 1/2 and 3/2 by a seed, so that rows
    block one after another."""
    cover: Vector = 0.5 + generator(seed).random(size)
    cover.setflags(write=False)  # as all paths share it
    return cover


class LemkePath:
    """The path of one problem, from z_0 = max -k_i / c_i on; it has no pivots if no k_i
    is negative.

    follow : `tableau.follow`, or its compiled form. end : SOLVED, RAY, or PAUSED as
    long as the path continues. pivots : how many there were.
    """

    def __init__(
        self,
        reduction: Reduction,
        q: Vector,
        cover: int | str,
        lexicographic: bool,
        follow: Follow = tableau.follow,
    ) -> None:
        self.reduction = reduction
        self.k = reduction.constants(q)
        self.follow = follow
        self.cover = (
            reduction.units
            if cover == ONES
            else seeded_cover(int(cover), reduction.units.size)
        )
        self.lexicographic = lexicographic
        self.tableau = tableau_of(reduction.K, self.k, reduction.d, self.cover)
        self.pivots = 0
        self.age = 0
        self.row = 0
        self.end = SOLVED
        if (self.k < 0).any():
            self.row, self.entering, self.way = begin(
                self.tableau, self.cover, lexicographic
            )
            self.pivots = 1
            self.age = 1
            self.end = PAUSED

    def advance(self, max_pivots: int) -> None:
        """Follow the path for at most `max_pivots` pivots; compute the tableau again
        where it is old, or there is a ray."""
        last = self.pivots + max_pivots
        while self.end == PAUSED and self.pivots < last:
            pivots_to_refresh = max(MIN_REFRESHED, self.k.size) - self.age
            if pivots_to_refresh <= 0:
                self._refresh()
                continue
            entering_state = (self.entering, self.way, self.row)
            max_pivots = min(pivots_to_refresh, last - self.pivots)
            path_state = self.follow(
                self.tableau, *entering_state, self.lexicographic, max_pivots
            )
            self.end, pivots, self.entering, self.way = path_state
            self.pivots, self.age = self.pivots + pivots, self.age + pivots
            if self.end == RAY and self.age:
                self.end = PAUSED
                self._refresh()

    def _refresh(self) -> None:
        refactorize(
            self.tableau, np.column_stack((self.reduction.K, self.cover)), self.k
        )
        self.age = 0

    def point(self) -> tuple[Vector, BasisStatus]:
        """Return the current z of the original problem, and the basis."""
        t, m = self.tableau, self.k.size
        rows = ((t.basic >= m) & (t.basic < 2 * m)).nonzero()[0]
        variables = t.basic[rows] - m
        y, basic = np.where(t.at_upper, self.reduction.d, 0.0), np.zeros(m, np.bool_)
        y[variables], basic[variables] = t.values[rows], True
        return self.reduction.recover(y, basic, t.at_upper)

    def w(self) -> Vector:
        """Return the current w of the original problem."""
        basic, w = self.tableau.basic, np.zeros(self.k.size)
        rows = (basic < w.size).nonzero()[0]
        w[basic[rows]] = self.tableau.values[rows]
        return self.reduction.recover_w(w)

    @property
    def cover_value(self) -> float:
        return (
            float(self.tableau.values[self.row])
            if self.tableau.basic[self.row] == 2 * self.k.size
            else 0.0
        )

    def ray(self) -> tuple[Vector, Vector]:
        """Return the direction of z on the ray, and the multipliers of the rows of the
        problem in the row of z_0."""
        t, m = self.tableau, self.k.size
        y, u = np.zeros(2 * m + 1), np.zeros(2 * m + 1)
        y[t.basic] = self.way * t.T[:, self.entering]
        y[t.nonbasic[self.entering]] = self.way
        u[t.nonbasic] = t.T[self.row]
        return self.reduction.direction(y[m : 2 * m]), self.reduction.multipliers(u[:m])


LITERAL_STEPS = 8  # block pivots on infeasibilities after a path


def solution_of_basis(
    problem: Problem, M: Vector, initial_guess: Vector, basis: BasisStatus
) -> tuple[Vector, bool]:
    """Return z of the basis at which a path has ended close to an initial guess, for M
    as a dense array, and whether it needs no refinement: whether, without any further
    pivot, it violates no row of the problem beyond rounding.

    Infeasibilities beyond rounding belong to numbers so small relative to others that
    z_0 left the basis before they mattered: block principal pivoting follows, for up to
    LITERAL_STEPS steps. If none of these leads to a feasible basis, z is that of the
    first one.
    """
    system = CorrectedSolutions(problem, M, initial_guess)
    first = problem.box.project(system.z_at(basis))
    if not violations(problem, first)[2].any():
        return first, True
    for basic_solution in islice(
        system.block_principal_pivoting(basis), LITERAL_STEPS + 1
    ):
        z = system.initial_guess = problem.box.project(basic_solution.z)
        if not system.count_violations(basic_solution):
            return z, False
    return first, False


def feasible_basic_solution(problem: Problem, basis: BasisStatus) -> Stage:
    """Yield the basic solution of a basis, such as the last one of a path for another
    q, if it is feasible: if it violates no row beyond rounding."""
    try:
        iterate = _of_basis(problem, basis)
    except SingularMatrix:
        return Breakdown("the principal submatrix of the starting basis is singular")
    if violations(problem, problem.box.z_of(iterate.x))[2].any():
        return Stalled("the starting basis is not that of a solution")
    yield iterate
    return Finished()


def from_last_basis(problem: Problem, basis: BasisStatus) -> Stage:
    """Pivot from the solution basis of a similar problem; where this problem has
    several solutions with this basis, as if an equation follows from others, yield one
    of them."""
    ending = yield from from_states(problem, basis)
    if isinstance(ending, Breakdown) and problem.n > SHORT_PATH:
        iterate = _of_basis(problem, basis, np.zeros(problem.n))
        yield iterate._replace(basis=None)
        return Finished()
    return ending


def _of_basis(
    problem: Problem, basis: BasisStatus, initial_guess: Vector | None = None
) -> Iterate:
    """Return the basic solution of a basis; of several, that close to the initial
    guess."""
    solutions = CorrectedSolutions(problem, matrices.dense(problem.M), initial_guess)
    return _at(problem, solutions.at(basis).z, 1, basis, "block")


def _at(
    problem: Problem, z: Vector, evaluations: int, basis: BasisStatus, step: str = ""
) -> Iterate:
    """Return the iterate at a z, moved within its bounds, with a basis."""
    z = problem.box.project(z)
    x = problem.box.x_within(z, problem.w(z), problem.box.basis_at(z))
    return Iterate(x, None, step, evaluations, basis=basis)


MAX_LEVELS = 3
# Relative to the largest |q|: violations above this do not belong to small components.
SMALL = 1e-8
# Relative to the violations: distances from bounds and sizes of w above which these
# cannot change.
FAR = 1e4
NOISE = 1e-10  # relative to the violations: components that are rounding of 0


def violations(problem: Problem, z: Vector) -> tuple[Vector, Vector, Mask]:
    """Return how a z within its bounds violates the problem: w = M z + q, with 0 for
    each w_i that may be rounding of 0, the natural residual of each row, and the rows
    in which it exceeds the rounding error."""
    w = problem.w(z)
    natural_residual = np.abs(problem.box.gaps(z, w))
    rounding = SIGN_ROUNDING * (
        absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    )
    return (
        np.where(np.abs(w) <= rounding, 0.0, w),
        natural_residual,
        natural_residual > rounding,
    )


# Without it `lemke` does not solve towers of 3 and 8 boxes at rest with velocities as
# free variables; 157 other problems, almost all of contact, do not need it.
@np.errstate(all="ignore")
def refine_small_components(problem: Problem, z: Vector, follow: Follow) -> Vector:
    """Return z with its small components refined: Lemke's method solves the problem in
    the distance from z, divided by the size of the violations, as long as its paths
    lead to solutions."""
    for _ in range(MAX_LEVELS):
        w, natural_residual, violated = violations(problem, z)
        size = natural_residual.max(where=violated, initial=0.0)
        if not 0.0 < size <= SMALL * np.abs(problem.q_ref).max():
            break
        lower, upper = ((bound - z) / size for bound in problem.box.vectors(problem.n))
        stays = ((lower >= 0.0) & (w > FAR * size)) | (
            (upper <= 0.0) & (w < -FAR * size)
        )
        lower = np.where(lower < -FAR, -np.inf, lower)
        upper = np.where(upper > FAR, np.inf, upper)
        vanishes = (
            (np.isinf(lower) & np.isinf(upper) & ~violated)
            | stays
            | (np.abs(w) <= NOISE * size)
        )
        q = np.where(vanishes, 0.0, w / size)
        lower = np.where(stays, 0.0, lower)
        upper = np.where(stays, 0.0, upper)
        try:
            remainder = Problem(problem.M, q, lower=lower, upper=upper)
            path = path_to_end(remainder, follow, reduced(remainder))
            z_on_path, basis = path.point()
            d = (
                solution_of_basis(remainder, path.reduction.M, z_on_path, basis)[0]
                if path.end == SOLVED
                else None
            )
        except ProblemError:
            break
        if d is None or not np.isfinite(d).all():
            break
        z = z + size * d
        z = problem.box.project(np.where(np.abs(z) <= NOISE * size, 0.0, z))
    return z
