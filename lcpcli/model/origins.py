"""What a file says about what its problem was made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lcpcli.errors import IS_MISSING, LEAVE_ONE_OUT, ProblemError, kind, quoted
from lcpcli.model import formulations
from lcpcli.model.formulation import Conditions, Formulation, named


def origin_of(
    raw_origin: Any, names: Sequence[str], problem: Conditions
) -> Formulation:
    """Return the origin for a formulation, for the object in a file, or for names; or
    raise ProblemError."""
    if raw_origin is None:
        return named(names, problem.q.size)
    origin: Formulation = (
        raw_origin if isinstance(raw_origin, Formulation) else _parsed(raw_origin)
    )
    if not origin.fits(problem):
        raise ProblemError(
            "origin",
            "does not yield this M and q",
            "make the problem again, or leave origin out",
        )
    if len(names):
        raise ProblemError(
            "names", "cannot be combined with origin, which has names", LEAVE_ONE_OUT
        )
    return origin


def _parsed(raw_origin: Any) -> Formulation:
    if not isinstance(raw_origin, Mapping):
        raise ProblemError(
            "origin", f"is {kind(raw_origin)}", "give an object with the key kind"
        )
    valid_kinds = ", ".join(formulations.ORIGINS)
    if "kind" not in raw_origin:
        raise ProblemError("origin.kind", IS_MISSING, f"add one of {valid_kinds}")
    name = raw_origin["kind"]
    if not isinstance(name, str) or not formulations.is_known(name):
        shown = quoted(name) if isinstance(name, str) else kind(name)
        raise ProblemError("origin.kind", f"is {shown}", f"use one of {valid_kinds}")
    try:
        origin: Formulation = formulations.load(name).parse(raw_origin)
    except ProblemError as error:
        raise ProblemError(f"origin.{error.where}", error.fault, error.hint) from None
    return origin
