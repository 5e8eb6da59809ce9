"""The number of BLAS threads: one by default, in a command from the start, in a program
for the duration of a call; and threads that solve at once, whose results are those of
one thread, to the last bit.
"""

import contextlib
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import cycle, islice
from threading import Barrier, Event, Thread

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.cli import problems as cli
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.linalg import threads
from lcpcli.linalg.threads import limited

EXAMPLE = contents.shipped_path("paper-example-1.json")


@pytest.fixture
def clean(monkeypatch):
    """An environment that says nothing about threads, and is read anew."""
    monkeypatch.setattr(threads, "in_environment", threads.in_environment.__wrapped__)
    for name in threads.VARIABLES:
        monkeypatch.delenv(name, raising=False)


def python(code, *arguments):
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.usefixtures("clean")
@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, ["1", "1", "1", "1", "1"]),
        ({"OPENBLAS_NUM_THREADS": "3"}, ["3", "1", "1", "1", "1"]),
        ({"MKL_NUM_THREADS": "4", "BLIS_NUM_THREADS": ""}, ["1", "4", "1", "1", "1"]),
        ({"OMP_NUM_THREADS": "5"}, [None, None, None, None, "5"]),
    ],
)
def test_command_keeps_what_the_environment_says(given, found, monkeypatch):
    monkeypatch.setattr("os.environ", {**os.environ, **given})
    cli.settle_threads([])
    assert [os.environ.get(name) for name in threads.VARIABLES] == found


@pytest.mark.usefixtures("clean")
def test_very_large_file_leaves_the_number_to_the_blas(monkeypatch, tmp_path):
    monkeypatch.setattr("os.environ", dict(os.environ))
    file = tmp_path / "large.npz"
    for size, number in ((cli.LARGE_FILE, None), (cli.LARGE_FILE - 1, 1)):
        with file.open("wb") as large:
            large.truncate(size)
        cli.settle_threads([str(tmp_path / "missing.json"), str(file)])
        assert threads.in_environment() == number


@pytest.mark.usefixtures("clean")
def test_bench_records_the_number_and_is_resumed_with_the_same(lcp, tmp_path):
    file = tmp_path / "r.json"
    lcp(f"bench {EXAMPLE} --method newton --budget 0 --threads 2 -q -o {file}")
    record = json.loads(file.read_text())
    assert record["machine"]["threads"] == 2
    assert "2 threads" in lcp(f"bench --resume {file}").out
    file.write_text(json.dumps({**record, "measurements": []}))
    assert (
        "was measured with threads 2, not 1; give --threads 2"
        in lcp(f"bench --resume {file}").err
    )
    assert lcp(f"bench --resume {file} --threads 2 -q").code == 0


@pytest.fixture
def numbers(clean, monkeypatch):  # noqa: ARG001
    """The numbers to which threads are limited, where 150 rows are many."""
    found = []

    @contextlib.contextmanager
    def limited(number):
        found.append(number)
        yield

    monkeypatch.setattr(threads, "limited", limited)
    monkeypatch.setattr(threads, "MANY_ROWS", 150)
    return found


def solve(n, form=np.asarray, **options):
    assert lcpcli.solve(form(2 * np.eye(n)), -np.ones(n), "newton", **options).solved


@pytest.mark.parametrize(
    ("form", "limits"),
    [
        (np.asarray, {99: [], 100: [1], 149: [1], 150: []}),
        (sparse.csr_array, {99: [], 150: [1]}),
    ],
)
def test_one_thread_where_the_blas_would_use_more_and_they_do_not_pay(
    form, limits, numbers
):
    for n, limit in limits.items():
        solve(n, form)
        assert numbers == limit
        numbers.clear()


@pytest.mark.parametrize("n", [2, 200])
def test_number_that_the_caller_gives_is_used(n, numbers):
    pytest.importorskip("threadpoolctl")
    solve(n, threads=3)
    lcpcli.run(Problem(np.eye(n), -np.ones(n)), "shi", threads=2)
    assert numbers == [3, 2]


@pytest.mark.parametrize("name", threads.VARIABLES)
def test_program_keeps_what_the_environment_says(name, numbers, monkeypatch):
    monkeypatch.setenv(name, "2")
    solve(149)
    assert numbers == []


@pytest.mark.usefixtures("clean")
def test_number_is_limited_in_the_blas_of_numpy_and_of_scipy_and_put_back():
    """A small problem does not even load threadpoolctl."""
    info = pytest.importorskip("threadpoolctl").threadpool_info
    processors = (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count()
    )
    if processors == 1 or not any(each["user_api"] == "blas" for each in info()):
        pytest.skip("one thread in any case")
    code = """
import sys
import numpy as np
import lcpcli
from lcpcli.linalg import factors, threads

lcpcli.solve(2 * np.eye(99), -np.ones(99))
assert "threadpoolctl" not in sys.modules
lcpcli.solve(2 * np.eye(100), -np.ones(100))
assert "threadpoolctl" in sys.modules
from threadpoolctl import threadpool_info

def numbers():
    return {
        each["num_threads"]
        for each in threadpool_info()
        if each["user_api"] == "blas"
    }

before = numbers()
with threads.limited(1):
    assert numbers() == {1}
    factors.checked_solver(np.eye(300))
    assert numbers() == {1}, "that of scipy too"
assert before != {1}
assert numbers() == before
with threads.limited(1):
    assert numbers() == {1}
    with threads.limited(2):
        assert numbers() == {1}, "the outermost one decides"
try:
    lcpcli.run(lcpcli.Problem(np.eye(300), -np.ones(300)), "newton", omega=1)
except lcpcli.errors.OptionError:
    assert numbers() == before
else:
    raise AssertionError
"""
    done = python(code)
    assert done.returncode == 0
    assert done.stderr == ""


@pytest.mark.slow("a process of its own")
@pytest.mark.usefixtures("clean")
def test_without_threadpoolctl_only_a_given_number_is_refused():
    code = """
import sys
sys.modules["threadpoolctl"] = None
import numpy as np
import lcpcli
print(lcpcli.solve(2 * np.eye(150), -np.ones(150)).solved)
try:
    lcpcli.solve([[1]], [-1], threads=1)
except lcpcli.errors.OptionError as error:
    print(error)
"""
    told = "threads: needs threadpoolctl; pip install threadpoolctl"
    assert python(code).stdout == f"True\n{told}\n"


PROBLEMS = 25
# Some M are so large that calls limit the threads of the BLAS, and the factors of the
# largest are kept.
FAMILIES = {
    "harker-pang": (6, 120, 220),
    "near-singular": (8, 210),
    "bimatrix": (4,),
    "obstacle": (100,),
}


def problems(seed):
    """Problems of several kinds: solvable, infeasible, mixed, programs, games,
    sparse."""
    random = np.random.default_rng(seed)
    of_families = [
        families.make(name, n, seed) for name, sizes in FAMILIES.items() for n in sizes
    ]
    A, q = random.standard_normal((8, 8)), random.standard_normal(8)
    own = [
        Problem(A @ A.T, q, lower=-1.0, upper=np.where(q < 0, 0.5, np.inf)),
        Problem(csr_array(A @ A.T * (np.abs(A) > 1) + 50 * np.eye(8)), q),
        lcpcli.from_qp(A @ A.T, q, A[:2], row_lower=np.zeros(2)),
        lcpcli.from_game(random.random((3, 2)), random.random((3, 2))),
        Problem([[0, 1], [0, -1]], [-2, 1]),
    ]
    return [*of_families, *own]


def solved(given, together=None):
    """What many calls return, without their times."""
    found = []
    if together is not None:
        together.wait(20)
    for problem in islice(cycle(given), PROBLEMS):
        result = lcpcli.run(problem)
        found.append(
            (
                result.status,
                result.message,
                result.route,
                result.iterations,
                result.z.tobytes(),
            )
        )
        if result.solved and problem.n > 200 and not problem.is_mixed:
            gradient = result.gradient(np.ones(problem.n))
            found.append((gradient.kinks, gradient.q.tobytes()))
    return found


@pytest.mark.parametrize(
    "seeds", [(0, 1), (0, 0)], ids=["problems apart", "the same problems"]
)
def test_results_of_two_threads_are_those_of_one(seeds):
    one, other = problems(0), problems(1)
    given = [(one, other)[seed] for seed in seeds]
    # For small problems too, which older versions of OpenBLAS share among threads.
    with limited(1):
        solved(one)  # loads everything
        alone, together = list(map(solved, given)), Barrier(2)
        with ThreadPoolExecutor(2) as threads:
            assert list(threads.map(solved, given, (together, together))) == alone


def test_smallest_number_counts_until_the_last_thread_is_done():
    controller = pytest.importorskip("threadpoolctl").ThreadpoolController

    def numbers():
        return {
            each["num_threads"]
            for each in controller().info()
            if each["user_api"] == "blas"
        }

    def other(entered, ending):
        with limited(1):
            entered.set()
            ending.wait(20)

    before, events = numbers(), [(Event(), Event()) for _ in range(2)]
    one, last = (Thread(target=other, args=pair) for pair in events)
    with limited(2):
        if numbers() != {2}:
            pytest.skip("no BLAS whose threads can be limited")
        for thread, (entered, ending) in zip((one, last), events, strict=True):
            thread.start()
            entered.wait(20)
            assert numbers() == {1}
            if thread is one:
                ending.set()
                thread.join()
                assert numbers() == {2}
    assert numbers() == {1}, "the other thread is not done"
    with limited(2):
        assert numbers() == {1}, "though more are asked for after it"
    ending.set()
    last.join()
    assert numbers() == before


@pytest.mark.usefixtures("clean")
@pytest.mark.parametrize("shape", [(120, 30), (300, 100)])
def test_fits_use_one_thread_as_all_other_calls_do(shape, monkeypatch):
    asked = []

    @contextlib.contextmanager
    def noted(number):
        asked.append(number)
        yield

    monkeypatch.setattr(threads, "limited", noted)
    rng = np.random.default_rng(0)
    A, b = rng.standard_normal(shape), rng.standard_normal(shape[0])
    calls = {
        "nnls": lambda: lcpcli.nnls(A, b),
        "lsq": lambda: lcpcli.lsq(A, b, 0, 1),
        "many": lambda: lcpcli.nnls(A, np.column_stack((b, -b))),
    }
    for name, call in calls.items():
        asked.clear()
        call()
        assert set(asked) == {1}, name
    result = lcpcli.nnls(A, b)
    asked.clear()
    assert result.answer.norm > 0
    assert set(asked) == {1}
