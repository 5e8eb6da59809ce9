"""The matrix to be classified, with quantities shared by several tests, and the time left."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from lcpcli import clock
from lcpcli.classes.verdict import NO, YES, Late, Verdict
from lcpcli.linalg import matrices, products
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.products import product
from lcpcli.rational import linear, numbers
from lcpcli.typing import Matrix, Vector

DENSE = 2000  # n up to which a sparse matrix may be made dense


class Context:
    """M, dense or sparse of shape (n, n), the verdicts so far, and a deadline by `clock.seconds`."""

    def __init__(self, M: Matrix, deadline: float) -> None:
        self.M, self.n, self.deadline = M, int(M.shape[0]), deadline
        self.verdicts: dict[str, Verdict] = {}

    def yes(self, *names: str) -> bool:
        """Whether M is known to belong to all of these classes."""
        return all(name in self.verdicts and self.verdicts[name].word == YES for name in names)

    def no(self, name: str) -> bool:
        """Whether M is known not to belong to the class."""
        return name in self.verdicts and self.verdicts[name].word == NO

    def witness(self, name: str) -> Vector | None:
        """The vector of the verdict on a class, if there is one."""
        return self.verdicts[name].vector if name in self.verdicts else None

    def check(self) -> None:
        """Raise Late if the time is used up."""
        if clock.seconds() > self.deadline:
            raise Late

    @cached_property
    def diagonal(self) -> Vector:
        """The diagonal of M, shape (n,)."""
        return np.asarray(self.M.diagonal(), dtype=np.float64)

    @cached_property
    def symmetric_part(self) -> Matrix:
        """M + M', rounded once per entry; exact if M is symmetric. Its definiteness is that of v'Mv."""
        with np.errstate(over="ignore"):
            total = self.M + self.M.T
        return total.tocsr() if is_sparse(self.M) else total

    @cached_property
    def dense(self) -> Vector | None:
        """M as a dense array; None for a sparse one of more than DENSE rows."""
        if not is_sparse(self.M):
            return np.asarray(self.M)
        return np.asarray(self.M.toarray()) if self.n <= DENSE else None

    def whole(self) -> list[list[int]]:
        """M as integers, multiplied by a power of two; for n up to DENSE."""
        assert self.dense is not None
        return numbers.integers(self.dense)

    def whole_symmetric_part(self) -> list[list[int]]:
        """M + M' as integers, multiplied by a power of two; for n up to DENSE."""
        A = self.whole()
        return [
            [a + b for a, b in zip(row, column, strict=True)]
            for row, column in zip(A, zip(*A, strict=True), strict=True)
        ]

    @cached_property
    def definiteness(self) -> linear.Definiteness:
        """What exact elimination of M + M' shows, for n up to DENSE. May raise Late."""
        return linear.definiteness(self.whole_symmetric_part(), self.check)

    def form_is(self, holds: Callable[[int], bool], v: Vector) -> bool:
        """Whether `holds` is true for the sign of v'Mv, -1, 0 or 1, determined exactly; False if undecided."""
        if not np.isfinite(v).all() or not v.any():
            return False
        with np.errstate(over="ignore", invalid="ignore"):
            value = float(v @ product(self.M, v))
            size = float(np.abs(v) @ products.absolute_product(self.M, np.abs(v)))
        underflow = (self.n * self.n + 1) * SMALLEST_NORMAL * max(1.0, float(np.abs(v).max()))
        if abs(value) > (2 * self.n + 4) * EPS * size + underflow:
            return holds(1 if value > 0 else -1)
        support = np.flatnonzero(v)
        if support.size > DENSE // 4:
            return False
        block = self.M[support][:, support]
        total = numbers.sign_of_form(matrices.dense(block), v[support])
        return holds((total > 0) - (total < 0))


def signs(A: Matrix, d: Vector, check: Callable[[], None]) -> Vector:
    """The sign of every component of A d, -1, 0 or 1, exactly, for finite A of shape (n, n) and d of shape (n,).

    In double precision where the rounding error cannot change it (it is zero for d = e and entries on a common grid),
    else in exact arithmetic. `check` is called for each row of the latter, and may raise Late.
    """
    n = d.size
    with np.errstate(over="ignore", invalid="ignore"):
        value = product(A, d)
        size = products.absolute_product(A, np.abs(d))
        bound = (n + 2) * EPS * size + n * SMALLEST_NORMAL
    sign: Vector = np.sign(value)
    if np.array_equal(d, np.ones(n)) and _sums_exactly(A, float(size.max())):
        return sign
    for i in np.flatnonzero(~(np.abs(value) > bound)):
        check()
        total = _sign_of_row(A, int(i), d)
        sign[i] = (total > 0) - (total < 0)
    return sign


def _sign_of_row(A: Matrix, i: int, d: Vector) -> int:
    if not is_sparse(A):
        return numbers.sign_of_product(A[i], d)
    part = slice(A.indptr[i], A.indptr[i + 1])
    return numbers.sign_of_product(A.data[part], d[A.indices[part]])


def _sums_exactly(A: Matrix, largest: float) -> bool:
    """Whether sums of entries totalling at most `largest` are free of rounding: all are multiples of a common unit."""
    if not 0 < largest < np.inf:
        return False
    entries = A.data if is_sparse(A) else A
    with np.errstate(over="ignore"):
        units = np.ldexp(entries, 51 - int(np.frexp(largest)[1]))
    return bool(
        np.isfinite(units).all() and np.array_equal(units, np.rint(units)) and not ((units == 0) & (entries != 0)).any()
    )
