"""Shared by the tests of the commands: a folder that is entered, problems in it, and
what an outcome tells."""

import shlex
import subprocess
import sys

import pytest

from lcpcli.files import contents

from ..conftest import Outcome

EXAMPLE = contents.shipped_path("paper-example-1.json")
MAIN = "from lcpcli.cli.main import main; main()"
GOOD = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}'
INFEASIBLE = '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}'


@pytest.fixture(autouse=True)
def few_repetitions(monkeypatch):
    """Runs that are compared are repeated once in these tests, which do not look at how
    exact their times are."""
    monkeypatch.setattr("lcpcli.solving.driver.MAX_REPETITIONS", 1)


@pytest.fixture
def folder(in_folder):
    """A folder, entered, with good.json, none.json, which has no solution, and
    good.json in M.csv and q.csv."""
    for name, text in {
        "good.json": GOOD,
        "none.json": INFEASIBLE,
        "M.csv": "2,1\n1,2\n",
        "q.csv": "-5\n-6\n",
    }.items():
        (in_folder / name).write_text(text)
    return in_folder


def assert_refused(outcome, *words):
    """One line on standard error says so, with these words, and that is all, but for a
    record of the same where JSON is asked for."""
    assert (outcome.code, outcome.err.count("\n")) == (2, 1), outcome.err
    if outcome.out:
        assert f"lcp: {outcome.record['message']}\n" == outcome.err
    assert [word for word in words if word not in outcome.err] == [], outcome.err


def python(code, line="", *more, **how):
    """Run a program in a process of its own."""
    command = [sys.executable, "-c", code, *shlex.split(line), *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False, **how)
    return Outcome(done.returncode, done.stdout, done.stderr)


def interrupt(*_, **__):
    raise KeyboardInterrupt
