"""A sparse mixed problem without its free variables, whose equations have a unique solution for given other variables.

From M_FF z_F = -(M_FB z_B + q_F) for the free variables F, by sparse factors, there are left w_B = K z_B + k of the
bounded ones B, with K = M_BB - M_BF M_FF^{-1} M_FB, which is dense.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.linalg.factors import SingularMatrix, sparse_lu
from lcpcli.linalg.matrices import product
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector

MOST_REDUCED = 500  # bounded variables: their K is dense
LARGEST = 1e10  # relative to the entries of M: those of M_FF^{-1} M_FB, above which M_FF counts as singular


class WithoutFree:
    """The problem in the bounded variables. Raises SingularMatrix if M_FF is singular, or nearly so, if there are no
    free variables, or if there are more than MOST_REDUCED bounded ones.

    problem : with a sparse M. bounded : its bounded variables, those of `reduced`, with dense K.
    """

    def __init__(self, problem: Problem) -> None:
        M, box = problem.M, problem.box
        lower, upper = box.vectors(problem.n)
        is_free = ~(np.isfinite(lower) | np.isfinite(upper))
        self._problem, self._free, self.bounded = problem, is_free.nonzero()[0], (~is_free).nonzero()[0]
        if not self._free.size or self.bounded.size > MOST_REDUCED:
            raise SingularMatrix
        rows, others = M[self._free], M[self.bounded]
        self._lu: Any = sparse_lu(False)(rows[:, self._free])
        self._columns, across = rows[:, self.bounded], others[:, self._free]
        if not self._free.size > 0 or self.bounded.size > MOST_REDUCED:
            raise SingularMatrix
        X = self._lu.solve(self._columns.toarray())
        if not np.abs(X).max(initial=0.0) <= LARGEST:
            raise SingularMatrix
        K = others[:, self.bounded].toarray() - product(across, X)
        k = problem.q[self.bounded] - product(across, self._lu.solve(problem.q[self._free]))
        self.reduced = Problem(K, k, lower=lower[self.bounded], upper=upper[self.bounded])

    def given(self, z: Vector, basis: States) -> tuple[Vector, States]:
        """Return z of the given problem, and its states, for those of the bounded variables."""
        whole, states = np.empty(self._problem.n), np.full(self._problem.n, BASIC, np.int8)
        whole[self.bounded], states[self.bounded] = z, basis
        whole[self._free] = -self._lu.solve(product(self._columns, z) + self._problem.q[self._free])
        return whole, states
