"""Times of this checkout and of another one, in pairs: bench.py BASE [--only NAME...] [--data FOLDER] [--list]

    python tests/seams/bench.py ../before                    # all rows but those marked "on request"
    python tests/seams/bench.py ../before --only lcp games   # rows whose names begin with one of these
    python tests/seams/bench.py ../before --list             # the names

Two processes, one for each checkout, take each case in turn, so that what the machine does besides affects both. A time
is processor time of one call. A row has the median of the ratios of pairs, this checkout's time over the other's, with
an interval that contains the true median in at least 95 of 100 cases, and how many functions one call calls in either,
which does not depend on the machine. The verdict is `slower` if the interval lies above 1.05, `faster` if it lies below
1/1.05, `same` if it lies below 1.05, otherwise `undecided`. The exit code is 1 if a row is slower, or fails here alone.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parents[2]
LEAST, MOST, SAMPLE = 12, 200, 0.02  # pairs of a row, and seconds that a measurement should take
LIMIT = 1.05
Call = Callable[[], Any]
PROGRAMS = [(name, n) for name in ("lp", "qp", "portfolio", "lasso", "control", "transport") for n in (20, 60, 200)]
PROGRAMS += [("frontier", n) for n in (20, 60)]


def made(folder: Path, family: str, n: int, *parameters: str) -> Any:
    """Read a problem of the gallery, which the first process that needs it has written."""
    import lcpcli

    path = folder / f"{'-'.join((family, str(n), *parameters))}.npz"
    if not path.exists():
        settings = [part for parameter in parameters for part in ("--set", parameter)]
        command = [sys.executable, "-m", "lcpcli", "make", family, "-n", str(n), *settings, "-o", str(path)]
        subprocess.run(command, check=True)
    return lcpcli.read(path)


def rows(folder: Path, data: list[Path]) -> dict[str, Callable[[], Call]]:
    """Functions that prepare what is measured, by name."""
    import lcpcli

    def of_family(family: str, n: int, *parameters: str, **options: Any) -> Callable[[], Call]:
        def prepare() -> Call:
            problem = made(folder, family, n, *parameters)
            return lambda: lcpcli.run(problem, **options)

        return prepare

    def arrays(n: int, **options: Any) -> Callable[[], Call]:
        def prepare() -> Call:
            M, q = random_lcp(n)
            return lambda: lcpcli.solve(M, q, **options)

        return prepare

    def of_file(path: Path, **options: Any) -> Callable[[], Call]:
        def prepare() -> Call:
            problem = lcpcli.read(path)
            return lambda: lcpcli.run(problem, **options)

        return prepare

    def many(columns: int, **options: Any) -> Callable[[], Call]:
        def prepare() -> Call:
            M, _ = random_lcp(10)
            Q = np.random.default_rng(1).normal(size=(10, columns))
            return lambda: list(lcpcli.solve_many(M, Q, **options))

        return prepare

    def batch() -> Call:
        problems = [random_lcp(10, seed) for seed in range(200)]
        M, q = (np.array(part) for part in zip(*problems, strict=True))
        return lambda: lcpcli.solve_many(M, q).z

    def solver(family: str, n: int, *parameters: str, step: float = 0.01) -> Callable[[], Call]:
        def prepare() -> Call:
            problem = made(folder, family, n, *parameters)
            steps = problem.q[:, None] * (1 + step * np.random.default_rng(2).normal(size=(problem.n, 20)))

            def call() -> None:
                own = lcpcli.Solver(problem.M)
                for q in steps.T:
                    own.solve(q)

            return call

        return prepare

    def game(n: int, all_equilibria: bool = False) -> Callable[[], Call]:
        def prepare() -> Call:
            A, B = np.random.default_rng(n).integers(-50, 51, (2, n, n)).astype(float)
            if all_equilibria:
                return lambda: list(lcpcli.solutions(lcpcli.from_game(A, B)))
            return lambda: lcpcli.run(lcpcli.from_game(A, B))

        return prepare

    def exact(family: str, n: int) -> Callable[[], Call]:
        def prepare() -> Call:
            problem = made(folder, family, n)
            return lambda: lcpcli.exact(lcpcli.Problem(problem.M, problem.q))

        return prepare

    def command(*words: str) -> Callable[[], Call]:
        whole = [sys.executable, "-m", "lcpcli", *words]
        return lambda: lambda: subprocess.run(whole, check=True, stdout=subprocess.DEVNULL)

    table: dict[str, Callable[[], Call]] = {}
    for n in (4, 10, 50, 300):
        table[f"lcp {n}"] = arrays(n)
        table[f"lcp {n} compiled"] = arrays(n, compiled=True)
        table[f"lcp {n} loop"] = arrays(n, trace=True)
    table["boxes 10"], table["boxes 10 compiled"] = of_family("boxes", 10), of_family("boxes", 10, compiled=True)
    for n in (20, 100):
        table[f"contact {n} at rest"] = of_family("rigid-boxes", n, "kind=tower")
        table[f"contact {n} at rest compiled"] = of_family("rigid-boxes", n, "kind=tower", compiled=True)
        table[f"contact {n} moving"] = of_family("contact", n)
        table[f"contact {n} moving compiled"] = of_family("contact", n, compiled=True)
    for name, n in PROGRAMS:
        table[f"program {name} {n}"] = of_family(name, n)
    for name in ("lp", "qp", "portfolio", "control", "lasso", "transport"):
        table[f"program {name} 200 compiled"] = of_family(name, 200, compiled=True)
    for path in data:
        table[f"program {path.stem}"] = of_file(path, compiled=True)
    table["obstacle 100 x 100"] = of_family("obstacle", 10_000)
    table["solve_many 200 columns"], table["solve_many 2000 columns"] = many(200, compiled=False), many(2000)
    table["solve_many batch of 200"] = batch
    table["Solver 50"] = solver("harker-pang", 50)
    table["Solver contact"] = solver("rigid-boxes", 30, "kind=tower")
    table["Solver obstacle"] = solver("obstacle", 400)
    table["start-up"] = command("solve", "paper-example-1", "--format", "json")
    table["start-up of help"] = command("solve", "--help")
    for n in (5, 20):
        table[f"games {n} x {n}"] = game(n)
    table["games 6 x 6 all equilibria"] = game(6, True)
    table["games poker"] = of_family("poker", 30)
    for n in (12, 16, 20):
        table[f"exact {n}"] = exact("harker-pang", n)
    table["on request: obstacle 1000 x 1000"] = of_family("obstacle", 1_000_000)
    return table


def random_lcp(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """M positive definite, not symmetric, and q."""
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(2, n, n))
    return A @ A.T + B - B.T + np.eye(n), 3 * random.normal(size=n)


def processor_seconds() -> float:
    """Processor time of this process and its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def work() -> None:
    """Serve measurements: a line [name, repetitions] is answered by the seconds of a call."""
    import lcpcli

    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    folder, *data = map(Path, sys.argv[2:])
    table = rows(folder, data)

    def reply(answer: Any) -> None:
        print(json.dumps(answer), file=replies, flush=True)

    reply({"names": list(table), "path": lcpcli.__file__})
    prepared: dict[str, Call] = {}
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
        except Exception as error:  # reported as a row, as the other checkout may be able to do it
            reply(f"{type(error).__name__}: {error}")


def calls(call: Call) -> int:
    """How many functions, of Python or of C, a call of this function calls."""
    count = itertools.count()
    sys.setprofile(lambda _, event, __: next(count) if event in ("call", "c_call") else None)
    try:
        call()
    finally:
        sys.setprofile(None)
    return next(count)


class Worker:
    """A process that measures a checkout."""

    def __init__(self, checkout: Path, folder: Path, data: list[Path]) -> None:
        settings = {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        command = [sys.executable, __file__, "--work", str(folder), *map(str, data)]
        self._process: Any = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ | settings, cwd=folder
        )
        first = self._answer()
        self.names: list[str] = first["names"]
        if not Path(first["path"]).resolve().is_relative_to(checkout):
            sys.exit(f"bench.py: {checkout} has no lcpcli: {first['path']} was imported")

    def ask(self, name: str, repetitions: int) -> Any:
        """Seconds of a call; for 0 repetitions the number of functions called; a text if the case fails."""
        print(json.dumps([name, repetitions]), file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self) -> Any:
        line = self._process.stdout.readline()
        if not line:
            sys.exit("bench.py: a process has ended early")
        return json.loads(line)

    def end(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def interval(ratios: list[float]) -> tuple[float, float]:
    """Bounds on the median by order statistics, which hold with a probability of at least 0.95."""
    ordered, n = sorted(ratios), len(ratios)
    tail, k = 0.0, 0
    while (tail := tail + math.comb(n, k) / 2**n) <= 0.025:
        k += 1
    return ordered[max(k - 1, 0)], ordered[min(n - k, n - 1)]


def pairs(name: str, own: Worker, base: Worker, budget: float) -> Iterator[tuple[float, float]]:
    """Times of both checkouts in turn, each first in half of the pairs, until the time is spent."""
    once = max(min(base.ask(name, 1) for _ in range(2)), 1e-6)
    repetitions, start = max(1, round(SAMPLE / once)), time.monotonic()
    for k in range(MOST):
        if k >= LEAST and time.monotonic() - start > budget:
            return
        times = {worker: worker.ask(name, repetitions) for worker in ((own, base) if k % 2 else (base, own))}
        yield times[own], times[base]


def verdict(low: float, high: float) -> str:
    """What the interval of the ratio says."""
    if high < LIMIT:
        return "faster" if high < 1 / LIMIT else "same"
    return "slower" if low > LIMIT else "undecided"


def row(name: str, own: Worker, base: Worker, budget: float) -> str:
    """Measure and print a row; return its verdict."""
    counts = [worker.ask(name, 0) for worker in (own, base)]
    if failures := [count for count in counts if isinstance(count, str)]:
        word = "fails" if isinstance(counts[0], str) and not isinstance(counts[1], str) else "not compared"
        print(f"{name:34} {word}: {failures[0]}", flush=True)
        return word
    times = list(pairs(name, own, base, budget))
    ratios = [mine / other for mine, other in times]
    low, high = interval(ratios)
    word = verdict(low, high)
    mine, other = (1e3 * median(column) for column in zip(*times, strict=True))
    numbers = f"{mine:10.4g} {other:10.4g} {median(ratios):7.3f}  [{low:.3f}, {high:.3f}] {len(times):4}"
    print(f"{name:34} {numbers} {counts[0]:8} {counts[1]:8}  {word}", flush=True)
    return word


def main() -> int:
    """Print the rows that are asked for, and how many have each verdict."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=Path, help="the other checkout")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="rows whose names begin with one of these")
    parser.add_argument("--data", type=Path, help="a folder of MPS files, each a row")
    parser.add_argument("--budget", type=float, default=6.0, help="seconds for each row (default 6)")
    parser.add_argument("--list", action="store_true", help="print the names of the rows")
    arguments = parser.parse_args()
    data = sorted(path.resolve() for path in arguments.data.glob("*.mps")) if arguments.data else []
    with tempfile.TemporaryDirectory() as name:
        own, base = (Worker(path.resolve(), Path(name), data) for path in (HERE, arguments.base))
        starts = tuple(arguments.only or ())
        chosen = [row for row in own.names if (row.startswith(starts) if starts else not row.startswith("on request"))]
        if not chosen:
            sys.exit(f"bench.py: no row begins with {' or '.join(starts)}; --list shows them")
        if arguments.list:
            print("\n".join(own.names))
            return 0
        head = f"{'this ms':>10} {'base ms':>10} {'ratio':>7}  {'interval':14} {'pairs':>5} {'calls':>8} {'base':>8}"
        print(f"{'row':34} {head}  verdict", flush=True)
        words = [row(each, own, base, arguments.budget) for each in chosen]
        own.end()
        base.end()
    print(", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words)))
    return int("slower" in words or "fails" in words)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        work()
    else:
        sys.exit(main())
