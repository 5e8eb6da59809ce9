"""One table of a report, as cells of text. The formats differ only in how they typeset it."""

from __future__ import annotations

from dataclasses import dataclass, field

LEFT = ("solver", "problem", "family", "how it ended", "why", "in", "up", "then")


@dataclass(frozen=True)
class Sheet:
    """One table: its title, the names of its columns, groups of rows of cells, and notes below it."""

    title: str
    header: list[str]
    groups: list[list[list[str]]]
    notes: list[str] = field(default_factory=list)
