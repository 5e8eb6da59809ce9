"""The units of `linalg.units` for a sparse M with symmetric |M|, as of a program, compiled by numba: what the criterion
needs of M takes longer than the solution in calls of numpy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lcpcli.linalg.units import MOST_CG_STEPS, SETTLED_ERROR
from lcpcli.methods.ldl_kernels import arithmetic, compiled

NONE = -1


@arithmetic
def _times(begin: Any, columns: Any, counts: Any, v: Any, image: Any) -> None:
    """Write the product of v with the matrix of the normal equations: the numbers of entries on its diagonal, and ones
    for the entries."""
    for i in range(v.size):
        total = counts[i] * v[i]
        for p in range(begin[i], begin[i + 1]):
            total += v[columns[p]]
        image[i] = total


@compiled
def _components(begin: Any, columns: Any) -> Any:
    """Return the components of the graph of rows and columns, for a symmetric pattern, and their number."""
    n, parts = begin.size - 1, 0
    part, queue = np.full(2 * n, NONE, np.int64), np.empty(2 * n, np.int64)
    for root in range(2 * n):
        if part[root] != NONE:
            continue
        part[root], queue[0], first, last = parts, root, 0, 1
        while first < last:
            node = queue[first]
            first += 1
            own, other = (node, n) if node < n else (node - n, 0)
            for p in range(begin[own], begin[own + 1]):
                neighbour = columns[p] + other
                if part[neighbour] == NONE:
                    part[neighbour], queue[last] = parts, neighbour
                    last += 1
        parts += 1
    return part[:n], part[n:], parts


@arithmetic
def _least_squares(begin: Any, columns: Any, counts: Any, sums: Any) -> Any:
    """Return the rho with the least sum of (e_ij + rho_i + rho_j)^2, by conjugate gradients as `units` does. counts,
    sums : the numbers of entries of the rows, at least 1, and the sums of the e_ij."""
    n, size = counts.size, 0.0
    x, residual, direction, image = np.zeros(n), -sums, -sums / counts, np.empty(n)
    largest = 0.0
    for i in range(n):
        size += residual[i] * direction[i]
        largest = max(largest, abs(direction[i]))
    for _ in range(MOST_CG_STEPS):
        if not largest > SETTLED_ERROR:
            break
        _times(begin, columns, counts, direction, image)
        along = 0.0
        for i in range(n):
            along += direction[i] * image[i]
        length, before = size / along, size
        size = largest = 0.0
        for i in range(n):
            x[i] += length * direction[i]
            residual[i] -= length * image[i]
            step = residual[i] / counts[i]
            size += residual[i] * step
            largest = max(largest, abs(step))
        for i in range(n):
            direction[i] = residual[i] / counts[i] + size / before * direction[i]
    return x


def entry(version: int) -> Any:
    """Return the kernel, to be compiled; version : as for `interior_kernels.entry`."""

    def symmetric_units(begin: Any, columns: Any, values: Any) -> tuple[Any, Any, Any, int]:
        """Return log2 of R, which is C, and the components of rows and of columns, each of shape (n,), and their
        number. begin, columns, values : M in compressed rows, without zeros."""
        version  # noqa: B018
        n = begin.size - 1
        counts, sums = np.empty(n), np.zeros(n)
        for i in range(n):
            counts[i] = max(begin[i + 1] - begin[i], 1)
            for p in range(begin[i], begin[i + 1]):
                sums[i] += math.frexp(values[p])[1]
        row_part, column_part, parts = _components(begin, columns)
        return _least_squares(begin, columns, counts, sums), row_part, column_part, parts

    return symmetric_units
