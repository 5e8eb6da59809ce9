"""Full disks, closed pipes and refused memory: one line reports it, and nothing half-written is left."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lcpcli import interrupts
from lcpcli.files import contents, reading
from lcpcli.solving import driver as driver

resource = pytest.importorskip("resource")

EXAMPLE = contents.shipped_path("paper-example-1.json")
BENCH = f"bench {EXAMPLE} --method newton --budget 0"
MAIN = "from lcpcli.cli.main import main; main()"
Run = Callable[..., Any]


def python(code: str, *arguments: str, **how: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **how)


WRITING = [
    f"solve {EXAMPLE} --trace -o out.json",
    f"solve {EXAMPLE} -q --plot out.svg",
    "compare -o out.csv",
    f"{BENCH} -q -o out.json",
    f"{BENCH} -q --plot out.svg",
    f"inspect {EXAMPLE} -o out.json",
    "make tridiagonal -n 100 -o out.json",
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
def test_file_that_does_not_fit_leaves_the_old_one_and_nothing_else(
    line: str, lcp: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if ".svg" in line:
        pytest.importorskip("matplotlib.backends.backend_svg")  # whose first import writes files of its own
    monkeypatch.chdir(tmp_path)
    old = Path(line.split()[-1])
    old.write_text("old")
    with no_file_larger_than(200):
        outcome = lcp(*line.split())
    assert outcome.code == 2
    assert re.fullmatch(r"lcp: out\.\w+: cannot be written \(File too large\); choose another location\n", outcome.err)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {old.name: "old"}


@pytest.mark.parametrize("line", WRITING)
def test_read_only_disk_is_reported_before_any_work(
    line: str, lcp: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: Any) -> Any:
        raise OSError(30, os.strerror(30))

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    monkeypatch.setattr(driver, "run", lambda *_, **__: pytest.fail("worked in vain"))
    outcome = lcp(*line.split())
    assert outcome.code == 2
    assert re.fullmatch(r"lcp: out\.\w+: cannot be written \(Read-only file system\); .*\n", outcome.err)
    assert (outcome.out, list(tmp_path.iterdir())) == ("", [])


@pytest.mark.parametrize(
    "line",
    ["--help", f"solve {EXAMPLE} --format json", "compare --format csv", BENCH, f"inspect {EXAMPLE}", "make kostreva"],
)
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
@pytest.mark.parametrize("line", [f"solve {EXAMPLE}", "make obstacle -o out.npz", BENCH])
def test_memory_too_small_for_numpy_is_reported_in_one_line(line: str, tmp_path: Path) -> None:
    size = 50 * 2**20
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({size}, {size})); {MAIN}"
    done = python(limit, *line.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(r".*memory.*\n", done.stderr, re.IGNORECASE), done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("error", [MemoryError(), ImportError("lib.so: no\nmemory"), SystemError("no reason given")])
def test_refused_memory_is_reported_in_one_line(error: Exception, lcp: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        if isinstance(error, ImportError):
            raise ImportError("a page\nof advice") from error
        raise error

    monkeypatch.setattr(reading, "problem_of", refuse)
    outcome = lcp("solve", EXAMPLE)
    assert (outcome.code, outcome.out) == (1, "")
    assert re.fullmatch(r"lcp: .*memory.*\n", outcome.err)
    assert "advice" not in outcome.err


def test_call_for_which_there_is_no_thread_is_made_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", refuse)
    assert interrupts.interruptibly(lambda: "made") == "made"


def test_stray_fault_of_a_file_names_the_file(lcp: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise PermissionError(13, "Permission denied", "/elsewhere")

    monkeypatch.setattr(reading, "problem_of", refuse)
    outcome = lcp("solve", EXAMPLE)
    assert (outcome.code, outcome.err) == (2, "lcp: /elsewhere: Permission denied\n")


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_an_overflow_is_told_in_words_of_the_field(method: str, lcp: Run, tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"M": [[1e200, 1e300], [1e300, -1e308]], "q": [-1, -1e300]}')
    outcome = lcp("solve", str(tmp_path / "p.json"), "--method", method, "--max-iterations", "100")
    assert (outcome.code, outcome.err) == (1, "")
    assert "encountered" not in outcome.out
    assert ("shi broke down: an overflow of double precision" in outcome.out) is (method == "shi")
