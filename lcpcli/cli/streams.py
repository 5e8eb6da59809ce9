"""Many problems solved by one method, each result written as soon as it is known; and
how such a run is resumed.

Several processes, on this machine or a cluster, solve them while the next problems are
being read. Each problem of a process that was killed gets a second attempt, alone; one
that kills its process again has no result.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import ExitStack, closing, contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from itertools import chain, repeat, takewhile
from operator import attrgetter
from pathlib import Path
from threading import Event, Semaphore, Thread
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from lcpcli.cli.declarations import (
    CLUSTER,
    COMPARE,
    RESUME,
    SEQUENCE,
    SEVERAL,
    SEVERAL_IN_TABLES,
    among,
    refuse,
    reject_conflicting_options,
)
from lcpcli.cli.main import as_written, of_result, of_several, reading
from lcpcli.cli.output import Output
from lcpcli.cli.problems import Inputs, Request, Runs, tell
from lcpcli.cli.resuming import Kind, Past
from lcpcli.cli.terminal import Line, emit, shows_progress
from lcpcli.errors import Exit, LCPError, count
from lcpcli.files import formats
from lcpcli.files.atomic_write import gradual_writing, open_log, refuse_unwritable
from lcpcli.files.contents import Source, source_name
from lcpcli.files.formats import has_lines
from lcpcli.files.inputs import InputItem, QColumns
from lcpcli.interrupts import deferring_signals
from lcpcli.report import result_formats
from lcpcli.report.columns import of_traces
from lcpcli.report.result_formats import Layout
from lcpcli.solving.trace import Trace

if TYPE_CHECKING:
    from lcpcli.cli.pools import Pool
    from lcpcli.solving.result import Result
    from lcpcli.solving.solver import Solver

Write = Callable[[str], object]


def run(input_items: Iterator[InputItem], output: Output, request: Request) -> int:
    """Solve the problems in the inputs, write each result, and return the exit code."""
    _refuse(request, output)
    is_log = output.kind.has_records and has_lines(output.path or "")
    log_path = request.resume or (output.path if is_log else None)
    task, past = _task(request, output), None
    missing_items = input_items
    with ExitStack() as stack:
        # The pool comes before open files, which forked processes would keep open.
        pool = _pool(request)
        if pool is not None:
            stack.enter_context(closing(pool))
        write: Write = len if output.silent else partial(emit, color=False)
        # To a log each record is written as soon as it is known; problems that have one
        # there are not solved again.
        if log_path is not None:
            book = stack.enter_context(open_log(log_path, anew=not request.resume))
            write = book.add
            past = Past(book.records() if request.resume else (), request)
            missing_items = past.missing(input_items)
        elif output.path is not None and not output.silent:
            write = stack.enter_context(gradual_writing(output.path))
            if output.is_json_file:
                write = stack.enter_context(_in_list(write))
        if log_path is None:
            write(result_formats.heading(task.format_name, task.layout))
        is_to_file = log_path is not None or output.path is not None
        outcomes, is_interrupted = _written(
            all_records(task, missing_items, pool, in_order=log_path is None),
            write,
            Line(
                total=_total(request.inputs),
                is_shown=shows_progress(request.quiet) and is_to_file,
            ),
            is_to_file,
        )
    if past is not None:
        outcomes = past.outcomes + outcomes  # counted by the thread that reads
        for remark in [] if is_interrupted else past.remarks():
            tell(remark, request.quiet)
    tell(_summary(outcomes, is_interrupted, log_path), request.quiet)
    if is_interrupted:
        return Exit.INTERRUPTED
    return of_several({Exit.SOLVED, *(code for _, code in outcomes)})


def _refuse(request: Request, output: Output) -> None:
    """Refuse what several problems cannot have, and a log that is not there."""
    is_whole = not (output.silent or output.kind.takes_many)
    refuse(is_whole, "--format", f"{output.form} is for one problem only", COMPARE)
    modes = {
        SEVERAL: True,
        SEVERAL_IN_TABLES: not output.kind.has_records,
        RESUME: bool(request.resume),
        CLUSTER: bool(request.cluster),
        SEQUENCE: request.sequence,
    }
    reject_conflicting_options(request.option_values, *among(modes))
    if request.resume and not Path(request.resume).exists():
        reason = f"there is no log {request.resume}"
        hint = "name a log or a new FILE.jsonl"
        refuse(not has_lines(request.resume), "--resume", reason, hint)
        refuse_unwritable(request.resume)


def _task(request: Request, output: Output) -> Task:
    form = "" if output.silent else output.form
    if request.resume:
        form = "json"
    every = (request.every or 1) if output.with_iterates else None
    layout = Layout.of(list(map(source_name, request.inputs.files)), output.width)
    if not request.sequence:
        return Task(request, form, layout, every)
    from lcpcli.solving.solver import Solver

    steps = Solver.of(None, {**request.numbers, "interrupts": "return"})
    return Task(request, form, layout, every, steps)


def _pool(request: Request) -> Pool | None:
    if request.cluster is None and (request.jobs or 1) == 1:
        return None
    from lcpcli.cli import pools

    if request.cluster is None:
        return pools.Local(request.jobs or 1)
    return pools.Cluster(request.cluster)


def _summary(
    outcomes: Counter[Kind], is_interrupted: bool, log_path: str | None
) -> str:
    """Return the line on how many problems ended how, and how to continue an
    interrupted run."""
    statuses = Counter(status for status, _ in outcomes.elements())
    numbers = ", ".join(
        f"{number} {status.replace('_', ' ')}"
        for status, number in statuses.most_common()
    )
    line = f"{count(statuses.total(), 'problem')}{': ' * bool(numbers)}{numbers}"
    if not is_interrupted:
        return line
    if log_path is None:
        return f"{line}; interrupted; with -o FILE.jsonl it could be resumed"
    return f"{line}; interrupted; continue with --resume {log_path}"


def _total(inputs: Inputs) -> int | None:
    """Return the number of problems in files that hold one each; None where a file may
    hold several, or M alone, so that the number is known after the last one is read."""
    kinds = map(formats.kind_by_name, inputs.files)
    are_whole = all(
        kind is not None and (kind.of or kind.keeps in (formats.ALL, ""))
        for kind in kinds
    )
    return len(inputs.files) if are_whole else None


@contextmanager
def _in_list(write: Write) -> Iterator[Write]:
    """Open a context with a function that writes lines of JSON as the elements of one
    list."""
    beginnings = chain(["[\n"], repeat(",\n"))

    def add(line: str) -> None:
        if line:  # the heading of JSON, which is written first, is ""
            write(next(beginnings) + line.removesuffix("\n"))

    try:
        yield add
    finally:
        is_empty = next(beginnings).startswith("[")
        write("[]\n" if is_empty else "\n]\n")


def _written(
    records: Generator[TaskRecord, None, None],
    write: Write,
    progress: Line,
    is_to_file: bool,
) -> tuple[Counter[Kind], bool]:
    """Write all records; return how many problems ended how, and whether Ctrl-C ended
    that. progress : where their number is shown meanwhile."""
    outcomes, is_interrupted = Counter[Kind](), False
    # A reader of standard output may keep a record waiting for ever.
    writing_whole = deferring_signals if is_to_file else nullcontext
    with progress as line:

        def add(record: TaskRecord) -> None:
            with writing_whole():
                write(record.text)
                outcomes[record.status, record.exit_code] += 1
            for complaint in record.complaints:
                line.note(f"lcp: {complaint}")
            line.tell_number(outcomes.total())

        try:
            for record in records:
                is_interrupted |= record.interrupted
                add(record)
        except KeyboardInterrupt:
            is_interrupted = True
            with suppress(KeyboardInterrupt):
                for record in _last(records) if is_to_file else ():
                    add(record)
    return outcomes, is_interrupted


def _last(records: Generator[TaskRecord, None, None]) -> Iterator[TaskRecord]:
    """Yield the remaining records of a generator after Ctrl-C, which is passed on to
    the generator unless it has raised that itself."""
    with suppress(KeyboardInterrupt, StopIteration):
        yield records.throw(KeyboardInterrupt)
        yield from records


# The time for which a process works on one piece: long compared with the milliseconds
# in which a piece is handed over, and short for a user who waits for results.
PIECE_SECONDS = 0.1


class TaskRecord(NamedTuple):
    """The output for one problem.

    text : the result in the format of the output. status : how the run ended.
    complaints : lines for standard error. interrupted : whether Ctrl-C ended the run.
    """

    text: str
    status: str
    exit_code: Exit
    complaints: tuple[str, ...] = ()
    interrupted: bool = False


_is_interrupted = attrgetter("interrupted")


def until_interrupted(records: Iterable[TaskRecord]) -> Iterator[TaskRecord]:
    """Yield records up to the first one of a run that Ctrl-C has ended."""
    for record in records:
        yield record
        if record.interrupted:
            return


# The records of several inputs, and the seconds that they took.
Records: TypeAlias = tuple[list[list[TaskRecord]], float]


class Task(NamedTuple):
    """The work on every problem: solve it by the method, prove the result if requested,
    and typeset the record.

    format_name : the format, "" for none. layout : the columns of a table. every : the
    step from one written iterate to the next; None to write none. steps : the solver of
    each problem from the basis of the last one, in a sequence.
    """

    request: Request
    format_name: str
    layout: Layout
    every: int | None
    steps: Solver | None = None

    def all_of(self, input_items: Sequence[InputItem]) -> Records:
        """Return the records of inputs and their seconds; the last are missing if the
        others took long or Ctrl-C has ended one of their runs."""
        began, seconds = time.perf_counter(), 0.0
        records = list[list[TaskRecord]]()
        for input_item in input_items:
            records.append(list(until_interrupted(self.records(input_item))))
            is_interrupted = any(record.interrupted for record in records[-1])
            seconds = time.perf_counter() - began
            if is_interrupted or seconds >= PIECE_SECONDS:
                break
        return records, seconds

    def records(self, input_item: InputItem) -> Iterator[TaskRecord]:
        alone = self.request.exact or self.request.bound or self.every or self.steps
        made = (
            self._together(input_item)
            if isinstance(input_item, QColumns) and not alone
            else self._each(input_item)
        )
        number, sources = 0, input_item.sources
        try:
            for source, (result, remarks) in zip(sources, made, strict=False):
                try:
                    text = self._text(result, source)
                # The text then has no conclusions, whose search Ctrl-C has ended.
                except KeyboardInterrupt:
                    result = replace(result, interrupted=True)
                    text = self._text(result, source)
                yield TaskRecord(
                    text,
                    result.word,
                    of_result(result),
                    tuple(remarks),
                    result.interrupted,
                )
                number += 1
        except LCPError as error:
            # Records have only the text of an error: its traceback would keep the data
            # of all frames in memory.
            yield from self._records_of_fault(sources[number:], as_written(error))
        except MemoryError:
            yield from self.records_of_loss(
                input_item, "there is not enough memory for this problem"
            )[number:]

    def _text(self, result: Result, source: Source) -> str:
        return (
            result_formats.of_result(result, source, self.format_name, self.layout)
            if self.format_name
            else ""
        )

    def _records_of_fault(
        self, sources: Sequence[Source], error: LCPError
    ) -> list[TaskRecord]:
        records = []
        for source in sources:
            is_named = source.file in error.parts
            message = str(error) if is_named else f"{source}: {error}"
            field = result_formats.field_in(error, source)
            records.append(
                self._without_result(
                    source, result_formats.BAD_INPUT, message, Exit.BAD_INPUT, field
                )
            )
        return records

    def records_of_loss(self, input_item: InputItem, message: str) -> list[TaskRecord]:
        """Return the records of an input whose results were lost."""
        return [
            self._without_result(
                at, result_formats.LOST, f"{at}: {message}", Exit.NOT_SOLVED
            )
            for at in input_item.sources
        ]

    def _each(self, input_item: InputItem) -> Iterator[tuple[Result, Sequence[str]]]:
        """Yield the results for problems that are solved one by one, with remarks on
        what was read."""
        inputs = self.request.inputs

        def traces(_: Any) -> tuple[Trace | None, None]:
            columns = of_traces(self.request.columns or ())
            return Trace(self.every, columns=columns) if self.every else None, None

        for read in inputs.problems(input_item, takes_models=self.steps is None):
            from lcpcli.solving.direct_run import uses_kernels

            compiled = uses_kernels(None, input_item.sources[0].item or 0)
            if self.steps is not None:
                result = self.steps.follow(read.problem, compiled)
            else:
                options_of_methods = self.request.options_for(read.problem)
                runs = Runs(self.request, read.problem, traces, True, compiled)
                (result,) = runs.results(options_of_methods)
            yield (
                self.request.prove(result, read.exactly),
                [] if inputs.quiet else read.remarks,
            )

    def _together(self, input_item: QColumns) -> Iterator[tuple[Result, Sequence[str]]]:
        from lcpcli.solving.many import solve_many

        request, first = self.request, self.request.inputs.first_of(input_item)
        (options,) = request.options_for(first)
        how = {"lower": first.lower, "upper": first.upper, **options, **request.numbers}
        results = solve_many(first.M, input_item.Q, request.variants[0].method, **how)
        for name, result in zip(input_item.names, results, strict=True):
            yield replace(result, problem=result.problem.named(name, first.origin)), []

    def _without_result(
        self,
        source: Source,
        status: str,
        message: str,
        exit_code: Exit,
        field: str | None = None,
    ) -> TaskRecord:
        text = ""
        if self.format_name:
            text = result_formats.without_result(
                source, status, message, field, self.format_name, self.layout
            )
        return TaskRecord(text, status, exit_code, (message,))


# Size of all inputs and records that wait, 32 MiB: memory must not grow with the
# number of problems.
MAX_BYTES = 2**25
READ_AHEAD = 512  # inputs that wait for a process: two of the largest pieces
# The size from which on a piece takes no further input, 512 KiB: a large input takes
# long enough by itself.
PIECE_BYTES = 2**19
COLUMNS_TOGETHER = 64  # the number of q with one M that are solved together
# Problems in a piece, after which even the results of the smallest ones are shown.
MAX_IN_A_PIECE = 256
# Pieces for each process, one at work and others queued, so that it never waits for the
# reader.
PIECES_EACH = 3
RECORD_BYTES = 500  # memory of a record without its text, about
SECONDS_TO_STOP = 5.0  # for the records of runs that are requested to stop
# Between checks that the processes are alive, while no record comes.
SECONDS_BETWEEN = 1.0
KILLED = "the process that solved this problem was killed twice"


class Ahead:
    """Inputs that a thread reads ahead, up to a number and a size; `news` is set for
    each of them and when there are no more."""

    def __init__(self, input_items: Iterable[InputItem], news: Event) -> None:
        self._input_items = input_items
        self._news = news
        self._read = deque[InputItem]()
        self._free_places = Semaphore(READ_AHEAD)
        self._endings: list[BaseException | None] = []
        thread = Thread(target=self._run, daemon=True)
        reading.append(thread)
        thread.start()

    @property
    def is_at_end(self) -> bool:
        """Return whether all inputs have been consumed. Raises the error, if any, that
        ended the reading."""
        is_at_end = bool(self._endings) and not self._read
        if is_at_end and self._endings[0] is not None:
            raise self._endings[0]
        return is_at_end

    def take(self, max_items: int) -> list[InputItem]:
        items, size = list[InputItem](), 0
        while self._read and len(items) < max_items and size < PIECE_BYTES:
            items.append(self._read.popleft())
            size += items[-1].size
            self._free_places.release(_places_of(items[-1]))
        return items

    def _run(self) -> None:
        failure = None
        try:
            for unsplit in self._input_items:
                for input_item in (
                    unsplit.parts(COLUMNS_TOGETHER)
                    if isinstance(unsplit, QColumns)
                    else [unsplit]
                ):
                    for _ in range(_places_of(input_item)):
                        self._free_places.acquire()
                    self._read.append(input_item)
                    self._news.set()
        except BaseException as error:
            failure = error
        self._endings.append(failure)
        self._news.set()


def _places_of(input_item: InputItem) -> int:
    """Return how many of the READ_AHEAD positions an input takes while it waits: one,
    or more by its size, so that all waiting inputs have at most MAX_BYTES together."""
    return min(READ_AHEAD, 1 + input_item.size * READ_AHEAD // MAX_BYTES)


def all_records(
    task: Task, input_items: Iterable[InputItem], pool: Pool | None, in_order: bool
) -> Generator[TaskRecord, None, None]:
    """Yield the records that the pool makes, or this process without one, in order or
    each as soon as it is known."""
    if pool is None:
        yield from until_interrupted(
            chain.from_iterable(map(task.records, input_items))
        )
        return
    try:
        yield from _Distribution(task, input_items, pool).records(in_order)
    except pool.end_errors:
        raise pool.end from None


class _Distribution:
    """Inputs that a pool solves.

    It takes no more inputs than keep the processes busy, so that memory remains for
    records that wait for an earlier one.
    """

    def __init__(
        self, task: Task, input_items: Iterable[InputItem], pool: Pool
    ) -> None:
        self._task = task
        self._pool = pool
        self._news = Event()
        self._inputs = Ahead(input_items, self._news)
        self._pieces: list[_Piece] = []  # in the order of the inputs
        self._size = 1  # problems of the next piece

    def records(self, in_order: bool) -> Iterator[TaskRecord]:
        try:
            yield from self._all(in_order)
        except KeyboardInterrupt:
            last = self._last()
            # A log is resumed without its unfinished records if they are its last ones.
            yield from last if in_order else sorted(last, key=_is_interrupted)
            raise

    def _last(self) -> Iterator[TaskRecord]:
        """Yield the records that are known once the runs that are under way have been
        requested to stop with their best iterates."""
        running = [piece.future for piece in self._pieces if piece.records is None]
        for future in running:
            future.cancel()
        if self._pool.stop():
            wait(running, SECONDS_TO_STOP)
        for piece in self._pieces:
            future = piece.future
            if piece.records is None and future.done() and not future.cancelled():
                piece.take([] if future.exception() else future.result()[0])
            yield from piece.taken()

    def _all(self, in_order: bool) -> Iterator[TaskRecord]:
        while True:
            self._news.clear()
            self._pool.check_alive()
            self._take_outcomes()
            self._hand_over_next()
            ready = [piece for piece in self._pieces if piece.records is not None]
            if in_order:
                finished = takewhile(
                    lambda piece: piece.records is not None, self._pieces
                )
                ready = list(finished)
            for piece in ready:
                yield from piece.taken()
                self._pieces.remove(piece)
            if not ready:
                if not self._pieces and self._inputs.is_at_end:
                    return
                self._news.wait(SECONDS_BETWEEN)

    def _hand_over(self, items: Sequence[InputItem], index: int) -> None:
        piece = _Piece(items, self._pool.submit(self._task.all_of, items))
        self._pieces.insert(index, piece)
        piece.future.add_done_callback(lambda _: self._news.set())

    def _take_outcomes(self) -> None:
        """Take the records of the pieces that are done, and hand over their remaining
        inputs again."""
        running = [piece for piece in self._pieces if piece.records is None]
        done = [piece for piece in running if piece.future.done()]
        errors = (piece.future.exception() for piece in done)
        if any(isinstance(error, self._pool.kill_error) for error in errors):
            # Other pieces may have been killed with it.
            _await([piece.future for piece in running], self._pool)
            done = running
        outcomes = list(self._outcomes(done))
        for piece, (records, seconds) in zip(done, outcomes, strict=True):
            remaining_items = piece.input_items[len(records) :]
            piece.take(records)
            in_time = int(PIECE_SECONDS * len(records) / max(seconds, 1e-6))
            self._size = max(1, min(MAX_IN_A_PIECE, 2 * self._size, in_time))
            first = self._pieces.index(piece) + 1
            for index, at in enumerate(
                range(0, len(remaining_items), self._size), first
            ):
                self._hand_over(remaining_items[at : at + self._size], index)

    def _outcomes(self, done: Sequence[_Piece]) -> Iterator[Records]:
        """Yield the records of pieces, of those that were killed the ones of a second
        attempt: the problems of the first such pieces get it, each alone."""
        suspects = self._pool.size
        for piece in done:
            try:
                yield piece.future.result()
            except self._pool.kill_error:
                again = piece.input_items if suspects > 0 else []
                yield (
                    [
                        _alone(self._task, input_item, self._pool)
                        for input_item in again
                    ],
                    0.0,
                )
                suspects -= 1

    def _hand_over_next(self) -> None:
        free = PIECES_EACH * self._pool.size
        free -= sum(piece.records is None for piece in self._pieces)
        while free > 0 and sum(piece.bytes for piece in self._pieces) < MAX_BYTES:
            items = self._inputs.take(min(self._size, self._pool.max_items))
            if not items:
                break
            self._hand_over(items, len(self._pieces))
            free -= 1


class _Piece:
    """Inputs that are handed over together, then their records, and the size of either
    in bytes."""

    def __init__(
        self, input_items: Sequence[InputItem], future: Future[Records]
    ) -> None:
        self.input_items, self.future = input_items, future
        self.bytes = sum(input_item.size for input_item in input_items)
        self.records: deque[TaskRecord] | None = None

    def take(self, records: list[list[TaskRecord]]) -> None:
        self.input_items = []
        self.records = deque(chain.from_iterable(records))
        self.bytes = sum(RECORD_BYTES + len(record.text) for record in self.records)

    def taken(self) -> Iterator[TaskRecord]:
        """Yield the records, each of them once."""
        while self.records:
            yield self.records.popleft()


def _alone(task: Task, input_item: InputItem, pool: Pool) -> list[TaskRecord]:
    future: Future[Records] = pool.submit(task.all_of, [input_item])
    _await([future], pool)
    try:
        return future.result()[0][0]
    except pool.kill_error:
        return task.records_of_loss(input_item, KILLED)


def _await(futures: Sequence[Future[Records]], pool: Pool) -> None:
    while wait(futures, SECONDS_BETWEEN).not_done:
        pool.check_alive()
