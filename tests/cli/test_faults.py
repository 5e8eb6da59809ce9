"""Full disks, closed pipes, refused memory: one line reports it, nothing half-written is left, nothing is lost."""

from __future__ import annotations

import contextlib
import json
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
    f"{BENCH} -q --plot out.svg",
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
        outcome = lcp("solve", str(file), "--method", method, "--format", form, "--max-iterations", "300")
        assert (outcome.code in (0, 1), outcome.err) == (True, "")


def shell(script: str) -> subprocess.CompletedProcess[str]:
    """Run a shell script in which $LCP is the command."""
    environment = {"LCP": f"{sys.executable} -m lcpcli", "PATH": "/usr/bin:/bin"}
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, env=environment, check=False)


@pytest.mark.slow("each in a process of its own")
@pytest.mark.parametrize("command", [f"solve {EXAMPLE}", "compare --format json", "--help"])
def test_full_device_is_reported_in_one_line(command: str) -> None:
    done = shell(f"$LCP {command} > /dev/full")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "standard output cannot be written (No space left on device)" in done.stderr


@pytest.mark.slow("each in a process of its own")
def test_closed_standard_output_is_an_error_unless_nothing_is_to_be_written() -> None:
    done = shell(f"$LCP solve {EXAMPLE} >&-")
    assert done.returncode == 2
    assert "standard output cannot be written" in done.stderr
    done = shell(f"$LCP solve {EXAMPLE} -q >&-")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow("each in a process of its own")
def test_first_line_can_be_had_alone() -> None:
    done = shell("$LCP compare --every 1 | head -1")
    assert done.stdout.startswith("paper-example-1")
    assert done.stderr == ""


PRINTING = """
import ctypes, os, sys
from lcpcli.cli.main import main
from lcpcli.solving import driver

def run(*given, **named):
    os.write(1, b"debugging")
    if sys.platform != "win32":
        ctypes.CDLL(None).puts(b"more of it, in the buffer of C")
    return real(*given, **named)

real, driver.run = driver.run, run
sys.argv[0] = "lcp"
"""
ORDERLY = "sys.settrace(lambda *_: None)\n"  # the interpreter then ends in its usual way


@pytest.mark.parametrize(("files", "ending"), [(1, ORDERLY), (2, "")], ids=["orderly", "at once"])
def test_what_compiled_code_prints_is_not_in_the_output(files: int, ending: str) -> None:
    words = ["solve", *files * [EXAMPLE], "--format", "json"]
    done = python(f"{PRINTING}{ending}main()", *words)
    assert (done.returncode, [json.loads(line)["solved"] for line in done.stdout.splitlines()]) == (0, files * [True])


def test_program_that_calls_the_command_has_its_output_back(lcp: Lcp, capfd: pytest.CaptureFixture[str]) -> None:
    usual = sys.stdout, sys.__stdout__
    assert json.loads(lcp("solve", EXAMPLE, "--format", "json").out)["solved"]
    os.write(1, b"back")
    assert (capfd.readouterr().out, (sys.stdout, sys.__stdout__)) == ("back", usual)


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="has no such file")
@pytest.mark.parametrize("name", ["-", "/dev/stdout"])
def test_standard_output_may_be_named_as_a_file(name: str) -> None:
    assert json.loads(python(MAIN, "solve", EXAMPLE, "--format", "json", "-o", name).stdout)["solved"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("solve paper-example-1 --minimize foo", "lcp: --minimize: names 'foo'"),
        ("solve paper-example-1 --maximize foo", "lcp: --maximize: names 'foo'"),
        ("compare paper-example-1 --sweep p=1e2,abc", "lcp: --sweep: p: 'abc' is not a number"),
        ("compare paper-example-1 --method shi:p=abc", "lcp: --method: p: 'abc' is not a number"),
        ("solve paper-example-1 --method auto:p=3", "lcp: --method: auto has no option p; it belongs to shi"),
        ("solve paper-example-1 --tol abc", "lcp: --tol: 'abc'"),
    ],
)
def test_an_error_names_the_option_at_fault(line: str, message: str, lcp: Lcp) -> None:
    outcome = lcp(*line.split())
    assert outcome.code == 2
    assert outcome.err.startswith(message)
