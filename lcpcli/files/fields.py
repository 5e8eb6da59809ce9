"""The named fields of problems, in all formats, and the problem made from them or from
the fields of a formulation. Each may have name, source and note.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any

from lcpcli import errors
from lcpcli.errors import IS_MISSING, ProblemError
from lcpcli.model import formulations
from lcpcli.model.formulations import TEXTS
from lcpcli.options import INFINITY

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.typing import Matrix

# Unknowns up to which matrices are stored dense: 320 kB each, for which dense
# arithmetic is faster.
LARGEST_DENSE = 200
BOUNDS = ("lower", "upper")
BOUND_OPTIONS = (*BOUNDS, INFINITY.name)  # the options that say what the bounds are
STARTS = ("x0", "x1")
KEYS = (*TEXTS, "M", "q", *BOUNDS, *STARTS, "solution", "verdict", "origin", "names")
NONLINEAR = {
    "F",
    "f",
    "function",
    "functions",
    "expression",
    "expressions",
    "equations",
    "jacobian",
}
A_RESULT = ("is a result, not a problem", "name the file of the problem")
PAIRS_OF_BOUNDS = {"bounds", "bnds", "bound", "box", "limits"}
OF_LOWER = (
    "l",
    "lb",
    "lo",
    "low",
    "xl",
    "zl",
    "lbound",
    "lowerbound",
    "lower_bound",
    "min",
)
OF_UPPER = (
    "u",
    "ub",
    "hi",
    "up",
    "high",
    "xu",
    "zu",
    "ubound",
    "upperbound",
    "upper_bound",
    "max",
)
OTHER_NAMES = {
    "matrix": "M",
    "a": "M",
    "vector": "q",
    "b": "q",
    "solutions": "solution",
    "z": "solution",
    **dict.fromkeys(("cost", "costs", "objective"), "c"),
    **dict.fromkeys(("minimize", "maximize", "minimise", "maximise"), "sense"),
}
OTHER_NAMES |= (
    {"start": "x0"}
    | dict.fromkeys(OF_LOWER, "lower")
    | dict.fromkeys(OF_UPPER, "upper")
)
# Keys of formulations: all of them, and those of matrices.
KNOWN = formulations.KEYS
MATRICES = formulations.MATRICES


def is_for_bounds(key: str) -> bool:
    folded = key.casefold()
    return folded in PAIRS_OF_BOUNDS or OTHER_NAMES.get(folded, folded) in BOUNDS


def refuse_unknown(
    field: str,
    keys_in_file: Collection[str],
    valid_names: tuple[str, ...],
    subject: str = "a problem",
) -> None:
    """Raise ProblemError for the first unknown key, suggesting the one that is likely
    meant."""
    unknown_key = _unknown_key(field, tuple(keys_in_file), valid_names, subject)
    if unknown_key is not None:
        raise ProblemError(*unknown_key)


# Many lines of a file may have the same keys.
@lru_cache(maxsize=64)
def _unknown_key(
    field: str,
    keys_in_file: tuple[str, ...],
    valid_names: tuple[str, ...],
    subject: str,
) -> tuple[str, str, str] | None:
    """Return the arguments of the error that `refuse_unknown` raises; None if all keys
    are known."""
    others = [key for key in keys_in_file if key not in valid_names]
    if not others:
        return None
    keys = set(keys_in_file)
    if keys & NONLINEAR and not keys & {"M", "Q", "A"}:
        hint = "give M and q of a linear one, or a .nl model (lcp help models)"
        return "", "is a nonlinear problem", hint
    if {"version", "status", "z"} <= keys:
        return "", *A_RESULT
    bounds = PAIRS_OF_BOUNDS if "lower" in valid_names else set[str]()
    meanings = (
        *(row.meant for row in formulations.TABLE.values()),
        (bounds, "bounds as lower and upper, each a list"),
    )
    for (names, what), key in product(meanings, others):
        is_part = any(
            key in name.split() and keys.issuperset(name.split()) for name in names
        )
        if key.casefold() in names or is_part:
            return key, f"is not a key of {subject}", f"give the {what}"
    other_names = {k: v for k, v in OTHER_NAMES.items() if v in valid_names}
    return errors.unknown_key(field, others, valid_names, subject, other_names)


def kind_of(keys: Collection[str]) -> str:
    """Return the kind of the formulation if the keys of an object show
    that it is one, else ""."""
    return formulations.told_by(keys)


def is_whole(fields: Collection[str]) -> bool:
    """Return whether the fields, by their names, are those of a whole problem, not of
    one whose q is elsewhere."""
    return "q" in fields or bool(kind_of(fields))


def without_nulls(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields without those that are null, as if they were left out, but for
    bounds, where null means none."""
    return {
        key: value
        for key, value in fields.items()
        if value is not None or key in BOUNDS
    }


def made(fields: Mapping[str, Any]) -> Problem | Matrix:
    """Return the problem with these fields, or of the formulation with these fields, or
    M alone if there is no q; a ProblemError names the field.

    fields : texts, numbers, vectors and matrices as `Problem`, `from_qp` and so on take
        them, None for no bound; solution is a list of vectors, origin an object.
        Unknown fields have been refused, except in an origin.
    """
    if kind := kind_of(fields):
        problem: Problem = formulations.load(kind).of_fields(fields)
        return problem
    from lcpcli.model.arrays import as_matrix
    from lcpcli.model.problem import Problem

    if "q" not in fields:
        if any(key in fields for key in KEYS if key not in ("M", *TEXTS)):
            raise ProblemError(
                "q", IS_MISSING, "add q, or name the file of q after this one"
            )
        return (
            as_matrix("M", fields["M"])
            if isinstance(fields["M"], list)
            else fields["M"]
        )
    arguments = {
        key: fields[key] for key in KEYS if key in fields and key != "solution"
    }
    if "names" in fields:
        from lcpcli.model.formulation import names_of

        arguments["names"] = names_of("names", fields["names"])
    return Problem(solutions=fields.get("solution", ()), **arguments)


def of_table(table: Any) -> dict[str, Any]:
    """Return M and q from an array of n rows and n + 1 columns, or M from an array of
    any other shape."""
    if table.ndim != 2 or table.shape[1] != table.shape[0] + 1:
        return {"M": table}
    return {"M": table[:, :-1].copy(), "q": table[:, -1].copy()}
