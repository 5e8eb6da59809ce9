"""Lemke's path and the basic solution of its last basis, compiled by numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, typeof, types
from numba.extending import overload

from lcpcli.basis import exchanges, free_variables, tableau
from lcpcli.kernels.overloads import MATRIX, OPTIONS, VECTOR
from lcpcli.model.box import BASIC, LOWER

STATES = types.Array(types.int8, 1, "C", readonly=True)

TABLEAU = typeof(tableau.tableau_of(np.eye(1), *np.ones((3, 1))))
FOLLOWED = (
    TABLEAU,
    types.int64,
    types.float64,
    types.int64,
    types.boolean,
    types.int64,
)
follow = njit(FOLLOWED, cache=True, **OPTIONS)(tableau.follow)
overload(tableau.follow, strict=False)(lambda *_: lambda *arguments: follow(*arguments))
path = njit((MATRIX, VECTOR, VECTOR, VECTOR, types.int64), cache=True, **OPTIONS)(
    tableau.path
)
exponents = njit((MATRIX,), cache=True, **OPTIONS)(free_variables.exponents)


@njit((MATRIX, VECTOR, VECTOR, VECTOR, STATES), cache=True, **OPTIONS)
def basic_solution(M: Any, q: Any, lower: Any, upper: Any, statuses: Any) -> Any:
    """Return the basic solution z of a basis, projected on the bounds, shape (n,); the
    least-norm one if M_BB is singular.
    """
    z, nothing = np.zeros(q.size), np.zeros(q.size)
    for i in range(q.size):
        if statuses[i] != BASIC:
            z[i] = lower[i] if statuses[i] == LOWER else upper[i]
    exchanges.solve_basic(M, q, nothing, z, (statuses == BASIC).nonzero()[0], nothing)
    return np.minimum(np.maximum(z, lower), upper)
