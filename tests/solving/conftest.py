"""The method that lies, and whether there is the extra `fast`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from lcpcli.solving import direct_run

from .liars import Liar


@pytest.fixture
def liar(monkeypatch: pytest.MonkeyPatch) -> Liar:
    return Liar(monkeypatch)


@pytest.fixture(params=["compiled", "numpy"])
def way(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[str]:
    """Whether there are kernels, which are then used from the first problem on."""
    monkeypatch.setattr(direct_run, "MANY", 0)
    if request.param == "numpy":
        monkeypatch.setattr(direct_run, "has_numba", lambda: False)
    direct_run.compiled.cache_clear()
    yield request.param
    direct_run.compiled.cache_clear()
