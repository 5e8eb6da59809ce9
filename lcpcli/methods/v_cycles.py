"""V-cycles of a hierarchy for principal submatrices, as preconditioners in single precision.

Basis functions truncated where a constraint is active: R. Kornhuber, Monotone multigrid methods for elliptic
variational inequalities I, Numerische Mathematik 69 (1994) 167-184. The directions that they make are as good in single
precision, which takes half of the memory and of the time to read it (L. Giraud, A. Haidar and L. T. Watson,
Mixed-precision preconditioners in parallel domain decomposition solvers, Lecture Notes in Computational Science and
Engineering 60 (2008) 357-364).
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lcpcli.linalg.doubles import SMALLEST_NORMAL, largest
from lcpcli.linalg.entries import with_data
from lcpcli.linalg.factors import Solve
from lcpcli.linalg.stencils import Operator
from lcpcli.methods.multilevel import Hierarchy
from lcpcli.typing import Mask, Matrix, Vector

# Times the usual weights, for the two sweeps of Jacobi relaxation before each coarse correction, and in reverse after
# it: those of Chebyshev's polynomial for the upper eight ninths of the spectrum.
SWEEPS = 0.86, 3.11
MOSTLY_BASIC = 0.8  # of an aggregate, by weight: it takes part in the correction of basic variables
REGULAR = 1e-14  # of the largest diagonal entry: what a coarsest matrix gets added


class _Level(NamedTuple):
    """What a V-cycle needs of one level, in single precision.

    shares : those of the unknowns in their aggregates. work : two vectors, which a cycle overwrites.
    """

    operator: Operator
    restriction: Matrix
    prolongation: Matrix
    weights: Any
    aggregate: Any
    shares: Any
    work: Any


class VCycles:
    """One V-cycle for each principal submatrix of the finest matrix of a hierarchy."""

    def __init__(self, hierarchy: Hierarchy) -> None:
        self._levels = []
        each = hierarchy.operators, hierarchy.restrictions, hierarchy.weights, hierarchy.tentative
        for operator, R, weights, T in zip(*each, strict=True):
            single = _single(R)
            arrays = _single(weights), T.indices, _single(T.data**2), np.empty((2, weights.size), dtype=np.float32)
            self._levels.append(_Level(operator.in_single_precision(), single, single.T, *arrays))
        self._coarsest, n = hierarchy.coarsest, hierarchy.matrices[0].shape[0]
        self._ends = np.empty(n, dtype=np.float32), np.empty(n)
        self._last: tuple[Mask, Solve] | None = None

    def __call__(self, basic: Mask) -> Solve:
        """Return one V-cycle for the principal submatrix of the basic variables, shape (n,), symmetric if A is; it
        takes and returns vectors of shape (n,) that are 0 elsewhere, the latter in memory that the next cycle
        overwrites. Nothing is formed but masks: an aggregate counts
        as basic if most of it is, so that the coarse versions of the whole matrix serve for every submatrix. It raises
        SingularMatrix."""
        masks = [basic]
        for level in self._levels:
            shares = np.bincount(level.aggregate, level.shares * masks[-1], level.restriction.shape[0])
            masks.append(shares > MOSTLY_BASIC)
        basic = masks.pop()
        if self._last is None or not np.array_equal(basic, self._last[0]):
            self._last = basic, _inverse(self._coarsest, basic)
        solve = self._last[1]
        for level, mask in reversed(list(zip(self._levels, masks, strict=True))):
            solve = partial(_v_cycle, level, level.weights * mask, _single(mask), solve)
        return partial(_in_range, solve, *self._ends)


def _single(values: Any) -> Any:
    """Return an array, or a sparse matrix, in single precision."""
    return values.astype(np.float32) if isinstance(values, np.ndarray) else with_data(values, _single(values.data))


def _in_range(solve: Solve, single: Any, image: Vector, b: Vector) -> Vector:
    """Return what a linear function in single precision makes of b in double precision, however small or large b is.

    single, image : memory for both."""
    size = largest(b)
    if not SMALLEST_NORMAL < size < np.inf:
        return np.array(b)
    np.multiply(b, 1 / size, out=single, casting="same_kind")
    return np.multiply(solve(single), size, out=image, dtype=np.float64)


def _inverse(A: Vector, basic: Mask) -> Solve:
    """Return a solver of systems with a principal submatrix of a small dense A, for vectors of shape (n,)."""
    diagonal = A.diagonal() * basic
    size = diagonal.max(initial=0.0) or 1.0
    regular = np.diag(np.where(diagonal <= REGULAR * size, size, REGULAR * size))
    inverse = _single(np.linalg.inv(np.where(np.outer(basic, basic), A, 0.0) + regular) * basic)
    return partial(np.matmul, inverse)


def _v_cycle(level: _Level, weights: Any, mask: Any, coarse: Solve, b: Any) -> Any:
    A, (x, y), (first, second) = level.operator, level.work, SWEEPS
    np.multiply(weights, b, out=x)
    x *= first
    A.relaxed(x, b, weights, second, y)
    change = level.prolongation @ coarse(level.restriction @ A.residual(y, b, mask, x))
    change *= mask
    y += change
    A.relaxed(y, b, weights, second, x)
    return A.relaxed(x, b, weights, first, y)
