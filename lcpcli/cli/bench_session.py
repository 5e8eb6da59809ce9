"""lcp bench from parsed options to an exit code: start or resume, measure, save, show."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from lcpcli import options
from lcpcli.bench import figure, suites
from lcpcli.bench import record as records
from lcpcli.bench import session as benching
from lcpcli.bench.formats import render
from lcpcli.bench.record import Record, Settings
from lcpcli.cli import problems
from lcpcli.cli.exit_codes import INTERRUPTED
from lcpcli.cli.methods import chosen_variants
from lcpcli.cli.output import emit, form_of, terminal
from lcpcli.cli.progress import Progress, wanted
from lcpcli.cli.session import same_file
from lcpcli.errors import OptionError
from lcpcli.files.atomic_write import refuse_unwritable, reserved, write_whole
from lcpcli.options import ACCEPT, BUDGET, INFINITY, TIME_LIMIT, TOL, flag
from lcpcli.report import plotting as figures

MEASURING = (TOL, TIME_LIMIT, ACCEPT, BUDGET)
ASKED = ("suite", "infinity", "methods", "sweep", "peers", "tol", "time_limit", "accept", "budget")
"""What a resumed record fixes."""


def run(given: dict[str, Any], suite: str, methods: Sequence[str], time_limit: float) -> int:
    """Run the requested bench, with these defaults; return the exit code."""
    output = None if given["output"] == "-" else given["output"]
    kept = {output: form_of(output, otherwise="")} if output is not None else {}
    for path in (output, given["plot"]):
        if path is not None:
            refuse_unwritable(path)
    if given["plot"] is not None:
        figures.form_of(given["plot"])
        figures.require()
    writes = list(kept)
    if given["resume"] is not None and _resume(given).pending():
        writes.append(given["resume"])
    with reserved(writes):
        return _run(given, output, kept, lambda: _start(given, suite, methods, time_limit))


def _run(given: dict[str, Any], output: str | None, kept: dict[str, str], start: Callable[[], Record]) -> int:
    """Run the bench while this run alone has its outputs; return the exit code."""
    if given["resume"] is None:
        record = start()
    else:
        record = _resume(given)
        if output is not None and kept[output] != "json" and same_file(output, given["resume"]):
            raise OptionError(output, "holds the record", "choose another file for the output")
        if record.pending():
            kept = {given["resume"]: "json"} | kept
    _refuse_overwriting(record, [*kept, *filter(None, [given["plot"]])])
    if record.missing and not given["quiet"]:
        click.echo(f"lcp bench: not installed, left out: {', '.join(record.missing)}", err=True)
    interrupted = _measure(record, kept, given["quiet"])
    _keep(record, kept)
    if given["plot"] is not None and record.measurements:
        write_whole(given["plot"], figure.draw(record, figures.form_of(given["plot"])))
    if not given["quiet"]:
        width, color = terminal()
        emit(render(record, given["form"], width, color), color)
    if interrupted:
        _tell_how_to_go_on(record, kept)
        return INTERRUPTED
    return int(any(row.false_success for row in record.measurements))


def _tell_how_to_go_on(record: Record, kept: dict[str, str]) -> None:
    done = len(record.measurements)
    left = sum(len(solvers) for _, solvers in record.pending())
    file = next((path for path, form in kept.items() if form == "json"), None)
    hint = f"; resume with lcp bench --resume {file}" if file else "; with -o FILE.json it could be resumed"
    click.echo(f"lcp bench: interrupted after {done} of {done + left} measurements{hint}", err=True)


def _start(given: dict[str, Any], suite: str, methods: Sequence[str], time_limit: float) -> Record:
    asked = given["suite"] or (suite,)
    numbers = {option.name: given[option.name] for option in MEASURING}
    options.check((*MEASURING, INFINITY), given)
    if numbers["time_limit"] == math.inf:
        raise OptionError("--time-limit", "is infinite", "give a number of seconds; a failure counts as that")
    defaults = {"time_limit": time_limit, "budget": suites.budget_of(asked)}
    for name, value in numbers.items():
        if value is None:
            numbers[name] = defaults.get(name, next(option.default for option in MEASURING if option.name == name))
    settings = Settings(**{name: float(value) for name, value in numbers.items()})
    names = [str(variant) for variant in chosen_variants(given, methods)]
    tell = (lambda _: None) if given["quiet"] else problems.tell
    infinity = None if given["infinity"] == math.inf else given["infinity"]
    return benching.start(asked, names, given["peers"], settings, tell, infinity)


def _resume(given: dict[str, Any]) -> Record:
    for name in ASKED:
        if given[name] not in (None, ()):
            place = "SUITE" if name == "suite" else flag(name if name == "sweep" else name.removesuffix("s"))
            raise OptionError(
                place, "has no effect with --resume, which keeps the options of the bench", "leave it out"
            )
    record = records.read(given["resume"])
    if record.pending():
        benching.refuse_elsewhere(record)
    return record


def _refuse_overwriting(record: Record, paths: Sequence[str]) -> None:
    for path in paths:
        if any(file and same_file(path, file) for case in record.cases for file in (case.file, case.q_file)):
            raise OptionError(path, "holds a problem", "choose another file for the output")


def _measure(record: Record, kept: dict[str, str], quiet: bool) -> bool:
    """Measure all that is pending, saving each measurement as it comes; return whether that was interrupted."""
    files = {path: form for path, form in kept.items() if Path(path).is_file() or not Path(path).exists()}
    _keep(record, files)
    left = sum(len(solvers) for _, solvers in record.pending())
    with Progress(left, shown=wanted(quiet)) as progress:
        try:
            for _ in benching.run(record, progress.starting):
                progress.finished()
                _keep(record, files)
        except KeyboardInterrupt:
            return True
    return False


def _keep(record: Record, kept: dict[str, str]) -> None:
    for path, form in kept.items():
        write_whole(path, render(record, form, None, False))
