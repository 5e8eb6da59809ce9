"""The work on each of many problems, in this process or another: solving it, and typesetting its record.

Many problems solved by several processes, on this machine or a cluster, while the next problems are being read.

Each problem of a process that was killed gets a second attempt, alone; a problem that kills its process again has no
result.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import replace
from threading import Condition, Event, Thread
from typing import TYPE_CHECKING, NamedTuple

from lcpcli.cli.main import BAD_INPUT, NOT_SOLVED, as_written, of_result, reading
from lcpcli.cli.request import Request
from lcpcli.errors import LCPError
from lcpcli.files.contents import Source
from lcpcli.files.inputs import QColumns, Work
from lcpcli.options import LIMITS
from lcpcli.report import result_formats
from lcpcli.report.result_formats import Layout
from lcpcli.solving.trace import Trace

if TYPE_CHECKING:
    from lcpcli.cli.pools import Pool
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

    form : the format, "" for none. layout : the columns of a table. every : the step from one
    written iterate to the next; None to write none. steps : what solves each problem from the states of the last one,
    if they are a sequence.
    """

    request: Request
    form: str
    layout: Layout
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
            return result, result_formats.of_result(result, source, self.form, self.layout)
        except KeyboardInterrupt:
            result = replace(result, interrupted=True)
            return result, result_formats.of_result(result, source, self.form, self.layout)

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
        text = result_formats.without_result(source, word, message, self.form, self.layout) if self.form else ""
        return TaskRecord(text, word, exit_code, (message,))


MOST_BYTES = 2**25  # of waiting inputs and records, 32 MiB: memory must not grow with the number of problems
READ_AHEAD = 512  # inputs that wait for a process: two of the largest pieces
PIECE_BYTES = 2**19  # at which a piece takes no further input, 512 KiB: large inputs are work enough one by one
COLUMNS_FOR_ONE = 16  # q of one M that count as one problem, as they are solved together and take about as long

MOST_IN_A_PIECE = 256  # problems, so that even the smallest ones are shown after at most that many
PIECES_EACH = 3  # pieces that each process has or finds next, so that none waits for the reader
RECORD_BYTES = 500  # of a record besides its text, about, as the interpreter stores it
SECONDS_BETWEEN = 5.0  # looks at the processes while no record comes: only a cluster without workers waits so long
KILLED = "the process that solved this problem was killed twice"


def size_of(work: Work) -> int:
    """Return the number of bytes of an input."""
    return work.Q.nbytes if isinstance(work, QColumns) else sum(map(len, work.contents))


class Ahead:
    """Inputs that a separate thread reads ahead, as far as there is room.

    `news` is set whenever an input has been read, and at the end. The thread may wait for standard input indefinitely;
    the program ends without waiting for it.
    """

    def __init__(self, works: Iterable[Work], news: Event) -> None:
        self._works, self._news = works, news
        self._read: deque[Work] = deque()
        self._bytes = 0
        self._room = Condition()
        self._over = False
        self._fault: BaseException | None = None
        thread = Thread(target=self._run, daemon=True)
        reading.append(thread)
        thread.start()

    @property
    def is_at_end(self) -> bool:
        """Return whether all inputs have been taken. Raises the error, if any, that ended the reading."""
        if not self._over or self._read:
            return False
        if self._fault is not None:
            raise self._fault
        return True

    def take(self, number: int, most: int) -> list[Work]:
        """Take inputs that have been read, at most `number` or `most` of them; an input with several q comes alone."""
        taken: list[Work] = []
        total = 0
        with self._room:
            self._room.notify()
            while self._read and len(taken) < min(number, most) and total < PIECE_BYTES:
                if taken and isinstance(self._read[0], QColumns):
                    break
                work = self._read.popleft()
                self._bytes -= size_of(work)
                if isinstance(work, QColumns):
                    size = COLUMNS_FOR_ONE * number
                    part, rest = work.part(0, size), work.part(size, len(work.names))
                    if rest.names:
                        self._read.appendleft(rest)
                        self._bytes += size_of(rest)
                    return [part]
                taken.append(work)
                total += size_of(work)
        return taken

    def _run(self) -> None:
        try:
            for work in self._works:
                with self._room:
                    self._room.wait_for(lambda: len(self._read) < READ_AHEAD and self._bytes < MOST_BYTES)
                    self._read.append(work)
                    self._bytes += size_of(work)
                self._news.set()
        except BaseException as error:
            self._fault = error
        self._over = True
        self._news.set()


def elsewhere(task: Task, works: Iterable[Work], pool: Pool, in_order: bool) -> Iterator[TaskRecord]:
    """Yield the records that the pool makes, in the order of the problems or each as soon as it is known.

    Only as many inputs are taken as keep the processes busy and, if `in_order`, leave room for records that wait for an
    earlier one.
    """
    news = Event()
    inputs, waiting, running = Ahead(works, news), list[_Piece](), list[_Piece]()
    size, total = 1, 0  # of the next piece, in problems; of all pieces, in bytes

    def hand_over(taken: Sequence[Work], place: int) -> None:
        """Have the pool solve a piece, which waits for its turn at this place."""
        nonlocal total
        piece = _Piece(taken, pool.submit(task.all_of, taken))
        piece.future.add_done_callback(lambda _: news.set())
        running.append(piece)
        if in_order:
            waiting.insert(place, piece)
        total += piece.bytes

    try:
        while True:
            news.clear()
            pool.look()
            done = [piece for piece in running if piece.future.done()]
            for piece in done:
                running.remove(piece)
                total -= piece.bytes
                left, seconds = piece.finish(task, pool)
                fitting = int(PIECE_SECONDS * len(piece.records) / max(seconds, 1e-6))
                size = max(1, min(MOST_IN_A_PIECE, 2 * size, fitting))
                total += piece.bytes
                place = waiting.index(piece) + 1 if in_order else 0
                for number, at in enumerate(range(0, len(left), size)):
                    hand_over(left[at : at + size], place + number)
            while len(running) < PIECES_EACH * pool.size and total < MOST_BYTES:
                taken = inputs.take(size, pool.most)
                if not taken:
                    break
                hand_over(taken, len(waiting))
            ready = [] if in_order else done
            while waiting and waiting[0].is_finished:
                ready.append(waiting.pop(0))
            for piece in ready:
                total -= piece.bytes
                yield from piece.records
            if not ready:
                if not running and inputs.is_at_end:
                    return
                news.wait(SECONDS_BETWEEN)
    except pool.end_errors:
        raise pool.end from None


class _Piece:
    """Inputs that are handed over together, and then their records."""

    def __init__(self, works: Sequence[Work], future: Future[tuple[list[TaskRecord], float]]) -> None:
        self.works, self.future, self.is_finished = works, future, False
        self.records: list[TaskRecord] = []
        self.bytes = sum(map(size_of, works))

    def finish(self, task: Task, pool: Pool) -> tuple[Sequence[Work], float]:
        """Replace the inputs by their records; return those without, and the seconds that the others took."""
        try:
            self.records, seconds = self.future.result()
        except pool.kill_error:
            self.records, seconds = list(_again(task, self.works, pool)), 0.0
        left = self.works[len(self.records) :]  # several q come alone, and have all their records
        self.works, self.is_finished = [], True
        self.bytes = sum(RECORD_BYTES + len(record.text) for record in self.records)
        return left, seconds


def _again(task: Task, works: Sequence[Work], pool: Pool) -> Iterator[TaskRecord]:
    """Yield the records of inputs whose process was killed, after a second attempt at each alone."""
    futures = [pool.submit(task.all_of, [work]) for work in works]
    for work, future in zip(works, futures, strict=True):
        try:
            yield from future.result()[0]
        except pool.kill_error:
            yield from task.records_of_loss(work, KILLED)
