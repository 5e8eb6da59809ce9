"""The parts of a path, each of which is verified as soon as it is found."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.interrupts import deferring_signals
from lcpcli.parametric.exact_pivoting import ExactFamily
from lcpcli.parametric.family import Family
from lcpcli.parametric.path import ExactPath, Path
from lcpcli.parametric.verified import Verified, verify
from lcpcli.rational.numbers import rounded
from lcpcli.typing import States

AT_ONCE = 500_000  # numbers of z from which on a part is made
LEAST_AT_ONCE = 4  # breakpoints of a part


class _Point(NamedTuple):
    """A breakpoint: s and z; for a path in fractions also w; and the states on the piece before, None for the first."""

    s: Any
    z: Any
    w: Any
    states: States | None


class Parts:
    """The breakpoints of a path, those that no part has yet but for the first two, which end the part before.

    found : the parts that are made; each begins with the last two breakpoints of the previous one.
    exact : the problems of a path in fractions, else None.
    """

    def __init__(self, family: Family, tol: float) -> None:
        self.family, self.tol, self.count, self.found = family, tol, 0, list[Path]()
        self.exact: ExactFamily | None = None
        self._points: list[_Point] = []
        self._known: Verified | None = None  # the first two points

    @property
    def last(self) -> _Point:
        """Return the last breakpoint."""
        return self._points[-1]

    def add(self, s: Any, z: Any, states: States | None) -> None:
        """Add a breakpoint, and the states on the piece before it; make a part of those before if there are many."""
        self._points.append(self._point(s, z, states))
        self.count += 1
        if len(self._points) * self.family.problem.n < AT_ONCE or len(self._points) <= LEAST_AT_ONCE:
            return
        t = [self.family.t_of(float(point.s)) for point in self._points]
        some = next((k for k in range(len(t) - 1, 0, -1) if t[k] != t[k - 1]), 0)  # the others have the last t
        if some > LEAST_AT_ONCE // 2:
            part, first = self._part(some), some - 2
            with deferring_signals():
                self.found.append(part)
                self._points = self._points[first:]
                self._known = Verified(part.t[first:], part.z[first:], part.w[first:], part.verified)

    def replace_last(self, s: Any, z: Any) -> None:
        """Put another point in the place of the last breakpoint."""
        self._points[-1] = self._point(s, z, self.last.states)

    def rest(self) -> Path:
        """Return the last part."""
        if self._points:
            return self._part(len(self._points))
        none, exact = np.zeros((0, self.family.problem.n)), ExactPath([], [], []) if self.exact is not None else None
        return Path(self.family, np.zeros(0), none, none, none.astype(np.int8), "", "", False, 0.0, exact=exact)

    def _point(self, s: Any, z: Any, states: States | None) -> _Point:
        return _Point(s, z, None if self.exact is None else self.exact.w(s, z), states)

    def _part(self, some: int) -> Path:
        """Return some of the points as a part of the path, verified."""
        pieces = [point.states for point in self._points[1:]]
        states = np.array(pieces, dtype=np.int8).reshape(len(pieces), self.family.problem.n)
        exact, own = self._proved(states, some) if self.exact is not None else (None, self._verified(states, some))
        is_verified = own.is_verified and (self._known is None or self._known.is_verified)
        return Path(self.family, own.t, own.z, own.w, states[: some - 1], "", "", is_verified, 0.0, exact=exact)

    def _verified(self, states: States, some: int) -> Verified:
        """Return some of the points as far as they are verified."""
        t = np.array([self.family.t_of(float(point.s)) for point in self._points])
        z, known = np.array([point.z for point in self._points]), 0
        if self._known is not None:
            known = self._known.t.size
            t[:known], z[:known] = self._known.t, self._known.z
        return verify(self.family, t, z, states, self.tol, known, some)

    def _proved(self, states: States, some: int) -> tuple[ExactPath, Verified]:
        """Return some of the points in fractions, and rounded, and whether both ends of each piece satisfy its
        conditions."""
        family, exact, points = self.family, self.exact, self._points[:some]
        assert exact is not None
        proved = all(
            exact.satisfies(piece, *end[:3])
            for piece, *both in zip(states, points, points[1:], strict=False)
            for end in both
        )
        start, stop = Fraction(family.start), Fraction(family.stop)
        t = [start + point.s * (stop - start) for point in points]
        own = ExactPath(t, [point.z for point in points], [point.w for point in points])
        z, w = (np.array([rounded(row) for row in rows]).reshape(some, -1) for rows in own[1:])
        return own, Verified(np.array([family.t_of(float(point.s)) for point in points]), z, w, proved)
