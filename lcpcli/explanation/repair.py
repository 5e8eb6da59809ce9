"""The smallest change of numbers in the data, in a weighted 1-norm, that makes a
problem solvable.

First a relaxation without complementarity is solved: the smallest violation of the
linear conditions whose numbers may change is a linear program, which is solved exactly.
No smaller change suffices, and if the problem with this change has a solution, it is
the smallest one. This is the case if feasible problems are solvable, as for linear and
convex quadratic programs.

Otherwise the changes become unknowns of a larger problem, whose best solution is
computed. A number q_i may increase by p and decrease by m, both nonnegative, with rows
of zeros for p and m: w = M z + q + p - m. If a bound may change, z_i is made free, with
w_i - s + t = 0, where s >= 0 is complementary to z_i - l_i + p - m >= 0, and t >= 0 to
u_i + p - m - z_i >= 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from lcpcli.enumeration.optimum import OPTIMAL, optimum
from lcpcli.enumeration.search import MAX_BLOCK_UNKNOWNS, UNSOLVABLE
from lcpcli.explanation.conditions import (
    CONSTRAINTS,
    LOWER,
    OPTIMALITY,
    SIGN,
    UPPER,
    VARIABLE,
    Condition,
    Number,
    System,
)
from lcpcli.explanation.contradictions import smallest
from lcpcli.explanation.programs import LinearProgram, in_doubles, matrix_of
from lcpcli.interrupts import remaining
from lcpcli.model.formulation import Formulation
from lcpcli.model.problem import Problem
from lcpcli.options import Limits
from lcpcli.rational.exact_problem import Bounds, ExactProblem, Rows
from lcpcli.rational.numbers import rounded, zeros
from lcpcli.solving import driver
from lcpcli.solving.proof import exact_answer
from lcpcli.verify.exact_solution import from_point

# Unknowns up to which the search in rational arithmetic usually takes seconds.
MAX_SEARCHED = 60
MAX_ITERATIONS = 300  # limit of the run for a solution in floating-point arithmetic
MIN_SECONDS = 1e-6  # time limit of that run if the time is up

Values = list[Fraction]
Key = tuple[str, int]  # the field and the index of a number
FIELDS = {LOWER: "lower", UPPER: "upper", SIGN: "q"}  # the fields of conditions


class Change(NamedTuple):
    """A number in the data, and its change, in the author's sense."""

    number: Number
    change: Fraction


@dataclass(frozen=True)
class Repair:
    """A change of the data that makes a problem solvable.

    changes, total : the numbers that change, and the sum of their weighted sizes. z : a
        solution of the changed problem; None if none is known, and only the linear
        conditions of the constraints, or of optimality, are known to be consistent.
        is_least : whether this change suffices and no smaller one does.
    """

    changes: Sequence[Change]
    total: Fraction
    z: Values | None
    is_least: bool


class Repairs:
    """The search for the smallest repair. weights : the costs of the numbers that may
    change. repair : the best one that is known, or None; one without changes is a
    solution. is_impossible : whether it is proved that no change suffices.
    """

    def __init__(self, system: System, weights: Mapping[Number, Fraction]) -> None:
        self.system = system
        self.weights = weights
        self.repair: Repair | None = None
        self.is_impossible = False

    def run(self) -> None:
        """Solve the relaxation; if its change does not suffice, the larger problem."""
        if not self._relax() and not self.is_impossible:
            self._search()

    def _relax(self) -> bool:
        """Return whether the smallest change for the linear conditions alone, of the
        constraints or also of optimality, suffices.
        """
        weights = {
            (each.field, each.at): weight for each, weight in self.weights.items()
        }
        smallest_changes = dict[Key, Fraction]()
        for stage in (CONSTRAINTS, OPTIMALITY):
            conditions = [each for each in self.system.linear if each.stage == stage]
            changes = violation(self.system, conditions, weights)
            if changes is None:
                fixed = [each for each in conditions if _key(each) not in weights]
                found = smallest(self.system, fixed, ())
                self.is_impossible = found is not None and bool(found.multipliers)
                return False
            smallest_changes |= changes
            if not changes:
                continue
            z = solution(changed(self.system.data, smallest_changes))
            self._set_repair(smallest_changes, z, z is not None)
            if z is not None:
                return True
        # Feasible linear programs with feasible duals are solvable, and their
        # constraints and optimality conditions have no unknowns in common, so that both
        # smallest changes add up to the smallest one.
        if smallest_changes and is_linear_program(self.system):
            self._set_repair(smallest_changes, None, True)
            return True
        return False

    def _set_repair(
        self, change_of: Mapping[Key, Fraction], z: Values | None, is_least: bool
    ) -> None:
        """Store a repair with these changes and this solution."""
        sizes = (
            (each, change_of.get((each.field, each.at), Fraction(0)), weight)
            for each, weight in self.weights.items()
        )
        entries = [(each, change, weight) for each, change, weight in sizes if change]
        changes = [Change(each, each.sense * change) for each, change, _ in entries]
        total = sum(
            (weight * abs(change) for _, change, weight in entries), Fraction(0)
        )
        self.repair = Repair(changes, total, z, is_least)

    def _search(self) -> None:
        """Compute the best solution of the larger problem in which changes are
        unknowns.
        """
        data, columns = _extended(self.system.data, list(self.weights))
        if data.n > MAX_BLOCK_UNKNOWNS:
            return
        costs = zeros(data.n)
        for number, weight in self.weights.items():
            costs[columns[number]] = costs[columns[number] + 1] = weight
        limit = remaining()
        best_solution = optimum(
            data, costs, time_limit=limit if limit < math.inf else None
        )
        if best_solution.status == UNSOLVABLE:
            self.repair, self.is_impossible = None, True
        if best_solution.z is None:
            return
        changes = {
            (each.field, each.at): best_solution.z[column] - best_solution.z[column + 1]
            for each, column in columns.items()
        }
        z = best_solution.z[: self.system.n]
        self._set_repair(changes, z, best_solution.status == OPTIMAL)


def violation(
    system: System, of: Sequence[Condition], weights: Mapping[Key, Fraction]
) -> dict[Key, Fraction] | None:
    """Return the smallest changes of numbers that have weights for which some linear
    conditions are consistent, or None if they are not computed.
    """
    program, changes = _program(system, of, weights)
    minimizer = program.minimizer() if of else ([], [])
    if minimizer is None:
        return None
    smallest_changes = dict[Key, Fraction]()
    for column, (key, sign) in changes.items():
        change = smallest_changes.get(key, Fraction(0)) + sign * minimizer[0][column]
        smallest_changes[key] = change
    return {key: change for key, change in smallest_changes.items() if change}


def _key(of: Condition) -> Key:
    return FIELDS[of.kind], of.at


def _program(
    system: System, of: Sequence[Condition], weights: Mapping[Key, Fraction]
) -> tuple[LinearProgram, dict[int, tuple[Key, int]]]:
    """Return the program for the smallest violation of linear conditions whose numbers
    have these weights, in which the other conditions hold; and for each additional
    unknown the number that it changes, and the sign of the change.
    """
    n, zero = system.n, Fraction(0)
    rows = list[dict[int, Fraction]]()
    right_side = list[Fraction]()
    equal = list[bool]()
    costs, changes = zeros(n), dict[int, tuple[Key, int]]()
    lower: Bounds = [None] * n
    upper: Bounds = [None] * n
    for each in of:
        key, forms = _key(each), system.forms(each)
        integers, scale, constant = system.entries(forms[0])
        row = {j: Fraction(a, scale) for j, a in integers.items()}
        if system.is_bound(each) and key not in weights:
            is_lower = each.kind == LOWER
            (lower if is_lower else upper)[each.at] = (
                -constant if is_lower else constant
            )
            continue
        # A form increases with q and u, and decreases with l.
        side = -1 if each.kind == LOWER or forms[0] >= 4 * n else 1
        for sign in (1, -1)[: len(forms)] if key in weights else ():
            changes[len(costs)] = key, sign * side
            row[len(costs)] = Fraction(sign)
            costs.append(weights[key])
            lower.append(zero)
            upper.append(None)
        rows.append(row)
        right_side.append(-constant)
        equal.append(len(forms) == 2)
    return LinearProgram(costs, rows, right_side, equal, lower, upper), changes


def solution(
    data: ExactProblem, max_search_unknowns: int = MAX_SEARCHED
) -> Values | None:
    """Return an exact solution; None if the search yields none.

    max_search_unknowns : unknowns up to which a search in rational arithmetic is
        attempted.
    """
    system, n = System(data), data.n
    if (z := _optimum(system)) is not None:
        return z
    limit = remaining()
    limits = Limits(
        max_iterations=MAX_ITERATIONS, time_limit=max(limit / 2, MIN_SECONDS)
    )
    result = driver.run(data.problem, "auto", limits=limits)
    if result.interrupted:
        raise KeyboardInterrupt
    z = from_point(data, result.z) if result.solved else None
    if z is None and n <= max_search_unknowns:
        answer = exact_answer(data, result)
        z = None if answer is None else answer.z
    return z


def is_linear_program(system: System) -> bool:
    """Return whether the problem is that of a program without quadratic terms."""
    kinds = [each.kind for each in system.components]
    variables = {i for i, kind in enumerate(kinds) if kind == VARIABLE}
    return bool(variables) and not any(
        j in variables for i in variables for j in system.data.rows[i]
    )


def _optimum(system: System) -> Values | None:
    """Return the solution of the optimality conditions of a linear program; None if
    there is none, or the problem is not that of a linear program.
    """
    if not is_linear_program(system):
        return None
    data, components = system.data, enumerate(system.components)
    variables = {i for i, each in components if each.kind == VARIABLE}
    of = [each for each in system.linear if each.stage == CONSTRAINTS]
    program, _ = _program(system, of, {})
    costs = [
        Fraction(data.constants[i], data.scales[i]) if i in variables else Fraction(0)
        for i in range(data.n)
    ]
    minimizer_and_multipliers = program._replace(costs=costs).minimizer()
    if minimizer_and_multipliers is None:
        return None
    z, y = minimizer_and_multipliers[0], iter(minimizer_and_multipliers[1])
    for each in of:
        if not system.is_bound(each):
            sign = 1 if system.forms(each)[0] < 2 * data.n else -1
            z[system.rows_of.get(each.at, each.at)] += sign * next(y)
    return z if data.is_solution(system.filled(z)) else None


def changed(data: ExactProblem, change_of: Mapping[Key, Fraction]) -> ExactProblem:
    """Return a problem with changed q and bounds."""
    q = list[Fraction]()
    lower = list(data.lower)
    upper = list(data.upper)
    for i, (constant, scale) in enumerate(
        zip(data.constants, data.scales, strict=True)
    ):
        q.append(Fraction(constant, scale) + change_of.get(("q", i), 0))
        for field, bounds in ((LOWER, lower), (UPPER, upper)):
            if (bound := bounds[i]) is not None:
                bounds[i] = bound + change_of.get((field, i), 0)
    problem = data.problem
    has_names = problem.origin is not None and problem.formulation.is_names_alone
    origin = problem.origin if has_names else problem.block_form
    return _exact(data.M, q, lower, upper, origin)


def _exact(
    rows: Rows,
    q: Values,
    lower: Bounds,
    upper: Bounds,
    origin: Formulation | None = None,
) -> ExactProblem:
    """Return an exact problem with its nearest floating-point problem."""
    low, high = in_doubles(lower, upper)
    problem = Problem(matrix_of(rows, len(q)), rounded(q), lower=low, upper=high)
    return ExactProblem(problem.having(origin=origin), rows, q, lower, upper)


def _extended(
    data: ExactProblem, numbers: Sequence[Number]
) -> tuple[ExactProblem, dict[Number, int]]:
    """Return the larger problem, and for each number the index of its increase, which
    is followed by that of its decrease.
    """
    zero, rows = Fraction(0), data.M
    q = [Fraction(*each) for each in zip(data.constants, data.scales, strict=True)]
    lower, upper = list(data.lower), list(data.upper)
    of_bounds = dict[Key, int]()
    for i in dict.fromkeys(each.at for each in numbers if each.field != "q"):
        for field, bound, sign in ((LOWER, lower[i], 1), (UPPER, upper[i], -1)):
            if bound is not None:
                of_bounds[field, i] = len(rows)
                rows[i][len(rows)] = Fraction(-sign)
                rows.append({i: Fraction(sign)})
                q.append(-sign * bound)
                lower.append(zero)
                upper.append(None)
        lower[i] = upper[i] = None
    columns = dict[Number, int]()
    for each in numbers:
        columns[each] = rise = len(rows)
        row = rows[of_bounds.get((each.field, each.at), each.at)]
        sign = -1 if each.field == LOWER else 1
        row |= {rise: Fraction(sign), rise + 1: Fraction(-sign)}
        rows += [{}, {}]
        q += [zero, zero]
        lower += [zero, zero]
        upper += [None, None]
    return _exact(rows, q, lower, upper), columns
