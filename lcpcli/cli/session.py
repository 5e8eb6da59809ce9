"""The one way from files to an exit code: problems are read, a task is done with them, and its outcome is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, TypeAlias

from lcpcli import options
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, of_several
from lcpcli.cli.output import STANDARD, Output, show
from lcpcli.cli.problems import Inputs, same_file, tell
from lcpcli.cli.runs import Request, referred
from lcpcli.enumeration import others
from lcpcli.errors import LCPError, OptionError
from lcpcli.files.formats import LINES
from lcpcli.options import LIMITS
from lcpcli.report import formats
from lcpcli.solving import driver

if TYPE_CHECKING:
    from lcpcli.cli.problems import Held
    from lcpcli.files.contents import Source
    from lcpcli.files.inputs import Work
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.result import Result

Results: TypeAlias = "list[list[Result]]"  # by problem
Faults: TypeAlias = "list[tuple[Source, LCPError]]"
Outcome: TypeAlias = tuple[str, int, Callable[[], object]]  # the text, the exit code, and what draws the figure then
NUMBERS = (options.WARM, options.INFINITY, options.MAX_SOLUTIONS, options.JOBS, *LIMITS)


def run(asked: Request, of_one: Callable[[Request, Work, Output], Outcome] | None = None) -> int:
    """Run methods on the problems that are asked for; show or write what comes of it; return the exit code.

    of_one : what is done instead, with one problem.
    """
    inputs, takes_many = asked.inputs, not asked.levels and of_one is None
    if asked.exact and of_one is None:
        from lcpcli.rational.linear import require

        require()
    output = Output(asked)
    prints = asked.output is None and asked.resume is None and not output.silent
    if prints and any(same_file(STANDARD, path) for path in inputs.paths):  # it would go on for ever
        raise OptionError("standard output", "goes to a file of problems", "choose another file for the output")
    options.check(NUMBERS, {**asked._asdict(), **inputs.bounds})
    are_many = asked.output is not None and asked.output.casefold().endswith(LINES)
    are_many |= any(value is not None for value in (asked.jobs, asked.cluster, asked.resume))
    works, several = inputs.works(are_many and takes_many)
    if several:
        from lcpcli.files import games

        told = games.hint(inputs.files)
        if of_one is not None:
            raise OptionError("--all", "takes one problem", told or "give the others to another run")
        inputs.tell([told] if told else [])
        if takes_many:
            from lcpcli.cli import many

            return many.run(works, output, asked)
    text, exit_code, draw = of_one(asked, next(works), output) if of_one else _outcome(asked, works, output)
    if not output.silent:
        show(text, output.path, output.color)
    draw()
    return exit_code


def _outcome(asked: Request, works: Iterator[Work], output: Output) -> Outcome:
    """What comes of all problems."""
    held, sources, faults = _read(asked.inputs, list(works))
    text_of = partial(_text, asked, sources=sources, faults=faults, output=output)
    if not held:
        return text_of([]), BAD_INPUT, int
    is_searched = not asked.levels and others.is_searched(held[0].problem, held[0].length)
    exactly = held[0].exactly if is_searched else None
    results, interrupted = _results(asked, held, output)
    if output.trace_path is not None:
        from lcpcli.report import result_csv

        show(result_csv.iterates_text(list(chain.from_iterable(results))), output.trace_path)
    text = ""
    if not output.silent:
        results, text = _with_conclusions(asked, results, None if interrupted else exactly, text_of)
    made = list(chain.from_iterable(results))
    if interrupted or any(result.interrupted for result in made):
        return text, INTERRUPTED, partial(output.draw, results)
    codes = [result.exit_code for result in made] + [BAD_INPUT] * bool(faults)
    return text, of_several(codes), partial(output.draw, results)


def _read(inputs: Inputs, works: Sequence[Work]) -> tuple[list[Held], list[Source], Faults]:
    """The problems, where they are, and what is wrong with the others; of a single one it is raised."""
    held: list[Held] = []
    sources: list[Source] = []
    faults: Faults = []
    for work in works:
        try:
            found = list(inputs.held(work))
        except LCPError as fault:
            if len(works) == 1:
                raise
            faults.append((work.sources[0], fault))
            tell(str(fault))
            continue
        held += found
        sources += work.sources
        inputs.tell(list(chain.from_iterable(each.remarks for each in found)))
    return held, sources, faults


def _results(asked: Request, held: list[Held], output: Output) -> tuple[Results, bool]:
    """The results, by problem, with what is proved of them; those before Ctrl-C if it came, and whether it came.

    The problems are let go, with the contents of files.
    """
    problems, data = [each.problem for each in held], [each.exactly if asked.exact else None for each in held]
    held.clear()
    output.require_room(len(problems))
    chosen = [asked.options_for(problem) for problem in problems]
    if asked.levels or output.plot is not None:
        problems = referred(problems, asked.limits)
    is_timed = output.plot is not None or (bool(asked.levels) and not output.silent)
    results: Results = []
    try:
        for problem, own in zip(problems, chosen, strict=True):
            results.append([])
            for result in asked.run(problem, own, output.traces, is_timed):
                results[-1].append(result)
                if result.interrupted:
                    return results, True
        for made, exactly in zip(results, data, strict=True):
            for k, result in enumerate(made):
                made[k] = asked.proved(result, exactly)
    except KeyboardInterrupt:
        if not any(results):
            raise
        return list(filter(None, results)), True
    return results, False


def _with_conclusions(
    asked: Request, results: Results, exactly: Callable[[], ExactProblem] | None, text_of: Callable[[Results], str]
) -> tuple[Results, str]:
    """The results with what is concluded from them, and their text; without that if Ctrl-C comes before it is
    made."""
    try:
        made = [driver.concluded(own) for own in results]
        if asked.levels:
            made = [[driver.verified(result) for result in own] for own in made]
        if exactly is not None:
            made = [[_among_others(result, exactly) for result in own] for own in made]
        return made, text_of(made)
    except KeyboardInterrupt:
        bare = [driver.interrupted(own) for own in results]
        return bare, text_of(bare)


def _text(asked: Request, results: Results, sources: Sequence[Source], faults: Faults, output: Output) -> str:
    """What is shown of the results, in JSON also what could not be read."""
    shown = [[output.shown(result) for result in own] for own in results]
    places = sources[: len(shown)]  # the others were not reached
    options = {"compared": bool(asked.levels), "whole": output.path is not None, "iterates": output.with_iterates}
    text = formats.render(shown, places, output.form, output.width, output.color, **options) if shown else ""
    return text + formats.unread(faults) * (output.form == "json")


def _among_others(result: Result, exactly: Callable[[], ExactProblem]) -> Result:
    """The result with whether the problem has other solutions, and whether it has any as written."""
    if not result.solved or result.interrupted:
        return result
    findings = others.search_others(result.z, exactly)
    return replace(result, others=findings.others, exactly_solvable=findings.solvable)
