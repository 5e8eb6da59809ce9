"""The residuals of a point of a nonlinear problem, whether it is a solution, and proofs
by interval arithmetic that there is a unique solution close to it.

With the variables N at bounds held there, z_B solves F_B = 0. If K = z_B - Y F_B(z) +
(I - Y J_BB(X)) (X - z_B) lies inside the box X around z_B, for any Y, then F_B has a
zero in K and no other one in X: R. Krawczyk, Newton-Algorithmen zur Bestimmung von
Nullstellen mit Fehlerschranken, Computing 4 (1969) 187-201; R. E. Moore, A test for
existence of solutions to nonlinear systems, SIAM Journal on Numerical Analysis 14
(1977) 611-615. This zero is the only solution nearby if X lies between the bounds of
z_B, and F_N has the strict signs required at the bounds of z_N, in X and close to these
bounds.

z solves the problem if and only if it solves the linearization there, whose w at z is
F(z). So z is measured as a point of that linear problem (see `measure`): a row may be
violated by tol times its terms |J| |z| + |q|, with q = F(z) - J z, or times its cap. J
may be wrong, by a mistake or as a difference quotient over a jump of F. So a row with a
violation must have terms that are confirmed by difference quotients of F, or J must
agree with these in several directions (see `evaluations.Slopes`).

The terms of F itself are unknown. If they cancel, as in exp(z) - 1 close to 0, the
violation of a row is a rounding error that may be much larger than tol |J| |z|. So a
violation is also accepted if it is at most a few times the noise of F, as far as that
is the noise of rounding (see `differences.noise`).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from lcpcli.linalg.doubles import (
    EPS,
    ROUNDING,
    SMALLEST_NORMAL,
    each_step,
    is_finite,
    size,
)
from lcpcli.linalg.matrices import are_equal, dense, is_sparse, with_data
from lcpcli.model.evaluations import MAX_NOISE, Evaluations, Slopes, rounding
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem
from lcpcli.model.right_hand_sides import like_with
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.error_theorems import Bound
from lcpcli.verify.measure import Rows
from lcpcli.verify.point import Criterion, Point, on_bounds, without_small_distances

SOURCE = "Krawczyk 1969, the only solution at this distance"
NO_INTERVALS = Bound(math.inf, "F has no evaluation in interval arithmetic")
UNPROVED = Bound(
    math.inf,
    "Krawczyk's operator proves no solution nearby, or a component is at a "
    "bound with w = 0",
)
MAX_UNKNOWNS = 1000  # unknowns up to which the dense Y is formed
ATTEMPTS, GROWTH = 8, 8.0  # the number of boxes, and the largest ratio of their sizes


@np.errstate(all="ignore")
def proved_bound(problem: NonlinearProblem, z: Vector) -> Bound:
    """Return a proved bound on |z - z*|_inf to a solution z*, the only one at this
    distance; infinite if none is proved.

    z : shape (n,), within its bounds; components that are to be at a bound are exactly
        there.
    """
    if problem.interval is None:
        return NO_INTERVALS
    box, point = problem.box, problem.interval(z, z)
    at_lower, at_upper = (z <= box.lower) & ~box.fixed, (z >= box.upper) & ~box.fixed
    B = (~(at_lower | at_upper | box.fixed)).nonzero()[0]
    if problem.n > MAX_UNKNOWNS or not np.isfinite(J := dense(point.J_lower)).all():
        return UNPROVED
    try:
        Y = np.linalg.inv(J[np.ix_(B, B)])
    except np.linalg.LinAlgError:
        return UNPROVED
    middle, width = _middle(point.F_lower[B], point.F_upper[B])
    moved = _rounded_up(np.abs(Y @ middle) + _errors(Y, middle, width), B.size)
    radius = 2 * moved + 4 * EPS * np.abs(z[B]) + SMALLEST_NORMAL
    for _ in range(ATTEMPTS):
        max_radius = float(radius.max(initial=SMALLEST_NORMAL))
        if not max_radius < math.inf:
            break
        low, high = z.copy(), z.copy()
        low[B], high[B] = z[B] - radius, z[B] + radius
        low[at_upper] = z[at_upper] - max_radius
        high[at_lower] = z[at_lower] + max_radius
        box_bounds = (
            np.where(low < z, np.nextafter(low, -np.inf), low),
            np.where(high > z, np.nextafter(high, np.inf), high),
        )
        values = problem.interval(*box_bounds)
        widths = np.nextafter(np.maximum(box_bounds[1] - z, z - box_bounds[0]), np.inf)
        J_middle, J_width = _middle(
            dense(values.J_lower)[np.ix_(B, B)], dense(values.J_upper)[np.ix_(B, B)]
        )
        rest = (
            np.abs(np.eye(B.size) - Y @ J_middle) + _errors(Y, J_middle, J_width) + EPS
        )
        reached = _rounded_up(moved + rest @ widths[B], 2 * B.size)
        if (reached < radius).all():
            inside = (box_bounds[0][B] > box.lower[B]).all() and (
                box_bounds[1][B] < box.upper[B]
            ).all()
            strict = (values.F_lower[at_lower] > 0).all() and (
                values.F_upper[at_upper] < 0
            ).all()
            return (
                Bound(float(reached.max(initial=0.0)), SOURCE)
                if inside and strict
                else UNPROVED
            )
        radius = GROWTH * np.clip(
            np.where(np.isfinite(reached), reached, radius), radius, GROWTH * radius
        )
    return UNPROVED


def _middle(lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return midpoints of intervals and bounds on their half widths."""
    middle = lower + (upper - lower) / 2
    return middle, np.nextafter(np.maximum(upper - middle, middle - lower), np.inf)


def _errors(Y: Vector, middle: Vector, width: Vector) -> Vector:
    """Return bounds on the errors of the product of Y with the midpoints, from rounding
    and from the half widths.
    """
    k, absolute = 4 * (middle.shape[0] + 2), np.abs(Y)
    return np.asarray(
        absolute @ width
        + k * (EPS * (absolute @ (np.abs(middle) + width)) + SMALLEST_NORMAL)
    )


def _rounded_up(sums: Vector, terms: int) -> Vector:
    """Return upper bounds on sums of this number of nonnegative terms, from their
    values in floating-point arithmetic.
    """
    return np.asarray(sums * (1 + 4 * (terms + 4) * EPS))


# A component below this relative to the largest one may be the rounding error of 0.
VANISHED = 1e-12
# A residual of at most WORTH, or LITTLE times the residual at x0, may be due to noise
# alone.
WORTH, LITTLE = 1e-6, 1e-10
LOOSE = 1e-8  # users request tolerances above this for noisy F
TOLD = 64 * EPS  # the noise, relative to the terms of a row, from which it is reported


class NonlinearCriterion(Criterion):
    """The tolerance that a point must meet to be a solution of a nonlinear problem.

    problem : the linearization at x0.
    """

    is_linear = False
    reference_solves = False

    def __init__(self, evaluations: Evaluations, tol: float) -> None:
        self.evaluations = evaluations
        original_problem = evaluations.problem
        self._first = 0.0
        F = evaluations.known_values(original_problem.x0)
        names = original_problem.names if any(original_problem.names) else ()
        first = self._linearization(*self._conditions(original_problem.x0, F), names)
        first = first.having(solutions=original_problem.solutions)
        super().__init__(first, tol, literal=True)
        self.start = size(original_problem.box.gaps(original_problem.x0, F))

    def linearization(self, z: Vector, F: Vector) -> Problem:
        """Return the linear problem with M = J(z) and w(z) = F; entries that are not
        finite are replaced by 0. What is known of the M of the first one holds for an
        equal M, as J does not depend on z where F is affine.
        """
        first = self.problem
        J, q = self._conditions(z, F)
        if not are_equal(J, first.M):
            linear = self._linearization(J, q).having(origin=first.origin)
        elif np.array_equal(q, first.q):
            return first
        else:
            linear = like_with(first, q, first.box)
        return linear.having(solutions=first.solutions)

    def _conditions(self, z: Vector, F: Vector) -> tuple[Matrix, Vector]:
        J = self.evaluations.jacobian(z)
        J = with_data(J, _finite(J.data)) if is_sparse(J) else _finite(J)
        return J, _finite(F - J @ z)

    def _linearization(
        self, J: Matrix, q: Vector, names: Sequence[str] = ()
    ) -> Problem:
        original_problem = self.evaluations.problem
        return Problem(
            J,
            q,
            name=original_problem.name,
            note=original_problem.note,
            names=names,
            lower=original_problem.lower,
            upper=original_problem.upper,
        )

    def point(self, z: Vector) -> Point:
        """Return the point at a z within its bounds; if it almost solves the problem,
        return the first point without rounding errors of zeros that does solve it.

        If z has components that are rounding errors compared with the largest one, the
        point without these comes first: where all terms of a row are such errors, no
        tolerance allows them.
        """
        box = self.evaluations.problem.box
        is_tiny = np.abs(z) <= ROUNDING * size(z)
        clean_z = box.project(np.where(is_tiny, 0.0, z))
        if not np.array_equal(clean_z, z) and self.is_small(
            size(box.gaps(z, self.evaluations.known_values(z)))
        ):
            point = NonlinearPoint(self, clean_z)
            if point.solves():
                return point
        point = NonlinearPoint(self, z)
        if point.solves() or not point.is_small:
            return point
        return next((other for other in point.cleaned() if other.solves()), point)

    def is_small(self, residual: float) -> bool:
        """Return whether a residual is so small that it may consist of rounding errors
        and noise.
        """
        return residual <= max(WORTH, LITTLE * self.start)

    def residuals(self, Z: Vector) -> tuple[list[float], list[bool]]:
        """Return the natural residuals of points; none is reported to be rounding."""
        problem = self.evaluations.problem
        return [size(problem.box.gaps(z, problem.values(z))) for z in Z], [False] * len(
            Z
        )

    def bound(self, F: Vector) -> float:
        """Return the size of the natural residual relative to the first one."""
        merit = float(np.abs(F).max(initial=0.0))
        self._first = self._first or merit
        return merit / self._first if merit else 0.0


class NonlinearPoint(Point):
    """A z with its residuals; w : F(z). noise : of each row of F, 0 until it is
    needed.
    """

    is_linear = False
    slopes: Slopes | None

    def __init__(
        self,
        criterion: NonlinearCriterion,
        z: Vector,
        noise: Vector | float = 0.0,
        is_admissible: bool = True,
    ) -> None:
        self.original_criterion, self.noise = criterion, noise
        self._is_new = criterion.evaluations.cached(z) is None
        self._measured(z, criterion.evaluations.known_values(z), is_admissible)

    def _measured(self, z: Vector, F: Vector, is_admissible: bool) -> None:
        self.F, self.slopes = F, None
        linear = Criterion(
            self.original_criterion.linearization(z, F),
            self.original_criterion.tol,
            literal=True,
        )
        super().__init__(linear, z, is_admissible)

    # Without F as a function, which may be of any kind.
    def __getstate__(self) -> dict[str, Any]:
        return {
            **vars(self),
            "_solves": self.solves(),
            "original_criterion": None,
            "slopes": None,
        }

    @cached_property
    def _plain(self) -> Rows:
        rows = self.criterion.measure.rows(self._inside)
        return rows._replace(
            w=self.F, full_terms=np.maximum(rows.full_terms, self.noise / EPS)
        )

    @property
    def _rows(self) -> Rows:
        return self._plain

    @property
    def is_small(self) -> bool:
        return self.original_criterion.is_small(self.residual)

    @np.errstate(all="ignore")
    def _decision(self) -> bool:
        if (
            not is_finite(self.F)
            or np.max(self.distances_beyond) > self.criterion.tol
            or not self._is_within()
        ):
            return False
        # A claim to be a solution is verified by a second evaluation of F.
        F = (
            self.F
            if self._is_new
            else self.original_criterion.evaluations.problem.values(self.z)
        )
        if not np.array_equal(F, self.F):
            vars(self).pop("_plain", None)
            self._measured(self.z, F, self._beyond is None)
            if not is_finite(F) or not self._is_within():
                return False
        return self._is_confirmed()

    def _is_within(self) -> bool:
        """Return whether the violations beyond noise meet the tolerance."""
        measure = self.criterion.measure
        violations = measure.violations(self._at_fixed, self.F)
        beyond_noise = np.where(violations > 4 * self.noise, violations, 0.0)
        return bool(
            is_finite(violations)
            and measure.allows(beyond_noise, self.z, self._plain, self.criterion.tol)
        )

    def _is_confirmed(self) -> bool:
        """Return whether difference quotients of F confirm terms large enough for the
        violations; if not, the terms are replaced by the confirmed ones.
        """
        violations = self.criterion.measure.violations(self._at_fixed, self.F)
        needed = np.where(violations > 4 * self.noise, violations, 0.0) / max(
            self.criterion.tol, ROUNDING
        )
        if not needed.any():
            return True
        self.slopes = slopes = Slopes(
            self.original_criterion.evaluations.problem,
            self.z,
            self.F,
            self.criterion.problem.M,
        )
        lacking = slopes.lacking(needed)
        wrong = lacking | slopes.refuted
        terms = np.maximum(slopes.min_terms, np.abs(self.F))
        if wrong.any():
            row_terms, full = (
                np.where(wrong, np.minimum(terms, others), others)
                for others in self._plain[1:3]
            )
            self._plain = self._plain._replace(terms=row_terms, full_terms=full)
            vars(self).pop("relative_residuals", None)
        return not lacking.any()

    @np.errstate(all="ignore")
    def remarks(self) -> list[str]:
        """Return what differences show about F and J at z, as clauses: the noise of F,
        a wrong entry of J, and, if z is no solution, a kink or a jump of F.
        """
        evaluations, solves = self.original_criterion.evaluations, self.solves()
        if not is_finite(self.F):
            return []
        problem = evaluations.problem
        z = self.z
        terms = np.maximum(self._plain.terms, np.abs(self.F))
        slopes = self.slopes or Slopes(problem, z, self.F, self.criterion.problem.M)
        is_asked = (
            not solves
            or evaluations.noise.any()
            or self.original_criterion.tol > LOOSE
            or slopes.is_uneven
        )
        noise = evaluations.noise_at(z) if is_asked else np.zeros(z.size)
        remarks, shares = list[str](), np.where(noise > 0, noise / terms, 0.0)
        if (shares > TOLD).any():
            remarks.append(
                f"F is noisy at about {noise[i := int(shares.argmax())]:.0e}, "
                f"in row {self._name(i)}"
            )
        if not solves or slopes.refuted.any():
            remarks += filter(None, [evaluations.fault_of_jacobian(z)])
        if solves or remarks:
            return remarks
        for rows, what in zip(
            slopes.unsmooth(noise), ("has a kink", "jumps"), strict=True
        ):
            remarks += [
                f"F {what} there, in row {self._name(i)}"
                for i in rows.nonzero()[0][:1].tolist()
            ]
        return remarks

    def _name(self, i: int) -> str:
        return self.original_criterion.evaluations.problem.names[i] or str(i + 1)

    @property
    def is_doubtful(self) -> bool:
        """Return whether z would be a solution if J were right."""
        return self.slopes is not None and not self.solves()

    @property
    def counted_as_0(self) -> str:
        return "up to the noise of F" if np.count_nonzero(self.noise) else ""

    @property
    def remark(self) -> str:
        return self.counted_as_0

    def solution(self) -> Point | None:
        """Return this point if it solves the problem, if necessary up to the noise of
        F; otherwise None.
        """
        if self.solves():
            return self
        if not self.is_small:
            return None
        evaluations = self.original_criterion.evaluations
        z = self.z
        problem = self.original_criterion.evaluations.problem
        if (self.relative_residuals > self.original_criterion.tol)[
            evaluations.noise > MAX_NOISE * evaluations.sizes
        ].any():
            return None  # that noise is not of rounding
        other = NonlinearPoint(
            self.original_criterion,
            z,
            rounding(problem.values, problem.box, z),
        )
        return other if other.solves() else None

    def alternatives(self) -> Generator[Point, None, None]:
        """Yield points that may be accepted instead of this one: the point itself up to
        the noise of F, and points without rounding errors of zeros.
        """
        solution = self.solution()
        if solution is not None:
            yield solution
        yield from self.cleaned()

    @each_step(all="ignore")
    def cleaned(self) -> Generator[NonlinearPoint, None, None]:
        """Yield points in which zeros are restored that rounding and the steps of a
        method have changed, as in `point`; then points without components that are
        rounding errors compared with the largest one, or at most the natural residual.
        """
        measure = self.criterion.measure
        problem = self.original_criterion.evaluations.problem
        seen = [self.z]
        small = (
            np.where(np.abs(self.z) <= max_size, 0.0, self.z)
            for max_size in (VANISHED * size(self.z), self.residual)
        )
        # A generator, so that it is computed only if the first point is no solution.
        nearer = (without_small_distances(measure, self.z) for _ in range(1))
        for start in chain((self.z,), nearer, map(problem.box.project, small)):
            w = self.original_criterion.evaluations.known_values(start)
            z = on_bounds(measure, start, w)
            if is_finite(w) and not any(np.array_equal(z, other) for other in seen):
                seen.append(z)
                yield NonlinearPoint(self.original_criterion, z)


def _finite(values: Vector) -> Vector:
    """Return values with NaN and infinity replaced by 0."""
    return np.where(np.isfinite(values), values, 0.0)
