"""Iterates of the published methods, bit by bit: shi, fixed-point, newton, lemke and
interior, with their options."""

from functools import partial

import numpy as np
import populations
from record import GENEROUS_SECONDS, Case, exact, hash_of, main, of_result

from lcpcli import Problem, run

STEPS = 300  # at most; the others end by themselves
CALLS = {
    "newton": ("newton", {}),
    "newton from 1": ("newton", {"z0": 1.0}),
    "lemke": ("lemke", {}),
    "lemke ones": ("lemke", {"cover": "ones"}),
    "interior": ("interior", {}),
    "fixed-point": ("fixed-point", {}),
    "fixed-point scaled": ("fixed-point", {"scale": True}),
    "fixed-point finished": ("fixed-point", {"finish": True}),
    "shi": ("shi", {}),
    "shi p=10": ("shi", {"p": 10}),
    "shi scaled": ("shi", {"scale": True}),
    "shi finished": ("shi", {"finish": True}),
}
FAMILIES = (
    "harker-pang",
    "tridiagonal",
    "obstacle",
    "contact",
    "murty",
    "kostreva",
    "degenerate",
    "ill-scaled",
    "boxes",
)
RANDOM = 150  # random problems
TIED = 20  # problems in small integers with q = -e, in which many rows block at once


def cases(seed):
    """Return each call with each problem."""
    problems = {
        f"{f} {n}": partial(populations.gallery, f, n, seed)
        for f in FAMILIES
        for n in (5, 20)
    }
    problems |= {
        f"random {k}": partial(exact.random_problem, 1000 * seed + k, 12)
        for k in range(RANDOM)
    }
    problems |= {f"tied {k}": partial(_tied, 1000 * seed + k) for k in range(TIED)}
    return [
        Case(f"{call}: {name}", make)
        for name, make in problems.items()
        for call in CALLS
    ]


def _tied(seed):
    random = np.random.default_rng(seed)
    n = int(random.integers(3, 9))
    return Problem(random.integers(0, 3, (n, n)) + np.eye(n), -np.ones(n))


def outcome(case, problem):
    """Return a hash of all iterates, and how the run ended."""
    method, options = CALLS[case.key.split(": ")[0]]
    if "z0" in options:
        options = {"z0": [options["z0"]] * problem.n}
    result = run(
        problem,
        method,
        trace=True,
        max_iterations=STEPS,
        time_limit=GENEROUS_SECONDS,
        **options,
    )
    rows = result.trace.rows
    return of_result(result) | {
        "steps": hash_of([len(rows)], [sum(map(ord, row.step)) for row in rows]),
        "iterates": hash_of(*(row.z for row in rows)),
        "exact z": hash_of(result.z),
    }


if __name__ == "__main__":
    main(cases, outcome)
