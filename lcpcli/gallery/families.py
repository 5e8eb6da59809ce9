"""Families of problems by name, imported on demand. A family `f` is the function f in the module f.

A family is a function (n, seed, *, parameters) -> Problem of about n unknowns: the same numbers for the same arguments
on any machine (up to rounding, where a product of matrices is not of integers). Its keyword-only parameters have
defaults; a family without random entries calls its second argument _seed. Its module opens with the source, repeated
in SOURCE; CLASS is the class of its matrices, and SIZE the number of unknowns if it is fixed.
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
    "ill-scaled": "harker-pang, badly scaled",
    "tridiagonal": "tridiag(-1, 4, -1), random q",
    "dominant": "random, ten entries per row",
    "obstacle": "membrane over an obstacle on a square grid",
    "two-obstacles": "membrane between two obstacles, with bounds",
    "torsion": "elastic-plastic torsion of a bar, with bounds",
    "journal-bearing": "oil film with cavitation (Cryer 1971)",
    "american-put": "option pricing, one implicit time step",
    "contact": "rigid bodies with Coulomb friction",
    "bimatrix": "random two-player game",
    "circuit": "bridge rectifiers with ideal diodes, free potentials",
    "relays": "switching system, with bounds",
    "spatial-prices": "trade between regions, free prices, flows with capacities",
    "boxes": "random, with bounds of every kind",
    "lp": "random linear program and its dual",
    "qp": "random convex quadratic program",
    "portfolio": "least variance with a factor model, a program",
    "control": "masses and springs under bounded forces, a program",
    "transport": "least cost from plants to markets, a linear program",
    "murty": "exponential for least-index pivoting (Murty 1978)",
    "fathi": "exponential for Lemke's method (Fathi 1979)",
    "ben-gharbia-gilbert": "plain Newton-min cycles (2012)",
    "curtis-han-robinson": "plain active-set method cycles (2015)",
    "kostreva": "Lemke's method cycles without a tie-breaking rule (1979)",
    "growth": "solution 1, 2, 4, ..., 2^(n-1)",
    "hilbert": "Hilbert matrix, scaled to integers up to n = 18",
    "diagonal": "diagonal matrix with entries over many decades",
    "near-singular": "smallest eigenvalue epsilon",
    "degenerate": "z_i = w_i = 0 for half of the indices",
    "near-degenerate": "max(z_i, w_i) = epsilon for half of the indices",
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
    """The number of unknowns of a family of fixed size, else None."""
    size: int | None = getattr(_module(name), "SIZE", None)
    return size


def is_random(name: str) -> bool:
    """Whether a family depends on the seed."""
    return "seed" in inspect.signature(load(name)).parameters


def parameters_of(name: str) -> dict[str, Any]:
    """A family's own parameters with their defaults."""
    declared = inspect.signature(load(name)).parameters.values()
    return {p.name: p.default for p in declared if p.kind is p.KEYWORD_ONLY}


def make(name: str, n: int | None = None, seed: int = 0, **parameters: Any) -> Problem:
    """The problem of a family with about n unknowns; by default 10, or the family's own number.

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
        hint = likely(parameter, known) if known else "leave it out"
        raise OptionError("parameter", f"{name} has no {quoted(parameter)}", hint)


def _module(name: str) -> ModuleType:
    if name not in FAMILIES:
        raise OptionError("family", f"{quoted(name)} is unknown", likely(name, FAMILIES))
    return import_module(f"lcpcli.gallery.{name.replace('-', '_')}")
