"""Adding a method, a family, a problem format or a peer takes one new file and one line of a registry."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import lcpcli

Run = Callable[..., str]


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package, to be added to."""
    target = tmp_path / "lcpcli"
    shutil.copytree(Path(lcpcli.__file__).parent, target, ignore=shutil.ignore_patterns("__pycache__"))
    return target


@pytest.fixture
def lcp(package: Path) -> Run:
    """Run the command of the copy."""

    def run(*arguments: str, given: str = "") -> str:
        environment = os.environ | {"PYTHONPATH": str(package.parent)}
        command = [sys.executable, "-m", "lcpcli", *arguments]
        done = subprocess.run(
            command, input=given, capture_output=True, text=True, check=False, cwd=package.parent, env=environment
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    return run


def register(registry: Path, name: str, line: str) -> None:
    """Add one line to the dictionary of that name in a file."""
    text = registry.read_text()
    opening = text.index("{", text.index(f"\n{name} = ")) + 1
    registry.write_text(f"{text[:opening]}\n    {line},{text[opening:]}")


METHOD = '''
"""The inverse, for M with a nonnegative inverse and q <= 0."""

import numpy as np

from lcpcli.methods.iterate import Iterate


def toy(problem, x0):
    yield Iterate(x0, None, "", 0)
    yield Iterate(np.linalg.solve(problem.M, -problem.q) / 2, None, "", 1)
'''
FAMILY = '''
"""The identity, of this test."""

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"


def toy(n, _seed, *, load=1.0):
    return Problem(np.eye(n), np.full(n, -load), name=f"toy-{n}", solutions=[np.full(n, load)], source="this test")
'''
FORMAT = '''
"""The diagonal of M and q, in two lines."""

import numpy as np

from lcpcli.model.problem import Problem


def parse(content):
    diagonal, q = (list(map(float, line.split())) for line in content.decode().splitlines())
    return Problem(np.diag(diagonal), q)


def render(problem):
    lines = (problem.M.diagonal(), problem.q)
    return {"": "\\n".join(" ".join(map(str, line)) for line in lines).encode()}
'''
PEER = '''
"""A solver that says 1."""

import numpy as np

from lcpcli.peers.registry import Claim

PACKAGE = "toy"


def version():
    return "0"


def excludes(problem):
    return ""


def solve(problem, tol, time_limit):
    return Claim(np.ones(problem.n), True, 1e-3, "one")
'''


def test_method(package: Path, lcp: Run) -> None:
    (package / "methods" / "toy.py").write_text(METHOD)
    register(package / "methods" / "registry.py", "METHODS", '"toy": "the inverse"')
    record = json.loads(
        lcp("solve", "-", "--method", "toy", "--format", "json", given='{"M": [[2, 0], [0, 4]], "q": [-2, -4]}')
    )
    assert (record["status"], record["method"], record["z"]) == ("solved", "toy", [1.0, 1.0])
    assert "toy" in lcp("solve", "--help")


def test_family(package: Path, lcp: Run) -> None:
    (package / "gallery" / "toy.py").write_text(FAMILY)
    register(package / "gallery" / "families.py", "FAMILIES", '"toy": "the identity"')
    problem = json.loads(lcp("make", "toy", "-n", "3", "--set", "load=2"))
    assert (problem["name"], problem["q"]) == ("toy-3", [-2, -2, -2])
    assert "toy" in lcp("make", "--list")


def test_problem_format(package: Path, lcp: Run) -> None:
    (package / "files" / "toy_format.py").write_text(FORMAT)
    register(package / "files" / "formats.py", "FORMATS", '".toy": "toy"')
    lcp("make", "diagonal", "-n", "3", "--set", "decades=0", "-o", "problem.toy")
    assert (package.parent / "problem.toy").read_text() == "1.0 1.0 1.0\n-1.0 1.0 -1.0"
    assert json.loads(lcp("solve", "problem.toy", "--format", "json"))["z"] == [1.0, 0.0, 1.0]


def test_peer(package: Path, lcp: Run) -> None:
    (package / "peers" / "toy.py").write_text(PEER)
    register(package / "peers" / "registry.py", "PEERS", '"toy": "says 1"')
    (package.parent / "problem.json").write_text('{"M": [[2, 0], [0, 4]], "q": [-2, -4]}')
    out = lcp("bench", "problem.json", "--method", "newton", "--peer", "toy", "--budget", "0", "--format", "json")
    rows = {row["solver"]: row for row in json.loads(out)["measurements"]}
    assert rows["toy"]["success"]
    assert rows["toy"]["kind"] == "peer"
