"""Functions of other subpackages as kernels call them, most of them with the source
that numpy runs. Nothing is compiled here, so that the modules of kernels are
independent of each other.

The pivot, `shift` and the ratio test have a second version here, in passes without
temporary arrays. Compiled from the functions for numpy, a pivot takes 2 times as long
with 10 unknowns and 4 times with 300, and a call 1.2 times with 30, 1.5 to 1.8 times
with 100 and 2.3 to 2.5 times with 200.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload, register_jitable

from lcpcli.basis import exchanges, free_variables, tableau
from lcpcli.basis.tableau import (
    NO_ROW,
    NOISE,
    SMALL,
    UNBOUNDED,
    ZERO,
    lexicographic_minimum,
)
from lcpcli.linalg import factors, matrices, units

OPTIONS = {"nogil": True, "error_model": "numpy"}
VECTOR, MATRIX = (types.Array(types.float64, d, "C", readonly=True) for d in (1, 2))


@overload(tableau.exchange, jit_options=OPTIONS)
def _exchange(T: Any, row: Any, column: Any) -> Any:  # noqa: ARG001
    """Return the body of `tableau.exchange` that is compiled: one pass over the tableau
    instead of three."""

    def exchange(T: Any, row: Any, column: Any) -> Any:
        pivot, pivot_row = T[row, column], T[row].copy()
        pivot_row /= -pivot
        largest = np.abs(pivot_row).max()
        pivot_row[column] = 0.0
        for i in range(T.shape[0]):
            other, factor = T[i], T[i, column]
            if i != row and factor != 0.0:
                for j in range(pivot_row.size):
                    other[j] += factor * pivot_row[j]
                other[column] = factor / pivot
        T[row] = pivot_row
        T[row, column] = 1.0 / pivot
        return largest

    return exchange


@overload(tableau.shift, jit_options=OPTIONS)
def _shift(
    tableau: Any,  # noqa: ARG001
    change: Any,  # noqa: ARG001
    step: Any,  # noqa: ARG001
) -> Any:
    """Return the body of `tableau.shift` that is compiled: one pass."""

    def shift(tableau: Any, change: Any, step: Any) -> Any:
        values, noise = tableau.values, tableau.noise
        fastest = 0.0
        for i in range(values.size):
            rate = abs(change[i])
            fastest = max(fastest, rate)
            values[i] += step * change[i]
            noise[i] = max(noise[i], NOISE * step * rate)
            if abs(values[i]) <= ZERO * noise[i]:
                values[i] = 0.0
        return fastest

    return shift


@overload(tableau.choose, jit_options=OPTIONS)
def _choose(
    tableau: Any,  # noqa: ARG001
    entering: Any,  # noqa: ARG001
    change: Any,  # noqa: ARG001
    cover_row: Any,  # noqa: ARG001
    lexicographic: Any,  # noqa: ARG001
) -> Any:
    """Return the body of `tableau.choose` that is compiled: two passes."""

    def choose(
        tableau: Any,
        entering: Any,
        change: Any,
        cover_row: Any,
        lexicographic: Any,
    ) -> Any:
        n, d = tableau.values.size, tableau.d
        noise, values = tableau.noise, tableau.values
        variable, min_rate = tableau.nonbasic[entering], SMALL * tableau.growth[0]
        bound_flip_ratio = d[variable - n] if n <= variable < 2 * n else np.inf
        distances, min_ratio = np.empty(n), bound_flip_ratio
        for i in range(n):
            distance = max(
                values[i] - tableau.lower[i]
                if change[i] < 0.0
                else tableau.upper[i] - values[i],
                0.0,
            )
            distances[i] = distance
            if abs(change[i]) > min_rate:
                min_ratio = min(min_ratio, distance / abs(change[i]))
        if min_ratio == np.inf:
            return UNBOUNDED, 0.0
        fall = -change[cover_row]
        if fall > min_rate and values[cover_row] - min_ratio * fall <= noise[cover_row]:
            return cover_row, distances[cover_row] / fall
        if bound_flip_ratio <= min_ratio:
            return NO_ROW, bound_flip_ratio
        row, fastest = 0, 0.0
        tied = np.zeros(n, np.bool_)
        for i in range(n):
            rate = abs(change[i])
            tied[i] = rate > min_rate and distances[i] - min_ratio * rate <= noise[i]
            if tied[i] and rate > fastest:
                row, fastest = i, rate
        if lexicographic:
            row = lexicographic_minimum(tableau, np.nonzero(tied)[0], change)
        return row, distances[row] / abs(change[row])

    return choose


@overload(matrices.row_and_column_maxima, jit_options=OPTIONS)
def _maxima(M: Any, R: Any, C: Any) -> Any:  # noqa: ARG001
    """Return the body of `row_and_column_maxima` that is compiled: one pass over a
    dense M."""

    def maxima(M: Any, R: Any, C: Any) -> Any:
        rows, columns = np.zeros(R.size), np.zeros(R.size)
        for i in range(R.size):
            row = M[i]
            for j in range(R.size):
                if row[j] != 0.0:
                    size = abs(row[j]) * R[i] * C[j]
                    rows[i], columns[j] = max(rows[i], size), max(columns[j], size)
        return rows, columns

    return maxima


for function in (
    *(tableau.lexicographic_minimum, tableau.move, tableau.tableau_of, tableau.begin),
    *(factors.finite, exchanges.reciprocals, exchanges.solve_basic),
    *(
        units.half_power,
        units.common_power,
        units.are_far_apart,
        units.sizes_in_units,
        units.swept,
    ),
    *(units.moderate_powers, free_variables.constants, free_variables.widths),
    *(
        free_variables.largest,
        free_variables.cleaned,
        free_variables.solved,
        free_variables.combinations,
    ),
    *(
        free_variables.may_be_monotone,
        free_variables.same_units,
        free_variables.eliminated,
    ),
):
    register_jitable(**OPTIONS)(function)
