"""The names of the variables of an .nl model, from the file .col beside it."""

from __future__ import annotations

import os
from collections.abc import Sequence

from lcpcli.errors import ProblemError, count
from lcpcli.files.contents import STANDARD_INPUT, content_of, decode, within


def names_beside(path: str, variables: Sequence[str]) -> Sequence[str]:
    """Return the names of some variables of the model in a file, which are given by v and their numbers from 0."""
    beside = f"{os.path.splitext(path)[0]}.col"
    if path == STANDARD_INPUT or not os.path.isfile(beside):
        return variables
    numbers = [int(variable[1:]) for variable in variables]
    lines = within(beside, decode, content_of(beside, "write it again")).splitlines()
    if max(numbers, default=-1) >= len(lines):
        fault = f"has {count(len(lines), 'name')}, but {path} has the variable v{max(numbers)}"
        raise ProblemError(beside, fault, "write both again")
    return [lines[number].strip() for number in numbers]
