"""How far a z is from being a solution, and whether a vector proves that there is none.

The componentwise backward error of z is the smallest omega for which z solves a problem
with data M + dM, q + dq such that |dM| <= omega |M| and |dq| <= omega |q|: these change
w_i by up to omega (|M| |z| + |q|)_i, each independently (see `measure`). For a z_i
beyond its bounds no such change helps, unless l_i = u_i, which may change by omega
relatively.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeVar

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import count
from lcpcli.linalg import matrices
from lcpcli.model import views
from lcpcli.model.arrays import FROM_1
from lcpcli.model.formulation import Answer
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import brief, rounded
from lcpcli.typing import Vector
from lcpcli.verify.acceptance import Extent, accepted
from lcpcli.verify.certificate import MANY, Proof, first_proof
from lcpcli.verify.error_theorems import Bound, error_bound
from lcpcli.verify.farkas import exact_proof
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem

# Unknowns up to which an error bound is computed, which may take a second.
MAX_BOUNDED = 300
# The largest distance, relative to natural sizes, of a point that solves the problem
# for which the message mentions it.
SMALL_CHANGE = 1e-4
MAX_LISTED = 10  # violations that a verification lists

Number = TypeVar("Number", float, Fraction)


@dataclass(frozen=True)
class Violation(Generic[Number]):
    """A component that prevents z from being a solution: its index, from 0, what it
    violates, z_i and w_i.

    kind : as "z < 0", "w < 0", both with a comma between them, or "z w > 0"; with
        bounds "z < lower", "z > upper", "w < 0" or "w > 0".
    """

    index: int
    kind: str
    z: Number
    w: Number


@dataclass(frozen=True, eq=False)
class Verification:
    """The verification of an answer.

    kind : "solution" for a z, "farkas" for a vector y.
    exact : whether it was verified without rounding, on the exact numbers.
    accepted, message : whether the answer is accepted, and why, as a sentence.
    residual, relative_residual, error : as in `result.Result`; None for a y, and error
        None if no solution is known.
    backward_error : the componentwise backward error; infinite if a z_i is outside
        different bounds, None for a y.
    bound : the proved bound on the distance to the solution, from `error_bound`; None
        in exact arithmetic, for a y, for more than MAX_BOUNDED unknowns, and if M is
        in no class for which a bound is known.
    violations, violated : the worst violations, and how many components violate a
        condition.
    strategies : for a game, the proposed strategies, or those of z, with payoffs and
        gains; else None.
    statement : for a program, what x is, or what it violates; else "".
    multipliers : the multipliers of the rows computed for an x without them, shape
        (m,); else None.
    answer : further results of the formulation, as why a program has no optimum; else
        None.
    """

    problem: Problem
    kind: Literal["solution", "farkas"]
    exact: bool
    accepted: bool
    message: str
    residual: float | None = None
    relative_residual: float | None = None
    error: float | None = None
    backward_error: float | None = None
    bound: Bound | None = None
    violations: Sequence[Violation[float] | Violation[Fraction]] = ()
    violated: int = 0
    strategies: Any = None  # an Answer, whose kind the reader knows from the problem
    statement: str = ""
    multipliers: Vector | None = None
    answer: Answer | None = None

    def __repr__(self) -> str:
        return str(
            views.verification_text.verification_report([self]).render()
        ).rstrip()

    def __bool__(self) -> bool:
        return self.accepted


class Proposed(NamedTuple):
    """A proposed solution of a problem: z, or the values that a formulation takes
    instead.

    values : finite floating-point numbers, shape (k,), or fractions. tol : the
        tolerance, 0 in exact arithmetic. data : the problem in exact numbers, None for
        floating point. of_z : verifies a z. is_own : whether multipliers are known to
        have the sign convention of the formulation.
    """

    problem: Problem
    values: Sequence[Any] | Vector
    tol: float
    data: ExactProblem | None
    of_z: Callable[[Any], Verification]
    is_own: bool = False

    @property
    def array(self) -> Any:
        """Return the values as an array, fractions as objects."""
        return np.array(self.values, dtype=float if self.data is None else object)


@np.errstate(all="ignore")  # overflow gives infinity
def verify(problem: Problem, z: Vector, tol: float) -> Verification:
    """Verify z, finite and of shape (n,), in floating-point arithmetic, by
    `acceptance.accepted` for the point itself. Violations are the components whose
    relative residual is above tol, the largest first.
    """
    point = Point(Criterion(problem, tol), z, is_admissible=False)
    bound = error_bound(problem, z) if problem.n <= MAX_BOUNDED else None
    return _verified(point, bound)


@np.errstate(all="ignore")
def verify_nonlinear(problem: NonlinearProblem, z: Vector, tol: float) -> Verification:
    """Verify z, finite and of shape (n,), as `verify` does, with F evaluated at z. The
    problem of the verification is the linearization there, which z solves if and only
    if it solves the nonlinear problem; no bound is computed.
    """
    with imports:
        from lcpcli.model.evaluations import Evaluations
        from lcpcli.verify.nonlinear_point import NonlinearCriterion, NonlinearPoint
    point = NonlinearPoint(
        NonlinearCriterion(Evaluations(problem), tol), z, is_admissible=False
    )
    if (undefined := problem.undefined(z)) is not None:
        i, value = undefined
        message = (
            f"z does not solve the problem: F is {value} there, in row "
            f"{problem.names[i] or f'{i + 1} {FROM_1}'}"
        )
        return Verification(
            point.criterion.problem,
            "solution",
            exact=False,
            accepted=False,
            message=message,
        )
    verification = _verified(point, None)
    return replace(
        verification, message="; ".join([verification.message, *point.remarks()])
    )


def _verified(point: Point, bound: Bound | None) -> Verification:
    """Return the verification of a point in floating-point arithmetic."""
    problem = point.criterion.problem
    z = point.z
    tol = point.criterion.tol
    each, relative = point.relative_residuals, point.relative_residual
    acceptance = accepted(problem, [point], tol, Extent(as_given=True))
    is_accepted = acceptance is not None and acceptance.solved
    message = _measured(point, tol)
    if acceptance is None:
        nearby = next((other for other in point.alternatives() if other.solves()), None)
        if nearby is not None and nearby.is_near(point, max(tol, SMALL_CHANGE)):
            message += _how_changed(nearby, point)
    elif (
        acceptance.reason
        and acceptance.certificate is None
        and not acceptance.point.solves()
    ):
        message += f"{', but' if is_accepted else ';'} {acceptance.reason}"
    elif acceptance.certificate is not None:
        message += f", and {acceptance.certificate.statement}"
    elif acceptance.point is not point:
        message += _how_changed(acceptance.point, point)
    violating = [
        i
        for i in np.argsort(-each, kind="stable").tolist()
        if not each[i] <= tol and not is_accepted
    ]
    return Verification(
        problem,
        "solution",
        exact=False,
        accepted=is_accepted,
        message=(
            f"z {'solves' if is_accepted else 'does not solve'} the problem: {message}"
        ),
        residual=point.residual,
        relative_residual=relative,
        error=problem.error(z),
        backward_error=_backward_error(point, point.w),
        bound=bound,
        violations=[
            _violation(problem, i, float(z[i]), float(point.w[i]))
            for i in violating[:MAX_LISTED]
        ],
        violated=len(violating),
    )


def _measured(point: Point, tol: float) -> str:
    """Return how far a point is from a solution, as a clause: its relative residual,
    or, as no change of M and q helps there, by how much it is beyond a bound.
    """
    problem = point.criterion.problem
    z = point.z
    relative = point.relative_residual
    if relative < np.inf:
        word = "at most" if point.solves() else "above"
        return f"its relative residual {relative:.1e} is {word} {tol:g}"
    beyond = z - problem.box.project(z)
    i = int(np.argmax(np.abs(beyond)))
    if not beyond[i]:
        return f"its residual is {point.residual:.1e}"
    below = beyond[i] < 0
    bound = (problem.box.lower if below else problem.box.upper) + np.zeros(z.size)
    side = "below its lower" if below else "above its upper"
    name = problem.names[i] or f"z{i + 1}"
    return f"{name} is {abs(beyond[i]):.2g} {side} bound {bound[i]:.7g}"


def _how_changed(nearby: Point, point: Point) -> str:
    """Return how `nearby`, which meets the tolerance, differs from `point`, as a
    clause.
    """
    ways = [nearby.counted_as_0] if nearby.counted_as_0 else []
    if not np.array_equal(nearby.z, point.z):
        ways.insert(0, "with components put on their bounds")
    it = "it" if point.relative_residual < np.inf else "its relative residual"
    said = f", but {' and '.join(ways)} {it} is {nearby.relative_residual:.1e}"
    rounded = nearby.rounded_rows
    return said if rounded is None else f"{said}; {rounded.statement}"


@np.errstate(all="ignore")
def verify_exactly(
    data: ExactProblem, z: list[Fraction], claimed_w: list[Fraction] | None = None
) -> Verification:
    """Verify z, of length n, in rational arithmetic: it is accepted if it is a
    solution, and `claimed_w`, unless it is None, equals M z + q. Only the reported
    residuals are rounded. Violations are the components for which min(z_i, w_i) is not
    0.
    """
    w = data.w(z)
    each = data.gaps(z, w)
    violating = sorted(
        (i for i in range(data.n) if each[i]), key=lambda i: -abs(each[i])
    )
    different = (
        (i, *both)
        for i, both in enumerate(zip(w, claimed_w or w, strict=False), 1)
        if both[0] != both[1]
    )
    difference = next(
        (
            f"component {i} {FROM_1} is {brief(computed)}, not {brief(claimed)}"
            for i, computed, claimed in different
        ),
        "",
    )
    failure = f"the specified w is not Mz + q: {difference}" if difference else ""
    if violating:
        verb = "fails" if len(violating) == 1 else "fail"
        components = count(len(violating), "component")
        failure = f"z is not an exact solution: {components} {verb}"
    doubles = rounded(z)
    point = Point(Criterion(data.problem), doubles, is_admissible=False)
    return Verification(
        data.problem,
        "solution",
        exact=True,
        accepted=not failure,
        message=failure or f"z is an exact solution: {data.problem.box.wording.solved}",
        residual=float(
            np.abs(rounded(each[i] for i in violating[:1])).max(initial=0.0)
        ),
        relative_residual=point.relative_residual if violating else 0.0,
        error=data.problem.error(doubles),
        backward_error=_backward_error(point, rounded(w)),
        violations=[
            _violation(data.problem, i, z[i], w[i]) for i in violating[:MAX_LISTED]
        ],
        violated=len(violating),
    )


def verify_farkas(
    problem: Problem, y: list[Fraction], data: ExactProblem | None, is_rounded: bool
) -> Verification:
    """Verify a proof y, of length n, that no z within its bounds has M z + q of the
    required signs.

    For exact data, y has to be a proof exactly, or, if it is known to be rounded, to be
    one after correction. Without exact data, the numbers are those of the text that the
    problem was read from, or else its double precision numbers, and y may be a proof
    after rounding, or up to the rounding of M; for few unknowns only if y is known to
    be rounded, as that of an ill-posed problem.
    """
    exact, doubles = data is not None, rounded(y)
    problem = problem if data is None else data.problem
    message = f"proved infeasible: {problem.box.wording.refuted}"
    exact_data = data or ExactProblem.of_problem(problem)
    is_proof = not exact and Proof("farkas", doubles).holds(problem)
    failure = "" if is_proof else _failed_condition(exact_data, y)
    if (
        failure
        and exact
        and is_rounded
        and exact_proof(exact_data, doubles) is not None
    ):
        failure = ""
    elif failure and not exact:
        rounded_from = 0 if is_rounded else MANY
        proof = first_proof(problem, [doubles], rounded_from=rounded_from)
        if proof is not None:
            failure, message = "", f"proved: {proof.statement}"
    if failure:
        message = f"y proves nothing: {failure}"
    return Verification(
        problem, "farkas", exact=exact, accepted=not failure, message=message
    )


def _failed_condition(data: ExactProblem, y: list[Fraction]) -> str:
    """Return the first condition of a proof that y violates, as a clause; "" if it
    violates none.
    """
    if not data.problem.box.is_orthant:
        return (
            ""
            if data.refuted_by(y)
            else "y violates a sign condition, or y'w is not negative for every "
            "z within the bounds"
        )
    i, smallest = min(
        enumerate(y), key=lambda entry: entry[1], default=(0, Fraction(0))
    )
    if smallest < 0:
        return f"y{i + 1} = {brief(smallest)} is negative"
    columns, constant = data.with_transpose(y)
    if constant >= 0:
        return f"q'y = {brief(constant)} is not negative"
    j = max(range(data.n), key=lambda j: columns[j])
    return (
        f"component {j + 1} {FROM_1} of M'y, {brief(columns[j])}, is positive"
        if columns[j] > 0
        else ""
    )


def _violation(problem: Problem, i: int, z: Number, w: Number) -> Violation[Number]:
    """Return the violation of component i, which has these z and w."""
    if problem.box.is_orthant:
        negative = ", ".join(
            f"{name} < 0" for name, value in (("z", z), ("w", w)) if value < 0
        )
        return Violation(i, negative or "z w > 0", z, w)
    low = problem.box.lower[i]
    high = problem.box.upper[i]
    if z < low:
        kind = "z < lower"
    elif z > high:
        kind = "z > upper"
    else:
        kind = "w < 0" if w < 0 else "w > 0"
    return Violation(i, kind, z, w)


def _backward_error(point: Point, w: Vector) -> float:
    """Return the componentwise backward error of a point, whose w is known."""
    problem = point.criterion.problem
    box = point.criterion.problem.box
    z = point.z
    changes = np.maximum(box.excess(np.where(box.fixed, box.lower, z), w), 0.0)
    sizes = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    largest = np.max(changes[changes > 0] / sizes[changes > 0], initial=0.0)
    return float(np.max(point.distances_beyond, initial=largest))
