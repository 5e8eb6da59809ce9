"""A report as the formats typeset it: sections of lines, tables of text and a figure;
and the tables of these formats and of all figures. Nothing heavy is imported, so that
help is instant."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from importlib import import_module
from typing import Any, NamedTuple

from lcpcli.files.formats import LINES
from lcpcli.report.wording import all_visible


class Table(NamedTuple):
    """A table of cells of text.

    header : the names of the columns, all "" for a table that has none.
    groups : lists of rows, with a rule between two lists.
    words : the indices of the columns of words, which are left-aligned; the others hold
        numbers.
    texts : the indices of the columns of sentences, which a screen wraps.
    notes : lines below the table.
    name : the heading under which a page folds a long table; "" for a table that stays
        open.
    """

    header: Sequence[str]
    groups: Sequence[Sequence[Sequence[str]]]
    words: Collection[int] = (0,)
    texts: Collection[int] = ()
    notes: Sequence[str] = ()
    name: str = ""

    @property
    def rows(self) -> list[Sequence[str]]:
        return [row for group in self.groups for row in group]

    def widths(self) -> list[int]:
        """Return the number of characters of the widest cell of each column."""
        return [
            max(map(len, cells)) for cells in zip(self.header, *self.rows, strict=True)
        ]


class Section(NamedTuple):
    """A part of a report under a title.

    verdict : the main result in one line, which begins the section; "" if the tables
        come first.
    is_as_requested : whether the verdict is what was requested, as a solution is.
    facts : lines below the verdict, or below the title.
    remarks : lines of advice, above the tables if there is a verdict, else below them.
    provenance : what made the section. figure : a function that returns its `Picture`;
        None if it has none.
    """

    title: str
    verdict: str = ""
    is_as_requested: bool = False
    facts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    remarks: Sequence[str] = ()
    provenance: str = ""
    figure: Callable[[], Any] | None = None


class Document(NamedTuple):
    """A report. title : the title of all of it; a section of the same title opens the
    report."""

    title: str
    sections: Sequence[Section]

    def visible(self) -> Document:
        """Return the report as people see it, without empty tables."""
        title, sections = all_visible(self)
        shown = [
            section._replace(tables=[table for table in section.tables if table.rows])
            for section in sections
        ]
        return Document(title, shown)


class Form(NamedTuple):
    """A format.

    meaning : its description in help. suffix : the suffix of its files.
    renderer : the module of lcpcli.report whose `render` makes a text of a document,
        with a selection of iterates and components; "" for a format with all numbers.
    fits_screen : whether it fits the width of a terminal, and has colours.
    is_printed : whether it is for readers who do not run the program.
    has_figures : whether it has the figures. has_records : whether it has a record for
        each input, with all that is known. has_proofs : whether it has proofs.
    takes_many : whether it can be written problem by problem.
    """

    meaning: str
    suffix: str
    renderer: str = ""
    fits_screen: bool = False
    is_printed: bool = False
    has_figures: bool = False
    has_records: bool = False
    has_proofs: bool = True
    takes_many: bool = False


FORMATS = {
    "table": Form(
        "human-readable", ".txt", "terminal", fits_screen=True, takes_many=True
    ),
    "json": Form(
        "one object per line, for scripts", ".json", has_records=True, takes_many=True
    ),
    "csv": Form("z and w with all digits", ".csv", has_proofs=False, takes_many=True),
    "markdown": Form("the table in Markdown", ".md", "markdown"),
    "latex": Form("the table in LaTeX with booktabs", ".tex", "latex", is_printed=True),
    "html": Form(
        "a page with tables and figures",
        ".html",
        "html_page",
        is_printed=True,
        has_figures=True,
    ),
}
MEANINGS = {name: form.meaning for name, form in FORMATS.items()}
RECORD_MEANINGS = dict(
    MEANINGS,
    json="one object, for scripts",
    csv="a key and its value per line",
    html="a page",
)


class Figure(NamedTuple):
    """A figure.

    title : the title of its file. commands : the commands that draw it, by `--option
        FILE`.
    meaning : what help says of this option; "" for a figure that replaces another one,
        as cones do with --all.
    made_by : the function that makes its `Picture`, in lcpcli.report or in
        lcpcli.bench. drawn_by : the function that draws this, in lcpcli.report.figures.
        in_plane : whether it is for LCPs with two unknowns.
    """

    title: str
    commands: Collection[str]
    option: str
    meaning: str
    made_by: str
    drawn_by: str
    in_plane: bool = False


FIGURES = {
    "convergence": Figure(
        "Error against run time and iteration",
        ("solve", "compare"),
        "plot",
        "Draw error over time: .png, .svg or .pdf.",
        "report.plotting.runs_or_answer",
        "run_figures.draw_convergence",
    ),
    "paths": Figure(
        "Trajectories of iterates",
        ("solve", "compare"),
        "paths",
        "Draw the iterates x, z = |x| + x, of a problem in two unknowns over the merit "
        "function: .png, .svg, .pdf.  [default: none]",
        "report.plotting.paths_of",
        "plane_figures.draw_paths",
        in_plane=True,
    ),
    "fit": Figure(
        "Measurements and their fit",
        ("solve",),
        "plot",
        "",
        "report.plotting.runs_or_answer",
        "fit_figures.draw",
    ),
    "cones": Figure(
        "Complementary cones",
        ("solve",),
        "plot",
        "",
        "report.plotting.cones",
        "plane_figures.draw",
        in_plane=True,
    ),
    "response": Figure(
        "Path of solutions",
        ("path",),
        "plot",
        "Draw z(t), and the objective of a program: .png, .svg or .pdf.",
        "report.plotting.plot_path",
        "run_figures.draw",
    ),
    "bench": Figure(
        "Benchmark",
        ("bench",),
        "plot",
        "Draw performance profiles, error against time, and scaling with n, as .png, "
        ".svg or .pdf.",
        "bench.report.figure",
        "run_figures.draw_bench",
    ),
}
SUFFIXES = {
    "": "table",
    **{form.suffix: name for name, form in FORMATS.items()},
    **dict.fromkeys(LINES, "json"),
}


def typeset(
    document: Document, format_name: str, width: int | None = None, color: bool = False
) -> str:
    """Return a report as text in a format. width : of the terminal, None if there is
    none. color : whether it has colours."""
    module = import_module(f"lcpcli.report.{FORMATS[format_name].renderer}")
    return str(module.render(document.visible(), width, color))
