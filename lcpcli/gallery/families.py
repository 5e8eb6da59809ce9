"""Families of problems by name, imported on demand.

A family `f` is a function f(n, seed, *, parameters) -> Problem with about n unknowns, in the file of its theme or a new
file. The same arguments give the same numbers on any machine (up to rounding, if a product of matrices is not of
integers). Keyword-only parameters have defaults; a family without random entries calls its second argument _seed.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.errors import LONGEST_QUOTE, OptionError, ParameterError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

DEFAULT_SIZE = 10  # unknowns: few enough to be read
LARGEST_SIZE = 10**8  # unknowns; the vectors of a larger problem alone take gigabytes


class Entry(NamedTuple):
    """A family: its file, its meaning, the class of its matrices, and its number of unknowns if that is fixed."""

    file: str
    meaning: str
    matrices: str
    size: int | None = None


SPD = "symmetric positive definite"
SEMIDEFINITE = "positive semidefinite"
ANY = "any"
REGISTRY = {
    "harker-pang": Entry("random_problems", "random, dense (Harker and Pang 1990)", "positive definite"),
    "ill-scaled": Entry("random_problems", "harker-pang, badly scaled", "P"),
    "tridiagonal": Entry("random_problems", "tridiag(-1, 4, -1), random q", f"{SPD}, M"),
    "dominant": Entry("random_problems", "random, ten entries per row", "H+"),
    "obstacle": Entry("systems", "membrane over an obstacle on a square grid", f"{SPD}, M"),
    "two-obstacles": Entry("systems", "membrane between two obstacles, with bounds", f"{SPD}, M"),
    "torsion": Entry("systems", "elastic-plastic torsion of a bar, with bounds", f"{SPD}, M"),
    "journal-bearing": Entry("systems", "oil film with cavitation (Cryer 1971)", f"{SPD}, M"),
    "american-put": Entry("systems", "option pricing, one implicit time step", f"{SPD}, M"),
    "contact": Entry("systems", "rigid bodies with Coulomb friction", "copositive"),
    "rigid-boxes": Entry("rigid_bodies", "a time step of rigid boxes: tower, pyramid, heap, crushed", "copositive"),
    "bimatrix": Entry("systems", "random two-player game", "copositive"),
    "poker": Entry("systems", "poker with one card of each rank, a game tree", "copositive"),
    "bargaining": Entry("systems", "offers under incomplete information, a game tree", "copositive"),
    "circuit": Entry("systems", "bridge rectifiers with ideal diodes, free potentials", SEMIDEFINITE),
    "relays": Entry("systems", "switching system, with bounds", SEMIDEFINITE),
    "spatial-prices": Entry("systems", "trade between regions, free prices, flows with capacities", SEMIDEFINITE),
    "boxes": Entry("random_problems", "random, with bounds of every kind", SPD),
    "lp": Entry("programs", "random linear program and its dual", "skew-symmetric"),
    "qp": Entry("programs", "random convex quadratic program", SEMIDEFINITE),
    "portfolio": Entry("programs", "least variance with a factor model, a program", SEMIDEFINITE),
    "frontier": Entry("programs", "efficient frontier, as a target return or its weight varies", SEMIDEFINITE),
    "lasso": Entry("programs", "regularization path, as a penalty varies", SEMIDEFINITE),
    "control": Entry("programs", "masses and springs under bounded forces, a program", SEMIDEFINITE),
    "transport": Entry("programs", "least cost from plants to markets, a linear program", SEMIDEFINITE),
    "murty": Entry("random_problems", "exponential for least-index pivoting (Murty 1978)", f"P, {SEMIDEFINITE}"),
    "all-cones": Entry("random_problems", "line through all 2^n complementary cones", f"P, {SEMIDEFINITE}"),
    "fathi": Entry("random_problems", "exponential for Lemke's method (Fathi 1979)", SPD),
    "ben-gharbia-gilbert": Entry("random_problems", "plain Newton-min cycles (2012)", "P"),
    "curtis-han-robinson": Entry("random_problems", "plain active-set method cycles (2015)", SPD, 3),
    "kostreva": Entry(
        "random_problems", "Lemke's method cycles without a tie-breaking rule (1979)", "P, not positive definite"
    ),
    "growth": Entry("random_problems", "solution 1, 2, 4, ..., 2^(n-1)", "M"),
    "hilbert": Entry("random_problems", "Hilbert matrix, scaled to integers up to n = 18", SPD),
    "diagonal": Entry("random_problems", "diagonal matrix with entries over many decades", f"{SPD}, M"),
    "near-singular": Entry("random_problems", "smallest eigenvalue epsilon", SPD),
    "degenerate": Entry("random_problems", "z_i = w_i = 0 for half of the indices", SPD),
    "near-degenerate": Entry("random_problems", "max(z_i, w_i) = epsilon for half of the indices", SPD),
    "infeasible": Entry("random_problems", "no z >= 0 with Mz + q >= 0", "none"),
    "unsolvable": Entry("random_problems", "feasible, but without a solution", "none"),
    "planted": Entry("random_problems", "random, with a hidden solution", ANY),
    "gaussian": Entry("random_problems", "random M and q, with or without a solution", ANY),
    "indefinite": Entry("random_problems", "random, with a degenerate solution", ANY),
    "ray": Entry("random_problems", "solvable, but Lemke's method ends on a ray", "copositive"),
}
FAMILIES = {name: entry.meaning for name, entry in REGISTRY.items()}

Family = Callable[..., "Problem"]


def load(name: str) -> Family:
    family: Family = getattr(import_module(f"lcpcli.gallery.{entry(name).file}"), name.replace("-", "_"))
    return family


def entry(name: str) -> Entry:
    if name not in REGISTRY:
        raise OptionError(
            "family", f"{quoted(name)} is unknown", likely(name, FAMILIES, "lcp make --list shows the families")
        )
    return REGISTRY[name]


def is_random(name: str) -> bool:
    return "seed" in inspect.signature(load(name)).parameters


def parameters_of(name: str) -> dict[str, Any]:
    declared = inspect.signature(load(name)).parameters.values()
    return {p.name: p.default for p in declared if p.kind is p.KEYWORD_ONLY}


def make(name: str, n: int | None = None, seed: int = 0, **parameters: Any) -> Problem:
    """Return the problem of a family with about n unknowns; by default 10, or the family's own number.

    Raises OptionError if there is no such family, parameter, size or seed.
    """
    for parameter in parameters:
        refuse_unknown(name, parameter)
    size = entry(name).size
    n = size or DEFAULT_SIZE if n is None else n
    if not 1 <= n <= LARGEST_SIZE:
        raise ParameterError("n", "is out of range", f"give a whole number from 1 to {LARGEST_SIZE}")
    if size and n != size:
        raise ParameterError("n", f"is {n}, and {name} has {size} unknowns", "leave it out")
    if seed < 0:
        raise ParameterError("seed", "is negative", "give a whole number >= 0")
    return load(name)(n, seed, **parameters)


def refuse_unknown(name: str, parameter: str) -> None:
    known = parameters_of(name)
    if parameter not in known:
        hint = likely(parameter, known) if known else "leave it out"
        raise OptionError("parameters", f"{quoted(parameter)} is not a parameter of {name}", hint)


def require(parameter: str, value: float, fits: bool, admissible: str) -> None:
    """Raise OptionError for the parameter unless its value fits; `admissible` is the range as shown to the user."""
    if not fits:
        raise OptionError(parameter, f"{str(value)[:LONGEST_QUOTE]} is out of range", f"it must be: {admissible}")
