# ruff: noqa: ARG001 (every method has both arguments)
"""The methods of this package keep the contract of methods, and each way to break it is found."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from lcpcli.methods.registry import METHODS, Method
from lcpcli.methods.stages import Finished, Iterate
from lcpcli.options import Option
from lcpcli.solving.contract import check_method


@pytest.mark.parametrize("name", METHODS)
def test_the_methods_of_this_package_keep_it(name: str) -> None:
    check_method(name)


def good(problem: Any, x0: Any) -> Any:
    x = x0 + 1.0
    yield Iterate(x, None, "", 1)
    yield Iterate(x + 1, None, "", 2)
    return Finished()


def changes_q(problem: Any, x0: Any) -> Any:
    problem.q.flags.writeable = True
    problem.q[0] += 1.0
    return (yield from good(problem, x0))


def reuses_its_array(problem: Any, x0: Any) -> Any:
    for k in range(3):
        x0 += k
        yield Iterate(x0, None, "", k)
    return Finished()


def counts_down(problem: Any, x0: Any) -> Any:
    yield Iterate(x0 + 1, None, "", 2)
    yield Iterate(x0 + 2, None, "", 1)
    return Finished()


def draws_lots(problem: Any, x0: Any) -> Any:
    yield Iterate(np.random.default_rng().random(problem.n), None, "", 1)
    return Finished()


def returns_nothing(problem: Any, x0: Any) -> Any:
    yield Iterate(x0, None, "", 1)


def is_undefined(problem: Any, x0: Any) -> Any:
    yield Iterate(np.full(problem.n, np.nan), None, "", 1)


def yields_a_list(problem: Any, x0: Any) -> Any:
    yield Iterate(x0.tolist(), None, "", 1)


def counts_nothing(problem: Any, x0: Any) -> Any:
    yield Iterate(x0, None, "", None)  # type: ignore[arg-type]


def raises(problem: Any, x0: Any) -> Any:
    yield from good(problem, x0)
    raise KeyError("no such key")


def takes_an_option(problem: Any, x0: Any, *, sweeps: int) -> Any:
    return good(problem, x0)


FAULTS = [
    (changes_q, "changes M or q"),
    (reuses_its_array, "changes an array that it has yielded"),
    (counts_down, "counts fewer evaluations than before"),
    (draws_lots, "yields other iterates when it is run again"),
    (is_undefined, "yields an x with nan"),
    (yields_a_list, "yields an x that is not an array of numbers"),
    (counts_nothing, "counts None evaluations"),
    (raises, "raises KeyError: 'no such key'"),
    (takes_an_option, "takes the options ['sweeps'], but declares []"),
    (returns_nothing, "yields or returns None"),
]


def declare(monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any], **declared: Any) -> None:
    """Declare a method of a package toys as a function of a module of it."""
    module = ModuleType("toys.methods")
    function.__module__ = "toys.methods"
    setattr(module, "toy", function)  # noqa: B010
    monkeypatch.setitem(sys.modules, "toys.methods", module)
    monkeypatch.setitem(METHODS, "toy", Method("a toy", location=("toys.methods", "toy"), **declared))


@pytest.mark.parametrize(("function", "fault"), FAULTS)
def test_each_fault_is_named(function: Callable[..., Any], fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(monkeypatch, function, uses_start=True)
    with pytest.raises(AssertionError) as error:
        check_method("toy")
    assert fault in str(error.value)


def test_a_start_that_matters_is_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    def steps(problem: Any, x0: Any) -> Any:
        while True:
            yield Iterate(x0 + 1.0, None, "", 1)

    declare(monkeypatch, steps)
    with pytest.raises(AssertionError, match="depends on the start, but does not declare uses_start"):
        check_method("toy")
    declare(monkeypatch, steps, uses_start=True)
    check_method("toy")


def test_a_default_is_in_its_range(monkeypatch: pytest.MonkeyPatch) -> None:
    def steps(problem: Any, x0: Any, *, sweeps: int) -> Any:
        while True:
            yield Iterate(x0 + sweeps, None, "", 1)

    for default in (1, 0):
        option = Option("sweeps", int, default, "whole number >= 1", lambda number: number >= 1, "Sweeps.")
        declare(monkeypatch, steps, uses_start=True, options=(option,))
        if default:
            check_method("toy")
        else:
            with pytest.raises(AssertionError, match="0 is out of range"):
                check_method("toy")
