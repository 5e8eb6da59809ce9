"""The .sol files in which solvers answer AMPL and what else writes .nl files (D. M. Gay, Hooking your solver to AMPL,
1997, section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lcpcli.errors import ProblemError, count
from lcpcli.files.contents import decode
from lcpcli.files.nl_segments import Header
from lcpcli.files.nl_tokens import whole
from lcpcli.rational.numbers import fraction
from lcpcli.typing import Vector

WITH_TOLERANCE = "3"  # as the second option: a tolerance stands behind the options


def solution_text(header: Header, message: str, values: Vector, number: int) -> str:
    """Return the file with the values of all variables, and none of multipliers. number : the solve_result_num."""
    return "\n".join(
        [
            message,
            "",
            "Options",
            *_options(header.options),
            *map(str, (header.rows, 0, header.variables, len(values))),
            *map(repr, values.tolist()),
            f"objno 0 {number}",
            "",
        ]
    )


def values_in(content: bytes, variables: int) -> list[Fraction]:
    """Return the values of all variables in a file, with all decimals; raise ProblemError if it has other ones.

    variables : the number of variables in the model.
    """
    lines = [line.strip() for line in decode(content).split("\n")]
    try:
        at = lines.index("Options") + 1
        at += 1 + whole(lines[at]) - (lines[at + 2] == WITH_TOLERANCE)
        _, duals, own, values = map(whole, lines[at : at + 4])
        first = at + 4 + duals
        found = [fraction(line) for line in lines[first : first + values]]
    except (ValueError, IndexError):
        raise ProblemError("", "is no .sol file in text", "write it as solvers for AMPL do, in text") from None
    if own != variables or len(found) != own:
        where = f"{count(len(found), 'value')} of {count(own, 'variable')}"
        raise ProblemError("", f"has {where} for {variables} of the model", "solve the model again")
    return found


def _options(options: Sequence[str]) -> list[str]:
    """Return the options of the model, with their number before them, which counts two more if a tolerance follows."""
    size, *own = options
    has_tolerance = own[1:2] == [WITH_TOLERANCE]
    return [str(int(size) + 2 * has_tolerance), *own]
