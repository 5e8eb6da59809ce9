"""From parsed options to an exit code: read, run, show."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lcpcli import options
from lcpcli.cli import INTERRUPTED
from lcpcli.cli.options import for_methods, limits
from lcpcli.cli.output import HERE, Output, Plot, emit, terminal
from lcpcli.cli.progress import Line, wanted
from lcpcli.errors import OptionError

if TYPE_CHECKING:
    from lcpcli.exact.problem import ExactProblem
    from lcpcli.limits import Limits
    from lcpcli.problem import Problem
    from lcpcli.result import Result
    from lcpcli.typing import Vector

OF_OUTPUT = ("form", "trace", "every", "output", "quiet", "bound")
BRIEF, REPEATS = 0.05, 3  # seconds of a run below which, where times are compared, the quickest of so many counts
Paths = Sequence[tuple[str, str | None]]


def run(
    paths: Paths,
    methods: Sequence[str],
    given: dict[str, Any],
    *,
    levels: tuple[float, ...] = (),
    exact: bool = False,
) -> int:
    """Run the methods on each of the problems, given by their files; show the results; return the worst exit code.

    levels : relative errors to note when they are first reached; with them, and for figures, a problem that brings no
        solution is solved beforehand, so that there is something to measure errors against.
    exact : prove each result in rational arithmetic.
    """
    output = Output(exact=exact, compared=bool(levels), **{name: given[name] for name in OF_OUTPUT})
    plot = Plot(given["plot"], levels)
    options.check(warm=given.get("warm"))
    if exact:
        from lcpcli.exact.linear import require

        require()
    _refuse_amiss(paths, output, plot)
    bounds = limits(given)
    problems, data = _read(paths, exact)
    chosen = [for_methods(given, methods, problem) for problem in problems]
    if levels or plot.path is not None:
        problems = [_referred(problem, bounds) for problem in problems]
    width, color = (None, False) if output.path else terminal()
    proofs = dict(zip(map(id, problems), data, strict=True)) if exact else {}
    runs = _runs(problems, methods, chosen, bounds, given.get("warm"), (output, plot, width), wanted(given["quiet"]))
    results, interrupted = _finished(runs, proofs, bounds, given["bound"])
    _show(results, output, width, color, compared=bool(levels))
    plot.show(results)
    return INTERRUPTED if interrupted else max(result.exit_code for result in results)


def _finished(
    runs: Iterator[Result], proofs: dict[int, ExactProblem], bounds: Limits, bounded: bool
) -> tuple[list[Result], bool]:
    """The results, with what was to be proved of them, as far as Ctrl-C lets them come; and whether it came."""
    results: list[Result] = []
    try:
        for result in runs:
            results.append(result)
            if result.interrupted:
                return results, True
        if proofs:
            results[:] = _proved(proofs, results, bounds)
        if bounded:
            for i, result in enumerate(results):
                results[i] = result if result.interrupted else _bounded(result)
    except KeyboardInterrupt:
        if not results:
            raise
        return results, True
    return results, any(result.interrupted for result in results)


def _refuse_amiss(paths: Paths, output: Output, plot: Plot) -> None:
    """Refuse inputs and outputs that are in each other's way."""
    refuse_clashes([name for pair in paths for name in pair if name], output.path, plot.path)
    if plot.path == HERE and output.path is None and output.form != "table":
        raise OptionError("--plot -", f"would end up amid the {output.form}", "name a file, or write that to one by -o")


def _read(paths: Paths, exact: bool) -> tuple[list[Problem], list[ExactProblem]]:
    """The problems in the files, and where they are needed, the same in rational numbers."""
    from lcpcli import files

    data = [files.read_exact(*path) for path in paths] if exact else []
    return [known.problem for known in data] or [files.read(*path) for path in paths], data


def _show(results: Sequence[Result], output: Output, width: int | None, color: bool, compared: bool) -> None:
    """Print the results, or write them to the file asked for."""
    if output.silent:
        return
    from lcpcli import files, report

    text = report.render(results, output.form, width, color, compared=compared, whole=output.path is not None)
    if output.path is None:
        emit(text, color)
    else:
        files.write_whole(output.path, text)


def _runs(
    problems: Sequence[Problem],
    methods: Sequence[str],
    chosen: Sequence[Sequence[dict[str, Any]]],
    bounds: Limits,
    warm: float | None,
    shown: tuple[Output, Plot, int | None],
    watched: bool,
) -> Iterator[Result]:
    """One result a problem and method, problem by problem; with `warm`, a second one from near the solution."""
    from lcpcli import driver
    from lcpcli.methods import STARTED

    output, plot, width = shown

    def run_once(problem: Problem, method: str, values: dict[str, Any]) -> Result:
        trace, curve = output.trace(problem, width), plot.curve(problem)
        with Line() as line:
            observe = line.tell if watched else None
            return driver.run(problem, method, limits=bounds, trace=trace, curve=curve, observe=observe, **values)

    for problem, own in zip(problems, chosen, strict=True):
        near = None if warm is None else _near(problem, warm)
        for method, values in zip(methods, own, strict=True):
            yield from _quickest(partial(run_once, problem, method, values), plot.timed)
            if near is not None and method in STARTED:
                again = {**values, "x0": near, "z0": None}
                warmed = _quickest(partial(run_once, problem, method, again), plot.timed)
                yield from (replace(result, warm=True) for result in warmed)


def _quickest(once: Callable[[], Result], timed: bool) -> Iterator[Result]:
    """A run, and where its time is read and it is a brief one, the quickest of several.

    Raises KeyboardInterrupt after the result where a later one was interrupted.
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


def _proved(data: dict[int, ExactProblem], results: Sequence[Result], bounds: Limits) -> list[Result]:
    """Each result with what is proved of it, in what time the run has left."""
    from lcpcli.exact.proof import prove

    return [
        prove(data[id(result.problem)], result, bounds.time_limit - result.setup_seconds - result.solve_seconds)
        for result in results
    ]


def _near(problem: Problem, size: float) -> Vector:
    from lcpcli import reference

    return reference.near(problem, size)


def _bounded(result: Result) -> Result:
    """The result with what is proved about its error."""
    from lcpcli.bounds import NO_BOUND, error_bound

    return replace(result, bound=error_bound(result.problem, result.z) or NO_BOUND)


def _referred(problem: Problem, bounds: Limits) -> Problem:
    """The problem with a solution to measure errors against, if one is found in the time that a run may take."""
    from lcpcli import reference

    return reference.with_reference(problem, min(bounds.time_limit, reference.SECONDS))


def refuse_clashes(inputs: Sequence[str], *outputs: str | None) -> None:
    """Refuse standard input that is to be read twice, and an output that would overwrite a problem or another one."""
    refuse_twice(inputs)
    written = [output for output in outputs if output is not None]
    for output in written:
        if any(same_file(output, name) for name in inputs):
            raise OptionError(output, "holds the problem", "choose another place for the output")
    if len(written) > 1 and Path(written[0]).absolute() == Path(written[1]).absolute():
        raise OptionError("--plot", "goes to the same file as --output", "choose another place for one")


def refuse_twice(paths: Sequence[str | None]) -> None:
    """Raise OptionError if standard input stands for two files."""
    from lcpcli import files

    if paths.count(files.STANDARD_INPUT) > 1:
        raise OptionError("standard input", "can be read only once", "name a file")


def same_file(one: str, other: str) -> bool:
    try:
        return Path(one).samefile(other)
    except OSError:
        return False
