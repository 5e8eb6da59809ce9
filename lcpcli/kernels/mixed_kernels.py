"""The elimination of free variables, and the basis of a mixed problem from that of the
reduced problem, compiled by numba.
"""

from __future__ import annotations

from numba import njit, types

from lcpcli.basis import free_variables
from lcpcli.kernels.overloads import MATRIX, OPTIONS, VECTOR

OWN_MATRIX = types.Array(types.float64, 2, "C")
NUMBERS, INDICES, STATES = (
    types.Array(each, 1, "C") for each in (types.float64, types.int64, types.int8)
)
NONFIXED = types.NamedTuple(
    (OWN_MATRIX, INDICES, NUMBERS, INDICES, INDICES), free_variables.NonfixedVariables
)
nonfixed_variables = njit((MATRIX, VECTOR, VECTOR), cache=True, **OPTIONS)(
    free_variables.nonfixed_variables
)
reduced = njit(
    (MATRIX, *3 * (VECTOR,), NONFIXED, types.UniTuple(NUMBERS, 2)),
    cache=True,
    **OPTIONS,
)(free_variables.reduced)
recovered_basis = njit((NONFIXED, types.int64, STATES), cache=True, **OPTIONS)(
    free_variables.recovered_basis
)
