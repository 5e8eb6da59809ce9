"""Many problems with one method, here or in other processes: each is written as soon as it is solved."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

import click

from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, NOT_SOLVED, SOLVED, of_several
from lcpcli.cli.output import Line, Output, emit, wanted
from lcpcli.cli.problems import tell
from lcpcli.cli.runs import Request
from lcpcli.errors import LCPError, OptionError, count
from lcpcli.files.atomic_write import refuse_unwritable, written_gradually
from lcpcli.files.contents import Source, place
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import QColumns, Work
from lcpcli.options import LIMITS
from lcpcli.report import formats
from lcpcli.solving.trace import Trace

if TYPE_CHECKING:
    from lcpcli.cli.pools import Pool
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.typing import MethodName

COMPARE = "leave it out, or use lcp compare"
LOST = "breakdown"
NO_MEMORY = "there is not enough memory for it"
Write = Callable[[str], object]


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


class Task(NamedTuple):
    """What is done with every problem: solved by the method, perhaps proved, and written.

    form : the format, "" for none. width : of the names of problems in a table. every : of the iterates, how many are
        written; None for none.
    """

    asked: Request
    form: str
    width: int
    every: int | None

    def all_of(self, works: Sequence[Work]) -> tuple[list[Record], float]:
        """The records of several inputs, and the seconds that they took."""
        began = time.perf_counter()
        return [record for work in works for record in self.records(work)], time.perf_counter() - began

    def records(self, work: Work) -> Iterator[Record]:
        """Those of an input, one for each problem, in order."""
        alone = self.asked.exact or self.asked.bound or self.every
        made = self._together(work) if isinstance(work, QColumns) and not alone else self._each(work)
        number = 0
        try:
            for source, (result, remarks) in zip(work.sources, made, strict=False):
                text = formats.of_result(result, source, self.form, self.width) if self.form else ""
                yield Record(text, result.word, result.exit_code, tuple(remarks), result.interrupted)
                number += 1
        except LCPError as fault:
            for source in work.sources[number:]:
                message = str(fault) if source.file in fault.where.split(": ") else f"{source}: {fault}"
                yield self._without_result(source, formats.BAD_INPUT, message, BAD_INPUT)
        except MemoryError:
            yield from self.lost(work, NO_MEMORY)[number:]

    def lost(self, work: Work, message: str) -> list[Record]:
        """Those of an input from which no result came."""
        return [self._without_result(at, LOST, f"{at}: {message}", NOT_SOLVED) for at in work.sources]

    def _each(self, work: Work) -> Iterator[tuple[Result, list[str]]]:
        """The results for problems that are solved one by one, with remarks on what was read."""
        from lcpcli.solving.driver import concluded

        def traces(_: Problem) -> tuple[Trace | None, None]:
            return Trace(self.every) if self.every else None, None

        inputs = self.asked.inputs
        for held in inputs.held(work):
            (result,) = self.asked.run(held.problem, self.asked.options_for(held.problem), traces, labelled=False)
            for prove in self.asked.proofs(held.exactly if self.asked.exact else None):
                result = prove(result)
            yield concluded([result])[0], [] if inputs.quiet else held.remarks

    def _together(self, work: QColumns) -> Iterator[tuple[Result, list[str]]]:
        """Those for problems with one M, solved together."""
        from lcpcli.solving.many import solve_many

        asked = self.asked
        first = asked.inputs.first_of(work)
        (options,) = self.asked.options_for(first)
        options |= {limit.name: getattr(asked, limit.name) for limit in LIMITS}
        method = cast("MethodName", self.asked.variants[0].method)
        results = solve_many(first.M, work.Q, lower=first.lower, upper=first.upper, method=method, **options)
        for name, result in zip(work.names, results, strict=True):
            yield replace(result, problem=result.problem.named(name)), []

    def _without_result(self, source: Source, word: str, message: str, exit_code: int) -> Record:
        text = formats.without_result(source, word, message, self.form, self.width) if self.form else ""
        return Record(text, word, exit_code, (message,))


def run(works: Iterator[Work], output: Output, asked: Request) -> int:
    """Solve the problems in the inputs; write each result; return the exit code."""
    _refuse_without_effect(output, asked)
    is_log = output.form == "json" and (output.path or "").casefold().endswith(LINES)
    log_path = asked.resume or (output.path if is_log else None)
    if asked.resume and not Path(asked.resume).exists():
        if not asked.resume.casefold().endswith(LINES):
            raise OptionError("--resume", f"there is no log {asked.resume}", "name one, or a new FILE.jsonl")
        refuse_unwritable(asked.resume)
    form = "json" if asked.resume else "" if output.silent else output.form
    every = (asked.every or 1) if output.with_iterates else None
    task = Task(asked, form, formats.width_of([place(file) for file in asked.inputs.files]), every)
    tally = _Tally()
    if log_path is None:
        destination: AbstractContextManager[Write] = nullcontext(partial(emit, color=False))
        if output.silent:
            destination = nullcontext(len)
        elif output.path is not None:
            destination = written_gradually(output.path)
        with _records(task, works, in_order=True) as records, destination as write:
            write(formats.heading(task.form, task.width))
            tally.write(records, write, is_told=wanted(asked.quiet) and output.path is not None)
    else:
        _log(works, log_path, task, tally)
    if not asked.quiet:
        click.echo(tally.told(log_path), err=True)
    return tally.exit_code


def _log(works: Iterator[Work], path: str, task: Task, tally: _Tally) -> None:
    """Write records to a log, each as soon as it is known; leave out those that a log to be resumed has."""
    from lcpcli.cli import resumption
    from lcpcli.files import log

    asked = task.asked
    options, past = resumption.unshown(asked), resumption.Past()
    with log.opened(path, anew=not asked.resume) as book:
        if asked.resume:
            past.read(book, task, options)
        left = past.left(resumption.marked(works, options))
        with _records(task, left, in_order=False) as records:
            if not asked.resume:
                book.clear()
            tally.write(records, book.add, is_told=wanted(asked.quiet))
        tally.add_before(past.ends)
        if not tally.interrupted:
            book.end(past.has_replaced)


class _Tally:
    """How many problems ended how."""

    def __init__(self) -> None:
        self.words: Counter[str] = Counter()
        self.codes = {SOLVED}
        self.interrupted, self.ending = False, INTERRUPTED

    def write(self, records: Iterator[Record], write: Write, is_told: bool) -> None:
        """Write all records and count them. is_told : whether their number is shown meanwhile."""
        with Line() as line:
            try:
                for record in records:
                    write(record.text)
                    self.words[record.word] += 1
                    self.codes.add(record.exit_code)
                    for complaint in record.complaints:
                        tell(complaint)
                    if is_told:
                        line.tell_number(self.words.total())
                    if record.interrupted:
                        raise KeyboardInterrupt
            except KeyboardInterrupt as request:
                self.interrupted = True
                self.ending = getattr(request, "exit_code", INTERRUPTED)

    def add_before(self, ends: Iterable[tuple[str, int]]) -> None:
        """Count problems of a log, which were there before, by how they ended."""
        past = Counter(ends)
        self.words = sum((Counter({word: number}) for (word, _), number in past.items()), Counter()) + self.words
        self.codes.update(code for _, code in past)

    @property
    def exit_code(self) -> int:
        return self.ending if self.interrupted else of_several(self.codes)

    def told(self, log_path: str | None) -> str:
        """The summary, in one line."""
        numbers = ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in self.words.most_common())
        line = f"lcp: {count(self.words.total(), 'problem')}{': ' * bool(numbers)}{numbers}"
        if not self.interrupted:
            return line
        hint = f"go on with --resume {log_path}" if log_path else "with -o FILE.jsonl it could be resumed"
        return f"{line}; interrupted; {hint}"


def _refuse_without_effect(output: Output, asked: Request) -> None:
    """Raise OptionError for what is not done with many problems, or not together."""
    if asked.plot is not None:
        raise OptionError("--plot", "draws one problem only", COMPARE)
    if output.trace_path is not None:
        raise OptionError("--trace", "writes the iterates of one problem only", "give --trace without a file, and JSON")
    if not output.silent and output.form not in formats.FORMS:
        raise OptionError("--format", f"{output.form} is for one problem only", COMPARE)
    if output.with_iterates and output.form != "json":
        raise OptionError("--trace", "has no effect on several problems but in JSON", "give --format json")
    if asked.every is not None and not output.with_iterates:
        raise OptionError("--every", "has no effect on several problems", "leave it out")
    if asked.resume is not None:
        for flag, value in {"--output": asked.output, "--format": asked.form}.items():
            if value is not None:
                raise OptionError(flag, "has no effect with --resume, which goes on with its file", "leave it out")
    if asked.jobs is not None and asked.cluster is not None:
        raise OptionError("--jobs", "has no effect with --cluster, which has workers of its own", "leave it out")


@contextmanager
def _records(task: Task, works: Iterator[Work], in_order: bool) -> Iterator[Iterator[Record]]:
    """A context with the records, made by whom the options say, in the order of the problems or as they are known."""
    asked = task.asked
    if asked.cluster is None and (asked.jobs or 1) == 1:
        yield (record for work in works for record in task.records(work))
        return
    from lcpcli.cli.pools import Cluster, Local, ending_on_request
    from lcpcli.cli.workers import elsewhere

    pool: Pool
    with ExitStack() as open_until_then:
        if asked.cluster is not None:
            pool = Cluster(asked.cluster)
        else:
            open_until_then.enter_context(ending_on_request())
            pool = Local(asked.jobs or 1)
        open_until_then.callback(pool.close)
        yield elsewhere(task, works, pool, in_order)
