"""`lcp path` that is stopped: the part that was found is given, verified, with the reason."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import writing
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.parametric import following

from .conftest import MAIN, Lcp, python


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two problems that have many breakpoints between them."""
    monkeypatch.chdir(tmp_path)
    random = np.random.default_rng(0)
    A, q = random.normal(size=(60, 60)), random.uniform(0.1, 1, 60)
    for name, sign in (("from", 1), ("to", -1)):
        writing.write(Problem(A @ A.T + A - A.T, sign * q), f"{name}.npz")
    return tmp_path


def test_time_limit_leaves_the_verified_part_and_a_breakdown_is_told(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "check", later(following.TimeIsUp, 20))
    outcome = lcp("path", "from.npz", "to.npz", "--time-limit", "100", "--format", "json")
    found = json.loads(outcome.out)
    assert (outcome.code, found["end"], found["verified"]) == (1, "time_limit", True)
    assert (found["message"], 1 < len(found["t"]) <= 21) == ("stopped at the time limit", True)
    monkeypatch.setattr(following, "check", later(SingularMatrix, 1))
    outcome = lcp("path", "from.npz", "to.npz")
    assert (outcome.code, "broke down: a basis is too ill-conditioned" in outcome.out) == (1, True)


def later(error: type[BaseException], calls: int) -> Callable[[], None]:
    """A function that raises an error when it has been called so often."""
    left = iter(range(calls))

    def check() -> None:
        if next(left, None) is None:
            raise error

    return check


def test_interrupt_leaves_the_verified_part_and_the_points_on_it(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "check", later(KeyboardInterrupt, 20))
    outcome = lcp("path", "from.npz", "to.npz", "--at", "0.01,1", "-o", "part.csv")
    assert (outcome.code, outcome.err) == (130, "lcp: to.npz: interrupted\n")
    lines = Path("part.csv").read_text().splitlines()
    assert "interrupted; " in lines[1]
    assert lines[1].endswith(", verified")
    assert lines[-1].startswith(",0.01,")


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signal_ends_with_the_part_that_is_known(number: int, code: int, folder: Path) -> None:
    slow = f"""
import os, signal
from lcpcli.parametric import following
own, calls = following.check, iter(range(20))
def check():
    own()
    if next(calls, None) is None:
        os.kill(os.getpid(), {int(number)})
following.check = check
{MAIN}
"""
    done = python(slow, "path", "from.npz", "to.npz", "--format", "json", cwd=folder)
    assert (done.returncode, done.stderr) == (code, "")
    found = json.loads(done.stdout)
    assert (found["end"], found["verified"]) == ("interrupted", True)
    assert len(found["t"]) > 1
