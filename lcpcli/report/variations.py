"""The last error of a run, and its time, against the value of an option: tables and the
data of a figure, of options that are varied one at a time on several problems."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from lcpcli.report import plotting, wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.plotting import THEORY, Line, Picture, Variation
from lcpcli.solving.result import Result

NOTE = "in parentheses: the run has not reached the tolerance"


def variations(runs: Sequence[Sequence[Result]]) -> list[Variation]:
    """Return the runs, grouped by problem, and then by the option that varies according
    to their labels."""
    options = list(
        dict.fromkeys(_setting(result)[1] for results in runs for result in results)
    )
    return [_variation(option, runs) for option in options]


def _variation(option: str, runs: Sequence[Sequence[Result]]) -> Variation:
    runs_by_problem = [
        [result for result in results if _setting(result)[1] == option]
        for results in runs
    ]
    every = [result for results in runs_by_problem for result in results]
    names = list(dict.fromkeys(_setting(result)[0] for result in every))
    values = list(dict.fromkeys(_setting(result)[2] for result in every))
    is_known = all(result.error is not None for result in every)
    measure = "error" if is_known else "residual"
    lines = []
    for name in names:
        for results in runs_by_problem:
            selected = [result for result in results if _setting(result)[0] == name]
            if not selected:  # by Ctrl-C
                continue
            title = wording.title(selected[0].problem)
            lines.append(
                Line(
                    f"{name}, {title}" if len(names) > 1 else title,
                    [_setting(result)[2] for result in selected],
                    [getattr(result, measure) for result in selected],
                    [result.seconds for result in selected],
                    [result.solved for result in selected],
                )
            )
    theory = [math.log(3) / float(value) for value in values] if option == "p" else []
    return Variation(option, values, lines, measure, theory)


def _setting(result: Result) -> tuple[str, str, str]:
    """Return the name of a run without the option that varies, this option, which is
    the last one, and its value."""
    name, _, settings = wording.name(result).partition(":")
    others, _, setting = settings.rpartition(",")
    option, _, value = setting.partition("=")
    return f"{name}:{others}" if others else name, option, value


def document(runs: Sequence[Sequence[Result]]) -> Document:
    drawn = variations(runs)
    sections = [_section(each) for each in drawn]
    results = [result for variation in runs for result in variation]
    sections[-1] = sections[-1]._replace(
        provenance=wording.made_by(results, one_at_a_time=True),
        figure=partial(picture, runs) if _are_numbers(drawn) else None,
    )
    options = " and ".join(variation.option for variation in drawn)
    return Document(f"Error and time against {options}", sections)


def _are_numbers(drawn: Sequence[Variation]) -> bool:
    return all(
        plotting.is_number(value) for variation in drawn for value in variation.values
    )


def picture(runs: Sequence[Sequence[Result]]) -> Picture:
    return plotting.variations(variations(runs), runs)


def _section(variation: Variation) -> Section:
    """Return the tables of the errors and the times, with a column for each problem."""
    names = [line.label for line in variation.lines]
    length, unit = wording.common_unit(
        t for line in variation.lines for t in line.seconds
    )
    theory = [THEORY] * bool(variation.theory)
    errors, times = list[list[str]](), list[list[str]]()
    for i, value in enumerate(variation.values):
        expected = [wording.short(variation.theory[i])] if variation.theory else []
        # Runs that Ctrl-C has prevented are missing.
        index_of_value = [
            {v: k for k, v in enumerate(line.values)} for line in variation.lines
        ]
        at = [
            (line, indices[value]) if value in indices else None
            for line, indices in zip(variation.lines, index_of_value, strict=True)
        ]
        error_cells = [
            wording.short(pair[0].errors[pair[1]]) if pair else "" for pair in at
        ]
        errors.append([value, *expected, *error_cells])
        times.append([value, *(_time(*pair, length) if pair else "" for pair in at)])
    notes = [NOTE] * any(not all(line.solved) for line in variation.lines)
    tables = [
        Table([variation.option, *theory, *names], [errors], words=()),
        Table([variation.option, *names], [times], words=(), notes=notes),
    ]
    title = f"{variation.option}: {variation.measure} of the result, and time in {unit}"
    return Section(title, tables=tables)


def _time(line: Line, i: int, length: float) -> str:
    text = wording.digits(line.seconds[i] / length, 2)
    return text if line.solved[i] else f"({text})"
