"""Families of problems by name, imported when they are asked for. A family `f` is the function f in the module f.

A family is a function (n, seed, *, parameters) -> Problem of about n unknowns: the same numbers for the same arguments,
whatever the machine (to rounding, where a product of matrices is not of integers). Its keyword-only parameters have
defaults; one whose numbers are fixed calls its second argument _seed. Its module opens with the source, which stands in
SOURCE too, and tells in CLASS to which class its matrices belong; SIZE is there if it is of one size only.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from lcpcli.errors import OptionError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

FAMILIES = {
    "harker-pang": "random, dense (Harker and Pang 1990)",
    "ill-scaled": "harker-pang in mixed units",
    "tridiagonal": "tridiag(-1, 4, -1), random q",
    "dominant": "random, ten entries a row",
    "obstacle": "membrane over an obstacle on a square grid",
    "journal-bearing": "oil film that breaks (Cryer 1971)",
    "american-put": "one time step of an option's price",
    "contact": "rigid bodies with Coulomb friction",
    "bimatrix": "random two-player game",
    "lp": "random linear program with its dual",
    "qp": "random convex quadratic program",
    "murty": "exponential for least-index pivoting (Murty 1978)",
    "fathi": "exponential for Lemke's method (Fathi 1979)",
    "ben-gharbia-gilbert": "plain Newton cycles (2012)",
    "curtis-han-robinson": "plain active sets cycle (2015)",
    "kostreva": "Lemke's method cycles without a rule for ties (1979)",
    "growth": "solution 1, 2, 4, ..., 2^(n-1)",
    "hilbert": "Hilbert matrix, in integers up to n = 18",
    "diagonal": "diagonal over many decades",
    "near-singular": "smallest eigenvalue epsilon",
    "degenerate": "z_i = w_i = 0 in half of the places",
    "near-degenerate": "max(z_i, w_i) = epsilon in half of the places",
    "infeasible": "no z >= 0 with Mz + q >= 0",
    "unsolvable": "feasible, no solution",
    "ray": "solvable, Lemke's method ends on a ray",
}
DEFAULT_SIZE = 10
LARGEST_SIZE = 10**8

Family = Callable[..., "Problem"]


def load(name: str) -> Family:
    """The family of that name."""
    family: Family = getattr(_module(name), name.replace("-", "_"))
    return family


def class_of(name: str) -> str:
    """The class of the matrices of a family, in words."""
    words: str = _module(name).CLASS
    return words


def fixed_size(name: str) -> int | None:
    """The number of unknowns of a family that has one size only, else None."""
    size: int | None = getattr(_module(name), "SIZE", None)
    return size


def is_random(name: str) -> bool:
    """Whether a family's numbers depend on the seed."""
    return "seed" in inspect.signature(load(name)).parameters


def parameters_of(name: str) -> dict[str, Any]:
    """A family's own parameters with their defaults."""
    declared = inspect.signature(load(name)).parameters.values()
    return {p.name: p.default for p in declared if p.kind is p.KEYWORD_ONLY}


def make(name: str, n: int | None = None, seed: int = 0, **parameters: Any) -> Problem:
    """The problem of a family with about n unknowns; by default 10, or as many as the family has.

    Raises OptionError if there is no such family, parameter, size or seed.
    """
    for parameter in parameters:
        refuse_unknown(name, parameter)
    size = fixed_size(name)
    if n is None:
        n = size or DEFAULT_SIZE
    if not 1 <= n <= LARGEST_SIZE:
        raise OptionError("-n", "is out of range", f"give a whole number from 1 to {LARGEST_SIZE}")
    if size and n != size:
        raise OptionError("-n", f"is {n}, and {name} has {size} unknowns", "leave it out")
    if seed < 0:
        raise OptionError("--seed", "is negative", "give a whole number >= 0")
    return load(name)(n, seed, **parameters)


def refuse_unknown(name: str, parameter: str) -> None:
    """Raise OptionError unless the family has a parameter of that name."""
    known = parameters_of(name)
    if parameter not in known:
        mend = likely(parameter, known) if known else "leave it out"
        raise OptionError("parameter", f"{name} has no {quoted(parameter)}", mend)


def _module(name: str) -> ModuleType:
    if name not in FAMILIES:
        raise OptionError("family", f"{quoted(name)} is unknown", likely(name, FAMILIES))
    return import_module(f"lcpcli.gallery.{name.replace('-', '_')}")
