"""Evaluations of F and J of a nonlinear problem, counted; J by finite differences where it is not given.

Columns of J without a common row are differenced together: A. R. Curtis, M. J. D. Powell, J. K. Reid, On the estimation
of sparse Jacobian matrices, IMA Journal of Applied Mathematics 13 (1974) 117-119.
"""

from __future__ import annotations

from collections import deque
from functools import cached_property

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ParameterError, count
from lcpcli.linalg.doubles import EPS, is_finite
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import FROM_0
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Indices, Matrix, Vector

MOST_DENSE = 100  # unknowns up to which J is differenced column by column, and is dense
KEPT = 4  # points whose F is kept, as the loop and the method, and J by differences, ask for it again
STEP = EPS**0.5  # of a forward difference, relative to z_j, or to 1 if z_j is smaller
WRONG = 0.1  # the relative difference from which an entry of J is said to be wrong
NOTABLE = 1e-4  # relative to the largest entry of the row, and to F: the size from which an entry is
BY_DIFFERENCES = "by differences of F"


class Evaluations:
    """The evaluations of one run. The last J is kept, as the loop and the method ask for it at the same z.

    pattern : the places of J that may differ from 0, a csr array, for finite differences; None to find them.
    functions, jacobians : the numbers of evaluations so far; those for finite differences count as functions.
    """

    def __init__(self, problem: NonlinearProblem, pattern: Matrix | None = None) -> None:
        if pattern is not None and (shape := getattr(pattern, "shape", np.shape(pattern))) != (problem.n, problem.n):
            fault = f"has shape {shape} for {count(problem.n, 'unknown')}"
            raise ParameterError("pattern", fault, f"give shape ({problem.n}, {problem.n})")
        self.problem, self._given = problem, pattern
        self.functions = self.jacobians = 0
        self._last: tuple[Vector, Matrix] | None = None
        self._values = deque[tuple[Vector, Vector]](maxlen=KEPT)

    def values(self, z: Vector) -> Vector:
        """Return F(z), with nan where it is undefined."""
        self.functions += 1
        F = self.problem.values(z)
        self._values.appendleft((z, F))
        return F

    def known_values(self, z: Vector) -> Vector:
        """Return F(z), evaluated only if it has not been of late; this does not count."""
        known = next((F for place, F in self._values if np.array_equal(place, z)), None)
        if known is None:
            known = self.problem.values(z)
            self._values.appendleft((z, known))
        return known

    def jacobian(self, z: Vector) -> Matrix:
        """Return J(z), dense or a csr array, with nan or infinity where it is undefined."""
        if self._last is None or not np.array_equal(self._last[0], z):
            self.jacobians += 1
            self._last = z, self._differences(z, self._steps(z)) if self.problem.J is None else self.problem.jacobian(z)
        return self._last[1]

    def finite_jacobian(self, z: Vector) -> Matrix | None:
        """Return J(z), or None unless all its entries are finite."""
        J = self.jacobian(z)
        return J if is_finite(J.data if is_sparse(J) else J.ravel()) else None

    @np.errstate(all="ignore")
    def fault_of_jacobian(self, z: Vector) -> str:
        """Return at which entry a given J(z) differs most from differences of F, as a clause; "" if none does by much,
        and for more unknowns than are differenced column by column."""
        if self.problem.J is None or self.problem.n > MOST_DENSE:
            return ""
        J, other = self.jacobian(z), Evaluations(self.problem)._differences(z, self._steps(z))
        J = J.toarray() if is_sparse(J) else J
        sizes = np.fmax(np.abs(J), np.abs(other))
        least = NOTABLE * np.maximum(sizes.max(axis=1, initial=0.0), np.abs(self.values(z)))
        gaps = np.abs(J - other) / np.maximum(sizes, least[:, np.newaxis])
        gaps = np.where(np.isfinite(other), np.where(np.isfinite(J), gaps, np.inf), 0.0)
        if not (gaps > WRONG).any():
            return ""
        i, j = np.unravel_index(gaps.argmax(), gaps.shape)
        return f"J[{i}, {j}] is {J[i, j]:.6g} there, but {BY_DIFFERENCES} {other[i, j]:.6g} {FROM_0}"

    @cached_property
    def _pattern(self) -> Matrix | None:
        """Return the places of J that may differ from 0 as a csc array; None if it is to be dense.

        F_i depends on z_j if it changes with z_j at x0, or is nan where z_j is.
        """
        n, pattern = self.problem.n, self._given
        if pattern is None and n <= MOST_DENSE:
            return None
        with imports:
            from scipy.sparse import csc_array
        if pattern is not None:
            return csc_array(pattern)
        z, F = self.problem.x0, self.values(self.problem.x0)
        rows, columns = list[Indices](), list[Indices]()
        for j in range(n):
            moved, undefined = z.copy(), z.copy()
            moved[j], undefined[j] = z[j] + self._steps(z)[j], np.nan
            depends = (self.values(moved) != F) | np.isnan(self.values(undefined))
            rows.append(depends.nonzero()[0])
            columns.append(np.full(rows[-1].size, j))
        places = np.concatenate(rows), np.concatenate(columns)
        return csc_array((np.ones(places[0].size), places), shape=(n, n))

    @cached_property
    def _groups(self) -> list[Indices]:
        """Return groups of columns, none with a common row, each found greedily."""
        pattern, n = self._pattern, self.problem.n
        if pattern is None:
            return [np.array([j]) for j in range(n)]
        rows_of, last, color = pattern.indices, np.full((n, 0), False), np.full(n, -1)
        for j in range(n):
            own = rows_of[pattern.indptr[j] : pattern.indptr[j + 1]]
            free = (~last[own].any(axis=0)).nonzero()[0]
            if not free.size:
                last, free = np.hstack([last, np.full((n, 1), False)]), np.array([last.shape[1]])
            color[j] = free[0]
            last[own, free[0]] = True
        return [(color == k).nonzero()[0] for k in range(last.shape[1])]

    def _steps(self, z: Vector) -> Vector:
        return self._inward(z, STEP * np.maximum(np.abs(z), 1.0))

    def _inward(self, z: Vector, steps: Vector) -> Vector:
        """Return steps that stay below the upper bounds, and go down where there is no room above."""
        above, below = self.problem.upper - z, z - self.problem.lower
        down: Vector = np.where((above < steps) & (below > above), -np.minimum(steps, below), np.minimum(steps, above))
        return down

    @np.errstate(all="ignore")
    def _differences(self, z: Vector, steps: Vector) -> Matrix:
        """Return J by forward differences, by backward ones where those are undefined."""
        F = self.known_values(z)
        quotients = [self._quotient(z, F, steps, group) for group in self._groups]
        pattern, n = self._pattern, self.problem.n
        if pattern is None:
            return np.array(quotients).T
        data = np.empty(pattern.nnz)
        for group, own in zip(self._groups, quotients, strict=True):
            for j in group.tolist():
                place = slice(pattern.indptr[j], pattern.indptr[j + 1])
                data[place] = own[pattern.indices[place]]
        with imports:
            from scipy.sparse import csc_array
        return csc_array((data, pattern.indices, pattern.indptr), shape=(n, n)).tocsr()

    def _quotient(self, z: Vector, F: Vector, steps: Vector, group: Indices) -> Vector:
        """Return the change of F with the components of a group, each row divided by the step of its component."""
        quotient = np.full(self.problem.n, np.nan)
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[group] += sign * steps[group]
            change = self.values(moved) - F
            quotient = np.where(np.isfinite(quotient), quotient, change / self._divisors(moved - z, group))
            if np.isfinite(quotient).all():
                break
        return quotient

    def _divisors(self, moves: Vector, group: Indices) -> Vector:
        """Return for each row the move of the component of the group that it depends on; 1 without one."""
        pattern, divisors = self._pattern, np.ones(self.problem.n)
        if pattern is None:
            return np.full(self.problem.n, moves[group[0]] or 1.0)
        for j in group.tolist():
            divisors[pattern.indices[pattern.indptr[j] : pattern.indptr[j + 1]]] = moves[j] or 1.0
        return divisors
