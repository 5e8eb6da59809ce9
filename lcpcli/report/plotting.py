"""Runs as a picture, for a file or a notebook."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lcpcli.errors import ParameterError, count
from lcpcli.files.atomic_write import write_whole
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.report import wording
from lcpcli.report.figures import drawing
from lcpcli.report.figures.data import Curve, Panel
from lcpcli.solving.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """The curves of runs, one panel per problem; a notebook shows it."""

    panels: Sequence[Panel]

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write it as .png, .svg or .pdf, completely or not at all."""
        file = os.fspath(file)
        write_whole(file, drawing.convergence(self.panels, drawing.form_of(file)))

    def __repr__(self) -> str:
        runs = sum(len(panel.curves) for panel in self.panels)
        return f"<Picture: {count(runs, 'run')} on {count(len(self.panels), 'problem')}>"

    def _repr_svg_(self) -> str:
        return drawing.convergence(self.panels, "svg").decode()


def plot(results: Result | Sequence[Result], file: str | os.PathLike[str] | None = None) -> Picture:
    """Draw error against run time and against iteration, or the residual where no solution is known.

    Parameters
    ----------
    results : one or several, each solved with trace=True. Those on the same problem share a panel, in which runs of
        one method are told apart by the options in which they differ.
    file : where to write the picture as well: .png, .svg or .pdf.

    Returns
    -------
    Picture : a notebook shows it; its `save(file)` writes it.

    Raises
    ------
    OptionError : a result has no trace; the suffix is not one of these; the file cannot be written; matplotlib is
        missing, which comes with the extra `plot`.

    Examples
    --------
    >>> import lcpcli
    >>> problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    >>> lcpcli.plot([lcpcli.run(problem, method, trace=True) for method in ("shi", "fixed-point")], "errors.svg")
    <Picture: 2 runs on 1 problem>
    """
    drawing.require()
    groups: list[list[Result]] = []
    for result in [results] if isinstance(results, Result) else results:
        if result.trace is None and result.curve is None:
            raise ParameterError("trace", f"{result.method} has kept no iterates", "solve with trace=True")
        group = next((group for group in groups if _is_same(group[0].problem, result.problem)), None)
        if group is None:
            groups.append(group := [])
        group.append(result)
    if not groups:
        raise ParameterError("results", "there are none", "give at least one")
    picture = Picture(panels([_told_apart(group) for group in groups]))
    if file is not None:
        picture.save(file)
    return picture


def _told_apart(group: Sequence[Result]) -> list[Result]:
    """The results with labels that name the options in which runs of one method differ."""
    labelled = []
    for result in group:
        alike = [other.options for other in group if wording.name(other) == wording.name(result)]
        apart = [
            f"{name}={value if isinstance(value, (bool, str)) else f'{value:g}'}"
            for name, value in result.options.items()
            if isinstance(value, (bool, int, float, str)) and any(options.get(name) != value for options in alike)
        ]
        label = f"{result.label or result.method}:{','.join(apart)}" if apart else result.label
        labelled.append(replace(result, label=label))
    return labelled


def _is_same(one: Problem, other: Problem) -> bool:
    """Whether two problems have the same M, q and bounds, and curves of the same measure."""
    if one is other:
        return True
    if bool(one.solutions) != bool(other.solutions) or is_sparse(one.M) != is_sparse(other.M):
        return False
    vectors = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("q", "lower", "upper"))
    return vectors and not abs(one.M - other.M).max()


def panels(runs: Sequence[Sequence[Result]]) -> list[Panel]:
    """The curves of the runs, grouped by problem; each run must have recorded a `curve` or a trace.

    Errors are drawn if a solution is known or computed, else residuals. Time is that of the rows.
    """
    drawn = []
    for results in runs:
        problem = results[0].problem
        measure = "error" if problem.solutions else "residual"
        title = ", ".join(filter(None, (wording.title(problem), wording.size(problem))))
        curves = [_curve(result, measure) for result in results]
        drawn.append(Panel(title, measure, curves, "; ".join(wording.provenance(results))))
    return drawn


def _curve(result: Result, measure: str) -> Curve:
    kept = result.curve or result.trace
    rows = kept.rows if kept else []
    k, seconds, errors = ([getattr(row, name) for row in rows] for name in ("k", "seconds", measure))
    return Curve(result.method, wording.name(result).replace(" warm", ", warm"), k, seconds, errors, result.solved)
