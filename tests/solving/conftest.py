"""The method that lies, and whether there is the extra `fast`."""

import numpy as np
import pytest

import lcpcli
from lcpcli.solving import direct_run

from .liars import Liar


@pytest.fixture
def liar(monkeypatch):
    return Liar(monkeypatch)


@pytest.fixture(params=["compiled", "numpy"])
def way(request, monkeypatch):
    """Whether there are kernels, which are then used from the first problem on."""
    if request.param == "compiled":  # which is the same as the other one without it
        pytest.importorskip("numba")
    monkeypatch.setattr(direct_run, "MANY", 0)
    if request.param == "numpy":
        monkeypatch.setattr(direct_run, "has_numba", lambda: False)
    direct_run.compiled.cache_clear()
    yield request.param
    direct_run.compiled.cache_clear()


def assert_same(ours, theirs):
    """A result of many and one of the problem alone, but for the time."""
    assert ours.status == theirs.status
    assert ours.method == theirs.method
    assert ours.message == theirs.message
    assert np.allclose(
        ours.z, theirs.z, rtol=1e-9, atol=1e-10 * float(np.abs(theirs.z).max())
    )
    assert ours.basis == theirs.basis
    assert ours.relative_residual <= ours.limits.tol
    largest = float(np.abs(theirs.problem.q).max()) + float(
        np.abs(theirs.problem.M).max() * np.abs(ours.z).max()
    )
    assert (
        abs(ours.residual - lcpcli.check(theirs.problem, ours.z).residual)
        <= 1e-14 * largest
    )
    assert ours.limits == theirs.limits
    assert ours.options | {"compiled": True} == theirs.options | {"compiled": True}, (
        "with the kernels or without"
    )
    assert list(ours.to_dict()) == list(theirs.to_dict())
    assert min(ours.parts.values()) >= 0.0 < ours.seconds
    assert ours.parts.keys() == theirs.parts.keys()
