"""States of variables as a starting point, from the command line: words, or a file with a list of them or a result."""

from __future__ import annotations

import os
from typing import Any

from lcpcli.errors import ProblemError, kind
from lcpcli.files import json_format, reading
from lcpcli.files.content import decode
from lcpcli.model.problem import Problem
from lcpcli.model.start import STATES, states_of, x_of_states

EXPECTED = "give a JSON list of lower, basic and upper, or what lcp solve --format json prints"


def read_states(given: str, problem: Problem) -> list[str]:
    """The states, one for each variable; ProblemError if some are missing, or not possible for the bounds."""
    words = [word.strip() for word in given.split(",")]
    typed = bool(set(words) & set(STATES)) and not os.path.exists(given)  # noqa: PTH110 (Path.exists raises an error for a long text)
    states = words if typed else reading.parsed(given, EXPECTED, lambda content: _parse(content, problem))
    try:
        x_of_states(problem, states)
    except ProblemError as error:
        where = f"--{error.where}" if typed else f"--basis: {reading.place(given)}: {error.where}"
        raise ProblemError(where, error.fault, error.hint) from None
    return states


def _parse(content: bytes, problem: Problem) -> list[str]:
    """The list that a file holds, or that of a result; of a result for an LCP, which has none, by its z and w."""
    held = json_format.load_first(decode(content))
    states: Any = held.get("basis") if isinstance(held, dict) else held
    if states is None and isinstance(held, dict) and {"z", "w"} <= set(held):
        return states_of(problem, *json_format.parse_result("", content, problem.n))
    if not isinstance(states, list):
        raise ProblemError("basis", "is missing" if states is None else f"is {kind(states)}", EXPECTED)
    return states
