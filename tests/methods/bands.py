"""Basic solutions of bands in rational arithmetic, however ill-conditioned they are."""

from fractions import Fraction

import numpy as np
from scipy.sparse import csr_array

Row = dict[int, Fraction]


def solution(M, b):
    """x with M x = b, by elimination without row exchanges."""
    n = M.shape[0]
    rows = [_row(M, i) for i in range(n)]
    right = list(b)
    below = [[i for i in range(j + 1, n) if j in rows[i]] for j in range(n)]
    for j in range(n):
        for i in below[j]:
            factor = rows[i].pop(j) / rows[j][j]
            right[i] -= factor * right[j]
            for k, value in rows[j].items():
                if k > j:
                    if k not in rows[i] and k < i:
                        below[k].append(i)
                    rows[i][k] = rows[i].get(k, Fraction(0)) - factor * value
    x = [Fraction(0)] * n
    for j in reversed(range(n)):
        rest = sum(value * x[k] for k, value in rows[j].items() if k > j)
        x[j] = (right[j] - rest) / rows[j][j]
    return x


def basic_solution(problem, z):
    """The basic solution of the states of z, and its w, of an M that is sparse."""
    M, q = csr_array(problem.M), list(map(Fraction, problem.q))
    lower, upper = problem.box.vectors(problem.n)
    exact = [Fraction(0)] * problem.n
    for bound in (lower, upper):
        for i in np.flatnonzero(z == bound):
            exact[i] = Fraction(float(bound[i]))
    basic = np.flatnonzero((z != lower) & (z != upper))
    right = [-a - b for a, b in zip(product(M, exact), q, strict=True)]
    block = csr_array(M[basic][:, basic])
    for i, value in zip(basic, solution(block, [right[i] for i in basic]), strict=True):
        exact[i] = value
    w = [a + b for a, b in zip(product(M, exact), q, strict=True)]
    return exact, w


def product(M, z):
    return [
        sum((value * z[j] for j, value in _row(M, i).items()), Fraction(0))
        for i in range(M.shape[0])
    ]


def _row(M, i):
    own = slice(M.indptr[i], M.indptr[i + 1])
    return {
        int(j): Fraction(float(value))
        for j, value in zip(M.indices[own], M.data[own], strict=True)
    }
