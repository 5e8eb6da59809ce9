"""Where a run on a problem starts, a basis in words, and components of solutions by the
names of the unknowns, also in linear expressions."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    LEAVE_ONE_OUT,
    MAKE_AGREE,
    ParameterError,
    ProblemError,
    kind,
    likely,
    numbers_for,
    quoted,
)
from lcpcli.linalg.doubles import size
from lcpcli.model.arrays import FROM_0, as_vector, by_names, refuse_infinite
from lcpcli.model.box import BASIC, UPPER, WORDS
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector, VectorLike

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.model.changes import Scaled

# Relative to the largest |q_ref|_i: the natural residual from which on a z is no better
# than none.
FAR_START = 0.5
NO_NAMES = "the problem has no names; take z, with its indices"
_STATES = {word: state for state, word in WORDS.items()}


class Start:
    """The start of a run: the basis that comes first, x = (z - w) / 2, and z; None if
    the start is not a z.

    gap : the natural residual at z; infinite if z is None.
    """

    def __init__(
        self,
        problem: Problem,
        basis: BasisStatus | None = None,
        x: Vector | None = None,
        z: Vector | None = None,
    ) -> None:
        self.problem = problem
        self._basis = basis
        self._x = x
        self.z = z
        self.gap = math.inf
        if z is not None:
            w = problem.w(z)
            self.gap = size(problem.box.gaps(z, w))
            refuse_infinite("M z0 + q", w)

    @property
    def is_near(self) -> bool:
        """Return whether the start is a z whose natural residual is so small that its
        basis may be that of a solution."""
        return self.gap < FAR_START * size(self.problem.q_ref)

    @property
    def known_to_auto(self) -> dict[str, bool]:
        if self._basis is not None:
            return {"is_basic_start": True}
        return {"is_warm_start": True} if self.is_near else {}

    @cached_property
    def basis(self) -> BasisStatus:
        if self._basis is not None:
            return self._basis
        return (
            self.problem.box.basis_of(self.x)
            if self.z is None
            else self.problem.box.basis_at(self.z)
        )

    @cached_property
    def x(self) -> Vector:
        if self._x is not None:
            return self._x
        if self.z is not None:
            return self.problem.box.x_of(self.z, self.problem.w(self.z))
        return x_in(self.problem, self.basis)

    def in_units_of(self, change: Scaled) -> Start:
        """Return the same start for the scaled problem."""
        x = None if self._x is None else change.start(self._x)
        z = None if self.z is None else change.z_inside(self.z)
        return Start(change.problem, self._basis, x, z)


@np.errstate(all="ignore")
def start_at(
    problem: Problem, x0: VectorLike | None, z0: VectorLike | None, basis: Any = None
) -> Start:
    """Return the start of a user: x0, or the x of z0 and w = M z0 + q, or an x that
    represents a basis."""
    start_options = [
        name
        for name, value in (("basis", basis), ("z0", z0), ("x0", x0))
        if value is not None
    ]
    if len(start_options) > 1:
        raise ParameterError(
            start_options[0],
            f"gives the starting point, and so does {start_options[-1]}",
            LEAVE_ONE_OUT,
        )
    if basis is not None:
        return Start(problem, basis_of_words(problem, basis))
    x0, z0 = by_names(lambda: problem.names, x0=x0, z0=z0)
    if z0 is not None:
        return Start(problem, z=as_vector("z0", z0, problem.n))
    return Start(problem, x=as_vector("x0", x0, problem.n))


def basis_of_words(problem: Problem, basis: Sequence[str]) -> BasisStatus:
    """Return the basis for a list of words, one for each variable."""
    n = problem.n
    if not isinstance(basis, (list, tuple, np.ndarray)):
        raise ProblemError(
            "basis",
            f"is {kind(basis)}",
            f"give a list of the words {', '.join(WORDS.values())}",
        )
    if len(basis) != n:
        raise ProblemError(
            "basis",
            numbers_for(len(basis), "entry", n, "unknown"),
            MAKE_AGREE,
        )
    numbers = [
        _STATES.get(state) if isinstance(state, str) else None for state in basis
    ]
    if None in numbers:
        i = numbers.index(None)
        raise ProblemError(
            f"basis[{i}]",
            f"is {kind(basis[i])}",
            f"write lower, basic or upper {FROM_0}",
        )
    statuses: BasisStatus = np.array(numbers, np.int8)
    if problem.box.is_orthant and UPPER not in numbers:
        return statuses
    low, high = problem.box.vectors(n)
    for i in np.flatnonzero(
        np.isinf(np.where(statuses == UPPER, high, low)) & (statuses != BASIC)
    )[:1].tolist():
        raise ProblemError(
            f"basis[{i}]",
            f"is {basis[i]}, but there is no such bound",
            f"write another status {FROM_0}",
        )
    for i in np.flatnonzero((statuses == BASIC) & (low == high))[:1].tolist():
        raise ProblemError(
            f"basis[{i}]",
            "is basic, but that variable is fixed",
            f"write lower {FROM_0}",
        )
    return statuses


@np.errstate(all="ignore")
def x_in(problem: Problem, basis: BasisStatus) -> Vector:
    """Return an x that represents a basis: at a bound with w of size one, or inside the
    bounds."""
    low, high = problem.box.vectors(problem.n)
    above, below = (
        bound + sign * np.maximum(1.0, np.spacing(np.abs(bound)))
        for bound, sign in ((low, 1), (high, -1))
    )
    inside = np.where(np.isfinite(low), above, np.where(np.isfinite(high), below, 0.0))
    inside = np.where(np.isfinite(low) & np.isfinite(high), low / 2 + high / 2, inside)
    return np.asarray(
        0.5
        * np.where(
            basis == BASIC, inside, np.where(basis == UPPER, high + 1.0, low - 1.0)
        )
    )


def component(problem: Problem, name: str, z: Vector) -> Vector:
    """Return the component of z with this name, or of each z in an array of shape (m,
    n); of a program to be maximized its multiplier in that sense. Raise KeyError if
    there is none, with a likely name, or several."""
    names = list(problem.names)
    if not name or name not in names:
        hint = (
            likely(str(name), valid_names)
            if (valid_names := list(filter(None, names)))
            else NO_NAMES
        )
        raise KeyError(f"{name!r} is not the name of an unknown; {hint}")
    if (times := names.count(name)) > 1:
        raise KeyError(
            f"{name!r} is the name of {times} unknowns; take z, with their indices"
        )
    values: Vector = z[..., i := names.index(name)]
    return 0.0 - values if i in reversed_names(problem) else values


def reversed_names(problem: Problem) -> set[int]:
    """Return the components whose names have the other sign: multipliers of an
    objective to be maximized."""
    block_form = problem.block_form
    if block_form is None:
        return set()
    return {i for i in block_form.reversed(problem.n) if problem.names[i]}


def in_stated_sense(problem: Problem, values: Sequence[Any]) -> list[Any]:
    """Return z, or w, with the signs that the names of its components have."""
    reversed_indices = reversed_names(problem)
    return [
        0 - value if i in reversed_indices else value for i, value in enumerate(values)
    ]


# No two parts that may be blank stand side by side: so a text is read in linear time.
TERM = (
    r"\s*(?:(?P<sign>[-+])\s*)?(?:(?P<number>"
    r"(?:[0-9]{1,300}(?:\.[0-9]{0,300}|/0*[1-9][0-9]{0,300})?|\.[0-9]{1,300})"
    r"(?:[eE][-+]?[0-9]{1,3})?)(?![\w.])\s*)?"
    r"(?:\*\s*)?(?P<name>\"[^\"]+\"|[^\W\d][^\s+*\"-]*)\s*"
)
HINT = (
    'write numbers and names with + and - between them, such as 2 z1 - 1/3 z2 + "a '
    'name with blanks"'
)


def coefficients(text: str) -> dict[str, Fraction]:
    """Return the coefficients of the names in a linear expression, which are added up,
    or raise ProblemError.

    >>> coefficients('z1 - 2.5 z3 + 1/3*"cost of Ann" + z1')
    {'z1': Fraction(2, 1), 'z3': Fraction(-5, 2), 'cost of Ann': Fraction(1, 3)}
    """
    with imports:
        from fractions import Fraction
    coefficients_by_name, position = dict[str, Fraction](), 0
    while position < len(text) or not coefficients_by_name:
        if (term := re.compile(TERM).match(text, position)) is None or (
            coefficients_by_name and not term["sign"]
        ):
            raise ProblemError(
                "objective",
                f"has {quoted(text[position:].strip())} instead of a term",
                HINT,
            )
        name, position = term["name"].strip('"'), term.end()
        significand, _, exponent = (term["number"] or "1").lower().partition("e")
        value = (
            Fraction(significand)
            * Fraction(10) ** int(exponent or 0)
            * (-1 if term["sign"] == "-" else 1)
        )
        coefficients_by_name[name] = coefficients_by_name.get(name, Fraction(0)) + value
    return coefficients_by_name
