"""A batch of LCPs with an M each, and the gradients of all: batches.py [b]

Milliseconds for b problems, 1000 by default, medians of calls that are made in turns:
`lcpcli.solve_many` and `Batch.gradient` beside what one would write with QuantEcon, a
compiled loop over `lcp_lemke` and systems with M_BB', padded by the identity, in one
call of numpy, which verifies nothing and knows no kinks. The matrices are positive
definite, not symmetric, and all arrays of doubles. One thread, whose own time counts,
so that others disturb less.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import statistics
import sys
import time
from functools import partial
from typing import Any

import numpy as np
from measuring import Call, in_turns, show
from numba import njit
from quantecon.optimize import lcp_lemke

import lcpcli

SIZES = (4, 10, 50)
REPETITIONS, WARM_UP, WIDTHS = 30, 3, (4, 14, 10, 10, 7)
Vector = np.ndarray[Any, np.dtype[np.float64]]


@njit
def lemke(M: Any, q: Any) -> Any:
    z = np.empty(q.shape)
    for i in range(q.shape[0]):
        z[i] = lcp_lemke(M[i], q[i]).z
    return z


def padded_gradient(M: Vector, z: Vector, g: Vector) -> tuple[Vector, Vector]:
    basic = z > 0
    blocks = np.where(basic[:, :, None] & basic[:, None, :], M, np.eye(z.shape[1]))
    by_q = -np.linalg.solve(
        blocks.transpose(0, 2, 1), np.where(basic, g, 0.0)[:, :, None]
    )[:, :, 0]
    return by_q[:, :, None] * z[:, None, :], by_q


def gradient(M: Vector, q: Vector, g: Vector) -> tuple[Vector, Vector]:
    found = lcpcli.solve_many(M, q).gradient(g)
    return found.M, found.q


def medians(*calls: Call) -> list[float]:
    times = in_turns(
        *calls,
        most=REPETITIONS,
        least=REPETITIONS,
        warm_up=WARM_UP,
        clock=time.process_time,
    )
    return [1e3 * statistics.median(own) for own in times]


def in_numpy(n: int, M: Vector, q: Vector, g: Vector) -> None:
    z = lemke(M, q)
    batch, known = lcpcli.solve_many(M, q), padded_gradient(M, z, g)
    assert batch.solved.all()
    assert np.allclose(batch.z, z, rtol=0, atol=1e-8)
    assert np.allclose(batch.gradient(g).M, known[0], rtol=0, atol=1e-8)
    forward = medians(partial(lcpcli.solve_many, M, q), partial(lemke, M, q))
    both = medians(
        partial(gradient, M, q, g), lambda: padded_gradient(M, lemke(M, q), g)
    )
    backward = [total - solve for total, solve in zip(both, forward, strict=True)]
    for name, (ours, theirs) in {
        "forward": forward,
        "backward": backward,
        "both": both,
    }.items():
        show((n, name, ours, theirs, ours / theirs), WIDTHS)


def main() -> None:
    b, generator = (
        int(sys.argv[1]) if len(sys.argv) > 1 else 1000,
        np.random.default_rng(0),
    )
    show(("n", "", "lcpcli/ms", "other/ms", "ratio"), WIDTHS)
    for n in SIZES:
        A, B = generator.standard_normal((2, b, n, n))
        M = (
            A @ A.transpose(0, 2, 1) / n
            + 0.1 * np.eye(n)
            + (B - B.transpose(0, 2, 1)) / np.sqrt(n)
        )
        q, g = generator.standard_normal((2, b, n))
        in_numpy(n, M, q, g)


if __name__ == "__main__":
    main()
