"""The problems between two that share M: their q and their bounds move linearly."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import OptionError, ProblemError
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import FROM_0
from lcpcli.model.problem import M_FIELDS, Problem, conditions_of
from lcpcli.typing import Mask, Matrix, Vector


class Family:
    """The problems with the data (1 - s) FROM + s TO, where t = a + s (b - a), 0 <= s <= 1.

    problem, to : the problems FROM and TO. Raises ProblemError unless they share M and, up to their values, the bounds.
    start, stop : a and b, two numbers, a < b, else it raises OptionError.
    """

    def __init__(self, problem: Problem, to: Problem, start: float = 0.0, stop: float = 1.0) -> None:
        if not (math.isfinite(start) and math.isfinite(stop) and start < stop):
            raise OptionError("start", f"is {start:g}, and stop {stop:g}", "give finite numbers, start < stop")
        _refuse_different(problem, to)
        self.problem, self.to, self.start, self.stop = problem, to, start, stop
        self._last = start, problem

    def share(self, t: Any) -> Any:
        """Return s of t, a number or an array."""
        return (t - self.start) / (self.stop - self.start)

    def t_of(self, share: float) -> float:
        """Return t of s, exactly a and b at the ends."""
        return self.start * (1 - share) + self.stop * share

    def q(self, share: Vector | float) -> Vector:
        """Return q at s, exactly those of both problems at the ends; for s of shape (m, 1) of shape (m, n)."""
        return _between(self.problem.q, self.to.q, share)

    def bounds(self, share: Vector | float) -> tuple[Vector, Vector]:
        """Return l and u at s, of shapes as q."""
        low, high = (_between(*ends, share) for ends in self._bounds)
        return low, high

    @cached_property
    def _bounds(self) -> tuple[tuple[Vector, Vector], tuple[Vector, Vector]]:
        first, last = conditions_of(self.problem), conditions_of(self.to)
        return (first.lower, last.lower), (first.upper, last.upper)

    @cached_property
    def has_moving_bounds(self) -> bool:
        """Return whether a bound moves."""
        return any(not np.array_equal(*ends) for ends in self._bounds)

    @cached_property
    def is_fixed(self) -> Mask:
        """Return where both bounds are equal throughout, so that w_i may have any sign."""
        (low, last_low), (high, last_high) = self._bounds
        return np.asarray((low == high) & (last_low == last_high))

    @property
    def is_mixed(self) -> bool:
        """Return whether one of the problems has bounds other than z >= 0."""
        return self.problem.is_mixed or self.to.is_mixed

    def at(self, t: float) -> Problem:
        """Return the problem at t, with its numbers rounded to doubles; with what is known of M, as it is the same."""
        if self._last[0] != t:
            share, before = self.share(t), vars(self._last[1])
            low, high = self.bounds(share) if self.is_mixed else (0.0, np.inf)
            problem = Problem(self.problem.M, self.q(share), self.problem.name, lower=low, upper=high)
            self._last = t, problem.knowing(**{name: before[name] for name in M_FIELDS if name in before})
        return self._last[1]


def _between(first: Vector, last: Vector, share: Vector | float) -> Vector:
    """Return (1 - share) first + share last, and infinite entries as they are."""
    same = first == last
    with np.errstate(invalid="ignore"):
        moved: Vector = (1 - share) * first + share * last
    return np.where(same, first, moved)


def _refuse_different(problem: Problem, to: Problem) -> None:
    if problem.n != to.n:
        raise ProblemError("n", f"is {problem.n} and {to.n}", "give two problems with the same unknowns")
    if not _equal(problem.M, to.M):
        raise ProblemError("M", "differs between the two problems", "give two problems with one M")
    first, last = conditions_of(problem), conditions_of(to)
    for field in ("lower", "upper"):
        differs = np.isfinite(getattr(first, field)) != np.isfinite(getattr(last, field))
        for i in np.flatnonzero(differs)[:1].tolist():
            fault = "is finite in one problem and infinite in the other"
            raise ProblemError(f"{field}[{i}]", fault, f"give bounds that are finite in both or in neither {FROM_0}")


def _equal(A: Matrix, B: Matrix) -> bool:
    if A is B:
        return True
    if is_sparse(A) != is_sparse(B):
        with imports:
            from lcpcli.linalg.matrices import dense
        A, B = dense(A), dense(B)
    return A.shape == B.shape and not (A != B).sum()
