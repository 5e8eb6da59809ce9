"""`auto` gives the right answer or the right refusal: on the literature's hard problems, in all units, at random."""

from __future__ import annotations

import itertools
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, Status, Trace, solve, write
from lcpcli.errors import OptionError
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.verify.certificate import proves_infeasible

from .. import exact


def answer(M: Any, q: Any, start: Any = None, limit: float = 60.0) -> Any:
    return run(Problem(M, q), "auto", start, limits=Limits(time_limit=limit))


@pytest.mark.parametrize("n", [3, 7, 51])
def test_ben_gharbia_and_gilbert_from_the_cycling_starts(n: int) -> None:
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    for sign in (1, -1):
        result = answer(M, np.ones(n), sign * (np.ones(n) - 2 * np.eye(n)[0]))
        assert (result.solved, result.z.tolist()) == (True, [0.0] * n)


def test_curtis_han_and_robinson_from_every_side_and_kostreva() -> None:
    for start in itertools.product((1, -1), repeat=3):
        result = answer([[4, 5, -5], [5, 9, -5], [-5, -5, 7]], [2.0, 1.0, -3.0], start)
        assert np.allclose(result.z, [0, 4 / 19, 11 / 19], rtol=1e-14, atol=1e-15)
    assert np.allclose(answer([[1, 2, 0], [0, 1, 2], [2, 0, 1]], [-1, -1, -1]).z, 1 / 3, rtol=1e-15)


@pytest.mark.parametrize("n", [10, 200])
def test_murty_and_fathi_where_pivoting_is_exponential(n: int) -> None:
    U = np.eye(n) + 2 * np.triu(np.ones((n, n)), 1)
    for M, solution in ((U, np.eye(n)[-1]), (U.T @ U, np.eye(n)[0])):
        result = answer(M, -np.ones(n))
        assert (result.solved, result.z.tolist()) == (True, solution.tolist())


def test_diagonals_over_twelve_decades_and_hilbert_matrices_are_solved_to_a_small_residual() -> None:
    M = np.diag(10.0 ** np.arange(-6, 7))
    assert np.allclose(answer(M, -M @ np.ones(13)).z, 1, rtol=1e-15)
    for n in (4, 8, 12):
        M = 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
        result = answer(M, -M @ np.ones(n))
        assert result.solved
        assert result.relative_residual <= 1e-14


@pytest.mark.parametrize(
    ("M", "q", "code", "status", "last"),
    [
        ([[0, -1], [1, 0]], [-1, -1], 3, "infeasible", "lemke"),
        ([[0, 1], [1, 0]], [-1, 1], 3, "unsolvable", "exact"),  # though feasible
        ([[0, 1], [0, 0]], [-1, 0], 0, "solved", "exact"),  # though Lemke's method ends on a ray
    ],
)
def test_verdicts_come_with_their_proof_and_reach_the_shell(
    M: Any, q: Any, code: int, status: str, last: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    result = answer(M, q)
    assert (result.status.word, result.route[-1]) == (status, last)
    proof = result.certificate
    if status == "infeasible":
        assert proves_infeasible(result.problem, proof.vector)
    else:
        assert (proof and proof.kind) == (None if result.solved else "exhaustion")
    write(result.problem, tmp_path / "own.json")
    outcome = lcp("solve", str(tmp_path / "own.json"), "--format", "json")
    record = json.loads(outcome.out)
    assert (outcome.code, record["status"], record["route"][-1]) == (code, status, last)
    assert (record["certificate"] is None) is (status == "solved")


@pytest.mark.parametrize("seeds", [range(0, 400, 20), range(4, 404, 20), range(8, 408, 20)])
def test_random_problems_are_decided_as_exact_enumeration_does(seeds: range) -> None:
    for seed in seeds:
        problem = exact.random_problem(seed, 5)
        result = run(problem, "auto", limits=Limits(time_limit=120))
        solvable = exact.solution(problem) is not None
        assert (result.solved, result.status.has_no_solution) == (solvable, not solvable), seed


def test_sparse_infeasible_problems_are_proved_so() -> None:
    """Without entries, with a row of zeros, and the Laplacian of a line, whose columns sum to zero, with a load that
    has nowhere to go."""
    n = 400
    ends = np.full(n, 2.0)
    ends[[0, -1]] = 1.0
    neumann = sparse.diags_array([-np.ones(n - 1), ends, -np.ones(n - 1)], offsets=[-1, 0, 1])
    for M in (sparse.csr_array((n, n)), sparse.diags_array(np.minimum(np.arange(n), 1.0)).tocsr(), neumann):
        assert answer(M, -np.ones(n)).status is Status.INFEASIBLE


OF_HIGHS = ("HiGHS", "THIRD_PARTY_NOTICES")  # in the lines that its version 1.16 prints once in a process


def test_structurally_singular_blocks_print_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    generator = np.random.default_rng(3)
    M = sparse.csr_array(sparse.random_array((300, 300), density=0.01, rng=generator))
    answer(M, generator.standard_normal(300), limit=1.0)
    printed = capfd.readouterr().out.splitlines()
    assert [line for line in printed if not any(word in line for word in OF_HIGHS)] == []


def bimatrix(m: int, seed: int) -> Problem:
    A, B = np.random.default_rng(seed).uniform(1, 2, (2, m, m))
    return Problem(np.block([[np.zeros((m, m)), A], [B.T, np.zeros((m, m))]]), -np.ones(2 * m))


@pytest.mark.parametrize("m", [10, 40])
def test_bimatrix_games_are_solved_by_pure_equilibria_or_paths_of_lemke_and_howson(m: int) -> None:
    routes = {run(bimatrix(m, seed), "auto").route for seed in range(10)}
    assert routes == {("pure",), ("lemke-howson",)}


def test_units_near_the_ends_of_double_range_do_not_look_like_divergence() -> None:
    M = [[0, 0, -2e41], [2e-111, -1e-111, -1e-111], [2e113, 1e113, 0]]
    assert answer(M, [8e41, 4e-111, -2e113]).solved


def test_interrupt_reaches_the_solver_of_programs(tmp_path: Path) -> None:
    problem = bimatrix(60, 0)
    write(problem, tmp_path / "game.json")
    command = [sys.executable, "-m", "lcpcli", "solve", str(tmp_path / "game.json"), "--method", "milp"]
    with subprocess.Popen([*command, "--format", "json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        maps, deadline = Path(f"/proc/{process.pid}/maps"), time.monotonic() + 30.0
        while maps.exists() and "highs" not in maps.read_text() and time.monotonic() < deadline:
            time.sleep(0.05)  # until the solver is loaded, which takes longer where other processes are busy
        time.sleep(0.7)
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert (process.returncode, err) == (130, b"")
    assert json.loads(out)["status"] == "interrupted"


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_scale_and_finish_are_added_to_the_literal_methods_in_the_open(method: str) -> None:
    generator = np.random.default_rng(5)
    factor = generator.standard_normal((20, 20))
    M, q = factor @ factor.T + 20 * np.eye(20), generator.standard_normal(20)
    plain = solve(M, q, method, max_iterations=20000)
    scaled = solve(M, q, method, scale=True, max_iterations=20000)
    ticks, trace = count(), Trace()
    limits, clock = Limits(tol=1e-13), lambda: float(next(ticks))  # so that the time for tries is the same every time
    finished = run(Problem(M, q), method, scale=True, finish=True, limits=limits, trace=trace, clock=clock)
    assert scaled.solved
    assert scaled.iterations < plain.iterations
    assert finished.solved
    assert trace.rows[-1].step == "finish"
    assert (finished.options["scale"], finished.options["finish"]) == (True, True)
    for addition in ("scale", "finish"):
        with pytest.raises(OptionError, match=f"^{addition}: has no effect"):
            solve(M, q, "lemke", **{addition: True})
