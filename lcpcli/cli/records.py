"""One of many problems, from its input to what is written of it; in this process or in another."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from lcpcli.cli import exit_codes, problems, runs
from lcpcli.cli.methods import for_methods
from lcpcli.cli.options import limits
from lcpcli.cli.repetition import timed
from lcpcli.errors import LCPError
from lcpcli.files.contents import Source
from lcpcli.files.fields import OF_BOUNDS
from lcpcli.files.inputs import QColumns, Work
from lcpcli.options import LIMITS
from lcpcli.report import formats
from lcpcli.report.formats import BAD_INPUT

if TYPE_CHECKING:
    from lcpcli.methods.variants import Variant
    from lcpcli.model.problem import Problem
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.result import Result
    from lcpcli.typing import MethodName

LOST = "breakdown"
NO_MEMORY = "there is not enough memory for it"


class Record(NamedTuple):
    """What is written of a problem.

    text : in the format of the output. word : how it ended. complaints : lines for standard error. interrupted :
    whether Ctrl-C ended it.
    """

    text: str
    word: str
    exit_code: int
    complaints: tuple[str, ...] = ()
    interrupted: bool = False


@dataclass(frozen=True)
class Task:
    """What is done with every problem: solved by a method with the given options, perhaps proved, and written.

    form : the format, "" for none. width : of the names of problems in a table. every : of the iterates, how many are
        written; None for none.
    """

    variant: Variant
    given: dict[str, Any]
    exact: bool
    form: str
    width: int
    every: int | None

    def all_of(self, works: Sequence[Work]) -> tuple[list[Record], float]:
        """The records of several inputs, and the seconds that they took."""
        began = time.perf_counter()
        return [record for work in works for record in self.records(work)], time.perf_counter() - began

    def records(self, work: Work) -> Iterator[Record]:
        """Those of an input, one for each problem, in order."""
        alone = self.exact or self.given["bound"] or self.every
        made = self._together(work) if isinstance(work, QColumns) and not alone else self._each(work)
        number = 0
        try:
            for source, (result, remarks) in zip(work.sources, made, strict=False):
                yield self._written(result, source, remarks)
                number += 1
        except LCPError as fault:
            yield from (self._bad(source, fault) for source in work.sources[number:])
        except MemoryError:
            yield from self.lost(work, NO_MEMORY)[number:]

    def lost(self, work: Work, message: str) -> list[Record]:
        """Those of an input from which no result came."""
        return [self._without_result(at, LOST, f"{at}: {message}", exit_codes.NOT_SOLVED) for at in work.sources]

    def _each(self, work: Work) -> Iterator[tuple[Result, list[str]]]:
        """The results for problems that are solved one by one, with remarks on what was read."""
        for held in problems.held(work, self._bounds):
            remarks = [] if self.given["quiet"] else held.remarks
            yield self._solved(held.problem, held.exactly if self.exact else None), remarks

    def _together(self, work: QColumns) -> Iterator[tuple[Result, list[str]]]:
        """Those for problems with one M, solved together."""
        from lcpcli.solving.many import solve_many

        first = problems.first_of(work, self._bounds)
        (options,) = for_methods(self.given, [self.variant], first)
        chosen = {limit.name: self.given[limit.name] for limit in LIMITS} | options
        method = cast("MethodName", self.variant.method)
        results = solve_many(first.M, work.Q, lower=first.lower, upper=first.upper, method=method, **chosen)
        for name, result in zip(work.names, results, strict=True):
            yield replace(result, problem=result.problem.named(name)), []

    def _solved(self, problem: Problem, data: Callable[[], ExactProblem] | None) -> Result:
        from lcpcli.solving import driver as driver
        from lcpcli.solving.driver import concluded
        from lcpcli.solving.proof import prove
        from lcpcli.solving.trace import Trace

        (options,) = for_methods(self.given, [self.variant], problem)
        bounds = limits(self.given)

        def once() -> Result:
            trace = Trace(self.every) if self.every else None
            return driver.run(problem, self.variant.method, limits=bounds, trace=trace, conclude=False, **options)

        (result,) = timed(once, compared=False)
        if data is not None:
            result = prove(data, result, bounds.time_limit - result.seconds)
        if self.given["bound"] and not result.interrupted:
            result = runs.bounded(result)
        return concluded([result])[0]

    def _written(self, result: Result, source: Source, remarks: Sequence[str] = ()) -> Record:
        text = formats.of_result(result, source, self.form, self.width) if self.form else ""
        return Record(text, result.word, result.exit_code, tuple(remarks), result.interrupted)

    def _bad(self, source: Source, fault: LCPError) -> Record:
        message = str(fault) if source.file in fault.where.split(": ") else f"{source}: {fault}"
        return self._without_result(source, BAD_INPUT, message, exit_codes.BAD_INPUT)

    def _without_result(self, source: Source, word: str, message: str, exit_code: int) -> Record:
        text = formats.without_result(source, word, message, self.form, self.width) if self.form else ""
        return Record(text, word, exit_code, (message,))

    @property
    def _bounds(self) -> dict[str, str | None]:
        return {name: self.given[name] for name in OF_BOUNDS}
