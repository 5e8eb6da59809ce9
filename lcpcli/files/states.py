"""States of variables as a starting point, from the command line: words, or a file with a list of them or a result."""

from __future__ import annotations

import os
from typing import Any

from lcpcli.errors import OptionError, ProblemError, kind
from lcpcli.files import csv_answer, csv_format, json_format, reading
from lcpcli.files.content import decode
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.model.start import STATES, states_of, x_of_states
from lcpcli.rational.numbers import rounded

EXPECTED = "give a JSON list of lower, basic and upper, or a result of lcp solve in JSON or CSV"


def read_states(given: str, problem: Problem) -> list[str]:
    """The states, one for each variable; ProblemError if some are missing, or not possible for the bounds."""
    is_file = bool(given) and os.path.exists(given)  # noqa: PTH110 (Path.exists raises an error for a long text)
    words = given.replace(",", " ").split()
    if not is_file and not set(words) & set(STATES):
        raise OptionError(
            "--basis", f"{given!r} is neither a file nor states", "write lower,basic,upper or name a file"
        )
    states = reading.parsed(given, EXPECTED, lambda content: _parse(given, content, problem)) if is_file else words
    try:
        x_of_states(problem, states)
    except ProblemError as error:
        where = f"--basis: {given}: {error.where}" if is_file else f"--{error.where}"
        raise ProblemError(where, error.fault, error.hint) from None
    return states


def _parse(path: str, content: bytes, problem: Problem) -> list[str]:
    """The list that a file holds, or that of a result; of one without such a list by its z and w."""
    form = reading.format_of(path, content)
    if form is csv_format:
        answer = csv_answer.parse(content)
        if answer.w is None:
            raise ProblemError("", "has no column headed w", EXPECTED)
        given = (("z", answer.z), ("w", answer.w))
        return states_of(problem, *(as_vector(name, rounded(values), problem.n) for name, values in given))
    if form is not json_format:
        raise ProblemError("", "has no states", EXPECTED)
    held = json_format.load_first(decode(content))
    states: Any = held.get("basis") if isinstance(held, dict) else held
    if states is None and isinstance(held, dict) and {"z", "w"} <= set(held):
        return states_of(problem, *json_format.parse_result("", content, problem.n))
    if not isinstance(states, list):
        raise ProblemError("basis", "is missing" if states is None else f"is {kind(states)}", EXPECTED)
    return states
