"""Lemke's method from other starts: on the problem with some pairs (z_i, w_i) exchanged.

In M = [0 A; B' 0], q = -e, the bimatrix games, the path from the covering vector e ends at once, on a ray. With z_k and
one w_j exchanged it is a path as in C. E. Lemke and J. T. Howson, Equilibrium points of bimatrix games, SIAM Journal
12 (1964) 413-423, where z_k is the label that is dropped.
"""

from __future__ import annotations

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.linalg import matrices
from lcpcli.methods.finish import finish
from lcpcli.methods.iterate import Finished, Iterate, Stage, Stalled, advance, limited
from lcpcli.methods.lemke import lemke
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

MAX_UNKNOWNS = 1000  # since the exchanged problem is dense
TRIES = 8
MAX_PIVOTS = 5  # per unknown and try
TOLERANCE = 1e-6  # of the largest |q|: the size of F up to which the end of a path is worth finishing


def restarts(problem: Problem, x0: Vector) -> Stage:  # noqa: ARG001 (as for a method)
    """Yield the end of the path of each try, if that is a solution."""
    if problem.n > MAX_UNKNOWNS or not (problem.q < 0).any():
        return Finished()
    M, evaluations = matrices.dense(problem.M), 0
    for k in np.random.default_rng(0).permutation(problem.n)[:TRIES]:
        rows = np.flatnonzero((M[:, k] > 0) & (problem.q < 0))
        if not rows.size:
            continue
        pair = np.unique([k, rows[np.argmax(-problem.q[rows] / M[rows, k])]])
        last = _end_of_path(M, problem.q, pair)
        if last is None or last.F is None or np.abs(last.F).max() > TOLERANCE * np.abs(problem.q).max():
            continue
        x = last.x.copy()
        x[pair] *= -1
        evaluations += last.evaluations
        yield from finish(problem, None, _single(last._replace(x=x, F=None, step="restart", evaluations=evaluations)))
    return Stalled("no path from another start ends at a solution")


def _end_of_path(M: Vector, q: Vector, pair: Indices) -> Iterate | None:
    """The last iterate of Lemke's method on the exchanged problem; None if it does not end at a solution."""
    try:
        path = limited(lemke(_exchanged(M, q, pair), np.zeros(q.size)), MAX_PIVOTS * q.size)
        last = None
        while isinstance(step := advance(path), Iterate):
            last = step
            if remaining() <= 0:
                raise TimeIsUp
    except (ProblemError, FloatingPointError, np.linalg.LinAlgError):
        return None
    return last if isinstance(step, Finished) else None


def _single(iterate: Iterate) -> Stage:
    yield iterate
    return Finished()


def _exchanged(M: Vector, q: Vector, pair: Indices) -> Problem:
    """The principal pivot transform, z_i and w_i exchanged for the pair's indices; ProblemError if it overflows."""
    inverse = np.linalg.inv(M[np.ix_(pair, pair)])
    columns = M[:, pair] @ inverse
    T = M - columns @ M[pair]
    T[:, pair] = columns
    T[pair] = -inverse @ M[pair]
    T[np.ix_(pair, pair)] = inverse
    shifted = q - columns @ q[pair]
    shifted[pair] = -inverse @ q[pair]
    return Problem(T, shifted)
