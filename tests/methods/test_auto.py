"""What auto does: its attempts take turns in rounds, search where M has no property that helps, and a tree whose proofs
are exact; presolve gets half of the time for milp."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Generator
from functools import partial
from itertools import groupby

import numpy as np
import pytest
from scipy.sparse import block_array, block_diag, csr_array, diags_array, identity

from lcpcli import Problem, Status, clock, inspect, plan, run
from lcpcli.auto import attempts as auto_table
from lcpcli.auto import policy
from lcpcli.auto.attempts import ROUNDS, TABLE, Row, in_rounds
from lcpcli.auto.policy import _for_half_of_the_time, _search
from lcpcli.auto.structure import MOST_PIVOTED_BY_NUMPY, Structure
from lcpcli.gallery import families
from lcpcli.interrupts import TimeIsUp, check, remaining, within
from lcpcli.methods import lemke
from lcpcli.methods.direct import MOST_PIVOTED
from lcpcli.methods.milp import milp
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import Breakdown, Finished, Iterate, NoSolution, OutOfTime, Stage, Stalled, Turns, advance
from lcpcli.verify.point import Point

from .. import exact
from .planted import solvable
from .stages import through
from .test_reflections import planted

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
    monkeypatch.setattr("lcpcli.auto.attempts.FIRST", (new, *auto_table.FIRST))
    for place in ("inspection.inspection", "solving.direct_run"):
        monkeypatch.setattr(f"lcpcli.{place}.FIRST", (new, *auto_table.FIRST), raising=False)
    assert run(problem).route == ("known",)
    assert plan(problem)[0] == ("known", "", None, "it is known")
    assert "known" in repr(inspect(problem))


@pytest.mark.parametrize("name", ["harker-pang", "bimatrix", "lp", "contact", "planted", "obstacle", "circuit"])
@pytest.mark.parametrize("n", [8, 18, 60, 500])
def test_the_route_of_a_run_is_a_part_of_its_plan(name: str, n: int) -> None:
    problem = families.make(name, min(n, {"bimatrix": 200, "planted": 60}.get(name, n)))
    planned = {attempt.method for attempt in plan(problem)} | {"auto"}
    inside = {"krylov", "multilevel", "gradient"} if planned & {"sparse", "newton"} else set()
    assert set(run(problem, trace=True).route) <= planned | inside


def test_every_attempt_is_one_of_a_method_or_of_the_sparse_route() -> None:
    assert {row.method for row in TABLE} - {
        "linear",
        "piqp",
        "sparse",
        "elimination",
        "pure",
        "lemke-howson",
    } <= METHODS.keys()
    assert all(count == 1 for count in Counter((row.method, row.part, row.reason) for row in TABLE).values())


def test_a_plan_says_that_presolve_and_exact_arithmetic_take_part() -> None:
    bounded = Problem(np.diag([1.0, 0.0, 2.0]) + np.triu(np.ones((3, 3)), 1), -np.ones(3), upper=[1, 2, np.inf])
    methods = [attempt.method for attempt in plan(bounded)]
    assert "presolve" in methods
    assert methods.index("exact") < methods.index("milp")


@pytest.mark.slow("takes 1500 iterations of all methods")
def test_iterations_of_all_rounds_count_and_a_method_stands_in_the_route_once() -> None:
    result = run(families.make("gaussian", 310), max_iterations=1500, trace=True)
    assert result.status.word == "iteration_limit"
    assert result.iterations == len(result.trace.rows) - 1 == 1500
    assert len(set(result.route)) == len(result.route)
    turns = [name for name, _ in groupby(row.method for row in result.trace.rows[1:])]
    assert turns.count("reflections") > 1


POINT = Iterate(np.zeros(1), None, "", 0)


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list with the time of the clock."""
    time = [0.0]
    monkeypatch.setattr(clock, "seconds", lambda: time[0])
    return time


def looking(seen: list[float]) -> Stage:
    """Note the time that is left, twice, then ask whether there is any."""
    for _ in range(2):
        seen.append(remaining())
        yield POINT
    check()
    return Finished()


def test_the_second_half_is_left_and_no_context_is_open_in_between(now: list[float]) -> None:
    seen: list[float] = []
    with within(100.0):
        stage = _for_half_of_the_time(looking(seen))
        for time, left in ((10.0, 90.0), (50.0, 50.0)):
            assert advance(stage) is POINT
            now[0] = time
            assert remaining() == left
        assert seen == [50.0, 40.0]
        now[0] = 51.0
        assert isinstance(advance(stage), OutOfTime)


@pytest.mark.parametrize(("limit", "time", "half"), [(math.inf, 1e9, math.inf), (100.0, 101.0, 50.0)])
def test_the_end_of_the_whole_time_is_that_of_the_run_and_half_of_no_limit_is_none(
    limit: float, time: float, half: float, now: list[float]
) -> None:
    seen: list[float] = []
    with within(limit):
        stage = _for_half_of_the_time(looking(seen))
        assert [advance(stage), advance(stage)] == [POINT, POINT]
        now[0] = time
        if time < limit:
            assert isinstance(advance(stage), Finished)
        else:
            with pytest.raises(TimeIsUp):
                advance(stage)
    assert seen == [half, half]


def gaussian(n: int, seed: int) -> Problem:
    random = np.random.default_rng(seed)
    return Problem(random.normal(size=(n, n)), random.normal(size=n))


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_solution_with_w_0_and_many_z_0_is_found_at_once(symmetric: bool) -> None:
    for seed in range(2):
        random = np.random.default_rng(seed)
        M = random.normal(size=(100, 100)) * (random.random((100, 100)) < 0.3)
        M = M + M.T if symmetric else M
        result = run(Problem(csr_array(M), -M @ np.maximum(random.random(100) - 0.5, 0.0)))
        assert (result.solved, result.route) == (True, ("newton",))


@pytest.mark.parametrize("family", ["contact", "lp", "qp", "transport"])
def test_zeros_on_the_diagonal_call_for_lemke_and_for_interior_before_it_where_pivots_cost_more(family: str) -> None:
    small, large = (run(families.make(family, n), trace=True) for n in (MOST_PIVOTED_BY_NUMPY // 2, MOST_PIVOTED + 50))
    assert (small.solved, small.route) == (True, ("lemke",))
    assert (large.solved, {"interior", "piqp"} & {*large.route} != set(), "lemke" in large.route) == (True, True, False)


def test_attempts_that_the_direct_run_has_made_are_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made, pivoted = [], lemke.pivoted
    monkeypatch.setattr(lemke, "pivoted", lambda *given: made.append(given) or pivoted(*given))
    result = run(families.make("ray", 24), trace=True)
    assert (result.solved, result.route[-1], len(made)) == (True, "milp", 1)


def test_infeasible_problems_wait_for_no_search() -> None:
    results = [run(gaussian(20, seed)) for seed in range(100, 106)]
    assert Status.INFEASIBLE in {result.status for result in results}
    assert not any("reflections" in result.route for result in results if result.status is Status.INFEASIBLE)


def test_factors_of_narrow_bands_come_first_as_long_as_they_settle_fast() -> None:
    for n in (200, 1000):
        M = families.make("tridiagonal", n).M + diags_array([np.ones(n - 2)], offsets=[2])  # no Z-matrix
        assert run(Problem(M, -np.ones(n))).route == ("newton",)


def test_games_with_zeros_only_on_the_diagonal_call_for_lemke() -> None:
    assert "interior" not in run(families.make("bimatrix", 50), trace=True).route


def test_planted_solutions_are_found() -> None:
    result = run(Problem(*planted(80, 0)))
    assert (result.solved, result.route[-1]) == (True, "reflections")
    assert run(solvable("any", 48, np.random.default_rng(2))).solved


@pytest.mark.parametrize("seed", range(100, 112))
def test_problems_without_a_known_solution_are_decided(seed: int) -> None:
    assert run(gaussian(20 + seed % 2 * 10, seed), time_limit=60).status in (
        Status.SOLVED,
        Status.INFEASIBLE,
        Status.UNSOLVABLE,
    )


@pytest.mark.slow("60 problems in exact arithmetic")
def test_the_tree_decides_as_exact_arithmetic_does() -> None:
    for problem in (gaussian(8, seed) for seed in range(60)):
        excluded = isinstance(through(milp(problem, np.zeros(8)))[1], NoSolution)
        assert excluded == (exact.solution(problem) is None)


def test_a_solution_that_rounding_hides_from_a_linear_program_is_found() -> None:
    """x_1 = 2^25, where the terms of a row are 3e7 times their sum: the LP finds a proof up to rounding first."""
    eps, small, k = 2.0**-52, 2.0**-27, 150
    A = block_diag([[[1 + eps, -1], [-1, 1]], identity(k)])
    b, c = np.ones(k + 2), np.ones(k + 2)
    b[1], c[:2] = small - 1, 0
    result = run(Problem(csr_array(block_array([[None, -A.T], [A, None]])), np.append(c, -b)))
    assert result.solved


def test_the_tree_waits_where_milp_is_to_wait() -> None:
    """As for problems without their far bounds, which come before the problem as it is."""
    problem = gaussian(32, 105)
    search = partial(_search, presolve=True, states=False)
    assert isinstance(through(search(problem, Turns(np.zeros(32))))[1], NoSolution)
    assert isinstance(through(search(problem, Turns(np.zeros(32)), milp=False))[1], Stalled)


def test_search_ends_soon_after_a_point_whose_violations_may_be_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Point, "solves", lambda _: False)
    monkeypatch.setattr(policy, "_improved", no_improvement)
    result = run(families.make("contact", 48), time_limit=60.0)
    assert (result.status, result.residual < 1e-10) == (Status.STALLED, True)
    assert policy.NEARLY in result.message or "satisfies each row by its own terms" in result.message
    assert "milp" not in result.route


def no_improvement(*_: object) -> Generator[Iterate, None, bool]:
    yield from ()
    return False


@pytest.mark.parametrize(("n", "is_dense"), [(100, True), (401, True), (401, False), (1000, False)])
def test_a_first_time_step_of_an_american_put_is_solved_although_far_prices_are_tiny(n: int, is_dense: bool) -> None:
    """Far out of the money they fall to 1e-38, and q is 0 there: from q < 0, each step of pivoting finds one more."""
    strike, rate, volatility, step = 100.0, 0.05, 0.2, 0.01
    x, h = np.linspace(-1.2, 1.2, n + 2, retstep=True)
    payoff = np.maximum(strike - strike * np.exp(x), 0.0)
    a, b = volatility**2 / (2 * h**2), (rate - volatility**2 / 2) / (2 * h)
    M = diags_array([-(a - b) * step, 1 + (2 * a + rate) * step, -(a + b) * step], offsets=[-1, 0, 1], shape=(n, n))
    q = M @ payoff[1:-1] - payoff[1:-1]
    q[0] -= (a - b) * step * payoff[0]
    result = run(Problem(M.toarray() if is_dense else csr_array(M), q))
    assert result.solved
    assert (result.z > 0)[np.argmax(result.z > 0) :].all()
