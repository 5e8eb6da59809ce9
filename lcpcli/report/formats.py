"""The formats of reports, each a row of a table; nothing heavy is imported, so that help is instant."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from lcpcli.files.formats import LINES

if TYPE_CHECKING:
    from lcpcli.report.document import Document


class Form(NamedTuple):
    """A format.

    meaning : its description in help. suffix : the suffix of its files.
    renderer : the module of lcpcli.report whose `render` makes a text of a document; "" for a format with all numbers.
    """

    meaning: str
    suffix: str
    renderer: str = ""


FORMATS = {
    "table": Form("human-readable", ".txt", "terminal"),
    "json": Form("one object per line, for scripts", ".json"),
    "csv": Form("z and w with all digits", ".csv"),
    "markdown": Form("the table in Markdown", ".md", "markdown"),
    "latex": Form("the table in LaTeX with booktabs", ".tex", "latex"),
    "html": Form("a page with tables and figures", ".html", "html_page"),
}
MEANINGS = {name: form.meaning for name, form in FORMATS.items()}
RECORD_MEANINGS = {
    **MEANINGS,
    "json": "one object, for scripts",
    "csv": "a key and its value per line",
    "html": "a page",
}
TABLES = [name for name, form in FORMATS.items() if form.renderer]  # they show a selection of iterates and components
SUFFIXES = {"": "table", **{form.suffix: name for name, form in FORMATS.items()}, **dict.fromkeys(LINES, "json")}


def typeset(document: Document, form: str, width: int | None = None, color: bool = False) -> str:
    """Return a report as text in a format, whatever its names hold.

    width, color : the width of the terminal, None if there is none, and whether it shows colours.
    """
    module = import_module(f"lcpcli.report.{FORMATS[form].renderer}")
    return str(module.render(document.visible(), width, color))
