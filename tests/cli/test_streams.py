"""Standard output that is full, closed, not wanted any more or printed to by others: nothing is lost or added."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from .conftest import EXAMPLE, MAIN, Lcp, python


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
def test_closed_standard_output_leaves_the_exit_code() -> None:
    done = shell(f"$LCP solve {EXAMPLE} >&-")
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
