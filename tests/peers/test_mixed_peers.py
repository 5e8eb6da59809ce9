"""Other solvers get the bounds of a problem, or say that they take none."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli.gallery import families as gallery
from lcpcli.peers import registry as peers

from .claims import loaded

ORTHANT_ONLY = [name for name in peers.PEERS if name == "quantecon"]
WITH_BOUNDS = [name for name in peers.PEERS if name not in (*ORTHANT_ONLY, "gambit")]


@pytest.mark.parametrize("name", WITH_BOUNDS)
@pytest.mark.parametrize("family", ["boxes", "torsion", "two-obstacles"])
def test_quadratic_programming_solvers_get_the_bounds(family: str, name: str) -> None:
    peer, problem = loaded(name), gallery.make(family, 25)
    assert peer.excludes(problem) == ""
    claim = peer.solve(problem, 1e-9, 10.0)
    assert claim.solved
    assert claim.z is not None
    assert np.abs(claim.z - lcpcli.run(problem).z).max() <= 1e-4


@pytest.mark.parametrize("name", ORTHANT_ONLY)
def test_solvers_for_nonnegative_z_are_given_no_bounds(name: str) -> None:
    assert peers.load(name).excludes(gallery.make("boxes", 5)) == "takes no bounds but z >= 0"
    assert peers.load(name).excludes(gallery.make("harker-pang", 5)) == ""
