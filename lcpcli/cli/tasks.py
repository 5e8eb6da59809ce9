"""The work on each of many problems, in this process or another: solving it, and typesetting its record."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from lcpcli.cli.main import BAD_INPUT, NOT_SOLVED, as_written, of_result
from lcpcli.cli.request import Request
from lcpcli.errors import LCPError
from lcpcli.files.contents import Source
from lcpcli.files.inputs import QColumns, Work
from lcpcli.options import LIMITS
from lcpcli.report import result_formats
from lcpcli.solving.trace import Trace

if TYPE_CHECKING:
    from lcpcli.cli.request import AnyProblem
    from lcpcli.solving.result import Result
    from lcpcli.solving.solver import SequenceSteps


PIECE_SECONDS = 0.1  # of work that is handed over: long against the milliseconds that this costs, short for the user
LOST = "breakdown"
NO_MEMORY = "there is not enough memory for this problem"


class TaskRecord(NamedTuple):
    """The output for one problem.

    text : the result in the format of the output. word : how the run ended. complaints : lines for standard error.
    interrupted : whether Ctrl-C ended the run.
    """

    text: str
    word: str
    exit_code: int
    complaints: tuple[str, ...] = ()
    interrupted: bool = False


class Task(NamedTuple):
    """The work on every problem: solve it by the method, prove the result if requested, and typeset the record.

    form : the format, "" for none. width : the width of the names of problems in a table. every : the step from one
    written iterate to the next; None to write none. steps : what solves each problem from the states of the last one,
    if they are a sequence.
    """

    request: Request
    form: str
    width: int
    every: int | None
    steps: SequenceSteps | None = None

    def all_of(self, works: Sequence[Work]) -> tuple[list[TaskRecord], float]:
        """Return the records of several inputs, and the seconds that they took.

        Those of the last inputs are missing if the others took long: another process may have nothing to do.
        """
        began, seconds, records = time.perf_counter(), 0.0, list[TaskRecord]()
        for work in works:
            records += self.records(work)
            if (seconds := time.perf_counter() - began) >= PIECE_SECONDS:
                break
        return records, seconds

    def records(self, work: Work) -> Iterator[TaskRecord]:
        """Yield the records of an input, one for each problem, in order."""
        alone = self.request.exact or self.request.bound or self.every or self.steps
        made = self._together(work) if isinstance(work, QColumns) and not alone else self._each(work)
        number = 0
        try:
            for source, (result, remarks) in zip(work.sources, made, strict=False):
                result, text = self._with_text(result, source)
                yield TaskRecord(text, result.word, of_result(result), tuple(remarks), result.interrupted)
                number += 1
        except LCPError as error:
            fault = as_written(error)
            for source in work.sources[number:]:
                message = str(fault) if source.file in fault.where.split(": ") else f"{source}: {fault}"
                yield self._without_result(source, result_formats.BAD_INPUT, message, BAD_INPUT)
        except MemoryError:
            yield from self.records_of_loss(work, NO_MEMORY)[number:]

    def _with_text(self, result: Result, source: Source) -> tuple[Result, str]:
        """Return the result and its text; without the conclusions that the text asks for if Ctrl-C comes first."""
        if not self.form:
            return result, ""
        try:
            return result, result_formats.of_result(result, source, self.form, self.width)
        except KeyboardInterrupt:
            result = replace(result, interrupted=True)
            return result, result_formats.of_result(result, source, self.form, self.width)

    def records_of_loss(self, work: Work, message: str) -> list[TaskRecord]:
        """Return the records of an input whose results were lost."""
        return [self._without_result(at, LOST, f"{at}: {message}", NOT_SOLVED) for at in work.sources]

    def _each(self, work: Work) -> Iterator[tuple[Result, Sequence[str]]]:
        """Yield the results for problems that are solved one by one, with remarks on what was read."""
        from lcpcli.solving.direct_run import uses_kernels

        inputs, compiled = self.request.inputs, uses_kernels(None, work.sources[0].item or 0)
        if self.steps is not None:
            for step in inputs.problems(work):
                result = self.steps.solve(step.problem, compiled)
                yield self.request.prove(result, step.exactly), [] if inputs.quiet else step.remarks
            return
        for read in inputs.any_problems(work):
            chosen = self.request.options_for(read.problem)
            (result,) = self.request.run(read.problem, chosen, self._traces, of_many=True, compiled=compiled)
            yield self.request.prove(result, read.exactly), [] if inputs.quiet else read.remarks

    def _traces(self, _: AnyProblem) -> tuple[Trace | None, None]:
        return Trace(self.every) if self.every else None, None

    def _together(self, work: QColumns) -> Iterator[tuple[Result, Sequence[str]]]:
        from lcpcli.solving.many import solve_many

        request = self.request
        first = request.inputs.first_of(work)
        (options,) = self.request.options_for(first)
        options |= {limit.name: getattr(request, limit.name) for limit in LIMITS}
        method = self.request.variants[0].method
        results = solve_many(first.M, work.Q, lower=first.lower, upper=first.upper, method=method, **options)
        for name, result in zip(work.names, results, strict=True):
            yield replace(result, problem=result.problem.named(name, first.origin)), []

    def _without_result(self, source: Source, word: str, message: str, exit_code: int) -> TaskRecord:
        text = result_formats.without_result(source, word, message, self.form, self.width) if self.form else ""
        return TaskRecord(text, word, exit_code, (message,))
