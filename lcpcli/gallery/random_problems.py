"""Random problems, and problems built around a known solution or around a proof that there is none."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from lcpcli.gallery.differences import three_diagonals
from lcpcli.gallery.families import require
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

ORIGINAL = "random, original to lcp"
OFF_DIAGONAL = 9  # entries per row of `dominant`, ten with the diagonal


def harker_pang(n: int, seed: int, *, symmetric: bool = False) -> Problem:
    """Draw M = A'A + B + D with A and the skew B in (-5, 5), the diagonal D in (0, 0.3), and q in (-500, 500).

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
    """Rescale the nonsymmetric M and q of Harker and Pang to R M C and R q, R and C diagonal with random powers of two.

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
    """Let M be tridiag(-1, 4, -1), sparse, and q normally distributed.

    M is from Example 1 of Y. El foutayeni, M. Khaladi, Using vector divisions in solving the linear complementarity
    problem, J. Comput. Appl. Math. 236 (2012) 1919-1925.
    """
    q = np.random.default_rng([seed, n]).standard_normal(n)
    source = "after El foutayeni and Khaladi 2012, Example 1, random q"
    note = "Well conditioned for every n."
    return Problem(three_diagonals(np.full(n, 4.0)), q, name=f"tridiagonal-{n}", source=source, note=note)


def dominant(n: int, seed: int) -> Problem:
    """Draw about ten normal entries per row; the diagonal is 1.1 times the sum of their moduli, plus 0.1."""
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
    """Let M be HDH with a random reflection H and eigenvalues D equally spaced from 1 to 2, except one, epsilon.

    q = w - Mz, rounded, for z and w complementary and uniform in (0, 1); no solution is given, as the solution for
    rounded data may differ from this z by about 1e-16 / epsilon.

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


KINDS = 5  # the kinds of bounds: boxed, only a lower bound, only an upper bound, free, fixed


def boxes(n: int, seed: int) -> Problem:
    """Draw integers: M = A A' + n I, bounds of every kind, and the q for which a random z is the solution.

    About two thirds of the variables with bounds are at a bound.
    """
    random = np.random.default_rng([seed, n])
    A = random.integers(-2, 3, (n, n)).astype(float)
    M = A @ A.T + n * np.eye(n)
    kind, state = random.permutation(np.arange(n) % KINDS), random.integers(0, 3, n)
    low = random.integers(-9, 10, n).astype(float)
    high = low + random.integers(2, 9, n)
    lower = np.where((kind == 2) | (kind == 3), -np.inf, low)
    upper = np.where((kind == 1) | (kind == 3), np.inf, np.where(kind == 4, low, high))
    at_lower, at_upper = (state == 0) & np.isfinite(lower), (state == 1) & np.isfinite(upper)
    z = np.where(at_lower | (kind == 4), lower, np.where(at_upper, upper, low + 1))
    size = random.integers(1, 10, n).astype(float)
    w = np.where(kind == 4, size - 5, np.where(at_lower, size, np.where(at_upper, -size, 0.0)))
    source = "original to lcp"
    note = f"{np.count_nonzero(at_lower)} variables at a lower bound, {np.count_nonzero(at_upper)} at an upper one."
    return Problem(M, w - M @ z, name=f"boxes-{n}", source=source, solutions=(z,), note=note, lower=lower, upper=upper)


def diagonal(n: int, _seed: int, *, decades: int = 6) -> Problem:
    """Let M be diag(10^-decades, ..., 10^decades), sparse, with z = (1, 0, 1, 0, ...) and w = M (e - z).

    The problem is trivial except for methods that depend on scaling.

    decades : 0 <= decades <= 150.
    """
    require("decades", decades, 0 <= decades <= 150, "0 <= decades <= 150")
    from scipy.sparse import csr_array, diags_array

    entries = 10.0 ** np.linspace(-decades, decades, n)
    z = (np.arange(n) % 2 == 0).astype(float)
    M, q = csr_array(diags_array(entries)), np.where(z > 0, -entries, entries)
    note = "The unknowns are decoupled; only their scaling differs."
    return Problem(M, q, name=f"diagonal-{n}", solutions=[z], source="original to lcp", note=note)


def degenerate(n: int, seed: int) -> Problem:
    """Draw integers M = A'A + I and q; z > 0 for a quarter of the indices and w > 0 for another, rounded down."""
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    places = random.permutation(n)
    z, w = np.zeros(n), np.zeros(n)
    quarter = (n + 2) // 4
    z[places[:quarter]] = random.integers(1, 10, quarter)
    w[places[quarter : n // 2]] = random.integers(1, 10, n // 2 - quarter)
    note = "The solution is exact: all numbers are integers. z_i = w_i = 0 for half of the indices."
    return Problem(M, w - M @ z, name=f"degenerate-{n}", solutions=[z], source=ORIGINAL, note=note)


def near_degenerate(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """Draw integers M = A'A + I; z_i or w_i is 0, the other is 1 for half of the indices and epsilon for the rest.

    epsilon : rounded to a power of two, so that q is exact and the solution is known (while n^2 < 2^51 epsilon; beyond,
        none is given); 1e-12 <= epsilon <= 1.
    """
    require("epsilon", epsilon, 1e-12 <= epsilon <= 1, "1e-12 <= epsilon <= 1")
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    power = 2.0 ** round(math.log2(epsilon))
    size = np.where(np.arange(n) % 2 == 0, 1.0, power)[random.permutation(n)]
    z, w = complementary(size, random.integers(0, 2, n) == 1)
    solutions = [z] if n * n < 2**51 * power else []
    note = f"Strictly complementary by only {power:.3g} (2^{round(math.log2(power))})."
    return Problem(M, w - M @ z, name=f"near-degenerate-{n}", solutions=solutions, source=ORIGINAL, note=note)


def infeasible(n: int, seed: int) -> Problem:
    """Draw integers M and q, whose first (n + 1) // 2 rows are chosen to add up to M'y <= 0 and q'y = -1.

    No z >= 0 has Mz + q >= 0: J. Farkas, Theorie der einfachen Ungleichungen, J. reine angew. Math. 124 (1902) 1-27.
    """
    random = np.random.default_rng([seed, n])
    k = (n + 1) // 2
    M = random.integers(-5, 6, (n, n)).astype(np.float64)
    q = random.integers(-5, 6, n).astype(np.float64)
    M[0] = -M[1:k].sum(axis=0) - random.integers(0, 3, n)
    q[0] = -q[1:k].sum() - 1
    note = f"A Farkas vector is y with ones in the first {k} entries and zeros in the others."
    return Problem(M, q, name=f"infeasible-{n}", verdict="infeasible", source=ORIGINAL, note=note)


def unsolvable(n: int, seed: int) -> Problem:
    """Hide [0 1; 1 0] with q = (-1, 1), which has no solution, in two random rows that involve no other unknown.

    n is at least 2. The other rows have a symmetric positive definite block, whose solvability makes the whole problem
    feasible, and random integers in the two columns.
    """
    n = max(2, n)
    random = np.random.default_rng([seed, n])
    M, q = np.zeros((n, n)), random.integers(-5, 6, n).astype(np.float64)
    M[:2, :2], q[:2] = [[0, 1], [1, 0]], [-1, 1]
    M[2:, :2], M[2:, 2:] = random.integers(-2, 3, (n - 2, 2)), integer_matrix(random, n - 2)
    order = random.permutation(n)
    note = "Feasible, but no complementary set yields a solution."
    M = np.ascontiguousarray(M[order][:, order])
    return Problem(M, q[order], name=f"unsolvable-{n}", verdict="unsolvable", source=ORIGINAL, note=note)


def ray(n: int, seed: int) -> Problem:
    """Put [0 1; 0 0] and a symmetric positive definite integer block on the diagonal of M. n is at least 2.

    q_1 is the smallest component of q, so that z_1, whose column of M is zero, enters first in Lemke's method. In z_1
    and z_2 the solutions are (t, -q_1) and (0, -q_1 + t) for all t >= 0; the solution given has t = 0.
    """
    n = max(2, n)
    random = np.random.default_rng([seed, n])
    M, q = np.zeros((n, n)), np.zeros(n)
    size = random.integers(1, 10, n).astype(np.float64)
    z, w = complementary(size, random.integers(0, 2, n) == 1)
    M[2:, 2:] = integer_matrix(random, n - 2)
    q[2:] = w[2:] - M[2:, 2:] @ z[2:]
    M[0, 1], q[0] = 1, q.min() - 1
    z[:2] = 0, -q[0]
    note = "It has infinitely many solutions, but Lemke's method from e ends on a ray at its first pivot."
    return Problem(M, q, name=f"ray-{n}", solutions=[z], source=ORIGINAL, note=note)


def integer_matrix(random: Generator, n: int) -> Vector:
    """Return A'A + I with entries of A from -1, 0 and 1: symmetric positive definite, with integers up to n + 1."""
    A = random.integers(-1, 2, (n, n)).astype(np.float64)
    M: Vector = A.T @ A + np.eye(n)
    return M


def complementary(size: Vector, inside: Mask) -> tuple[Vector, Vector]:
    """Return two vectors with entries of the given sizes: the first is 0 outside the set, the second inside it."""
    return np.where(inside, size, 0), np.where(inside, 0, size)
