"""lcp bench: what it keeps, what it counts, how it ends, and how it goes on after it was cut off."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli.bench import record as records
from lcpcli.bench.record import BenchRecord, Machine
from lcpcli.model.problem import Problem
from lcpcli.peers.registry import Claim

from . import bench_problems

Lcp = Callable[..., Any]
FAST = ("--budget", "0")


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    return bench_problems.write(tmp_path, "one", "two", "three", "none")


def keys(record: BenchRecord) -> list[tuple[str, str]]:
    return [row.key for row in record.measurements]


def test_record_holds_what_was_measured(files: list[str], tmp_path: Path, lcp: Lcp) -> None:
    output = str(tmp_path / "r.json")
    outcome = lcp("bench", *files, *FAST, "--method", "auto", "--method", "shi", "-o", output)
    assert (outcome.code, outcome.err) == (0, "")
    record = records.read(output)
    assert keys(record) == [(f"{p}.json", m) for p in ("one", "two", "three", "none") for m in ("auto", "shi")]
    rows = {row.key: row for row in record.measurements}
    auto = rows["one.json", "auto"]
    assert (auto.success, auto.false_success, auto.claimed, auto.status, auto.kind) == (
        *(True, False, True),
        *("solved", "method"),
    )
    assert auto.error is not None
    assert auto.error < 1e-9
    assert auto.curve_of == "error"
    assert auto.curve
    assert auto.curve[-1][2] == auto.error
    assert rows["three.json", "auto"].curve_of == "error"
    assert rows["none.json", "shi"].curve_of == "residual"
    assert rows["none.json", "shi"].error is None
    assert len(auto.seconds) >= 1
    assert all(seconds > 0 for seconds in auto.seconds)
    none = rows["none.json", "auto"]
    assert (none.status, none.success, none.claimed) == ("infeasible", True, True)
    assert not rows["none.json", "shi"].success
    assert record.versions["numpy"] == np.__version__
    assert record.machine.cores == os.cpu_count()
    assert record.options.accept == 1e-6


def test_curve_goes_forward_in_time_and_ends_with_the_last_iterate(files: list[str], tmp_path: Path, lcp: Lcp) -> None:
    output = str(tmp_path / "r.json")
    lcp("bench", files[0], *FAST, "--method", "fixed-point", "-o", output)
    (row,) = records.read(output).measurements
    assert row.curve is not None
    numbers, seconds, errors = zip(*row.curve, strict=True)
    assert numbers[-1] == row.iterations
    assert list(numbers) == sorted(set(numbers))
    assert list(seconds) == sorted(seconds)
    assert seconds[1] >= (row.setup_seconds or 0)
    assert errors[-1] < 1e-9 < errors[0]


def test_false_success_is_counted_shown_and_sets_the_exit_code(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench_problems.install(monkeypatch, "liar", bench_problems.liar)
    output = str(tmp_path / "r.json")
    outcome = lcp("bench", *files[:2], *FAST, "--method", "auto", "--peer", "liar", "-o", output)
    assert outcome.code == 1
    lied = [row for row in records.read(output).measurements if row.solver == "liar"]
    assert [(row.claimed, row.success, row.false_success, row.kind) for row in lied] == [
        (True, False, True, "peer")
    ] * 2
    shown = lcp("bench", "--resume", output)
    assert shown.code == 1
    solvers = [line.split() for line in shown.out.splitlines() if line.startswith("liar")]
    assert solvers[0][:4] == ["liar", "0", "2", "2"]
    assert shown.out.count("wrong: fine") == 2


def test_excluded_problem_is_not_a_failure_and_is_listed_with_its_reason(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    def excludes(problem: Problem) -> str:
        return "takes no verdicts" if problem.verdict else ""

    def solve(problem: Problem) -> Claim:
        return Claim(np.linalg.solve(problem.M, -problem.q).clip(0), True, 0.002, "")

    bench_problems.install(monkeypatch, "picky", solve, excludes)
    output = str(tmp_path / "r.json")
    outcome = lcp("bench", files[0], files[3], *FAST, "--method", "auto", "--peer", "picky", "-o", output)
    assert outcome.code == 0
    row = records.read(output).measurements[-1]
    assert (row.status, row.statement, row.seconds, row.claimed) == ("excluded", "takes no verdicts", [], False)
    shown = lcp("bench", "--resume", output).out
    assert next(line for line in shown.splitlines() if line.startswith("picky")).split()[:4] == ["picky", "1", "1", "0"]
    assert "takes no verdicts" in shown


def test_missing_peer_is_named_in_one_line_and_left_out(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench_problems.install(monkeypatch, "absent", bench_problems.silent, version=None)
    output = str(tmp_path / "r.json")
    outcome = lcp("bench", files[0], *FAST, "--method", "auto", "--peer", "absent", "-o", output)
    assert outcome.code == 0
    assert outcome.err == "lcp bench: not installed, left out: absent\n"
    record = records.read(output)
    assert (record.peers, record.missing) == ([], ["absent"])


def test_acceptance_level_decides(files: list[str], lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def rough(problem: Problem) -> Claim:
        return Claim(problem.solutions[0] * (1 + 1e-5), True, 0.001, "rough")

    bench_problems.install(monkeypatch, "rough", rough)
    arguments = ("bench", files[0], *FAST, "--method", "auto", "--peer", "rough", "-q")
    assert lcp(*arguments).code == 1
    assert lcp(*arguments, "--accept", "1e-3").code == 0


def test_interrupted_bench_keeps_what_is_done(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def impatient(problem: Problem) -> Claim:
        calls.append(problem.name)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return bench_problems.silent(problem)

    bench_problems.install(monkeypatch, "impatient", impatient)
    output = str(tmp_path / "r.json")
    outcome = lcp("bench", *files[:3], *FAST, "--method", "auto", "--peer", "impatient", "-o", output)
    assert outcome.code == 130
    assert "interrupted after 3 of 6 measurements" in outcome.err
    done = records.read(output)
    assert keys(done) == [("one.json", "auto"), ("one.json", "impatient"), ("two.json", "auto")]
    assert lcp("bench", "--resume", output, "-q").code == 0
    whole = records.read(output)
    assert whole.measurements[:3] == done.measurements
    assert keys(whole) == [(f"{p}.json", s) for p in ("one", "two", "three") for s in ("auto", "impatient")]


SLOW = """
import sys, time
from lcpcli.bench import suites
prepare = suites.prepare
def slowly(case):
    time.sleep(100 if "none" in case.name else 0.1)
    return prepare(case)
suites.prepare = slowly
sys.argv = ["lcp", *sys.argv[1:]]
from lcpcli.cli.main import main
main()
"""


@pytest.mark.slow("runs a bench in a process, and again")
@pytest.mark.parametrize(("blow", "code"), [(signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)])
def test_bench_that_is_cut_off_leaves_a_valid_record_that_resumes_to_the_same_rows(
    blow: signal.Signals, code: int, tmp_path: Path, lcp: Lcp
) -> None:
    files = bench_problems.write(tmp_path, "one", "two", "three", "none")
    output, other = tmp_path / "killed.json", str(tmp_path / "whole.json")
    arguments = ["bench", *files, *FAST, "--method", "auto", "--method", "lemke"]
    process = subprocess.Popen([sys.executable, "-c", SLOW, *arguments, "-q", "-o", str(output)])
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (output.exists() and records.read(str(output)).measurements):
        time.sleep(0.005)
    process.send_signal(blow)
    assert process.wait() == code
    killed = records.read(str(output))
    assert 1 <= len(killed.measurements) < 8
    assert lcp("bench", "--resume", str(output), "-q").code == 0
    lcp(*arguments, "-q", "-o", other)
    resumed, whole = records.read(str(output)), records.read(other)
    assert keys(resumed) == keys(whole)
    assert resumed.measurements[: len(killed.measurements)] == killed.measurements
    assert [row.status for row in resumed.measurements] == [row.status for row in whole.measurements]


def test_complete_record_is_rendered_without_measuring_or_changing_it(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "r.json"
    lcp("bench", files[0], *FAST, "--method", "auto", "-q", "-o", str(output))
    content = output.read_bytes()
    monkeypatch.setattr("lcpcli.bench.recording.machine", lambda: Machine("other", 1, 1, "other", 1))
    outcome = lcp("bench", "--resume", str(output), "--format", "json")
    assert outcome.out.encode() == content == output.read_bytes()


def test_bench_is_not_resumed_elsewhere(
    files: list[str], tmp_path: Path, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "r.json"
    lcp("bench", files[0], *FAST, "--method", "auto", "-q", "-o", str(output))
    machine = records.read(str(output)).machine
    output.write_text(json.dumps({**json.loads(output.read_text()), "measurements": []}))
    monkeypatch.setattr("lcpcli.bench.recording.machine", lambda: replace(machine, cores=1000))
    outcome = lcp("bench", "--resume", str(output))
    assert outcome.code == 2
    assert "--resume: was measured with cores" in outcome.err
    assert len(outcome.err.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["quik"], "did you mean quick?"),
        (["nothing-like-it"], "choose one of quick"),
        (["missing.json"], "missing.json: no such file"),
        (["-"], "standard input"),
        (["--peer", "quantecom"], "did you mean quantecon?"),
        (["--method", "newtom"], "'newtom'"),
        (["--time-limit", "0"], "--time-limit"),
        (["--time-limit", "inf"], "--time-limit"),
        (["--accept", "2"], "--accept"),
        (["--budget", "-1"], "--budget"),
        (["--tol", "nan"], "--tol"),
        (["-o", "r.xlsx"], "r.xlsx"),
        (["-o", "/nowhere/r.json"], "/nowhere"),
        (["--plot", "r.gif"], "--plot"),
        (["--resume", "r.json"], "no such file"),
        (["--resume", "r.json", "quick"], "SUITE has no effect with --resume"),
        (["--resume", "r.json", "--method", "auto"], "--method has no effect with --resume"),
        (["--resume", "r.json", "--budget", "1"], "--budget has no effect with --resume"),
    ],
)
def test_bad_usage_is_reported_in_one_line(
    arguments: list[str], message: str, lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = lcp("bench", *arguments)
    assert outcome.code == 2
    assert len(outcome.err.splitlines()) == 1
    assert message in outcome.err.replace(": ", " ") or message in outcome.err
    assert not list(tmp_path.iterdir())


def test_problem_is_not_overwritten(files: list[str], lcp: Lcp) -> None:
    content = Path(files[0]).read_text()
    outcome = lcp("bench", *files, "-o", files[0])
    assert outcome.code == 2
    assert "holds a problem" in outcome.err
    assert Path(files[0]).read_text() == content


def test_quiet_prints_nothing(files: list[str], lcp: Lcp) -> None:
    outcome = lcp("bench", files[0], *FAST, "--method", "auto", "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")


def test_progress_is_shown_on_a_terminal_alone(files: list[str], lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ("bench", files[0], *FAST, "--method", "auto", "--method", "lemke")
    assert lcp(*arguments).err == ""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    shown = lcp(*arguments).err
    assert "one.json: auto" in shown
    assert "one.json: lemke" in shown
    assert "1/2" in shown
    assert lcp(*arguments, "-q").err == ""
