"""What is shown of results on one problem, as cells and lines of text, which the formats only typeset."""

from __future__ import annotations

from dataclasses import dataclass, field

LEFT = ("method", "status", "piece", "", "row", "column")  # left-aligned columns


@dataclass(frozen=True)
class ResultTable:
    """Cells of text. `header` names the columns; `groups` has lists of rows, of iterates one per method.

    verdict, facts : of a single result, shown above the rows; "" and none for a comparison. settled : whether the
    verdict is what was asked for.
    provenance : the program's version, the limits and the options in force.
    summary_header, summary : of a comparison, a row per method. leaders : its best cells, by row and column.
    """

    title: str
    header: list[str]
    groups: list[list[list[str]]]
    verdict: str
    facts: list[str]
    remarks: list[str]
    provenance: str
    settled: bool = False
    summary_header: list[str] = field(default_factory=list)
    summary: list[list[str]] = field(default_factory=list)
    leaders: set[tuple[int, int]] = field(default_factory=set)
