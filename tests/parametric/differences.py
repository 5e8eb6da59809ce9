"""Random mixed problems, directions for their data, and the differences of exact solutions in them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.random import Generator

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.matrices import dense
from lcpcli.typing import Vector

from .. import mixed_problems

DATA = ("M", "q", "lower", "upper")
SCALE = 64  # data and changes are multiples of 1 / SCALE: with a STEP that is a power of 2, nothing is rounded
STEP = 2.0**-24


def rounded(values: Vector) -> Vector:
    return np.rint(SCALE * values) / SCALE


def random_problem(n: int, random: Generator, mixed: bool) -> Problem:
    """M is positive definite, not symmetric; if mixed with bounds of all kinds, fixed and free variables too."""
    M, q = mixed_problems.monotone(n, random)
    if not mixed:
        return Problem(rounded(M) + np.eye(n), rounded(q))
    lower, upper = map(rounded, mixed_problems.with_all_bounds(n, random))
    return Problem(rounded(M) + np.eye(n), rounded(q), lower=lower, upper=upper)


def random_change(problem: Problem, random: Generator) -> dict[str, Vector]:
    """A direction for all data; bounds that do not exist stay, and those of fixed variables move together."""
    n, (low, high) = problem.n, problem.box.vectors(problem.n)
    moves = rounded(random.normal(size=(2, n)))
    moves[1, low == high] = moves[0, low == high]
    moves[np.isinf((low, high))] = 0.0
    return {"dM": rounded(random.normal(size=(n, n))), "dq": rounded(random.normal(size=n))} | {
        "dlower": moves[0],
        "dupper": moves[1],
    }


def exact_z(problem: Problem, change: dict[str, Vector], h: float) -> list[Fraction]:
    """The solution in fractions of the problem with its data plus h times the change, which doubles represent."""
    data = dict(zip(DATA, (dense(problem.M), problem.q, *problem.box.vectors(problem.n)), strict=True))
    z = lcpcli.exact(Problem(**{name: data[name] + h * change.get(f"d{name}", 0.0) for name in DATA})).exact
    assert z is not None
    assert z.z is not None
    return z.z


def exact_derivative(problem: Problem, change: dict[str, Vector], h: float = STEP) -> Vector:
    """The central difference of exact solutions: exact for changes of q and of bounds, else with an error of h^2."""
    ends = zip(exact_z(problem, change, h), exact_z(problem, change, -h), strict=True)
    return np.array([float((a - b) / Fraction(2 * h)) for a, b in ends])
