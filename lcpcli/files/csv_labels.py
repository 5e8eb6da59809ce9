"""Numbers in CSV, put in the order of the unknowns if their labels are the names of these."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lcpcli.errors import ProblemError, quoted
from lcpcli.files.csv_cells import cells_of
from lcpcli.files.csv_format import delimiter_of, is_header, lines_of

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

FEWEST_NUMBERED = 3  # rows of M whose first entries are hardly 1, 2, 3, ... by chance


def places(labels: Sequence[str], names: Sequence[str]) -> list[int] | None:
    """Return where each name is among the labels. Return None, so that positions count, if the labels are in this order
    or have nothing to do with the names; raise ProblemError if only some of them are names."""
    own = [label.strip() for label in labels]
    if own == list(names) or not set(own) & set(names) or len(set(names)) < len(names):
        return None
    if sorted(own) == sorted(names):
        return [own.index(name) for name in names]
    other = next((label for label in own if label not in names), own[0])
    fault = f"has the label {quoted(other)}, which is not the name of an unknown"
    if other in names:
        fault = f"has {len(own)} labels for {len(names)} unknowns"
    raise ProblemError("", fault, "give each unknown once, by its name, or leave the labels out")


def remark(problem: Problem) -> str:
    """Return the line on a problem in one table that may begin with an index; "" for any other."""
    n, is_named = problem.n, any(problem.names)
    first = [] if is_named or n < FEWEST_NUMBERED else problem.M[:, 0].tolist()
    if not first or first not in (list(range(n)), list(range(1, n + 1))):
        return ""
    numbers = ", ".join(f"{x:g}" for x in first[:FEWEST_NUMBERED])
    return f"the first column of M is {numbers}, ...; if it numbers the rows, add a header with an empty first cell"


def in_order(content: bytes, names: Sequence[str]) -> bytes:
    """Return a table below a header with its rows, if these are labelled, or the columns of its only row in the order
    of these names; any other text, such as a result, as it is."""
    lines = lines_of(content) if all(names) and names else []
    if len(lines) < 2:
        return content
    mark = delimiter_of(lines[0][1])
    header, *rows = [cells_of(number, line, mark) for number, line in lines]
    if not is_header(header) or "component" in header or {len(row) for row in rows} != {len(header)}:
        return content
    if len(header) > 1 and (found := places([row[0] for row in rows], names)) is not None:
        return "\n".join([lines[0][1], *(lines[1 + i][1] for i in found)]).encode()
    if len(rows) == 1 and (found := places(header, names)) is not None:
        return (mark or " ").join(rows[0][i] for i in found).encode()
    return content
