"""The formats of results, by name; nothing heavy is imported, so that help is instant."""

from __future__ import annotations

from lcpcli.files.formats import LINES

FORMATS = {
    "table": "human-readable",
    "json": "one object per line, for scripts",
    "csv": "z and w with all digits",
    "markdown": "the table in Markdown",
    "latex": "the table in LaTeX with booktabs",
}
TABLES = ("table", "markdown", "latex")  # those that show a selection of iterates and of components
LEVELS = (1e-3, 1e-6, 1e-9)  # errors, relative to the solution, for which a comparison reports the time
SUFFIXES = {
    "": "table",
    ".txt": "table",
    ".json": "json",
    **dict.fromkeys(LINES, "json"),
    ".csv": "csv",
    ".md": "markdown",
    ".tex": "latex",
}
