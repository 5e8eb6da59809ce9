"""Basic solutions of bands in rational arithmetic, however ill-conditioned they are."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array


def solution(M, b):
    """x with M x = b."""
    flint = pytest.importorskip("flint")
    n, numbers = M.shape[0], M.toarray().ravel().tolist()
    A, right = (
        [flint.fmpq(*value.as_integer_ratio()) for value in values]
        for values in (numbers, b)
    )
    x = flint.fmpq_mat(n, n, A).solve(flint.fmpq_mat(n, 1, right))
    return [Fraction(int(value.p), int(value.q)) for value in x.entries()]


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
    rows = (zip(row.indices, row.data, strict=True) for row in csr_array(M))
    return [
        sum((Fraction(float(a)) * z[j] for j, a in row), Fraction(0)) for row in rows
    ]
