"""Examples from the literature, constructed to defeat a method, and problems whose M has no property that a method
could rely on, mostly with a solution that is known.

Matrices and solutions are rounded so that q = w - Mz is free of rounding, and the known solution exact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.random import Generator

from lcpcli.gallery.families import require
from lcpcli.gallery.random_problems import ORIGINAL, complementary
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

LARGEST_POWER = 1023  # the largest exponent of two in double precision, which bounds exact solutions
LARGEST_EXACT = 18  # the largest Hilbert matrix for which all numbers are integers representable in double precision


def murty(n: int, _seed: int) -> Problem:
    """Let M be upper triangular with 1 on the diagonal and 2 above it, and q = -e; the solution is e_n.

    K. G. Murty, Computational complexity of complementary pivot methods, Math. Programming Study 7 (1978) 61-73.
    """
    U = 2 * np.triu(np.ones((n, n))) - np.eye(n)
    note = f"Pivoting on the least index needs 2^{n} - 1 steps from z = 0."
    return Problem(U, -np.ones(n), name=f"murty-{n}", solutions=[np.eye(n)[-1]], source="Murty 1978", note=note)


def all_cones(n: int, _seed: int, *, t: float = -1.0) -> Problem:
    """Let M be that of `murty` and q = a - t e with a_i = 2^(i - 1) - 1: a line through all 2^n complementary cones.

    From t = -1 to 2^n - 1 the solution path has its breakpoints at 0, 1, 2, ..., 2^n - 2: z_n is 0 up to t = a_n and
    t - a_n from there on, so that the other rows, a_i - t + 2 z_n, come back along the same path.
    K. G. Murty, Computational complexity of parametric linear programming, Math. Programming 19 (1980) 213-219.

    t : |t| <= 1e15; it moves q alone.
    """
    require("t", t, abs(t) <= 1e15, "|t| <= 1e15")
    a = np.exp2(np.arange(n)) - 1
    note = f"The path from t = -1 to 2^{n} - 1 has a breakpoint at each whole number between them."
    return Problem(murty(n, _seed).M, a - t, name=f"all-cones-{n}", source="after Murty 1978 and 1980", note=note)


def fathi(n: int, _seed: int) -> Problem:
    """Let M be U'U for an upper triangular U with 1 on the diagonal and 2 above it, and q = -e; the solution is e_1.

    Y. Fathi, Computational complexity of LCPs associated with positive definite symmetric matrices, Math. Programming
    17 (1979) 335-344.
    """
    U = 2 * np.triu(np.ones((n, n))) - np.eye(n)
    note = f"Lemke's method needs 2^{n} pivots; the condition of M grows like n^4."
    return Problem(U.T @ U, -np.ones(n), name=f"fathi-{n}", solutions=[np.eye(n)[0]], source="Fathi 1979", note=note)


def ben_gharbia_gilbert(n: int, _seed: int, *, alpha: float = 2.0) -> Problem:
    """Let M be I + alpha C with the cyclic down-shift C, and q = e; z = 0; iterations from x0 = 2 e_1 - e cycle.

    n is rounded up to an odd number >= 3; for an even n M would not be a P-matrix. I. Ben Gharbia, J. C. Gilbert,
    Nonconvergence of the plain Newton-min algorithm for linear complementarity problems with a P-matrix, Math.
    Programming 134 (2012) 349-364.

    alpha : 1 < alpha <= 1e6.
    """
    require("alpha", alpha, 1 < alpha <= 1e6, "1 < alpha <= 1e6")
    unit = np.eye(max(3, n + 1 - n % 2))
    return Problem(
        unit + alpha * np.roll(unit, 1, axis=0),
        np.ones(len(unit)),
        name=f"ben-gharbia-gilbert-{len(unit)}",
        x0=2 * unit[0] - 1,
        solutions=[np.zeros(len(unit))],
        source="Ben Gharbia and Gilbert 2012",
        note=f"The Newton iteration without safeguards returns to the active set of x0 after {len(unit)} steps.",
    )


def kostreva(n: int, _seed: int) -> Problem:
    """Let M be I + 2 C with the cyclic up-shift C, q = -e; then z = e/3. n is rounded up to an odd number >= 3.

    M. M. Kostreva, Cycling in linear complementarity problems, Math. Programming 16 (1979) 127-130, for n = 3.
    """
    n = max(3, n + 1 - n % 2)
    M = np.eye(n) + 2 * np.roll(np.eye(n), -1, axis=0)
    z = np.full(n, 1 / 3)
    note = "For n = 3 Lemke's method cycles if ties are broken by the smallest index."
    return Problem(M, -np.ones(n), name=f"kostreva-{n}", solutions=[z], source="Kostreva 1979", note=note)


def curtis_han_robinson(_n: int, _seed: int) -> Problem:
    """Pose a problem with the solution (0, 4/19, 11/19) and an x0 from which plain active-set exchanges cycle.

    F. E. Curtis, Z. Han, D. P. Robinson, A globally convergent primal-dual active-set framework for large-scale convex
    quadratic optimization, Comput. Optim. Appl. 60 (2015) 311-341.
    """
    return Problem(
        [[4, 5, -5], [5, 9, -5], [-5, -5, 7]],
        [2, 1, -3],
        name="curtis-han-robinson",
        x0=[-1, 1, -1],
        solutions=[[0, 4 / 19, 11 / 19]],
        source="Curtis, Han and Robinson 2015",
        note="The Newton iteration without safeguards cycles from x0, although M is symmetric positive definite.",
    )


def growth(n: int, _seed: int) -> Problem:
    """Let M have 1 on the diagonal and -1 below it, and q = -e; the solution is z_i = 2^(i-1). n is at most 1024.

    The solution grows as the pivots of a matrix of J. H. Wilkinson do (Error analysis of direct methods of matrix
    inversion, J. ACM 8 (1961) 281-330).
    """
    n = min(n, LARGEST_POWER + 1)
    M = 2 * np.eye(n) - np.tril(np.ones((n, n)))
    note = "The components of the solution grow by the factor 2 from one to the next."
    z = np.exp2(np.arange(n))
    return Problem(M, -np.ones(n), name=f"growth-{n}", solutions=[z], source="after Wilkinson 1961", note=note)


def hilbert(n: int, _seed: int, *, degenerate: bool = False) -> Problem:
    """Let M be the Hilbert matrix, with the entries 1 / (i + j - 1), and q = -M z for z = e.

    Up to n = 18 M is multiplied by the least common multiple of 1, ..., 2n - 1: all data are integers, and z is the
    exact solution. Beyond, M is rounded to nearest and q = -M z is rounded; as ill-conditioning makes the solution of
    the rounded data differ from z, none is given.
    D. Hilbert, Ein Beitrag zur Theorie des Legendre'schen Polynoms, Acta Math. 18 (1894) 155-159.

    degenerate : z = (1, 0, 1, 0, ...) instead, still with w = 0.
    """
    denominators = np.arange(1, n + 1)[:, None] + np.arange(n)
    factor = math.lcm(*range(1, 2 * n)) if n <= LARGEST_EXACT else 1
    M, z = factor / denominators, np.ones(n)
    if degenerate:
        z[1::2] = 0
    known, source = [z] if n <= LARGEST_EXACT else [], "the Hilbert matrix (Hilbert 1894)"
    note = f"The Hilbert matrix times {factor}; its condition grows like exp(3.5 n)."
    return Problem(M, -M @ z, name=f"hilbert-{n}", solutions=known, source=source, note=note)


STEPS_OF_M, STEPS_OF_Z = 2.0**20, 2.0**10  # M and z are multiples of their inverses: products have 53 bits at most
POSITIVE = 0.4  # the share of positive components in the solution of `indefinite`


def planted(n: int, seed: int, *, entries: int = 0) -> Problem:
    """Draw M from the normal distribution, a set of half of the indices on average, z > 0 on it and w > 0 elsewhere.

    q = w - Mz for z_i and w_i uniform in (0.1, 1.1). Nothing tells which of the 2^n sets it is: the difficulty grows
    with n as that of a random constraint satisfaction problem does.

    entries : the number of entries in each row of a sparse M, some of them in the same place; 0 for a dense M.
    """
    require("entries", entries, 0 <= entries <= 1000, "0 <= entries <= 1000")
    random = np.random.default_rng([seed, n, entries])
    M = _sparse(random, n, entries) if entries else _rounded(random.standard_normal((n, n)), STEPS_OF_M)
    inside = random.integers(0, 2, n) == 1
    z, w = complementary(_rounded(random.uniform(0.1, 1.1, n), STEPS_OF_Z), inside)
    note = f"z > 0 for {np.count_nonzero(inside)} of {n} indices, w > 0 for the others."
    return Problem(M, w - M @ z, name=f"planted-{n}", solutions=[z], source=ORIGINAL, note=note)


def gaussian(n: int, seed: int) -> Problem:
    """Draw M and q from the normal distribution. There may be no solution, one, or several."""
    random = np.random.default_rng([seed, n])
    note = "Whether there is a solution is not known."
    return Problem(
        random.standard_normal((n, n)), random.standard_normal(n), name=f"gaussian-{n}", source=ORIGINAL, note=note
    )


def indefinite(n: int, seed: int, *, symmetric: bool = False, strict: bool = False) -> Problem:
    """Draw M from the normal distribution, over sqrt(n), z with positive components at two fifths of the indices, and
    q = w - Mz with w = 0.

    The solution is degenerate at the other indices, and one solve with M finds it, as in the problems `sid` and `asym`
    of the repository dominicflocco/DCA-BL (INFORMS J. Comput. 2024.0822), whose M are made in another way.

    symmetric : let M be symmetric.
    strict : let w be positive where z is 0.
    """
    random = np.random.default_rng([seed, n])
    M = random.standard_normal((n, n)) / np.sqrt(n)
    M = _rounded((M + M.T) / np.sqrt(2) if symmetric else M, STEPS_OF_M)
    size = _rounded(random.uniform(0.0, 1.0, n), STEPS_OF_Z) + 1 / STEPS_OF_Z
    z, w = complementary(size, random.permutation(n) < round(POSITIVE * n))
    note = f"z > 0 for {np.count_nonzero(z)} of {n} indices, w > 0 for {'the others' if strict else 'none'}."
    q = (w if strict else 0.0) - M @ z
    return Problem(M, q, name=f"indefinite-{n}", solutions=[z], source="after INFORMS J. Comput. 2024.0822", note=note)


def _sparse(random: Generator, n: int, entries: int) -> Any:
    """Return a sparse M with normal entries in random places; those in the same place are added."""
    from scipy.sparse import csr_array

    places = np.repeat(np.arange(n), entries), random.integers(0, n, entries * n)
    return csr_array((_rounded(random.standard_normal(entries * n), STEPS_OF_M), places), shape=(n, n))


def _rounded(values: Vector, steps: float) -> Vector:
    return np.rint(steps * values) / steps
