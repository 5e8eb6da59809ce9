"""The destination, the format and the iterates of results."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from lcpcli.cli.declarations import (
    CSV,
    ITERATES_IN_JSON,
    JSON,
    NO_ITERATES,
    NO_UNKNOWNS,
    QUIET,
    Reporting,
    among,
    refuse,
    reject_conflicting_options,
)
from lcpcli.cli.problems import AnyProblem, Request, tell
from lcpcli.cli.terminal import emit, size, terminal
from lcpcli.errors import File
from lcpcli.methods.registry import ALL
from lcpcli.options import EVERY
from lcpcli.report import columns
from lcpcli.report.document import FIGURES, FORMATS, SUFFIXES

if TYPE_CHECKING:
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace
    from lcpcli.typing import Indices

# Iterates of one method in a table, about a page of paper, without --every.
MAX_ROWS = 60
# Rows shown even on a small screen; lines that the summary and the prompt take.
MIN_ROWS, SUMMARY_LINES = 8, 12
MAX_POINTS = 400  # of one method in a figure, about one for each pixel across an axis


class Destination:
    """Where a command shows its report.

    form, path : the format, and the file, None for standard output. quiet : whether
        nothing but errors is printed.
    width, color : of a terminal, else None, and whether it shows colours. silent :
        whether the report is not shown.
    """

    def __init__(self, form: str | None, path: str | None, quiet: bool = False) -> None:
        hint = f"give --format {path}, or a name with a suffix"
        # -o json would write a table to a file json.
        refuse(path in FORMATS, "--output", f"{path} is a format", hint)
        if form is None:  # the suffix of the file decides; without one, it is the table
            ending = os.path.splitext(path or "")[1].lower()
            suffixes = f"use {', '.join(filter(None, SUFFIXES))} or give --format"
            refuse(
                ending not in SUFFIXES,
                File(path or ""),
                f"the suffix {ending} is not a format",
                suffixes,
            )
            form = SUFFIXES[ending]
        self.form = form
        self.path = path
        self.quiet = quiet
        self.width, color = (None, False) if path else terminal()
        self.kind, self.silent = FORMATS[form], quiet and path is None
        self.color = color and self.kind.fits_screen
        if self.kind.has_figures:
            hush()

    @classmethod
    def of(cls, asked: Reporting) -> Destination:
        return cls(asked.form, asked.output, asked.quiet)

    @property
    def is_json_file(self) -> bool:
        """Return whether the output is a .json file, which has one JSON text, and not
        an object in each line."""
        return self.kind.has_records and (self.path or "").casefold().endswith(".json")

    def show(
        self, render: Callable[[str, int | None, bool], str], verdict: str = ""
    ) -> None:
        """Show what `render` returns for the format, the width and whether there are
        colours; where it goes to a file, say the verdict in a line on standard
        error."""
        if not self.silent:
            text = render(self.form, self.width, self.color)
            if self.is_json_file:
                from lcpcli.report.result_formats import as_list

                text = as_list(text)
            show(text, self.path, self.color)
        if verdict and self.path is not None:
            tell(verdict, self.quiet)

    def add(self, path: str | None, content: Callable[[], str | bytes]) -> None:
        """Write a further file with its content, if it has a name, and say so."""
        if path is not None:
            show(content(), path)
            tell(f"wrote {path}", self.quiet)

    def draw(self, path: str | None, kind: str, *data: Any) -> None:
        """Write a figure, of FIGURES, likewise, in the form of its suffix."""
        if path is not None:
            from lcpcli.report import plotting

            form = plotting.form_of(path)
            self.add(path, lambda: plotting.made(kind, *data).content(form))


class Output(Destination):
    """The choice of what is shown of a request, in which format and where, checked
    before any computation.

    with_iterates : whether the iterates are added to the output.
    """

    def __init__(self, request: Request) -> None:
        super().__init__(request.form, request.output, request.quiet)
        self.request = request
        asks = request.trace or bool(request.every or request.columns)
        self.with_iterates = asks and not self.silent
        kind = self.kind
        in_table = bool(kind.renderer) and (kind.has_figures or not request.sweep)
        self._keeps_iterates = self.with_iterates or (in_table and not self.silent)
        self.columns = request.columns or ()
        columns.require(self.columns, [each.method for each in request.variants])
        self._of_traces = columns.of_traces(self.columns)
        is_json = kind.has_records and not self.silent
        modes = {
            QUIET: self.silent,
            NO_ITERATES: not self._keeps_iterates,
            JSON: is_json,
            ITERATES_IN_JSON: is_json and not self._of_traces,
            NO_UNKNOWNS: not kind.has_proofs
            and bool(request.sweep)
            and not self.with_iterates,
            CSV: not kind.has_proofs,
        }
        reject_conflicting_options(request.option_values, *among(modes))
        for figure, drawn in self.figures.items():
            require_plot(drawn, FIGURES[figure].option)

    @property
    def figures(self) -> dict[str, str]:
        """Return the files of the requested figures, by kind."""
        request = self.request
        asked = {"paths": request.paths, "convergence": request.plot}
        return {kind: file for kind, file in asked.items() if file is not None}

    def shows_answer(self, problems: Sequence[AnyProblem]) -> bool:
        """Return whether the figure is that of an answer, without any iterates."""
        is_single = len(problems) == len(self.request.variants) == 1
        if not is_single or [*self.figures] != ["convergence"]:
            return False
        origin = problems[0].origin
        return origin is not None and origin.has_picture

    def traces(
        self, problem: AnyProblem, shows_answer: bool = False
    ) -> tuple[Trace | None, Trace | None]:
        """Return an empty trace for iterates that are shown or written, and an empty
        curve for the figure and for the levels; each keeps only what is needed.

        shows_answer : whether the figure needs no curve.
        """
        request, levels = self.request, self.request.levels if problem.solutions else ()
        draws = self.kind.has_figures or (bool(self.figures) and not shows_answer)
        has_curve = draws or bool(levels)
        if not (self._keeps_iterates or has_curve):
            return None, None
        import numpy as np

        from lcpcli.solving.trace import Trace

        trace = curve = None
        if self._keeps_iterates and not self.kind.renderer:
            trace = Trace(request.every or 1, columns=self._of_traces)
        elif self._keeps_iterates:
            trace = Trace(
                *self._selection(problem),
                residuals=not problem.solutions
                or not {"residual", ALL}.isdisjoint(self.columns),
                columns=self._of_traces,
            )
        if has_curve:
            every, max_points = (1, MAX_POINTS) if draws else (sys.maxsize, None)
            residuals = draws and not problem.solutions
            curve = Trace(
                every,
                max_points,
                np.empty(0, dtype=np.intp),
                residuals,
                levels,
                request.paths is not None,
            )
        return trace, curve

    def draw_runs(self, runs: Sequence[Sequence[Result]]) -> None:
        for kind, file in self.figures.items():
            self.draw(file, kind, runs)

    def _selection(self, problem: AnyProblem) -> tuple[int, int | None, Indices | None]:
        """Return the selection of a table: the step and the largest number of its
        iterates, and their components."""
        from lcpcli.report.tables import kept_components

        width = self.width if self.kind.fits_screen else None
        components = kept_components(problem, width, self.request.names)
        if self.request.every is not None:
            return self.request.every, None, components
        if self.kind.has_figures:
            return 1, MAX_POINTS, components
        max_rows = MAX_ROWS
        # They fit on a screen.
        if width is not None and not self.request.levels:
            max_rows = min(MAX_ROWS, max(MIN_ROWS, size().lines - SUMMARY_LINES))
        return int(EVERY.value), max_rows, components


def require_plot(file: str | None, option: str = "plot") -> None:
    """Refuse a figure of another suffix, or if the package that draws is missing."""
    if file is None:
        return
    from lcpcli.report import plotting

    plotting.require(option)
    plotting.form_of(file, option)
    hush()


def hush() -> None:
    """Keep matplotlib from warning on standard error that it has no folder for its
    cache."""
    import logging

    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def show(content: str | bytes, path: str | None, color: bool = False) -> None:
    if path is None:
        emit(str(content), color)
    else:
        from lcpcli.files import atomic_write

        atomic_write.write_whole(path, content)
