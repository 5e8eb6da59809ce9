"""Suites of cases by name. A case is a problem of the gallery, or one in a file.

Nothing heavy is imported, so that help can list the suites and the formats of a report.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

from lcpcli.files import contents

DEFAULT_METHODS = ("auto", "newton", "lemke", "fixed-point", "shi")


@dataclass(frozen=True)
class Case:
    """One problem, described so that it can be made again.

    name : unique within a bench.
    family, n, seed, parameters : the arguments of `gallery.make`; "", 0, 0 and none for a file. Nonlinear
        problems have no seed and no parameters.
    file, q_file : the paths of its file, and of the file of q if separate; "" for a problem of the gallery.
    infinity : bounds in its file of at least this size count as infinite; None if only infinite ones do.
    """

    name: str
    family: str = ""
    n: int = 0
    seed: int = 0
    parameters: dict[str, bool | int | float | str] = field(default_factory=dict)
    file: str = ""
    q_file: str = ""
    infinity: float | None = None


@dataclass(frozen=True)
class Suite:
    """Cases under one name.

    budget : default number of seconds for a measurement.
    ladders : whether the cases of each family are in order of stiffness, for a report on stability.
    over_time : whether the report shows what is solved within which time.
    methods : those that are measured by default.
    """

    meaning: str
    cases: tuple[Case, ...]
    budget: float = 2.0
    ladders: bool = False
    over_time: bool = False
    methods: tuple[str, ...] = DEFAULT_METHODS


def case(family: str, n: int, seed: int = 0, **parameters: Any) -> Case:
    """Return a case of the gallery, named after its arguments."""
    name = series(f"{family} {n}", {**parameters, **({"seed": seed} if seed else {})})
    return Case(name, family, n, seed, parameters)


def series(family: str, parameters: dict[str, Any]) -> str:
    """Return the common name of cases that differ only in size and seed."""
    words = (name if value is True else f"{name}={value}" for name, value in parameters.items())
    return " ".join([family, *words])


def sizes(family: str, *ns: int, **parameters: Any) -> tuple[Case, ...]:
    """Return cases of one family that differ in their size."""
    return tuple(case(family, n, **parameters) for n in ns)


SYMMETRIC = {"symmetric": True}
QUICK = (
    *sizes("harker-pang", 25, 50, 100),
    *sizes("obstacle", 100, 225, 400),
    case("tridiagonal", 300),
    case("ben-gharbia-gilbert", 51),
    case("curtis-han-robinson", 3),
    case("murty", 10),
    case("diagonal", 20, decades=6),
    case("bimatrix", 10),
    case("infeasible", 10),
)
PAPER = (
    *sizes("tridiagonal", 10, 100, 1000, 10_000),
    *sizes("dominant", 100, 300, 1000),
    *sizes("obstacle", 25, 100, 400),
    *sizes("journal-bearing", 25, 100, 400),
    *sizes("american-put", 25, 100, 400),
    *(case("near-singular", 100, epsilon=epsilon) for epsilon in (1e-1, 1e-2, 1e-3)),
    *(case("near-degenerate", 100, epsilon=epsilon) for epsilon in (1e-2, 1e-6)),
    *sizes("degenerate", 20, 50, 100),
    *sizes("ben-gharbia-gilbert", 5, 51, 201),
    *sizes("kostreva", 3, 51),
    *sizes("murty", 3, 6, 9),
    case("curtis-han-robinson", 3),
    case("hilbert", 4),
    case("diagonal", 20, decades=2),
    *sizes("qp", 10, 20),
)
DENSE = (
    *sizes("harker-pang", 50, 100, 200, 400, 800),
    *sizes("harker-pang", 50, 100, 200, 400, 800, symmetric=True),
    *sizes("bimatrix", 10, 20, 40),
    *sizes("contact", 50, 100, 200),
    *sizes("lp", 50, 100, 200),
    *sizes("qp", 50, 100, 200),
    *sizes("degenerate", 50, 100, 200),
)
SPARSE = (
    *sizes("obstacle", 900, 2500, 10_000, 40_000),
    *sizes("journal-bearing", 900, 2500, 10_000),
    *sizes("american-put", 1000, 3000, 10_000),
    *sizes("tridiagonal", 1000, 10_000, 100_000),
    *sizes("dominant", 300, 1000, 3000),  # its factors fill in; the time limit cannot stop a factorization
)
SPEED = (
    *(case("harker-pang", n, **kind) for n in (10, 300, 1000, 2000) for kind in (SYMMETRIC, {})),
    *sizes("obstacle", 10_000, 90_000),
)
STIFF = (
    *(case("diagonal", 50, decades=decades) for decades in (1, 2, 4, 8, 16, 50, 100, 150)),
    *(case("near-singular", 50, epsilon=epsilon) for epsilon in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
    *(case("near-degenerate", 50, epsilon=epsilon) for epsilon in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
    *(case("ill-scaled", 50, decades=decades) for decades in (1, 2, 4, 8, 16, 32, 50)),
    *sizes("hilbert", 2, 4, 6, 8, 10, 12, 14, 16, 20),
    *sizes("obstacle", 25, 100, 400, 2500, 10_000),
    *sizes("journal-bearing", 25, 100, 400, 2500),
    *sizes("american-put", 25, 100, 400, 3000),
)
EXTREME = (
    *sizes("growth", 10, 20, 30, 40, 50, 60),
    *sizes("murty", 5, 10, 20, 40, 100),
    *sizes("fathi", 5, 10, 15, 20, 100),
    *sizes("ben-gharbia-gilbert", 5, 51, 201),
    *sizes("kostreva", 3, 51),
    case("curtis-han-robinson", 3),
    *sizes("degenerate", 10, 50, 100),
    *sizes("bimatrix", 4, 10, 20, 40),
    *sizes("contact", 10, 50, 100),
    *sizes("lp", 10, 50, 100),
    *sizes("infeasible", 10, 50, 100),
    *sizes("unsolvable", 4, 10, 20),
    *sizes("ray", 4, 10, 20),
)
MIXED = (
    *sizes("two-obstacles", 100, 2500, 10_000, 90_000),
    *sizes("torsion", 100, 2500, 10_000),
    *sizes("circuit", 8, 80, 800, 8000),
    *sizes("relays", 10, 50, 200, 800),
    *sizes("spatial-prices", 24, 120, 1000),
    *sizes("boxes", 10, 100, 300, 1000),
)
HARD = (
    *(case("planted", n, seed) for n in (40, 60, 100, 200, 500) for seed in (0, 1)),
    *(case("planted", n, seed, entries=10) for n in (40, 100, 200, 500) for seed in (0, 1)),
    *(case("gaussian", n, seed) for n in (20, 30, 40) for seed in (0, 1)),
    *(case("indefinite", 100, seed, **kind) for kind in ({}, SYMMETRIC) for seed in (0, 1)),
    *(case("indefinite", 100, seed, strict=True, **kind) for kind in ({}, SYMMETRIC) for seed in (0, 1)),
    *(*sizes("circuit", 80), *sizes("relays", 50, 200), *sizes("spatial-prices", 120), *sizes("contact", 100)),
)
PROGRAMS = (
    *(
        Case(f"{name}.json", file=contents.shipped_path(f"programs/{name}.json"))
        for name in ("hs21", "hs35", "hs53", "hs76", "klee-minty", "portfolio", "transport")
    ),
    *sizes("portfolio", 100, 1000, 2500),
    *sizes("control", 100, 1000, 5000),
    *sizes("transport", 100, 1000, 10_000),
)
NONLINEAR = (
    *sizes("kojima-shindo", 4),
    *sizes("josephy", 4),
    *sizes("mathiesen", 4),
    *sizes("billups", 1),
    *sizes("nash-cournot", 5, 10),
    *sizes("scarf", 19),
    *sizes("bratu", 289, 5625),
    *sizes("elastohydrodynamic", 41, 101),
)
SUITES = {
    "quick": Suite("a little of everything, in under a minute", QUICK, budget=0.5),
    "paper": Suite("fixed-point and shi on more than the paper's examples", PAPER, budget=0.5),
    "dense": Suite("dense problems up to n = 800", DENSE),
    "sparse": Suite("sparse problems up to n = 100,000", SPARSE),
    "mixed": Suite("problems with bounds, free variables and equations", MIXED),
    "hard": Suite("problems without a structure to rely on, and models: solved over time", HARD, 0.0, over_time=True),
    "programs": Suite("linear and quadratic programs", PROGRAMS),
    "nonlinear": Suite("nonlinear problems of the literature", NONLINEAR, methods=("josephy-newton",)),
    "speed": Suite("the problems of lcp help speed: small and large, dense and sparse", SPEED),
    "stiff": Suite("ill-conditioned, badly scaled and nearly degenerate problems", STIFF, 0.0, ladders=True),
    "extreme": Suite("problems constructed to defeat a method, and problems without a solution", EXTREME, 0.0, True),
}
ALL = "all"
GONE = {  # suites of earlier versions
    "path": "run tests/benchmarks/paths.py of the source instead",
    "sequences": "run tests/benchmarks/steps.py of the source instead",
}


def budget_of(asked: Sequence[str]) -> float:
    """Return the default number of seconds for a measurement."""
    return max(SUITES[name].budget if name in SUITES else Suite.budget for name in asked)


def methods_of(asked: Sequence[str]) -> list[str]:
    """Return the methods that are measured by default."""
    own = (SUITES[name].methods if name in SUITES else Suite.methods for name in asked)
    return list(dict.fromkeys(chain.from_iterable(own)))
