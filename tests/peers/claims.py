"""What the tests of other solvers have in common: a small problem, and what may be claimed about it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from lcpcli import Problem
from lcpcli.peers import registry as peers
from lcpcli.peers.registry import Claim
from lcpcli.verify.point import Criterion, Point

TOL = 1e-9
TIME_LIMIT = 20.0
IN_CI = ("piqp", "daqp")  # the test extra has them: they are never skipped
INDEFINITE = Problem([[0, 1], [1, 0]], [-1, -1])


def loaded(name: str) -> peers.Peer:
    """The peer of that name; the test is skipped where it is not installed, unless the test extra has it, and where its
    licence has expired."""
    peer = peers.load(name)
    if peer.version() is None and name not in IN_CI:
        pytest.skip(f"{name} is not installed")
    if (reason := peer.excludes(Problem([[1]], [1]))).startswith("licence"):
        pytest.skip(reason)
    return peer


def relative_residual(problem: Problem, claim: Claim) -> float:
    assert claim.z is not None
    return Point(Criterion(problem), claim.z, is_admissible=False).scaled_residual


def stand_in(program: Path, text: str) -> Path:
    """A shell script in place of another program."""
    if os.name != "posix":
        pytest.skip("needs a POSIX shell")
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    return program
