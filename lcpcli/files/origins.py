"""Programs and games among the objects of files: which keys tell them, and what else is refused.

A program has either the native keys Q, c, A, row_lower, row_upper, lower, upper or the names of qpsolvers or of OSQP; a
game A and B. Each may have name, source and note.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from itertools import combinations
from typing import Any, NamedTuple

from lcpcli.errors import ProblemError
from lcpcli.files.keys import THREE_PLAYERS, is_for_bounds, refuse_unknown
from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_game, from_osqp, from_qp, from_qpsolvers

TEXTS = ("name", "source", "note")
OF_ROWS = ("A", "b", "row_lower", "row_upper", "rows")
NATIVE = ("Q", "c", *OF_ROWS, "lower", "upper", "free", "columns", "sense", "constant", *TEXTS)
QPSOLVERS = ("P", "q", "G", "h", "A", "b", "lb", "ub", *TEXTS)
OSQP = ("P", "q", "A", "l", "u", *TEXTS)
GAME = ("A", "B", "rows", "columns", *TEXTS)
READINGS = (
    "give min x'Qx/2 + c'x, row_lower <= Ax <= row_upper, lower <= x <= upper, "
    "or min x'Px/2 + q'x, Gx <= h, Ax = b, lb <= x <= ub, or min x'Px/2 + q'x, l <= Ax <= u"
)
EQUATIONS = (
    'write "A": Aeq, "b": beq beside P, q, G, h, lb, ub, '
    'or "A": Aeq, "row_lower": beq, "row_upper": beq beside Q, c, lower, upper'
)
INEQUALITIES = (
    'write "A": A_ub, "row_upper": b_ub beside Q, c, lower, upper, or "G": A_ub, "h": b_ub beside P, q, A, b, lb, ub'
)
QUADPROG = "write H as P, f as q, A and b as G and h, Aeq and beq as A and b"
OF_OTHERS = {
    **dict.fromkeys(("Aeq", "beq", "A_eq", "b_eq"), EQUATIONS),
    **dict.fromkeys(("A_ub", "b_ub"), INEQUALITIES),
    **dict.fromkeys(("H", "f"), QUADPROG),
}
KNOWN = {*NATIVE, *QPSOLVERS, *OSQP, *GAME, *OF_OTHERS}
TELLING = {"Q", "c", "P", "G", "h", "row_lower", "row_upper", *OF_OTHERS} - {"f"}


class Form(NamedTuple):
    """A way to write a program: its keys, the vector and the matrix of its objective, what makes the problem."""

    keys: tuple[str, ...]
    vector: str
    matrix: str
    make: Callable[..., Problem]


FORMS = (Form(NATIVE, "c", "Q", from_qp), Form(QPSOLVERS, "q", "P", from_qpsolvers), Form(OSQP, "q", "P", from_osqp))


def kind_of(keys: Collection[str]) -> str:
    """ "program" or "game" if the keys of an object tell that it is one, else ""."""
    given = set(keys)
    if "M" in given:
        return ""
    if given & TELLING or ({"A", "q"} <= given and given & {"b", "l", "u"}):
        return "program"
    return "game" if given & {"A", "B"} and not given & {"b", "q"} else ""


def made(held: Mapping[str, Any]) -> Problem:
    """The problem of the program or of the game that an object holds, or a ProblemError that names the field."""
    return _game(held) if kind_of(held) == "game" else _program(held)


def _program(held: Mapping[str, Any]) -> Problem:
    for key in held:
        if key in OF_OTHERS:
            raise ProblemError(key, "is not a key of a program", OF_OTHERS[key])
    form = _form(held)
    refuse_unknown("", held, form.keys, "a program")
    if form.vector not in held:
        raise ProblemError(form.vector, "is missing", f"add the objective, {form.vector}'x")
    if form.keys is OSQP and "P" not in held:
        hint = "add it, all zeros for a linear program; the matrix of a complementarity problem is called M"
        raise ProblemError("P", "is missing", hint)
    return form.make(**{form.matrix: None} | dict(held))


def _form(keys: Collection[str]) -> Form:
    """The first way to write a program that has those of the keys that any has; ProblemError if none has them all."""
    known = sorted((key for key in keys if any(key in form.keys for form in FORMS)), key=lambda key: key not in NATIVE)
    for form in FORMS:
        if set(known) <= set(form.keys):
            return form
    one, other = next(two for two in combinations(known, 2) if not any(set(two) <= set(form.keys) for form in FORMS))
    raise ProblemError(other, f"and {one} are of two ways to write a program", READINGS)


def _game(held: Mapping[str, Any]) -> Problem:
    if bound := next(filter(is_for_bounds, held), None):
        raise ProblemError(bound, "is not a key of a game", "its unknowns are probabilities; leave it out")
    refuse_unknown("", held, GAME, "a game")
    for key in ("A", "B"):
        if key not in held:
            raise ProblemError(key, "is missing", f"add the key {key}{', -A in a zero-sum game' * (key == 'B')}")
    if any(_depth(held[key]) > 2 for key in ("A", "B")):
        raise ProblemError("", *THREE_PLAYERS)
    return from_game(**held)


def _depth(payoffs: Any) -> int:
    """How many lists are nested: one per player."""
    return 1 + _depth(payoffs[0]) if isinstance(payoffs, list) and payoffs else 0
