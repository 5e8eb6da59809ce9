"""The verification of a path in floating-point arithmetic: of its breakpoints, and of
all points between them.

Each breakpoint has to solve its problem, with the q and the bounds at its t, by the
criterion of `solve`. A z_j that is 0 in exact arithmetic may have to be slightly
positive at a t that is rounded to double precision, or t has to be one of the adjacent
floating-point numbers: so replacements that differ by rounding errors are tested if a
breakpoint is no solution. Only at a jump may a row be violated by as much as the last
bit of t changes it: its points are solutions for a single t, which is hardly ever a
floating-point number.

On a piece z, w, q and the bounds are linear in t. For each row i take the terms |q|_i +
sum_j |M_ij| |z_j| over those numbers only that do not change their sign on the piece:
they are linear there, and no larger than the terms of the row. So if at both endpoints
the violations of the conditions of the piece's basis are at most the tolerance times
these terms, this holds at each point between them, which is then the exact solution of
a problem whose numbers differ by no more than the tolerance, relatively (Oettli and
Prager 1964, as in `verify.measure`). As t has a few correct digits less than double
precision, violations of NEGLIGIBLE times the numbers between which q(t) and z(t) vary
are allowed at the endpoints: (1 - s) |q_0| + s |q_1|, and |M| times the larger |z| of
both endpoints, or the same of a bound that moves. Components that are not basic have to
be at their bounds at both endpoints.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import ROUNDING
from lcpcli.linalg.matrices import absolute_product, is_sparse, product, row_errors
from lcpcli.model.box import LOWER, UPPER
from lcpcli.model.right_hand_sides import Columns
from lcpcli.parametric.path import Family
from lcpcli.typing import BasisStatus, Indices, Mask, Vector
from lcpcli.verify.acceptance import BY_CRITERION, accepted
from lcpcli.verify.measure import Measure, Rows
from lcpcli.verify.point import Criterion, Point, block_pivoting_points

# Violations at the endpoints of a piece by rounding of t, relative to the numbers that
# vary along it.
NEGLIGIBLE = 2.0**-44
# Limits on the change of z by a replacement: relative to the lengths of the adjacent
# pieces, plus relative to z at their endpoints.
SHARE, CHANGE_RTOL = 2.0**-10, 2.0**-32
# The numbers of ulps by which t may be changed.
ADJACENT, NEARBY = (1, -1), (16, -16, 256, -256)


def _before_and_after(pieces: Any) -> tuple[Any, Any]:
    """Return for each breakpoint the row of the piece before it, and that of the piece
    after it; at the first and the last breakpoint both are the same.
    """
    if not len(pieces):
        nothing = np.zeros((1, pieces.shape[1]), dtype=pieces.dtype)
        return nothing, nothing
    return np.concatenate((pieces[:1], pieces)), np.concatenate((pieces, pieces[-1:]))


class Breakpoints(NamedTuple):
    """Consecutive breakpoints, and the bases of the pieces between them.

    t, z, statuses : shapes (m,), (m, n) and (m - 1, n).
    """

    t: Vector
    z: Vector
    statuses: BasisStatus


@np.errstate(all="ignore")
def verify(
    family: Family,
    breakpoints: Breakpoints,
    tol: float,
    n_verified: int = 0,
    some: int | None = None,
) -> tuple[Vector, Vector, Vector, bool]:
    """Return verified breakpoints: t of shape (m,), z and w of shape (m, n), and
    whether they and the pieces between them are verified.

    n_verified : the number of first breakpoints that are results of an earlier call.
    some : how many are returned; the remaining ones, of which none has the t of the
        last returned one, are only neighbours.
    """
    verification = _Verification(family, breakpoints, tol, n_verified)
    n_returned = breakpoints.t.size if some is None else some
    is_verified = verification.verify_or_replace(
        range(n_verified, n_returned)
    ) and verification.are_pieces(n_returned)
    return (
        verification.t[:n_returned],
        verification.z[:n_returned],
        verification.w[:n_returned],
        is_verified,
    )


class _Verification:
    """The verification of breakpoints, which may be replaced by others that differ by
    rounding errors.
    """

    def __init__(
        self, family: Family, breakpoints: Breakpoints, tol: float, n_verified: int
    ) -> None:
        self.family = family
        self.t = breakpoints.t.copy()
        self.statuses = breakpoints.statuses
        self.tol = tol
        self.adjacent_states = _before_and_after(self.statuses)
        self.z = breakpoints.z.copy()
        self.z[n_verified:] = self._on_bounds(
            family.share(self.t[n_verified:]), slice(n_verified, None)
        )
        self._measure()

    def _on_bounds(self, s: Vector, some: slice) -> Vector:
        """Return the z of some breakpoints for these s: each component is exactly at
        the bound where it is on an adjacent piece, and otherwise within its bounds.
        """
        before, after = (bases[some] for bases in self.adjacent_states)
        low, high = self._bounds(s)
        z = np.where(
            (before == LOWER) | (after == LOWER), low, np.clip(self.z[some], low, high)
        )
        if not self.family.is_mixed:
            return z
        return np.where((before == UPPER) | (after == UPPER), high, z)

    def _bounds(self, s: Vector) -> tuple[Vector, Vector]:
        """Return the bounds at these s, shapes (m, n); scalars for problems that are
        not mixed."""
        if self.family.is_mixed:
            return self.family.bounds(s[:, np.newaxis])
        return np.zeros(()), np.full((), np.inf)

    def _measure(self) -> None:
        """Compute q, w = M z + q and |M| |z|; columns of M for which all z are 0 are
        skipped.
        """
        M, z = self.family.problem.M, self.z
        self.s = self.family.share(self.t)
        self.Q = self.family.q(self.s[:, np.newaxis])
        used = z.any(axis=0)
        if not is_sparse(M) and 2 * np.count_nonzero(used) < used.size:
            M, z = M[:, used], z[:, used]
        self.w = product(M, z.T).T + self.Q
        self.sizes = absolute_product(M, np.abs(z).T).T

    def verify_or_replace(self, some: range) -> bool:
        """Return whether these breakpoints solve their problems, if necessary after
        replacements.
        """
        if not np.isfinite(self.Q).all():
            return False
        doubtful = np.flatnonzero(~self._surely_solve()).tolist()
        runs = sorted({self._run(k) for k in doubtful if k in some})
        are_solutions = [self._verify_or_replace_run(*run) for run in runs]
        if runs:
            self._measure()
        return all(are_solutions)

    def _surely_solve(self) -> Mask:
        """Return which breakpoints solve their problems for all possible rounding
        errors in w.
        """
        low, high = (bound.T for bound in self._bounds(self.s))
        M = self.family.problem.M
        z = self.z
        block = Columns(M, self.Q.T, low, high).block(0, self.s.size)
        measure, terms = Measure(block), self.sizes + np.abs(self.Q)
        rows = Rows(self.w, terms, terms, row_errors(M, z, terms))
        measured_rows = rows if block.reference_z is None else measure.rows(z, self.w)
        return np.asarray(
            measure.surely_solves(z, measured_rows, self.tol) & block.are_moderate
        )

    def _run(self, k: int) -> tuple[int, int]:
        """Return the first breakpoint with the t of breakpoint k, and the first one
        after it with a different t.
        """
        others = np.flatnonzero(self.t != self.t[k])
        return int(others[others < k].max(initial=-1)) + 1, int(
            others[others > k].min(initial=self.t.size)
        )

    def _verify_or_replace_run(self, first: int, end: int) -> bool:
        """Return whether breakpoints with equal t solve their problems, or do so after
        a replacement, which is stored.
        """
        for t, Z in self._replacements(first, end):
            raise_if_timed_out()
            criterion = Criterion(self.family.at(t), self.tol)
            points = [Point(criterion, z) for z in Z]
            if all(
                self._is_small_change(k, point.z) and point.solves()
                for k, point in enumerate(points, first)
            ):
                self.t[first:end], self.z[first:end] = t, Z
                return True
        return end - first > 1 and any(
            self._jumps(first, end, steps) for steps in (0, *ADJACENT, *NEARBY)
        )

    def _replacements(self, first: int, end: int) -> Iterator[tuple[float, Vector]]:
        """Yield t and z that differ from those of breakpoints with equal t by rounding
        errors, the cheapest ones first.
        """
        for steps in (0, *ADJACENT):
            yield from self._moved(first, end, steps)
        t = float(self.t[first])
        criterion = Criterion(self.family.at(t), self.tol)
        points = [Point(criterion, z) for z in self.z[first:end]]
        problem, replaced = criterion.problem, []
        for point in points:
            acceptance = accepted(problem, [point], self.tol, BY_CRITERION)
            replaced.append(point.z if acceptance is None else acceptance.point.z)
        yield t, np.array(replaced)
        if end - first == 1:
            for steps in (0, *ADJACENT):
                yield from self._basic(first, steps)
        for steps in NEARBY:
            yield from self._moved(first, end, steps)

    def _basic(self, k: int, steps: int) -> Iterator[tuple[float, Vector]]:
        """Yield t of a breakpoint changed by `steps` ulps, and basic solutions for the
        bases of the adjacent pieces.
        """
        adjacent = {
            basis.tobytes(): basis for basis in self.statuses[max(k - 1, 0) : k + 1]
        }.values()
        for t, _ in self._moved(k, k + 1, steps):
            yield from (
                (t, z[np.newaxis])
                for basis in adjacent
                for z in block_pivoting_points(self.family.at(t), basis)
            )

    def _moved(
        self, first: int, end: int, steps: int
    ) -> Iterator[tuple[float, Vector]]:
        """Yield the common t of the breakpoints from `first` to before `end` changed by
        `steps` ulps, and z for it. Unless `steps` is 0, yield nothing if t is an end of
        its range, or would reach or pass such an end or an adjacent breakpoint.
        """
        family, unmoved = self.family, float(self.t[first])
        t = unmoved + steps * self._last_bit(first)
        adjacent = [
            *(float(self.t[k]) for k in (first - 1, end) if 0 <= k < self.t.size),
            family.start,
            family.stop,
        ]
        if not steps or all((t - other) * (unmoved - other) > 0 for other in adjacent):
            yield (
                t,
                self._on_bounds(
                    np.full(end - first, family.share(t)), slice(first, end)
                ),
            )

    def _last_bit(self, k: int) -> float:
        """Return the smallest change of t that changes both t and s in floating-point
        arithmetic.
        """
        return float(
            max(
                np.spacing(abs(self.t[k])),
                np.spacing(self.s[k]) * (self.family.stop - self.family.start),
            )
        )

    def _is_small_change(self, k: int, z: Vector) -> bool:
        """Return whether z differs little from that of a breakpoint, compared with it
        and with the adjacent breakpoints.
        """
        some = self.z[max(k - 1, 0) : k + 2]
        max_change = SHARE * np.abs(some - self.z[k]).max(
            axis=0
        ) + CHANGE_RTOL * np.abs(some).max(axis=0)
        return bool((np.abs(z - self.z[k]) <= max_change).all())

    def _jumps(self, first: int, end: int, steps: int) -> bool:
        """Return whether the breakpoints of a jump solve their problems up to the last
        bit of t, with t changed by `steps` ulps; if so, store t and z.
        """
        family, tol = self.family, max(self.tol, ROUNDING)
        for t, Z in self._moved(first, end, steps):
            bit = self._last_bit(first)
            endpoints = [
                family.at(min(max(t + side * bit, family.start), family.stop))
                for side in (-1, 1)
            ]
            first_bounds, last_bounds = (
                np.array(problem.box.vectors(Z.shape[1])) for problem in endpoints
            )
            # The difference of infinite bounds is NaN; they do not change.
            moves = np.nan_to_num(np.abs(last_bounds - first_bounds)).max(axis=0)
            changes = np.abs(endpoints[1].q - endpoints[0].q) + absolute_product(
                family.problem.M, moves
            )
            criterion = Criterion(family.at(t), self.tol)
            for z in Z:
                point = Point(criterion, z)
                is_wrong = ~(point.relative_residuals <= tol)
                if not (
                    criterion.problem.box.excess(z, point.w)[is_wrong]
                    <= changes[is_wrong]
                ).all():
                    return False
            self.t[first:end], self.z[first:end] = t, Z
            return True
        return False

    def are_pieces(self, n_breakpoints: int) -> bool:
        """Return whether on each piece between the first breakpoints both endpoints
        satisfy the conditions of its basis.
        """
        keeps = _keeps_sign(self.z)
        sizes = self.sizes
        z = self.z
        Q = self.Q
        if not keeps.all():
            sizes = absolute_product(
                self.family.problem.M, np.where(keeps, np.abs(z), 0.0).T
            ).T
        allowed = max(self.tol, ROUNDING) * (
            sizes + np.where(_keeps_sign(Q), np.abs(Q), 0.0)
        )
        bases = self.statuses[: n_breakpoints - 1]
        if not self._are_at_bounds(bases):
            return False
        w = np.where(self.family.is_fixed, 0.0, self.w)
        for offset in (0, 1):
            breakpoints = slice(offset, len(bases) + offset)
            violations = np.where(
                bases == LOWER,
                -w[breakpoints],
                np.where(bases == UPPER, w[breakpoints], np.abs(w[breakpoints])),
            )
            is_wrong = ~(violations <= allowed[breakpoints])
            for k in np.flatnonzero(is_wrong.any(axis=1)).tolist():
                rows = np.flatnonzero(is_wrong[k])
                if not (
                    violations[k, rows] <= self._rounding(k, k + offset, rows)
                ).all():
                    return False
        return bool(np.isfinite(self.t).all())

    def _are_at_bounds(self, statuses: BasisStatus) -> bool:
        """Return whether at both endpoints of each piece the components that are not
        basic are at their bounds, but for rounding of t. Elsewhere edges of the path
        have been treated as points, as they are short compared with the largest z.
        """
        low, high = self._bounds(self.s)
        from_low, from_high = np.abs(self.z - low), np.abs(high - self.z)
        larger = np.abs(self.z)
        larger[1:] = np.maximum(larger[1:], np.abs(self.z[:-1]))
        larger[:-1] = np.maximum(larger[:-1], np.abs(self.z[1:]))
        for ends in (slice(len(statuses)), slice(1, len(statuses) + 1)):
            distances = np.where(
                statuses == LOWER,
                from_low[ends],
                np.where(statuses == UPPER, from_high[ends], 0.0),
            )
            if not (distances <= CHANGE_RTOL * larger[ends]).all():
                return False
        return True

    def _rounding(self, piece: int, k: int, rows: Indices) -> Vector:
        """Return the violations that rounding of t may cause in some rows at breakpoint
        k, an endpoint of a piece.
        """
        larger = np.maximum(
            np.abs(self.z[piece : piece + 2]).max(axis=0),
            self.family.sizes_of_moving_bounds(self.s[k]),
        )
        first, last = (
            np.abs(problem.q[rows]) for problem in (self.family.problem, self.family.to)
        )
        moved = (1 - self.s[k]) * first + self.s[k] * last
        return np.asarray(
            NEGLIGIBLE * (absolute_product(self.family.problem.M[rows], larger) + moved)
        )


def _keeps_sign(values: Vector) -> Mask:
    """Return where values at breakpoints, shape (m, n), do not change their sign on an
    adjacent piece.
    """
    changes = values[:-1] * values[1:] < 0
    before, after = (
        _before_and_after(changes)
        if len(changes)
        else (np.zeros(values.shape, dtype=bool),) * 2
    )
    return np.asarray(~(before | after))
