"""The problems that ship: each says where it is from, and its known solutions are solutions."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem, Status, read, run
from lcpcli.files import shipped

from . import exact

FOLDER = Path(shipped.path("paper-example-1.json")).parent
NAMES = sorted(path.name for path in FOLDER.glob("*.json"))


@pytest.fixture(params=NAMES)
def problem(request: pytest.FixtureRequest) -> Problem:
    return read(shipped.path(request.param))


def test_these_problems_ship() -> None:
    others = ["bimatrix.json", "diode-bridge.json"]
    assert [*others, "paper-example-1.json", "paper-example-2.json", "tridiagonal-100.json"] == NAMES


def test_each_has_a_name_a_source_and_a_solution(problem: Problem) -> None:
    assert f"{problem.name}.json" in NAMES
    assert problem.source
    assert problem.solutions


def test_each_stands_in_the_folders_readme(problem: Problem) -> None:
    assert f"| {problem.name}.json | {problem.n} |" in (FOLDER / "README.md").read_text()


def test_known_solutions_are_exact_solutions(problem: Problem) -> None:
    """Each component is taken as the nearest fraction of small denominator, and the problem is checked in fractions."""
    for solution in problem.solutions:
        z = [Fraction(t).limit_denominator(1000) for t in solution.tolist()]
        assert all(
            abs(near - Fraction(given)) <= Fraction(1, 10**15) for near, given in zip(z, solution.tolist(), strict=True)
        )
        assert exact.solves(problem, z)


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_all_but_the_game_are_solved_by_both_methods(problem: Problem, method: str) -> None:
    result = run(problem, method)
    assert result.solved is (problem.name != "bimatrix")
    assert problem.name != "bimatrix" or result.status in (Status.STALLED, Status.DIVERGED)


def test_bimatrix_solutions_are_the_published_equilibria() -> None:
    """von Stengel 2007: (1, 0, 0) and (1, 0); (4/5, 1/5, 0) and (2/3, 1/3); (0, 1/3, 2/3) and (1/3, 2/3)."""
    published = [((1, 0, 0), (1, 0)), ((4 / 5, 1 / 5, 0), (2 / 3, 1 / 3)), ((0, 1 / 3, 2 / 3), (1 / 3, 2 / 3))]
    for z, (x, y) in zip(read(shipped.path("bimatrix.json")).solutions, published, strict=True):
        assert np.allclose(z[:3] / z[:3].sum(), x, rtol=0, atol=1e-15)
        assert np.allclose(z[3:] / z[3:].sum(), y, rtol=0, atol=1e-15)
