"""Quadratic programs as LCPs, and back: R. W. Cottle, G. B. Dantzig, Complementary pivot theory of mathematical
programming, Linear Algebra Appl. 1 (1968) 103-125. That a program without a minimum is infeasible or unbounded:
M. Frank, P. Wolfe, An algorithm for quadratic programming, Naval Res. Logist. Quart. 3 (1956) 95-110.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from lcpcli import linalg
from lcpcli.errors import ProblemError
from lcpcli.problem import Problem, as_matrix, as_square, as_vector, count, is_sparse, kind
from lcpcli.products import product
from lcpcli.typing import Indices, Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.result import Result

SECONDS = 1.0  # for finding out whether Q is positive semidefinite
UNBOUNDED = "the program is unbounded below"
KEYS = ("kind", "variables", "free")


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a solution of the LCP says of min x'Qx / 2 + c'x, Ax >= b, x >= 0 but for the free x_i.

    x, y, objective : the point, the multipliers y >= 0 of Ax >= b, and the value there; None where it is not solved.
    statement : what x is, or what it means that there is no solution.
    exact : x and y as fractions where they are proved, else None.
    """

    x: Vector | None
    y: Vector | None
    objective: float | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


@dataclass(frozen=True)
class QuadraticProgram:
    """The program of which M = [Q -A'; A 0] and q = (c, -b) are the first-order conditions, z = (x, y).

    variables : length of x.
    free : indices of the unrestricted x_i, each the difference of z_i and one more unknown behind x, in this order.
    """

    variables: int
    free: tuple[int, ...] = ()

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> QuadraticProgram:
        """The program that a file describes, or a ProblemError."""
        from lcpcli.files.keys import refuse_unknown

        refuse_unknown("", data, KEYS)
        k = data.get("variables")
        if isinstance(k, bool) or not isinstance(k, (int, float)) or not k >= 1 or k % 1 != 0:
            raise ProblemError("variables", "is no number of variables", "give a whole number from 1")
        return cls(int(k), _indices(data.get("free", []), int(k)))

    def data(self) -> dict[str, Any]:
        held: dict[str, Any] = {"kind": "qp", "variables": self.variables}
        return held | {"free": list(self.free)} if self.free else held

    def fits(self, M: Matrix, q: Vector) -> bool:
        k, K = self.variables, self._split
        if q.size < K:
            return False
        Q, index, sign = M[:k, :k], *self._spread()
        whole = _equal(M[:K, :K], linalg.scaled(Q[index][:, index], sign, sign)) and _equal(Q, Q.T)
        if not whole or not np.array_equal(q[:K], sign * q[index]):
            return False
        return q.size == K or (_equal(M[:K, K:], -M[K:, :K].T) and not abs(M[K:, K:]).sum())

    def problem(self, Q: Matrix, c: Vector, A: Matrix | None, b: Vector, **texts: str) -> Problem:
        """The LCP of checked data."""
        index, sign = self._spread()
        q = np.concatenate((sign * c[index], -b)) + 0.0  # no -0
        M = linalg.scaled(Q[index][:, index], sign, sign)
        if A is not None:
            M = bordered(M, linalg.scaled(A[:, index], np.ones(b.size), sign), is_sparse(Q) or is_sparse(A))
        return Problem(M if is_sparse(M) else M + 0.0, q, origin=self, **texts)

    def answer(self, result: Result) -> Minimum:
        """x, y and the objective of a result that is solved, and what the result means."""
        if not result.solved:
            return Minimum(None, None, None, self._unsolved(result))
        k, M, q = self.variables, result.problem.M, result.problem.q
        x, y = self._parts(result.z)
        with np.errstate(over="ignore", invalid="ignore"):
            objective = float(x @ product(M[:k, :k], x) / 2 + q[:k] @ x)
        exact = None
        if result.exact is not None and result.exact.z is not None:
            exact = {
                name: part.tolist() for name, part in zip("xy", self._parts(np.array(result.exact.z)), strict=True)
            }
        return Minimum(x, y, objective, _meaning(result.problem, k), exact)

    @property
    def _split(self) -> int:
        """How many entries of z make up x."""
        return self.variables + len(self.free)

    def _spread(self) -> tuple[Indices, Vector]:
        """For each entry of z that makes up x the index in x, and the sign with which it counts."""
        index = np.concatenate((np.arange(self.variables), np.array(self.free, dtype=np.intp)))
        return index, np.where(np.arange(self._split) < self.variables, 1.0, -1.0)

    def _parts(self, z: Any) -> tuple[Any, Any]:
        x = z[: self.variables].copy()
        x[list(self.free)] -= z[self.variables : self._split]
        return x, z[self._split :]

    def _unsolved(self, result: Result) -> str:
        from lcpcli.farkas import alternative
        from lcpcli.result import Status

        if result.status not in (Status.INFEASIBLE, Status.UNSOLVABLE):
            return "not solved, so that there is no x"

        K, M, q = self._split, result.problem.M, result.problem.q
        if (q[K:] >= 0).all():  # x = 0 is feasible
            return UNBOUNDED
        point, proof = alternative(M[K:, :K], q[K:], SECONDS)
        if proof is not None:
            return "the program is infeasible: no x meets its constraints"
        if point is not None:
            return f"{UNBOUNDED}: an LP finds its constraints feasible, to its tolerance"
        return "the program has no minimum: it is infeasible or unbounded below"


def from_qp(
    Q: Any,
    c: ArrayLike,
    A: Any = None,
    b: ArrayLike | None = None,
    *,
    free: Sequence[int] = (),
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """The LCP of the first-order conditions of min x'Qx / 2 + c'x subject to Ax >= b and x >= 0.

    Q : shape (k, k), symmetric; dense, nested sequences or scipy sparse. If it is positive semidefinite, the solutions
        of the LCP are the minima, else the points that meet the first-order conditions. 0 for a linear program.
    c : shape (k,).
    A, b : shapes (m, k) and (m,), or both None for no constraints but x >= 0.
    free : indices of the x_i that may be negative.

    z = (x, y), with the multipliers y; `Result.answer` maps it back. Raises ProblemError, which names the field.

    >>> import lcpcli
    >>> problem = lcpcli.from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], [1])
    >>> answer = lcpcli.run(problem, "auto").answer
    >>> answer.x.tolist(), answer.objective
    ([1.5, 0.0], -2.25)
    """
    linear = as_vector("c", c)
    k = linear.size
    if not k:
        raise ProblemError("c", "is empty", "give a program of at least one variable")
    quadratic = as_square("Q", Q, k, "c")
    rows, columns = (quadratic != quadratic.T).nonzero()
    if rows.size:
        raise ProblemError(f"Q[{rows[0]}][{columns[0]}]", "makes Q unsymmetric", "give (Q + Q') / 2, the same program")
    program = QuadraticProgram(k, _indices(free, k))
    if A is None or b is None:
        if (A is None) != (b is None):
            absent, present = ("A", "b") if A is None else ("b", "A")
            raise ProblemError(absent, "is missing", f"give it with {present}, or leave both out")
        return program.problem(quadratic, linear, None, np.empty(0), name=name, source=source, note=note)
    matrix, right = as_matrix("A", A), as_vector("b", b)
    if matrix.shape[1] != k:
        raise ProblemError("A", f"has {count(matrix.shape[1], 'column')} for {count(k, 'variable')}", "make them agree")
    if right.size != matrix.shape[0]:
        fault = f"has {count(right.size, 'entry')} where A has {count(matrix.shape[0], 'row')}"
        raise ProblemError("b", fault, "make them agree")
    return program.problem(quadratic, linear, matrix, right, name=name, source=source, note=note)


def bordered(Q: Matrix | None, A: Matrix, sparse: bool) -> Matrix:
    """[Q -A'; A 0] for Q of shape (k, k), or None for zero, as a sparse or a dense matrix."""
    m, k = A.shape
    if not sparse and not is_sparse(A):
        return np.block([[np.zeros((k, k)) if Q is None else Q, -A.T], [A, np.zeros((m, m))]])
    from scipy.sparse import block_array, csr_array

    M = block_array([[csr_array((k, k)) if Q is None else csr_array(Q), -A.T], [A, csr_array((m, m))]], format="csr")
    return M if sparse else M.toarray()


@lru_cache(maxsize=1)  # several methods on one problem come one after the other
def _meaning(problem: Problem, k: int) -> str:
    """What a solution of the first-order conditions is, by what is proved of Q, the first k rows and columns of M."""
    from lcpcli.classes import classify
    from lcpcli.classes.verdict import NO, YES

    verdicts = classify(problem.M[:k, :k], SECONDS, last="positive_semidefinite")
    if verdicts["positive_definite"].word == YES:
        return "x is the only minimum, as Q is positive definite"
    word = verdicts["positive_semidefinite"].word
    if word == YES:
        return "x is a minimum, as Q is positive semidefinite"
    if word == NO:
        return "x meets the first-order conditions only, and need not be a minimum: Q is not positive semidefinite"
    return "x meets the first-order conditions; whether Q is positive semidefinite, and x a minimum, is not decided"


def _indices(given: Any, k: int) -> tuple[int, ...]:
    """The indices of free variables, or a ProblemError."""
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
