"""Quadratic programs: R. W. Cottle, G. B. Dantzig, Complementary pivot theory of mathematical programming, Linear
Algebra Appl. 1 (1968) 103-125.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, kind, refuse_unknown
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import as_vector
from lcpcli.typing import Indices, Matrix, Vector

KEYS = ("kind", "variables", "free")


@dataclass(frozen=True)
class QuadraticProgram:
    """min x'Qx / 2 + c'x, Ax >= b, x_i >= 0 except free x_i: its LCP has M = [Q -A'; A 0] and q = (c, -b).

    These are the first-order conditions, with z = (x, y) and the multipliers y >= 0 of Ax >= b.

    variables : length of x.
    free : indices of the free x_i, each the difference of z_i and one more unknown after x, in this order.
    """

    variables: int
    free: tuple[int, ...] = ()

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> QuadraticProgram:
        """The program described in a file, or a ProblemError."""
        refuse_unknown("", data, KEYS)
        k = data.get("variables")
        if isinstance(k, bool) or not isinstance(k, (int, float)) or not k >= 1 or k % 1 != 0:
            raise ProblemError("variables", "is not a number of variables", "give a whole number from 1")
        return cls(int(k), indices_of_free(data.get("free", []), int(k)))

    def data(self) -> dict[str, Any]:
        held: dict[str, Any] = {"kind": "qp", "variables": self.variables}
        return held | {"free": list(self.free)} if self.free else held

    def fits(self, M: Matrix, q: Vector) -> bool:
        k, K = self.variables, self.split
        if q.size < K:
            return False
        Q, index, sign = M[:k, :k], *self._spread()
        whole = _equal(M[:K, :K], matrices.scaled(Q[index][:, index], sign, sign)) and _equal(Q, Q.T)
        if not whole or not np.array_equal(q[:K], sign * q[index]):
            return False
        return q.size == K or (_equal(M[:K, K:], -M[K:, :K].T) and not abs(M[K:, K:]).sum())

    def conditions(self, Q: Matrix, c: Vector, A: Matrix | None, b: Vector) -> tuple[Matrix, Vector]:
        """M and q of checked data."""
        index, sign = self._spread()
        q = np.concatenate((sign * c[index], -b)) + 0.0  # no -0
        M = matrices.scaled(Q[index][:, index], sign, sign)
        if A is not None:
            M = bordered(M, matrices.scaled(A[:, index], np.ones(b.size), sign), is_sparse(Q) or is_sparse(A))
        return (M if is_sparse(M) else M + 0.0), q

    def parts(self, z: Any) -> tuple[Any, Any]:
        """x and y of a z, an array of any numbers."""
        x = z[: self.variables].copy()
        x[list(self.free)] -= z[self.variables : self.split]
        return x, z[self.split :]

    @property
    def split(self) -> int:
        """The number of entries of z that represent x."""
        return self.variables + len(self.free)

    def _spread(self) -> tuple[Indices, Vector]:
        """For each entry of z that represents x, the index in x and the sign."""
        index = np.concatenate((np.arange(self.variables), np.array(self.free, dtype=np.intp)))
        return index, np.where(np.arange(self.split) < self.variables, 1.0, -1.0)


def bordered(Q: Matrix | None, A: Matrix, sparse: bool) -> Matrix:
    """[Q -A'; A 0] for Q of shape (k, k), or None for zero, as a sparse or a dense matrix."""
    m, k = A.shape
    if not sparse and not is_sparse(A):
        return np.block([[np.zeros((k, k)) if Q is None else Q, -A.T], [A, np.zeros((m, m))]])
    from scipy.sparse import block_array, csr_array

    M = block_array([[csr_array((k, k)) if Q is None else csr_array(Q), -A.T], [A, csr_array((m, m))]], format="csr")
    return M if sparse else M.toarray()


def indices_of_free(given: Any, k: int) -> tuple[int, ...]:
    """The indices of the free variables among k, or a ProblemError."""
    if not isinstance(given, (list, tuple, range, np.ndarray)):
        raise ProblemError("free", f"is {kind(given)}", "give a list of indices")
    indices = as_vector("free", list(given))
    wrong = np.flatnonzero((indices < 0) | (indices >= k) | (indices != np.floor(indices)))
    if wrong.size:
        i = int(wrong[0])
        raise ProblemError(f"free[{i}]", f"is {indices[i]:g}", f"indices are whole numbers from 0 to {k - 1}")
    if np.unique(indices).size < indices.size:
        raise ProblemError("free", "names an index twice", "keep one")
    return tuple(map(int, indices.tolist()))


def _equal(A: Matrix, B: Matrix) -> bool:
    return not (A != B).sum()
