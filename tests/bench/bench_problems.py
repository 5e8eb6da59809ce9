"""Tiny problems in files, other solvers and measurements made up, for the tests of lcp
bench."""

import json
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np

from lcpcli.bench.record import BenchRecord, Machine, Measurement, Settings
from lcpcli.bench.report import render
from lcpcli.bench.suites import Case, case
from lcpcli.peers import packages
from lcpcli.peers import registry as peers
from lcpcli.peers.registry import Claim

PROBLEMS = {
    "one": {"M": [[2, 1], [1, 2]], "q": [-5, -6], "solution": [4 / 3, 7 / 3]},
    "two": {"M": [[2, -1], [-1, 2]], "q": [-1, 3], "solution": [0.5, 0]},
    "three": {"M": [[3, 0], [0, 4]], "q": [-3, -4]},
    "none": {"M": [[0, -1], [1, 0]], "q": [-1, -1], "verdict": "infeasible"},
}

SETTINGS = Settings(1e-10, 10.0, 1e-6, 1.0)
MACHINE = Machine("P_1 & Co", 2, 2**33, "Linux", 1)


EMPTY = {
    "suite": ["quick"],
    "cases": [
        case("harker-pang", 10, seed=2, symmetric=True),
        Case("a.json", file="b/a.json"),
    ],
    "methods": ["auto"],
    "peers": ["quantecon"],
    "missing": [],
    "options": SETTINGS,
    "machine": MACHINE,
    "versions": {"numpy": "2.0"},
}


def changed(**changes):
    """A record without measurements, but for the changes, in JSON."""
    content = json.loads(render(BenchRecord(**EMPTY), "json", None, False))
    return json.dumps({**content, **changes})


def measured(**changes):
    """A record of one measurement, which is in order but for the changes."""
    return changed(measurements=[{**asdict(measurement("a.json", "auto")), **changes}])


def write(folder, *names):
    paths = []
    for name in names:
        path = folder / f"{name}.json"
        path.write_text(json.dumps(PROBLEMS[name]))
        paths.append(str(path))
    return paths


def install(monkeypatch, name, solve, excludes=lambda _: "", version="1.0"):
    """Make a peer of that name, for one test."""
    peer = SimpleNamespace(
        module=name,
        version=lambda: version,
        excludes=excludes,
        solve=lambda problem, _tol, _time_limit: solve(problem),
    )
    monkeypatch.setitem(peers.REGISTRY, name, ("packages", "made up"))
    monkeypatch.setattr(packages, name, peer, raising=False)


def liar(problem):
    """Says that -1 solves everything."""
    return Claim(-np.ones(problem.n), True, 0.001, "fine")


def silent(problem):  # noqa: ARG001
    return Claim(None, False, 0.001, "gave up")


def measurement(problem, solver, n=2, success=True, **changes):
    """A success or a failure that claims nothing, but for the changes."""
    ended = {
        "status": "solved" if success else "iteration_limit",
        "statement": "solved",
        "claimed": success,
    }
    plain = {
        "family": None,
        "seed": None,
        "parameters": {},
        "kind": "method",
        "false_success": False,
    }
    return Measurement(
        problem,
        solver=solver,
        n=n,
        success=success,
        **plain | ended | {"seconds": [1.0]} | changes,
    )
