"""Records of the derivatives of solutions; `parametric` computes them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Generic, TypeAlias, TypeVar

import numpy as np

from lcpcli.linalg.factors import each_product
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.typing import Mask, Matrix, Vector

Kinks = TypeVar("Kinks", list[int], dict[int, list[int]])
Regular = TypeVar("Regular", bool | None, list[bool | None])


@dataclass(frozen=True, eq=False)
class Derivative(Generic[Kinks, Regular]):
    """The derivative of a solution for a change of the data in one direction; for a
    batch of b problems, z and w have a first dimension of length b, kinks is keyed by
    the number of each problem that has any, and strongly_regular is a list.

    z, w : the derivatives of z and of w = M z + q, shape (n,). With J, z is the
        derivative of J z, shape (k,), and w is nan in components in which the solutions
        differ.
    kinks : the indices of the components that are at a bound while w is 0, up to
        rounding. If there are any, z and w are the derivatives with these components
        held at their bounds or, if requested, the one-sided derivatives for a small
        positive step in this direction.
    strongly_regular : whether the solution is proved to be locally unique and Lipschitz
        continuous for all data close to these. It is then differentiable where there is
        no kink, and has one-sided derivatives in every direction. None at kinks, if
        that is not proved or was not requested: one-sided derivatives are then only a
        direction in which solutions may move, to first order.
    """

    z: Vector
    w: Vector
    kinks: Kinks
    strongly_regular: Regular


@dataclass(frozen=True, eq=False)
class Gradient(Generic[Kinks]):
    """The derivatives of a function of z with respect to all data, each computed when
    it is read. For a batch of b problems, each has a first dimension of length b.

    q : with respect to q, shape (n,); 0 at bounds.
    M : with respect to M, shape (n, n); for a sparse M, a csr_array with respect to its
        stored entries.
    lower, upper : with respect to the bounds, shape (n,); 0 where z is not at that
        bound. Where l_i = u_i, only the sum of the two is meaningful, as both bounds
        have to change together.
    kinks : as in `Derivative`; the variables there are held at their bounds.
    """

    q: Vector
    _M: Matrix = field(repr=False)
    _z: Vector = field(repr=False)
    _g: Vector = field(repr=False)
    _basic: Mask = field(repr=False)
    _upper: Mask = field(repr=False)
    kinks: Kinks

    @cached_property
    @np.errstate(all="ignore")
    def M(self) -> Matrix:
        M, z = self._M, self._z
        if not is_sparse(M):
            return self.q[..., :, np.newaxis] * z[..., np.newaxis, :]
        of_entries = M.copy()
        of_entries.data = np.repeat(self.q, np.diff(M.indptr)) * z[M.indices]
        return of_entries

    @property
    def lower(self) -> Vector:
        return np.where(self._upper, 0.0 * np.abs(self.q), self._by_bounds)

    @property
    def upper(self) -> Vector:
        # nan where q is nan
        return np.where(self._upper, self._by_bounds, 0.0 * np.abs(self.q))

    @cached_property
    @np.errstate(all="ignore")
    def _by_bounds(self) -> Vector:
        rest = (
            each_product(self._M.swapaxes(1, 2), self.q)
            if self.q.ndim > 1
            else product(self._M.T, self.q)
        )
        return np.where(self._basic, 0.0, self._g + rest)


OneDerivative: TypeAlias = Derivative[list[int], bool | None]
OneGradient: TypeAlias = Gradient[list[int]]
BatchDerivative: TypeAlias = Derivative[dict[int, list[int]], list[bool | None]]
BatchGradient: TypeAlias = Gradient[dict[int, list[int]]]
