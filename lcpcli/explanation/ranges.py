"""Ranging: how far each cost and each row side of a solved program may change, the
others being fixed, while its optimal basis stays the same (G. B. Dantzig, Linear
Programming and Extensions, Princeton University Press 1963, section 12-4).

For the basic components B, M_BB z_B = -q_B - M_BN z_N, where the others are at bounds.
The derivatives of z and w with respect to a number are solutions of a system with this
matrix; the range ends where the first z_B reaches a bound, or the first w_N becomes 0.
It is computed in floating-point arithmetic, as the solution is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from lcpcli.explanation.conditions import LOWER, RANGE, ROW, Number, System
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.factors import checked_solver
from lcpcli.linalg.matrices import product
from lcpcli.model import box
from lcpcli.parametric.following import basic_states
from lcpcli.typing import BasisStatus, Vector

RELATIVE_ZERO = 1e-10  # of derivatives, in relation to the largest one


class End(NamedTuple):
    """A limit of a range: the number there, and what changes beyond it, in words."""

    value: float
    change: str


class Range(NamedTuple):
    """The range of a number. below, above : its limits, None where it has none."""

    number: Number
    value: float
    below: End | None
    above: End | None


def ranges(system: System, z: Vector) -> Iterator[Range]:
    """Yield the ranges of the costs and row sides of a program with a solution z; none
    if no basis of it is computed.
    """
    basis = _Basis.of(system, z)
    if basis is None:
        return
    for number in system.numbers:
        if number.is_default:
            raise_if_timed_out()
            yield basis.range(number)


class _Basis:
    """A basis of a solution, with gaps that it keeps nonnegative: of each basic
    component from its lower and from its upper bound, and w of the others, times -1 at
    an upper bound.
    """

    def __init__(self, system: System, z: Vector, states: BasisStatus) -> None:
        self._system, self._problem, self._z = system, system.data.problem, z
        self._states = states
        self._basic = np.flatnonzero(states == box.BASIC)
        self._others = np.flatnonzero(states != box.BASIC)
        block = self._problem.M[self._basic][:, self._basic]
        self._solve = (
            checked_solver(block) if self._basic.size else lambda b, _=False: b
        )
        low, high = self._problem.box.vectors(system.n)
        # A component with equal bounds never leaves them.
        self._sign = np.where(states == box.UPPER, -1.0, 1.0)[self._others]
        w = self._sign * (product(self._problem.M, z) + self._problem.q)[self._others]
        w[(low == high)[self._others]] = np.inf
        distances = (z - low)[self._basic], (high - z)[self._basic]
        self._gaps = np.maximum(np.concatenate((*distances, w)), 0.0)

    @classmethod
    def of(cls, system: System, z: Vector) -> _Basis | None:
        """Return a basis of a solution; None if there is a line of solutions, or its
        matrix is singular in floating-point arithmetic.
        """
        problem = system.data.problem
        is_fixed = np.equal(*problem.box.vectors(system.n))
        states = basic_states(problem, z, product(problem.M, z) + problem.q, is_fixed)
        try:
            return None if states is None else cls(system, z, states)
        except np.linalg.LinAlgError:
            return None

    def range(self, number: Number) -> Range:
        """Return the range of a number, in the author's sense."""
        value = float(self._system.value(number))
        i, z = number.at, float(self._z[number.at])
        state = box.LOWER if number.field == LOWER else box.UPPER
        if number.field != "q" and self._states[i] != state:
            end = End(z, self._binds(i))
            is_lower = number.field == LOWER
            return Range(number, value, *((None, end) if is_lower else (end, None)))
        rates = self._rates(number)
        ends = (self._end(value, rates, sign * number.sense) for sign in (-1, 1))
        below, above = (
            end and End(value + (end.value - value) * number.sense, end.change)
            for end in ends
        )
        return Range(number, value, below, above)

    def _rates(self, number: Number) -> Vector:
        """Return the derivatives of the gaps by a number of the problem."""
        n, i, M = self._system.n, number.at, self._problem.M
        unit, dz = np.zeros(n), np.zeros(n)
        unit[i] = 1.0
        if number.field != "q":
            dz, unit = unit, product(M, unit)
        if self._basic.size:
            dz[self._basic] = -self._solve(unit[self._basic])
        dw = product(M, dz) + (unit if number.field == "q" else 0.0)
        dw = self._sign * dw[self._others]
        rates: Vector = np.concatenate((dz[self._basic], -dz[self._basic], dw))
        rates[np.abs(rates) <= RELATIVE_ZERO * np.abs(rates).max(initial=0.0)] = 0.0
        return rates

    def _end(self, value: float, rates: Vector, sign: int) -> End | None:
        """Return the limit of a number as it increases, or decreases for -1."""
        falls = np.flatnonzero((sign * rates < 0) & np.isfinite(self._gaps))
        if not falls.size:
            return None
        steps = self._gaps[falls] / np.abs(rates[falls])
        k = int(np.argmin(steps))
        return End(value + sign * float(steps[k]), self._change(int(falls[k])))

    def _change(self, k: int) -> str:
        """Return what happens where a gap becomes 0."""
        size = self._basic.size
        if k >= 2 * size:
            return self._unbinds(int(self._others[k - 2 * size]))
        return self._binds(int(self._basic[k % size]))

    def _binds(self, i: int) -> str:
        """Return what happens where component i reaches a bound."""
        name, kind, _ = self._system.components[i]
        if kind == ROW:
            return f"row {name} stops binding"
        return f"row {name} binds" if kind == RANGE else f"{name} reaches a bound"

    def _unbinds(self, i: int) -> str:
        """Return what happens where component i leaves its bound."""
        name, kind, _ = self._system.components[i]
        if kind == RANGE:
            return f"row {name} stops binding"
        return f"row {name} binds" if kind == ROW else f"{name} leaves its bound"
