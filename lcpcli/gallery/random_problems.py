"""Random problems, examples that defeat a method, and problems constructed from a
solution or from a proof that there is none. In the latter, numbers are rounded such
that q = w - Mz has no rounding errors, and the known solution is exact.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from lcpcli.gallery.families import require
from lcpcli.gallery.systems import three_diagonals
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Matrix, Vector


def harker_pang(n: int, seed: int, *, symmetric: bool = False) -> Problem:
    """Draw M = A'A + B + D with A and the skew B in (-5, 5), the diagonal D in (0,
    0.3), and q in (-500, 500).

    P. T. Harker and J.-S. Pang, A damped-Newton method for the LCP, Lectures in Applied
    Mathematics 26 (1990) 265-284.

    symmetric : leave B out.
    """
    random = np.random.default_rng([seed, n])
    A, B = random.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.diag(random.uniform(0, 0.3, n))
    if not symmetric:
        upper = np.triu(B, 1)
        M += upper - upper.T
    return Problem(M, random.uniform(-500, 500, n))


def ill_scaled(n: int, seed: int, *, decades: int = 6) -> Problem:
    """Rescale the nonsymmetric M and q of Harker and Pang to R M C and R q, R and C
    diagonal with random powers of two.

    decades : R and C lie between 10^-decades and 10^decades.
    """
    require("decades", decades, 0 <= decades <= 50, "0 <= decades <= 50")
    base, powers = harker_pang(n, seed), int(decades * math.log2(10))
    R, C = np.exp2(
        np.random.default_rng([seed, n, powers]).integers(-powers, powers + 1, (2, n))
    )
    note = (
        "Rescaled exactly, by powers of two: the original problem has the solution C z."
    )
    return Problem(R[:, None] * base.M * C, R * base.q, note=note)


def tridiagonal(n: int, seed: int) -> Problem:
    """Let M be tridiag(-1, 4, -1), sparse, and q normally distributed.

    M is from Example 1 of Y. El foutayeni, M. Khaladi, J. Comput. Appl. Math. 236
    (2012) 1919-1925.
    """
    q = np.random.default_rng([seed, n]).standard_normal(n)
    return Problem(
        three_diagonals(np.full(n, 4.0)), q, note="Well conditioned for every n."
    )


def dominant(n: int, seed: int) -> Problem:
    """Draw about ten normal entries per row; the diagonal is 1.1 times the sum of their
    moduli, plus 0.1."""
    from scipy.sparse import csr_array, diags_array

    random = np.random.default_rng([seed, n])
    rows, columns = np.repeat(np.arange(n), 9), random.integers(0, n, 9 * n)
    values = np.where(rows == columns, 0.0, random.standard_normal(9 * n))
    off = csr_array((values, (rows, columns)), shape=(n, n))
    off.eliminate_zeros()
    M = csr_array(off + diags_array(1.1 * abs(off).sum(axis=1) + 0.1))
    return Problem(
        M, random.standard_normal(n), note="A sparse factorization of M fills in."
    )


def near_singular(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """Let M be HDH with a random reflection H and eigenvalues D equally spaced from 1
    to 2, except one, epsilon.

    q = w - Mz, rounded, for z and w complementary and uniform in (0, 1); z may be wrong
    by about 1e-16 / epsilon.
    """
    random = np.random.default_rng([seed, n])
    v, size = random.standard_normal(n), random.uniform(-1, 1, n)
    v /= np.sqrt(np.sum(v * v))
    eigenvalues = np.append(epsilon, np.linspace(1, 2, n)[1:])
    scaled = eigenvalues * v
    M = 4 * np.sum(scaled * v) * np.outer(v, v) - 2 * (
        np.outer(v, scaled) + np.outer(scaled, v)
    )
    M[np.diag_indices(n)] += eigenvalues
    return Problem(
        M,
        np.maximum(-size, 0) - M @ np.maximum(size, 0),
        note=f"The condition of M is {2 / epsilon:.3g}.",
    )


def boxes(n: int, seed: int) -> Problem:
    """Draw integers: M = A A' + n I, bounds of every kind, and the q for which a random
    z, mostly at bounds, is the solution.
    """
    random = np.random.default_rng([seed, n])
    A = random.integers(-2, 3, (n, n)).astype(float)
    M = A @ A.T + n * np.eye(n)
    # kinds of bounds: boxed, only a lower bound, only an upper bound, free, fixed
    kind, state = random.permutation(np.arange(n) % 5), random.integers(0, 3, n)
    low = random.integers(-9, 10, n).astype(float)
    high = low + random.integers(2, 9, n)
    lower = np.where((kind == 2) | (kind == 3), -np.inf, low)
    upper = np.where((kind == 1) | (kind == 3), np.inf, np.where(kind == 4, low, high))
    at_lower = (state == 0) & np.isfinite(lower)
    at_upper = (state == 1) & np.isfinite(upper)
    z = np.where(at_lower | (kind == 4), lower, np.where(at_upper, upper, low + 1))
    size = random.integers(1, 10, n).astype(float)
    w = np.where(
        kind == 4, size - 5, np.where(at_lower, size, np.where(at_upper, -size, 0.0))
    )
    note = (
        f"{np.count_nonzero(at_lower)} variables at a lower bound, "
        f"{np.count_nonzero(at_upper)} at an upper one."
    )
    return Problem(M, w - M @ z, solutions=(z,), note=note, lower=lower, upper=upper)


def diagonal(n: int, _seed: int, *, decades: int = 6) -> Problem:
    """Let M be diag(10^-decades, ..., 10^decades), sparse, with z = (1, 0, 1, 0, ...)
    and w = M (e - z)."""
    from scipy.sparse import csr_array, diags_array

    entries = 10.0 ** np.linspace(-decades, decades, n)
    z = (np.arange(n) % 2 == 0).astype(float)
    M, q = csr_array(diags_array(entries)), np.where(z > 0, -entries, entries)
    return Problem(
        M,
        q,
        solutions=[z],
        note="The unknowns are decoupled; only their scaling differs.",
    )


def degenerate(n: int, seed: int) -> Problem:
    """Draw integers: M = A'A + I, and q such that z > 0 for a quarter of the indices
    and w > 0 for another quarter, both rounded down; z_i = w_i = 0 for the others.
    """
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    order = random.permutation(n)
    quarter = (n + 2) // 4
    z, w = np.zeros((2, n))
    z[order[:quarter]] = random.integers(1, 10, quarter)
    w[order[quarter : n // 2]] = random.integers(1, 10, n // 2 - quarter)
    note = (
        "The solution is exact: all numbers are integers. z_i = w_i = 0 for half of "
        "the indices."
    )
    return Problem(M, w - M @ z, solutions=[z], note=note)


def near_degenerate(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """Draw integers: M = A'A + I; one of z_i and w_i is 0, and the other is 1 for half
    of the indices and epsilon for the rest.

    epsilon is rounded to a power of two, so that q is exact, and the solution known, as
    long as n^2 < 2^51 epsilon.
    """
    random = np.random.default_rng([seed, n])
    M, power = integer_matrix(random, n), 2.0 ** round(math.log2(epsilon))
    size = np.where(np.arange(n) % 2 == 0, 1.0, power)[random.permutation(n)]
    z, w = complementary(size, random.integers(0, 2, n) == 1)
    note = f"Strictly complementary by only {power:.3g} (2^{round(math.log2(power))})."
    solutions = [z] if n * n < 2**51 * power else []
    return Problem(M, w - M @ z, solutions=solutions, note=note)


def infeasible(n: int, seed: int) -> Problem:
    """Draw integers M and q, whose first (n + 1) // 2 rows are chosen to add up to M'y
    <= 0 and q'y = -1.

    No z >= 0 has Mz + q >= 0: J. Farkas, Theorie der einfachen Ungleichungen, J. reine
    angew. Math. 124 (1902) 1-27.
    """
    random = np.random.default_rng([seed, n])
    k = (n + 1) // 2
    M, q = (random.integers(-5, 6, shape).astype(np.float64) for shape in ((n, n), n))
    M[0] = -M[1:k].sum(axis=0) - random.integers(0, 3, n)
    q[0] = -q[1:k].sum() - 1
    note = (
        f"A Farkas vector is y with ones in the first {k} entries and zeros in the "
        "others."
    )
    return Problem(M, q, verdict="infeasible", note=note)


def unsolvable(n: int, seed: int) -> Problem:
    """Hide [0 1; 1 0] with q = (-1, 1), which has no solution, in two random rows that
    contain no other unknowns. The other unknowns have a symmetric positive definite
    block, so that the problem is feasible, and random integers. n is at least 2.
    """
    n = max(2, n)
    random, M = np.random.default_rng([seed, n]), np.zeros((n, n))
    q = random.integers(-5, 6, n).astype(np.float64)
    M[:2, :2], q[:2] = [[0, 1], [1, 0]], [-1, 1]
    M[2:, :2] = random.integers(-2, 3, (n - 2, 2))
    M[2:, 2:] = integer_matrix(random, n - 2)
    order = random.permutation(n)
    note = "Feasible, but no complementary set yields a solution."
    return Problem(M[np.ix_(order, order)], q[order], verdict="unsolvable", note=note)


def ray(n: int, seed: int) -> Problem:
    """Put [0 1; 0 0] and a symmetric positive definite integer block on the diagonal of
    M. n is at least 2.

    q_1 is the smallest component of q, so that z_1, whose column of M is zero, enters
    first in Lemke's method. In z_1 and z_2 the solutions are (t, -q_1) and (0, -q_1 +
    t) for all t >= 0; the known one has t = 0.
    """
    n = max(2, n)
    random = np.random.default_rng([seed, n])
    M, q = np.zeros((n, n)), np.zeros(n)
    z, w = complementary(
        random.integers(1, 10, n).astype(np.float64), random.integers(0, 2, n) == 1
    )
    M[2:, 2:] = integer_matrix(random, n - 2)
    q[2:] = w[2:] - M[2:, 2:] @ z[2:]
    M[0, 1], q[0] = 1, q.min() - 1
    z[:2] = 0, -q[0]
    note = (
        "It has infinitely many solutions, but Lemke's method from e terminates on a "
        "ray "
        "at its first pivot."
    )
    return Problem(M, q, solutions=[z], note=note)


def integer_matrix(random: Generator, n: int) -> Vector:
    """Return A'A + I with entries of A from -1, 0 and 1: symmetric positive definite,
    with integers up to n + 1."""
    A = random.integers(-1, 2, (n, n)).astype(np.float64)
    return np.asarray(A.T @ A + np.eye(n))


def complementary(size: Vector, inside: Mask) -> tuple[Vector, Vector]:
    """Return two vectors with entries of these sizes: the first is 0 outside the set,
    the second inside it.
    """
    return np.where(inside, size, 0), np.where(inside, 0, size)


# The order of the largest Hilbert matrix whose multiples in integers double precision
# represents exactly.
LARGEST_EXACT = 18


def murty(n: int, _seed: int) -> Problem:
    """Let M be upper triangular with 1 on the diagonal and 2 above it, and q = -e; the
    solution is e_n.

    K. G. Murty, Computational complexity of complementary pivot methods, Math.
    Programming Study 7 (1978) 61-73.
    """
    note = f"Pivoting on the least index needs 2^{n} - 1 steps from z = 0."
    return Problem(_triangle(n), -np.ones(n), solutions=[np.eye(n)[-1]], note=note)


def all_cones(n: int, _seed: int, *, t: float = -1.0) -> Problem:
    """Let M be that of `murty` and q = a - t e with a_i = 2^(i - 1) - 1: a line through
    all 2^n complementary cones.

    From t = -1 to 2^n - 1 the solution path has its breakpoints at 0, 1, 2, ..., 2^n -
    2: z_n is 0 up to t = a_n and t - a_n from there on, so that the other rows, a_i - t
    + 2 z_n, come back along the same path.
    K. G. Murty, Computational complexity of parametric linear programming, Math.
    Programming 19 (1980) 213-219.
    """
    note = (
        f"The path from t = -1 to 2^{n} - 1 has a breakpoint at each integer "
        "between them."
    )
    return Problem(_triangle(n), np.exp2(np.arange(n)) - 1 - t, note=note)


def fathi(n: int, _seed: int) -> Problem:
    """Let M be U'U for an upper triangular U with 1 on the diagonal and 2 above it, and
    q = -e; the solution is e_1.

    Y. Fathi, Computational complexity of LCPs, Math. Programming 17 (1979) 335-344.
    """
    U = _triangle(n)
    note = f"Lemke's method needs 2^{n} pivots; the condition of M grows like n^4."
    return Problem(U.T @ U, -np.ones(n), solutions=[np.eye(n)[0]], note=note)


def _triangle(n: int) -> Vector:
    return np.asarray(2 * np.triu(np.ones((n, n))) - np.eye(n))


def ben_gharbia_gilbert(n: int, _seed: int, *, alpha: float = 2.0) -> Problem:
    """Let M be I + alpha C with the cyclic down-shift C, and q = e; z = 0; iterations
    from x0 = 2 e_1 - e cycle.

    n is rounded up to an odd number >= 3; for an even n M would not be a P-matrix.
    I. Ben Gharbia, J. C. Gilbert, Math. Programming 134 (2012) 349-364.
    """
    unit = np.eye(max(3, n + 1 - n % 2))
    return Problem(
        unit + alpha * np.roll(unit, 1, axis=0),
        np.ones(len(unit)),
        x0=2 * unit[0] - 1,
        solutions=[np.zeros(len(unit))],
        note=(
            "The Newton iteration without safeguards returns to the active set of "
            f"x0 after {len(unit)} steps."
        ),
    )


def kostreva(n: int, _seed: int) -> Problem:
    """Let M be I + 2 C with the cyclic up-shift C, q = -e; then z = e/3. n is rounded
    up to an odd number >= 3.

    M. M. Kostreva, Cycling in linear complementarity problems, Math. Programming 16
    (1979) 127-130, for n = 3.
    """
    n = max(3, n + 1 - n % 2)
    M, z = np.eye(n) + 2 * np.roll(np.eye(n), -1, axis=0), np.full(n, 1 / 3)
    note = "For n = 3 Lemke's method cycles if ties are broken by the smallest index."
    return Problem(M, -np.ones(n), solutions=[z], note=note)


def curtis_han_robinson(_n: int, _seed: int) -> Problem:
    """Pose a problem with the solution (0, 4/19, 11/19) and an x0 from which plain
    principal pivoting cycles.

    F. E. Curtis, Z. Han, D. P. Robinson, Comput. Optim. Appl. 60 (2015) 311-341.
    """
    return Problem(
        [[4, 5, -5], [5, 9, -5], [-5, -5, 7]],
        [2, 1, -3],
        x0=[-1, 1, -1],
        solutions=[[0, 4 / 19, 11 / 19]],
        note=(
            "The Newton iteration without safeguards cycles from x0, although M is "
            "symmetric positive definite."
        ),
    )


def growth(n: int, _seed: int) -> Problem:
    """Let M have 1 on the diagonal and -1 below it, and q = -e; the solution is z_i =
    2^(i-1), like the pivots in J. H. Wilkinson, Error analysis of direct methods of
    matrix inversion, J. ACM 8 (1961) 281-330. n is at most 1024.
    """
    n = min(n, 1024)
    note = "The components of the solution grow by the factor 2 from one to the next."
    M = 2 * np.eye(n) - np.tril(np.ones((n, n)))
    return Problem(M, -np.ones(n), solutions=[np.exp2(np.arange(n))], note=note)


def hilbert(n: int, _seed: int, *, degenerate: bool = False) -> Problem:
    """Let M have the entries 1 / (i + j - 1), and q = -M z for z = e, or (1, 0, 1, 0,
    ...) if degenerate.

    Up to n = 18 M is multiplied by the least common multiple of 1, ..., 2n - 1, so that
    all data are integers and z is exact. Beyond, M and q are rounded, and no solution
    is known, as theirs differs from z.
    D. Hilbert, Ein Beitrag zur Theorie des Legendre'schen Polynoms, Acta Math. 18
    (1894) 155-159.
    """
    denominators = np.arange(1, n + 1)[:, None] + np.arange(n)
    factor = math.lcm(*range(1, 2 * n)) if n <= LARGEST_EXACT else 1
    M, z = factor / denominators, np.where(np.arange(n) % 2, not degenerate, 1.0)
    note = f"The Hilbert matrix times {factor}; its condition grows like exp(3.5 n)."
    solutions = [z] if n <= LARGEST_EXACT else []
    return Problem(M, -M @ z, solutions=solutions, note=note)


# M and z are multiples of the inverses of these, so that products have at most 53 bits.
STEPS_OF_M, STEPS_OF_Z = 2.0**20, 2.0**10


def planted(n: int, seed: int, *, entries: int = 0) -> Problem:
    """Draw M from the normal distribution, a set of half of the indices on average, z >
    0 on it and w > 0 elsewhere, uniform in (0.1, 1.1), and let q = w - Mz. Nothing
    shows which of the 2^n sets it is.

    entries : the number of entries in each row of a sparse M, some at the same
        position; 0 for a dense M.
    """
    random = np.random.default_rng([seed, n, entries])
    if entries:
        from scipy.sparse import csr_array

        positions = np.repeat(np.arange(n), entries), random.integers(0, n, entries * n)
        values = _rounded(random.standard_normal(entries * n), STEPS_OF_M)
        M: Matrix = csr_array((values, positions), shape=(n, n))
    else:
        M = _rounded(random.standard_normal((n, n)), STEPS_OF_M)
    inside = random.integers(0, 2, n) == 1
    z, w = complementary(_rounded(random.uniform(0.1, 1.1, n), STEPS_OF_Z), inside)
    note = f"z > 0 for {np.count_nonzero(inside)} of {n} indices, w > 0 for the others."
    return Problem(M, w - M @ z, solutions=[z], note=note)


def gaussian(n: int, seed: int) -> Problem:
    """Draw M and q from the normal distribution. There may be no solution, one, or
    several."""
    M, q = np.split(np.random.default_rng([seed, n]).standard_normal((n + 1, n)), [n])
    return Problem(M, q[0], note="Whether there is a solution is not known.")


def indefinite(
    n: int, seed: int, *, symmetric: bool = False, strict: bool = False
) -> Problem:
    """Draw M from the normal distribution, over sqrt(n), and z > 0 at two fifths of the
    indices; q = -Mz, so that w = 0.

    One solve with M finds z, as in the problems `sid` and `asym` of the repository
    dominicflocco/DCA-BL (INFORMS J. Comput. 2024.0822), whose M are made in another
    way.

    symmetric : whether M is symmetric. strict : whether w is positive where z is 0.
    """
    random = np.random.default_rng([seed, n])
    M = random.standard_normal((n, n)) / np.sqrt(n)
    M = _rounded((M + M.T) / np.sqrt(2) if symmetric else M, STEPS_OF_M)
    size = _rounded(random.uniform(0.0, 1.0, n), STEPS_OF_Z) + 1 / STEPS_OF_Z
    z, w = complementary(size, random.permutation(n) < round(0.4 * n))
    note = (
        f"z > 0 for {np.count_nonzero(z)} of {n} indices, w > 0 for "
        f"{'the others' if strict else 'none'}."
    )
    return Problem(M, (w if strict else 0.0) - M @ z, solutions=[z], note=note)


def _rounded(values: Vector, steps: float) -> Vector:
    """Return values rounded to multiples of 1 / steps."""
    return np.rint(steps * values) / steps
