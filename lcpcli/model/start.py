"""Where a run on a problem starts, and the states of variables in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.errors import ParameterError, ProblemError, count, kind
from lcpcli.linalg.doubles import size
from lcpcli.model.arrays import FROM_0, as_vector, by_names, refuse_infinite
from lcpcli.model.box import BASIC, UPPER, WORDS
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector, VectorLike

FAR_START = 0.5  # of the largest |q_ref|_i: the natural residual from which on a z is no better than none
_STATES = {word: state for state, word in WORDS.items()}


class Start:
    """The start of a run: the states that are tried first, x = (z - w) / 2, and z if it is given.

    gap : the natural residual at z; infinite if no z is given.
    """

    def __init__(
        self, problem: Problem, basis: States | None = None, x: Vector | None = None, z: Vector | None = None
    ) -> None:
        self.problem, self._basis, self._x, self.z, self.gap = problem, basis, x, z, math.inf
        if z is not None:
            w = problem.w(z)
            self.gap = size(problem.box.gaps(z, w))
            refuse_infinite("M z0 + q", w)

    @property
    def is_near(self) -> bool:
        """Return whether a z is given whose natural residual is so small that its states may be those of a solution."""
        return self.gap < FAR_START * size(self.problem.q_ref)

    @property
    def known_to_auto(self) -> dict[str, bool]:
        return {"states": True} if self._basis is not None else {"near": True} if self.is_near else {}

    @cached_property
    def basis(self) -> States:
        if self._basis is not None:
            return self._basis
        return self.problem.box.basis_of(self.x) if self.z is None else self.problem.box.basis_at(self.z)

    @cached_property
    def x(self) -> Vector:
        if self._x is not None:
            return self._x
        if self.z is not None:
            return self.problem.box.x_of(self.z, self.problem.w(self.z))
        return x_in(self.problem, self.basis)


@np.errstate(all="ignore")
def start_at(problem: Problem, x0: VectorLike | None, z0: VectorLike | None, basis: Any = None) -> Start:
    """Return the start that is given: x0, or the x of z0 and w = M z0 + q, or an x with the states of a basis."""
    given = [name for name, value in (("basis", basis), ("z0", z0), ("x0", x0)) if value is not None]
    if len(given) > 1:
        raise ParameterError(given[0], f"gives the starting point, and so does {given[-1]}", "leave one out")
    if basis is not None:
        return Start(problem, basis_of_words(problem, basis))
    x0, z0 = by_names(lambda: problem.names, x0=x0, z0=z0)
    if z0 is not None:
        return Start(problem, z=as_vector("z0", z0, problem.n))
    return Start(problem, x=as_vector("x0", x0, problem.n))


def basis_of_words(problem: Problem, basis: Sequence[str]) -> States:
    """Return the states that are given in words, one for each variable."""
    n = problem.n
    if not isinstance(basis, (list, tuple, np.ndarray)):
        raise ProblemError("basis", f"is {kind(basis)}", f"give a list of the words {', '.join(WORDS.values())}")
    if len(basis) != n:
        raise ProblemError("basis", f"has {count(len(basis), 'entry')} for {count(n, 'unknown')}", "make them agree")
    numbers = [_STATES.get(word) if isinstance(word, str) else None for word in basis]
    if None in numbers:
        i = numbers.index(None)
        raise ProblemError(f"basis[{i}]", f"is {kind(basis[i])}", f"write lower, basic or upper {FROM_0}")
    states: States = np.array(numbers, np.int8)
    if problem.box.is_orthant and UPPER not in numbers:
        return states
    low, high = problem.box.vectors(n)
    for i in np.flatnonzero(np.isinf(np.where(states == UPPER, high, low)) & (states != BASIC))[:1].tolist():
        raise ProblemError(f"basis[{i}]", f"is {basis[i]}, but there is no such bound", f"write another state {FROM_0}")
    for i in np.flatnonzero((states == BASIC) & (low == high))[:1].tolist():
        raise ProblemError(f"basis[{i}]", "is basic, but that variable is fixed", f"write lower {FROM_0}")
    return states


@np.errstate(all="ignore")
def x_in(problem: Problem, basis: States) -> Vector:
    """Return an x with the states of a basis: at a bound with w of size one, or inside the bounds."""
    low, high = problem.box.vectors(problem.n)
    above, below = (bound + turn * np.maximum(1.0, np.spacing(np.abs(bound))) for bound, turn in ((low, 1), (high, -1)))
    inside = np.where(np.isfinite(low), above, np.where(np.isfinite(high), below, 0.0))
    inside = np.where(np.isfinite(low) & np.isfinite(high), low / 2 + high / 2, inside)
    return np.asarray(0.5 * np.where(basis == BASIC, inside, np.where(basis == UPPER, high + 1.0, low - 1.0)))
