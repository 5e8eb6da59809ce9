"""The one way from files to an exit code: what is asked for, the problems that are read, the task that is done with
them, and what comes of it shown or written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from lcpcli import options
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, of_several
from lcpcli.cli.options import STARTS
from lcpcli.cli.output import STANDARD, Output, show, wanted
from lcpcli.cli.problems import Inputs, same_file, tell
from lcpcli.cli.runs import Methods, referred
from lcpcli.errors import LCPError, OptionError
from lcpcli.files.contents import files_in
from lcpcli.files.fields import OF_BOUNDS
from lcpcli.files.formats import LINES
from lcpcli.methods.registry import ADDITIONS, OPTIONS
from lcpcli.options import LIMITS

if TYPE_CHECKING:
    from lcpcli.cli.all_solutions import Search
    from lcpcli.cli.problems import Held
    from lcpcli.files.contents import Source
    from lcpcli.files.inputs import Work
    from lcpcli.model.problem import Problem
    from lcpcli.options import Limits
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.result import Result

Results: TypeAlias = "list[list[Result]]"  # by problem
Faults: TypeAlias = "list[tuple[Source, LCPError]]"
NUMBERS = (options.WARM, options.INFINITY, options.MAX_SOLUTIONS, options.JOBS, *LIMITS)


class Request(NamedTuple):
    """What lcp solve or lcp compare is asked for; an option that is not given is None, or False if it is a flag.

    inputs : the problems. own : the options of methods, additions and starts that are given, by name.
    """

    inputs: Inputs
    own: dict[str, Any]
    tol: float | None
    max_iterations: int | None
    time_limit: float | None
    threads: int | None
    bound: bool
    form: str | None
    trace: str | None
    every: int | None
    plot: str | None
    output: str | None
    quiet: bool
    warm: float | None = None
    max_solutions: int | None = None
    jobs: int | None = None
    cluster: str | None = None
    resume: str | None = None

    @classmethod
    def of(cls, paths: Sequence[str], given: dict[str, Any], default: Sequence[str] = ()) -> Request:
        """What the options of a command ask for, by their names, with the problems in these files and folders.

        The number of threads is set, and outputs are refused that cannot be written.
        """
        quiet = given["quiet"]
        files = files_in(paths, (lambda _: None) if quiet else tell) or default
        inputs = Inputs(files, **{name: given.pop(name) for name in (*OF_BOUNDS, "game")}, quiet=quiet)
        own = {name: given.pop(name) for name in (*OPTIONS, *STARTS, *ADDITIONS)}
        asked = cls(inputs, {name: value for name, value in own.items() if value is not None}, **given)
        path = asked.output if asked.resume is None else None  # with --resume there is no other output
        outputs = {"--output": path, "--trace": asked.trace or None, "--plot": asked.plot, "--resume": asked.resume}
        inputs.prepare(outputs, asked.threads)
        return asked

    @property
    def limits(self) -> Limits:
        """The limits, with defaults for those that are not given."""
        from lcpcli.options import Limits

        given = {limit.name: getattr(self, limit.name) for limit in LIMITS}
        return Limits(**{name: value for name, value in given.items() if value is not None})


class Outcome(NamedTuple):
    """What comes of the problems of a command: the text to be shown, the exit code, and what draws the figure then."""

    text: str
    exit_code: int
    draw: Callable[[], object] = int


def run(asked: Request, task: Solving | Search) -> int:
    """Do a task with the problems that are asked for; show or write what comes of it; return the exit code."""
    inputs = asked.inputs
    output = Output(asked, task.levels)
    prints = asked.output is None and asked.resume is None and not output.silent
    if prints and any(same_file(STANDARD, path) for path in inputs.paths):  # it would go on for ever
        raise OptionError("standard output", "goes to a file of problems", "choose another file for the output")
    options.check(NUMBERS, {**asked._asdict(), **inputs.bounds})
    are_many = asked.output is not None and asked.output.casefold().endswith(LINES)
    are_many |= any(value is not None for value in (asked.jobs, asked.cluster, asked.resume))
    works, several = inputs.works(are_many and task.takes_many)
    if several and (code := task.take_several(works, output)) is not None:
        return code
    outcome = task.outcome(works, output)
    if not output.silent:
        show(outcome.text, output.path, output.color)
    outcome.draw()
    return outcome.exit_code


class Solving:
    """Run methods on problems, and prove what is asked for.

    is_compared : whether results are shown side by side. takes_many : whether problems may come without end.
    levels : of a comparison, relative errors whose first attainment is recorded; with them, and for figures, a problem
        without a known solution is solved beforehand to provide the reference for errors.
    """

    def __init__(self, methods: Methods, levels: tuple[float, ...] = ()) -> None:
        self.methods, self.levels = methods, levels
        self.is_compared, self.takes_many = bool(levels), not levels
        if methods.exact:
            from lcpcli.rational.linear import require

            require()

    def take_several(self, works: Iterator[Work], output: Output) -> int | None:
        """Solve problems one after another, and return the exit code; None for a comparison, which takes them all."""
        from lcpcli.files import games

        inputs = self.methods.asked.inputs
        if told := games.hint(inputs.files):
            inputs.tell([told])
        if self.is_compared:
            return None
        from lcpcli.cli import many

        return many.run(works, output, self.methods)

    def outcome(self, works: Iterator[Work], output: Output) -> Outcome:
        """What comes of all problems."""
        held, sources, faults = self._read(works)
        text_of = partial(self._text, sources=sources, faults=faults, output=output)
        if not held:
            return Outcome(text_of([]), BAD_INPUT)
        data = [each.exactly if self.methods.exact else None for each in held]
        exactly = None
        if not self.is_compared:
            from lcpcli.enumeration.others import is_searched

            exactly = held[0].exactly if is_searched(held[0].problem, held[0].length) else None
        problems = [each.problem for each in held]
        del held  # with the contents of files
        results, interrupted = self._results(problems, data, output)
        if output.trace_path is not None:
            from lcpcli.report import result_csv

            show(result_csv.iterates_text(list(chain.from_iterable(results))), output.trace_path)
        text = ""
        if not output.silent:
            results, text = self._with_conclusions(results, None if interrupted else exactly, text_of)
        codes = [result.exit_code for result in chain.from_iterable(results)] + [BAD_INPUT] * bool(faults)
        interrupted |= any(result.interrupted for result in chain.from_iterable(results))
        return Outcome(text, INTERRUPTED if interrupted else of_several(codes), partial(output.draw, results))

    def _read(self, works: Iterator[Work]) -> tuple[list[Held], list[Source], Faults]:
        """The problems, where they are, and what is wrong with the others; of a single one it is raised."""
        inputs, all_works = self.methods.asked.inputs, list(works)
        held: list[Held] = []
        sources: list[Source] = []
        faults: Faults = []
        for work in all_works:
            try:
                found = list(inputs.held(work))
            except LCPError as fault:
                if len(all_works) == 1:
                    raise
                faults.append((work.sources[0], fault))
                tell(str(fault))
                continue
            held += found
            sources += work.sources
            inputs.tell(list(chain.from_iterable(each.remarks for each in found)))
        return held, sources, faults

    def _results(
        self, problems: list[Problem], data: Sequence[Callable[[], ExactProblem] | None], output: Output
    ) -> tuple[Results, bool]:
        """The results, by problem, with what is proved of them; those before Ctrl-C if it came, and whether it came."""
        methods = self.methods
        output.require_room(len(problems))
        chosen = [methods.options(problem) for problem in problems]
        if self.is_compared or output.plot is not None:
            problems = referred(problems, methods.asked.limits)
        is_timed = output.plot is not None or (self.is_compared and not output.silent)
        watched = wanted(methods.asked.quiet)
        results: Results = []
        try:
            for problem, own in zip(problems, chosen, strict=True):
                results.append([])
                for result in methods.run(problem, own, output.traces, compared=is_timed, watched=watched):
                    results[-1].append(result)
                    if result.interrupted:
                        return results, True
            for made, exactly in zip(results, data, strict=True):
                for prove in methods.proofs(exactly):
                    for k, result in enumerate(made):
                        made[k] = prove(result)
        except KeyboardInterrupt:
            if not any(results):
                raise
            return list(filter(None, results)), True
        return results, False

    def _with_conclusions(
        self, results: Results, exactly: Callable[[], ExactProblem] | None, text_of: Callable[[Results], str]
    ) -> tuple[Results, str]:
        """The results with what is concluded from them, and their text; without that if Ctrl-C comes before it is
        made."""
        from lcpcli.solving import driver

        try:
            made = [driver.concluded(own) for own in results]
            if self.is_compared:
                made = [[driver.verified(result) for result in own] for own in made]
            if exactly is not None:
                made = [[_among_others(result, exactly) for result in own] for own in made]
            return made, text_of(made)
        except KeyboardInterrupt:
            bare = [driver.interrupted(own) for own in results]
            return bare, text_of(bare)

    def _text(self, results: Results, sources: Sequence[Source], faults: Faults, output: Output) -> str:
        """What is shown of the results, in JSON also what could not be read."""
        from lcpcli.report import formats as report

        shown = [[output.shown(result) for result in own] for own in results]
        places = sources[: len(shown)]  # the others were not reached
        text = ""
        if shown:
            text = report.render(
                shown,
                places,
                output.form,
                output.width,
                output.color,
                compared=self.is_compared,
                whole=output.path is not None,
                iterates=output.with_iterates,
            )
        return text + report.unread(faults) * (output.form == "json")


def _among_others(result: Result, exactly: Callable[[], ExactProblem]) -> Result:
    """The result with whether the problem has other solutions, and whether it has any as written."""
    if not result.solved or result.interrupted:
        return result
    from lcpcli.enumeration.others import search_others

    findings = search_others(result.z, exactly)
    return replace(result, others=findings.others, exactly_solvable=findings.solvable)
