"""What a file says about what its problem was made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lcpcli.errors import IS_MISSING, LEAVE_ONE_OUT, ProblemError, kind, quoted
from lcpcli.model import formulations
from lcpcli.model.formulation import Conditions, Formulation, named


def origin_of(given: Any, names: Sequence[str], problem: Conditions) -> Formulation:
    """Return the origin that is given as such, as the object in a file, or as names; or
    raise ProblemError."""
    if given is None:
        return named(names, problem.q.size)
    origin: Formulation = given if isinstance(given, Formulation) else _parsed(given)
    if not origin.fits(problem):
        raise ProblemError(
            "origin",
            "does not yield this M and q",
            "make the problem again, or leave origin out",
        )
    if len(names):
        raise ProblemError(
            "names", "is given beside origin, which has names", LEAVE_ONE_OUT
        )
    return origin


def _parsed(given: Any) -> Formulation:
    if not isinstance(given, Mapping):
        raise ProblemError(
            "origin", f"is {kind(given)}", "give an object with the key kind"
        )
    known = ", ".join(formulations.ORIGINS)
    if "kind" not in given:
        raise ProblemError("origin.kind", IS_MISSING, f"add one of {known}")
    name = given["kind"]
    if not isinstance(name, str) or not formulations.is_known(name):
        shown = quoted(name) if isinstance(name, str) else kind(name)
        raise ProblemError("origin.kind", f"is {shown}", f"use one of {known}")
    try:
        origin: Formulation = formulations.load(name).parse(given)
    except ProblemError as error:
        raise ProblemError(f"origin.{error.where}", error.fault, error.hint) from None
    return origin
