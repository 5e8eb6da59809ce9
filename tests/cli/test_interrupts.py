"""Ctrl-C and SIGTERM: what is finished is reported, nothing half-written is left, and no traceback is seen."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import recording as benching
from lcpcli.files import atomic_write, contents, reading
from lcpcli.report import plotting as figures
from lcpcli.solving import driver as driver
from lcpcli.solving import proof, reference
from lcpcli.verify import error_bound

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")

EXAMPLE = contents.shipped_path("paper-example-1.json")
BENCH = f"bench {EXAMPLE} --method newton --budget 0"
MAIN = "from lcpcli.cli.main import main; main()"
Run = Callable[..., Any]


def interrupt(*_: Any, **__: Any) -> Any:
    raise KeyboardInterrupt


def later(function: Callable[..., Any], calls: int) -> Callable[..., Any]:
    """The function, interrupted from that many calls on."""
    left = iter(range(calls))
    return lambda *given, **named: interrupt() if next(left, None) is None else function(*given, **named)


def python(code: str, *arguments: str, **how: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **how)


def test_run_that_is_interrupted_outside_its_method_leaves_the_finished_ones(
    lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "run", later(driver.run, 1))
    outcome = lcp("compare", EXAMPLE, "--format", "json")
    assert (outcome.code, outcome.err) == (130, "")
    assert [json.loads(line)["method"] for line in outcome.out.splitlines()] == ["fixed-point"]


def test_interrupted_bound_leaves_the_result(lcp: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(error_bound, "error_bound", later(error_bound.error_bound, 1))
    outcome = lcp("compare", EXAMPLE, "--format", "json", "--bound")
    first, second = map(json.loads, outcome.out.splitlines())
    assert outcome.code == 130
    assert (first["solved"], second["solved"]) == (True, True)
    assert first["error_bound"] is not None
    assert second["error_bound"] is None


def test_interrupted_proof_leaves_the_result_unproved(lcp: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    monkeypatch.setattr(proof, "from_point", interrupt)
    outcome = lcp("solve", EXAMPLE, "--format", "json", "--exact")
    result = json.loads(outcome.out)
    assert (outcome.code, result["status"], result["z"]) == (130, "interrupted", [1, 0, 1, 0])


@pytest.mark.parametrize("kind", [ImportError, SystemError])
def test_interrupt_that_a_peer_wraps_leaves_what_is_measured(
    kind: type[Exception], lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrapped(*_: Any) -> Any:
        raise kind("returned a result with an exception set") from KeyboardInterrupt()

    pytest.importorskip("piqp")
    monkeypatch.setattr("lcpcli.peers.packages.piqp.solve", wrapped)
    outcome = lcp(*BENCH.split(), "--peer", "piqp")
    assert outcome.code == 130
    assert outcome.err == "lcp bench: interrupted after 1 of 2 measurements; with -o FILE.json it could be resumed\n"
    assert "1 of 2 measured" in outcome.out


@pytest.mark.parametrize("kind", [ImportError, SystemError])
def test_interrupt_that_a_library_wraps_ends_without_a_word(
    kind: type[Exception], lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrapped(*_: Any) -> Any:
        raise kind("no reason given") from KeyboardInterrupt()

    monkeypatch.setattr(reading, "problem_of", wrapped)
    outcome = lcp("solve", EXAMPLE)
    assert (outcome.code, outcome.out, outcome.err) == (130, "", "")


def test_interrupted_figure_comes_after_the_results(lcp: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(figures, "convergence", interrupt)
    outcome = lcp("solve", EXAMPLE, "--format", "csv", "--plot", str(tmp_path / "error.svg"))
    assert outcome.code == 130
    assert outcome.out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "module", "name"),
    [
        (f"inspect {EXAMPLE}", reading, "problem_of"),
        (f"check {EXAMPLE} {EXAMPLE}", reading, "problem_of"),
        (BENCH, benching, "start"),
    ],
)
def test_interrupted_preparation_ends_without_a_word(
    line: str, module: Any, name: str, lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, interrupt)
    outcome = lcp(*line.split())
    assert (outcome.code, outcome.out, outcome.err.strip()) == (130, "", "")


def test_interrupted_reference_says_that_nothing_has_run(lcp: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "with_reference", interrupt)
    outcome = lcp("compare", EXAMPLE)
    assert (outcome.code, outcome.out, outcome.err.strip().count("\n")) == (130, "", 0)
    assert "before the first run" in outcome.err


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


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM)])
def test_signal_while_a_file_is_read_ends_at_once(number: signal.Signals, code: int, tmp_path: Path) -> None:
    pipe = tmp_path / "problem.json"
    os.mkfifo(pipe)
    command = [sys.executable, "-c", MAIN, "solve", str(pipe), "-o", str(tmp_path / "result.json")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    with pipe.open("w"):  # waits for the reader
        process.send_signal(number)
        out, err = process.communicate(timeout=20)
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


def test_ctrl_c_that_the_caller_ignores_stays_ignored(lcp: Run) -> None:
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
    ],
)
def test_command_that_is_interrupted_after_the_iteration_reports_its_result(
    place: str, lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(place, interrupt)
    command = ["compare", EXAMPLE, "--method", "newton"] if place.endswith("verified") else ["solve", EXAMPLE]
    outcome = lcp(*command, "--format", "json")
    assert (outcome.code, outcome.err) == (130, "")
    assert json.loads(outcome.out)["z"] == [1, 0, 1, 0]


def test_one_of_many_problems_that_is_interrupted_after_the_iteration_is_written(
    lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lcpcli.verify.digits.digits", interrupt)
    outcome = lcp("solve", EXAMPLE, EXAMPLE, "--format", "json")
    assert (outcome.code, len(outcome.out.splitlines())) == (130, 1)


def test_conclusions_that_are_interrupted_leave_the_minimizer_and_no_claim(
    lcp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lcpcli.solving.minimum.kind_of_point", interrupt)
    outcome = lcp("solve", "problems/programs/portfolio.json", "--format", "json")
    answer = json.loads(outcome.out)["answer"]
    assert (outcome.code, answer["proved"], len(answer["x"])) == (130, None, 3)
    assert answer["statement"] == "x satisfies the first-order conditions; whether it is a minimizer was not examined"


def test_interrupt_in_a_callback_of_the_interpreter_is_not_lost() -> None:
    program = f"""
import os, signal, sys, time, weakref
from lcpcli.files import reading

class Lock: pass

def read(*_):
    lock = Lock()
    reference = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
    del lock
    for _ in range(1000):
        time.sleep(0.02)

reading.problem_of = read
sys.argv = ["lcp", "solve", {str(EXAMPLE)!r}]
{MAIN}
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=15)
    assert (ended.returncode, ended.stderr.strip()) == (130, b"")
