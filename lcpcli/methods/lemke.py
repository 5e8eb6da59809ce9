"""Lemke's method: complementary pivoting from a covering vector, with the lexicographic minimum ratio test.

C. E. Lemke, Bimatrix equilibrium points and mathematical programming, Management Science 11 (1965) 681-689; scheme I,
algorithm 4.4.5 of R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, Academic Press (1992);
the lexicographic rule after B. C. Eaves, The linear complementarity problem, Management Science 17 (1971) 612-634.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli import linalg
from lcpcli.certificate import Certificate, proves_infeasible
from lcpcli.methods.iterate import Breakdown, Iterate, NoSolution, Stalled
from lcpcli.principal import PrincipalSolver
from lcpcli.problem import Problem
from lcpcli.typing import Indices, Vector

EPS = float(np.finfo(float).eps)
LARGEST = 5000  # unknowns; the inverse of the basis is dense
NOISE = 2.0**-36  # an update that leaves no more than this of its terms has cancelled, ratios as close as this tie
ROUNDING = 2.0**-42  # the same for sums that have just been computed from M and q
TIE = 2.0**-30  # quotients of entries of the inverse as close as this are equal
DOUBTFUL = 2.0**-26  # a pivot that cancellation has made so small is computed anew before it is used
REFACTOR = 50  # pivots, at least, between two inversions of the basis from scratch
REFACTOR_AT_TIES = 5  # the same where rows tie: there rounding can lead off the path
RAY = "this proves the problem infeasible where M is copositive-plus or row sufficient; elsewhere it proves nothing"


def lemke(problem: Problem, x0: Vector) -> Iterator[Iterate]:
    """Follow the path of almost complementary basic solutions of w = M z + e z_0 + q from a large z_0 down to z_0 = 0.

    For every M it ends after finitely many pivots, at a solution or on a ray. Where M is copositive-plus (Lemke 1965)
    or row sufficient, or has nonnegative principal minors and a solution for every feasible q (M. Aganagić and R. W.
    Cottle, A constructive characterization of Q0-matrices with nonnegative principal minors, Mathematical Programming
    37 (1987) 223-231), a ray means that the problem is infeasible; elsewhere it means nothing. The number of pivots is
    usually of the order of n, at worst exponential.

    With k of the z basic, a pivot costs a few passes over the k columns of the n-by-n inverse that are no unit
    vectors. They are dense, however sparse M is.

    Parameters
    ----------
    problem : the LCP, n <= 5000 unknowns.
    x0 : yielded first, as every method does, and not used: the method starts where it must, from z = 0.

    Yields
    ------
    Iterate : x0, and (z - w) / 2 after every pivot, with F = M z - w + q = -z_0 e, which costs nothing. The last one is
        computed anew from M and q. `evaluations` counts the pivots.

    Raises
    ------
    NoSolution : the path has ended on a ray; the certificate is "farkas" if the ray proves that no z >= 0 has
        M z + q >= 0, otherwise "ray".
    Stalled : the last basis is complementary, but ill-conditioned: its solution does not solve the problem.
    Breakdown : there are too many unknowns, or the numbers have overflowed.
    """
    n, auxiliary = problem.n, 2 * problem.n
    needed = bool((problem.q < 0).any())
    if needed and n > LARGEST:
        raise Breakdown(f"it keeps a dense inverse, for at most {LARGEST} unknowns; here are {n}")
    tableau = _Tableau(problem)
    yield Iterate(x0, None, "", 0)
    if not needed:
        yield Iterate(-0.5 * problem.q, np.zeros(n), "", 0)
        return
    pivots, entering = 0, auxiliary
    column, row, tied = tableau.first_pivot()
    while True:
        leaving = tableau.pivot(column, row, tied, entering)
        pivots += 1
        yield Iterate(tableau.x(), np.full(n, -tableau.value_of(auxiliary)), "", pivots)
        entering = leaving - n if leaving >= n else leaving + n
        column, row, tied = tableau.next_pivot(entering)
        if row == tableau.row_of[auxiliary]:
            x, F, solves = _solution(problem, tableau.support(entering))
            if not solves and tableau.age:
                tableau.invert()
                column, row, tied = tableau.next_pivot(entering)
            if row == tableau.row_of[auxiliary]:
                yield Iterate(x, F, "", pivots + 1)
                if solves:
                    return
                raise Stalled("the last basis is complementary, but too ill-conditioned to give a solution")
        if row < 0:
            raise NoSolution(_certificate(problem, tableau, entering, column))


class _Tableau:
    """A basis of w - M z - e z_0 = q, the inverse of its matrix and its basic solution.

    Variables are numbered: w_i is i, z_i is n + i, z_0 is 2 n. Column i of the inverse is a unit vector as long as w_i
    is basic; the others are the rows of `inverse`. They are at the same time the columns of the tableau that started
    as the identity, which the lexicographic rule reads.

    basic : the variable of each row, shape (n,).
    row_of : the row of each variable, shape (2 n + 1,), -1 where it is not basic.
    values : the basic solution, shape (n,).
    outside : the k indices i of the w_i that are not basic.
    inverse : row s holds column outside[s] of the inverse, shape (n, n), of which k rows are in use.
    age : pivots since the inverse was last computed from scratch.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.n = problem, problem.n
        self.column_of_M = linalg.column_reader(problem.M)
        self.basic: Indices = np.arange(self.n)
        self.row_of: Indices = np.append(self.basic, np.full(self.n + 1, -1))
        self.values: Vector = problem.q.copy()
        self.outside: list[int] = []
        self.inverse: Vector = np.empty((self.n, self.n))
        self.work: Vector = np.empty((self.n, self.n))
        self.age = 0

    def value_of(self, variable: int) -> float:
        """The value of a basic variable."""
        return float(self.values[self.row_of[variable]])

    def x(self) -> Vector:
        """(z - w) / 2 of the basic solution; 0 for the pair of which neither is basic."""
        x = np.zeros(2 * self.n + 1)
        x[self.basic] = self.values
        return 0.5 * (x[self.n : -1] - x[: self.n])

    def support(self, entering: int) -> Indices:
        """The i for which z_i is basic, once `entering` is."""
        support = self.row_of[self.n : -1] >= 0
        if entering >= self.n:
            support[entering - self.n] = True
        return np.flatnonzero(support)

    def first_pivot(self) -> tuple[Vector, int, Indices]:
        """The pivot that brings z_0 in, just large enough for all w = q + e z_0 to be nonnegative."""
        tied = np.flatnonzero(self.values == self.values.min())
        return -np.ones(self.n), int(tied[-1]), tied  # the last one is the lexicographic minimum of [q | I]

    def next_pivot(self, entering: int) -> tuple[Vector, int, Indices]:
        """The entering column, the row of the leaving variable (-1: there is none) and all rows that tie with it.

        If z_0 is among those it is the one that leaves; else the lexicographic rule chooses.
        """
        k = len(self.outside)
        if self.age >= max(REFACTOR, k):
            self.invert()
        column, size = self._column(entering)
        row, tied = self._minimum_ratio(column)
        delicate = tied.size > 1 and self.age >= max(REFACTOR_AT_TIES, k**2 / self.n)
        if self.age and (row < 0 or delicate or column[row] < DOUBTFUL * size[row]):
            self.invert()
            column, size = self._column(entering)
            row, tied = self._minimum_ratio(column)
        return column, row, tied

    def pivot(self, column: Vector, row: int, tied: Indices, entering: int) -> int:
        """Exchange the basic variable of the row for the entering one; returns the one that leaves."""
        leaving = int(self.basic[row])
        step = self.values[row] / column[row]
        change = step * column
        self.values -= change
        self.values[np.abs(self.values) <= NOISE * np.abs(change)] = 0.0
        self.values[tied] = 0.0
        self.values[row] = step
        if leaving < self.n:
            self.inverse[len(self.outside)] = 0.0
            self.inverse[len(self.outside), row] = 1.0
            self.outside.append(leaving)
        self._eliminate(column, row)
        self.basic[row] = entering
        self.row_of[leaving], self.row_of[entering] = -1, row
        if entering < self.n:
            place, last = self.outside.index(entering), len(self.outside) - 1
            self.inverse[place] = self.inverse[last]
            self.outside[place] = self.outside[last]
            self.outside.pop()
        self.age += 1
        if not np.isfinite(self.values).all():
            raise Breakdown("the basic solution has overflowed")
        return leaving

    def invert(self) -> None:
        """Compute the inverse and the basic solution from scratch; what is within rounding of zero becomes zero."""
        others = np.flatnonzero(self.basic >= self.n)
        variables = self.basic[others]
        outside, inside = np.array(self.outside, dtype=np.intp), np.flatnonzero(self.row_of[: self.n] >= 0)
        columns = np.full((self.n, others.size), -1.0)
        ours = variables < 2 * self.n
        columns[:, ours] = -linalg.dense_columns(self.problem.M, variables[ours] - self.n)
        try:
            block = np.linalg.inv(columns[outside])
        except np.linalg.LinAlgError:
            return
        size = np.abs(block) @ (np.abs(columns[outside]) @ np.abs(block))
        block[np.abs(block) <= ROUNDING * size] = 0.0
        rest = -(columns[inside] @ block)
        rest[np.abs(rest) <= ROUNDING * (np.abs(columns[inside]) @ size)] = 0.0
        k, rows = others.size, self.row_of[inside]
        self.inverse[:k, others], self.inverse[:k, rows] = block.T, rest.T
        q = self.problem.q
        size = np.abs(q[outside]) @ np.abs(self.inverse[:k])
        size[rows] += np.abs(q[inside])
        self.values = q[outside] @ self.inverse[:k]
        self.values[rows] += q[inside]
        self.values[np.abs(self.values) <= ROUNDING * size] = 0.0
        self.age = 0

    def _column(self, entering: int) -> tuple[Vector, Vector]:
        """The column of a variable in the tableau, and the size of the terms of which its entries are sums."""
        k = len(self.outside)
        if entering < self.n:
            column = self.inverse[self.outside.index(entering)].copy()
            return column, np.abs(column)
        m = self.column_of_M(entering - self.n)
        above, beside = -m[self.outside], -m[self.basic[self.basic < self.n]]
        size = np.abs(above) @ np.abs(self.inverse[:k], out=self.work[:k])
        column = above @ self.inverse[:k]
        rows = np.flatnonzero(self.basic < self.n)
        column[rows] += beside
        size[rows] += np.abs(beside)
        column[np.abs(column) <= NOISE * size] = 0.0
        return column, size

    def _minimum_ratio(self, column: Vector) -> tuple[int, Indices]:
        rows = np.flatnonzero(column > 0)
        if not rows.size:
            return -1, rows
        ratios = np.maximum(self.values[rows], 0.0) / column[rows]
        tied = rows[ratios <= ratios.min() * (1 + NOISE)]
        if tied.size == 1:
            return int(tied[0]), tied
        auxiliary = int(self.row_of[2 * self.n])
        if auxiliary in tied:
            return auxiliary, tied
        return self._lexicographic_minimum(tied, column), tied

    def _lexicographic_minimum(self, rows: Indices, column: Vector) -> int:
        """Of the rows that tie, the one whose row of the inverse, divided by its entry in the column, is least."""
        places = {i: place for place, i in enumerate(self.outside)}
        units = [int(i) for i in self.basic[rows] if i < self.n]
        for i in sorted([*places, *units]):
            if i in places:
                quotients = self.inverse[places[i], rows] / column[rows]
                least = quotients.min()
                rows = rows[quotients - least <= TIE * np.maximum(np.abs(quotients), abs(least))]
            else:
                rows = rows[rows != self.row_of[i]]
            if rows.size == 1:
                break
        return int(rows[-1])

    def _eliminate(self, column: Vector, row: int) -> None:
        """The inverse after a pivot on column[row], cancelled entries set to zero."""
        k = len(self.outside)
        inverse, change = self.inverse[:k], self.work[:k]
        quotients = inverse[:, row] / column[row]
        np.multiply(quotients[:, np.newaxis], column, out=change)
        inverse -= change
        np.abs(change, out=change)
        change *= NOISE
        inverse[np.abs(inverse) <= change] = 0.0
        inverse[:, row] = quotients


def _solution(problem: Problem, support: Indices) -> tuple[Vector, Vector, bool]:
    """The solution x = (z - w) / 2 of a complementary basis, F at x, and whether that is zero up to rounding."""
    M, q, n = problem.M, problem.q, problem.n
    z = np.zeros(n)
    try:
        z[support] = PrincipalSolver(M).solve(support, -q[support])
    except linalg.SingularMatrix:
        return -0.5 * q, np.minimum(q, 0.0), False
    w = problem.w(z)
    w[support] = 0.0
    x = 0.5 * (z - w)
    z, w = 2 * np.maximum(x, 0.0), 2 * np.maximum(-x, 0.0)
    F = problem.w(z) - w
    return x, F, bool((np.abs(F) <= 2 * (n + 1) * EPS * (linalg.absolute_product(M, z) + w + np.abs(q))).all())


def _certificate(problem: Problem, tableau: _Tableau, entering: int, column: Vector) -> Certificate:
    """What the ray along the entering column proves.

    Candidates for Farkas' y are its z, which is one where M is copositive-plus, and the multipliers of the row of z_0,
    which are one where z_0 is at its minimum over all z, w, z_0 >= 0.
    """
    n = problem.n
    ray = np.zeros(2 * n + 1)
    ray[tableau.basic] = np.maximum(-column, 0.0)
    ray[entering] = 1.0
    multipliers = np.zeros(n)
    multipliers[tableau.outside] = -tableau.inverse[: len(tableau.outside), tableau.row_of[2 * n]]
    z = ray[n:-1]
    for y in (z, np.maximum(multipliers, 0.0)):
        if proves_infeasible(problem, y):
            return Certificate("farkas", "y >= 0, M'y <= 0 and q'y < 0 for a y that Lemke's method has found", y)
    return Certificate("ray", RAY, z)
