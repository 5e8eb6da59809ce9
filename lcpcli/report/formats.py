"""The formats of results, by name; nothing heavy is imported, so that help is instant."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

FORMATS = {
    "table": "for people",
    "json": "one object a line, for scripts",
    "csv": "every iterate with all digits",
    "markdown": "the table in Markdown",
    "latex": "the table in LaTeX with booktabs",
}
TABLES = ("table", "markdown", "latex")  # those that show a choice of iterates and of components
LEVELS = (1e-3, 1e-6, 1e-9)  # of the error, relative to the solution, of which a comparison tells the time
SUFFIXES = {"": "table", ".txt": "table", ".json": "json", ".csv": "csv", ".md": "markdown", ".tex": "latex"}
