"""Runs that are compared are repeated once in these tests, which do not look at how exact their times are."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _few_repetitions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lcpcli.solving.driver.MOST_REPETITIONS", 1)
