"""Sequences with one M, each q solved from the last z by a Solver, beside each problem
alone."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import populations
from record import Case, hash_of, main

from lcpcli import Problem, Solver, run

STEPS, SEQUENCES = 12, 40
FAMILIES = (
    "american-put",
    "tridiagonal",
    "obstacle",
    "boxes",
    "spatial-prices",
    "rigid-boxes",
    "lp",
    "qp",
)


class Sequence(NamedTuple):
    """A problem, and the right-hand sides that follow."""

    like: Problem
    q: Any


def cases(seed):
    """Return sequences of each family, with steps of different sizes."""
    found = []
    for k in range(SEQUENCES):
        family, n = FAMILIES[k % len(FAMILIES)], (12, 40, 100)[k % 3]
        found.append(Case(f"{family} {n} {k}", partial(_sequence, family, n, seed, k)))
    return found


def _sequence(family, n, seed, k):
    like = populations.gallery(family, n, seed)
    random = np.random.default_rng([seed, k])
    steps = np.cumsum(random.standard_normal((STEPS, like.n)), axis=0) * 10.0 ** -(
        1 + k % 4
    )
    return Sequence(like, like.q * (1 + steps))


def outcome(_, sequence):
    """Return statuses and states of all steps; a step is false if it ends otherwise
    than the problem alone."""
    like, Q = sequence
    solver = Solver(like.M, lower=like.lower, upper=like.upper)
    results = [solver.solve(q) for q in Q]
    alone = [run(Problem(like.M, q, lower=like.lower, upper=like.upper)) for q in Q]
    words = [result.status.word for result in results]
    entry = {
        "status": "+".join(sorted(set(words))),
        "words": words,
        "steps": [r.iterations for r in results],
    }
    entry["states"] = hash_of(
        *([len(word) for word in result.basis] for result in results)
    )
    different = [
        k
        for k, (a, b) in enumerate(zip(results, alone, strict=True))
        if a.solved != b.solved
    ]
    if different:
        entry["false"] = f"steps {different} end otherwise than alone"
    return entry


if __name__ == "__main__":
    main(cases, outcome)
