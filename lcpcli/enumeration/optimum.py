"""The best of all solutions of a problem with respect to a linear objective:
`lcpcli.optimum`.

This is branch and bound over the basis status of the unknowns: each node of the tree is
a polyhedron in which some statuses are chosen. The minimum of the objective on it,
computed by the simplex method in integers, is a lower bound; if it is attained at a
solution, the node has no better one. So neither a big-M constant for complementarity
nor a tolerance is needed.

Objectives may also contain the payoffs of a game, if they are linear in the unknowns of
a problem that the formulation provides for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from heapq import heapify, heappop, heappush
from typing import Any, NamedTuple

import numpy as np

from lcpcli import clock, options
from lcpcli.enumeration.meaning import InPayoffs, meaning_of
from lcpcli.enumeration.search import TIME_LIMIT, UNSOLVABLE, in_exact_numbers
from lcpcli.errors import ProblemError, quoted
from lcpcli.interrupts import TimeIsUp, deadline_after, remaining
from lcpcli.model.arrays import as_vector, by_names
from lcpcli.model.block_form import SENSES, sense_of
from lcpcli.model.problem import Problem
from lcpcli.model.words import coefficients, reversed_names
from lcpcli.options import Limits
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import text, zeros
from lcpcli.rational.tree import OBJECTIVE, Node, Unknowns, explored
from lcpcli.solving import driver
from lcpcli.verify.exact_solution import from_point

PREFIX = "payoff of "


def names_of_payoffs(data: ExactProblem) -> Sequence[str]:
    """Return the names of the payoffs of the players of a game; none for other
    problems.
    """
    return [PREFIX + player for player in meaning_of(data).payoffs()]


def in_costs(
    data: ExactProblem, objective: Mapping[str, Fraction]
) -> tuple[InPayoffs, Mapping[str, Fraction], Fraction]:
    """Return a problem, an objective in its unknowns, and a constant, which replace an
    objective with payoffs of the players of a game. An objective without payoffs is
    returned unchanged, with the constant 0. Raises ProblemError if payoffs cannot be
    combined with unknowns.
    """
    meaning = meaning_of(data)
    payoffs = {PREFIX + player: each for player, each in meaning.payoffs().items()}
    others = {name: value for name, value in objective.items() if name not in payoffs}
    if len(others) == len(objective):
        return InPayoffs(data, list), objective, Fraction(0)
    searched, constant = meaning.in_payoffs(), Fraction(0)
    if others and searched.data is not data:
        reason = (
            f"has {next(iter(others))!r} in addition to payoffs, which are not "
            "linear in the unknowns"
        )
        raise ProblemError(
            "objective", reason, f"use {' and '.join(map(repr, payoffs))} alone"
        )
    for name, payoff in payoffs.items():
        value, unknown = objective.get(name, Fraction(0)), f"z{payoff.unknown + 1}"
        others[unknown] = others.get(unknown, Fraction(0)) - value * payoff.slope
        constant += value * payoff.constant
    return searched, others, constant


OPTIMAL, UNBOUNDED = "optimal", "unbounded"
MIN_SECONDS = 1e-6  # the time limit of the first run if the time is up
# Limits on the run for a first solution, and on its verification in exact arithmetic.
MAX_ITERATIONS, FIRST_EFFORT = 1000, 5.0
WORDS = {"min": ("smaller", "lower"), "max": ("larger", "upper")}


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best solution that a search has computed, with proved bounds on the objective
    of all others, in fractions.

    data, sense : the problem, and "min" or "max".
    status : "optimal" if no solution is better; "unbounded" if the objective is
        unbounded over the solutions; "unsolvable" if the problem has no solution;
        "time_limit" or "interrupted" if the search was stopped.
    z, value : the best known solution, and its objective; None if there is none.
    bound : no solution has a better objective than this; None if no bound is known.
    gap : the distance between value and bound; None if one of them is not known.
    nodes : the nodes of the tree. seconds : the time of the search.
    """

    data: ExactProblem
    sense: str
    status: str
    z: list[Fraction] | None
    value: Fraction | None
    bound: Fraction | None
    nodes: int
    seconds: float

    @property
    def gap(self) -> Fraction | None:
        return (
            None
            if self.value is None or self.bound is None
            else abs(self.value - self.bound)
        )

    @property
    def w(self) -> list[Fraction] | None:
        return None if self.z is None else self.data.w(self.z)

    @property
    def equilibrium(self) -> Any:
        """Return the equilibrium that z represents; None if the problem is no game."""
        return meaning_of(self.data).equilibrium(self.z) if self.z else None

    @property
    def outward(self) -> dict[str, int]:
        """Return the directions, 1 for upward and -1 for downward, in which value,
        bound and gap may be rounded so that statements about them remain true: a bound
        away from the value; and the objective of a solution that need not be the best
        towards worse values.
        """
        side = int(-SENSES[self.sense])
        return {
            "value": side if self.status == OPTIMAL else -side,
            "bound": side,
            "gap": 1,
        }

    def message(
        self, cell: Callable[[Fraction, int], str] = lambda value, _: text(value)
    ) -> str:
        """Return the outcome in one sentence, with numbers in the format of `cell`,
        rounded in the direction passed to it.
        """
        better, side = WORDS[self.sense]
        numbers = ((name, getattr(self, name)) for name in ("value", "bound"))
        value, bound = (
            "" if number is None else cell(number, self.outward[name])
            for name, number in numbers
        )
        if self.status == UNSOLVABLE:
            return (
                "no solution: every complementary basis is excluded in rational "
                "arithmetic"
            )
        if self.status == UNBOUNDED:
            return f"solutions have {better} and {better} objectives without limit"
        if self.status == OPTIMAL:
            return (
                f"optimal: {'least' if better == 'smaller' else 'largest'} value "
                f"{value} (exact)"
            )
        progress = (
            "no solution is known"
            if self.value is None
            else f"the best known objective is {value}"
        )
        proved = (
            "no bound is proved"
            if self.bound is None
            else f"the proved {side} bound is {bound}"
        )
        return f"{self.status.replace('_', ' ')}: {progress}, {proved}"

    def __repr__(self) -> str:
        return f"<Optimum: {self.message()}>"


def optimum(
    problem: Problem | ExactProblem,
    objective: Any,
    *,
    sense: str = "min",
    time_limit: float | None = None,
) -> Optimum:
    """Find the solution of a problem with the least, or the largest, objective'z, in
    exact arithmetic.

    Parameters
    ----------
    problem : a Problem, whose doubles are taken as exact, or an ExactProblem; at most
        500 unknowns. Of a game, the payoffs are used, as in `solutions`.
    objective : shape (n,), numbers, also Fractions; or coefficients by the names of
        unknowns, the others 0; or an expression such as "z1 + 2 z3". In a program to be
        maximized, the name of a row denotes its multiplier in that sense, whose sign is
        opposite to that in z. For a game, also '"payoff of row" + "payoff of column"',
        and for a game tree '"payoff of Ann"': these are the expected payoffs.
    sense : "min" or "max".
    time_limit : seconds after which to stop, with the best known solution and a bound;
        by default there is no limit.

    Raises
    ------
    ProblemError, OptionError : a parameter is of the wrong kind, or out of range.

    Examples
    --------
    >>> import lcpcli
    >>> problem = lcpcli.Problem([[1, 2], [2, 1]], [-1, -1])
    >>> best = lcpcli.optimum(problem, [2, 1], sense="max")
    >>> list(map(str, best.z)), str(best.value), best.status
    (['1', '0'], '2', 'optimal')
    """
    options.check((options.TIME_LIMIT,), {"time_limit": time_limit})
    data = in_exact_numbers(problem)
    sign, constant = int(SENSES[sense_of(sense)]), Fraction(0)
    searched = InPayoffs(data, list)
    if isinstance(objective, str):
        # A name may contain blanks, or resemble a number.
        is_name = objective.strip() in data.problem.names
        objective = {objective.strip(): 1} if is_name else coefficients(objective)
    if isinstance(objective, Mapping):
        exact_objective = dict(
            zip(
                objective,
                _fractions(list(objective.values()), len(objective)),
                strict=True,
            )
        )
        searched, objective, constant = in_costs(data, exact_objective)
    (objective,) = by_names(lambda: data.problem.names, objective=objective)
    began = clock.seconds()
    costs = _costs(searched.data, objective)
    search = Search(searched.data, [sign * cost for cost in costs])
    try:
        with deadline_after(math.inf if time_limit is None else time_limit):
            search.begin()
            status = search.run()
    except TimeIsUp:
        status = TIME_LIMIT
    value, bound = (
        None if each is None else each * sign + constant
        for each in (search.value, search.bound(status))
    )
    z = search.z
    if z is not None and searched.data is not data:
        z = searched.z_of(z)
        assert data.is_solution(z)
    return Optimum(
        data, sense, status, z, value, bound, search.nodes, clock.seconds() - began
    )


def best(
    data: ExactProblem,
    costs: list[Fraction],
    sense: str,
    constant: Fraction,
    time_limit: float,
) -> Optimum:
    """Return the solution with the best costs'z + constant, as `optimum` does."""
    best_solution = optimum(data, costs, sense=sense, time_limit=time_limit)
    value, bound = (
        None if each is None else each + constant
        for each in (best_solution.value, best_solution.bound)
    )
    return replace(best_solution, value=value, bound=bound)


def _costs(data: ExactProblem, objective: Any) -> list[Fraction]:
    """Return the coefficients of an objective as fractions."""
    problem = data.problem
    if not isinstance(objective, Mapping):
        return _fractions(objective, problem.n)
    costs, turned = zeros(problem.n), reversed_names(problem)
    for name, value in objective.items():
        i = _index(data, name)
        costs[i] += -value if i in turned and name == problem.names[i] else value
    return costs


def _fractions(raw_values: Any, n: int) -> list[Fraction]:
    """Return n numbers as fractions, exactly; raise ProblemError for anything else."""
    values = as_vector("objective", raw_values, n)
    pairs = zip(
        np.asarray(raw_values, dtype=object).ravel().tolist(),
        values.tolist(),
        strict=True,
    )
    return [
        each if isinstance(each, Fraction) else Fraction(value) for each, value in pairs
    ]


def _index(data: ExactProblem, name: Any) -> int:
    """Return the index of the unknown with this name, or with a number as in z1; raise
    ProblemError if there is none.
    """
    names, positions = list(data.problem.names), [f"z{i}" for i in range(1, data.n + 1)]
    matching_names = next(
        (each for each in (names, positions) if name and name in each), None
    )
    if matching_names is None:
        hint = "leave it out: the problem has no unknowns"
        if positions:
            hint = f"use names of unknowns, or {positions[0]} to {positions[-1]}"
        raise ProblemError(
            "objective",
            f"names {quoted(name)}",
            ", or ".join([hint, *map(repr, names_of_payoffs(data))]),
        )
    if matching_names.count(name) > 1:
        times = matching_names.count(name)
        reason = f"names {quoted(name)}, as {times} unknowns are called"
        raise ProblemError("objective", reason, "use z1, z2, ...")
    return matching_names.index(name)


class _Open(NamedTuple):
    """A node that has not been branched on, with its bound and its number. violated :
    as in `Unknowns`.
    """

    bound: float | Fraction
    order: int
    node: Node
    violated: dict[int, int]


class Search:
    """The search for the smallest objective.

    nodes : the number of nodes of the tree. z, value : the best known solution, and its
        objective. The queue has the nodes that have not been branched on: the last one
        is examined first until there is a solution, then the one with the smallest
        bound.
    """

    def __init__(self, data: ExactProblem, costs: Sequence[Fraction]) -> None:
        self.data = data
        self.nodes = 0
        self._costs = costs
        self.z: list[Fraction] | None = None
        self.value: Fraction | None = None
        self._open: list[_Open] = []
        self._current: list[_Open] = []  # the node that is being branched on
        self._unknowns = Unknowns(data, Effort().steps(data))
        self._form, self._scale = self._unknowns.objective(costs)
        self.check = self._unknowns.check

    def begin(self) -> None:
        """Start with a solution that a run in floating-point arithmetic finds, so that
        there is one even if the time is short.
        """
        limits = Limits(
            max_iterations=MAX_ITERATIONS,
            time_limit=max(remaining() / 2, MIN_SECONDS),
        )
        result = driver.run(self.data.problem, "auto", limits=limits)
        if result.interrupted:
            raise KeyboardInterrupt
        if (
            result.solved
            and (z := from_point(self.data, result.z, Effort(FIRST_EFFORT))) is not None
        ):
            self.z = z
            self.value = sum(
                (c * v for c, v in zip(self._costs, z, strict=True)), Fraction(0)
            )

    def run(self) -> str:
        """Search until the best solution is proved to be the best; return the status of
        the search.
        """
        root = self._unknowns.root(self._form)
        self.extend([] if root is None else self._opened(root))
        if any(is_leaf for _, is_leaf in explored(self, self)):
            return UNBOUNDED
        return UNSOLVABLE if self.value is None else OPTIMAL

    def bound(self, status: str) -> Fraction | None:
        """Return a lower bound on the objective of all solutions, after a search with
        this status; None if there is none.
        """
        if status == OPTIMAL:
            return self.value
        bounds = [each.bound for each in (*self._open, *self._current)]
        if status != TIME_LIMIT or not bounds or min(bounds) == -math.inf:
            return None
        smallest_bound = Fraction(min(bounds))
        return smallest_bound if self.value is None else min(smallest_bound, self.value)

    def __len__(self) -> int:
        """Return the number of nodes in the queue, 0 if none can have a better
        solution."""
        self._current = []
        is_over = (
            self.value is not None and self._open and self._open[0].bound >= self.value
        )
        return 0 if is_over else len(self._open)

    def pop(self) -> _Open:
        self._current = [
            self._open.pop() if self.value is None else heappop(self._open)
        ]
        return self._current[0]

    def extend(self, nodes: Iterable[_Open]) -> None:
        for each in nodes:
            if self.value is None:
                self._open.append(each)
            else:
                heappush(self._open, each)

    def violations(self, each: _Open) -> dict[int, int]:
        return each.violated

    def branching_index(self, each: _Open) -> int | None:
        return self._unknowns.branching_index(each.node)

    def children(self, parent: _Open, k: int) -> Iterator[_Open]:
        """Yield the nodes for each status of the unknown that are not empty and may
        contain a better solution.
        """
        minimized_form = None if parent.bound == -math.inf else OBJECTIVE * self.data.n
        for state in self._unknowns.choices[k]:
            child = parent.node.copy()
            if self._unknowns.choose(child, k, state, minimized_form=minimized_form):
                yield from self._opened(child)

    def _opened(self, node: Node) -> Iterator[_Open]:
        """Record the minimizer of a node if it is a better solution than those known so
        far. Yield the node with its bound if other points in it may be better still.
        """
        self.nodes += 1
        unknowns = self._unknowns
        dictionary = node.dictionary
        form = OBJECTIVE * self.data.n
        is_bounded = dictionary.minimize(form)
        value = Fraction(dictionary.value(form), int(dictionary.divisor) * self._scale)
        if is_bounded and self.value is not None and value >= self.value:
            return
        violated = unknowns.violated(node, unknowns.states_at_point(node))
        if not violated and (self.value is None or value < self.value):
            z = list(unknowns.point(node))
            assert self.data.is_solution(z)
            if self.value is None:
                heapify(self._open)
            self.z, self.value = z, value
        if violated or not is_bounded:
            yield _Open(value if is_bounded else -math.inf, self.nodes, node, violated)
