"""The .sol files in which AMPL and other programs that write .nl files read answers (D. M. Gay, Hooking your solver to
AMPL, 1997, section 5)."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.files.nl_segments import Header
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


def _options(options: Sequence[str]) -> list[str]:
    """Return the options of the model, with their number before them, which counts two more if a tolerance follows."""
    size, *own = options
    has_tolerance = own[1:2] == [WITH_TOLERANCE]
    return [str(int(size) + 2 * has_tolerance), *own]
