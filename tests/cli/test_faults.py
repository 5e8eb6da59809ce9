"""Full disks, closed pipes and refused memory: one line reports it, and nothing half-written is left."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lcpcli import interrupts
from lcpcli.files import reading
from lcpcli.solving import driver as driver

from .conftest import EXAMPLE, MAIN, Lcp, assert_refused, python

resource = pytest.importorskip("resource")

BENCH = f"bench {EXAMPLE} --method newton --budget 0"


WRITING = [
    f"solve {EXAMPLE} --trace -o out.json",
    f"solve {EXAMPLE} -q --plot out.svg",
    f"compare {EXAMPLE} --method newton -o out.csv",
    f"{BENCH} -q -o out.json",
    f"inspect {EXAMPLE} -o out.json",
    "make tridiagonal -n 100 -o out.mtx",
    "make tridiagonal -n 100 -o out.npz",
]


@contextlib.contextmanager
def no_file_larger_than(size: int) -> Iterator[None]:
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)


@pytest.mark.parametrize("line", WRITING)
def test_file_that_cannot_be_written_leaves_the_old_one_and_nothing_else(
    line: str, lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As it does not fit, or as the disk can only be read, which is reported before any work."""

    def refuse(**_: Any) -> Any:
        raise OSError(30, os.strerror(30))

    if ".svg" in line:
        pytest.importorskip("matplotlib.backends.backend_svg")  # whose first import writes files of its own
    monkeypatch.chdir(tmp_path)
    old = Path(line.split()[-1])
    old.write_text("old")
    told = r"lcp: out\.\w+: cannot be written \(%s\); choose another location\n"
    with no_file_larger_than(200):
        outcome = lcp(*line.split())
    assert (outcome.code, bool(re.fullmatch(told % "File too large", outcome.err))) == (2, True), outcome.err
    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    monkeypatch.setattr(driver, "run", lambda *_, **__: pytest.fail("worked in vain"))
    assert_refused(lcp(*line.split()), "cannot be written (Read-only file system); ")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {old.name: "old"}


@pytest.mark.parametrize("line", ["--help", f"solve {EXAMPLE} --format json", BENCH, "make kostreva"])
def test_pipe_that_nobody_reads_ends_with_141(line: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        command = [sys.executable, "-c", MAIN, *line.split()]
        done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, check=False)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.parametrize("redirection", ["2> /dev/full", "2>&-"])
def test_error_that_cannot_be_reported_keeps_its_exit_code(redirection: str) -> None:
    script = f'"{sys.executable}" -c "{MAIN}" solve nowhere.json {redirection}'
    done = subprocess.run(["bash", "-c", script], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, b"", b"")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the limit is not one of addresses")
@pytest.mark.parametrize("line", [f"solve {EXAMPLE}", "make obstacle -o out.npz"])
def test_memory_too_small_for_numpy_is_reported_in_one_line(line: str, tmp_path: Path) -> None:
    size = 50 * 2**20
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({size}, {size})); {MAIN}"
    done = python(limit, *line.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(r".*memory.*\n", done.stderr, re.IGNORECASE), done.stderr
    assert list(tmp_path.iterdir()) == []


ERRORS = {
    "memory": MemoryError(),
    "library": ImportError("lib.so: no\nmemory"),
    "no reason": SystemError("no reason given"),
    "file": PermissionError(13, "Permission denied", "/elsewhere"),
}


@pytest.mark.parametrize("kind", ERRORS)
def test_stray_fault_is_reported_in_one_line(kind: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        if kind == "library":
            raise ImportError("a page\nof advice") from ERRORS[kind]
        raise ERRORS[kind]

    monkeypatch.setattr(reading, "problem_of", refuse)
    outcome = lcp("solve", EXAMPLE)
    if kind == "file":
        assert_refused(outcome, "lcp: /elsewhere: Permission denied\n")
    else:
        assert (outcome.code, outcome.out, "advice" in outcome.err) == (1, "", False)
        assert re.fullmatch(r"lcp: .*memory.*\n", outcome.err)


def test_call_for_which_there_is_no_thread_is_made_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", refuse)
    assert interrupts.interruptibly(lambda: "made") == "made"


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_an_overflow_is_told_in_words_of_the_field(method: str, lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"M": [[1e200, 1e300], [1e300, -1e308]], "q": [-1, -1e300]}')
    outcome = lcp("solve", str(tmp_path / "p.json"), "--method", method, "--max-iterations", "100")
    assert (outcome.code, outcome.err) == (1, "")
    assert "encountered" not in outcome.out
    assert ("shi broke down: an overflow of double precision" in outcome.out) is (method == "shi")


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
@pytest.mark.parametrize(
    "text",
    [
        '{"M": [[1]], "q": [-1], "x0": [1e308]}',
        '{"M": [[1e308, 1e308], [-1e308, 1e308]], "q": [-1, -1]}',
        '{"M": [[1e-320, 0], [0, 1e-320]], "q": [1e308, -1]}',
        '{"M": [[0]], "q": [0]}',
        '{"M": [[0, 0], [0, 0]], "q": [-1, 1e300]}',
        '{"M": [[1e-300]], "q": [-1e300]}',
    ],
)
def test_numbers_at_the_ends_of_double_range_end_in_a_status(text: str, method: str, lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    file.write_text(text)
    for form in ("table", "json"):
        outcome = lcp("solve", str(file), "--method", method, "--format", form, "--max-iterations", "100")
        assert (outcome.code in (0, 1), outcome.err) == (True, "")
