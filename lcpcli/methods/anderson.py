"""Anderson acceleration of a fixed point iteration, with a safeguard.

H. F. Walker and P. Ni, Anderson acceleration for fixed-point iterations, SIAM Journal on Numerical Analysis 49 (2011)
1715-1735: algorithm AA in its unconstrained form, equations (2.1) and (2.2).
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg.krylov import norm
from lcpcli.typing import Vector

RESTART_GROWTH = 2.0  # growth of |g - x| over its minimum at which the memory is cleared
RIDGE = 1e-14  # added to the Gram matrix, relative to its trace, against nearly dependent differences


class Anderson:
    """The accelerated sequence of x -> g(x): call next(x, g(x)) for the next x.

    It takes g - sum gamma_i (g_(i+1) - g_i) over the last `memory` pairs, where gamma minimises |f - sum gamma_i
    (f_(i+1) - f_i)|_2 for f = g - x. When |f|_2 exceeds RESTART_GROWTH times its minimum since the last restart, the
    iteration restarts from the minimum, with a plain step and an empty memory; so a contraction is never made to
    diverge. It keeps 2 memory + 4 vectors, and costs two products with memory x n arrays per step.

    memory : number of pairs kept, >= 1.
    n : length of x.
    """

    def __init__(self, memory: int, n: int) -> None:
        memory = min(memory, n)
        self._df, self._dg = np.empty((memory, n)), np.empty((memory, n))
        self._gram = np.zeros((memory, memory))
        self._restart()

    def _restart(self) -> None:
        self._kept = self._slot = 0
        self._last: tuple[Vector, Vector] | None = None
        self._smallest, self._best = math.inf, np.empty(0)

    def next(self, x: Vector, g: Vector) -> Vector:
        """The next x; a new array, or g itself."""
        f = g - x
        size = norm(f)
        if size > RESTART_GROWTH * self._smallest:
            best = self._best
            self._restart()
            return best
        if not size < np.inf:
            return g
        if size < self._smallest:
            self._smallest, self._best = size, g
        if self._last is not None:
            self._remember(f, g, *self._last)
        self._last = f, g
        if self._kept == 0 or size == 0:
            return g
        kept = slice(self._kept)
        gram = self._gram[kept, kept]
        ridge = RIDGE * float(np.trace(gram)) * np.eye(self._kept)
        gamma = np.linalg.lstsq(gram + ridge, np.einsum("ij,j->i", self._df[kept], f), rcond=None)[0]
        accelerated: Vector = g - np.einsum("i,ij->j", gamma, self._dg[kept])
        return accelerated

    def _remember(self, f: Vector, g: Vector, last_f: Vector, last_g: Vector) -> None:
        """Replace the oldest differences by the newest, and update the Gram matrix."""
        slot = self._slot
        np.subtract(f, last_f, out=self._df[slot])
        np.subtract(g, last_g, out=self._dg[slot])
        self._kept = max(self._kept, slot + 1)
        self._slot = (slot + 1) % len(self._df)
        products = np.einsum("ij,j->i", self._df[: self._kept], self._df[slot])
        self._gram[slot, : self._kept] = self._gram[: self._kept, slot] = products
