"""What `lcp check` says of a program: the verification of x, with or without
multipliers, and what x is.

If only x is proposed, multipliers are those of a linear program that approximates the
program at x. Within rows, bounds and a box around x, it minimizes g'd over steps d,
where g = Qx + c is the derivative of the objective. If x satisfies the first-order
conditions, d = 0 is a minimizer and the multipliers of the rows are those of the
program; otherwise d is a step to a lower objective.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from lcpcli.errors import count
from lcpcli.formulations.quadratic_program.conclusions import (
    WORDS,
    data_of,
    kind_of_solutions,
)
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.linalg.matrices import absolute_product, product, row_maxima, scaled
from lcpcli.linalg.programs import minimized
from lcpcli.model.arrays import FROM_1
from lcpcli.model.block_form import Blocks
from lcpcli.model.formulation import Answer, unnamed
from lcpcli.model.problem import Problem
from lcpcli.options import TOL
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import approximate, rounded, zeros
from lcpcli.report import wording
from lcpcli.typing import Vector
from lcpcli.verify import exact_solution
from lcpcli.verify.verification import Proposed, Verification, verify

MAX_EFFORT = 60.0  # seconds for exact multipliers, the limit of exact proofs
# A gain above this, relative to the terms of the objective, is not rounding error and
# shows that x is not an optimum.
MIN_GAIN = 1e-8
# x_i may move by this times |x_i|, so little that the linear program approximates the
# objective.
BOX_SIZE = 0.1
# In the size of the box, |x_i| is at least this times the largest one, so that
# variables that are 0 can move.
MIN_BOX_SIZE = 1e-3
OBJECTIVE_CLAUSES = {"min": "above the minimum", "max": "below the maximum"}


@dataclass(frozen=True)
class Multipliers(Answer):
    """The multipliers of the rows that were computed for a proposed x."""

    program: Program
    y: Vector

    def lines(self) -> list[str]:
        return [f"computed y = {wording.named(self.y.tolist(), self.program.rows)}"]


def verified(program: Program, proposed: Proposed) -> Verification:
    """Verify z, x, or x and y."""
    problem = proposed.problem
    values = proposed.values
    data = proposed.data
    if data is None:
        proposal = _Proposal(program, problem, proposed.array)
        readings = proposal.readings(
            values,
            proposed.is_own,
            lambda x, y: program.z_of(x, y, proposal.data),
            lambda: proposal.step[0],
        )
        return proposal.verified(map(proposed.of_z, readings), proposed.tol)
    proposal = _Proposal(program, problem, rounded(list(values)))
    readings = proposal.readings(
        proposed.array,
        proposed.is_own,
        partial(_completed, data, proposal),
        partial(_exact_multipliers, data, proposal),
    )
    return proposal.verified((proposed.of_z(list(z)) for z in readings), TOL.value)


def _exact_multipliers(data: ExactProblem, proposal: _Proposal) -> Any:
    refined_z = proposal.with_step()
    exact_z = exact_solution.from_point(data, refined_z, Effort(MAX_EFFORT))
    z = exact_z or fractions_of(refined_z)
    return np.array(z[proposal.k : data.n - proposal.origin.ranges], dtype=object)


def _around(value: Vector, lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return how far a value may move down and up before it meets a bound. A value
    beyond a bound may stay there, but not move farther.
    """
    equal = lower == upper
    return np.where(equal, 0.0, np.minimum(lower - value, 0.0)), np.where(
        equal, 0.0, np.maximum(upper - value, 0.0)
    )


class _Proposal:
    """A proposed point of a program: its x, and whether its multipliers y have to be
    computed.
    """

    def __init__(self, origin: Program, problem: Problem, values: Vector) -> None:
        self.origin = origin
        self.problem = problem
        self.k = origin.variables
        self.data = data_of(problem, origin)
        self.x = values[: self.k]
        self.sign = origin.sign
        self.needs_multipliers = values.size == self.k < problem.n

    @cached_property
    @np.errstate(all="ignore")
    def step(self) -> tuple[Vector, float]:
        """Return the multipliers of the rows that the linear program at x has, shape
        (m,), and by how much its step, shortened to the minimum along it, lowers the
        objective; zeros and nan if the linear program has no solution without overflow.
        """
        data = self.data
        x = self.x
        heights = np.ones(self.data.row_lower.size)
        g = product(data.Q, x) + data.c
        largest = float(np.abs(x).max())
        sizes = (
            BOX_SIZE * np.maximum(np.abs(x), MIN_BOX_SIZE * largest)
            if largest
            else np.ones(x.size)
        )
        A = data.A
        if heights.size:
            heights = row_maxima(scaled(A, heights, sizes))
            heights[heights == 0] = 1.0
            A = scaled(A, 1 / heights, sizes)
        bounds_of_rows = _around(product(data.A, x), data.row_lower, data.row_upper)
        low, high = _around(x, data.lower, data.upper)
        bounds = np.maximum(low / sizes, -1.0), np.minimum(high / sizes, 1.0)
        unit = float(np.abs(g * sizes).max()) or 1.0
        optimum = minimized(
            g * sizes / unit,
            A,
            (bounds_of_rows[0] / heights, bounds_of_rows[1] / heights),
            bounds,
        )
        if optimum is None or not np.isfinite(optimum.y).all():
            return np.zeros(heights.size), math.nan
        d = optimum.x * sizes
        slope, curvature = float(g @ d), float(d @ product(data.Q, d))
        t = min(1.0, -slope / curvature) if curvature > 0 else 1.0
        return optimum.y * unit / heights, -t * (slope + t * curvature / 2)

    def with_step(self) -> Vector:
        """Return the z that consists of x and the multipliers computed by the linear
        program.
        """
        return self.origin.z_of(self.x, self.step[0], self.data)

    def readings(
        self,
        values: Any,
        has_multipliers: bool,
        completed: Callable[[Any, Any], Any],
        search: Callable[[], Any],
    ) -> Iterator[Any]:
        """Yield each z that the proposed values may mean. `completed` makes it from x
        and y, and `search` finds y if it is missing; for a maximum, both signs of y are
        tested.
        """
        ranges, n = self.origin.ranges, self.problem.n
        x, y = values[: self.k], values[self.k : n - ranges]
        if self.needs_multipliers:
            yield completed(x, search())
            return
        if values.size == n and not has_multipliers:
            yield values
        if values.size < n or has_multipliers:
            yield completed(x, -y if self.sign < 0 else y)
        if (
            self.sign < 0
            and not has_multipliers
            and y.size
            and (values.size < n or not ranges)
        ):
            yield completed(x, y if values.size < n else -y)

    def verified(self, of_readings: Iterator[Verification], tol: float) -> Verification:
        """Return the first verification that is accepted, or the first of all if none
        is, with a statement about x, and with the multipliers if they had to be
        computed.
        """
        verification = next(of_readings)
        verification = (
            verification
            if verification.accepted
            else next((other for other in of_readings if other.accepted), verification)
        )
        if not verification.accepted:
            return replace(verification, statement=self._fault(tol))
        y = (
            self.sign * self.with_step()[self.k : self.problem.n - self.origin.ranges]
            + 0.0
        )
        statement = kind_of_solutions(self.problem, self.origin, self.data).statement
        verification = replace(verification, statement=statement)
        if not self.needs_multipliers:
            return verification
        return replace(verification, multipliers=y, answer=Multipliers(self.origin, y))

    @np.errstate(all="ignore")
    def _fault(self, tol: float) -> str:
        """Return in words why x was not accepted: what it violates, how much better the
        objective can be, or that its multipliers are wrong.
        """
        if violated := _violated(self.origin, self.data, self.x, tol):
            return f"x is not feasible: {violated}"
        origin, feasible = self.origin, f"x is feasible to the tolerance {tol:g}"
        noun = WORDS[origin.sense]
        value = origin.objective(self.data, self.x)
        _, gain = self.step
        if math.isnan(gain):
            return feasible
        size = np.abs(self.x)
        terms = float(
            size @ (absolute_product(self.data.Q, size) / 2 + np.abs(self.data.c))
        )  # the sum of the absolute values of the terms of the objective
        if gain > max(tol, MIN_GAIN) * terms:
            far = (
                f"at least {approximate(Fraction(gain), -1, 2)} "
                f"{OBJECTIVE_CLAUSES[self.origin.sense]}"
            )
            return f"{feasible}, but not a {noun}: its objective {value:.7g} is {far}"
        if (
            not self.needs_multipliers
            and verify(self.problem, self.with_step(), tol).accepted
        ):
            kind = kind_of_solutions(self.problem, origin, self.data)
            return f"{kind.statement}, but with other multipliers"
        return f"{feasible}, but not shown to be a {noun}"


def _completed(data: ExactProblem, proposal: _Proposal, x: Any, y: Any) -> Any:
    """Return the z that consists of exact x and y, and of s = Ax, projected onto the
    bounds of the rows.
    """
    slacks = np.array(zeros(proposal.origin.ranges), dtype=object)
    w = data.w(list(np.concatenate((x, y, slacks))))
    first = data.n - proposal.origin.ranges
    rows = proposal.k + np.flatnonzero(proposal.data.ranges)
    sides = zip(rows.tolist(), data.lower[first:], data.upper[first:], strict=True)
    s = [
        w[i] if low is None or high is None else min(max(w[i], low), high)
        for i, low, high in sides
    ]
    return np.concatenate((x, y, np.array(s, dtype=object)))


@np.errstate(all="ignore")
def _violated(origin: Program, data: Blocks, x: Vector, tol: float) -> str:
    """Return in words the row or bound that x violates most, relative to its terms, and
    by how much; "" if none is violated by more than the tolerance.
    """
    values = np.concatenate((product(data.A, x), x))
    sizes = np.concatenate((absolute_product(data.A, np.abs(x)), np.abs(x)))
    names = [
        f"row {name or f'{i} {FROM_1}'}"
        for i, name in enumerate(origin.rows or unnamed(data.row_lower.size), 1)
    ]
    names += [
        name or f"x{j}"
        for j, name in enumerate(origin.columns or unnamed(origin.variables), 1)
    ]
    sides = (
        ("below", "lower", data.row_lower, data.lower, 1.0),
        ("above", "upper", data.row_upper, data.upper, -1.0),
    )
    worst = 0.0
    sentence = ""
    number = 0
    for side, bound, of_rows, of_x, sign in sides:
        bounds = np.concatenate((of_rows, of_x))
        beyond = np.where(np.isfinite(bounds), sign * (bounds - values), 0.0)
        relative = np.where(
            beyond > tol * (sizes + np.abs(bounds)),
            beyond / (sizes + np.abs(bounds)),
            0.0,
        )
        number, i = number + int(np.count_nonzero(relative)), int(np.argmax(relative))
        if relative[i] > worst:
            worst = relative[i]
            sentence = (
                f"{names[i]} is {values[i]:.7g}, {beyond[i]:.2g} {side} its {bound} "
                f"bound {bounds[i]:.7g}"
            )
    return (
        f"{sentence}; {count(number - 1, 'other bound')} violated"
        if number > 1
        else sentence
    )
