"""Components of solutions by the names of the unknowns, and linear expressions in these, as texts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from lcpcli.errors import ProblemError, likely, quoted
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program
from lcpcli.typing import Vector

NO_NAMES = "the problem has no names; take z, with its indices"


def component(problem: Problem, name: str, z: Vector) -> Vector:
    """Return the component of z with this name, or of each z in an array of shape (m, n); of a program to be maximized
    its multiplier in that sense. Raise KeyError if there is none, with a likely name, or several."""
    names = list(problem.names)
    if not name or name not in names:
        hint = likely(str(name), own) if (own := list(filter(None, names))) else NO_NAMES
        raise KeyError(f"{name!r} is not the name of an unknown; {hint}")
    if (times := names.count(name)) > 1:
        raise KeyError(f"{name!r} is the name of {times} unknowns; take z, with their indices")
    found: Vector = z[..., i := names.index(name)]
    return 0.0 - found if i in reversed_names(problem) else found


def reversed_names(problem: Problem) -> set[int]:
    """Return the components whose names have the other sign: multipliers of a program to be maximized."""
    origin, names = problem.origin, problem.names
    return {i for i in origin.reversed(problem.n) if names[i]} if isinstance(origin, Program) else set()


def in_own_sense(problem: Problem, values: Sequence[Any]) -> list[Any]:
    """Return z, or w, with the signs for which the names of its components stand."""
    turned = reversed_names(problem)
    return [0 - value if i in turned else value for i, value in enumerate(values)]


TERM = re.compile(
    r"\s*(?P<sign>[-+]?)\s*(?P<number>(?:[0-9]{1,300}(?:\.[0-9]{0,300}|/0*[1-9][0-9]{0,300})?|\.[0-9]{1,300})"
    r"(?:[eE][-+]?[0-9]{1,3})?(?![\w.]))?\s*\*?\s*(?P<name>\"[^\"]+\"|[^\W\d][^\s+*\"-]*)\s*"
)
HINT = 'write numbers and names with + and - between them, such as 2 z1 - 1/3 z2 + "a name with blanks"'


def coefficients(text: str) -> dict[str, Fraction]:
    """Return the coefficients of the names in a linear expression, which are added up, or raise ProblemError.

    >>> coefficients('z1 - 2.5 z3 + 1/3*"cost of Ann" + z1')
    {'z1': Fraction(2, 1), 'z3': Fraction(-5, 2), 'cost of Ann': Fraction(1, 3)}
    """
    found, place = dict[str, Fraction](), 0
    while place < len(text) or not found:
        if (term := TERM.match(text, place)) is None or (found and not term["sign"]):
            raise ProblemError("objective", f"has {quoted(text[place:].strip())} in place of a term", HINT)
        name, place = term["name"].strip('"'), term.end()
        whole, _, exponent = (term["number"] or "1").lower().partition("e")
        value = Fraction(whole) * Fraction(10) ** int(exponent or 0) * (-1 if term["sign"] == "-" else 1)
        found[name] = found.get(name, Fraction(0)) + value
    return found
