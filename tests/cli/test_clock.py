"""One clock: what the user waits for, in parts that add up, without imports, the same
in every command; comparisons."""

import os
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Status, Trace, clock, interrupts, read
from lcpcli.bench.timing import run_method
from lcpcli.cli import problems as timing
from lcpcli.files import contents
from lcpcli.methods.registry import METHODS
from lcpcli.options import Limits
from lcpcli.report import outcome
from lcpcli.solving import driver
from lcpcli.solving.driver import run, verified
from lcpcli.verify.point import Criterion, Point

from .conftest import EXAMPLE, python

PROBLEM = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
MAX_REPETITIONS = driver.MAX_REPETITIONS  # before the tests make it less
PARTS = ("setup_seconds", "solve_seconds", "verify_seconds")


class Time:
    """A clock that goes on by one second each time it is read, and by `pause` more each
    tenth time."""

    def __init__(self, pause=0.0):
        self.now, self.readings, self.pause = 0.0, 0, pause

    def __call__(self):
        self.readings += 1
        self.now += 1.0 + self.pause * (self.readings % 10 == 0)
        return self.now


@pytest.fixture
def ticking(monkeypatch):
    ticking = Time()
    monkeypatch.setattr("time.perf_counter", ticking)
    return ticking


@pytest.mark.usefixtures("ticking")
def test_clock_stands_still_during_imports():
    before = clock.seconds()
    with clock.imports, clock.imports:
        pass
    assert clock.seconds() - before == pytest.approx(2.0)  # of 3, as one passed inside


LOADED = """
import os, sys, time
passed = 0.0
class Watch:
    def find_spec(self, name, path=None, target=None):
        global passed
        passed += 1.0
from lcpcli import clock
sys.meta_path.insert(0, Watch())
time.perf_counter = lambda: passed
import numpy as np
import lcpcli
method, cycle = sys.argv[1], np.roll(np.eye(10), 1, axis=1)

def sparse(n, bounded):
    from scipy.sparse import diags_array
    beside = -np.ones(n - 1)
    M = diags_array([beside, 3 * np.ones(n), beside], offsets=(-1, 0, 1))
    return lcpcli.Problem(M, np.sin(np.arange(n)), upper=0.2 if bounded else None)

problems = {
    "small": lambda: lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]),
    "of 200": lambda: lcpcli.Problem(
        np.kron(np.eye(20), 3 * np.eye(10) + cycle) + 0.01, np.cos(np.arange(200))
    ),
    "sparse": lambda: sparse(
        3000 if method not in ("milp", "lemke", "shi") else 100, False
    ),
    "sparse with bounds": lambda: sparse(100 if method != "milp" else 10, True),
    "mixed": lambda: lcpcli.Problem(
        [[2, 1], [-1, 0]], [-5, 6], lower=[0, -1], upper=[3, np.inf]
    ),
    "program": lambda: lcpcli.from_qp(
        None, [1, 1], [[1, 1], [1, -1]], row_lower=[1, -1]
    ),
    "infeasible": lambda: lcpcli.Problem([[0, 1], [0, -1]], [-2, 1]),
    "infeasible, of 40": lambda: lcpcli.Problem(-np.ones((40, 40)), -np.ones(40)),
    "game": lambda: lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]),
    "game of 30": lambda: lcpcli.from_game(
        *np.random.default_rng(0).random((2, 15, 15))
    ),
    "indefinite": lambda: lcpcli.Problem(
        np.random.default_rng(1).normal(size=(12, 12)), -np.ones(12)
    ),
}
calls = {
    "run": lambda problem: lcpcli.run(
        problem, method, max_iterations=50, time_limit=0.5
    ),
    "exact": lambda problem: lcpcli.exact(problem, time_limit=0.5),
    "compiled": lambda problem: driver.run(problem, method, compiled=True),
}
for call in ("run", "exact", "compiled") if method == "auto" else ("run",):
    for kind, make in problems.items():
        if call != "run" and kind not in ("small", "infeasible", "game", "mixed"):
            continue
        if not (child := os.fork()):
            from lcpcli.solving import driver
            problem, before = make(), passed
            result = calls[call](problem)
            assert result.seconds == 0, (call, kind, result.seconds)
            is_late = result.status is lcpcli.Status.TIME_LIMIT
            assert not is_late, (call, kind, result.message)
            assert passed > before
            os._exit(0)
        assert os.waitpid(child, 0)[1] == 0, (call, kind)
"""


@pytest.mark.slow("a process for each method and kind of problem")
@pytest.mark.skipif(sys.platform == "win32", reason="cannot fork")
@pytest.mark.parametrize("method", METHODS)
def test_nothing_that_a_first_run_loads_is_part_of_it(method):
    """In new processes, by a clock that goes on only while a module is looked for."""
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # a fork has no other threads
    done = python(LOADED, method, env=alone)
    assert done.code == 0, done.err
    # Which other processes may not have kept.
    assert "compiling the kernels" in done.err or not done.err


def test_limits_and_seconds_count_the_same(monkeypatch):
    """By a clock that goes on by one second whenever anything reads it."""
    run(PROBLEM, "fixed-point")  # loads what it needs
    monkeypatch.setattr("time.perf_counter", Time())
    result = run(PROBLEM, "fixed-point", omega=50, limits=Limits(time_limit=100.0))
    assert result.status is Status.TIME_LIMIT
    assert 99.9 < result.seconds <= 110
    with interrupts.deadline_after(3.0):
        interrupts.raise_if_timed_out()
    with (
        interrupts.deadline_after(0.5),
        interrupts.deadline_after(9.0),
        pytest.raises(interrupts.TimeIsUp),
    ):
        interrupts.raise_if_timed_out()


@pytest.mark.usefixtures("ticking")
def test_clock_of_a_thread_goes_on_while_another_thread_loads_a_module():
    loading, ending = threading.Event(), threading.Event()

    def load():
        with clock.imports:
            loading.set()
            ending.wait()

    thread = threading.Thread(target=load)
    thread.start()
    loading.wait()
    before = clock.seconds()
    ending.set()
    thread.join()
    # As the other thread has read the time too.
    assert clock.seconds() - before == pytest.approx(2.0)


def test_no_part_of_a_call_is_left_out(monkeypatch):
    """From the arrays on: the parts of a call that begins at 0 end with the last
    reading but the trace's own."""
    ticking = Time()
    monkeypatch.setattr("lcpcli.solving.call.seconds", ticking)
    real = lcpcli.solving.call.driver.run
    monkeypatch.setattr(
        "lcpcli.solving.call.driver.run",
        lambda *given, **named: real(*given, clock=ticking, **named),
    )
    result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6])
    assert result.seconds == ticking.now - 1.0


@pytest.mark.parametrize(
    ("command", "method"),
    [("solve", "auto"), ("solve", "shi"), ("solve", "lemke"), ("compare", "milp")],
)
def test_parts_add_up_in_every_command(command, method, lcp):
    trace = ["--trace"] * (command == "solve")
    found = lcp(command, EXAMPLE, "--method", method, "--format", "json", *trace).record
    assert found["seconds"] == pytest.approx(
        sum(found[part] for part in PARTS), rel=1e-12
    )
    assert min(found[part] for part in PARTS) > 0
    times = [0.0, *(row["seconds"] for row in found["trace"] or ()), found["seconds"]]
    assert times == sorted(times)
    assert len(times) == 2 or times[1] > 0


def test_bench_times_from_the_arrays(monkeypatch):
    """A problem that was checked before is made anew within the time."""
    made = []
    real = Problem.anew

    def counted(problem):
        made.append(real(problem))
        return made[-1]

    monkeypatch.setattr(Problem, "anew", counted)
    answer = run_method("auto", PROBLEM, 1e-10, np.inf, True)
    assert len(made) == 1
    assert made[0] is not PROBLEM
    assert answer.curve[-1][1] <= answer.seconds


@pytest.fixture
def repeating(monkeypatch):
    """Runs are repeated, however busy the machine is."""
    monkeypatch.setattr(driver, "MAX_REPETITIONS", MAX_REPETITIONS)
    for limit in ("BRIEF", "LONGEST_REPEATED", "REPETITION_SECONDS"):
        monkeypatch.setattr(driver, limit, np.inf)


@pytest.fixture
def runs(monkeypatch, repeating):  # noqa: ARG001
    """The results of runs that a command makes, in a process that has made none."""
    results = []
    real = driver.run

    def noted(*given, **named):
        results.append(real(*given, **named))
        return results[-1]

    monkeypatch.setattr(driver, "run", noted)
    monkeypatch.setattr(timing, "methods_run", set())
    return results


def test_a_first_run_of_a_method_is_made_again_for_one_problem_as_for_many(lcp, runs):
    shown = lcp(f"solve {EXAMPLE} --method newton --format json").record
    assert 1 < len(runs) <= 1 + driver.FEW_REPETITIONS
    assert shown["seconds"] == pytest.approx(least_of(runs[1:]))
    assert len({id(run.problem) for run in runs}) == len(runs)
    runs.clear()
    found = lcp(f"solve {EXAMPLE} {EXAMPLE} --method lemke --format json").records
    *first, last = runs
    assert [each["seconds"] for each in found] == pytest.approx(
        [least_of(first[1:]), last.seconds]
    )


def test_a_run_whose_times_nobody_sees_is_made_once(lcp, runs, tmp_path):
    for given in (["-q"], ["-o", str(tmp_path / "result.json")]):
        lcp("solve", EXAMPLE, *given)
        assert len(runs) == 1
        runs.clear()
        timing.methods_run.clear()


def least_of(runs):
    return min(run.seconds for run in runs)


@pytest.mark.usefixtures("repeating")
@pytest.mark.parametrize("pause", [1.0, 100.0])
def test_the_fastest_repetition_counts_and_long_pauses_in_the_others_are_told(pause):
    """The first run, which is the fastest here, does not count; half of the repetitions
    have pauses."""
    whole, runs = run(PROBLEM, "fixed-point", trace=Trace(), clock=Time()), []

    def once(again):
        runs.append(again)
        waited = 0.5 if not again else 1.0 + pause * (len(runs) % 2)
        return replace(
            whole, parts={part: waited * spent for part, spent in whole.parts.items()}
        )

    (result,) = driver.repeated(once, compared=True, is_shown=True)
    assert runs == [False] + [True] * MAX_REPETITIONS
    assert result.seconds == whole.seconds
    assert result.parts == whole.parts
    assert result.trace.rows[-1].seconds <= result.seconds
    assert result.spread == pytest.approx(1 + pause / 2)
    assert bool(outcome.spread([result])) == (pause == 100.0)


@pytest.mark.usefixtures("repeating")
def test_a_pause_in_another_step_of_each_repetition_is_in_no_curve():
    """Each repetition pauses for 1000 s before one of its iterates, another one each
    time, so that even the fastest has a pause."""
    plain = run(PROBLEM, "fixed-point", trace=Trace(levels=(1e-3,)), clock=Time())
    rows, pause, runs = plain.trace.rows, 1000.0, []

    def once(again):
        runs.append(again)
        late = len(runs) % 3 + 1
        times = {row.k: row.seconds + pause * (row.k >= late) for row in rows}
        parts = {**plain.parts, "solve": plain.parts["solve"] + pause}
        return replace(plain, parts=parts, trace=plain.trace.timed(times))

    (result,) = driver.repeated(once, compared=True, is_shown=True)
    assert [row.seconds for row in result.trace.rows] == [row.seconds for row in rows]
    assert result.trace.milestones == plain.trace.milestones
    assert result.seconds == pytest.approx(plain.seconds)
    assert outcome.spread([result])  # that each repetition had a pause is said


def test_claim_is_checked_anew_and_not_believed():
    honest = lcpcli.run(read(EXAMPLE), "fixed-point")
    assert verified(honest).verified is True
    wrong = Point(Criterion(honest.problem), honest.z + 1e-3)
    assert verified(replace(honest, point=wrong)).verified is False
    unfinished = lcpcli.run(honest.problem, "fixed-point", max_iterations=1)
    assert verified(unfinished).verified is None


def test_small_residual_far_from_the_solution_is_remarked():
    problem = read(contents.shipped_path("bimatrix.json"))
    one, other = problem.solutions[:2]
    only_one = replace(problem, solutions=(one,))
    found = lcpcli.run(only_one, "auto", z0=other)
    assert found.solved
    assert "either it is another solution" in outcome.doubt(found)
    assert outcome.doubt(lcpcli.run(only_one, "auto", z0=one)) == ""
    assert outcome.doubt(lcpcli.run(problem, "auto", z0=other)) == ""
