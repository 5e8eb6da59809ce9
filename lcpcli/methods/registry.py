"""The methods by name, imported when they are asked for. A method `m` is the function m in the module of that name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any

from lcpcli.errors import OptionError, likely
from lcpcli.options import OPTIONS, flag

if TYPE_CHECKING:
    from lcpcli.methods.iterate import Iterate
    from lcpcli.model.problem import Problem

METHODS = {
    "auto": "whatever solves the problem first, or proves that it has no solution",
    "shi": "smoothed vector divisions (El foutayeni and Khaladi 2012, after Shi 2008)",
    "fixed-point": "modulus iteration (Schäfer 2004)",
    "newton": "generalized Newton, safeguarded block principal pivoting (Kostreva 1978; Júdice and Pires 1994)",
    "lemke": "complementary pivoting (Lemke 1965)",
    "milp": "mixed-integer program (Pardalos and Rosen 1988)",
}

ITERATIVE = ("shi", "fixed-point")  # the methods that equilibration and finishing may be added to
STARTED = ("auto", "shi", "fixed-point", "newton")  # the methods to which it matters where they start
ADDITIONS = ("scale", "finish")

Method = Callable[..., "Iterator[Iterate]"]


def load(name: str) -> Method:
    """The method of that name: a function (problem, x0, *, options) that checks its options and returns an iterator."""
    if name not in METHODS:
        raise OptionError("method", f"{name!r} is unknown", likely(str(name), METHODS))
    function = name.replace("-", "_")
    module = "auto.policy" if name == "auto" else function
    method: Method = getattr(import_module(f"lcpcli.methods.{module}"), function)
    return method


def options_of(method: Method) -> list[str]:
    """The options that have an effect on a method: its keyword-only parameters."""
    parameters = inspect.signature(method).parameters.values()
    return [parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY]


def options_in_force(method: Method, problem: Problem, chosen: dict[str, Any]) -> dict[str, Any]:
    """All of a method's options with their values: chosen, default, or derived from the problem by the method's module.

    Raises OptionError for a chosen option that has no effect on the method.
    """
    known = options_of(method)
    for name in chosen:
        if name not in OPTIONS and name not in known:
            raise OptionError(name, "is no option of a method", f"there are {', '.join(known)}")
        if name not in known:
            raise OptionError(
                flag(name), f"has no effect with the method {method.__name__.replace('_', '-')}", "leave it out"
            )
    parameters = inspect.signature(method).parameters
    values = {name: chosen.get(name, parameters[name].default) for name in known}
    module = import_module(method.__module__)
    for name, value in values.items():
        if value is None and hasattr(module, f"default_{name}"):
            values[name] = getattr(module, f"default_{name}")(problem)
    return values
