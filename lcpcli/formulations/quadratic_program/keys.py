"""The keys of linear and quadratic programs in files: either the native keys Q, c, A,
row_lower, row_upper, lower, upper or the names of qpsolvers or of OSQP.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import combinations
from typing import Any

from lcpcli.errors import IS_MISSING, ProblemError
from lcpcli.files.fields import BOUNDS, refuse_unknown, without_nulls
from lcpcli.files.formats import refuse
from lcpcli.formulations.quadratic_program import reductions
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem

NATIVE = (
    "Q",
    "c",
    "A",
    "b",
    "row_lower",
    "row_upper",
    "rows",
    *BOUNDS,
    "free",
    "columns",
    "sense",
    "constant",
    *TEXTS,
)
QPSOLVERS = ("P", "q", "G", "h", "A", "b", "lb", "ub", *TEXTS)
OSQP = ("P", "q", "A", "l", "u", *TEXTS)
READINGS = (
    "give min x'Qx/2 + c'x, row_lower <= Ax <= row_upper, lower <= x <= upper, "
    "or min x'Px/2 + q'x, Gx <= h, Ax = b, lb <= x <= ub, or min x'Px/2 + q'x, "
    "l <= Ax <= u"
)
FOREIGN_FIELDS = dict(  # names of quadprog and linprog, with those of qpsolvers
    zip(
        ("H", "f", "Aeq", "beq", "A_eq", "b_eq", "A_ub", "b_ub"),
        "PqAbAbGh",
        strict=True,
    )
)
# For each way to write a program the function that makes the problem, its keys, and the
# names of the vector and of the matrix of the objective.
FORMS = {
    "from_qp": (NATIVE, "c", "Q"),
    "from_qpsolvers": (QPSOLVERS, "q", "P"),
    "from_osqp": (OSQP, "q", "P"),
}


def problem_of(data: Mapping[str, Any]) -> Problem:
    """Return the problem of the program with these keys, or raise ProblemError."""
    maker = _maker_of(tuple(data))
    keys, vector, matrix = FORMS[maker]
    refuse_unknown("", data, keys, "a program")
    hint = f"add the objective, {vector}'x"
    refuse(data.get(vector) is None, vector, IS_MISSING, hint)
    hint = (
        "add it, all zeros for a linear program; the matrix of a complementarity "
        "problem is called M"
    )
    refuse(keys is OSQP and "P" not in data, "P", IS_MISSING, hint)
    arguments = {matrix: None} | without_nulls(data)
    problem: Problem = getattr(reductions, maker)(**arguments)
    return problem


def remark(data: Mapping[str, Any]) -> str:
    """Return a line on how b was read, if it alone bounds the rows, as other programs
    mean Ax <= b or Ax = b by it; else ""."""
    if "b" not in data or data.get("row_upper") is not None:
        return ""
    if _maker_of(tuple(data)) != "from_qp":
        return ""
    return (
        "b is read as Ax >= b; name it row_upper for Ax <= b, and give it as row_lower "
        "and as row_upper for Ax = b"
    )


# Many lines of a file may have the same keys.
@lru_cache(maxsize=64)
def _maker_of(keys_in_file: tuple[str, ...]) -> str:
    """Return the name of the function that makes the problem of a program with these
    keys, or raise ProblemError."""
    if other := next((key for key in keys_in_file if key in FOREIGN_FIELDS), None):
        reason = (
            f"is not a key of a program; it is called {FOREIGN_FIELDS[other]} in "
            "the second of these ways"
        )
        raise ProblemError(other, reason, READINGS)
    recognized = [
        key for key in keys_in_file if any(key in keys for keys, *_ in FORMS.values())
    ]
    recognized.sort(key=lambda key: key not in NATIVE)
    maker = next(
        (maker for maker, (keys, *_) in FORMS.items() if set(recognized) <= set(keys)),
        "",
    )
    if not maker:
        pairs = (
            two
            for two in combinations(recognized, 2)
            if not any(set(two) <= set(keys) for keys, *_ in FORMS.values())
        )
        one, other = next(pairs)
        raise ProblemError(
            other, f"and {one} belong to two ways to write a program", READINGS
        )
    return maker
