"""Numbers in CSV, put in the order of the unknowns if their labels are the names of these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from lcpcli.files.csv_cells import cells_of, places_of
from lcpcli.files.csv_format import delimiter_of, is_header, lines_of
from lcpcli.files.formats import HEAD

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

FEWEST_NUMBERED = 3  # rows of M whose first entries are hardly 1, 2, 3, ... by chance


def remark(problem: Problem) -> str:
    """Return the line on a problem in one table that may begin with an index; "" for any other."""
    n, is_named = problem.n, any(problem.names)
    first = [] if is_named or n < FEWEST_NUMBERED else problem.M[:, 0].tolist()
    if not first or first not in (list(range(n)), list(range(1, n + 1))):
        return ""
    numbers = ", ".join(f"{x:g}" for x in first[:FEWEST_NUMBERED])
    return f"the first column of M is {numbers}, ...; if it numbers the rows, add a header with an empty first cell"


def in_order(content: bytes, names: Callable[[], Sequence[str]]) -> bytes:
    """Return a table below a header with its rows, if these are labelled, or the columns of its only row in the order
    of these names; any other text, such as a result, as it is. names : returns the names, if there are labels."""
    first = lines_of(content[:HEAD])[:1]
    mark = delimiter_of(first[0][1]) if first else ""
    header = cells_of(*first[0], mark) if first else []
    if len(header) < 2 or not is_header(header) or "component" in header or not (own := names()) or not all(own):
        return content
    (_, heading), *lines = lines_of(content)
    rows = [cells_of(number, line, mark) for number, line in lines]
    if {len(row) for row in rows} != {len(header)}:
        return content
    if (found := places_of([row[0] for row in rows], own)) is not None:
        return "\n".join([heading, *(lines[i][1] for i in found)]).encode()
    if len(rows) == 1 and (found := places_of(header, own)) is not None:
        return (mark or " ").join(rows[0][i] for i in found).encode()
    return content
