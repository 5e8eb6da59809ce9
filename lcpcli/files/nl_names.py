"""The names of the variables and rows of an .nl model, from the files .col and .row beside it."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

from lcpcli.errors import ProblemError, count
from lcpcli.files.contents import STANDARD_INPUT, content_of, decode, within


def names_beside(path: str, variables: Sequence[str]) -> Sequence[str]:
    """Return the names of some variables of the model in a file, which are given by v and their numbers from 0."""
    names, numbers = _names(path, ".col"), [int(variable[1:]) for variable in variables]
    if names and max(numbers, default=-1) >= len(names):
        fault = f"has {count(len(names), 'name')}, but {path} has the variable v{max(numbers)}"
        raise ProblemError(_beside(path, ".col"), fault, "write both again")
    return [names[number] for number in numbers] if names else variables


def named(path: str, error: ProblemError) -> ProblemError:
    """Return an error with the names of the variables and the rows in it, where there are names."""
    return ProblemError(in_names(path, error.where), in_names(path, error.fault), error.hint)


def in_names(path: str, text: str) -> str:
    """Return a text with the names of the variables and the rows in it, where there are names."""

    def name(found: re.Match[str]) -> str:
        names, number = _names(path, ".col" if found[1] == "v" else ".row"), int(found[2])
        return names[number] if number < len(names) else found[0]

    return re.sub(r"\b([vC])(\d+)\b", name, text)


def _beside(path: str, suffix: str) -> str:
    return f"{os.path.splitext(path.removesuffix('.gz'))[0]}{suffix}"


def _names(path: str, suffix: str) -> list[str]:
    beside = _beside(path, suffix)
    if path == STANDARD_INPUT or not os.path.isfile(beside):
        return []
    text = within(beside, decode, content_of(beside, "write it again"))
    return [line.strip() for line in text.removesuffix("\n").split("\n")]
