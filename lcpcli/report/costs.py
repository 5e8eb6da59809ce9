"""The summary of compared runs: for each, the options that distinguish it, its costs, and how it ended."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.report import wording
from lcpcli.report.document import Table
from lcpcli.report.wording import LEVELS
from lcpcli.solving.result import Result

SHORT = {"iteration_limit": "k limit", "time_limit": "t limit"}  # for crowded rows
NOT_REACHED = "-"
NOTE = "to: errors relative to the solution's largest component"
FALSE = "FALSE"  # in place of the status of a run whose claim does not hold


def summary(results: Sequence[Result], width: int | None) -> Table:
    """Return a row for each run: the iterations and the time to each level of error, if these are recorded, and to the
    verified end.

    All times are in one unit. Options by which runs differ have columns of their own. width : the width of the
    terminal, None for no limit; a summary that is too wide leaves out levels, the coarsest first.
    """
    are_noted = any(result.curve is not None and result.curve.levels for result in results)
    made = [_summary(results, LEVELS[i:] if are_noted else (), are_noted) for i in range(len(LEVELS) + 1)]
    return next((each for each in made if width is None or _width(each) <= width), made[-1])


def _width(each: Table) -> int:
    """Return the number of columns of text, with a blank after each column and room for a mark."""
    return sum(width + 1 for width in each.widths()) + len(each.best)


def _summary(results: Sequence[Result], levels: Sequence[float], are_noted: bool) -> Table:
    """Return the summary with the costs of these levels; if no costs `are_noted`, it has evaluations and residuals."""
    settings = [_settings(result) for result in results]
    options = list(dict.fromkeys(name for own in settings for name in own))
    attained = [reached(result) for result in results]
    length, unit = wording.common_unit(
        [r.seconds for r in results] + [own[level][1] for own in attained for level in levels if level in own]
    )
    has_error = any(result.error is not None for result in results)
    counts = [] if are_noted else ["evaluations", "residual"]
    header = ["method", *options, *(name for level in levels for name in (f"to {wording.level(level)}", unit))]
    header += ["end" if are_noted else "iterations", unit, *counts, *["error"] * has_error, "status"]
    rows = []
    for result, own, at in zip(results, settings, attained, strict=True):
        costs = [at.get(level) for level in levels] + [(result.iterations, result.seconds)]
        row = [result.method, *(own.get(option, "") for option in options)]
        row += [cell for cost in costs for cell in _cost(cost, length)]
        row += [str(result.evaluations), wording.residual(result)] * (not are_noted)
        rows.append(row + [wording.error(result.error, result.problem)] * has_error + [_status(result)])
    first = 1 + len(options)
    times = [[at[level][1] if level in at else None for at in attained] for level in levels]
    times.append([result.seconds if result.solved else None for result in results])
    best = {(row, first + 2 * j + 1) for j, column in enumerate(times) for row in _shortest(column)}
    notes = [NOTE] * any(name.startswith("to ") for name in header)
    return Table(header, [rows], words=(0, len(header) - 1), best=best, why="the shortest time", notes=notes)


def _settings(result: Result) -> dict[str, str]:
    """Return the options that set a run apart, by name."""
    settings = (setting.partition("=") for setting in result.label.partition(":")[2].split(",") if setting)
    return {name: value or "yes" for name, _, value in settings}


def reached(result: Result) -> dict[float, tuple[int, float]]:
    """Return the iterations and the seconds until each level of error."""
    return {each.level: (each.k, each.seconds) for each in (result.curve.milestones if result.curve else ())}


def _cost(cost: tuple[int, float] | None, length: float) -> tuple[str, str]:
    if cost is None:
        return NOT_REACHED, NOT_REACHED
    k, seconds = cost
    return str(k), wording.digits(seconds / length)


def _shortest(times: Sequence[float | None]) -> list[int]:
    """Return the index of the shortest time of several runs, or no index if there is nothing to compare."""
    known = [(seconds, i) for i, seconds in enumerate(times) if seconds is not None]
    return [min(known)[1]] if len(times) > 1 and known else []


def _status(result: Result) -> str:
    return FALSE if result.verified is False else SHORT.get(result.word, result.word.replace("_", " "))
