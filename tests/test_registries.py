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
from lcpcli.inspection.classify import CLASSES
from lcpcli.methods.registry import ANY, METHODS, OPTIONS

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
"""The inverse of M + shift I, times a scale, for M with a nonnegative inverse and q <= 0."""

import numpy as np

from lcpcli.methods.stages import Finished, Iterate


def toy(problem, x0, *, shift, scale_by):
    z = scale_by * np.linalg.solve(problem.M + shift * np.eye(problem.n), -problem.q)
    yield Iterate(z / 2, None, "", 1)
    return Finished()
'''
DECLARED = (
    '"toy": Method("the inverse", options=(Option("shift", float, 0.0, "shift >= 0", lambda v: v >= 0, "Added to M."), '
    'Option("scale_by", int, 1, "whole number >= 1", lambda v: v >= 1, "Multiplies z.")))'
)
FAMILY = '''
"""The identity, of this test."""

import numpy as np

from lcpcli.model.problem import Problem


def toy(n, _seed, *, load=1.0):
    return Problem(np.eye(n), np.full(n, -load), name=f"toy-{n}", solutions=[np.full(n, load)], source="this test")
'''
FORMAT = '''
"""The diagonal of M and q, in two lines."""

import numpy as np


def fields(content, number=float):
    diagonal, q = ([number(text) for text in line.split()] for line in content.decode().splitlines())
    return {"M": np.diag(diagonal), "q": q}


def values(field, content, number=float):
    return fields(content, number)[field]


def render(fields, exact):
    lines = (fields["M"].diagonal(), fields["q"])
    return {"": "\\n".join(" ".join(map(str, line)) for line in lines).encode()}
'''
PEER = '''
"""A solver that says 1."""

from lcpcli.peers.packages import Solver


def says_one(numpy, problem, program, tol, time_limit):
    return numpy.ones(problem.n), None, True, "one"


toy = Solver("numpy", says_one, ())
'''


def test_declarations_of_methods_name_one_option_each_and_known_classes() -> None:
    options = {option for method in METHODS.values() for option in method.options}
    assert len(options) == len(OPTIONS)
    assert {name for method in METHODS.values() for name in method.guaranteed} <= {ANY, *CLASSES}


def test_method_with_two_options(package: Path, lcp: Run) -> None:
    (package / "methods" / "toy.py").write_text(METHOD)
    register(package / "methods" / "registry.py", "METHODS", DECLARED)
    given = '{"M": [[2, 0], [0, 4]], "q": [-2, -4]}'
    toy = ("--method", "toy", "--format", "json")
    record = json.loads(lcp("solve", "-", *toy, given=given))
    assert (record["status"], record["method"], record["z"]) == ("solved", "toy", [1.0, 1.0])
    assert record["options"] == {"shift": 0.0, "scale_by": 1}
    given = '{"M": [[2, 0], [0, 2]], "q": [-2, -2]}'
    record = json.loads(lcp("solve", "-", *toy, "--shift", "2", "--scale-by", "2", given=given))
    assert (record["status"], record["z"]) == ("solved", [1.0, 1.0])
    assert record["options"] == {"shift": 2.0, "scale_by": 2}
    for command in ("solve", "compare"):
        assert all(word in lcp(command, "--help") for word in ("Method toy", "--scale-by", "[shift >= 0; default 0]"))
    classes = json.loads(lcp("inspect", "-", "--format", "json", given=given))
    assert classes["methods"]["toy"]["guaranteed"] == "not decided"


def test_family(package: Path, lcp: Run) -> None:
    (package / "gallery" / "toy.py").write_text(FAMILY)
    register(package / "gallery" / "families.py", "REGISTRY", '"toy": Entry("toy", "the identity", "P")')
    problem = json.loads(lcp("make", "toy", "-n", "3", "--set", "load=2"))
    assert (problem["name"], problem["q"]) == ("toy-3", [-2, -2, -2])
    assert "toy" in lcp("make", "--list")


def test_problem_format(package: Path, lcp: Run) -> None:
    (package / "files" / "toy_format.py").write_text(FORMAT)
    register(package / "files" / "formats.py", "FORMATS", '".toy": "toy_format"')
    lcp("make", "diagonal", "-n", "3", "--set", "decades=0", "-o", "problem.toy")
    assert (package.parent / "problem.toy").read_text() == "1.0 1.0 1.0\n-1.0 1.0 -1.0"
    assert json.loads(lcp("solve", "problem.toy", "--format", "json"))["z"] == [1.0, 0.0, 1.0]


def test_peer(package: Path, lcp: Run) -> None:
    (package / "peers" / "toy.py").write_text(PEER)
    register(package / "peers" / "registry.py", "REGISTRY", '"toy": ("toy", "says 1")')
    (package.parent / "problem.json").write_text('{"M": [[2, 0], [0, 4]], "q": [-2, -4]}')
    out = lcp("bench", "problem.json", "--method", "newton", "--peer", "toy", "--budget", "0", "--format", "json")
    rows = {row["solver"]: row for row in json.loads(out)["measurements"]}
    assert rows["toy"]["success"]
    assert rows["toy"]["kind"] == "peer"
