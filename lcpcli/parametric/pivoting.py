"""Parametric principal pivoting: the path of solutions as q and the bounds change
linearly.

At a vertex of the path one component i is degenerate: z_i is at a bound and w_i = 0.
The rows R with w = 0 are then one more than the basic z, and t is determined together
with these. Two edges start at a vertex: z_i leaves its bound, or w_i becomes nonzero.
The path arrives along one and continues along the other, until another z_j reaches a
bound, another w_j reaches 0, or t reaches its limit. On an edge t increases, decreases
(after a turning point) or is constant (a jump).

R. W. Cottle, Monotone solutions of the parametric linear complementarity problem,
Mathematical Programming 3 (1972) 210-224; R. W. Cottle, J.-S. Pang and R. E. Stone, The
Linear Complementarity Problem (1992), section 4.5. For convex quadratic programs it is
the critical line method (H. Markowitz, Naval Research Logistics Quarterly 3 (1956)
111-133). Ties are broken as if the data were perturbed by random multiples of an
infinitesimal number, which prevents cycling (A. Charnes, Optimality and degeneracy in
linear programming, Econometrica 20 (1952) 160-170).

In exact arithmetic, ties, signs and turning points are decided without rounding, and
each piece is proved. Each condition is a form that is nonnegative: z_i - l_i and u_i -
z_i, w_i if z_i is at its lower bound, -w_i if it is at its upper bound, s and 1 - s. A
vertex is a dictionary whose cobasic forms are those that are 0 there.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model import changes
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.parametric.path import Family
from lcpcli.parametric.systems import (
    MAX_CHANGES,
    DenseBasisFactorization,
    SparseBasisFactorization,
)
from lcpcli.rational import pivoting
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import whole_multiple
from lcpcli.typing import BasisStatus, Indices, Vector

Z = "z"
W = "w"
T = "t"


class Variable(NamedTuple):
    """A variable that enters or leaves: its kind, its index, and the sign of its change
    as it enters, or of the side on which it leaves.
    """

    kind: str
    at: int
    sign: float


class Direction(NamedTuple):
    """The changes of z, w and t along an edge, and the largest size of the changes of t
    and of the basic z.
    """

    z: Vector
    w: Vector
    t: float
    size: float


class Edge(NamedTuple):
    """An edge of the path, with the vertex to which it leads.

    statuses : the basis on the edge, shape (n,).
    rise : the sign of the change of t. is_point : whether it has no length, at a
        degenerate vertex.
    s, z : the vertex in the scale of the problem, as floats or fractions; on a ray the
        last s and the direction of z.
    multipliers : on a ray in floating-point arithmetic, the multipliers of the rows
        with w = 0; otherwise None. is_ray, is_last : whether it is a ray, and whether
        it is the last edge.
    """

    statuses: BasisStatus
    rise: float
    is_point: bool
    s: Any
    z: Any
    multipliers: Vector | None = None
    is_ray: bool = False
    is_last: bool = False


# Numbers below this, relative to the largest of their kind in the equilibrated problem,
# are considered 0.
ROUNDING_RTOL = 2.0**-43
# t is constant on an edge if its part in the change of the equations is below this.
STANDSTILL = 2.0**-40
# If a vertex is corrected by more than this, relative to z, the inverse has lost half
# of its digits, and is recomputed from scratch.
LARGE_CORRECTION = 2.0**-26
# A pivot below this, relative to the direction, is computed again by a new inverse.
DOUBTFUL_PIVOT = 2.0**-26
# A difference of equal numbers, or 0, may be replaced by this, relatively, by rounding.
CANCELLED = 2.0**-46
# The path reaches the boundary of the range of s if all forms are at least minus this
# there, relative to the size of z.
NEAR_END = 2.0**-38


class Pivoting:
    """The path from a basis at s = 0, in the equilibrated problem, with t as s
    multiplied by `span`.

    statuses : the current basis, shape (n,).
    fixed : q + M z_N, where z_N are the z at bounds, is fixed + t system.moved.
    """

    def __init__(self, family: Family, statuses: BasisStatus) -> None:
        self.units = changes.scale(family.problem)
        scaled_problem, n = self.units.problem, family.problem.n
        self.n, self.statuses = n, statuses.copy()
        (low, high), (last_low, last_high) = (
            map(self.units.z_inside, family.bounds(s)) for s in (0.0, 1.0)
        )
        rates = [
            self.units.w_inside(family.to.q) - scaled_problem.q,
            _change(low, last_low),
            _change(high, last_high),
        ]
        self.span = max(float(np.abs(rate).max(initial=0.0)) for rate in rates) or 1.0
        moved, *of_bounds = (rate / self.span for rate in rates)
        self.bounds, self.rates = np.array([low, high]), np.array(of_bounds)
        self.has_upper, self.moves = bool((high < np.inf).any()), bool(self.rates.any())
        self.is_fixed = family.is_fixed
        self.t = 0.0
        self.z = np.zeros(n)
        self.w = np.zeros(n)
        self.fixed = scaled_problem.q
        self.system = (
            SparseBasisFactorization
            if is_sparse(scaled_problem.M)
            else DenseBasisFactorization
        )(scaled_problem.M, moved)
        for j in np.flatnonzero(statuses != BASIC).tolist():
            self._shift(j, 1.0)
        self.system.begin(np.flatnonzero(statuses == BASIC))
        random = generator(0).uniform(1, 2, (3, n))
        at = np.where(statuses == UPPER, -1.0, 1.0)
        self.perturbed_q = np.where(statuses == BASIC, 0.0, at * random[0])
        self.perturbed_bounds = np.where(
            statuses == BASIC, [-random[1], random[2]], 0.0
        )
        self._recompute_vertex()

    def edges(self) -> Iterator[Edge]:
        """Yield the edges of the path one after another; raise SingularMatrix if
        rounding prevents it.
        """
        entering = Variable(T, self.n, 1.0)
        while True:
            for _ in range(2):
                direction = self._direction(entering)
                step, leaving, pivot = self._step(entering, direction)
                if not (self.system.age and pivot < DOUBTFUL_PIVOT * direction.size):
                    break
                self.system.refresh()
            basis = self.statuses.copy()
            if entering.kind == Z:
                basis[entering.at] = BASIC
            rise = float(np.sign(direction.t))
            if leaving is None:
                y = (
                    self.system.multipliers(self.n)
                    if self.system.has(self.n)
                    else np.zeros(self.n)
                )
                ray = self.units.z_outside(direction.z), self.units.w_inside(y)
                yield Edge(
                    basis,
                    rise,
                    False,
                    self.t / self.span,
                    *ray,
                    is_ray=True,
                    is_last=True,
                )
                return
            is_point = self._is_point(step, direction)
            self.t += step * direction.t
            self.z += step * direction.z
            if leaving.kind == T:  # no pivot: the basis without t may be singular
                s = float(leaving.sign > 0)
                yield Edge(
                    basis,
                    rise,
                    is_point,
                    s,
                    self.units.z_outside(self.z),
                    is_last=True,
                )
                return
            self._exchange(entering, leaving)
            self._recompute_vertex()
            is_last = (
                self.span - self.t <= ROUNDING_RTOL * self.span
                if rise > 0
                else rise < 0 and self.t <= ROUNDING_RTOL * self.span
            )
            s = float(rise > 0) if is_last else self.t / self.span
            yield Edge(
                basis, rise, is_point, s, self.units.z_outside(self.z), is_last=is_last
            )
            if is_last:
                return
            kind, at, sign = leaving
            entering = Variable(W, at, -sign) if kind == Z else Variable(Z, at, sign)

    def _is_point(self, step: float, direction: Direction) -> bool:
        """Return whether an edge has no length, but for rounding."""
        z_stands = step * direction.size <= ROUNDING_RTOL * self._size
        return z_stands and step * abs(direction.t) <= ROUNDING_RTOL * self.span

    @property
    def _size(self) -> float:
        """Return the largest size of z and t."""
        return max(float(np.abs(self.z).max(initial=0.0)), self.t)

    def _direction(self, entering: Variable) -> Direction:
        """Return the direction of the edge along which a variable enters."""
        system, (kind, at, sign) = self.system, entering
        if kind == W:
            x = sign * system.solve_unit(at)
            w = system.times(x)
        else:
            x = -sign * system.solve_column(at)
            w = system.times(x) + sign * system.column(at)
        w[system.rows] = 0.0
        z, t = self._spread(x)
        size = max(float(np.abs(x).max(initial=0.0)), 1.0)
        if kind == T:
            t = sign
        elif (
            abs(t) * np.abs(system.moved[system.rows]).max(initial=0.0)
            <= STANDSTILL * size
        ):
            t = 0.0
        if self.moves and t:
            z += np.where(self.statuses == BASIC, 0.0, t * self._of_state(self.rates))
        if kind == W:
            w[at] = sign
        elif kind == Z:
            z[at] += sign
        return Direction(z, w, t, size)

    def _spread(self, x: Vector) -> tuple[Vector, float]:
        """Return the basic z in a vector of shape (n,), and t, from their values in the
        order of the columns.
        """
        values = np.zeros(self.n + 1)
        values[self.system.cols] = x
        return values[:-1], float(values[-1])

    def _of_state(self, lower_upper: Vector) -> Vector:
        """Return the lower or the upper value of each component, depending on whether
        it is at its upper bound; shape (n,).
        """
        if not self.has_upper:
            return np.asarray(lower_upper[0])
        return np.asarray(
            np.where(self.statuses == UPPER, lower_upper[1], lower_upper[0])
        )

    def _slacks(
        self, entering: Variable, z: Vector, w: Vector, lower_upper: Vector
    ) -> Vector:
        """Return the distance of each component from the value at which it would leave
        the basis, or its w reach 0, shape (n,); with upper bounds also that of basic
        z_j from these, shape (2 n,). For a direction and the rates of the bounds,
        return how these distances change.
        """
        is_basic = self.statuses == BASIC
        if entering.kind == Z:
            is_basic[entering.at] = True
        if not self.has_upper:
            return np.asarray(np.where(is_basic, z - lower_upper[0], w))
        signed = np.where(self.is_fixed, 0.0, np.where(self.statuses == UPPER, -w, w))
        return np.concatenate(
            (
                np.where(is_basic, z - lower_upper[0], signed),
                np.where(is_basic, lower_upper[1] - z, 0.0),
            )
        )

    def _step(
        self, entering: Variable, direction: Direction
    ) -> tuple[float, Variable | None, float]:
        """Return the length of the edge; the blocking variable, or None on a ray;
        and the rate at which its distance decreases.
        """
        lower_upper = self.bounds + self.t * self.rates if self.moves else self.bounds
        slacks = self._slacks(entering, self.z, self.w, lower_upper)
        rates = self._slacks(
            entering, direction.z, direction.w, direction.t * self.rates
        )
        noise = ROUNDING_RTOL * self._size
        slacks[slacks <= noise] = 0.0
        blocking = np.flatnonzero(
            (rates < -ROUNDING_RTOL * direction.size) & (slacks < np.inf)
        )
        ratios = slacks[blocking] / -rates[blocking]
        step = float(ratios.min(initial=np.inf))
        if direction.t:
            distance_to_end = max(
                self.span - self.t if direction.t > 0 else self.t, 0.0
            )
            full_step = distance_to_end / abs(direction.t)
            if (
                full_step <= step
                or (slacks[blocking] + full_step * rates[blocking]).min()
                >= -NEAR_END * self._size
            ):
                return full_step, Variable(T, self.n, direction.t), abs(direction.t)
        if step == np.inf:
            return step, None, 0.0
        tied = blocking[
            slacks[blocking] + step * rates[blocking]
            <= noise + ROUNDING_RTOL * slacks[blocking]
        ]
        k = int(tied[0]) if tied.size == 1 else self._first(entering, tied, rates)
        at, is_above = k % self.n, k >= self.n
        if self.statuses[at] == BASIC or (entering.kind == Z and at == entering.at):
            return step, Variable(Z, at, 1.0 if is_above else -1.0), -rates[k]
        return (
            step,
            Variable(W, at, -1.0 if self.statuses[at] == UPPER else 1.0),
            -rates[k],
        )

    def _first(self, entering: Variable, tied: Indices, rates: Vector) -> int:
        """Return, of tied components, the one that reaches its limit first if the data
        are perturbed.
        """
        system, nonbasic = self.system, self.statuses != BASIC
        z = np.where(nonbasic, self._of_state(self.perturbed_bounds), 0.0)
        w = self.perturbed_q.copy()
        for j in np.flatnonzero(z).tolist():
            w += z[j] * system.column(j)
        x = -system.solve(w)
        w += system.times(x)
        basic_z, t = self._spread(x)
        z += basic_z
        if self.moves:
            z += np.where(nonbasic, t * self._of_state(self.rates), 0.0)
        slacks = self._slacks(entering, z, w, self.perturbed_bounds + t * self.rates)
        return int(tied[np.argmin(slacks[tied] / -rates[tied])])

    def _shift(self, j: int, times: float) -> None:
        """Add z_j at its bound, multiplied by `times` (1 or -1), to `fixed`, and its
        rate to `moved`.
        """
        side = int(self.statuses[j] == UPPER)
        value, rate = self.bounds[side, j], self.rates[side, j]
        if value or rate:
            column = times * self.system.column(j)
            self.fixed = self.fixed + value * column
            if rate:
                self.system.moved = self.system.moved + rate * column

    def _exchange(self, entering: Variable, leaving: Variable) -> None:
        """Pivot: replace one variable in the basis by another, and update its inverse
        or factors."""
        system, moved = self.system, self.system.moved
        if entering.kind == Z:
            self._shift(entering.at, -1.0)
            self.statuses[entering.at] = BASIC
        if leaving.kind == Z:
            self.statuses[leaving.at] = UPPER if leaving.sign > 0 else LOWER
            self._shift(leaving.at, 1.0)
        old, new = (
            each.at + (self.n + 1) * (each.kind == W) for each in (leaving, entering)
        )
        if old != new:
            system.exchange(old, new)
        if system.moved is not moved and system.has(self.n):
            system.exchange(self.n, self.n)
        # These changes, or a small pivot, may have made the factors inaccurate.
        if system.age > MAX_CHANGES:
            system.refresh()

    def _recompute_vertex(self) -> None:
        """Recompute the vertex from its basis with one correction, and w from z."""
        system = self.system
        for is_refreshed in (False, True):
            lower_upper = (
                self.bounds + self.t * self.rates if self.moves else self.bounds
            )
            self.z = np.where(
                self.statuses == BASIC, self.z, self._of_state(lower_upper)
            )
            x = np.append(self.z, self.t)[system.cols]
            w = self.fixed + system.times(x)
            if not system.has(self.n):
                w += self.t * system.moved
            correction = system.solve(w)
            size = float(np.abs(correction).max(initial=0.0))
            if not size < np.inf:
                raise SingularMatrix
            if size > ROUNDING_RTOL * self._size:
                w -= system.times(correction)
            w[system.rows] = 0.0
            values = np.append(self.z, self.t)
            terms = np.where(
                (x == 0) & (size <= ROUNDING_RTOL * self._size), size, np.abs(x)
            )
            values[system.cols] = np.where(
                np.abs(x - correction) <= CANCELLED * terms, 0.0, x - correction
            )
            self.z = values[:-1]
            self.t = float(values[-1])
            self.w = w
            if is_refreshed or size <= LARGE_CORRECTION * self._size:
                return
            system.refresh()


def _change(first: Vector, last: Vector) -> Vector:
    """Return last - first, 0 for equal infinite numbers."""
    with np.errstate(invalid="ignore"):
        return np.where(first == last, 0.0, last - first)


Values = list[Fraction]
NOTHING = Fraction(0), Fraction(0)  # a bound that does not move, at 0


class ExactFamily:
    """The problems between two with the same M, in fractions: M_ij = rows[i][j] /
    scales[i] in integers; and q, l and u at s = 0 with their changes, None for infinite
    bounds.
    """

    def __init__(self, first: ExactProblem, last: ExactProblem) -> None:
        self._first = first
        self.n = first.n
        self.rows = first.rows
        self.scales = first.scales
        constants = [
            [Fraction(c, s) for c, s in zip(each.constants, each.scales, strict=True)]
            for each in (first, last)
        ]
        self.q = [(a, b - a) for a, b in zip(*constants, strict=True)]
        self.lower, self.upper = (
            [
                None if a is None or b is None else (a, b - a)
                for a, b in zip(*bounds, strict=True)
            ]
            for bounds in ((first.lower, last.lower), (first.upper, last.upper))
        )

    def w(self, s: Fraction, z: Values) -> Values:
        """Return w = M z + q at s."""
        return [
            w + s * change
            for w, (_, change) in zip(self._first.w(z), self.q, strict=True)
        ]

    def satisfies(
        self, statuses: BasisStatus, s: Fraction, z: Values, w: Values
    ) -> bool:
        """Return whether a point satisfies the conditions of a basis; if both endpoints
        of a piece do, so does every point of the piece.
        """
        for i, state in enumerate(statuses.tolist()):
            low, high = (
                bound and bound[0] + s * bound[1]
                for bound in (self.lower[i], self.upper[i])
            )
            if (low is not None and z[i] < low) or (high is not None and z[i] > high):
                return False
            if state == BASIC and w[i]:
                return False
            if state != BASIC and z[i] != (high if state == UPPER else low):
                return False
            if state * w[i] > 0 and low != high:
                return False
        return True


class ExactPivoting(pivoting.RationalPivoting):
    """The path in exact arithmetic from a basis at s = 0, with s as its parameter; form
    3 n + 1 is 1 - s.
    """

    def __init__(self, family: ExactFamily, statuses: BasisStatus) -> None:
        n, self.family = family.n, family
        bounds = list(zip(family.lower, family.upper, strict=True))
        self._bases = [low or high or NOTHING for low, high in bounds]
        self._signs = [-1 if low is None and high else 1 for low, high in bounds]
        form_of_z = self._form_of_z = [
            i if sign > 0 else 2 * n + i for i, sign in enumerate(self._signs)
        ]  # z_i - l_i, or u_i - z_i if there is only an upper bound
        signed = [
            3 * n,
            3 * n + 1,
            *(i for i, (low, _) in enumerate(bounds) if low is not None),
        ]
        signed += [2 * n + i for i, (_, high) in enumerate(bounds) if high is not None]
        signed += [
            n + i for i, (low, high) in enumerate(bounds) if low is None or low != high
        ]
        super().__init__(
            n,
            Dictionary(self._rows(), [*form_of_z, 3 * n], signed, raise_if_timed_out),
            statuses.tolist(),
        )
        self._begin()

    def _rows(self) -> dict[int, list[int]]:
        """Return the other forms in terms of s and the forms of z, each multiplied by a
        positive integer.
        """
        n = self.family.n
        family = self.family
        bases = self._bases
        signs = self._signs
        rows = {3 * n + 1: [1, *[0] * n, -1]}
        for i, (row, scale, (q, change)) in enumerate(
            zip(family.rows, family.scales, family.q, strict=True)
        ):
            raise_if_timed_out()
            constant = scale * q + sum(a * bases[j][0] for j, a in row.items())
            slope = scale * change + sum(a * bases[j][1] for j, a in row.items())
            rows[n + i] = whole_multiple(
                [
                    constant,
                    *(Fraction(signs[j] * row.get(j, 0)) for j in range(n)),
                    slope,
                ]
            )
            low, high = family.lower[i], family.upper[i]
            if low and high:
                unit = [Fraction(-(j == i)) for j in range(n)]
                rows[2 * n + i] = whole_multiple(
                    [high[0] - low[0], *unit, high[1] - low[1]]
                )
        return rows

    def _begin(self) -> None:
        """Pivot to the dictionary of the initial basis."""
        n, dictionary = self.n, self.dictionary
        entering_forms = [
            form
            for form, state in zip(self._form_of_z, self.statuses, strict=True)
            if state == BASIC
        ]
        for i, state in enumerate(self.statuses):
            if state == BASIC:
                columns = [
                    k
                    for k, form in enumerate(dictionary.cobasic, 1)
                    if form in entering_forms and dictionary.rows[n + i][k]
                ]
                entering_forms.remove(dictionary.cobasic[columns[0] - 1])
                dictionary.pivot(n + i, columns[0])
            elif state == UPPER:
                dictionary.negate(n + i)
                if self._signs[i] > 0:
                    dictionary.pivot(2 * n + i, self._column(i))

    @property
    def is_feasible(self) -> bool:
        """Return whether all signed forms are nonnegative at the point."""
        return all(
            row[0] >= 0
            for form, row in self.dictionary.rows.items()
            if form in self.dictionary.signed
        )

    def vertex(self) -> tuple[Fraction, Values]:
        """Return s and z at the point."""
        s = self.value_of(self.parameter)
        each = zip(self._bases, self._signs, self._form_of_z, strict=True)
        return s, [
            base + s * change + sign * self.value_of(form)
            for (base, change), sign, form in each
        ]

    def edges(self) -> Iterator[Edge]:
        """Yield the edges of the path one after another."""
        last = {self.parameter, self.parameter + 1}
        for pivot in self.follow(self.parameter, last):
            basis = np.array(pivot.statuses, np.int8)
            yield Edge(
                basis,
                pivot.rise,
                pivot.is_point,
                *self.vertex(),
                is_last=pivot.leaving in last,
            )
        if self.ray is not None:
            s, *rates = self.dictionary.direction(
                self._column(self.ray), [self.parameter, *self._form_of_z]
            )
            each = zip(self._bases, self._signs, rates, strict=True)
            z = [s * change + sign * rate for (_, change), sign, rate in each]
            yield Edge(
                np.array(self.statuses, np.int8),
                0,
                False,
                self.vertex()[0],
                z,
                is_ray=True,
                is_last=True,
            )
