"""A solve with the gradient of a function of z beside the solve alone: gradients.py [n]

Medians of calls of `lcpcli.solve` from arrays, without and with `Result.gradient(g).q`, and with `.M` as well, a full
matrix; in turns, so that what disturbs one disturbs the others. Dense P-matrices of the gallery, by default n = 300.
"""

from __future__ import annotations

import statistics
import sys
import time
from functools import partial
from typing import Any

import numpy as np

import lcpcli
from lcpcli.gallery import families
from lcpcli.linalg.matrices import dense

FAMILIES, SEEDS, REPETITIONS = ("harker-pang", "dominant", "near-singular", "ill-scaled"), 3, 300


def called(M: Any, q: Any, g: Any, *parts: str) -> None:
    """Solve the problem and read these parts of the gradient."""
    result = lcpcli.solve(M, q)
    if parts:
        gradient = result.gradient(g)
        for part in parts:
            getattr(gradient, part)


def main(n: int = 300) -> None:
    print(f"{'problem':14}{'seed':>5}{'solve/us':>10}{'with q':>8}{'with q, M':>11}")
    for name in FAMILIES:
        for seed in range(SEEDS):
            problem = families.make(name, n, seed)
            M, q, g = dense(problem.M).copy(), problem.q.copy(), np.ones(n)
            calls = [partial(called, M, q, g, *parts) for parts in ((), ("q",), ("q", "M"))]
            times: list[list[float]] = [[] for _ in calls]
            for _ in range(REPETITIONS):
                for call, own in zip(calls, times, strict=True):
                    began = time.perf_counter()
                    call()
                    own.append(time.perf_counter() - began)
            alone, with_q, with_M = (statistics.median(own) for own in times)
            print(f"{name:14}{seed:5}{1e6 * alone:10.0f}{with_q / alone:8.2f}{with_M / alone:11.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
