"""Systems A_RC x = b with rows R and columns C of A = [M, c], which change by one row or column at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from lcpcli.linalg.matrices import column_reader
from lcpcli.typing import Matrix, Vector

LEAST_PIVOT = 2.0**-26  # relative to the terms of a pivot: a smaller one is not relied on
MOST_CHANGES = 64  # after which factors are computed from scratch
NOTHING: tuple[int, Vector] = -1, np.zeros(0)  # the solution for no column


class ChangingSystem(ABC):
    """What both kinds of systems share.

    moved : column n of A, which is c; the others are those of M. age : the changes since factors were computed from
    scratch; more than MOST_CHANGES after a pivot that is not clearly different from 0.
    """

    def __init__(self, M: Matrix, moved: Vector) -> None:
        self.n, self.moved, self.age = moved.size, moved, 0
        self._column_of_M = column_reader(M)
        self._solved = NOTHING  # the last column that was solved for, with the solution

    def column(self, col: int) -> Vector:
        """Return a column of A, shape (n,)."""
        return self.moved if col == self.n else self._column_of_M(col)

    def keep_accurate(self) -> None:
        """Compute the factors from scratch if many changes, or a small pivot, may have spoilt them."""
        if self.age > MOST_CHANGES:
            self.refresh()

    @abstractmethod
    def refresh(self) -> None:
        """Compute the factors from scratch; raise SingularMatrix if A_RC is singular."""
