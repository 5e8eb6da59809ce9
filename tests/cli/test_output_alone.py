"""Standard output has what the command writes, and nothing that compiled code prints."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-1.json")
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


@pytest.mark.parametrize("ending", ["", ORDERLY], ids=["at once", "orderly"])
@pytest.mark.parametrize("files", [1, 2])
def test_what_compiled_code_prints_is_not_in_the_output(files: int, ending: str) -> None:
    words = ["solve", *files * [EXAMPLE], "--format", "json"]
    command = [sys.executable, "-c", f"{PRINTING}{ending}main()", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert [json.loads(line)["solved"] for line in done.stdout.splitlines()] == files * [True]


def test_program_that_calls_the_command_has_its_output_back(
    lcp: Callable[..., Any], capfd: pytest.CaptureFixture[str]
) -> None:
    usual = sys.stdout, sys.__stdout__
    assert json.loads(lcp("solve", EXAMPLE, "--format", "json").out)["solved"]
    os.write(1, b"back")
    assert (capfd.readouterr().out, (sys.stdout, sys.__stdout__)) == ("back", usual)


@pytest.mark.skipif(not os.path.exists("/dev/stdout"), reason="has no such file")
@pytest.mark.parametrize("name", ["-", "/dev/stdout", "/dev/fd/1"])
def test_standard_output_may_be_named_as_a_file(name: str) -> None:
    command = [sys.executable, "-m", "lcpcli", "solve", EXAMPLE, "--format", "json", "-o", name]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["solved"]
