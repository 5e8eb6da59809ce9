"""Full disks, closed pipes, refused memory, unusual numbers: one line, nothing
half-written, nothing lost."""

import contextlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from lcpcli import interrupts
from lcpcli.files.input_file import InputFile
from lcpcli.solving import driver as driver

from ..conftest import Outcome, save_json
from ..files.nl_writing import model
from ..wordings import CANNOT_BE_WRITTEN, OTHER_PLACE
from .conftest import EXAMPLE, MAIN, assert_refused, python

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
def no_file_larger_than(size):
    """Nor are modules that are imported kept in compiled form, which would be cut."""
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "dont_write_bytecode", True)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, usual[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, usual)


@pytest.mark.parametrize("line", WRITING)
def test_file_that_cannot_be_written_leaves_the_old_one_and_nothing_else(
    line, lcp, in_folder, monkeypatch
):
    """As it does not fit, or as the disk can only be read, which is reported before any
    work."""

    def refuse(**_):
        raise OSError(30, os.strerror(30))

    if ".svg" in line:
        # Whose first import writes files of its own.
        pytest.importorskip("matplotlib.backends.backend_svg")
    old = Path(line.split()[-1])
    old.write_text("old")
    fault = re.escape(CANNOT_BE_WRITTEN.format("File too large"))
    told = rf"lcp: out\.\w+: {fault}; {OTHER_PLACE}\n"
    with no_file_larger_than(200):
        outcome = lcp(line)
    assert outcome.code == 2
    assert re.fullmatch(told, outcome.err)
    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    monkeypatch.setattr(driver, "run", lambda *_, **__: pytest.fail("worked in vain"))
    assert_refused(lcp(line), CANNOT_BE_WRITTEN.format("Read-only file system"))
    assert {path.name: path.read_text() for path in in_folder.iterdir()} == {
        old.name: "old"
    }


@pytest.mark.parametrize("line", ["--help", f"solve {EXAMPLE}"])
def test_pipe_that_nobody_reads_ends_with_141(line):
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-c", MAIN, *line.split()]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.parametrize("redirection", ["2> /dev/full", "2>&-"])
def test_error_that_cannot_be_reported_keeps_its_exit_code(redirection):
    script = f'"{sys.executable}" -c "{MAIN}" unknown {redirection}'
    done = subprocess.run(["bash", "-c", script], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (2, b"", b"")


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere the limit is not one of addresses"
)
@pytest.mark.parametrize("line", [f"solve {EXAMPLE}", "make obstacle -o out.npz"])
def test_memory_too_small_for_numpy_is_reported_in_one_line(line, tmp_path):
    size = 50 * 2**20
    limit = (
        f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({size}, "
        f"{size})); {MAIN}"
    )
    done = python(limit, line, cwd=tmp_path)
    assert (done.code, done.out) == (1, "")
    assert re.fullmatch(r".*memory.*\n", done.err, re.IGNORECASE), done.err
    assert list(tmp_path.iterdir()) == []


IN_A_LIBRARY = ImportError("a page\nof advice")
IN_A_LIBRARY.__cause__ = ImportError("lib.so: no\nmemory")
ERRORS = {
    "memory": (MemoryError(), 1, ".*memory.*"),
    "library": (IN_A_LIBRARY, 1, "((?!advice).)*memory((?!advice).)*"),
    "no reason": (SystemError("no reason given"), 1, ".*memory.*"),
    "files": (OSError(24, "Too many"), 1, "the system refused: Too many"),
    "threads": (
        RuntimeError("can't start new thread"),
        1,
        "the system refused a further thread",
    ),
    "file": (PermissionError(13, "Denied", "/elsewhere"), 2, "/elsewhere: Denied"),
}


@pytest.mark.parametrize("kind", ERRORS)
def test_stray_fault_is_reported_in_one_line(kind, lcp, monkeypatch):
    """And not blamed on standard output."""
    cause, code, told = ERRORS[kind]

    def refuse(*_):
        raise cause

    monkeypatch.setattr(InputFile, "problem", refuse)
    outcome = lcp(f"solve {EXAMPLE}")
    assert (outcome.code, outcome.out) == (code, "")
    assert re.fullmatch(rf"lcp: {told}\n", outcome.err)


def test_call_for_which_there_is_no_thread_is_made_all_the_same(monkeypatch):
    def refuse(*_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", refuse)
    assert interrupts.interruptibly(lambda: "made") == "made"


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
# The interpreter then ends in its usual way.
ORDERLY = "sys.gettrace = lambda: True\n"


@pytest.mark.parametrize(
    ("files", "ending"), [(1, ORDERLY), (2, "")], ids=["orderly", "at once"]
)
def test_what_compiled_code_prints_is_not_in_the_output(files, ending):
    line = f"solve {' '.join(files * [EXAMPLE])} --format json"
    awaited = "try:\n    main()\nfinally:\n    os.write(2, b'in its usual way')"
    done = python(f"{PRINTING}{ending}{awaited}", line)
    assert (done.code, "usual way" in done.err) == (0, ending == ORDERLY)
    assert [record["solved"] for record in done.records] == files * [True]


def test_program_that_calls_the_command_has_its_output_back(lcp, capfd):
    usual = sys.stdout, sys.__stdout__
    assert lcp(f"solve {EXAMPLE} --format json").record["solved"]
    os.write(1, b"back")
    assert capfd.readouterr().out == "back"
    assert (sys.stdout, sys.__stdout__) == usual


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="has no such file")
def test_standard_output_may_be_named_as_a_file(lcp):
    assert lcp(f"solve {EXAMPLE} --format json -o /dev/stdout").record["solved"]


LINEAR = model(1, [((4, 1), {0: 1}, 0)], [(3,)])


@pytest.mark.parametrize("line", [1, 7])
def test_a_count_of_thousands_of_digits_in_a_model_is_refused(line, lcp, folder):
    lines = LINEAR.split(b"\n")
    lines[line] = b" " + 4400 * b"1" + lines[line].lstrip().lstrip(b"0123456789")
    (folder / "long.nl").write_bytes(b"\n".join(lines))
    assert_refused(lcp("solve long.nl"), f"long.nl: line {line + 1}")


ZEROS = 140_000 * "0"


@pytest.mark.parametrize("number", [f"-1.{ZEROS}", f"-{ZEROS}1/2"])
def test_a_number_longer_than_cells_of_csv_may_be_is_read(number, lcp, folder):
    (folder / "q.csv").write_text(f"{number}\n-1\n")
    save_json(folder / "problem.json", {"M": [[2, 1], [1, 2]], "q": [number, -1]})
    assert lcp("solve M.csv q.csv -q").code == 0
    assert lcp("solve problem.json -q").code == 0


def without_streams(line, *closed):
    """Run a command in a process that has not these standard streams."""
    return python(MAIN, line, preexec_fn=lambda: [*map(os.close, closed)])


def test_closed_standard_output_is_an_error_where_it_is_written():
    refused = without_streams(f"solve {EXAMPLE}", 1)
    assert_refused(refused, "standard output cannot be written")


@pytest.mark.parametrize(
    "line", ["solve -", "compare -", f"check {EXAMPLE} -", "solve - --jobs 2 -q"]
)
def test_closed_standard_input_is_an_error_where_it_is_read(line, lcp, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    assert_refused(lcp(line), "lcp: standard input: is closed; name a file\n")


def test_closed_streams_do_not_matter_where_they_are_not_used():
    assert without_streams(f"solve {EXAMPLE} -q", 0, 1) == Outcome(0, "", "")


def test_a_log_is_whole_though_all_standard_streams_are_closed(tmp_path):
    many, log = tmp_path / "many.jsonl", tmp_path / "log.jsonl"
    many.write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}\n' * 20)
    line = f"solve {many} --jobs 2 -o {log}"
    assert without_streams(line, 0, 1, 2).code == 0
    lines = log.read_text().splitlines()
    assert [json.loads(line)["solved"] for line in lines] == 20 * [True]


@pytest.mark.skipif(sys.platform == "win32", reason="keeps a folder that is used")
def test_removed_working_folder_is_named_where_it_is_needed(lcp, tmp_path, monkeypatch):
    gone = "the working folder has been removed: change to another one\n"
    (folder := tmp_path / "gone").mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    for line in (
        "solve good.json",
        f"solve {EXAMPLE} -o x.json",
        f"solve {EXAMPLE} {EXAMPLE} -o x.jsonl",
        f"{BENCH} -q -o y.json",
        "make tridiagonal -n 9 -o t.json",
    ):
        done = lcp(line)
        assert_refused(done, gone)
        has_record = "solve" in line and "-o" in line
        assert bool(done.out) == has_record
    # Where nothing is loaded yet; on Python 3.13 NumPy does not load there.
    line = f"solve {EXAMPLE} -o {tmp_path / 'result.json'} -q"
    done = python(MAIN, line)
    usual = (0, "") if sys.version_info[:2] != (3, 13) else (2, f"lcp: {gone}")
    assert (done.code, done.err) in ((0, ""), usual)


def test_a_refused_run_for_ampl_leaves_no_answer_of_an_earlier_one(lcp, folder):
    (folder / "stub.nl").write_bytes(LINEAR)
    assert lcp("stub -AMPL").code == 0
    assert (folder / "stub.sol").is_file()
    assert lcp("stub -AMPL speed=1").code == 2
    assert not (folder / "stub.sol").exists()


@pytest.mark.slow("a process of its own")
def test_full_device_is_reported_in_one_line():
    script = f"{sys.executable} -m lcpcli solve {EXAMPLE} > /dev/full"
    done = subprocess.run(
        script, shell=True, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert CANNOT_BE_WRITTEN.format("No space left on device") in done.stderr
