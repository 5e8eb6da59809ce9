"""Contact of rigid boxes with friction, at rest and moving, n = 4 to 200: each step by
solve, kernels and Solver."""

from functools import cache, partial
from typing import NamedTuple

import numpy as np
import populations
import truth
from record import GENEROUS_SECONDS, Case, main, of_result

from lcpcli import Problem, Solver, run

SIZES, STEPS = (4, 8, 12, 16, 20, 32, 48, 100, 200), 12
MAX_JUDGED = 20  # unknowns of a problem that is judged in fractions
WAYS = ("solve", "compiled", "Solver")


class Step(NamedTuple):
    """A problem, and how it is solved."""

    problem: Problem
    way: str


def cases(seed):
    """Return steps with the contacts of a heap of boxes, at rest and moving, by each
    way."""
    return [
        Case(f"{kind} {n} {k} {way}", partial(_step, n, kind, seed, k, way))
        for n in SIZES
        for k in range(STEPS)
        for kind in [("moving", "rest")[k % 2]]
        for way in WAYS
    ]


@cache
def _contacts(n, seed):
    return populations.gallery("rigid-boxes", n, seed)


def _step(n, kind, seed, k, way):
    """Return a step: at rest, rows that move have rounding alone in q, and the others
    are loaded as before."""
    like, random = _contacts(n, seed), np.random.default_rng([seed, n, k])
    q = np.array(like.q)
    if kind == "rest":
        q = np.where(
            np.abs(q) < np.abs(q).max() / 4, 1e-17 * random.standard_normal(like.n), q
        )
    return Step(Problem(like.M, q * (1 + 0.05 * random.random())), way)


def outcome(_, step):
    """Return what is compared, and for few unknowns what it is worth."""
    problem, way = step
    if way == "Solver":
        solver = Solver(problem.M)
        solver.solve(1.01 * problem.q)
        result = solver.solve(problem.q)
    else:
        result = run(problem, time_limit=GENEROUS_SECONDS, compiled=way == "compiled")
    entry = of_result(result)
    return truth.judged(problem, entry) if problem.n <= MAX_JUDGED else entry


if __name__ == "__main__":
    main(cases, outcome)
