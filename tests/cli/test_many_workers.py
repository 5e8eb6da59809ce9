"""Many problems in several processes: in which order records come, and that one that is
killed costs none."""

import inspect
import json
import logging
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager, suppress
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lcpcli.cli import pools
from lcpcli.cli import streams as tasks
from lcpcli.cli.streams import TaskRecord
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input, QColumns

from ..seeds import few_of
from .conftest import INFEASIBLE, MAIN, python

resource = pytest.importorskip("resource")
pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="the processes are found in /proc"
)
COMMAND = [sys.executable, "-c", MAIN]
MANY = 400
PATIENCE = 60.0  # seconds until something that must happen has not


def lines(k):
    rng = np.random.default_rng(0)
    every = rng.standard_normal((k, 5, 5)) + 9 * np.eye(5)
    return [
        json.dumps({"M": M.tolist(), "q": rng.standard_normal(5).tolist()})
        for M in every
    ]


def until(holds):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def started_by(pid):
    """The processes that solve problems for another."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [
        int(child)
        for child in children
        if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


def seconds_of(pid):
    """How long a process has computed."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) / os.sysconf("SC_CLK_TCK")


@contextmanager
def solving(options):
    """A run of `lcp solve -` that gets its problems one by one."""
    process = subprocess.Popen(
        [*COMMAND, "solve", "-", *options.split()],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdin is not None
    try:
        yield process, process.stdin
    finally:
        process.kill()
        process.communicate()


def give(stdin, problems, log=None):
    """Write problems to a run, and wait until some are in its log."""
    stdin.write("".join(f"{line}\n" for line in problems).encode())
    stdin.flush()
    until(lambda: log is None or (log.exists() and log.read_bytes().count(b"\n") >= 10))


def items(log):
    return [json.loads(line)["item"] for line in log.read_text().splitlines()]


def assert_all_solved(process, told, log):
    assert process.returncode == 0
    assert told.decode() == f"lcp: {MANY} problems: {MANY} solved\n"
    assert sorted(items(log)) == list(range(1, MANY + 1))


@pytest.mark.slow("starts processes and kills them")
def test_killed_process_costs_no_record_and_no_order(tmp_path):
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving(f"--jobs 2 -o {log}") as (process, stdin):
        give(stdin, problems[:200], log)
        os.kill(started_by(process.pid)[0], signal.SIGKILL)
        give(stdin, problems[200:])
        _, told = process.communicate(timeout=PATIENCE)
    assert_all_solved(process, told, log)


@pytest.mark.slow("starts processes and kills them")
@pytest.mark.parametrize(
    ("jobs", "number", "code"),
    [
        ("1", signal.SIGKILL, -9),
        ("2", signal.SIGKILL, -9),
        ("1", signal.SIGINT, 130),
        ("2", signal.SIGINT, 130),
        ("2", signal.SIGTERM, 143),
    ],
)
def test_ended_program_leaves_what_is_solved_and_no_process_and_goes_on_from_its_log(
    jobs, number, code, tmp_path
):
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving(f"--jobs {jobs} -o {log}") as (process, stdin):
        give(stdin, problems[:200], log)
        others = started_by(process.pid)
        process.send_signal(number)
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == code
    assert len(others) == (2 if jobs == "2" else 0)
    expected = (
        "" if code == -9 else f"lcp: .*; interrupted; continue with --resume {log}\n"
    )
    assert re.fullmatch(expected, told.decode())
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in others))
    assert 10 <= len(set(items(log))) == len(items(log)) < MANY
    with solving(f"--jobs {jobs} --resume {log}") as (process, stdin):
        give(stdin, problems)
        _, told = process.communicate(timeout=PATIENCE)
    assert_all_solved(process, told, log)


def torn():
    """End the process that calls this in the middle of handing over a result."""
    frames = (each.frame.f_locals for each in inspect.stack())
    results = next(names["result_queue"] for names in frames if "result_queue" in names)
    os.write(results._writer.fileno(), b"\0\0\1\0 and no more")
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_that_dies_handing_over_ends_the_others_at_the_next_look():
    pool = pools.Local(2)
    first, idle = pool.submit(os.getpid), pool.submit(time.sleep, PATIENCE)
    assert first.result(PATIENCE)
    future = pool.submit(torn)
    until(lambda: len(multiprocessing.active_children()) < pool.size)
    pool.check_alive()
    for each in (future, idle):
        assert isinstance(each.exception(PATIENCE), BrokenExecutor)
    assert pool.submit(os.getpid).result(PATIENCE) != first.result()
    pool.submit(time.sleep, PATIENCE)
    pool.close()
    assert not multiprocessing.active_children()


@pytest.mark.parametrize(
    ("jobs", "files"),
    few_of([(8, 14), (40, 60), (30, 40)], 2),
)
def test_processes_that_cannot_be_started_end_in_one_line(jobs, files, tmp_path):
    many = tmp_path / "many.jsonl"
    many.write_text("\n".join(lines(100)))
    done = python(
        f"import resource\nresource.setrlimit(resource.RLIMIT_NOFILE, ({files}, 1000))"
        f"\n{MAIN}",
        *("solve", str(many), "--jobs", str(jobs)),
        timeout=PATIENCE,
    )
    assert (done.code, done.err.count("\n")) == (1, 1), done.err
    told = "lcp: --jobs: a process cannot be started (Too many open files); give fewer"
    assert done.err.startswith(told)


@pytest.mark.slow("starts processes and kills them")
def test_processes_that_cannot_be_started_again_leave_what_is_solved(tmp_path):
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving(f"--jobs 2 -o {log}") as (process, stdin):
        give(stdin, problems[:200], log)
        until(lambda: log.read_bytes().count(b"\n") == 200)
        number = len(os.listdir(f"/proc/{process.pid}/fd"))
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (number, 1000))
        os.kill(started_by(process.pid)[0], signal.SIGKILL)
        # A run that has ended reads no more.
        with suppress(BrokenPipeError):
            give(stdin, problems[200:])
        process.wait(PATIENCE)
        told = process.stderr.read().decode()
    assert (process.returncode, told.count("\n")) == (1, 1), told
    assert told.startswith("lcp: --jobs: a process cannot be started (Too many open")
    assert sorted(items(log)) == list(range(1, 201))


def scheduler_and_workers(folder):
    """A Dask scheduler, whose address is in a file, and two workers."""
    python, file = sys.executable, str(folder / "scheduler.json")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", file, "--no-dashboard"]
    address = ["--port", "0", "--host", "127.0.0.1"]
    scheduler = ["distributed.cli.dask_scheduler", *common, *address]
    alone = ["--nthreads", "1", "--no-nanny", "--local-directory", str(folder)]
    worker = ["distributed.cli.dask_worker", *common, *alone]
    return [
        subprocess.Popen([python, "-m", *each], **quiet)
        for each in (scheduler, worker, worker)
    ]


@pytest.mark.slow("starts a cluster")
def test_killed_worker_of_a_cluster_costs_no_record_and_no_order(tmp_path):
    pytest.importorskip("distributed")
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    cluster = scheduler_and_workers(tmp_path)
    try:
        until(lambda: (tmp_path / "scheduler.json").exists())
        until(lambda: (tmp_path / "scheduler.json").read_text().endswith("}"))
        address = json.loads((tmp_path / "scheduler.json").read_text())["address"]
        with solving(f"--cluster {address} -o {log}") as (process, stdin):
            give(stdin, problems[:200], log)
            cluster[-1].kill()
            give(stdin, problems[200:])
            _, told = process.communicate(timeout=PATIENCE)
        assert_all_solved(process, told, log)
        log.unlink()
        with solving(f"--cluster {address} -o {log}") as (process, stdin):
            give(stdin, problems[:200])
            until(lambda: 10 <= log.read_bytes().count(b"\n") < MANY)
            cluster[0].kill()
            _, told = process.communicate("".join(problems).encode(), timeout=PATIENCE)
        assert process.returncode == 1, told.decode()
        (line,) = told.decode().splitlines()
        assert f"the scheduler at {address} no longer answers" in line
    finally:
        for each in cluster:
            each.kill()
            each.wait()


def test_cluster_without_workers_is_told_of_once(monkeypatch, capfd):
    workers, now = {}, [100.0]

    class Client:
        def __init__(self, *_, **__): ...

        get_executor = staticmethod(lambda **_: None)
        nthreads = staticmethod(lambda: workers)

    for name, own in {
        "": {"Client": Client},
        ".comm.addressing": {"get_address_host_port": lambda _: ("here", 1)},
        ".scheduler": {"KilledWorker": RuntimeError},
        ".security": {"Security": object},
    }.items():
        module = SimpleNamespace(**own)
        monkeypatch.setitem(sys.modules, f"distributed{name}", module)
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(logging, "disable", lambda _: None)
    with warnings.catch_warnings():
        pool = pools.Cluster("tcp://here:1")
    for now[0] in (100.0, 105.0):
        pool.check_alive()
    assert pool.size == 1
    assert capfd.readouterr().err == ""
    for now[0] in (110.0, 120.0):
        pool.check_alive()
    line = (
        "lcp: --cluster: the scheduler at tcp://here:1 has no workers; start dask "
        "worker tcp://here:1, which needs this package: without it a worker ends at "
        "once\n"
    )
    assert capfd.readouterr().err == line
    workers |= {"a": 2, "b": 1}
    now[0] = 130.0
    pool.check_alive()
    assert pool.size == 3


@pytest.mark.slow("waits for a cluster")
@pytest.mark.parametrize(
    ("address", "fault"),
    [
        ("scheduler.json", "cannot be reached"),
        ("tcp://1.0.0.1:1x", "cannot be reached"),
        ("tls://1:8", "needs certificates"),
    ],
)
def test_cluster_that_cannot_be_there_is_told_in_a_line(address, fault):
    pytest.importorskip("distributed")
    with solving(f"--cluster {address}") as (process, _):
        _, told = process.communicate(lines(1)[0].encode(), timeout=PATIENCE)
    assert process.returncode == 2
    (line,) = told.decode().splitlines()
    assert line.startswith(f"lcp: --cluster: {address} {fault}")


def problems(n):
    """Problems that are numbered from 1."""
    return (Input((InputFile(f"{k}.json", b"{}", k),)) for k in range(1, n + 1))


def solved(*texts, seconds=1.0):
    return [[TaskRecord(str(text), "solved", 0)] for text in texts], seconds


def told(task, n, pool, in_order):
    """The records of n problems, as they come."""
    return [
        record.text for record in tasks.all_records(task, problems(n), pool, in_order)
    ]


class Deadly:
    """A task, and a pool of one process that some inputs kill, always or the first
    time."""

    kill_error, end_errors = BrokenExecutor, (OSError,)
    size, max_items = 1, 256

    def __init__(self, always=(), once=()):
        self.always, self.once = set(always), set(once)

    def submit(self, _, works):
        future = Future()
        numbers = {work.line for work in works}
        if numbers & (self.always | self.once):
            self.once -= numbers
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(solved(*(work.line for work in works), seconds=0.01))
        return future

    all_of = submit

    def check_alive(self):
        """There is one process."""

    def records_of_loss(self, work, message):
        return [TaskRecord(f"{work.line}: {message}", "breakdown", 1)]


@pytest.mark.parametrize("in_order", [True, False])
@pytest.mark.parametrize(
    ("always", "once"), [((7,), (3,)), ((1, 2, 50), (20, 21)), ((), ())]
)
def test_problem_that_kills_its_process_again_is_the_only_one_without_a_result(
    always, once, in_order
):
    pool = Deadly(always, once)
    texts = told(pool, 100, pool, in_order)
    expected = [
        f"{k}: {tasks.KILLED}" if k in always else str(k) for k in range(1, 101)
    ]
    assert texts == expected if in_order else sorted(texts) == sorted(expected)


def test_second_attempt_is_alone_though_another_piece_has_a_rest_that_kills():
    class Together(Deadly):
        """It hands back all but the first of many inputs; what kills a process takes
        along what is handed over next."""

        is_dying = False

        def check_alive(self):
            self.is_dying = False

        def submit(self, _, works):
            future = super().submit(_, works[:1] if len(works) > 4 else works)
            if self.is_dying:
                future = Future()
                future.set_exception(BrokenExecutor())
            self.is_dying |= future.exception() is not None and len(works) > 1
            return future

    for kills, killed_once in product(range(4, 12, 3), range(12, 24, 3)):
        pool = Together((kills,), (killed_once,))
        expected = [
            f"{k}: {tasks.KILLED}" if k == kills else str(k) for k in range(1, 101)
        ]
        assert told(pool, 100, pool, True) == expected


def test_only_so_much_is_read_ahead_as_keeps_the_processes_busy():
    pool = Deadly()
    read = []
    works = (read.append(work) or work for work in problems(10_000))
    records = tasks.all_records(pool, works, pool, in_order=True)
    for _ in range(10):
        next(records)
    assert len(read) < 1000


def test_behind_one_that_takes_long_more_and_more_are_handed_over_at_once():
    slow = Future()
    sizes = []

    class Slow(Deadly):
        def submit(self, _, works):
            sizes.append(len(works))
            if sum(sizes) == 500:
                slow.set_result(solved(1))
            return slow if works[0].line == 1 else super().submit(_, works)

    pool = Slow()
    assert told(pool, 500, pool, True) == [str(k) for k in range(1, 501)]
    assert len(sizes) < 50


@pytest.mark.parametrize("in_order", [True, False])
def test_inputs_that_a_process_hands_back_are_solved_in_their_order(in_order):
    class Slow(Deadly):
        def submit(self, _, works):
            return super().submit(_, works[: 1 + (works[0].line or 0) % 3])

    pool = Slow(once=(20, 40))
    numbers = [int(text) for text in told(pool, 500, pool, in_order)]
    assert (numbers if in_order else sorted(numbers)) == [*range(1, 501)]


class Stuck(Deadly):
    """A pool in which the first problem takes until all others, or so many, are solved;
    the records are large."""

    max_items = 1

    def __init__(self, until, length):
        super().__init__()
        self.first: Future[Any] = Future()
        self.solved, self.until, self.length = 0, until, length

    def submit(self, _, works):
        if works[0].line == 1:
            return self.first
        self.solved += 1
        if self.solved == self.until:
            self.first.set_result(solved(1))
        future = Future()
        future.set_result(solved(f"{works[0].line}".rjust(self.length)))
        return future


def test_each_record_is_known_at_once_where_no_order_is_kept():
    pool = Stuck(until=999, length=1)
    numbers = [int(text) for text in told(pool, 1000, pool, False)]
    assert numbers.index(1) >= 900
    assert sorted(numbers) == [*range(1, 1001)]


def test_in_order_only_what_has_room_is_solved_behind_one_that_takes_long():
    length = tasks.MAX_BYTES // 100
    pool = Stuck(until=90, length=length)
    assert [int(text) for text in told(pool, 200, pool, True)] == [*range(1, 201)]
    stuck = Stuck(until=1000, length=length)
    held = tasks.all_records(stuck, problems(200), stuck, in_order=True)
    thread = threading.Thread(target=lambda: next(held), daemon=True)
    thread.start()
    end = time.monotonic() + PATIENCE
    while stuck.solved < 95:
        assert time.monotonic() < end
        time.sleep(0.01)
    thread.join(0.2)
    assert stuck.solved <= 105
    stuck.first.set_result(solved(1))


@pytest.mark.parametrize("in_order", [True, False])
def test_ctrl_c_while_a_record_is_written_costs_no_other_one(in_order):
    """Where no order is kept, a record that Ctrl-C has cut is the last one, as a log
    goes on behind those that are finished."""

    class Stopping(Deadly):
        def submit(self, _, works):
            future = Future()
            records = [
                [TaskRecord(str(work.line), "solved", 0, interrupted=work.line == 12)]
                for work in works
            ]
            future.set_result((records, 0.01))
            return future

        def stop(self):
            return True

    pool = Stopping()
    records = tasks.all_records(pool, problems(100), pool, in_order)
    texts = [next(records).text for _ in range(10)]
    texts.append(records.throw(KeyboardInterrupt).text)
    with pytest.raises(KeyboardInterrupt):
        texts.extend(record.text for record in records)
    numbers = range(1, len(texts) + 1)
    expected = sorted(numbers, key=lambda k: k == 12 and not in_order)
    assert texts == list(map(str, expected))
    assert len(texts) > 14  # pieces of 1, 2, 4, 8 problems


def test_columns_of_one_matrix_are_taken_in_parts_and_nothing_beside_them_is_lost():
    single = list(problems(3))
    columns = QColumns(
        ("M.npy", "Q.npy"), np.eye(2), np.ones((2, 150)), [str(j) for j in range(150)]
    )

    works = [single[0], single[1], columns, single[2]]
    ahead = tasks.Ahead(works, threading.Event())
    tasks.reading[-1].join(60)
    assert not ahead.is_at_end
    taken = []
    while together := ahead.take(3):
        taken += together
    assert ahead.is_at_end
    assert [work for work in taken if isinstance(work, Input)] == single
    parts = [work.names for work in taken if isinstance(work, QColumns)]
    assert max(map(len, parts)) == tasks.COLUMNS_TOGETHER
    assert [name for part in parts for name in part] == list(columns.names)


@pytest.mark.slow("starts processes and interrupts them")
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)]
)
def test_interrupted_processes_report_their_best_iterates(number, code, tmp_path):
    """As a single one does; the problem that is solved before them is as it was."""
    log = tmp_path / "log.jsonl"
    options = "--method fixed-point --max-iterations 1000000000 --jobs 2"
    with solving(f"{options} -o {log}") as (process, stdin):
        give(stdin, [*lines(1), *3 * [INFEASIBLE]])
        until(lambda: log.exists() and log.read_bytes().count(b"\n"))
        until(lambda: min(map(seconds_of, started_by(process.pid))) > 2)
        process.send_signal(number)
        _, told = process.communicate(timeout=PATIENCE)
    assert process.returncode == code, told
    statuses = [json.loads(line)["status"] for line in log.read_text().splitlines()]
    assert statuses == ["solved", "interrupted", "interrupted"]
