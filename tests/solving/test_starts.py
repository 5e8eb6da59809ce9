"""A run can begin where another has ended, or at a z."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem, Status, from_qp, read, run, solve_mcp
from lcpcli.errors import OptionError, ProblemError
from lcpcli.files import contents as shipped
from lcpcli.model.box import ORTHANT
from lcpcli.model.nonlinear import NonlinearProblem

from ..conftest import Outcome

Lcp = Callable[..., Outcome]

METHODS = ["shi", "fixed-point"]
EXAMPLE = shipped.shipped_path("paper-example-1.json")
Solved = Callable[..., Path]
From = Callable[..., tuple[str, int, list[float]]]


@pytest.fixture
def solved(lcp: Lcp, tmp_path: Path) -> Callable[..., Path]:
    """The JSON of a result of the first example."""

    def write(method: str, *options: str) -> Path:
        path = tmp_path / "result.json"
        assert lcp("solve", EXAMPLE, "--method", method, *options, "-o", str(path)).code == 0
        return path

    return write


@pytest.fixture
def from_there(lcp: Lcp) -> From:
    """The status, the iterations and z of a run with those options."""

    def solve(method: str, *options: str) -> tuple[str, int, list[float]]:
        outcome = lcp("solve", EXAMPLE, "--method", method, *options, "--format", "json")
        assert outcome.err == ""
        record = json.loads(outcome.out)
        return record["status"], record["iterations"], record["z"]

    return solve


@pytest.mark.parametrize("method", METHODS)
def test_from_a_result_or_the_solution_as_z_a_run_ends_at_once(
    method: str, from_there: From, solved: Solved, tmp_path: Path
) -> None:
    for option in ("--x0", "--z0"):
        for tol in ("1e-4", "1e-13"):
            path = str(solved(method, "--tol", tol))
            assert from_there(method, option, path, "--tol", tol)[:2] == ("solved", 0)
    for text in ("1\n0\n1\n0\n", "[1, 0, 1, 0]"):
        (tmp_path / "start").write_text(text)
        assert from_there(method, "--z0", str(tmp_path / "start")) == ("solved", 0, [1, 0, 1, 0])
    assert from_there(method, "--z0", "1,0,1,0") == ("solved", 0, [1, 0, 1, 0])


def test_of_several_results_the_first_counts_and_a_result_may_be_spread_over_lines(
    from_there: From, tmp_path: Path, solved: Solved
) -> None:
    assert from_there("shi", "--x0", "1,1,1,1", "--x1", str(solved("shi")))[:2] == ("solved", 1)
    line, path = solved("shi").read_text().rstrip(), tmp_path / "several"
    spread = json.dumps(json.loads(line), indent=2)
    for text in (*(f'{line}{between}{{"z": []}}\n' for between in ("\n", "\r\n", "\n\n")), spread):
        path.write_bytes(text.encode())
        assert from_there("shi", "--x0", str(path))[1] == 0


def test_the_driver_starts_from_z0(paper_example: Problem) -> None:
    (z,) = paper_example.solutions
    for method in METHODS:
        result = run(paper_example, method, z0=z)
        assert (result.status, result.iterations) == (Status.SOLVED, 0)
        assert np.allclose(result.z, z, rtol=0, atol=1e-14)
    own = Problem(paper_example.M, paper_example.q, x0=np.zeros(4), x1=np.ones(4))
    assert run(own, "shi").options["x1"] is not None
    assert run(own, "shi", z0=np.ones(4)).options["x1"] is None, "as it goes with the first"


def test_two_starts_and_one_of_another_length_are_refused() -> None:
    with pytest.raises(OptionError, match=r"z0.*x0.*leave one out"):
        run(read(EXAMPLE), "shi", x0=np.zeros(4), z0=np.zeros(4))
    with pytest.raises(ProblemError, match="z0: has 2 entries for 4 unknowns"):
        run(read(EXAMPLE), "shi", z0=[1, 2])


def test_x_gives_back_complementary_z_and_w() -> None:
    z, w = np.array([3.0, 0.0, 0.0, 1e308, 5e-324]), np.array([0.0, 2.0, 0.0, -1e-9, 0.0])
    x = ORTHANT.x_of(z, w)
    assert np.array_equal(x, [1.5, -1.0, 0.0, 5e307, 0.0])
    assert np.array_equal(ORTHANT.z_of(x)[:4], z[:4])


@pytest.mark.parametrize(("method", "start"), [("lemke", "x0"), ("milp", "z0")])
def test_a_start_for_methods_that_use_none_is_refused(lcp: Lcp, method: str, start: str) -> None:
    fault = f"has no effect with {method}, which uses no starting point; leave it out"
    with pytest.raises(OptionError, match=f"{start}: {fault}"):
        run(read(EXAMPLE), method, **{start: np.ones(4)})
    alone = lcp("solve", EXAMPLE, "--method", method, f"--{start}", "1,1,1,1")
    assert (alone.code, alone.err) == (2, f"lcp: --{start}: {fault}\n")
    both = lcp("compare", EXAMPLE, "--method", "lemke", "--method", "milp", f"--{start}", "1,1,1,1")
    assert "has no effect with lemke and milp, which use no starting point" in both.err
    assert lcp("compare", EXAMPLE, "--method", method, "--method", "newton", f"--{start}", "1,1,1,1").code == 0


@pytest.mark.parametrize("compiled", [False, pytest.param(True, id="compiled")])
def test_a_start_that_violates_a_row_in_small_units_is_not_called_a_solution(compiled: bool) -> None:
    """The row is 2^-12 (1, -1), where w is 2^-20 of q, but 2^-41 of the terms, which cancel."""
    if compiled:
        pytest.importorskip("numba")
    unit, far = 2.0**-12, 2.0**20
    z0 = np.array([far + 1 + 2.0**-20, far])
    problem = Problem([[unit, -unit], [-far, 0]], [-unit, far * z0[0]])
    assert problem.w(z0).tolist() == [unit * 2.0**-20, 0]
    result = run(problem, z0=z0, compiled=compiled)
    assert result.solved
    assert result.relative_residual <= result.tol
    assert not np.array_equal(result.z, z0)


@pytest.mark.parametrize("n", [60, 400])
def test_a_rounded_solution_of_a_program_is_repaired_by_a_few_systems(n: int) -> None:
    """z is right to seven digits, and M has zeros on its diagonal: without it, `interior` takes many steps."""
    rng = np.random.default_rng(n)
    A = rng.standard_normal((n // 2, n)) * (rng.random((n // 2, n)) < 0.2)
    x = rng.random(n) * (rng.random(n) < 0.5)
    problem = from_qp(np.diag(rng.random(n)), rng.standard_normal(n), A, A @ x - rng.random(n // 2), lower=0.0)
    cold = run(problem, "interior")
    z = cold.z * (1 + 1e-7 * rng.standard_normal(problem.n)) + 1e-9 * rng.random(problem.n)
    warm = run(problem, z0=z)
    assert (cold.solved, warm.solved) == (True, True)
    assert warm.evaluations <= 4 < cold.evaluations


def test_a_start_at_the_border_of_the_domain_of_F_is_moved_into_it() -> None:
    result = solve_mcp(lambda z: np.log(z) - [1.0, -1.0], x0=[0.0, 0.0])
    assert result.solved
    np.testing.assert_allclose(result.z, np.exp([1.0, -1.0]), rtol=1e-8)


def test_a_start_beyond_the_bounds_is_brought_within_them() -> None:
    problem = NonlinearProblem(lambda z: z**2 - 4.0, lower=0.0, x0=[1.0]).starting_at([-2.0])
    assert problem.x0.tolist() == [0.0]
