"""Many problems in several processes: one that is killed, wherever it is, costs no record."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest

from lcpcli.cli import pools
from lcpcli.cli import workers as tasks
from lcpcli.cli.problems import Inputs
from lcpcli.cli.request import Request
from lcpcli.files.inputs import Input
from lcpcli.methods.variants import Variant

from .conftest import MAIN, python

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the processes are found in /proc")

COMMAND = [sys.executable, "-c", MAIN]
MANY = 400
PATIENCE = 60.0  # seconds until something that must happen has not


def lines(k: int) -> list[str]:
    rng = np.random.default_rng(0)
    every = rng.standard_normal((k, 5, 5)) + 9 * np.eye(5)
    return [json.dumps({"M": M.tolist(), "q": rng.standard_normal(5).tolist()}) for M in every]


def until(holds: Any) -> None:
    """Wait for that."""
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def started_by(pid: int) -> list[int]:
    """The processes that solve problems for another."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in children if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes()]


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


def give(stdin: IO[bytes], problems: list[str], log: Path | None = None) -> None:
    """Write problems to a run, and wait until some are in its log."""
    stdin.write("".join(f"{line}\n" for line in problems).encode())
    stdin.flush()
    until(lambda: log is None or (log.exists() and log.read_bytes().count(b"\n") >= 10))


def items(log: Path) -> list[int]:
    return [json.loads(line)["item"] for line in log.read_text().splitlines()]


def assert_all_solved(process: subprocess.Popen[bytes], told: bytes, log: Path) -> None:
    assert (process.returncode, told.decode()) == (0, f"lcp: {MANY} problems: {MANY} solved\n")
    assert sorted(items(log)) == list(range(1, MANY + 1))


@pytest.mark.slow("starts processes and kills them")
def test_killed_process_costs_no_record_and_no_order(tmp_path: Path) -> None:
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving("--jobs", "2", "-o", str(log)) as (process, stdin):
        give(stdin, problems[:200], log)
        os.kill(started_by(process.pid)[0], signal.SIGKILL)
        give(stdin, problems[200:])
        _, told = process.communicate(timeout=PATIENCE)
    assert_all_solved(process, told, log)


@pytest.mark.slow("starts processes and kills them")
@pytest.mark.parametrize(
    ("jobs", "number", "code"),
    [
        *(("1", signal.SIGKILL, -9), ("2", signal.SIGKILL, -9)),
        *(("1", signal.SIGINT, 130), ("2", signal.SIGINT, 130), ("2", signal.SIGTERM, 143)),
    ],
)
def test_ended_program_leaves_what_is_solved_and_no_process_and_goes_on_from_its_log(
    jobs: str, number: int, code: int, tmp_path: Path
) -> None:
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    with solving("--jobs", jobs, "-o", str(log)) as (process, stdin):
        give(stdin, problems[:200], log)
        others = started_by(process.pid)
        process.send_signal(number)
        _, told = process.communicate(timeout=PATIENCE)
    assert (process.returncode, len(others)) == (code, 2 if jobs == "2" else 0)
    expected = "" if code == -9 else f"lcp: .*; interrupted; go on with --resume {log}\n"
    assert re.fullmatch(expected, told.decode())
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in others))
    assert 10 <= len(set(items(log))) == len(items(log)) < MANY
    with solving("--jobs", jobs, "--resume", str(log)) as (process, stdin):
        _, told = process.communicate("".join(f"{line}\n" for line in problems).encode(), timeout=PATIENCE)
    assert_all_solved(process, told, log)


def torn() -> None:
    """End the process that calls this in the middle of handing over a result."""
    connection = sys._getframe(1).f_locals["connection"]
    os.write(connection.fileno(), b"\0\0\1\0 and no more")
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("is_seen", [True, False])
def test_process_that_dies_while_it_hands_over_a_result_holds_up_nothing(is_seen: bool) -> None:
    pool = pools.Local(2)
    first, idle = pool.submit(os.getpid), pool.submit(time.sleep, PATIENCE)
    assert first.result(PATIENCE)
    future = pool.submit(torn)
    if is_seen:
        assert isinstance(future.exception(PATIENCE), BrokenExecutor)
        assert pool.submit(os.getpid).result(PATIENCE) != first.result()
    else:
        until(lambda: len(multiprocessing.active_children()) < pool.size)
    assert not idle.done()
    pool.close()
    assert not multiprocessing.active_children()


COPIED = """
import os, sys, time
from lcpcli.cli import pools

file, early = open(sys.argv[1], "w"), time.time()
pool = pools.Local(2)
first = pool.submit(eval, "__import__('__main__').early").result()
theirs = pool.submit(os.readlink, f"/proc/self/fd/{file.fileno()}").result()
pool.close()
print(first == early, theirs)
"""


def test_processes_that_are_copies_leave_the_files_of_the_program_alone(tmp_path: Path) -> None:
    assert python(COPIED, str(tmp_path / "file")).stdout == f"True {os.devnull}\n"


def test_work_that_takes_long_comes_back_without_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    task = tasks.Task(Request(Inputs([]), variants=[Variant("auto")]), "json", 20, None)
    works = [Input(("-",), (text.encode(),), line=k) for k, text in enumerate(lines(4), 1)]
    for limit, expected in ((np.inf, [1, 2, 3, 4]), (1e-9, [1])):
        monkeypatch.setattr(tasks, "PIECE_SECONDS", limit)
        assert [json.loads(record.text)["item"] for record in task.all_of(works)[0]] == expected


def scheduler_and_workers(folder: Path) -> list[subprocess.Popen[bytes]]:
    """A Dask scheduler, whose address is in a file, and two workers."""
    python, file = sys.executable, str(folder / "scheduler.json")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", file, "--no-dashboard"]
    scheduler = ["distributed.cli.dask_scheduler", *common, "--port", "0", "--host", "127.0.0.1"]
    worker = ["distributed.cli.dask_worker", *common, "--nthreads", "1", "--no-nanny", "--local-directory", str(folder)]
    return [subprocess.Popen([python, "-m", *each], **quiet) for each in (scheduler, worker, worker)]  # type: ignore[call-overload]


@pytest.mark.slow("starts a cluster")
def test_killed_worker_of_a_cluster_costs_no_record_and_no_order(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    log, problems = tmp_path / "log.jsonl", lines(MANY)
    cluster = scheduler_and_workers(tmp_path)
    try:
        until(lambda: (tmp_path / "scheduler.json").exists())
        until(lambda: (tmp_path / "scheduler.json").read_text().endswith("}"))
        address = json.loads((tmp_path / "scheduler.json").read_text())["address"]
        with solving("--cluster", address, "-o", str(log)) as (process, stdin):
            give(stdin, problems[:200], log)
            cluster[-1].kill()
            give(stdin, problems[200:])
            _, told = process.communicate(timeout=PATIENCE)
        assert_all_solved(process, told, log)
        with solving("--cluster", address, "-o", str(log)) as (process, stdin):
            give(stdin, problems[:200])
            until(lambda: 10 <= log.read_bytes().count(b"\n") < MANY)
            cluster[0].kill()
            _, told = process.communicate("".join(problems).encode(), timeout=PATIENCE)
        assert process.returncode == 2, told.decode()
        assert f"the scheduler at {address} no longer answers" in told.decode()
        assert len(told.splitlines()) == 1
    finally:
        for each in cluster:
            each.kill()
            each.wait()


def test_cluster_without_workers_is_told_of_once_after_a_while(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    pool, workers, now = pools.Cluster.__new__(pools.Cluster), dict[str, int](), [100.0]

    class Client:
        nthreads = staticmethod(lambda: workers)

    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    pool._client, pool._address, pool._has_warned = Client(), "tcp://here:1", False
    pool._began, pool._counted_at = 100.0, -1.0
    for now[0] in (100.0, 105.0):
        pool.look()
    assert (pool.size, capfd.readouterr().err) == (1, "")
    for now[0] in (110.0, 120.0):
        pool.look()
    line = "lcp: --cluster: the scheduler at tcp://here:1 has no workers; start dask worker tcp://here:1\n"
    assert capfd.readouterr().err == line
    workers |= {"a": 2, "b": 1}
    now[0] = 130.0
    pool.look()
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
def test_cluster_that_cannot_be_there_is_told_in_a_line(address: str, fault: str) -> None:
    pytest.importorskip("distributed")
    with solving("--cluster", address) as (process, _):
        _, told = process.communicate(lines(1)[0].encode(), timeout=PATIENCE)
    assert process.returncode == 2
    assert told.decode().startswith(f"lcp: --cluster: {address} {fault}")
    assert len(told.splitlines()) == 1
