"""Many problems in several processes: one that is killed, wherever it is, costs no record, and no order."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest

from lcpcli.cli import pools, workers
from lcpcli.cli.records import Record
from lcpcli.files.inputs import Input

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the processes are found in /proc")

COMMAND = [sys.executable, "-c", "from lcpcli.cli.main import main; main()"]
MANY = 400
PATIENCE = 60.0  # seconds until something that must happen has not


def lines(k: int) -> list[str]:
    rng = np.random.default_rng(0)
    made = []
    for _ in range(k):
        M = rng.standard_normal((5, 5))
        made.append(json.dumps({"M": (M + np.diag(np.abs(M).sum(1))).tolist(), "q": rng.standard_normal(5).tolist()}))
    return made


def until(holds: Any) -> None:
    """Wait for that."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def started_by(pid: int) -> list[int]:
    """The processes that solve problems for another."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == pid and b"spawn_main" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    return found


@contextmanager
def solving(*options: str) -> Iterator[tuple[subprocess.Popen[bytes], IO[bytes]]]:
    """A run of `lcp solve -` that gets its problems one by one."""
    process = subprocess.Popen([*COMMAND, "solve", "-", *options], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdin is not None
    try:
        yield process, process.stdin
    finally:
        process.kill()
        process.communicate()


def give(stdin: IO[bytes], problems: list[str]) -> None:
    stdin.write("".join(f"{line}\n" for line in problems).encode())
    stdin.flush()


def items(log: Path) -> list[int]:
    return [json.loads(line)["item"] for line in log.read_text().splitlines()]


def test_killed_process_costs_no_record_and_no_order(tmp_path: Path) -> None:
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving("--jobs", "2", "-o", str(log)) as (process, stdin):
        give(stdin, problems[:200])
        until(lambda: log.exists() and log.read_bytes().count(b"\n") >= 10)
        os.kill(started_by(process.pid)[0], signal.SIGKILL)
        give(stdin, problems[200:])
        _, told = process.communicate(timeout=PATIENCE)
    assert (process.returncode, told.decode()) == (0, f"lcp: {MANY} problems: {MANY} solved\n")
    assert items(log) == list(range(1, MANY + 1))


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_killed_program_goes_on_from_its_log_and_leaves_no_process(jobs: str, tmp_path: Path) -> None:
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving("--jobs", jobs, "-o", str(log)) as (process, stdin):
        give(stdin, problems[:200])
        until(lambda: log.exists() and log.read_bytes().count(b"\n") >= 10)
        others = started_by(process.pid)
        process.kill()
        process.wait()
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in others))
    assert len(others) == (2 if jobs == "2" else 0)
    assert 10 <= len(items(log)) < MANY
    with solving("--jobs", jobs, "--resume", str(log)) as (process, stdin):
        _, told = process.communicate("".join(f"{line}\n" for line in problems).encode(), timeout=PATIENCE)
    assert (process.returncode, told.decode()) == (0, f"lcp: {MANY} problems: {MANY} solved\n")
    assert items(log) == list(range(1, MANY + 1))


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_interrupt_leaves_what_is_solved_and_no_process(jobs: str, tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    with solving("--jobs", jobs, "-o", str(log)) as (process, stdin):
        give(stdin, lines(200))
        until(lambda: log.exists() and log.read_bytes().count(b"\n") >= 10)
        others = started_by(process.pid)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert told.decode().endswith(f"interrupted; go on with --resume {log}\n")
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in others))
    assert items(log) == list(range(1, len(items(log)) + 1))


def torn() -> None:
    """End the process that calls this in the middle of handing over a result."""
    results = sys._getframe(1).f_locals["result_queue"]
    os.write(results._writer.fileno(), b"\0\0\1\0 and no more")
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("is_seen", [True, False])
def test_process_that_dies_while_it_hands_over_a_result_holds_up_nothing(is_seen: bool) -> None:
    pool = pools.Local(2)
    first, idle = pool.executor.submit(os.getpid), pool.executor.submit(time.sleep, PATIENCE)
    assert first.result(PATIENCE)
    future = pool.executor.submit(torn)
    if is_seen:
        assert isinstance(future.exception(PATIENCE), BrokenExecutor)
        assert isinstance(idle.exception(PATIENCE), BrokenExecutor)
        pool.renew()
        assert pool.executor.submit(os.getpid).result(PATIENCE)
    else:
        until(lambda: len(multiprocessing.active_children()) < pool.size)
    pool.close()
    assert not multiprocessing.active_children()


class Deadly:
    """A task, and a pool of one process that some inputs kill, always or the first time."""

    lost, ends = BrokenExecutor, (OSError,)
    size = 1

    def __init__(self, always: set[int], once: set[int]) -> None:
        self.always, self.once, self.renewed = always, set(once), 0
        self.executor = self

    def submit(self, _: Any, works: list[Input]) -> Future[Any]:
        future: Future[Any] = Future()
        numbers = {work.line for work in works}
        if numbers & (self.always | self.once):
            self.once -= numbers
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(([Record(str(work.line), "solved", 0) for work in works], 0.01))
        return future

    all_of = submit

    def renew(self) -> None:
        self.renewed += 1

    def lost_record(self, work: Input, message: str) -> list[Record]:
        return [Record(f"{work.line}: {message}", "breakdown", 1)]


@pytest.mark.parametrize(("always", "once"), [((), (3,)), ((7,), ()), ((1, 2, 50), (20, 21)), ((), ())])
def test_problem_that_kills_its_process_again_is_the_only_one_without_a_result(
    always: tuple[int, ...], once: tuple[int, ...]
) -> None:
    pool: Any = Deadly(set(always), set(once))

    class Task:
        all_of = None
        lost = staticmethod(pool.lost_record)

    works = [Input((f"{k}.json",), (b"{}",), line=k) for k in range(1, 101)]
    task: Any = Task
    texts = [record.text for record in workers.elsewhere(task, works, pool)]
    assert texts == [f"{k}: {workers.KILLED}" if k in always else str(k) for k in range(1, 101)]
    assert bool(pool.renewed) == bool(always or once)


def test_only_so_much_is_read_ahead_as_keeps_the_processes_busy() -> None:
    pool: Any = Deadly(set(), set())
    read = []

    def works() -> Iterator[Input]:
        for k in range(10_000):
            read.append(k)
            yield Input((f"{k}.json",), (b"{}",), line=k)

    task: Any = Deadly
    records = workers.elsewhere(task, works(), pool)
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
                slow.set_result(([Record("1", "solved", 0)], 1.0))
            return slow if works[0].line == 1 else super().submit(_, works)

    pool: Any = Slow(set(), set())
    works = [Input((f"{k}.json",), (b"{}",), line=k) for k in range(1, 501)]
    texts = [record.text for record in workers.elsewhere(pool, works, pool)]
    assert texts == [str(k) for k in range(1, 501)]
    assert len(sizes) < 50


def scheduler_and_workers(folder: Path) -> list[subprocess.Popen[bytes]]:
    """A Dask scheduler, whose address is in a file, and two workers."""
    python, file = sys.executable, str(folder / "scheduler.json")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", file, "--no-dashboard"]
    scheduler = ["distributed.cli.dask_scheduler", *common, "--port", "0", "--host", "127.0.0.1"]
    worker = ["distributed.cli.dask_worker", *common, "--nthreads", "1", "--no-nanny", "--local-directory", str(folder)]
    return [subprocess.Popen([python, "-m", *each], **quiet) for each in (scheduler, worker, worker)]  # type: ignore[call-overload]


def test_killed_worker_of_a_cluster_costs_no_record_and_no_order(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    cluster = scheduler_and_workers(tmp_path)
    try:
        until(lambda: (tmp_path / "scheduler.json").exists())
        until(lambda: (tmp_path / "scheduler.json").read_text().endswith("}"))
        address = json.loads((tmp_path / "scheduler.json").read_text())["address"]
        with solving("--cluster", address, "-o", str(log)) as (process, stdin):
            give(stdin, problems[:200])
            until(lambda: log.exists() and log.read_bytes().count(b"\n") >= 10)
            cluster[-1].kill()
            give(stdin, problems[200:])
            _, told = process.communicate(timeout=PATIENCE)
        assert (process.returncode, told.decode()) == (0, f"lcp: {MANY} problems: {MANY} solved\n")
        assert items(log) == list(range(1, MANY + 1))
        with solving("--cluster", address, "-o", str(log)) as (process, stdin):
            give(stdin, problems[:200])
            until(lambda: 10 <= log.read_bytes().count(b"\n") < MANY)
            cluster[0].kill()
            _, told = process.communicate("".join(problems).encode(), timeout=PATIENCE)
        assert process.returncode == 2, told.decode()
        assert f"the scheduler at {address} has gone" in told.decode()
        assert len(told.splitlines()) == 1
    finally:
        for each in cluster:
            each.kill()
            each.wait()


@pytest.mark.parametrize("address", ["nonsense://1", "scheduler.json", "tcp://127.0.0.1:1x"])
def test_cluster_that_cannot_be_there_is_told_in_a_line(address: str) -> None:
    pytest.importorskip("distributed")
    with solving("--cluster", address) as (process, _):
        _, told = process.communicate(lines(1)[0].encode(), timeout=PATIENCE)
    assert process.returncode == 2
    assert told.decode().startswith(f"lcp: --cluster: {address} is not reached")
    assert len(told.splitlines()) == 1
