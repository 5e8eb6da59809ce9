"""The session of a command that solves: it reads the problems, runs the methods and shows the outcome."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

from lcpcli import options
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, as_written, of_result, of_several
from lcpcli.cli.output import Output
from lcpcli.cli.problems import InputModel, InputProblem, Inputs, same_file, tell
from lcpcli.cli.request import Request, with_references
from lcpcli.cli.terminal import STANDARD
from lcpcli.enumeration import others
from lcpcli.errors import LCPError, OptionError, ProblemError
from lcpcli.files.contents import Source
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import Work
from lcpcli.options import AUTO, LIMITS
from lcpcli.report import result_formats, wording
from lcpcli.solving import driver
from lcpcli.solving.result import Result

AnyInput: TypeAlias = InputProblem | InputModel
Results: TypeAlias = "list[list[Result]]"  # by problem
Faults: TypeAlias = "list[tuple[Source, LCPError]]"
NUMBERS = (options.INFINITY, options.MAX_SOLUTIONS, options.JOBS, *LIMITS)


class Outcome(NamedTuple):
    """What a run came to: the text of its report, the exit code, the verdict in a line, and what draws the figure."""

    text: str
    code: int
    verdict: str = ""
    draw: Callable[[], object] = int


def run(request: Request, of_one: Callable[[Request, Work, Output], Outcome] | None = None) -> int:
    """Run the requested methods on the requested problems, show or write the results, and return the exit code.

    of_one : a function to call instead, for a single problem.
    """
    inputs, takes_many = request.inputs, not request.levels and of_one is None
    if request.exact and of_one is None:
        from lcpcli.rational.elimination import require

        require()
    output = Output(request)
    prints = request.output is None and request.resume is None and not output.silent
    if prints and any(same_file(STANDARD, path) for path in inputs.paths):  # the run would read its own output for ever
        raise OptionError("standard output", "goes to a file of problems", "choose another file for the output")
    options.check(NUMBERS, {**request._asdict(), **inputs.bounds})
    are_many = request.output is not None and request.output.casefold().endswith(LINES)
    are_many |= request.sequence or any(value is not None for value in (request.jobs, request.cluster, request.resume))
    works, several = inputs.works(are_many and takes_many)
    if several:
        from lcpcli.files import games

        hint = "" if inputs.has_q else games.hint(inputs.files)
        if of_one is not None:
            raise OptionError("--all", "takes one problem", hint or "give the others to another run")
        inputs.tell([hint] if hint else [])
        if takes_many:
            from lcpcli.cli import streams

            return streams.run(works, output, request)
    made = of_one(request, next(works), output) if of_one else _outcome(request, works, output)
    output.destination.show(lambda *_: made.text, made.verdict)
    made.draw()
    return made.code


def _outcome(request: Request, works: Iterator[Work], output: Output) -> Outcome:
    problems, sources, faults = _read(request.inputs, list(works))
    text_of = partial(_text, request, sources=sources, faults=faults, output=output)
    if not problems:
        return Outcome(text_of([]), BAD_INPUT)
    first = problems[0]
    among = None
    if not request.levels and isinstance(first, InputProblem) and others.is_asked(first.problem):
        among = partial(_among_others, first)
    results, interrupted = _results(request, problems, sources, output)
    if output.trace_path is not None:
        from lcpcli.report import result_csv

        runs = list(chain.from_iterable(results))
        output.destination.add(output.trace_path, lambda _: result_formats.written(*result_csv.iterates(runs)))
    text = verdict = ""
    if not output.silent:
        results, text = _with_conclusions(request, results, None if interrupted else among, text_of)
    made = list(chain.from_iterable(results))
    if made and output.path is not None:
        from lcpcli.report import outcome

        solved = f"{sum(result.solved for result in made)} of {len(made)} runs solved"
        verdict = f"{sources[0].file}: {outcome.verdict(made[0])}" if len(made) == 1 else solved
    added = {AUTO} if request.adds_auto else set()
    codes = [of_result(result) for result in made if result.label not in added] + [BAD_INPUT] * bool(faults)
    is_cut = interrupted or any(result.interrupted for result in made)
    return Outcome(text, INTERRUPTED if is_cut else of_several(codes), verdict, partial(output.draw, results))


def _read(inputs: Inputs, works: Sequence[Work]) -> tuple[list[AnyInput], list[Source], Faults]:
    """Return the problems, their places, and the errors of unreadable ones; the error of a single problem is raised."""
    problems: list[AnyInput] = []
    sources: list[Source] = []
    faults: Faults = []
    for work in works:
        try:
            own = list(inputs.any_problems(work))
        except LCPError as error:
            if len(works) == 1:
                raise
            fault = as_written(error)
            if str(fault) not in {str(other) for _, other in faults}:  # as that of an option may be for all
                tell(str(fault))
            faults.append((work.sources[0], fault))
            continue
        problems += own
        sources += work.sources
        inputs.tell(list(chain.from_iterable(each.remarks for each in own)))
    return problems, sources, faults


def _results(
    request: Request, inputs: list[AnyInput], sources: Sequence[Source], output: Output
) -> tuple[Results, bool]:
    """Return the results, by problem, with their proofs, and whether Ctrl-C has cut them short.

    The list of inputs is emptied, to free the contents of the files. sources : the places of the problems.
    """
    problems = [each.problem for each in inputs]
    data = [each.exactly if request.exact else None for each in inputs]
    inputs.clear()
    chosen = [request.options_for(problem) for problem in problems]
    _require_pictures(request, problems)
    if request.names:
        for problem in problems:
            wording.require(problem, request.names)
    if request.levels or output.plot is not None or output.paths is not None:
        problems = with_references(problems, request.limits)
    is_timed = output.plot is not None or (bool(request.levels) and not output.silent)
    results: Results = []
    try:
        for problem, source, own in zip(problems, sources, chosen, strict=True):
            results.append([])
            try:
                for result in request.run(problem, own, output.traces, is_timed):
                    results[-1].append(result)
                    if result.interrupted:
                        return results, True
            except ProblemError as fault:  # where F is undefined at the start
                raise fault.inside(str(source)) from None
        for made, exactly in zip(results, data, strict=True):
            for k, result in enumerate(made):
                made[k] = request.prove(result, exactly)
    except KeyboardInterrupt:
        if not any(results):
            raise
        return list(filter(None, results)), True
    return results, False


def _with_conclusions(
    request: Request, results: Results, among: Callable[[Result], Result] | None, text_of: Callable[[Results], str]
) -> tuple[Results, str]:
    """Return the results with the conclusions from them, and their text; without conclusions if Ctrl-C comes before
    the text is made."""
    try:
        made = [[driver.verified(result) for result in own] for own in results] if request.levels else results
        if among is not None:
            made = [list(map(among, own)) for own in made]
        return made, text_of(made)
    except KeyboardInterrupt:
        bare = [[replace(result, interrupted=True) for result in own] for own in results]
        return bare, text_of(bare)


def _text(request: Request, results: Results, sources: Sequence[Source], faults: Faults, output: Output) -> str:
    shown = [[output.with_visible_trace(result) for result in own] for own in results]
    places = sources[: len(shown)]  # the others were not reached
    report = result_formats.report(
        shown,
        places,
        faults,
        compared=bool(request.levels),
        swept=bool(request.sweep),
        whole=output.path is not None,
        iterates=output.with_iterates,
        columns=request.columns,
        names=request.names,
    )
    return output.text_of(report) if shown or output.form == "json" else ""


def _among_others(source: InputProblem, result: Result) -> Result:
    """Return the result with what is known at once about other solutions."""
    if not result.solved or result.interrupted:
        return result
    findings = others.search_others(result.problem, result.z, source.exactly, source.length)
    return replace(result, others=findings.others, exactly_solvable=findings.solvable)


def _require_pictures(request: Request, problems: Sequence[Any]) -> None:
    """Refuse more problems than a picture has room for, and problems without a picture of paths."""
    if request.paths is not None or request.plot is not None:
        from lcpcli.report import plotting

        if request.paths is not None:
            plotting.require_plane(problems, plotting.PATHS)
        if request.plot is not None:
            plotting.require_room(len(problems))
