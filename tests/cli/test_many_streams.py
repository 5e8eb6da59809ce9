"""Streams of problems: what is solved as soon as it is there, and what is refused as it would never end."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files.inputs import Input, inputs

from . import conftest
from .conftest import Lcp, assert_refused

GOOD = f"{conftest.GOOD}\n".encode()


def test_the_first_problem_of_a_stream_does_not_wait_for_the_second_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def given() -> Iterator[bytes]:
        yield from (b"\n", GOOD)
        pytest.fail("the next line is waited for")

    class Stream:
        buffer = given()

    monkeypatch.setattr(sys, "stdin", Stream)
    work = next(inputs(["-"], streams=True))
    assert isinstance(work, Input)
    assert (work.line, work.read().n) == (2, 2)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("option", ["--jobs 1", "-o log.jsonl", "--resume log.jsonl"])
def test_a_problem_alone_is_a_stream_of_one(option: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    class Stream:
        buffer = iter([GOOD])

    monkeypatch.setattr(sys, "stdin", Stream)
    outcome = lcp("solve", "-", *option.split())
    assert (outcome.code, outcome.err) == (0, "lcp: 1 problem: 1 solved\n")


@pytest.mark.parametrize("command", ["solve - --resume own.jsonl < own.jsonl", "solve own.jsonl >> own.jsonl"])
def test_output_to_a_file_that_is_read_is_refused(command: str, tmp_path: Path) -> None:
    own = tmp_path / "own.jsonl"
    own.write_bytes(GOOD * 2)
    script = f"{sys.executable} -m lcpcli {command}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, cwd=tmp_path, timeout=60, check=False)
    assert (done.returncode, len(done.stderr.splitlines()), own.read_bytes()) == (2, 1, GOOD * 2)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_folder_of_temporary_files_is_named(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = tempfile.TemporaryFile

    def full(**options: Any) -> Any:
        return usual(**options) if options else Path("/dev/full").open("w+b")

    (tmp_path / "two.jsonl").write_bytes(GOOD * 2)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    told = f"cannot be collected in {tempfile.gettempdir()} (No space left on device); set TMPDIR to a folder with room"
    assert_refused(lcp("solve", "two.jsonl", "-o", "out.csv"), f"lcp: out.csv: {told}\n")
    assert not (tmp_path / "out.csv").exists()
