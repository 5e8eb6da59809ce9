"""Lemke's method from elsewhere: on the problem in which some pairs (z_i, w_i) have changed places.

In M = [0 A; B' 0], q = -e, the bimatrix games, the path from the covering vector e ends at once, on a ray. With z_k and
one w_j exchanged it is a path as of C. E. Lemke and J. T. Howson, Equilibrium points of bimatrix games, SIAM Journal
12 (1964) 413-423, where z_k is the label that is dropped.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg import matrices
from lcpcli.methods.finish import finish
from lcpcli.methods.iterate import Breakdown, Iterate, NoSolution, Stalled
from lcpcli.methods.lemke import lemke
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

LARGEST = 1000  # unknowns; the exchanged problem is dense
TRIES = 8
PIVOTS = 5  # an unknown, of each try


def restarts(problem: Problem, x0: Vector) -> Iterator[Iterate]:
    """Yield x0 and what the path of each try ends with, if that is a solution; x0 is not used."""
    yield Iterate(x0, None, "", 0)
    if problem.n > LARGEST or not (problem.q < 0).any():
        return
    M, evaluations = matrices.dense(problem.M), 0
    for k in np.random.default_rng(0).permutation(problem.n)[:TRIES]:
        rows = np.flatnonzero((M[:, k] > 0) & (problem.q < 0))
        if not rows.size:
            continue
        pair = np.unique([k, rows[np.argmax(-problem.q[rows] / M[rows, k])]])
        try:
            exchanged = _exchanged(M, problem.q, pair)
            last = deque(islice(lemke(exchanged, np.zeros(problem.n)), PIVOTS * problem.n), maxlen=1)[-1]
        except (Breakdown, Stalled, NoSolution, ProblemError, FloatingPointError, np.linalg.LinAlgError):
            continue
        if last.F is None or np.abs(last.F).max() > 1e-6 * np.abs(problem.q).max():
            continue
        x = last.x.copy()
        x[pair] *= -1
        evaluations += last.evaluations
        yield from finish(problem, iter([replace(last, x=x, F=None, step="restart", evaluations=evaluations)]))


def _exchanged(M: Vector, q: Vector, pair: Indices) -> Problem:
    """The principal pivot transform, z_i and w_i exchanged for the pair's indices; ProblemError where it overflows."""
    inverse = np.linalg.inv(M[np.ix_(pair, pair)])
    columns = M[:, pair] @ inverse
    T = M - columns @ M[pair]
    T[:, pair] = columns
    T[pair] = -inverse @ M[pair]
    T[np.ix_(pair, pair)] = inverse
    shifted = q - columns @ q[pair]
    shifted[pair] = -inverse @ q[pair]
    return Problem(T, shifted)
