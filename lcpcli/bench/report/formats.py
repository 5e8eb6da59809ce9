"""The formats of the report on a bench, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

FORMATS = {
    "table": "human-readable",
    "json": "the record, to resume from",
    "csv": "one row per measurement, all digits",
    "markdown": "the tables in Markdown",
    "latex": "the tables in LaTeX with booktabs",
}
