"""Times of this checkout and of another one, in pairs: bench.py BASE [--only NAME...]
[--data FOLDER]

    # all rows but those marked "on request"
    python tests/seams/bench.py ../before
    # rows whose names begin with one of these
    python tests/seams/bench.py ../before --only lcp games
    # all names, as no row begins with this
    python tests/seams/bench.py ../before --only ?

Two processes, one for each checkout, take each case in turn, so that what the machine
does besides affects both. A time is processor time of one call. A row has the median of
the ratios of pairs, this checkout's time over the other's, with an interval that
contains the true median in at least 95 of 100 cases, and how many functions one call
calls in either, which does not depend on the machine. The verdict is `slower` if the
interval lies above 1.05, `faster` if it lies below 1/1.05, `same` if it lies below
1.05, otherwise `undecided`. The exit code is 1 if a row is slower, or fails here alone.
"""

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).resolve().parents[2]
# Pairs of a row, and seconds that a measurement should take.
LEAST, MOST, SAMPLE = 12, 200, 0.02
LIMIT, BUDGET = 1.05, 6.0  # a ratio; seconds of a row
Call = Callable[[], Any]


def processor_seconds():
    """Processor time of this process and its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def work():
    """Serve measurements: a line [name, repetitions] is answered by the seconds of a
    call."""
    from bench_rows import rows

    import lcpcli

    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    folder, *data = map(Path, sys.argv[2:])
    table = rows(folder, data)

    def reply(answer):
        print(json.dumps(answer), file=replies, flush=True)

    reply({"names": list(table), "path": lcpcli.__file__})
    prepared = {}
    for line in sys.stdin:
        name, repetitions = json.loads(line)
        try:
            if name not in prepared:
                prepared = {name: table[name]()}
                prepared[name]()  # imports, and kernels that are compiled
            call = prepared[name]
            if not repetitions:
                reply(calls(call))
                continue
            start = processor_seconds()
            for _ in range(repetitions):
                call()
            reply((processor_seconds() - start) / repetitions)
        # Reported as a row, as the other checkout may be able to do it.
        except Exception as error:
            reply(f"{type(error).__name__}: {error}")


def calls(call):
    """How many functions, of Python or of C, a call of this function calls."""
    count = itertools.count()
    sys.setprofile(
        lambda _, event, __: next(count) if event in ("call", "c_call") else None
    )
    try:
        call()
    finally:
        sys.setprofile(None)
    return next(count)


class Worker:
    """A process that measures a checkout."""

    def __init__(self, checkout, folder, data):
        settings = {
            "PYTHONPATH": str(checkout),
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
        }
        command = [sys.executable, __file__, "--work", str(folder), *map(str, data)]
        self._process: Any = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | settings,
            cwd=folder,
        )
        first = self._answer()
        self.names: list[str] = first["names"]
        if not Path(first["path"]).resolve().is_relative_to(checkout):
            sys.exit(
                f"bench.py: {checkout} has no lcpcli: {first['path']} was imported"
            )

    def ask(self, name, repetitions):
        """Seconds of a call; for 0 repetitions the number of functions called; a text
        if the case fails."""
        print(json.dumps([name, repetitions]), file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self):
        line = self._process.stdout.readline()
        if not line:
            sys.exit("bench.py: a process has ended early")
        return json.loads(line)

    def end(self):
        self._process.stdin.close()
        self._process.wait()


def pairs(name, own, base):
    """Times of both checkouts in turn, each first in half of the pairs, until the time
    is spent."""
    once = max(min(base.ask(name, 1) for _ in range(2)), 1e-6)
    repetitions, start = max(1, round(SAMPLE / once)), time.monotonic()
    for k in range(MOST):
        if k >= LEAST and time.monotonic() - start > BUDGET:
            return
        times = {
            worker: worker.ask(name, repetitions)
            for worker in ((own, base) if k % 2 else (base, own))
        }
        yield times[own], times[base]


def verdict(low, high):
    """What the interval of the ratio says."""
    if high < LIMIT:
        return "faster" if high < 1 / LIMIT else "same"
    return "slower" if low > LIMIT else "undecided"


def row(name, own, base):
    """Measure and print a row; return its verdict."""
    counts = [worker.ask(name, 0) for worker in (own, base)]
    if failures := [count for count in counts if isinstance(count, str)]:
        word = (
            "fails"
            if isinstance(counts[0], str) and not isinstance(counts[1], str)
            else "not compared"
        )
        print(f"{name:34} {word}: {failures[0]}", flush=True)
        return word
    from lcpcli.bench.record import median_interval

    times = list(pairs(name, own, base))
    ratios = [mine / other for mine, other in times]
    low, high = median_interval(ratios)
    word = verdict(low, high)
    mine, other = (1e3 * median(column) for column in zip(*times, strict=True))
    numbers = (
        f"{mine:10.4g} {other:10.4g} {median(ratios):7.3f}  [{low:.3f}, {high:.3f}] "
        f"{len(times):4}"
    )
    print(f"{name:34} {numbers} {counts[0]:8} {counts[1]:8}  {word}", flush=True)
    return word


def main():
    """Print the rows that are asked for, and how many have each verdict."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("base", type=Path, help="the other checkout")
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NAME",
        help="rows whose names begin with one of these",
    )
    parser.add_argument("--data", type=Path, help="a folder of MPS files, each a row")
    arguments = parser.parse_args()
    data = (
        sorted(path.resolve() for path in arguments.data.glob("*.mps"))
        if arguments.data
        else []
    )
    with tempfile.TemporaryDirectory() as name:
        own, base = (
            Worker(path.resolve(), Path(name), data) for path in (HERE, arguments.base)
        )
        starts = tuple(arguments.only or ())
        chosen = [
            row
            for row in own.names
            if (row.startswith(starts) if starts else not row.startswith("on request"))
        ]
        if not chosen:
            names = "\n".join(own.names)
            sys.exit(
                f"no row begins with {' or '.join(starts)}, but these do:\n{names}"
            )
        head = (
            f"{'this ms':>10} {'base ms':>10} {'ratio':>7}  {'interval':14} "
            f"{'pairs':>5} {'calls':>8} {'base':>8}"
        )
        print(f"{'row':34} {head}  verdict", flush=True)
        words = [row(each, own, base) for each in chosen]
        own.end()
        base.end()
    print(", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words)))
    return int("slower" in words or "fails" in words)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        work()
    else:
        sys.path.insert(0, str(HERE))  # for the interval of a median
        sys.exit(main())
