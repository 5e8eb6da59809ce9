"""`auto` gives the right answer or the right refusal: on the literature's hard problems, in all units, at random."""

from __future__ import annotations

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

from lcpcli import Problem, Status, Trace, read, solve, write
from lcpcli.files import contents
from lcpcli.gallery import families as gallery
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.verify.certificate import proves_infeasible

from .. import exact

CURTIS = [[4.0, 5.0, -5.0], [5.0, 9.0, -5.0], [-5.0, -5.0, 7.0]]


def murty(n: int) -> np.ndarray:
    return np.eye(n) + 2 * np.triu(np.ones((n, n)), 1)


def unit(i: int, n: int) -> np.ndarray:
    return np.eye(n)[i]


def answer(M: Any, q: Any, start: Any = None, limit: float = 60.0) -> Any:
    return run(Problem(M, q), "auto", start, limits=Limits(time_limit=limit))


@pytest.mark.parametrize("n", [3, 7, 51])
@pytest.mark.parametrize("sign", [1, -1])
def test_ben_gharbia_and_gilbert_from_the_cycling_starts(n: int, sign: int) -> None:
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    start = sign * (np.ones(n) - 2 * unit(0, n))
    result = answer(M, np.ones(n), start)
    assert result.solved
    assert np.array_equal(result.z, np.zeros(n))


@pytest.mark.parametrize("start", [[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1], [1, 1, -1], [-1, -1, -1]])
def test_curtis_han_and_robinson_from_every_side(start: list[int]) -> None:
    result = answer(CURTIS, [2.0, 1.0, -3.0], start)
    assert np.allclose(result.z, [0, 4 / 19, 11 / 19], rtol=1e-14, atol=1e-15)


def test_kostreva() -> None:
    assert np.allclose(answer([[1, 2, 0], [0, 1, 2], [2, 0, 1]], [-1, -1, -1]).z, 1 / 3, rtol=1e-15)


@pytest.mark.parametrize("n", [10, 200])
def test_murty_and_fathi_where_pivoting_is_exponential(n: int) -> None:
    U = murty(n)
    for M, solution in ((U, unit(n - 1, n)), (U.T @ U, unit(0, n))):
        result = answer(M, -np.ones(n))
        assert result.solved
        assert np.array_equal(result.z, solution)


def test_growth_of_two_to_the_forty() -> None:
    n = 40
    assert np.array_equal(answer(np.eye(n) - np.tril(np.ones((n, n)), -1), -np.ones(n)).z, 2.0 ** np.arange(n))


def test_diagonal_over_twelve_decades() -> None:
    M = np.diag(10.0 ** np.arange(-6, 7))
    assert np.allclose(answer(M, -M @ np.ones(13)).z, 1, rtol=1e-15)


@pytest.mark.parametrize("n", [4, 8, 12])
def test_hilbert_matrices_are_solved_to_a_small_residual(n: int) -> None:
    M = 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    result = answer(M, -M @ np.ones(n))
    assert result.solved
    assert result.relative_residual <= 1e-14


def test_solvable_problem_on_which_lemke_ends_on_a_ray() -> None:
    result = answer([[0, 1], [0, 0]], [-1, 0])
    assert result.solved
    assert result.route[-1] == "exact"


def test_feasible_problem_without_solution_is_proved_to_have_none() -> None:
    result = answer([[0, 1], [1, 0]], [-1, 1])
    assert result.status is Status.UNSOLVABLE
    assert result.certificate.kind == "exhaustion"
    assert result.route == ("exact",)


def test_infeasible_problem_comes_with_farkas_vector() -> None:
    problem = Problem([[0, -1], [1, 0]], [-1, -1])
    result = run(problem, "auto")
    assert result.status is Status.INFEASIBLE
    assert result.certificate.vector is not None
    assert proves_infeasible(problem, result.certificate.vector)


def test_bimatrix_game_ends_at_an_equilibrium() -> None:
    problem = read(contents.shipped_path("bimatrix.json"))
    result = run(problem, "auto")
    assert result.solved
    assert result.error is not None
    assert result.error <= 1e-15


@pytest.mark.parametrize("seed", range(0, 400, 4))
def test_random_problems_are_decided_as_exact_enumeration_does(seed: int) -> None:
    problem = exact.random_problem(seed, 5)
    result = run(problem, "auto", limits=Limits(time_limit=20))
    solvable = exact.solution(problem) is not None
    assert (result.solved, result.status.has_no_solution) == (solvable, not solvable)


@pytest.mark.parametrize("seed", range(10))
def test_answer_does_not_depend_on_units_or_order(seed: int) -> None:
    generator = np.random.default_rng(seed)
    factor, skew = generator.standard_normal((2, 6, 6))
    M, q = factor @ factor.T + 0.1 * np.eye(6) + skew - skew.T, generator.standard_normal(6)
    z = answer(M, q).z
    R, C = 10.0 ** generator.uniform(-8, 8, (2, 6))
    t = 10.0 ** generator.uniform(-100, 100)
    order = generator.permutation(6)
    assert np.allclose(C * answer(R[:, None] * M * C, R * q).z, z, rtol=1e-9, atol=1e-12)
    assert np.allclose(answer(M, t * q).z / t, z, rtol=1e-12, atol=1e-14)
    assert np.allclose(answer(M[order][:, order], q[order]).z, z[order], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("n", [50, 400])
def test_sparse_and_dense_answers_agree(n: int) -> None:
    S = sparse.diags_array([-np.ones(n - 1), 4 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    q = np.random.default_rng(n).standard_normal(n)
    from_sparse, from_dense = answer(S, q), answer(S.toarray(), q)
    assert from_sparse.solved
    assert np.allclose(from_sparse.z, from_dense.z, rtol=0, atol=1e-9)


def no_entries(n: int) -> tuple[Any, np.ndarray]:
    return sparse.csr_array((n, n)), -np.ones(n)


def row_of_zeros(n: int) -> tuple[Any, np.ndarray]:
    M = sparse.eye_array(n, format="lil")
    M[0, 0] = 0.0
    return sparse.csr_array(M), -np.ones(n)


def neumann(n: int) -> tuple[Any, np.ndarray]:
    """The singular Laplacian of a line, whose columns sum to zero, with a load that has nowhere to go."""
    ends = np.full(n, 2.0)
    ends[[0, -1]] = 1.0
    return sparse.diags_array([-np.ones(n - 1), ends, -np.ones(n - 1)], offsets=[-1, 0, 1]), -np.ones(n)


@pytest.mark.parametrize("family", [no_entries, row_of_zeros, neumann])
def test_sparse_infeasible_problems_are_proved_so(family: Callable[[int], tuple[Any, np.ndarray]]) -> None:
    result = answer(*family(400))
    assert result.status is Status.INFEASIBLE
    assert result.solve_seconds < 20


def test_linear_program_as_sparse_skew_problem() -> None:
    """min c'x, Ax >= b, x >= 0 with its dual: M = [0 -A'; A 0], q = (c, -b)."""
    generator = np.random.default_rng(0)
    A = sparse.random_array((120, 130), density=0.05, rng=generator, data_sampler=lambda size: generator.random(size))
    A = sparse.csr_array(A)
    b, c = A @ generator.random(130), A.T @ generator.random(120) + generator.random(130)
    M = sparse.block_array([[None, -A.T], [A, None]], format="csr")
    result = answer(M, np.concatenate((c, -b)))
    assert result.solved


OF_HIGHS = ("HiGHS", "THIRD_PARTY_NOTICES")  # in the lines that its version 1.16 prints once in a process


def test_structurally_singular_blocks_print_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    generator = np.random.default_rng(3)
    M = sparse.csr_array(sparse.random_array((300, 300), density=0.01, rng=generator))
    answer(M, generator.standard_normal(300), limit=3.0)
    printed = capfd.readouterr().out.splitlines()
    assert [line for line in printed if not any(word in line for word in OF_HIGHS)] == []


@pytest.mark.parametrize("m", [10, 40])
def test_bimatrix_games_are_solved_by_lemke_from_elsewhere(m: int) -> None:
    generator = np.random.default_rng(m)
    A, B = generator.uniform(1, 2, (2, m, m))
    result = answer(np.block([[np.zeros((m, m)), A], [B.T, np.zeros((m, m))]]), -np.ones(2 * m))
    assert result.solved
    assert result.route == ("newton", "lemke")


def test_units_near_the_ends_of_double_range_do_not_look_like_divergence() -> None:
    M = [[0, 0, -2e41], [2e-111, -1e-111, -1e-111], [2e113, 1e113, 0]]
    assert answer(M, [8e41, 4e-111, -2e113]).solved


def test_interrupt_reaches_the_solver_of_programs(tmp_path: Path) -> None:
    generator = np.random.default_rng(0)
    A, B = generator.uniform(1, 2, (2, 60, 60))
    file = tmp_path / "game.json"
    M = np.block([[np.zeros((60, 60)), A], [B.T, np.zeros((60, 60))]])
    write(Problem(M, -np.ones(120)), file)
    command = [sys.executable, "-m", "lcpcli", "solve", str(file), "--method", "milp", "--format", "json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        maps, deadline = Path(f"/proc/{process.pid}/maps"), time.monotonic() + 30.0
        while maps.exists() and "highs" not in maps.read_text() and time.monotonic() < deadline:
            time.sleep(0.1)  # until the solver is loaded, which takes longer where other processes are busy
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        try:
            out, err = process.communicate(timeout=10)
        finally:
            process.kill()
    assert (process.returncode, err) == (130, "")
    assert json.loads(out)["status"] == "interrupted"


def test_start_at_the_solution_stops_at_once() -> None:
    z = answer(CURTIS, [2.0, 1.0, -3.0]).z
    assert solve(CURTIS, [2.0, 1.0, -3.0], z0=z).iterations == 0


def test_time_limit_bounds_the_exponential_methods() -> None:
    generator = np.random.default_rng(0)
    A, B = generator.uniform(1, 2, (2, 60, 60))
    problem = Problem(np.block([[np.zeros((60, 60)), A], [B.T, np.zeros((60, 60))]]), -np.ones(120))
    result = run(problem, "milp", limits=Limits(time_limit=1.0))
    assert result.solved or result.status is Status.TIME_LIMIT
    assert result.solve_seconds < 4


@pytest.mark.parametrize(
    ("text", "code", "status", "method"),
    [
        ('{"M": [[0, -1], [1, 0]], "q": [-1, -1]}', 3, "infeasible", "lemke"),
        ('{"M": [[0, 1], [1, 0]], "q": [-1, 1]}', 3, "unsolvable", "exact"),
        ('{"M": [[0, 1], [0, 0]], "q": [-1, 0]}', 0, "solved", "exact"),
    ],
)
def test_exit_code_and_certificate_reach_the_shell(
    text: str, code: int, status: str, method: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "own.json"
    file.write_text(text)
    outcome = lcp("solve", str(file), "--format", "json")
    record = json.loads(outcome.out)
    assert (outcome.code, record["status"]) == (code, status)
    assert (record["certificate"] is None) is (status == "solved")
    assert record["route"][-1] == method


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


@pytest.mark.parametrize("flag", ["--scale", "--finish"])
def test_scale_and_finish_have_no_effect_on_pivoting_methods(flag: str, lcp: Callable[..., Any]) -> None:
    outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), "--method", "lemke", flag)
    assert outcome.code == 2
    assert f"{flag}: has no effect" in outcome.err


def test_time_limit_ends_a_sparse_factorization_that_fills_in(tmp_path: Path) -> None:
    file = str(tmp_path / "dominant.npz")
    write(gallery.make("dominant", 5000), file)
    command = [sys.executable, "-m", "lcpcli", "solve", file, "--method", "newton", "--format", "json"]
    done = subprocess.run([*command, "--time-limit", "0.2"], capture_output=True, text=True, check=False, timeout=30)
    assert (done.returncode, done.stderr) == (1, "")
    record = json.loads(done.stdout)
    assert record["status"] == "time_limit"
    assert record["setup_seconds"] + record["solve_seconds"] < 3
