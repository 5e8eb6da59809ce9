"""The session of a command that solves: it reads the problems, runs the methods and
shows the outcome."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import TypeAlias

from lcpcli.cli.declarations import refuse
from lcpcli.cli.main import as_written, of_result, of_several
from lcpcli.cli.output import Output
from lcpcli.cli.problems import (
    InputProblem,
    Inputs,
    Request,
    Runs,
    same_file,
    tell,
    with_references,
)
from lcpcli.cli.terminal import STANDARD, Line, shows_progress
from lcpcli.enumeration import others
from lcpcli.errors import OTHER_OUTPUT, Exit, File, LCPError, OptionError, ProblemError
from lcpcli.files import contents
from lcpcli.files.formats import has_lines
from lcpcli.files.inputs import InputItem
from lcpcli.options import AUTO
from lcpcli.report import result_formats, wording
from lcpcli.report.columns import Selection
from lcpcli.solving import driver
from lcpcli.solving.result import Result

Results: TypeAlias = "list[list[Result]]"  # by problem
Faults: TypeAlias = "list[tuple[contents.Source, LCPError]]"


def run(
    request: Request, of_one: Callable[[Request, InputItem, Output], int] | None = None
) -> int:
    """Run the methods on the problems, or `of_one` on a single one, show the results,
    and return the exit code."""
    inputs, takes_many = request.inputs, not request.levels and of_one is None
    if request.exact and of_one is None:
        from lcpcli.rational.elimination import require

        require()
    output = Output(request)
    prints = request.output is None and request.resume is None and not output.silent
    # The run would read its output forever.
    if prints and any(same_file(STANDARD, path) for path in inputs.paths):
        raise OptionError(
            "standard output",
            "goes to a file of problems",
            OTHER_OUTPUT,
        )
    are_many = has_lines(request.output or "")
    are_many |= request.sequence or any(
        value is not None for value in (request.jobs, request.cluster, request.resume)
    )
    with inputs.reading():
        inputs = inputs.with_tables()
        input_items, several = inputs.input_items(are_many and takes_many)
    if several:
        hint = inputs.hint()
        refuse(
            of_one is not None,
            "--all",
            "takes one problem",
            hint or "give the others to another run",
        )
        inputs.tell([hint] if hint else [])
        if takes_many:
            from lcpcli.cli import streams

            return streams.run(input_items, output, request)
    return (
        of_one(request, next(input_items), output)
        if of_one
        else _run(request, input_items, output)
    )


def _run(request: Request, input_items: Iterator[InputItem], output: Output) -> int:
    problems, sources, faults = _read(request.inputs, list(input_items))
    paths = [each.paths for each in problems]

    def text_of(results: Results) -> str:
        return _text(request, output, results, sources, faults, paths)

    if not problems:
        output.show(lambda *_: text_of([]))
        return Exit.BAD_INPUT
    first = problems[0]
    results, interrupted = _results(request, problems, sources, output)
    text = verdict = ""
    if not output.silent:
        try:
            concluded = results
            if request.levels:
                concluded = [
                    [driver.verified(result) for result in results_of_problem]
                    for results_of_problem in results
                ]
            elif not interrupted:
                concluded = _with_others(results, first)
            text, results = text_of(concluded), concluded
        except KeyboardInterrupt:  # without the conclusions
            results = [
                [replace(result, interrupted=True) for result in results_of_problem]
                for results_of_problem in results
            ]
            text = text_of(results)
    made = list(chain.from_iterable(results))
    if len(made) == 1 and output.path is not None:
        from lcpcli.report import outcome

        verdict = f"{sources[0].file}: {outcome.verdict(made[0])}"
    elif made:
        verdict = f"{sum(result.solved for result in made)} of {len(made)} runs solved"
        has_solutions = not (output.kind.has_proofs or output.with_iterates)
        if has_solutions and not request.sweep:
            verdict += "; the file has their solutions, with --trace the iterates"
    output.show(lambda *_: text, verdict)
    output.draw_runs(results)
    if interrupted or any(result.interrupted for result in made):
        return Exit.INTERRUPTED
    added = {AUTO} if request.adds_auto else set()
    codes = [of_result(result) for result in made if result.label not in added]
    return of_several(codes + [Exit.BAD_INPUT] * bool(faults))


def _text(
    request: Request,
    output: Output,
    results: Results,
    sources: Sequence[contents.Source],
    faults: Faults,
    paths: Sequence[Sequence[str]],
) -> str:
    if not (results or output.kind.has_records):
        return ""
    selection = Selection(
        compared=bool(request.levels),
        shows_all=output.path is not None,
        swept=bool(request.sweep),
        iterates=output.with_iterates,
        columns=request.columns,
        names=request.names,
    )
    reached = slice(len(results))  # an interrupted run has not reached the others
    report = result_formats.results_report(
        results, sources[reached], paths[reached], selection, faults
    )
    return report.render(output.form, output.width, output.color)


def _with_others(results: Results, read: InputProblem) -> Results:
    """Return the result of a run with what is known of other solutions, if that is to
    be shown."""
    ((result,),) = results
    is_asked = read.exactly is not None and others.is_asked(read.problem)
    if not is_asked or not result.solved or result.interrupted:
        return results
    other_solutions = others.search_others(
        result.problem, result.z, read.exactly, read.length
    )
    return [
        [
            replace(
                result,
                others=other_solutions.others,
                exactly_solvable=other_solutions.solvable,
            )
        ]
    ]


def _read(
    inputs: Inputs, input_items: Sequence[InputItem]
) -> tuple[list[InputProblem], list[contents.Source], Faults]:
    """Return the problems, their sources, and the errors of unreadable ones; the error
    of a single problem is raised."""
    problems: list[InputProblem] = []
    sources: list[contents.Source] = []
    faults: Faults = []
    for input_item in input_items:
        try:
            with inputs.reading():
                problems_of_item = list(inputs.problems(input_item, takes_models=True))
        except LCPError as error:
            if len(input_items) == 1:
                raise
            shown_error = as_written(error)
            # The error of an option may be the same for all.
            if str(shown_error) not in {str(other) for _, other in faults}:
                tell(str(shown_error))
            faults.append((input_item.sources[0], shown_error))
            continue
        problems += problems_of_item
        sources += input_item.sources
    return problems, sources, faults


def _results(
    request: Request,
    inputs: list[InputProblem],
    sources: Sequence[contents.Source],
    output: Output,
) -> tuple[Results, bool]:
    """Return the results, by problem, with their proofs, and whether Ctrl-C has cut
    them short.

    The list of inputs is emptied, to free the contents of the files. sources : the
    sources of the problems, for errors.
    """
    problems = [each.problem for each in inputs]
    data = [each.exactly if request.exact else None for each in inputs]
    remarks = list(chain.from_iterable(each.remarks for each in inputs))
    inputs.clear()
    options_of_problems = [request.options_for(problem) for problem in problems]
    for kind in output.figures:
        from lcpcli.report import plotting

        plotting.require_drawable(kind, problems)
    for problem in problems if request.names else []:
        wording.require(problem, request.names)
    # Not before the options are accepted, so that an error is one line.
    request.inputs.tell(remarks)
    shows_answer = output.shows_answer(problems)
    if request.levels or (output.figures and not shows_answer):
        problems = with_references(problems, request.limits)
    draws_times = request.plot is not None and not shows_answer
    is_timed = draws_times or (bool(request.levels) and not output.silent)
    traces = partial(output.traces, shows_answer=shows_answer)
    results: Results = []
    try:
        for problem, source, options in zip(
            problems, sources, options_of_problems, strict=True
        ):
            results.append([])
            try:
                runs = Runs(request, problem, traces)
                for result in runs.results(options, is_timed):
                    results[-1].append(result)
                    if result.interrupted:
                        return results, True
            except ProblemError as error:  # where F is undefined at the start
                raise error.inside(File(source)) from None
        doing = "proving" if request.exact or request.bound else ""
        with Line(doing, is_shown=shows_progress(request.quiet)):
            for made, exactly in zip(results, data, strict=True):
                for k, result in enumerate(made):
                    made[k] = request.prove(result, exactly)
    except KeyboardInterrupt:
        if not any(results):
            raise
        return list(filter(None, results)), True
    return results, False
