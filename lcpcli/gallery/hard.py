"""Problems whose M has no property that a method could rely on, mostly with a solution that is known.

Matrices and solutions are rounded so that q = w - Mz is free of rounding, and the known solution exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from lcpcli.gallery.families import require
from lcpcli.gallery.random_problems import ORIGINAL, complementary
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

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
