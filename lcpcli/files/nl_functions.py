"""F, its Jacobian and enclosures of both, for the unknowns of an .nl file."""

from __future__ import annotations

import numpy as np

from lcpcli.files.fields import LARGEST_DENSE
from lcpcli.files.nl_model import NlModel
from lcpcli.model.nonlinear import Enclosure
from lcpcli.model.pairing import paired
from lcpcli.model.tape import Arithmetic, Jacobian, Tape
from lcpcli.typing import Indices, Matrix, Vector


class Functions:
    """The functions of a model in an arithmetic; those of the rows that complement an unknown come first on the tape.

    order : of each unknown the place of its row on the tape; by default equations are paired with the unknowns that are
    left by the entries of the Jacobian at the start.
    """

    def __init__(self, model: NlModel, arithmetic: Arithmetic, order: Indices | None = None) -> None:
        self.n = model.graph.n
        self._tape = Tape(model.graph, model.rows, arithmetic)
        self._jacobian = Jacobian(self._tape)
        self.order = self._paired(model) if order is None else order
        row_of = np.empty(self.n, np.intp)
        row_of[self.order] = np.arange(self.n)
        rows = row_of[self._jacobian.rows]
        self._entries = np.lexsort((self._jacobian.columns, rows))
        self._rows, self._columns = rows[self._entries], self._jacobian.columns[self._entries]
        self._ends = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=self.n))])

    @np.errstate(all="ignore")
    def _paired(self, model: NlModel) -> Indices:
        free, first = np.array(model.free, np.intp), len(model.complements)
        place = np.full(self.n, -1)
        place[free] = np.arange(free.size)
        rows, columns = self._jacobian.rows - first, place[self._jacobian.columns]
        own = (rows >= 0) & (columns >= 0)
        values = self._jacobian.entries(model.start)[own] if own.any() else np.empty(0)
        order = np.empty(self.n, np.intp)
        order[sorted(model.complements)] = np.arange(first)
        order[free] = first + paired(free.size, rows[own], columns[own], values)
        return order

    def F(self, z: Vector) -> Vector:
        """Return F(z)."""
        return self._tape.values(z)[..., self.order]

    def J(self, z: Vector) -> Matrix:
        """Return the Jacobian at z."""
        return self._matrix(self._entries_at(z))

    def _entries_at(self, z: Vector) -> Vector:
        return self._jacobian.entries(z)[..., self._entries]

    def _matrix(self, entries: Vector) -> Matrix:
        if self.n <= LARGEST_DENSE:
            matrix = np.zeros((self.n, self.n))
            matrix[self._rows, self._columns] = entries
            return matrix
        from scipy.sparse import csr_array

        return csr_array((entries, self._columns, self._ends), shape=(self.n, self.n))

    @np.errstate(all="ignore")
    def enclosure(self, lower: Vector, upper: Vector) -> Enclosure:
        """Return bounds on F and on the Jacobian over a box, if the arithmetic is that of intervals."""
        box = np.stack([lower, upper])
        return Enclosure(*self.F(box), *map(self._matrix, self._entries_at(box)))
