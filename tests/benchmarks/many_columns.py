"""One M with many right-hand sides, from arrays in memory to verified results:
many_columns.py [k]

Microseconds for each of k problems, 10000 by default. First LCPs with P-matrices that
are not definite, dominant (H+) and not, by a loop of `solve`, by `solve_many` and by
QuantEcon's compiled `lcp_lemke`; then nonnegative least squares, min |A x - b| over x
>= 0, by `solve_many` with M = A'A and q = -A'b, whose computation counts, and by
scipy's `nnls`. All in one thread, each the least of some repeats by the wall; slow
loops over some of the columns.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import math
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from measuring import in_turns, show
from quantecon.optimize import lcp_lemke
from scipy.optimize import nnls

import lcpcli

SIZES = (10, 50, 200)
ROWS, UNKNOWNS = 300, 40  # of A
REPEATS, SAMPLE = 5, 500  # SAMPLE: columns of the slow loops
WIDTHS = (22, 5, 12, 8, 12, 12, 10)
Vector = np.ndarray[Any, np.dtype[np.float64]]


def h_plus(n: int, generator: np.random.Generator) -> Vector:
    """Random entries, and a diagonal that dominates them by a tenth."""
    M = generator.standard_normal((n, n))
    np.fill_diagonal(M, 0.0)
    np.fill_diagonal(M, 1.1 * np.abs(M).sum(axis=1) + 0.1)
    return M


def definite(n: int, generator: np.random.Generator) -> Vector:
    """A definite matrix that is far from symmetric, and not dominant."""
    A, B = generator.standard_normal((2, n, n))
    return A @ A.T / n + 0.1 * np.eye(n) + (B - B.T) / math.sqrt(n)


def problems(
    family: Callable[[int, np.random.Generator], Vector],
    n: int,
    k: int,
    generator: np.random.Generator,
) -> tuple[Vector, Vector]:
    """A P-matrix in units that make it indefinite, and q for which about half of z is
    positive."""
    R, C = 10 ** generator.uniform(-1, 1, (2, n))
    M = R[:, np.newaxis] * family(n, generator) * C
    assert np.linalg.eigvalsh(M + M.T).min() < 0
    return M, R[:, np.newaxis] * generator.standard_normal((n, k))


def microseconds(call: Callable[[], Any], count: int) -> float:
    return 1e6 * min(in_turns(call, most=REPEATS, least=REPEATS, warm_up=0)[0]) / count


def one_by_one(call: Callable[[Vector], Any], columns: Vector) -> None:
    for column in columns:
        assert call(column) is not None


def solved(M: Vector, q: Vector) -> Vector:
    return lcpcli.solve(M, q, compiled=True).z


def together(M: Vector, Q: Vector) -> None:
    for result in lcpcli.solve_many(M, Q):
        assert result.solved
        assert result.z is not None


def fitted_together(A: Vector, B: Vector) -> None:
    together(A.T @ A, -(A.T @ B))


def complementarity(k: int, generator: np.random.Generator) -> None:
    show(("M", "n", "z > 0", "solve", "solve_many", "QuantEcon", "of it"), WIDTHS)
    for name, family in (("H+", h_plus), ("not dominant", definite)):
        for n in SIZES:
            M, Q = problems(family, n, k, generator)
            some = np.ascontiguousarray(Q.T[:SAMPLE])
            assert lcp_lemke(M, some[0]).success
            positive = (
                np.mean(
                    [
                        np.count_nonzero(result.z)
                        for result in lcpcli.solve_many(M, Q[:, :SAMPLE])
                    ]
                )
                / n
            )
            one = microseconds(partial(one_by_one, partial(solved, M), some), len(some))
            many = microseconds(partial(together, M, Q), k)
            theirs = microseconds(
                partial(one_by_one, partial(lcp_lemke, M), some), len(some)
            )
            show(
                (
                    f"P, {name}",
                    n,
                    f"{100 * positive:.0f} %",
                    one,
                    many,
                    theirs,
                    many / theirs,
                ),
                WIDTHS,
            )


def least_squares(k: int, generator: np.random.Generator) -> None:
    show(("b", "n", "x > 0", "", "solve_many", "scipy nnls", "of it"), WIDTHS)
    A, E = (
        generator.standard_normal((ROWS, UNKNOWNS)),
        generator.standard_normal((ROWS, k)),
    )
    X = np.maximum(generator.standard_normal((UNKNOWNS, k)), 0.0)
    for name, B in (("random", E), ("A x + noise", A @ X + 0.1 * E)):
        some = np.ascontiguousarray(B.T[:SAMPLE])
        results = lcpcli.solve_many(A.T @ A, -(A.T @ B[:, :SAMPLE]))
        pairs = [
            (result.z, nnls(A, b)[0]) for result, b in zip(results, some, strict=True)
        ]
        assert all(
            np.allclose(ours, theirs, rtol=0, atol=1e-9) for ours, theirs in pairs
        )
        positive = np.mean([np.count_nonzero(ours) for ours, _ in pairs]) / UNKNOWNS
        many = microseconds(partial(fitted_together, A, B), k)
        theirs = microseconds(partial(one_by_one, partial(nnls, A), some), len(some))
        show(
            (
                name,
                UNKNOWNS,
                f"{100 * positive:.0f} %",
                "",
                many,
                theirs,
                many / theirs,
            ),
            WIDTHS,
        )


def main() -> None:
    k, generator = (
        int(sys.argv[1]) if len(sys.argv) > 1 else 10_000,
        np.random.default_rng(0),
    )
    complementarity(k, generator)
    least_squares(k, generator)


if __name__ == "__main__":
    main()
