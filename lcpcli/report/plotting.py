"""Figures of results and their data: the bytes of a picture, by matplotlib, in one of
FORMS. Nothing heavy is imported until a figure is requested. Each function raises
OptionError if matplotlib is missing.

For performance profiles, see E. D. Dolan and J. J. Moré, Benchmarking optimization
software with performance profiles, Math. Program. 91 (2002) 201-213; for complementary
cones, K. G. Murty, On the number of solutions to the complementarity problem and
spanning properties of complementary cones, Linear Algebra Appl. 5 (1972) 65-108.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.errors import (
    LEAVE_OUT,
    ParameterError,
    count,
    missing,
    shortened,
)
from lcpcli.files.atomic_write import write_whole
from lcpcli.report import wording
from lcpcli.report.document import FIGURES

if TYPE_CHECKING:
    from lcpcli.enumeration.search import SolutionSet
    from lcpcli.model.problem import Problem
    from lcpcli.parametric.path import Path
    from lcpcli.solving.result import Result

FORMS = ("png", "svg", "pdf")
# Rows of axes that fit on a page of A4 with readable labels, each 1.5 inches high.
MAX_PANELS = 7
MAX_PLANES = 6  # problems whose paths of iterates fit on a page, two in a row
PLOT = "plot"


class Curve(NamedTuple):
    """One run on one problem.

    name : the method or peer, by which colour, marker and line style are chosen. label
        : the name of the run in the legend.
    k : the numbers of the iterates; an iterate whose number is None is skipped where k
        is the abscissa.
    seconds, errors : of each iterate the run time, and the error or residual; None
        where it was not measured.
    solved : whether the run solved the problem; a cross marks the last iterate of any
        other one.
    x : the iterates of a problem in two unknowns, if they were recorded.
    """

    name: str
    label: str
    k: Sequence[int | None]
    seconds: Sequence[float]
    errors: Sequence[float | None]
    solved: bool
    x: Sequence[Sequence[float]] = ()


class Panel(NamedTuple):
    """The runs on one problem. measure : "error" or "residual", whichever the curves
    have. provenance : a line on the program and its options, for the file's metadata.
    problem, solutions : for runs with recorded x, the LCP and the x = (z - w) / 2 of
        its known solutions."""

    title: str
    measure: str
    curves: Sequence[Curve]
    provenance: str = ""
    problem: Any = None
    solutions: Sequence[Sequence[float]] = ()


class Profile(NamedTuple):
    """One solver's times, one per problem, as multiples of the fastest solver's or in
    seconds; inf where it failed."""

    name: str
    label: str
    ratios: Sequence[float]
    in_seconds: bool = False


class Fitted(NamedTuple):
    """Measurements, the curve that fits them, and the parts of which it is the sum, by
    their names."""

    title: str
    measured: Any
    curve: Any
    parts: Mapping[str, Any]


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """A figure, drawn when it is written; a notebook shows it.

    kind : a key of FIGURES. data : what its function draws. provenance : lines for the
        metadata of the file. text : what the figure shows, for the interpreter.
    """

    kind: str
    data: Sequence[Any]
    provenance: Sequence[str]
    text: str = ""

    def save(self, file: str | os.PathLike[str] | None) -> Picture:
        """Write the picture as .png, .svg or .pdf, completely or not at all, if there
        is a file."""
        if file is not None:
            write_whole(os.fspath(file), self.content(form_of(os.fspath(file))))
        return self

    def content(self, file_format: str) -> bytes:
        require()
        from lcpcli.report.figures import style

        figure = FIGURES[self.kind]
        draw = _function(f"report.figures.{figure.drawn_by}")
        return style.file(
            lambda: draw(*self.data), file_format, figure.title, self.provenance
        )

    def __repr__(self) -> str:
        return f"<Picture: {self.text}>"

    def _repr_svg_(self) -> str:
        return self.content("svg").decode()


def _function(dotted_name: str) -> Callable[..., Any]:
    module, _, name = dotted_name.rpartition(".")
    function: Callable[..., Any] = getattr(import_module(f"lcpcli.{module}"), name)
    return function


def made(kind: str, *data: Any) -> Picture:
    """Return the picture of a kind, a key of FIGURES, for its data."""
    picture: Picture = _function(FIGURES[kind].made_by)(*data)
    return picture


def convergence(panels: Sequence[Panel]) -> Picture:
    """Return a picture with one row per panel: the error against the run time and
    against the iteration."""
    require_room(len(panels))
    text = (
        f"{count(sum(len(panel.curves) for panel in panels), 'run')} on "
        f"{count(len(panels), 'problem')}"
    )
    return Picture(
        "convergence", [panels], [panel.provenance for panel in panels], text
    )


def runs_or_answer(runs: Sequence[Sequence[Result]]) -> Picture:
    """Return the picture of the answer of a single run, if it has one; else that of
    the errors of the runs."""
    if len(runs) == 1 and len(runs[0]) == 1:
        from lcpcli.model.formulation import Answer

        result = runs[0][0]
        picture: Picture | None = (
            result.answer.picture(wording.title(result.problem))
            if isinstance(result.answer, Answer)
            else None
        )
        if picture is not None:
            return picture
    return convergence(panels(runs))


def cones(solution_set: SolutionSet) -> Picture:
    """Return a picture of q and the complementary cones of an LCP with two unknowns; a
    cone with q gives a solution."""
    return Picture(
        "cones", [solution_set], [f"{wording.PROGRAM}: {solution_set.message}"]
    )


def paths(panels: Sequence[Panel]) -> Picture:
    """Return a picture of the iterates of runs on LCPs with two unknowns, over the
    merit function."""
    return Picture("paths", [panels], [panel.provenance for panel in panels])


def paths_of(runs: Sequence[Sequence[Result]]) -> Picture:
    """Return the picture of runs, grouped by problem, as `paths`."""
    return paths(panels(runs))


def form_of(path: str, option: str = PLOT) -> str:
    """Return the form of the picture that an option requests, by the suffix of the
    path."""
    ending = PurePath(path).suffix.lower().lstrip(".")
    if ending not in FORMS:
        raise ParameterError(
            option,
            f"{shortened(path)!r} has no known suffix of a picture",
            "use one of .png, .svg, .pdf",
        )
    return ending


def require_room(
    problems: int, option: str = PLOT, max_problems: int = MAX_PANELS
) -> None:
    if problems > max_problems:
        reason = f"would draw {problems} problems, and a page can hold {max_problems}"
        raise ParameterError(option, reason, "draw fewer at a time")


def is_plane(problem: Problem) -> bool:
    return not problem.is_mixed and problem.n == 2


def require_plane(problems: Sequence[Problem], option: str = PLOT) -> None:
    """Refuse problems that are no LCPs with two unknowns, and more than fit on a
    page."""
    require_room(len(problems), option, MAX_PLANES)
    for problem in problems:
        if not is_plane(problem):
            reason = (
                f"draws LCPs with two unknowns, not one with {wording.size(problem)}"
            )
            raise ParameterError(option, reason, LEAVE_OUT)


def require_drawable(kind: str, problems: Sequence[Problem]) -> None:
    """Refuse what a figure, by its key in FIGURES, cannot show."""
    if FIGURES[kind].in_plane:
        require_plane(problems, FIGURES[kind].option)
    else:
        require_room(len(problems))


def require(option: str = PLOT) -> None:
    """Raise ParameterError, before any work, if matplotlib is missing, which the option
    needs."""
    if find_spec("matplotlib") is None:
        raise ParameterError(option, *missing("matplotlib"))


def plot_path(
    path: Path, file: str | os.PathLike[str] | None = None, show: Sequence[str] = ()
) -> Picture:
    """Draw the solutions along a path, of the unknowns to `show` alone if there are
    any, and the objective of a program."""
    require()
    data = [path, [show] if isinstance(show, str) else show]
    text = f"path of {count(path.t.size, 'breakpoint')}"
    return Picture("response", data, [f"{wording.PROGRAM}: {path}"], text).save(file)


def plot(
    results: Result | Sequence[Result], file: str | os.PathLike[str] | None = None
) -> Picture:
    """Draw the error, or the residual if no solution is known, against run time and
    against iteration.

    Parameters
    ----------
    results : one or more results, each of a run with trace=True. Results for the same
        problem share a panel; the labels of runs of one method show the options in
        which they differ.
    file : a file to which the picture is also written: .png, .svg or .pdf.

    Returns
    -------
    Picture : a notebook shows it; its `save(file)` writes it.

    Raises
    ------
    OptionError : a result has no trace; the suffix is not one of these; the file cannot
        be written; or matplotlib, which comes with the extra `plot`, is missing.

    Examples
    --------
    >>> import lcpcli
    >>> problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    >>> methods = ("shi", "fixed-point")
    >>> results = [lcpcli.run(problem, method, trace=True) for method in methods]
    >>> lcpcli.plot(results, "errors.svg")
    <Picture: 2 runs on 1 problem>
    """
    from lcpcli.solving.result import Result

    require()
    groups: list[list[Result]] = []
    for result in [results] if isinstance(results, Result) else results:
        if result.trace is None and result.curve is None:
            raise ParameterError(
                "trace",
                f"{result.method} has no recorded iterates",
                "solve with trace=True",
            )
        group = next(
            (group for group in groups if _is_same(group[0].problem, result.problem)),
            None,
        )
        if group is None:
            groups.append(group := [])
        group.append(result)
    if not groups:
        raise ParameterError("results", "there are none", "give at least one")
    return convergence(panels([_with_labels(group) for group in groups])).save(file)


def _with_labels(group: Sequence[Result]) -> list[Result]:
    """Return the results with labels that name the options in which runs of one method
    differ."""
    labelled = []
    for result in group:
        alike = [
            other.options
            for other in group
            if wording.name(other) == wording.name(result)
        ]
        apart = [
            f"{name}={value if isinstance(value, (bool, str)) else f'{value:g}'}"
            for name, value in result.options.items()
            if isinstance(value, (bool, int, float, str))
            and any(options.get(name) != value for options in alike)
        ]
        label = f"{wording.name(result)}:{','.join(apart)}" if apart else result.label
        labelled.append(replace(result, label=label))
    return labelled


def _is_same(one: Problem, other: Problem) -> bool:
    """Return whether two problems have the same M, q and bounds, and curves of the same
    measure."""
    from numpy import array_equal

    from lcpcli.linalg.matrices import are_equal

    pairs = (
        (getattr(one, name), getattr(other, name)) for name in ("q", "lower", "upper")
    )
    alike = bool(one.solutions) == bool(other.solutions) and are_equal(one.M, other.M)
    return one is other or (alike and all(array_equal(*pair) for pair in pairs))


def panels(runs: Sequence[Sequence[Result]]) -> list[Panel]:
    """Return the curves of the runs, grouped by problem, of errors if a solution is
    known or computed, else of residuals, and the recorded x; each run must have
    recorded a `curve` or a trace."""
    drawn = []
    for results in runs:
        problem = results[0].problem
        curves, solutions = list[Curve](), list[list[float]]()
        measure = "error" if problem.solutions else "residual"
        for result in results:
            recorded = result.curve or result.trace
            rows = recorded.rows if recorded else []
            k, seconds, errors = (
                [getattr(row, name) for row in rows]
                for name in ("k", "seconds", measure)
            )
            x = [row.x.tolist() for row in rows if row.x is not None]
            curves.append(
                Curve(
                    result.method,
                    wording.name(result),
                    k,
                    seconds,
                    errors,
                    result.solved,
                    x,
                )
            )
        if any(curve.x for curve in curves):
            known_solutions = [
                *problem.solutions,
                *(result.z for result in results if result.solved),
            ]
            solutions = [((z - problem.w(z)) / 2).tolist() for z in known_solutions]
        title = wording.title_and_size(problem)
        provenance = f"{title}: {'; '.join(wording.provenance(results))}"
        drawn.append(Panel(title, measure, curves, provenance, problem, solutions))
    return drawn
