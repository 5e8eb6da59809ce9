"""Fits of many right-hand sides b with the same A, by block pivots for all of them at
once.

The free coefficients of each fit are guessed by means of A'A, whose systems are solved
once for each set of free coefficients that occurs. The solutions are then corrected by
residuals of A itself: A. Bjorck, Stability analysis of the method of seminormal
equations for linear least squares problems, Linear Algebra Appl. 88/89 (1987) 31-48.
Fits with signs that rounding errors leave uncertain are solved one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.formulations.least_squares.active_set import (
    LARGE_RESIDUAL,
    UNREFINED,
    column_norms,
)
from lcpcli.formulations.least_squares.at_once import METHOD, FitResult, Fits
from lcpcli.formulations.least_squares.optimality import holds
from lcpcli.formulations.least_squares.scaling import Scaled
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.right_hand_sides import Stack
from lcpcli.options import DEFAULTS
from lcpcli.solving.many import Batch
from lcpcli.solving.result import Result
from lcpcli.typing import BasisStatus, Indices, Mask, Matrix, Vector

MAX_COEFFICIENTS = 64  # a set of free coefficients is one integer of 64 bits
MAX_ROUNDS = 20
CORRECTIONS = 2


class FitBatch(Batch):
    """The results of fits with the same A, as of `lcpcli.lsq` for a b of shape (m, k):
    `batch[i]` is the Result of column i, whose `answer` is its fit.

    x : the coefficients of all fits, shape (k, n). The row of an unsolved fit is nan.
    """

    def __init__(self, fits: Fits, single: Callable[[Vector], Result]) -> None:
        began = seconds()
        self._fits = fits
        (m, k), n = fits.data.b.shape, fits.data.lower.size
        self._results, self._rows = dict[int, Result](), None
        self._stopwatch = Stopwatch(seconds, began)
        self.z: Vector = np.full((k, m + n + fits.data.d.size), np.nan)
        self.solved: Mask = together(fits, self.z)
        self._steps = 1
        self._stopwatch.count("solve")
        for i in (~self.solved).nonzero()[0].tolist():
            result = self._results[i] = single(fits.data.b[:, i])
            self.solved[i] = result.solved
            self.z[i] = result.z if result.solved else np.nan
        self.z.flags.writeable = self.solved.flags.writeable = False
        self.x: Vector = self.z[:, m : m + n]

    @cached_property
    def _stack(self) -> Stack:  # type: ignore[override]
        first = self._fits.problem(0)
        Q = np.array([self._fits.problem(i).q for i in range(len(self.z))])
        M = first.M if isinstance(first.M, np.ndarray) else first.M.toarray()
        stacked = np.broadcast_to(M, (len(Q), *M.shape))
        return Stack(stacked, Q, first.lower, first.upper, np.inf)

    def __len__(self) -> int:
        return len(self.z)

    def __repr__(self) -> str:
        solved = np.count_nonzero(self.solved)
        return f"<Batch: {solved} of {len(self)} fits solved, n = {self.x.shape[1]}>"

    def __getitem__(self, index: Any) -> Any:
        if not isinstance(index, slice):
            i = range(len(self))[index]
            if i not in self._results:
                parts = self._stopwatch.parts.items()
                shares = {part: spent / len(self) for part, spent in parts}
                row: Any = self._fits, i, self.z
                self._results[i] = FitResult.of_solution(
                    (METHOD,), 1, DEFAULTS, {}, shares, _row=row
                )
            return self._results[i]
        return [self[i] for i in range(*index.indices(len(self)))]


class _System(NamedTuple):
    """The scaled data of k fits; b, c, d and the bounds have one row for each of them.

    K : [A'A E'; E 0], shape (n + e, n + e), for e equations.
    c, d : A'b and d.
    lower, upper : the bounds.
    """

    A: Matrix
    E: Matrix
    K: Matrix
    b: Vector
    c: Vector
    d: Vector
    lower: Vector
    upper: Vector

    def part(self, rows: Indices) -> _System:
        """Return the fits with these indices."""
        selected = (each[rows] for each in self[3:])
        return _System(*self[:3], *selected)


def _system(fits: Fits, scaled: Scaled, sides: Indices) -> _System:
    data, scaled_data = fits.data, scaled.data
    A, E = scaled_data.A, scaled_data.E
    k, n = len(sides), A.shape[1]
    K = np.zeros((n + len(E), n + len(E)))
    K[:n, :n] = A.T @ A
    K[n:, :n] = E
    K[:n, n:] = E.T
    b = np.ldexp(data.b.T, -sides)
    d = np.ldexp(np.broadcast_to(data.d, (k, len(E))), -sides - scaled.rows)
    low, high = (
        np.ldexp(np.broadcast_to(bound, (k, n)), scaled.columns - sides)
        for bound in (data.lower, data.upper)
    )
    return _System(A, E, K, b, b @ A, d, low, high)


@np.errstate(all="ignore")
def together(fits: Fits, z: Vector) -> Mask:
    """Fill in the rows of z whose fits are solved so that all signs are certain, and
    return which rows these are.
    """
    data = fits.data
    k, n = data.b.shape[1], data.lower.size
    none = np.zeros(k, dtype=bool)
    if k < 2 or n > MAX_COEFFICIENTS or not isinstance(data.A, np.ndarray):
        return none
    scaled = Scaled.of(data._replace(b=data.b[:, 0]))
    sides = np.frexp(np.abs(data.b).max(axis=0, initial=0.0))[1][:, np.newaxis]
    system = _system(fits, scaled, sides)
    try:
        statuses, inverses, x, y = _exchanged(system)
    except np.linalg.LinAlgError:
        return none
    free = statuses == BASIC
    for _ in range(CORRECTIONS):
        r = system.b - x @ system.A.T
        rest = np.hstack((r @ system.A + y @ system.E, system.d - x @ system.E.T))
        rest[:, :n] *= free
        step = np.einsum("kij,kj->ki", inverses, rest)
        x = x + step[:, :n]
        y = y - step[:, n:]
    r = system.b - x @ system.A.T
    clear = _are_clear(system, statuses, inverses, x, r, y)
    back = sides - scaled.columns
    coefficients = np.clip(np.ldexp(x, back), data.lower, data.upper)
    residuals, multipliers = np.ldexp(r, sides), np.ldexp(y, sides - scaled.rows)
    clear &= holds(data, residuals.T, coefficients.T, multipliers.T)
    z[clear] = np.hstack((residuals, coefficients, multipliers))[clear]
    return clear


def _exchanged(system: _System) -> tuple[BasisStatus, Vector, Vector, Vector]:
    """Return the statuses of the coefficients, the inverses of the systems of the free
    ones, x and y, to which block pivots on all infeasible coefficients lead. For some
    fits the pivoting may not have reached a solution; the caller has to check that.
    """
    k, n = system.lower.shape
    size = len(system.K)
    statuses = np.zeros((k, n), dtype=np.int8)
    inverses, solutions = np.empty((k, size, size)), np.empty((k, size))
    others = np.arange(k)  # the fits whose bases have changed
    for _ in range(MAX_ROUNDS):
        part = system.part(others)
        states_of_part = statuses[others]
        free = states_of_part == BASIC
        inverses[others] = _inverses(system.K, free)
        x = np.where(
            free, 0.0, np.where(states_of_part == UPPER, part.upper, part.lower)
        )
        rest = np.hstack((part.c, part.d)) - x @ system.K[:, :n].T
        rest[:, :n] *= free
        values = np.einsum("kij,kj->ki", inverses[others], rest)
        values[:, :n] += x
        solutions[others] = values
        x = values[:, :n]
        slopes = values @ system.K[:, :n] - part.c
        below, above = free & (x < part.lower), free & (x > part.upper)
        turned = (slopes * states_of_part > 0) & (part.lower < part.upper)
        changed = below | above | turned
        states_of_part = np.where(below, LOWER, np.where(above, UPPER, states_of_part))
        is_changed = changed.any(axis=1)
        if not is_changed.any():
            break
        statuses[others] = np.where(turned, BASIC, states_of_part)
        others = others[is_changed]
    return statuses, inverses, solutions[:, :n], -solutions[:, n:]


def _inverses(K: Matrix, free: Mask) -> Vector:
    """Return for each fit the inverse of the rows and columns of K that belong to the
    free coefficients and to the equations, with zeros elsewhere. It is computed once
    for all fits with the same free coefficients.
    """
    n = free.shape[1]
    keys = free @ (np.uint64(1) << np.arange(n, dtype=np.uint64))
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    is_free = np.ones((len(first), len(K)))
    is_free[:, :n] = free[first]
    both = is_free[:, :, np.newaxis] * is_free[:, np.newaxis, :]
    units = np.eye(len(K)) * (1 - is_free)[:, :, np.newaxis]
    return np.asarray((np.linalg.inv(K * both + units) * both)[which])


def _are_clear(
    system: _System,
    statuses: BasisStatus,
    inverses: Vector,
    x: Vector,
    r: Vector,
    y: Vector,
) -> Mask:
    """Return for each fit whether the signs of all coefficients and multipliers are
    correct in spite of rounding errors (as `active_set.are_clear` does for one fit).
    """
    n, norms = x.shape[1], column_norms(system.A)
    free = statuses == BASIC
    sizes = np.sqrt(np.einsum("ij,ij->i", r, r))
    of_b = np.sqrt(np.einsum("ij,ij->i", system.b, system.b))
    terms = of_b + np.abs(x) @ norms
    # The inverse of B'B has the squared norms of the rows of the pseudoinverse of B on
    # its diagonal. B are the free columns of A.
    rows = np.sqrt(np.maximum(np.diagonal(inverses, axis1=1, axis2=2)[:, :n], 0.0))
    largest = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    of_free = np.sqrt(free @ norms**2)
    errors = rows * (terms + largest * of_free * sizes)[:, np.newaxis]
    gaps = np.minimum(x - system.lower, system.upper - x)
    clear = (gaps > UNREFINED * errors) | ~free
    slopes = (r @ system.A + y @ system.E) * statuses
    noise = norms * (terms + largest * sizes)[:, np.newaxis]
    noise += np.abs(y) @ np.abs(system.E)
    clear &= (slopes > UNREFINED * noise) | free | (system.lower == system.upper)
    return np.asarray(clear.all(axis=1) & (sizes > LARGE_RESIDUAL * terms))
