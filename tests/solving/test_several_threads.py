"""Threads that solve at once: the results are those of one thread, to the last bit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import cycle, islice
from threading import Barrier, Event, Thread
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.gallery import families
from lcpcli.linalg.threads import limited

PROBLEMS = 50
# Some M are so large that calls limit the threads of the BLAS, and the factors of the largest are kept.
FAMILIES = {"harker-pang": (6, 120, 220), "near-singular": (8, 210), "bimatrix": (4,), "obstacle": (100,)}


def problems(seed: int) -> list[Problem]:
    """Problems of several kinds: solvable, infeasible, mixed, programs, games, sparse."""
    random = np.random.default_rng(seed)
    of_families = [families.make(name, n, seed) for name, sizes in FAMILIES.items() for n in sizes]
    A, q = random.standard_normal((8, 8)), random.standard_normal(8)
    own = [
        Problem(A @ A.T, q, lower=-1.0, upper=np.where(q < 0, 0.5, np.inf)),
        Problem(csr_array(A @ A.T * (np.abs(A) > 1) + 50 * np.eye(8)), q),
        lcpcli.from_qp(A @ A.T, q, A[:2], row_lower=np.zeros(2)),
        lcpcli.from_game(random.random((3, 2)), random.random((3, 2))),
        Problem([[0, 1], [0, -1]], [-2, 1]),
    ]
    return [*of_families, *own]


def solved(given: list[Problem], together: Barrier | None = None) -> list[Any]:
    """What many calls return, without their times."""
    found: list[Any] = []
    if together is not None:
        together.wait(20)
    for problem in islice(cycle(given), PROBLEMS):
        result = lcpcli.run(problem)
        found.append((result.status, result.message, result.route, result.iterations, result.z.tobytes()))
        if result.solved and problem.n > 200 and not problem.is_mixed:
            gradient = result.gradient(np.ones(problem.n))
            found.append((gradient.kinks, gradient.q.tobytes()))
    return found


@pytest.mark.parametrize("seeds", [(0, 1), (0, 0)], ids=["problems apart", "the same problems"])
def test_results_of_two_threads_are_those_of_one(seeds: tuple[int, int]) -> None:
    one, other = problems(0), problems(1)
    given = [(one, other)[seed] for seed in seeds]
    with limited(1):  # for small problems too, which older versions of OpenBLAS share among threads
        solved(one)  # loads everything
        alone, together = list(map(solved, given)), Barrier(2)
        with ThreadPoolExecutor(2) as threads:
            assert list(threads.map(solved, given, (together, together))) == alone


def test_smallest_number_counts_until_the_last_thread_is_done() -> None:
    controller = pytest.importorskip("threadpoolctl").ThreadpoolController

    def numbers() -> set[int]:
        return {each["num_threads"] for each in controller().info() if each["user_api"] == "blas"}

    def other(entered: Event, ending: Event) -> None:
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
