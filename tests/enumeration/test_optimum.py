"""The best solution by a linear objective, against all solutions, and what is proved at
a limit. Linear bilevel programs of the literature, with published optima: the
conditions of the follower are a mixed problem.
"""

import json
import re
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng

import lcpcli
from lcpcli.enumeration.optimum import Optimum
from lcpcli.enumeration.search import TIME_LIMIT
from lcpcli.files.contents import Source
from lcpcli.gallery.families import make
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.report import solutions

from .solution_sets import random_problem

SOURCE = Source("best.json")


def best_of_all(problem, costs):
    """The least objective of the vertices of all pieces, unless it falls along a
    ray."""
    pieces = list(lcpcli.solutions(problem))

    def value(z):
        return sum((cost * v for cost, v in zip(costs, z, strict=True)), Fraction(0))

    if not pieces:
        return "unsolvable", None
    if any(value(ray) < 0 for each in pieces for ray in each.rays) or any(
        map(value, _lines(pieces))
    ):
        return "unbounded", None
    return "optimal", min(value(vertex) for each in pieces for vertex in each.vertices)


def _lines(pieces):
    return [line for each in pieces for line in each.lines]


def test_it_is_the_best_of_all_solutions():
    ends, random = [], default_rng(3)
    for seed in range(25):
        M, q, lower, upper = random_problem(random, 5)
        problem = lcpcli.Problem(M, q, lower=lower, upper=upper)
        costs = random.integers(-4, 5, problem.n).tolist()
        expected = best_of_all(problem, costs)
        found = lcpcli.optimum(problem, costs)
        assert (
            found.status,
            found.value if found.status == "optimal" else None,
        ) == expected, seed
        largest = lcpcli.optimum(problem, [-cost for cost in costs], sense="max")
        assert largest.status == found.status
        assert largest.z == found.z
        ends.append(found.status)
        if found.status == "optimal":
            assert found.z is not None
            assert found.gap == 0
            assert found.value == sum(
                c * v for c, v in zip(costs, found.z, strict=True)
            )
            assert lcpcli.check(problem, found.z).accepted
    assert {"optimal", "unbounded", "unsolvable"} == set(ends)


def test_at_a_limit_there_is_the_best_so_far_and_a_proved_gap(lcp, tmp_path):
    problem = make("planted", 40, seed=1)
    found = lcpcli.optimum(problem, np.ones(40), time_limit=0.05)
    assert found.status == "time_limit"
    assert found.bound is None or found.value is None or found.bound <= found.value
    lcpcli.write(problem, tmp_path / "p.json")
    ended = lcp(
        f"solve {tmp_path / 'p.json'} --minimize z1 --time-limit 1e-6 --format json"
    )
    assert ended.code == 1
    assert ended.record["status"] == "time_limit"


def test_the_best_equilibrium_by_payoffs_is_that_of_all_equilibria():
    random = default_rng(3)
    for _ in range(6):
        shape = random.integers(1, 5, 2)
        game = lcpcli.from_game(*random.integers(-3, 4, (2, *shape)))
        of_row, of_column = random.integers(-2, 3, 2).tolist()
        objective = {"payoff of row": of_row, "payoff of column": of_column}
        everything = lcpcli.solutions(game)
        list(everything)
        values = [
            value_of(objective, each.payoffs) for each in everything.equilibria.extreme
        ]
        for sense, best in (("min", min), ("max", max)):
            found = lcpcli.optimum(game, objective, sense=sense)
            assert found.status == "optimal"
            assert found.bound == found.value
            own = value_of(objective, found.equilibrium.payoffs)
            assert found.value == best(values) == own


# The third row is the mean of the others: rounded costs make it worse.
MEANS = ([[0.6, 0.7], [0.8, 0.6], [0.7, 0.65]], [[0.9, 0.8], [0.1, 0.9], [0.8, 0.4]])
THIRDS = ([["1/3", "2/3"], ["1/3", "2/3"]], [["1/3", 0], [0, "1/3"]])


@pytest.mark.parametrize("payoffs", [MEANS, THIRDS])
def test_the_best_equilibrium_is_one_of_the_payoffs_as_written(payoffs):
    game = lcpcli.from_game(*payoffs)
    everything = lcpcli.solutions(game)
    list(everything)
    values = [each.payoffs[1] for each in everything.equilibria.extreme]
    for data in (game, ExactProblem.of_problem(game)):
        for sense, best in (("min", min), ("max", max)):
            found = lcpcli.optimum(data, '"payoff of column"', sense=sense)
            assert found.status == "optimal"
            assert found.value == best(values)


def value_of(objective, payoffs):
    return sum(
        (a * b for a, b in zip(objective.values(), payoffs, strict=True)), Fraction(0)
    )


@settings(max_examples=15)
@given(
    st.integers(-(10**9), 10**9), st.integers(1, 10**9), st.sampled_from(["min", "max"])
)
def test_every_number_that_is_shown_of_an_optimum_is_a_bound(p, d, sense):
    problem = lcpcli.Problem([[d]], [-p], lower=-np.inf)
    found = lcpcli.optimum(problem, [1], sense=sense)
    side = 1 if sense == "max" else -1
    report, record = (
        solutions.build(found, False, "table"),
        json.loads(solutions.solutions_report(found, SOURCE, False).render("json")),
    )
    words = " ".join(
        [report.sections[0].verdict, *report.sections[0].facts[:2], record["message"]]
    )
    shown = [
        Fraction(word) for word in re.findall(r"-?[0-9][0-9.]*(?:e[-+]?[0-9]+)?", words)
    ]
    assert len(shown) == 4
    assert all(side * (value - Fraction(p, d)) >= 0 for value in shown)
    for value in (record["value"], record["bound"]):
        excess = side * (Fraction(value) - Fraction(p, d))
        assert 0 <= excess <= abs(Fraction(p, d)) / 2**51


def test_at_a_limit_the_best_so_far_and_the_bound_are_rounded_apart():
    third = Fraction(1, 3)
    for sense, value, bound in (("min", 2 * third, third), ("max", third, 2 * third)):
        data = ExactProblem.of_floats(make("murty", 2))
        found = Optimum(data, sense, TIME_LIMIT, None, value, bound, 1, 0.0)
        record = json.loads(
            solutions.solutions_report(found, SOURCE, False).render("json")
        )
        low, high = sorted((record["value"], record["bound"]))
        assert Fraction(low) <= third
        assert Fraction(high) >= 2 * third
        assert Fraction(record["gap"]) >= third


def test_a_table_of_an_optimum_says_where_it_is_cut(lcp, tmp_path, monkeypatch):
    n, file = 13, tmp_path / "p.json"
    monkeypatch.setattr(solutions, "MAX_LINES", n - 1)
    file.write_text(json.dumps({"M": np.eye(n).tolist(), "q": [-1] * n}))
    shown = lcp(f"solve {file} --minimize z1").out
    assert (
        f"the first {n - 1} of {n} rows; --format json and csv have all of them"
        in shown
    )
    assert f"z{n - 1} " in shown
    assert f"z{n} " not in shown


Rows = Sequence[Sequence[float]]


class Program(NamedTuple):
    """Minimize leader'(x, y) for 0 <= x <= most and upper (x, y) <= limits, where y
    minimizes a convex function, with the gradient curvature (x, y) + follower, for rows
    (x, y) <= sides and 0 <= y <= most."""

    source: str
    optimum: str
    leader: Sequence[float]
    follower: Sequence[float]
    rows: Rows
    sides: Sequence[float]
    most: float = 10
    upper: Rows = ()
    limits: Sequence[float] = ()
    curvature: Rows = ()

    def problem(self):
        """Return the mixed problem in x, y, the multipliers of the rows, and one
        unknown for each row of the leader."""
        k = len(self.follower)
        m = len(self.rows)
        outer = len(self.limits)
        n = len(self.leader)
        G, H = np.array(self.rows), np.reshape(self.upper, (outer, n))
        M = np.zeros((n + m + outer, n + m + outer))
        M[n - k : n, :n] = self.curvature or 0
        M[n - k : n, n : n + m] = G[:, n - k :].T
        M[n : n + m, :n], M[n + m :, :n] = -G, -H
        q = [*[0] * (n - k), *self.follower, *self.sides, *self.limits]
        upper = [*[self.most] * n, *[np.inf] * (m + outer)]
        return lcpcli.Problem(M, q, upper=upper)


PROGRAMS = [
    Program(
        "Clark and Westerberg 1988",
        "-37",
        [1, -4],
        [1],
        [[-2, 1], [2, 5], [2, -3]],
        [0, 108, -4],
        most=30,
    ),
    Program(  # with y + 10 for y
        "Aiyoshi and Shimizu 1984, example 2",
        "0",
        [2, 2, -3, -3],
        [20, 20],
        [[-1, 0, 2, 0], [0, -1, 0, 2]],
        [10, 10],
        most=50,
        upper=[[1, 1, 1, -2]],
        limits=[30],
        curvature=[[-2, 0, 2, 0], [0, -2, 0, 2]],
    ),
]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.source)
def test_the_optimum_is_the_published_one(program):
    problem = program.problem()
    costs = {f"z{i}": Fraction(str(cost)) for i, cost in enumerate(program.leader, 1)}
    found = lcpcli.optimum(ExactProblem.of_decimals(problem), costs)
    assert found.status == "optimal"
    assert found.value == Fraction(program.optimum)
