"""Ctrl-C, SIGTERM and time limits at every stage: what is finished is reported or
raised, with the exit code of the signal, nothing half-written is left, and no traceback
is seen."""

import io
import itertools
import json
import os
import pickle
import pkgutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import Status
from lcpcli.files import atomic_write, contents, writing
from lcpcli.files.input_file import InputFile
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.parametric import following
from lcpcli.solving import loop

from ..conftest import Outcome
from .conftest import EXAMPLE, MAIN, interrupt, python

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")

BENCH = f"bench {EXAMPLE} --method newton --budget 0"
PROGRAM = contents.shipped_path("programs/portfolio.json")
SIGNALS = pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)]
)
SHI = "solve paper-example-2 --method shi"
BEST = """solve game.json --maximize '"payoff of row"' """
SOLVED, CUT = {"status": "solved", "z": [1, 0, 1, 0]}, {"status": "interrupted"}
UNFINISHED = CUT | {"complete": False}
GOOD, WITHOUT_BOUND = {"solved": True}, {"solved": True, "error_bound": None}
UNEXAMINED = (
    "x satisfies the first-order conditions; whether it is a minimizer was not examined"
)


@pytest.fixture
def stopped(lcp, folder, monkeypatch):
    """Run a command that gets a signal, or an error, at a call of a function: after so
    many others, or at the first one with such arguments."""
    rng = default_rng(0)
    A, q = rng.normal(size=(60, 60)), rng.uniform(0.1, 1, 60)
    for name, sign in (("from", 1), ("to", -1)):  # with many breakpoints between them
        writing.write(lcpcli.Problem(A @ A.T + A - A.T, sign * q), f"{name}.npz")
    games = default_rng(1)
    A, B = (np.round(games.random((16, 16)) * 99).tolist() for _ in "AB")
    (folder / "game.json").write_text(json.dumps({"A": A, "B": B}))
    (folder / "murty.json").write_text('{"M": [[1, 2], [2, 1]], "q": [-1, -1]}')

    def run(line, place, when, cause):
        function = pkgutil.resolve_name(place)
        number = itertools.count()
        over = []

        def counted(*given, **named):
            if not over and (
                next(number) == when if isinstance(when, int) else when(*given)
            ):
                over.append(True)
                if not isinstance(cause, int):
                    raise cause
                signal.raise_signal(cause)
            return function(*given, **named)

        monkeypatch.setattr(place, counted)
        return lcp(line)

    return run


def _has_a_bound(search, *_):
    return search.value is not None and search.bound("time_limit") is not None


# The command, and the call at which it is stopped.
STAGES = {
    "an iteration": (SHI, "solving.loop.in_range", 2, [CUT | {"iterations": 2}]),
    "a path": (
        "path from.npz to.npz",
        "parametric.following.raise_if_timed_out",
        20,
        [{"end": "interrupted", "verified": True}],
    ),
    "the best solution": (
        BEST,
        "enumeration.optimum.Search.children",
        _has_a_bound,
        [CUT],
    ),
    "all solutions": (
        "solve murty.json --all",
        "enumeration.search.Solutions.__next__",
        2,
        [UNFINISHED],
    ),
    "the first run": (
        f"compare {EXAMPLE} --plot error.svg",
        "solving.driver.run",
        0,
        [],
    ),
    "the second run": (
        f"compare {EXAMPLE}",
        "solving.driver.run",
        1,
        [{"method": "fixed-point"}],
    ),
    "the second bound": (
        f"compare {EXAMPLE} --bound",
        "verify.error_theorems.error_bound",
        1,
        [GOOD, WITHOUT_BOUND],
    ),
    "a proof": (
        f"solve {EXAMPLE} --exact",
        "solving.proof.from_point",
        0,
        [SOLVED | CUT],
    ),
    "the verification": (
        f"compare {EXAMPLE} --method newton",
        "solving.driver.verified",
        0,
        [SOLVED],
    ),
    "other solutions": (
        f"solve {EXAMPLE}",
        "enumeration.others.search_others",
        0,
        [SOLVED],
    ),
    "digits": (f"solve {EXAMPLE}", "verify.digits.digits", 0, [SOLVED]),
    "digits of many": (
        f"solve {EXAMPLE} {EXAMPLE}",
        "verify.digits.digits",
        0,
        [SOLVED],
    ),
    "the second of many": (
        f"solve {EXAMPLE} {EXAMPLE}",
        "cli.problems.Runs.results",
        1,
        [SOLVED],
    ),
    "a figure": (
        f"solve {EXAMPLE} --plot error.svg",
        "report.plotting.convergence",
        0,
        [SOLVED],
    ),
    "the kind of a point": (
        f"solve {PROGRAM}",
        "formulations.quadratic_program.conclusions.kind_of_point",
        0,
        [GOOD],
    ),
    "reading": (
        f"check {EXAMPLE} {EXAMPLE}",
        "files.input_file.InputFile.problem",
        0,
        [],
    ),
    "reading a problem": (
        f"solve {EXAMPLE}",
        "files.input_file.InputFile.problem",
        0,
        [],
    ),
    "the reference": (f"compare {EXAMPLE}", "solving.proof.with_reference", 0, []),
    "the start of a bench": (BENCH, "bench.timing.start", 0, []),
}


MANY = "1 problem: 1 solved; interrupted; with -o FILE.jsonl it could be resumed"
TOLD = {
    "the reference": "before the first run",
    "digits of many": MANY,
    "the second of many": MANY,
}


@SIGNALS
@pytest.mark.parametrize("stage", STAGES)
def test_signal_leaves_what_is_finished(stage, number, code, stopped, folder):
    for package in ("flint", "matplotlib"):
        pytest.importorskip(package)
    line, place, when, expected = STAGES[stage]
    files = set(folder.iterdir())
    outcome = stopped(f"{line} --format json", f"lcpcli.{place}", when, number)
    assert outcome.code == code
    assert set(folder.iterdir()) == files
    assert TOLD[stage] in outcome.err if stage in TOLD else outcome.err.strip() == ""
    assert outcome.err.strip().count("\n") == 0
    for found, facts in zip(outcome.records, expected, strict=True):
        assert {key: found[key] for key in facts} == facts
        assert 1 < len(found.get("t", (0, 1))) <= 21
        assert found.get("bound", 0) >= found.get("value", 0)
        assert len(found.get("pieces", (0, 1))) == 2
        assert (found.get("answer") or {}).get("statement", UNEXAMINED) == UNEXAMINED
    assert [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)] == [
        signal.default_int_handler,
        signal.SIG_DFL,
    ]


@pytest.mark.parametrize(
    ("problem", "place"),
    [
        (EXAMPLE, "verify.digits.digits"),
        (PROGRAM, "formulations.quadratic_program.conclusions.kind_of_point"),
    ],
)
def test_record_cut_before_its_conclusions_is_made_again_when_the_log_is_resumed(
    problem, place, stopped, lcp
):
    files = f"solve {problem} {EXAMPLE}"
    assert lcp(f"{files} -o whole.jsonl").code == 0
    cut = stopped(f"{files} -o cut.jsonl", f"lcpcli.{place}", 0, signal.SIGINT)
    assert cut.code == 130
    (unfinished,) = map(json.loads, Path("cut.jsonl").read_text().splitlines())
    assert (unfinished["status"], unfinished["interrupted"]) == ("solved", True)
    assert lcp(f"{files} --resume cut.jsonl").code == 0
    whole, resumed = (
        [
            (each["number"], each["digits"], (each["answer"] or {}).get("statement"))
            for each in map(json.loads, Path(name).read_text().splitlines())
        ]
        for name in ("whole.jsonl", "cut.jsonl")
    )
    assert resumed == whole


def test_path_that_is_stopped_has_its_points_in_a_file_and_says_why(stopped):
    check = "lcpcli.parametric.following.raise_if_timed_out"
    path = "path from.npz to.npz"
    outcome = stopped(f"{path} --at 0.01,1 -o part.csv", check, 20, KeyboardInterrupt)
    assert outcome.code == 130
    assert outcome.err == "lcp: to.npz: interrupted\n"
    lines = Path("part.csv").read_text().splitlines()
    assert "interrupted; " in lines[1]
    assert lines[1].endswith(", verified")
    assert lines[-1][:6] == ",0.01,"
    late = stopped(
        f"{path} --time-limit 100 --format json", check, 20, following.TimeIsUp
    )
    found = late.record
    assert (late.code, found["end"], found["verified"]) == (1, "time_limit", True)
    assert found["message"] == "stopped at the time limit"
    assert 1 < len(found["t"]) <= 21
    broken = stopped(path, check, 1, SingularMatrix)
    assert broken.code == 1
    assert "broke down: a basis is too ill-conditioned" in broken.out


@pytest.mark.parametrize("kind", [ImportError, SystemError])
def test_interrupt_that_a_library_wraps_is_one_and_leaves_what_is_measured(
    kind, lcp, monkeypatch
):
    def wrapped(*_):
        raise kind("returned a result with an exception set") from KeyboardInterrupt()

    pytest.importorskip("piqp")
    monkeypatch.setattr("lcpcli.peers.packages.piqp.solve", wrapped)
    outcome = lcp(f"{BENCH} --peer piqp")
    told = (
        "lcp: interrupted after 1 of 2 measurements; with -o FILE.json it "
        "could be resumed\n"
    )
    assert outcome.code == 130
    assert outcome.err == told
    assert "1 of 2 measured" in outcome.out
    monkeypatch.setattr(InputFile, "problem", wrapped)
    assert lcp(f"solve {EXAMPLE}") == Outcome(130, "", "")


LOADING = f"""
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "lcpcli.cli.command":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
{MAIN}
"""
IN_A_CALLBACK = f"""
import os, signal, time, weakref
from lcpcli.files.input_file import InputFile

class Lock: pass

def read(*_):
    lock = Lock()
    reference = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
    del lock
    for _ in range(1000):
        time.sleep(0.02)

InputFile.problem = read
{MAIN}
"""
# An object of LLVM is handed to another owner in two steps, as llvmlite does.
HANDED_OVER = """
def hand_over(steps):
    steps.append(1)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.02)
    steps.append(2)
"""
IN_LLVM = f"""
import os, signal, time
from lcpcli.files.input_file import InputFile

binding = dict(os=os, signal=signal, time=time, __name__="llvmlite.binding.module")
exec({HANDED_OVER!r}, binding)

def read(*_):
    steps = []
    try:
        binding["hand_over"](steps)
        for _ in range(1000):
            time.sleep(0.02)
    finally:
        if steps != [1, 2]:
            print("left in halves")

InputFile.problem = read
{MAIN}
"""


@pytest.mark.parametrize(
    "program",
    [LOADING, IN_A_CALLBACK, IN_LLVM],
    ids=["modules are loaded", "a callback runs", "LLVM is called"],
)
def test_interrupt_while_the_interpreter_is_at_work_ends_without_a_word(program):
    done = python(program, f"solve {EXAMPLE}", timeout=60)
    assert (done.code, done.out, done.err.strip()) == (130, "", "")


@SIGNALS
def test_signal_while_a_file_is_read_ends_at_once(number, code, tmp_path):
    pipe = tmp_path / "problem.json"
    os.mkfifo(pipe)
    command = [
        sys.executable,
        "-c",
        MAIN,
        "solve",
        str(pipe),
        "-o",
        str(tmp_path / "result.json"),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    with pipe.open("w"):  # waits for the reader
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert out == b""
    assert err.strip() == b""
    assert list(tmp_path.iterdir()) == [pipe]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_waits_until_files_are_whole(number, tmp_path):
    class Pressed(io.BytesIO):
        def read(self, size=-1):
            signal.raise_signal(number)
            return super().read(size)

    def handler(*_):
        seen.append({path.name: path.read_text() for path in tmp_path.iterdir()})

    seen = []
    usual = signal.signal(number, handler)
    try:
        atomic_write.write_together(
            {str(tmp_path / f"{k}.mtx"): Pressed(k.encode()) for k in "Mq"}
        )
        assert signal.getsignal(number) is handler
    finally:
        signal.signal(number, usual)
    assert seen[0] == {"M.mtx": "M", "q.mtx": "q"}


@SIGNALS
def test_signal_while_an_extension_module_loads_is_not_lost(
    number, code, lcp, monkeypatch
):
    class Loader(ExtensionFileLoader):
        path = "compiled.so"

        def __init__(self): ...

        @property
        def name(self):  # which is read while the module is set up
            # As the set-up of modules that Cython has compiled.
            with suppress(BaseException):
                signal.raise_signal(number)
            return "compiled"

    def load(*_):  # and work for a minute
        Loader().exec_module(ModuleType("compiled"))
        for _ in range(6000):
            time.sleep(0.01)

    monkeypatch.setattr(loop, "in_range", load)
    assert lcp(f"solve {EXAMPLE}").code == code


def test_ctrl_c_that_the_caller_ignores_stays_ignored(lcp):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert lcp("--version").code == 0
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


PROBLEM = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
CALLS = {
    "run": lcpcli.run,
    "solve": lambda problem, **options: lcpcli.solve(problem.M, problem.q, **options),
    "solve_many of problems": lambda problem, **options: next(
        lcpcli.solve_many([problem], **options)
    ),
    "solve_many of columns": lambda problem, **options: next(
        lcpcli.solve_many(problem.M, [[-5], [-6]], **options)
    ),
    "exact": lcpcli.exact,
}


@pytest.fixture
def _interrupted(monkeypatch):
    monkeypatch.setattr(loop, "in_range", interrupt)
    monkeypatch.setattr(
        "lcpcli.solving.direct_run.Session.result_if_accepted", interrupt
    )


@pytest.mark.usefixtures("_interrupted")
@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c_raises_with_the_best_iterate_or_returns_it(name):
    pytest.importorskip("flint")
    call = CALLS[name]
    with pytest.raises(lcpcli.Interrupted, match="interrupted") as ending:
        call(PROBLEM)
    assert isinstance(ending.value, KeyboardInterrupt)
    assert ending.value.result.status == Status.INTERRUPTED
    assert ending.value.result.z.tolist() == [0, 0]
    assert call(PROBLEM, interrupts="return").interrupted
    with pytest.raises(
        lcpcli.errors.OptionError,
        match=r"interrupts: 'ignore' .*; give",
    ):
        call(PROBLEM, interrupts="ignore")
    assert isinstance(pickle.loads(pickle.dumps(ending.value)), lcpcli.Interrupted)


@pytest.mark.usefixtures("_interrupted")
def test_ctrl_c_is_not_lost_although_the_last_iterate_is_a_solution():
    solved = lcpcli.run(lcpcli.Problem([[2, 1], [1, 2]], [5, 6]), interrupts="return")
    assert solved.status == Status.SOLVED
    assert solved.interrupted


LINEAR = {"Q": None, "c": [1, 1], "A": [[1, 1]], "row_lower": [1]}


def test_ctrl_c_after_the_iteration_raises_with_the_best_iterate(monkeypatch):
    once, real = iter([interrupt]), loop.Loop.result
    monkeypatch.setattr(loop.Loop, "result", lambda *given: next(once, real)(*given))
    problem = lcpcli.from_qp(**LINEAR)
    with pytest.raises(lcpcli.Interrupted) as ending:
        lcpcli.run(problem, "interior", trace=True)
    assert ending.value.result.interrupted
    assert ending.value.result.z.size == problem.n


def test_ctrl_c_while_a_conclusion_is_worked_out_leaves_it_to_the_next_reader(
    monkeypatch,
):
    result = lcpcli.run(lcpcli.from_qp(**LINEAR))
    with monkeypatch.context() as patched:
        patched.setattr(
            "lcpcli.formulations.quadratic_program.conclusions.has_other_minimum",
            interrupt,
        )
        with pytest.raises(KeyboardInterrupt):
            result.answer.statement  # noqa: B018
    assert result.answer.proved == "several_optima"
