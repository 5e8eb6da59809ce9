"""Problems with a random matrix or a random q, of any size."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.differences import three_diagonals
from lcpcli.gallery.families import require
from lcpcli.model.problem import Problem

OFF_DIAGONAL = 9  # entries per row of `dominant`
ORIGINAL = "random, original to lcp"


def harker_pang(n: int, seed: int, *, symmetric: bool = False) -> Problem:
    """M = A'A + B + D with A and the skew B in (-5, 5), the diagonal D in (0, 0.3), and q in (-500, 500).

    P. T. Harker and J.-S. Pang, A damped-Newton method for the linear complementarity problem, in: Computational
    Solution of Nonlinear Systems of Equations, Lectures in Applied Mathematics 26, AMS (1990) 265-284.

    symmetric : leave B out.
    """
    random = np.random.default_rng([seed, n])
    A, B = random.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.diag(random.uniform(0, 0.3, n))
    if not symmetric:
        upper = np.triu(B, 1)
        M += upper - upper.T
    return Problem(M, random.uniform(-500, 500, n), name=f"harker-pang-{n}", source="Harker and Pang 1990")


def ill_scaled(n: int, seed: int, *, decades: int = 6) -> Problem:
    """R M C and R q for the nonsymmetric M and the q of Harker and Pang, with diagonal R and C of random powers of two.

    decades : R and C lie between 10^-decades and 10^decades, 0 <= decades <= 50.
    """
    require("decades", decades, 0 <= decades <= 50, "0 <= decades <= 50")
    base = harker_pang(n, seed)
    powers = int(decades * math.log2(10))
    R, C = np.exp2(np.random.default_rng([seed, n, powers]).integers(-powers, powers + 1, (2, n)))
    source = "after Harker and Pang 1990, rows and columns rescaled"
    note = "Rescaled exactly, by powers of two: the original problem has the solution C z."
    return Problem(R[:, None] * base.M * C, R * base.q, name=f"ill-scaled-{n}", source=source, note=note)


def tridiagonal(n: int, seed: int) -> Problem:
    """M = tridiag(-1, 4, -1), sparse, and q normally distributed.

    M is that of Example 1 of Y. El foutayeni, M. Khaladi, Using vector divisions in solving the linear complementarity
    problem, J. Comput. Appl. Math. 236 (2012) 1919-1925.
    """
    q = np.random.default_rng([seed, n]).standard_normal(n)
    source = "after El foutayeni and Khaladi 2012, Example 1, random q"
    note = "Well conditioned for every n."
    return Problem(three_diagonals(np.full(n, 4.0)), q, name=f"tridiagonal-{n}", source=source, note=note)


def dominant(n: int, seed: int) -> Problem:
    """About ten random normal entries per row; the diagonal is 1.1 times the sum of their moduli, plus 0.1."""
    from scipy.sparse import csr_array, diags_array

    random = np.random.default_rng([seed, n])
    rows, columns = np.repeat(np.arange(n), OFF_DIAGONAL), random.integers(0, n, OFF_DIAGONAL * n)
    values = np.where(rows == columns, 0.0, random.standard_normal(OFF_DIAGONAL * n))
    off = csr_array((values, (rows, columns)), shape=(n, n))
    off.eliminate_zeros()
    M = csr_array(off + diags_array(1.1 * abs(off).sum(axis=1) + 0.1))
    note = "A sparse factorization of M fills in."
    return Problem(M, random.standard_normal(n), name=f"dominant-{n}", source=ORIGINAL, note=note)


def near_singular(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """M = HDH with a random reflection H and eigenvalues D equally spaced from 1 to 2, except one, epsilon.

    q = w - Mz, rounded, for z and w complementary and uniform in (0, 1); no solution is given, as that of the rounded
    data may differ from this z by about 1e-16 / epsilon.

    epsilon : the smallest eigenvalue of M, up to rounding, 1e-12 <= epsilon <= 1.
    """
    require("epsilon", epsilon, 1e-12 <= epsilon <= 1, "1e-12 <= epsilon <= 1")
    random = np.random.default_rng([seed, n])
    v, size = random.standard_normal(n), random.uniform(-1, 1, n)
    v /= np.sqrt(np.sum(v * v))
    eigenvalues = np.linspace(1, 2, n)
    eigenvalues[0] = epsilon
    scaled = eigenvalues * v
    M = 4 * np.sum(scaled * v) * np.outer(v, v) - 2 * (np.outer(v, scaled) + np.outer(scaled, v))
    M[np.diag_indices(n)] += eigenvalues
    q = np.maximum(-size, 0) - M @ np.maximum(size, 0)
    return Problem(M, q, name=f"near-singular-{n}", source=ORIGINAL, note=f"The condition of M is {2 / epsilon:.3g}.")
