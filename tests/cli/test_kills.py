"""Processes that are killed while they write lose nothing and leave nothing broken: a
few of the kills of benchmarks/kills.py."""

import sys
from importlib.util import find_spec

import pytest

from ..benchmarks import kills


@pytest.mark.slow("kills processes at random moments")
@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
@pytest.mark.parametrize(
    ("kind", "number"), [("file", 5), ("log", 5), ("bench", 5), ("kernels", 2)]
)
def test_killed_processes_lose_nothing(kind, number):
    if kind == "kernels" and find_spec("numba") is None:
        pytest.skip("there is no numba")
    assert kills.run(number, seed=1, names=[kind], tell=print) == number
