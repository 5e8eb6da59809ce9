"""The table of auto: its attempts take turns in rounds, and a row that is added is tried and shown."""

from __future__ import annotations

import math
from collections import Counter
from itertools import groupby

import numpy as np
import pytest

from lcpcli import Problem, inspect, plan, run
from lcpcli.gallery import families
from lcpcli.methods import auto_table
from lcpcli.methods.auto_table import ROUNDS, TABLE, Row, in_rounds
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Turns
from lcpcli.methods.structure import Structure

from .stages import through

PROBLEM = families.make("harker-pang", 150)
STRUCTURE = Structure(PROBLEM, np.zeros(PROBLEM.n))


def counting(_: Structure) -> Stage:
    """Yield iterates for ever; their evaluations are 2, 4, 6, ..."""
    k = 0
    while True:
        k += 1
        yield Iterate(np.zeros(PROBLEM.n), None, "", 2 * k)


def failing(_: Structure) -> Stage:
    yield Iterate(np.zeros(PROBLEM.n), None, "", 1)
    raise FloatingPointError("overflow")


def ended(_: Structure) -> Stage:
    yield Iterate(np.zeros(PROBLEM.n), None, "", 1)
    return Breakdown("at once")


def row(name: str, begin: auto_table.Callable[[Structure], Stage], share: float = 3, first_round: int = 0) -> Row:
    return Row(name, "", "", lambda _: True, begin, lambda _: share, first_round)


def turns_of(*rows: Row) -> tuple[list[tuple[str, int]], Turns]:
    """Return the names of the turns with their numbers of iterates, and the turns."""
    taken, turns = [], Turns(np.zeros(PROBLEM.n))
    for name, stage in in_rounds(STRUCTURE, rows):
        taken.append((name, len(through(turns.take(name, stage))[0])))
    return taken, turns


def test_attempts_go_on_in_rounds_with_doubled_shares() -> None:
    taken, turns = turns_of(row("a", counting), row("b", counting, 1))
    assert taken == [(name, share * 2**k) for k in range(ROUNDS) for name, share in (("a", 3), ("b", 1))]
    assert turns.last.evaluations == 2 * sum(iterates for _, iterates in taken)


def test_attempts_that_have_ended_or_failed_have_no_further_turn() -> None:
    taken, _ = turns_of(row("failing", failing), row("ended", ended), row("late", ended, first_round=1))
    assert taken == [("failing", 1), ("ended", 1), ("late", 1)]


def test_attempts_with_large_matrices_are_not_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(auto_table, "MOST_HELD", PROBLEM.n - 1)
    assert turns_of(row("a", counting))[0] == [("a", 3)]


def test_a_row_that_is_added_is_tried_and_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first row of all finds a solution that is known beforehand."""
    problem = families.make("planted", 150)
    z = problem.box.project(np.asarray(problem.solutions[0]))

    def known(_: Structure) -> Stage:
        yield Iterate(problem.box.x_of(z, problem.w(z)), None, "", 1)
        return Finished()

    new = row("known", known, math.inf)._replace(reason="it is known")
    monkeypatch.setattr("lcpcli.methods.auto_table.FIRST", (new, *auto_table.FIRST))
    for place in ("inspection.plan", "solving.direct_run"):
        monkeypatch.setattr(f"lcpcli.{place}.FIRST", (new, *auto_table.FIRST), raising=False)
    assert run(problem).route == ("known",)
    assert plan(problem)[0] == ("known", "", None, "it is known")
    assert "known" in repr(inspect(problem))


@pytest.mark.parametrize("name", ["harker-pang", "bimatrix", "lp", "contact", "planted", "obstacle", "circuit"])
@pytest.mark.parametrize("n", [8, 18, 60, 500])
def test_the_route_of_a_run_is_a_part_of_its_plan(name: str, n: int) -> None:
    problem = families.make(name, min(n, 200) if name in ("bimatrix", "planted") else n)
    planned = {attempt.method for attempt in plan(problem)} | {"auto"}
    inside = {"krylov", "multilevel", "gradient"} if planned & {"sparse", "newton"} else set()
    assert set(run(problem, trace=True).route) <= planned | inside


def test_every_attempt_is_one_of_a_method_or_of_the_sparse_route() -> None:
    assert {row.method for row in TABLE} - {"linear", "sparse"} <= METHODS.keys()
    assert all(count == 1 for count in Counter((row.method, row.part, row.reason) for row in TABLE).values())


def test_a_plan_says_that_presolve_and_exact_arithmetic_take_part() -> None:
    bounded = Problem(np.diag([1.0, 0.0, 2.0]) + np.triu(np.ones((3, 3)), 1), -np.ones(3), upper=[1, 2, np.inf])
    methods = [attempt.method for attempt in plan(bounded)]
    assert "presolve" in methods
    assert methods.index("exact") < methods.index("milp")


def test_iterations_of_all_rounds_count_and_a_method_stands_in_the_route_once() -> None:
    result = run(families.make("gaussian", 310), max_iterations=1300, trace=True)
    assert result.status.word == "iteration_limit"
    assert result.iterations == len(result.trace.rows) - 1 == 1300
    assert len(set(result.route)) == len(result.route)
    turns = [name for name, _ in groupby(row.method for row in result.trace.rows[1:])]
    assert turns.count("reflections") > 1
