"""In which order the records of many problems come from several processes, and how much waits meanwhile: what is known
is told at once where no order is kept, and a process that is killed costs no record."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterator
from concurrent.futures import BrokenExecutor, Future
from typing import Any

import numpy as np
import pytest

from lcpcli.cli import workers as tasks
from lcpcli.cli.streams import TaskRecord
from lcpcli.files.inputs import Input, QColumns

PATIENCE = 60.0  # seconds until something that must happen has not


def problems(n: int) -> Iterator[Input]:
    """Problems that are numbered from 1."""
    return (Input((f"{k}.json",), (b"{}",), line=k) for k in range(1, n + 1))


def solved(*texts: Any, seconds: float = 1.0) -> tuple[list[TaskRecord], float]:
    return [TaskRecord(str(text), "solved", 0) for text in texts], seconds


def told(task: Any, n: int, pool: Any, in_order: bool) -> list[str]:
    """The records of n problems, as they come."""
    return [record.text for record in tasks.elsewhere(task, problems(n), pool, in_order)]


class Deadly:
    """A task, and a pool of one process that some inputs kill, always or the first time."""

    kill_error, end_errors = BrokenExecutor, (OSError,)
    size, most = 1, 256

    def __init__(self, always: Collection[int] = (), once: Collection[int] = ()) -> None:
        self.always, self.once = set(always), set(once)

    def submit(self, _: Any, works: list[Input]) -> Future[Any]:
        future: Future[Any] = Future()
        numbers = {work.line for work in works}
        if numbers & (self.always | self.once):
            self.once -= numbers
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(solved(*(work.line for work in works), seconds=0.01))
        return future

    all_of = submit

    def look(self) -> None:
        """There is one process."""

    def records_of_loss(self, work: Input, message: str) -> list[TaskRecord]:
        return [TaskRecord(f"{work.line}: {message}", "breakdown", 1)]


@pytest.mark.parametrize("in_order", [True, False])
@pytest.mark.parametrize(("always", "once"), [((7,), (3,)), ((1, 2, 50), (20, 21)), ((), ())])
def test_problem_that_kills_its_process_again_is_the_only_one_without_a_result(
    always: tuple[int, ...], once: tuple[int, ...], in_order: bool
) -> None:
    pool = Deadly(always, once)
    texts = told(pool, 100, pool, in_order)
    expected = [f"{k}: {tasks.KILLED}" if k in always else str(k) for k in range(1, 101)]
    assert texts == expected if in_order else sorted(texts) == sorted(expected)


def test_only_so_much_is_read_ahead_as_keeps_the_processes_busy() -> None:
    pool: Any = Deadly()
    read: list[Input] = []
    works = (read.append(work) or work for work in problems(10_000))  # type: ignore[func-returns-value]
    records = tasks.elsewhere(pool, works, pool, in_order=True)
    for _ in range(10):
        next(records)
    assert len(read) < 1000


def test_behind_one_that_takes_long_more_and_more_are_handed_over_at_once() -> None:
    slow: Future[Any] = Future()
    sizes: list[int] = []

    class Slow(Deadly):
        def submit(self, _: Any, works: list[Input]) -> Future[Any]:
            sizes.append(len(works))
            if sum(sizes) == 500:
                slow.set_result(solved(1))
            return slow if works[0].line == 1 else super().submit(_, works)

    pool = Slow()
    assert told(pool, 500, pool, True) == [str(k) for k in range(1, 501)]
    assert len(sizes) < 50


@pytest.mark.parametrize("in_order", [True, False])
def test_inputs_that_a_process_hands_back_are_solved_in_their_order(in_order: bool) -> None:
    class Slow(Deadly):
        def submit(self, _: Any, works: list[Input]) -> Future[Any]:
            return super().submit(_, works[: 1 + (works[0].line or 0) % 3])

    pool = Slow(once=(20, 40))
    numbers = [int(text) for text in told(pool, 500, pool, in_order)]
    assert (numbers if in_order else sorted(numbers)) == [*range(1, 501)]


class Stuck(Deadly):
    """A pool in which the first problem takes until all others, or so many, are solved; the records are large."""

    most = 1

    def __init__(self, until: int, length: int) -> None:
        super().__init__()
        self.first: Future[Any] = Future()
        self.solved, self.until, self.length = 0, until, length

    def submit(self, _: Any, works: list[Input]) -> Future[Any]:
        if works[0].line == 1:
            return self.first
        self.solved += 1
        if self.solved == self.until:
            self.first.set_result(solved(1))
        future: Future[Any] = Future()
        future.set_result(solved(f"{works[0].line}".rjust(self.length)))
        return future


def test_each_record_is_known_at_once_where_no_order_is_kept() -> None:
    pool = Stuck(until=999, length=1)
    numbers = [int(text) for text in told(pool, 1000, pool, False)]
    assert numbers.index(1) >= 900
    assert sorted(numbers) == [*range(1, 1001)]


def test_in_order_only_so_much_is_solved_behind_one_that_takes_long_as_there_is_room_for() -> None:
    length = tasks.MOST_BYTES // 100
    pool = Stuck(until=90, length=length)
    assert [int(text) for text in told(pool, 200, pool, True)] == [*range(1, 201)]
    stuck: Any = Stuck(until=1000, length=length)
    held = tasks.elsewhere(stuck, problems(200), stuck, in_order=True)
    thread = threading.Thread(target=lambda: next(held), daemon=True)
    thread.start()
    end = time.monotonic() + PATIENCE
    while stuck.solved < 95:
        assert time.monotonic() < end
        time.sleep(0.01)
    thread.join(0.2)
    assert stuck.solved <= 105
    stuck.first.set_result(solved(1))


def test_columns_of_one_matrix_are_taken_alone_and_nothing_before_them_is_lost() -> None:
    all_read = threading.Event()
    single = list(problems(3))
    columns = QColumns(("M.npy", "Q.npy"), np.eye(2), np.ones((2, 40)), [str(j) for j in range(40)])

    def works() -> Iterator[Any]:
        yield from (single[0], single[1], columns, single[2])
        all_read.set()

    ahead = tasks.Ahead(works(), threading.Event())
    assert all_read.wait(60)
    taken: list[Any] = []
    while together := ahead.take(3, 4):
        assert len(together) == 1 or not any(isinstance(work, QColumns) for work in together)
        taken += together
    assert [work for work in taken if isinstance(work, Input)] == single
    assert [name for work in taken if isinstance(work, QColumns) for name in work.names] == list(columns.names)
