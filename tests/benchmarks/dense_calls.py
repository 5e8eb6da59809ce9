"""One call of `lcpcli.solve` from arrays to the verified answer, for dense M: dense_calls.py [n ...]

Medians of repeated calls on positive definite problems (Harker and Pang 1990), nonsymmetric and symmetric; where the
time goes; and the distance from the work that cannot be avoided: one factorization of the final block M_PP, one copy of
it, one product with M. Seconds are by the wall, around the call.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
from scipy.linalg import lapack

import lcpcli
from lcpcli.gallery import families

SIZES = (5, 10, 50, 300, 1000, 2000)
BUDGET, LEAST, MOST = 2.0, 5, 2000  # seconds and repetitions for each median
WIDTHS = (5, 10, 10, 7, 11, 13, 10, 9)
HEADER = ("n", "symmetric", "call", "set-up", "iterations", "verification", "limit", "distance")


def median(call: Callable[[], Any]) -> float:
    call()
    times: list[float] = []
    began = time.perf_counter()
    while len(times) < LEAST or (len(times) < MOST and time.perf_counter() - began < BUDGET):
        before = time.perf_counter()
        call()
        times.append(time.perf_counter() - before)
    return statistics.median(times)


def limit(M: Any, P: Any, symmetric: bool) -> float:
    block, v = M[np.ix_(P, P)], np.ones(M.shape[0])
    factorize = partial(lapack.dpotrf, lower=True, clean=False) if symmetric else lapack.dgetrf
    return median(lambda: factorize(block.T)) + median(lambda: M[P][:, P]) + median(lambda: M @ v)


def row(n: int, symmetric: bool) -> list[str]:
    problem, results = families.make("harker-pang", n, 0, symmetric=symmetric), list[lcpcli.Result]()

    def call() -> None:
        results.append(lcpcli.solve(problem.M, problem.q))

    seconds = median(call)
    assert all(result.solved for result in results)
    totals = [sum(result.parts[part] for result in results) for part in ("setup", "solve", "verify")]
    shares = [f"{100 * total / sum(totals):.0f} %" for total in totals]
    least = limit(problem.M, np.flatnonzero(results[-1].z), symmetric)
    times = [f"{1e6 * t:.0f} us" for t in (seconds, least)]
    return [str(n), "yes" if symmetric else "no", times[0], *shares, times[1], f"{seconds / least:.1f}"]


def main() -> None:
    sizes = [int(word) for word in sys.argv[1:]] or SIZES
    for cells in chain([HEADER], (row(n, symmetric) for n in sizes for symmetric in (False, True))):
        print("  ".join(cell.rjust(width) for cell, width in zip(cells, WIDTHS, strict=True)), flush=True)


if __name__ == "__main__":
    main()
