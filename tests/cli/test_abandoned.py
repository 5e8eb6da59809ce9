"""Time limits in the middle of a step, the calls that go on after them, and what a long
run shows of itself."""

import itertools
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from fractions import Fraction
from io import StringIO

import numpy as np
import pytest
from numpy.random import default_rng

from lcpcli import Problem, exact, interrupts
from lcpcli.cli import problems as request
from lcpcli.cli import terminal
from lcpcli.cli.main import of_result
from lcpcli.cli.problems import Inputs
from lcpcli.files import writing
from lcpcli.files.csv_format import grid_of
from lcpcli.gallery import families
from lcpcli.interrupts import TimeIsUp, deadline_after, remaining
from lcpcli.linalg import factors
from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.linalg.programs import minimized
from lcpcli.methods import registry as methods
from lcpcli.methods.bimatrix import costs, lemke_howson
from lcpcli.methods.stages import Finished, Iterate
from lcpcli.options import Limits
from lcpcli.rational.dictionary import LONG_ROW, Dictionary
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import Doubles, fraction
from lcpcli.solving import driver
from lcpcli.solving.driver import run
from lcpcli.solving.loop import INTERVAL, Loop
from lcpcli.solving.proof import prove
from lcpcli.verify import error_theorems

from ..conftest import Outcome
from .conftest import MAIN, python
from .terminals import Terminal, lines_in

PROBLEM = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
ABANDONING = """
import sys, threading, time
from lcpcli.interrupts import TimeIsUp, deadline_after, interruptibly

def call():
    time.sleep(float(sys.argv[1]))
    print("done", flush=True)

try:
    with deadline_after(0.0):
        interruptibly(call)
except TimeIsUp:
    print("late", flush=True)
"""
CALLING = """
import sys
import numpy as np
from lcpcli.gallery import families
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.linalg import factors
from lcpcli.linalg.programs import minimized

rng = np.random.default_rng(0)
"""
IN_HIGHS = """
A, zero, one = rng.standard_normal((300, 300)), np.zeros(300), rng.random(300)
call = lambda: minimized(
    one, A, (zero - np.inf, -rng.random(300)), (zero, zero + np.inf)
)
"""
IN_SUPERLU = (
    "A = families.make('dominant', 3000, 0).M; lu = factors.sparse_lu(False); call "
    "= lambda: lu(A)"
)
IN_LAPACK = (
    "A = rng.random((4000, 4000)); call = lambda: factors.checked_solver(A, 1.0)"
)


@pytest.mark.slow("waits for calls of seconds")
@pytest.mark.parametrize(
    ("calling", "ending", "code", "said"),
    [
        (IN_HIGHS, "", 0, []),
        (IN_SUPERLU, "sys.exit(3)", 3, []),
        (IN_LAPACK, "raise ValueError('planned')", 1, ["ValueError: planned"]),
    ],
    ids=["HiGHS", "SuperLU", "LAPACK"],
)
def test_program_ends_as_it_says_although_a_compiled_call_was_abandoned(
    calling, ending, code, said
):
    limited = (
        "try:\n    with deadline_after(0.05):\n        call()\nexcept TimeIsUp:\n    "
        "print('late')"
    )
    done = python(f"{CALLING}{calling}\n{limited}\n{ending}")
    assert (done.code, done.out) == (code, "late\n")
    assert done.err.splitlines()[-1:] == said


def test_interpreter_waits_for_an_abandoned_call():
    done = python(f"{ABANDONING}sys.exit(3)", "0.2")
    assert done == Outcome(3, "late\ndone\n", "")


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
def test_ctrl_c_ends_that_wait_without_a_word():
    code = f"""{ABANDONING}
join = threading.Thread.join
threading.Thread.join = lambda *limit: print("waiting", flush=True) or join(*limit)
"""
    process = subprocess.Popen(
        [sys.executable, "-c", code, "60"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert [process.stdout.readline() for _ in range(2)] == ["late\n", "waiting\n"]
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert set(out.split()) <= {"waiting"}
    assert err == ""
    assert process.returncode == -signal.SIGINT  # which shells report as 130


def test_command_ends_at_once(tmp_path):
    file, rng = tmp_path / "random.npz", default_rng(0)
    writing.write(
        Problem(rng.standard_normal((500, 500)), rng.standard_normal(500)), str(file)
    )
    done = python(MAIN, f"solve {file} --method milp --time-limit 0.2 --format json")
    assert (done.code, done.err) == (1, "")
    assert done.record["status"] == "time_limit"


def test_time_limit_of_the_run_ends_a_linear_program_in_any_thread():
    rng = default_rng(0)
    A, b, zero = rng.standard_normal((300, 300)), rng.random(300), np.zeros(300)
    errors = []

    def limited():
        try:
            with deadline_after(0.01):
                minimized(
                    -rng.random(300), A, (zero - np.inf, b), (zero, zero + np.inf)
                )
        except BaseException as error:
            errors.append(error)

    # Outside the main one, where calls are made directly.
    thread = threading.Thread(target=limited)
    thread.start()
    thread.join()
    assert [type(error) for error in errors] == [TimeIsUp]


def test_remaining_seconds_are_those_of_the_innermost_context():
    assert remaining() == np.inf
    with deadline_after(2000.0):
        with deadline_after(1000.0):
            assert 0 < remaining() <= 1000
        assert 1000 < remaining() <= 2000
    with deadline_after(-1.0):
        assert remaining() == 0


@pytest.mark.parametrize("name", ["LONG_LU", "LONG_CHOLESKY"])
def test_long_factorizations_give_the_solution(name, monkeypatch):
    A, indefinite = default_rng(0).random((300, 300)) + 300 * np.eye(300), np.eye(300)
    indefinite[0, 1] = indefinite[1, 0] = 2.0
    monkeypatch.setattr(factors, name, 300)
    for each in (A, A + A.T, indefinite):
        x = PrincipalSolver(each).solve(np.arange(300), each.sum(axis=1))
        np.testing.assert_allclose(x, np.ones(300), rtol=1e-13)
    with pytest.raises(factors.SingularMatrix):
        factors.dense_factors().cholesky(indefinite)


FACTORIZING = """
import threading, time
import numpy as np
from scipy.sparse import random_array
from lcpcli import Problem, interrupts, run
from lcpcli.cli.main import leave
from lcpcli.gallery import families

class Waits(threading.Event):
    late = 0

    def wait(self, timeout=None):
        done = super().wait(timeout)
        Waits.late += not done
        return done

threading.Event, time.perf_counter = Waits, lambda: float(Waits.late)
interrupts.WAIT = 0.001  # seconds, and the factorizations take many times as long
rng, n = np.random.default_rng(0), 5000
"""
NEARLY_DENSE = """
M = random_array((n, n), density=10 / n, rng=rng, data_sampler=rng.standard_normal)
problem, method = Problem(M, rng.standard_normal(n)), "interior"
"""


@pytest.mark.parametrize(
    "made",
    [NEARLY_DENSE, "problem, method = families.make('dominant', 4000), 'newton'"],
    ids=["interior", "newton"],
)
def test_time_limit_ends_a_sparse_factorization_that_fills_in(made):
    """By a clock that goes on only where one waits for a compiled call that has not
    ended."""
    limited = (
        "result = run(problem, method, time_limit=0.5)\nprint(result.status.word, "
        "len(interrupts.abandoned))"
    )
    done = python(f"{FACTORIZING}{made}\n{limited}\nleave(0)")
    assert done == Outcome(0, "time_limit 1\n", "")


def test_no_exact_system_is_begun_that_the_time_limit_does_not_leave_time_for(
    monkeypatch,
):
    pytest.importorskip("flint")
    A = default_rng(0).standard_normal((450, 450))
    call = subprocess.run
    begun = []

    def limited(*given, **how):
        begun.append(how["timeout"])
        return call(*given, **how)

    monkeypatch.setattr(subprocess, "run", limited)
    result = exact(Problem(A @ A.T + np.eye(450), -np.ones(450)), time_limit=0.3)
    assert result.exact.status is None
    assert all(0 <= each <= 0.3 for each in begun)


def test_time_limit_holds_while_numbers_become_exact_and_long_rows_pivot():
    data = ExactProblem.of_floats(PROBLEM)
    assert (
        data.are_floats(),
        ExactProblem.of_decimals(Problem([[0.1]], [-1])).are_floats(),
    ) == (True, False)
    z, sized = [Fraction(4, 3), Fraction(7, 3)], Doubles()
    sized("0.10000000000000000001")
    game = families.make("bimatrix", 20, 0)
    payoffs = costs(game)
    assert payoffs is not None
    long = Dictionary(
        {2: [1] * LONG_ROW, 3: [2] * LONG_ROW},
        list(range(10, 9 + LONG_ROW)),
        (),
        lambda: None,
    )
    for work in (
        lambda: ExactProblem.of_floats(PROBLEM),
        lambda: fraction("0.1"),
        lambda: grid_of(b"1 2\n3 4\n"),
        lambda: Doubles()("0.1"),
        lambda: sized.assign_distinct(),
        data.are_floats,
        data.in_integers,
        lambda: data.gaps(z, z),
        lambda: data.w(z),
        lambda: data.with_transpose(z),
        lambda: long.pivot(2, 1),
        lambda: next(lemke_howson(game, payoffs)),
    ):
        with deadline_after(-1.0), pytest.raises(TimeIsUp):
            work()


def test_numbers_not_made_exact_in_time_leave_the_result_without_proof():
    pytest.importorskip("flint")

    def late():
        raise TimeIsUp

    result = prove(late, run(Problem([[2.0]], [-1.0]), "auto"))
    assert result.solved
    assert of_result(result) == 1
    assert "no exact proof is known" in result.message


def test_bound_on_the_error_that_is_not_proved_in_time_is_left_out():
    result = run(PROBLEM, "newton")
    late = driver.with_bound(replace(result, limits=Limits(time_limit=1e-300)))
    assert late.bound is error_theorems.UNPROVED_IN_TIME
    assert driver.with_bound(result).bound is not error_theorems.UNPROVED_IN_TIME


def test_exact_proof_has_the_time_that_the_run_has_left():
    pytest.importorskip("flint")
    asked = request.Request(inputs=Inputs([]), exact=True)
    result = run(PROBLEM, "newton", limits=Limits(time_limit=1e6))
    seconds = []

    def exactly():
        seconds.append(remaining())
        return ExactProblem.of_floats(result.problem)

    assert asked.prove(result, exactly).exact is not None
    assert [9e5 < each < 1e6 - result.seconds for each in seconds] == [True]


class Clock:
    """A clock that is set forward."""

    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", clock)
    return clock


def test_driver_reports_by_the_clock_and_not_by_the_iterate(clock, monkeypatch):
    def method(problem, x0, **_):  # noqa: ARG001
        for k in range(1, 1000):
            clock.now = k * INTERVAL / 100
            yield Iterate(
                np.array([9.0]),
                np.array([1.0 / (k + 1)]),
                "",
                k,
                method="inner" if k > 500 else "",
            )
        return Finished()

    monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
    reports = []
    run(Problem([[1.0]], [-1.0]), "newton", observe=lambda *seen: reports.append(seen))
    assert 9 <= len(reports) <= 10
    name, k, level, seconds = reports[0]
    assert [name, reports[-1][0]] == ["newton", "inner"]
    assert level == 1.0 / (k + 1)
    assert seconds == pytest.approx(k * INTERVAL / 100)


def test_a_long_step_in_compiled_code_is_watched_too(monkeypatch):
    monkeypatch.setattr(interrupts, "WAIT", 0.01)
    looks = []
    with (
        interrupts.deadline_after(10.0, lambda: looks.append(1)),
        interrupts.deadline_after(9.0),
    ):
        step = interrupts.interruptibly(lambda: time.sleep(0.1) or "done")
    assert step == "done"
    assert looks


def test_nothing_is_shown_in_the_first_second_and_all_is_gone_at_the_end(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with terminal.Line() as line:
        line.tell("shi", 3, 0.5, terminal.PATIENCE / 2)
    assert stream.getvalue() == ""
    with terminal.Line() as line:
        line.tell("shi", 1234, 2.5e-5, 1.5)
        line.tell("shi", 2345, float("inf"), 2.5)
    assert lines_in(stream) == [
        "shi  k = 1234  relative residual about 2.5e-05",
        "shi  k = 2345",
        "",
    ]


def test_quiet_and_a_terminal_that_cannot_erase_silence_it(monkeypatch):
    for stream, quiet, term, shown in (
        (Terminal(), False, "xterm", True),
        (Terminal(), True, "xterm", False),
        (Terminal(), False, "dumb", False),
        (StringIO(), False, "xterm", False),
    ):
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("TERM", term)
        assert terminal.shows_progress(quiet) is shown


def test_long_solve_shows_its_line_on_standard_error(lcp, folder, monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(terminal, "PATIENCE", 0.0)
    monkeypatch.setattr("lcpcli.solving.loop.INTERVAL", 0.0)
    assert (folder / "none.json").exists()  # so that the iterates run off for ever
    outcome = lcp(
        "solve none.json --method fixed-point --max-iterations 20 --format json"
    )
    *shown, last = lines_in(stream)
    assert outcome.record["iterations"] == 20
    assert last == ""
    line = r"fixed-point  k = \d+  relative residual about \d\.\de[-+]\d+"
    assert any(re.fullmatch(line, text) for text in shown)


def test_what_a_run_takes_beyond_its_time_limit_is_told(monkeypatch):
    """By a clock that the verification sets forward."""
    now, verified = [0.0], Loop._verified

    def slowly(*given):
        now[0] += 3.0
        return verified(*given)

    def stage(problem, x0, **_):
        for k in itertools.count(1):
            now[0] += 0.3
            yield Iterate(x0, np.ones(problem.n), "", k)
        return Finished()

    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(Loop, "_verified", slowly)
    monkeypatch.setattr(methods, "load", lambda name: stage)  # noqa: ARG005
    told = run(PROBLEM, "newton", limits=Limits(time_limit=1.0)).message
    assert told.startswith("stopped at the time limit: the last step and the verif")
    assert re.search(r"took 3\.\d s more$", told)
    monkeypatch.setattr(Loop, "_verified", verified)
    assert (
        run(PROBLEM, "newton", limits=Limits(time_limit=1.0)).message
        == "stopped at the time limit"
    )
