"""Ctrl-C and SIGTERM: what is finished is reported or raised, nothing half-written is left, no traceback is seen."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lcpcli
from lcpcli import Status
from lcpcli.bench import recording as benching
from lcpcli.files import atomic_write, reading
from lcpcli.solving import driver as driver
from lcpcli.solving import proof, reference
from lcpcli.solving.loop import Loop
from lcpcli.verify import error_theorems

from ..conftest import Outcome
from .conftest import EXAMPLE, MAIN, Lcp, interrupt, python, record, records

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")

BENCH = f"bench {EXAMPLE} --method newton --budget 0"


def later(function: Callable[..., Any], calls: int) -> Callable[..., Any]:
    """The function, interrupted from that many calls on."""
    left = iter(range(calls))
    return lambda *given, **named: interrupt() if next(left, None) is None else function(*given, **named)


def test_run_that_is_interrupted_outside_its_method_leaves_the_finished_ones(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "run", later(driver.run, 1))
    outcome = lcp("compare", EXAMPLE, "--format", "json")
    assert (outcome.code, outcome.err) == (130, "")
    assert [each["method"] for each in records(outcome)] == ["fixed-point"]


def test_interrupted_bound_leaves_the_result(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(error_theorems, "error_bound", later(error_theorems.error_bound, 1))
    outcome = lcp("compare", EXAMPLE, "--format", "json", "--bound")
    first, second = records(outcome)
    assert (outcome.code, first["solved"], second["solved"]) == (130, True, True)
    assert (first["error_bound"] is None, second["error_bound"]) == (False, None)


@pytest.mark.parametrize("kind", [ImportError, SystemError])
def test_interrupt_that_a_library_wraps_is_one_and_leaves_what_is_measured(
    kind: type[Exception], lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrapped(*_: Any) -> Any:
        raise kind("returned a result with an exception set") from KeyboardInterrupt()

    pytest.importorskip("piqp")
    monkeypatch.setattr("lcpcli.peers.packages.piqp.solve", wrapped)
    outcome = lcp(*BENCH.split(), "--peer", "piqp")
    told = "lcp bench: interrupted after 1 of 2 measurements; with -o FILE.json it could be resumed\n"
    assert (outcome.code, outcome.err, "1 of 2 measured" in outcome.out) == (130, told, True)
    monkeypatch.setattr(reading, "problem_of", wrapped)
    assert lcp("solve", EXAMPLE) == Outcome(130, "", "")


def test_interrupted_proof_leaves_the_result_unproved(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    monkeypatch.setattr(proof, "from_point", interrupt)
    outcome = lcp("solve", EXAMPLE, "--format", "json", "--exact")
    result = record(outcome)
    assert (outcome.code, result["status"], result["z"]) == (130, "interrupted", [1, 0, 1, 0])


@pytest.mark.parametrize(
    ("line", "module", "name", "told"),
    [
        (f"check {EXAMPLE} {EXAMPLE}", reading, "problem_of", ""),
        (BENCH, benching, "start", ""),
        (f"compare {EXAMPLE}", reference, "with_reference", "before the first run"),
    ],
)
def test_interrupted_preparation_ends_without_a_result(
    line: str, module: Any, name: str, told: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, interrupt)
    outcome = lcp(*line.split())
    assert (outcome.code, outcome.out, outcome.err.strip().count("\n")) == (130, "", 0)
    assert told in outcome.err if told else not outcome.err.strip()


def test_interrupt_while_modules_are_loaded_ends_without_a_word() -> None:
    pressing = f"""
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "lcpcli.cli.command":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
{MAIN}
"""
    done = python(pressing, "--help")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signal_while_a_file_is_read_ends_at_once(number: signal.Signals, code: int, tmp_path: Path) -> None:
    pipe = tmp_path / "problem.json"
    os.mkfifo(pipe)
    command = [sys.executable, "-c", MAIN, "solve", str(pipe), "-o", str(tmp_path / "result.json")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    with pipe.open("w"):  # waits for the reader
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert (out, err.strip()) == (b"", b"")
    assert list(tmp_path.iterdir()) == [pipe]


def test_interrupt_waits_until_files_are_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(target: Path, data: bytes) -> Path:
        signal.raise_signal(signal.SIGINT)
        return temporary(target, data)

    temporary = atomic_write._temporary
    monkeypatch.setattr(atomic_write, "_temporary", pressed)
    with pytest.raises(KeyboardInterrupt):
        atomic_write.write_together({str(tmp_path / "M.mtx"): "M", str(tmp_path / "q.mtx"): "q"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"M.mtx": "M", "q.mtx": "q"}
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_termination_waits_until_a_file_is_whole(tmp_path: Path) -> None:
    code = """
import signal, sys
from pathlib import Path
from lcpcli.files.atomic_write import write_whole
replace = Path.replace
Path.replace = lambda *given: signal.raise_signal(signal.SIGTERM) or replace(*given)
write_whole(sys.argv[1], "whole")
print("still here")
"""
    done = python(code, str(tmp_path / "result.json"))
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGTERM, "", "")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"result.json": "whole"}


def test_ctrl_c_that_the_caller_ignores_stays_ignored(lcp: Lcp) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert lcp("--version").code == 0
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize(
    "place",
    [
        "lcpcli.solving.driver.verified",
        "lcpcli.enumeration.others.search_others",
        "lcpcli.verify.digits.digits",
        "lcpcli.report.plotting.convergence",
    ],
)
def test_command_that_is_interrupted_after_the_iteration_reports_its_result(
    place: str, lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(place, interrupt)
    command = ["compare", EXAMPLE, "--method", "newton"] if place.endswith("verified") else ["solve", EXAMPLE]
    picture = ["--plot", str(tmp_path / "error.svg")] if place.endswith("convergence") else []
    outcome = lcp(*command, *picture, "--format", "json")
    assert (outcome.code, outcome.err, list(tmp_path.iterdir())) == (130, "\n" if picture else "", [])
    assert record(outcome)["z"] == [1, 0, 1, 0]
    many = lcp("solve", EXAMPLE, EXAMPLE, "--format", "json")
    assert (many.code, len(records(many))) == ((130, 1) if place.endswith("digits") else (0, 2))


def test_conclusions_that_are_interrupted_leave_the_minimizer_and_no_claim(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lcpcli.solving.minimum.kind_of_point", interrupt)
    outcome = lcp("solve", "problems/programs/portfolio.json", "--format", "json")
    answer = record(outcome)["answer"]
    assert (outcome.code, answer["proved"], len(answer["x"])) == (130, None, 3)
    assert answer["statement"] == "x satisfies the first-order conditions; whether it is a minimizer was not examined"


def test_interrupt_in_a_callback_of_the_interpreter_is_not_lost() -> None:
    program = f"""
import os, signal, time, weakref
from lcpcli.files import reading

class Lock: pass

def read(*_):
    lock = Lock()
    reference = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
    del lock
    for _ in range(1000):
        time.sleep(0.02)

reading.problem_of = read
{MAIN}
"""
    ended = python(program, "solve", EXAMPLE, timeout=60)
    assert (ended.returncode, ended.stderr.strip()) == (130, "")


def interrupt_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Loop, "_take", interrupt)
    monkeypatch.setattr("lcpcli.solving.direct_run.result_of", interrupt)


def test_ctrl_c_is_not_lost_although_the_last_iterate_is_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    interrupt_iterations(monkeypatch)
    solved = lcpcli.run(lcpcli.Problem([[2, 1], [1, 2]], [5, 6]), interrupts="return")
    assert (solved.status, solved.interrupted) == (Status.SOLVED, True)
    open_still = lcpcli.run(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]), interrupts="return")
    assert (open_still.status, open_still.interrupted) == (Status.INTERRUPTED, True)


CALLS: dict[str, Callable[..., Any]] = {
    "run": lcpcli.run,
    "solve": lambda problem, **options: lcpcli.solve(problem.M, problem.q, **options),
    "solve_many of problems": lambda problem, **options: next(lcpcli.solve_many([problem], **options)),
    "solve_many of columns": lambda problem, **options: next(lcpcli.solve_many(problem.M, [[-5], [-6]], **options)),
    "exact": lcpcli.exact,
}


@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c_raises_with_the_best_iterate_or_returns_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    call, problem = CALLS[name], lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    interrupt_iterations(monkeypatch)
    with pytest.raises(lcpcli.Interrupted, match="interrupted") as ending:
        call(problem)
    assert isinstance(ending.value, KeyboardInterrupt)
    assert (ending.value.result.status, ending.value.result.z.tolist()) == (Status.INTERRUPTED, [0, 0])
    assert call(problem, interrupts="return").interrupted
    with pytest.raises(lcpcli.errors.OptionError, match='interrupts: \'ignore\' is unknown; give "raise" or "return"'):
        call(problem, interrupts="ignore")
    assert isinstance(pickle.loads(pickle.dumps(ending.value)), lcpcli.Interrupted)


def test_ctrl_c_after_the_iteration_raises_with_the_best_iterate(monkeypatch: pytest.MonkeyPatch) -> None:
    once, real = iter([interrupt]), Loop._verified
    monkeypatch.setattr(Loop, "_verified", lambda *given: next(once, real)(*given))
    problem = lcpcli.from_qp(None, [1, 1], [[1, 1]], row_lower=[1])
    with pytest.raises(lcpcli.Interrupted) as ending:
        lcpcli.run(problem, "interior", trace=True)
    assert ending.value.result.interrupted
    assert ending.value.result.z.size == problem.n


def test_ctrl_c_while_a_conclusion_is_worked_out_leaves_it_to_the_next_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    result = lcpcli.run(lcpcli.from_qp(None, [1, 1], [[1, 1]], row_lower=[1]))
    with monkeypatch.context() as patched:
        patched.setattr("lcpcli.solving.minimum.has_other_minimum", interrupt)
        with pytest.raises(KeyboardInterrupt):
            result.answer.statement  # noqa: B018
    assert result.answer.proved == "several_optima"


def test_loop_of_a_user_ends_with_ctrl_c() -> None:
    code = """
import os, signal, lcpcli
from lcpcli.solving.loop import Loop
Loop._take = lambda *_: os.kill(os.getpid(), signal.SIGINT)
for i in range(2):
    print(i, flush=True)
    lcpcli.solve([[2, 1], [1, 2]], [-5, -6], "newton")
"""
    done = python(code)
    assert done.stdout == "0\n"
    assert done.stderr.splitlines()[-1] == "lcpcli.Interrupted: interrupted"
