"""The problems that ship: each says where it is from, and its known solutions are solutions."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, Status, read, run
from lcpcli.files import contents

from .. import exact

FOLDER = Path(contents.shipped_path("paper-example-1.json")).parent
NAMES = sorted(path.name for path in FOLDER.glob("*.json"))


@pytest.fixture(params=NAMES)
def problem(request: pytest.FixtureRequest) -> Problem:
    return read(contents.shipped_path(request.param))


def test_these_problems_ship() -> None:
    others = ["paper-example-1.json", "paper-example-2.json", "tridiagonal-100.json", "two-unknowns.json"]
    assert ["bimatrix.json", "diode-bridge.json", *others] == NAMES


def test_each_has_a_name_a_source_and_a_solution_and_stands_in_the_folders_readme(problem: Problem) -> None:
    assert f"{problem.name}.json" in NAMES
    assert problem.source
    assert problem.solutions
    assert f"| {problem.name}.json | {problem.n} |" in (FOLDER / "README.md").read_text()


def test_known_solutions_are_exact_solutions(problem: Problem) -> None:
    """Each component is taken as the nearest fraction of small denominator, and the problem is checked in fractions."""
    for solution in problem.solutions:
        given = [Fraction(t) for t in solution.tolist()]
        z = [value.limit_denominator(1000) for value in given]
        assert max(abs(near - value) for near, value in zip(z, given, strict=True)) <= Fraction(1, 10**15)
        assert exact.solves(problem, z)


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_all_but_the_game_are_solved_by_both_methods(problem: Problem, method: str) -> None:
    result = run(problem, method)
    assert result.solved is (problem.name != "bimatrix")
    assert problem.name != "bimatrix" or result.status in (Status.STALLED, Status.DIVERGED)


def test_bimatrix_solutions_are_the_published_equilibria() -> None:
    """von Stengel 2007: (1, 0, 0) and (1, 0); (4/5, 1/5, 0) and (2/3, 1/3); (0, 1/3, 2/3) and (1/3, 2/3)."""
    published = [((1, 0, 0), (1, 0)), ((4 / 5, 1 / 5, 0), (2 / 3, 1 / 3)), ((0, 1 / 3, 2 / 3), (1 / 3, 2 / 3))]
    for z, (x, y) in zip(read(contents.shipped_path("bimatrix.json")).solutions, published, strict=True):
        assert np.allclose(z[:3] / z[:3].sum(), x, rtol=0, atol=1e-15)
        assert np.allclose(z[3:] / z[3:].sum(), y, rtol=0, atol=1e-15)


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, as the current one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lcpcli.solving.driver.MOST_REPETITIONS", 1)  # whose times are not looked at here
    return tmp_path


def test_each_is_read_by_its_name_from_any_folder(elsewhere: Path) -> None:
    for name, file in contents.shipped_problems().items():
        for given in (name, file.name):
            assert np.array_equal(read(given).q, read(str(file)).q)
    assert not list(elsewhere.iterdir())


def test_every_command_that_reads_a_problem_takes_the_names(elsewhere: Path, lcp: Callable[..., Any]) -> None:
    assert lcp("solve", "bimatrix", "-o", "result.json").code == 0
    for line in (
        "solve bimatrix diode-bridge -q",
        "solve winkels --all",
        "compare two-unknowns --method newton",
        "check bimatrix result.json",
        "inspect hs21",
        "convert portfolio -o portfolio.mat",
        "bench two-unknowns --method newton --budget 0 -q",
    ):
        outcome = lcp(*line.split())
        assert (outcome.code, outcome.err) == (0, ""), line
    assert (elsewhere / "portfolio.mat").exists()


def test_a_file_of_that_name_is_read_in_its_place_and_else_a_suffix_has_a_remark(
    elsewhere: Path, lcp: Callable[..., Any]
) -> None:
    remark = "lcp: hs21.json: no such file; the problem that ships under this name is read\n"
    assert lcp("solve", "hs21.json").err == lcp("inspect", "hs21.json").err == remark
    assert lcp("solve", "hs21.json", "-q").err == ""
    (elsewhere / "hs21.json").write_text('{"name": "own", "M": [[2]], "q": [-1]}')
    assert lcp("solve", "hs21.json").out.startswith("own: ")
    assert lcp("solve", "hs21").out.startswith("hs21: ")


NEAR = {"bimatrx": "bimatrix", "paper-exmple-1.json": "paper-example-1", "problems/bimatrix.json": "bimatrix"}
NEAR |= {"nowhere/klee-minty.mps": "klee-minty"}


def test_an_unknown_name_is_told_a_near_one(elsewhere: Path, lcp: Callable[..., Any]) -> None:
    assert not list(elsewhere.iterdir())
    told = {given: lcp("solve", given).err for given in NEAR}
    assert told == {
        given: f"lcp: {given}: no such file; did you mean {meant}, which is shipped?\n" for given, meant in NEAR.items()
    }
