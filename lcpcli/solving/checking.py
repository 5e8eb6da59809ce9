"""Verification of a proposed solution; for a program, also of x with or without
multipliers, and what x is.

Multipliers for an x alone are those of the linear program that approximates a program
near x. Within rows and bounds and a box around x, the derivative g = Qx + c of the
objective is minimized over steps d. If x satisfies the first-order conditions, d = 0 is
a minimizer and the multipliers of the rows are those of the program; if not, d is a
step to a lower objective.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from numbers import Rational
from typing import Any

import numpy as np

from lcpcli import options
from lcpcli.errors import IS_MISSING, LEAVE_ONE_OUT, LEAVE_OUT, ParameterError, count
from lcpcli.linalg.matrices import absolute_product, product, row_maxima, scaled
from lcpcli.linalg.programs import minimized
from lcpcli.model.arrays import FROM_1, as_vector, by_names
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem, as_problem
from lcpcli.model.program import SENSES, Program, ProgramData
from lcpcli.options import TOL
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import approximate, rounded
from lcpcli.solving.minimum import WORDS, data_of, kind_of_solutions
from lcpcli.solving.no_minimum import undecided, without_minimum
from lcpcli.typing import Vector, VectorLike
from lcpcli.verify import exact_solution
from lcpcli.verify.certificate import Proof
from lcpcli.verify.equilibria import of_game
from lcpcli.verify.verification import (
    Proposed,
    Verification,
    verify,
    verify_exactly,
    verify_farkas,
    verify_nonlinear,
)

MOST_EFFORT = 60.0  # for exact multipliers: as for exact proofs
# The largest one that is proposed for an answer whose digits were rounded.
LARGEST_TOL = 1e-4
# Relative to the terms of the objective: a larger gain shows that x is no optimum.
LEAST_GAIN = 1e-8
# Relative to x: small enough for the linear program to be a model of the objective.
BOX_SIZE = 0.1
# Of the largest |x_i|: the least that the box is relative to, so that zeros may move.
LEAST_BOX_SIZE = 1e-3
OBJECTIVE_CLAUSES = {"min": "above the minimum", "max": "below the maximum"}


@np.errstate(all="ignore")
def check(
    problem: Problem | NonlinearProblem,
    z: VectorLike | None = None,
    *,
    y: VectorLike | None = None,
    tol: float | None = None,
) -> Verification:
    """Verify a proposed solution z of a problem, or a proof y that there is none,
    whatever its source: `lcp check`.

    Parameters
    ----------
    problem : a Problem, or a NonlinearProblem, for which z counts in doubles only.
    z : shape (n,); accepted if its relative residual is at most tol. If one of its
        numbers is a fractions.Fraction and tol is not given, z is verified in exact
        arithmetic, with the doubles of the problem taken as exact. For a problem made
        from a program, z may also be x, shape (k,), for which multipliers are sought,
        or x followed by the multipliers y of the rows, shape (k + m,). For a game, it
        may also be the probabilities of the row player's and then the column player's
        strategies: those of each player are nonnegative and add up to 1. For a game
        tree, it may also be the probabilities of all actions at the first player's
        information sets, in the order of the file, and then at the second player's.
    y : shape (n,), in place of z: a Farkas vector, y >= 0 with M'y <= 0 and q'y < 0,
        verified in exact arithmetic.
    tol : 1e-10 by default.

    Returns
    -------
    Verification : whether the answer is accepted and why, with the residuals, the
        violated conditions and the componentwise backward error; the interpreter shows
        it as the command prints it.

    Raises LCPError if z or y has the wrong length or is not finite, or both are given,
    or tol is out of range.

    Examples
    --------
    >>> import lcpcli
    >>> problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    >>> lcpcli.check(problem, [4 / 3, 7 / 3]).accepted
    True
    >>> lcpcli.check(problem, [1, 2]).violated
    2
    >>> lcpcli.check(lcpcli.Problem([[-1]], [-2]), y=[1]).accepted
    True
    >>> sides = {"row_lower": 1, "row_upper": 1}
    >>> program = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], **sides)
    >>> lcpcli.check(program, [1, 0]).statement
    'x is the unique minimizer, as Q is positive definite'
    >>> from fractions import Fraction
    >>> lcpcli.check(problem, [Fraction(4, 3), Fraction(7, 3)]).exact
    True
    """
    options.check((TOL,), {"tol": tol})
    if isinstance(problem, NonlinearProblem):
        if y is not None:
            raise ParameterError(
                "y", "proves nothing for a nonlinear problem", "give z"
            )
        (values,) = by_names(lambda: problem.names, z=z)
        return verify_nonlinear(
            problem, as_vector("z", values, problem.n), tol or TOL.value
        )
    n = as_problem(problem).n
    if z is None and y is None:
        raise ParameterError("z", IS_MISSING, "give z, or a proof y")
    if z is not None and y is not None:
        raise ParameterError("y", "is given beside z", LEAVE_ONE_OUT)
    z, y = by_names(lambda: problem.names, z=z, y=y)
    if z is not None:
        values = as_vector("z", z)
        if values.size not in lengths(problem):
            as_vector("z", z, n)
        if tol is None and (exact := _fractions(z)):
            return verified_exactly(ExactProblem.of_floats(problem), exact)
        return verified(problem, values, tol or TOL.value)
    if tol is not None:
        raise ParameterError("tol", "has no effect on a proof", LEAVE_OUT)
    rounded_y = as_vector("y", y, n)
    exact = _fractions(y)
    return verified_proof(
        problem, exact or fractions_of(rounded_y), is_rounded=not exact
    )


def _fractions(values: Any) -> list[Fraction]:
    """Return the numbers of a list or an array as fractions if one of them is a
    Fraction; else an empty list."""
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    if not isinstance(listed, (list, tuple)) or not any(
        isinstance(value, Fraction) for value in listed
    ):
        return []
    return [
        Fraction(value) if isinstance(value, Rational) else Fraction(float(value))
        for value in listed
    ]


def lengths(problem: Problem | NonlinearProblem) -> dict[int, str]:
    """Return what may be verified, keyed by its length: for a program x, x and y, or z;
    for a game, also strategies."""
    origin = problem.origin
    if isinstance(origin, Game):
        return {problem.n: "{} and {} strategies".format(*origin.A.shape)}
    if isinstance(origin, Program):
        others = {problem.n - origin.ranges: "x and y", origin.variables: "x"}
        return {problem.n: "z", **others}
    return problem.formulation.lengths(problem)


def verified(
    problem: Problem, values: Vector, tol: float, own: bool = False
) -> Verification:
    """Verify z or, for a program, x, or x and y: values of one of the `lengths`.

    own : whether y is known to have the signs of the program's own sense; else it may
        also have the signs of z.
    """
    origin = problem.origin
    if not isinstance(origin, Program):
        of_z = partial(verify, problem, tol=tol)
        return _of_origin(Proposed(problem, values, tol, None, of_z, own))
    proposal = _Proposal(origin, problem, values)
    readings = proposal.readings(
        values,
        own,
        lambda x, y: origin.z_of(x, y, proposal.data),
        lambda: proposal.step[0],
    )
    return proposal.verified((verify(problem, z, tol) for z in readings), tol)


def _of_origin(proposed: Proposed) -> Verification:
    game = proposed.problem.origin
    if isinstance(game, Game):
        return of_game(game, proposed)
    found: Verification = proposed.problem.formulation.verified(proposed)
    return found


def accepting(
    problem: Problem, values: Vector, found: Verification, own: bool = False
) -> float | None:
    """Return the least power of ten, at most LARGEST_TOL, with which rejected values
    would be accepted, as they may have been rounded; None if there is none, or if the
    values were accepted."""
    relative = found.relative_residual
    if found.accepted or relative is None:
        return None
    if math.isinf(relative):  # beyond a bound
        relative = _beyond_bounds(problem, values)
    if not relative <= LARGEST_TOL:
        return None
    powers = [10.0**k for k in range(-9, 0)]
    tried = (tol for tol in powers if relative <= tol <= LARGEST_TOL)
    return next(
        (tol for tol in tried if verified(problem, values, tol, own).accepted), None
    )


def _beyond_bounds(problem: Problem, values: Vector) -> float:
    """Return how far the first of the unknowns, as many as there are values, are beyond
    their bounds, relative to the largest, in units that M suggests."""
    C = problem.units.diagonals()[1]
    z = np.concatenate((values, np.zeros(problem.n)))[: problem.n]
    beyond = np.abs(z - problem.box.project(z))[: values.size] / C[: values.size]
    largest = np.abs(values / C[: values.size]).max()
    return float(beyond.max() / largest) if largest else math.inf


def verified_exactly(
    data: ExactProblem,
    values: list[Fraction],
    w: list[Fraction] | None = None,
    own: bool = False,
) -> Verification:
    """Verify z, x, or x and y in rational arithmetic. w : a claimed M z + q for a z, to
    be verified too."""
    origin = data.problem.origin
    if not isinstance(origin, Program):
        of_z = partial(verify_exactly, data, given_w=w)
        return _of_origin(Proposed(data.problem, values, 0.0, data, of_z, own))
    proposal, exact = (
        _Proposal(origin, data.problem, rounded(values)),
        np.array(values, dtype=object),
    )

    def sought() -> Any:
        near = proposal.with_step()
        z = exact_solution.from_point(data, near, Effort(MOST_EFFORT)) or fractions_of(
            near
        )
        return np.array(z[proposal.k : data.n - origin.ranges], dtype=object)

    readings = proposal.readings(
        exact, own, partial(_completed, data, proposal), sought
    )
    given_w = w if len(values) == data.n else None
    return proposal.verified(
        (verify_exactly(data, list(z), given_w) for z in readings), TOL.value
    )


def verified_proof(
    problem: Problem,
    y: list[Fraction],
    data: ExactProblem | None = None,
    is_rounded: bool = False,
) -> Verification:
    """Verify a proof y that there is no solution; for a program also state what it
    proves, infeasibility for instance.

    data : exact data for which the proof is to hold. is_rounded : whether y is known to
        be rounded.
    """
    found = verify_farkas(problem, y, data, is_rounded)
    origin = problem.origin
    if not isinstance(origin, Program) or not found.accepted:
        return found
    if data and not data.are_floats():  # of which nothing was proved but what y proves
        answer = undecided(origin)
    else:
        claim = Proof("farkas", rounded(y), found.message)
        is_known = found.exact or claim.holds(problem)
        proof = replace(claim, is_rounded=not is_known)
        answer = without_minimum(problem, proof, origin, data_of(problem, origin))
    return replace(found, message=f"proved: {answer.statement}", answer=answer)


def _around(value: Vector, lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return how far a value may move down and up; beyond a bound it may move no
    farther."""
    equal = lower == upper
    return np.where(equal, 0.0, np.minimum(lower - value, 0.0)), np.where(
        equal, 0.0, np.maximum(upper - value, 0.0)
    )


class _Proposal:
    """A proposed point of a program: its x, and whether multipliers y came with it."""

    def __init__(self, origin: Program, problem: Problem, values: Vector) -> None:
        self.origin, self.problem, self.k = origin, problem, origin.variables
        self.data, self.x, self.sign = (
            data_of(problem, origin),
            values[: self.k],
            SENSES[origin.sense],
        )
        self.needs_multipliers = values.size == self.k < problem.n

    @cached_property
    @np.errstate(all="ignore")
    def step(self) -> tuple[Vector, float]:
        """Return the multipliers of the rows at x, shape (m,), and by how much the step
        that belongs to them lowers the objective; zeros and nan if there are none in
        the range of doubles."""
        data, x, heights = self.data, self.x, np.ones(self.data.row_lower.size)
        g = product(data.Q, x) + data.c
        largest = float(np.abs(x).max())
        sizes = (
            BOX_SIZE * np.maximum(np.abs(x), LEAST_BOX_SIZE * largest)
            if largest
            else np.ones(x.size)
        )
        A = data.A
        if heights.size:
            heights = row_maxima(scaled(A, heights, sizes))
            heights[heights == 0] = 1.0
            A = scaled(A, 1 / heights, sizes)
        ends = _around(product(data.A, x), data.row_lower, data.row_upper)
        low, high = _around(x, data.lower, data.upper)
        bounds = np.maximum(low / sizes, -1.0), np.minimum(high / sizes, 1.0)
        unit = float(np.abs(g * sizes).max()) or 1.0
        found = minimized(
            g * sizes / unit, A, (ends[0] / heights, ends[1] / heights), bounds
        )
        if found is None or not np.isfinite(found.y).all():
            return np.zeros(heights.size), math.nan
        d = found.x * sizes
        slope, curvature = float(g @ d), float(d @ product(data.Q, d))
        t = min(1.0, -slope / curvature) if curvature > 0 else 1.0
        return found.y * unit / heights, -t * (slope + t * curvature / 2)

    def with_step(self) -> Vector:
        """Return the z that consists of x and the multipliers of the step from it."""
        return self.origin.z_of(self.x, self.step[0], self.data)

    def readings(
        self,
        values: Any,
        own: bool,
        completed: Callable[[Any, Any], Any],
        sought: Callable[[], Any],
    ) -> Iterator[Any]:
        """Yield each z for which the values may stand, as `completed` makes it from x
        and y, which is sought if it is missing; for a maximum, y may have either
        sign."""
        ranges, n = self.origin.ranges, self.problem.n
        x, y = values[: self.k], values[self.k : n - ranges]
        if self.needs_multipliers:
            yield completed(x, sought())
            return
        if values.size == n and not own:
            yield values
        if values.size < n or own:
            yield completed(x, -y if self.sign < 0 else y)
        if self.sign < 0 and not own and y.size and (values.size < n or not ranges):
            yield completed(x, y if values.size < n else -y)

    def verified(self, of_readings: Iterator[Verification], tol: float) -> Verification:
        """Return the first verification that is accepted, or else the first of all,
        with a statement on x, and with the multipliers if they had to be sought."""
        found = next(of_readings)
        found = (
            found
            if found.accepted
            else next((other for other in of_readings if other.accepted), found)
        )
        if not found.accepted:
            return replace(found, statement=self._fault(tol))
        y = (
            self.sign * self.with_step()[self.k : self.problem.n - self.origin.ranges]
            + 0.0
        )
        statement = kind_of_solutions(self.problem, self.origin, self.data).statement
        return replace(
            found,
            statement=statement,
            multipliers=y if self.needs_multipliers else None,
        )

    @np.errstate(all="ignore")
    def _fault(self, tol: float) -> str:
        if violated := _violated(self.origin, self.data, self.x, tol):
            return f"x is not feasible: {violated}"
        origin, feasible = self.origin, f"x is feasible to the tolerance {tol:g}"
        word, value = (
            WORDS[origin.sense],
            self.sign * self.data.objective(self.x) + origin.constant,
        )
        _, gain = self.step
        if math.isnan(gain):
            return feasible
        size = np.abs(self.x)
        terms = float(
            size @ (absolute_product(self.data.Q, size) / 2 + np.abs(self.data.c))
        )  # of the objective
        if gain > max(tol, LEAST_GAIN) * terms:
            far = (
                f"at least {approximate(Fraction(gain), -1, 2)} "
                f"{OBJECTIVE_CLAUSES[self.origin.sense]}"
            )
            return f"{feasible}, but not a {word}: its objective {value:.7g} is {far}"
        if (
            not self.needs_multipliers
            and verify(self.problem, self.with_step(), tol).accepted
        ):
            kind = kind_of_solutions(self.problem, origin, self.data)
            return f"{kind.statement}, but with other multipliers"
        return f"{feasible}, but not shown to be a {word}"


def _completed(data: ExactProblem, proposal: _Proposal, x: Any, y: Any) -> Any:
    """Return the z that consists of exact x and y, and of s = Ax moved within its
    bounds."""
    zeros = np.array([Fraction(0)] * proposal.origin.ranges, dtype=object)
    w, first = (
        data.w(list(np.concatenate((x, y, zeros)))),
        data.n - proposal.origin.ranges,
    )
    rows = proposal.k + np.flatnonzero(proposal.data.ranges)
    ends = zip(rows.tolist(), data.lower[first:], data.upper[first:], strict=True)
    s = [
        w[i] if low is None or high is None else min(max(w[i], low), high)
        for i, low, high in ends
    ]
    return np.concatenate((x, y, np.array(s, dtype=object)))


@np.errstate(all="ignore")
def _violated(origin: Program, data: ProgramData, x: Vector, tol: float) -> str:
    """Return the row or bound that x violates most relative to its terms, and how much;
    "" if by no more than tol."""
    values = np.concatenate((product(data.A, x), x))
    sizes = np.concatenate((absolute_product(data.A, np.abs(x)), np.abs(x)))
    names = [
        f"row {name or f'{i} {FROM_1}'}"
        for i, name in enumerate(origin.rows or [""] * data.row_lower.size, 1)
    ]
    names += [
        name or f"x{j}"
        for j, name in enumerate(origin.columns or [""] * origin.variables, 1)
    ]
    sides = (
        ("below", "lower", data.row_lower, data.lower, 1.0),
        ("above", "upper", data.row_upper, data.upper, -1.0),
    )
    worst, sentence, number = 0.0, "", 0
    for side, bound, of_rows, of_x, sign in sides:
        ends = np.concatenate((of_rows, of_x))
        beyond = np.where(np.isfinite(ends), sign * (ends - values), 0.0)
        relative = np.where(
            beyond > tol * (sizes + np.abs(ends)), beyond / (sizes + np.abs(ends)), 0.0
        )
        number, i = number + int(np.count_nonzero(relative)), int(np.argmax(relative))
        if relative[i] > worst:
            worst = relative[i]
            sentence = (
                f"{names[i]} is {values[i]:.7g}, {beyond[i]:.2g} {side} its {bound} "
                f"bound {ends[i]:.7g}"
            )
    return (
        f"{sentence}; {count(number - 1, 'other bound')} violated"
        if number > 1
        else sentence
    )
