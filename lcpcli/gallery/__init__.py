"""Families of problems by name, imported when they are asked for. A family `f` is the function f in the module f.

A family is a function (n, seed, *, parameters) -> Problem of about n unknowns: the same numbers for the same arguments,
whatever the machine. Its keyword-only parameters have defaults. Its module opens with the source, and tells in CLASS to
which class its matrices belong.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lcpcli.errors import OptionError

if TYPE_CHECKING:
    from lcpcli.problem import Problem

FAMILIES = {
    "harker-pang": "random, dense, positive definite (Harker and Pang 1990)",
}

Family = Callable[..., "Problem"]


def load(name: str) -> Family:
    """The family of that name."""
    if name not in FAMILIES:
        close = get_close_matches(name.casefold(), FAMILIES, n=1)
        mend = f"did you mean {close[0]}?" if close else f"choose one of {', '.join(FAMILIES)}"
        raise OptionError("family", f"{name!r} is unknown", mend)
    module = name.replace("-", "_")
    family: Family = getattr(import_module(f"lcpcli.gallery.{module}"), module)
    return family


def class_of(name: str) -> str:
    """The class of the matrices of a family, in words."""
    words: str = import_module(load(name).__module__).CLASS
    return words


def parameters_of(name: str) -> dict[str, Any]:
    """A family's own parameters with their defaults."""
    declared = inspect.signature(load(name)).parameters.values()
    return {p.name: p.default for p in declared if p.kind is p.KEYWORD_ONLY}


def make(name: str, n: int, seed: int = 0, **parameters: Any) -> Problem:
    """The problem of a family with about n unknowns.

    Raises OptionError if there is no such family, parameter or size.
    """
    known = parameters_of(name)
    for parameter in parameters:
        if parameter not in known:
            mend = f"it has {', '.join(known)}" if known else "leave it out"
            raise OptionError(parameter, f"is no parameter of {name}", mend)
    if n < 1:
        raise OptionError("-n", f"is {n}", "give a whole number >= 1")
    return load(name)(n, seed, **parameters)
