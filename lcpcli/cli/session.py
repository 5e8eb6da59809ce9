"""From parsed options to an exit code: read, run, show."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lcpcli import options
from lcpcli.cli import problems as problems_in
from lcpcli.cli import threads
from lcpcli.cli.exit_codes import INTERRUPTED
from lcpcli.cli.methods import for_methods
from lcpcli.cli.options import limits
from lcpcli.cli.output import HERE, Output, Plot, emit, terminal
from lcpcli.cli.progress import Line, wanted
from lcpcli.errors import OptionError
from lcpcli.files.keys import BOUNDS

if TYPE_CHECKING:
    from lcpcli.methods.variants import Variant
    from lcpcli.model.problem import Problem
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.limits import Limits
    from lcpcli.solving.result import Result
    from lcpcli.typing import Vector

OF_OUTPUT = ("form", "trace", "every", "output", "quiet", "bound")
BRIEF, REPEATS = 0.02, 3  # shorter runs, in seconds, are timed as the fastest of that many: a first one is slow


def run(
    files: Sequence[str],
    variants: Sequence[Variant],
    given: dict[str, Any],
    *,
    levels: tuple[float, ...] = (),
    exact: bool = False,
) -> int:
    """Run the methods on each of the problems, given by their files; show the results; return the worst exit code.

    files : of one problem; with levels, of several.
    levels : relative errors whose first attainment is recorded; with them, and for figures, a problem without a known
        solution is solved beforehand to provide the reference for errors.
    exact : prove each result in rational arithmetic.
    """
    threads.settle(files, given["threads"])
    output = Output(exact=exact, compared=bool(levels), **{name: given[name] for name in OF_OUTPUT})
    plot = Plot(given["plot"], levels)
    options.check((options.WARM,), given)
    if exact:
        from lcpcli.rational.linear import require

        require()
    of_z = {name: given[name] for name in BOUNDS}
    _refuse_amiss(problems_in.inputs(files, of_z), output, plot)
    bounds = limits(given)
    problems, data = _read(files, of_z, exact, bool(levels), given["quiet"])
    plot.require_room(len(problems))
    chosen = [for_methods(given, variants, problem) for problem in problems]
    if levels or plot.path is not None:
        problems = _all_referred(problems, bounds)
    width, color = (None, False) if output.path else terminal()
    runs = _runs(problems, variants, chosen, bounds, given.get("warm"), (output, plot, width), wanted(given["quiet"]))
    results, interrupted = _finished(runs, data, bounds, given["bound"])
    if not output.silent:
        results = [_concluded(own, compared=bool(levels)) for own in results]
    _write_trace(results, output.trace_path)
    _show(results, output, width, color, compared=bool(levels))
    plot.show(results)
    return INTERRUPTED if interrupted else max(result.exit_code for own in results for result in own)


def _finished(
    runs: Iterator[tuple[int, Result]], proofs: Sequence[ExactProblem], bounds: Limits, bounded: bool
) -> tuple[list[list[Result]], bool]:
    """The results by problem with the proofs requested, those before Ctrl-C if it came, and whether it came."""
    results: dict[int, list[Result]] = {}
    try:
        for i, result in runs:
            results.setdefault(i, []).append(result)
            if result.interrupted:
                return list(results.values()), True
        for i, own in results.items():
            if proofs:
                own[:] = _proved(proofs[i], own, bounds)
        for own in results.values():
            for k, result in enumerate(own if bounded else []):
                own[k] = result if result.interrupted else _bounded(result)
    except KeyboardInterrupt:
        if not results:
            raise
        return list(results.values()), True
    return list(results.values()), any(result.interrupted for own in results.values() for result in own)


def _concluded(results: Sequence[Result], compared: bool) -> list[Result]:
    """Results on one problem with the conclusions from them and, in a comparison, with their claims verified."""
    from lcpcli.solving.conclusions import concluded, verified

    return [verified(result) if compared else result for result in concluded(results)]


def _refuse_amiss(files: Sequence[str], output: Output, plot: Plot) -> None:
    """Refuse conflicting inputs and outputs."""
    written = {"--output": output.path, "--trace": output.trace_path, "--plot": plot.path}
    refuse_clashes(files, written)
    if plot.path == HERE and output.path is None and output.form != "table":
        form = {"markdown": "Markdown", "latex": "LaTeX"}.get(output.form, output.form.upper())
        raise OptionError("--plot -", f"would be mixed into the {form}", "name a file, or write that to one by -o")


def _read(
    files: Sequence[str], bounds: problems_in.Given, exact: bool, several: bool, quiet: bool
) -> tuple[list[Problem], list[ExactProblem]]:
    """The problem in the files, or several; and, for exact arithmetic, the same in rational numbers."""
    if several:
        return problems_in.read_each(files, bounds, quiet), []
    if not exact:
        return [problems_in.read(files, bounds, quiet)], []
    data = problems_in.read_exact(files, bounds, quiet)
    return [data.problem], [data]


def _write_trace(results: Sequence[Sequence[Result]], path: str | None) -> None:
    """Write all iterates to the file for them, if there is one."""
    if path is None:
        return
    from lcpcli.files import atomic_write
    from lcpcli.report import trace_csv

    atomic_write.write_whole(path, trace_csv.render([result for own in results for result in own]))


def _show(results: Sequence[Sequence[Result]], output: Output, width: int | None, color: bool, compared: bool) -> None:
    """Print the results, or write them to the output file."""
    if output.silent:
        return
    from lcpcli.files import atomic_write
    from lcpcli.report import render as report

    shown = [[output.shown(result, width) for result in own] for own in results]
    whole, iterates = output.path is not None, output.with_iterates
    text = report.render(shown, output.form, width, color, compared=compared, whole=whole, iterates=iterates)
    if output.path is None:
        emit(text, color)
    else:
        atomic_write.write_whole(output.path, text)


def _runs(
    problems: Sequence[Problem],
    variants: Sequence[Variant],
    chosen: Sequence[Sequence[dict[str, Any]]],
    bounds: Limits,
    warm: float | None,
    shown: tuple[Output, Plot, int | None],
    watched: bool,
) -> Iterator[tuple[int, Result]]:
    """One result per problem and variant, each with the number of its problem; with `warm`, a second one started near
    the solution."""
    from lcpcli.methods.registry import METHODS
    from lcpcli.methods.variants import labels
    from lcpcli.solving import run as driver

    output, plot, width = shown
    timed = plot.path is not None or not output.silent

    def run_once(problem: Problem, variant: Variant, label: str, values: dict[str, Any]) -> Result:
        trace, curve = output.trace(problem, width), plot.curve(problem)
        with Line() as line:
            observe = line.tell if watched else None
            result = driver.run(
                problem,
                variant.method,
                limits=bounds,
                trace=trace,
                curve=curve,
                observe=observe,
                conclude=False,
                **values,
            )
            return replace(result, label=label)

    for i, (problem, own) in enumerate(zip(problems, chosen, strict=True)):
        near = None if warm is None else _near(problem, warm)
        for variant, label, values in zip(variants, labels(variants), own, strict=True):
            for result in _quickest(partial(run_once, problem, variant, label, values), timed):
                yield i, result
            if near is not None and METHODS[variant.method].uses_start:
                again = {**values, "x0": near, "z0": None, "basis": None}
                for result in _quickest(partial(run_once, problem, variant, label, again), timed):
                    yield i, replace(result, warm=True)


def _quickest(once: Callable[[], Result], timed: bool) -> Iterator[Result]:
    """A run; if it is timed and short, the fastest of several.

    Raises KeyboardInterrupt after the result if a repetition was interrupted.
    """
    runs, interrupted = [once()], False
    try:
        while timed and len(runs) < REPEATS and runs[0].seconds < BRIEF and not runs[-1].interrupted:
            runs.append(once())
    except KeyboardInterrupt:
        interrupted = True
    whole = [run for run in runs if not run.interrupted]
    yield min(whole or runs, key=lambda result: result.seconds)
    if interrupted or (whole and len(whole) < len(runs)):
        raise KeyboardInterrupt


def _proved(data: ExactProblem, results: Sequence[Result], bounds: Limits) -> list[Result]:
    """Each result with what is proved about it in the time that the run has left."""
    from lcpcli.solving.proof import prove

    return [prove(data, result, bounds.time_limit - result.seconds) for result in results]


def _near(problem: Problem, size: float) -> Vector:
    from lcpcli.solving import reference

    return reference.near(problem, size)


def _bounded(result: Result) -> Result:
    """The result with what is proved about its error."""
    from lcpcli.bounds.error_bound import NO_BOUND, error_bound

    return replace(result, bound=error_bound(result.problem, result.z) or NO_BOUND)


def _all_referred(problems: Sequence[Problem], bounds: Limits) -> list[Problem]:
    """The problems with reference solutions. Ctrl-C is reported, as there is no iterate yet to report."""
    try:
        return [_referred(problem, bounds) for problem in problems]
    except KeyboardInterrupt:
        if sys.stderr is not None:
            click.echo("lcp: interrupted while solving for the reference of the errors, before the first run", err=True)
        raise


def _referred(problem: Problem, bounds: Limits) -> Problem:
    """The problem with a reference solution for errors, if one is found within the time limit of a run."""
    from lcpcli.solving import reference

    return reference.with_reference(problem, min(bounds.time_limit, reference.SECONDS))


def refuse_clashes(inputs: Sequence[str], outputs: Mapping[str, str | None]) -> None:
    """Refuse to read standard input twice, and outputs, by their options, that would overwrite a problem or each
    other."""
    refuse_twice(inputs)
    written: dict[Path, str] = {}
    for option, output in outputs.items():
        if output is None:
            continue
        if any(same_file(output, name) for name in inputs):
            raise OptionError(output, "holds the problem", "choose another file for the output")
        earlier = written.setdefault(Path(output).absolute(), option)
        if earlier != option:
            raise OptionError(option, f"goes to the same file as {earlier}", "choose another file for one")


def refuse_twice(paths: Sequence[str | None]) -> None:
    """Raise OptionError if standard input is given for two files."""
    from lcpcli.files import reading

    if paths.count(reading.STANDARD_INPUT) > 1:
        raise OptionError("standard input", "can be read only once", "name a file")


def same_file(one: str, other: str) -> bool:
    try:
        return Path(one).samefile(other)
    except OSError:
        return False
