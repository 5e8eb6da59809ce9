"""A problem without unknowns, as a time step without contacts is, has one solution, the empty vector."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csr_array

import lcpcli
from lcpcli import Problem, Result
from lcpcli.errors import ProblemError
from lcpcli.methods.registry import METHODS
from lcpcli.report.document import FORMATS

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
NONE, SPARSE = np.zeros((0, 0)), csr_array((0, 0))
BOTH = pytest.mark.parametrize("M", [NONE, SPARSE], ids=["dense", "sparse"])


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "none.json").write_text('{"M": [], "q": []}')
    return str(tmp_path / "none.json")


def is_solved(result: Result) -> bool:
    """Whether the empty vector is the solution, and a result of it can be shown in every way."""
    assert result.to_dict()["z"] == result.digits == result.basis == []
    assert "n = 0" in repr(result)
    return result.solved and result.z.shape == (0,) and result.residual == result.relative_residual == 0


@pytest.mark.parametrize("bounds", [{}, {"lower": [], "upper": []}, {"lower": None, "upper": 1.0}])
def test_all_ways_to_solve_end_at_the_empty_vector(bounds: dict[str, Any]) -> None:
    for M in (NONE, SPARSE, [], np.zeros(0), coo_matrix((0, 0))):
        for start in ({}, {"z0": []}, {"x0": np.zeros(0)}, {"basis": []}, {"tol": 1e-17}, {"callback": print}):
            assert is_solved(lcpcli.solve(M, [], **bounds, **start))
        assert "()" in lcpcli.solve(M, [], **bounds)._repr_html_()
        solver = lcpcli.Solver(M, **bounds)
        results = [solver.solve([]), solver.solve([], lower=-1.0), solver.solve([], warm=False)]
        solver.update(M)
        assert all(map(is_solved, [*results, solver.solve([])]))
        for Q in (np.zeros((0, 1)), np.zeros((0, 8)), iter([[], []])):
            assert all(map(is_solved, lcpcli.solve_many(M, Q, **bounds)))


@pytest.mark.parametrize("method", METHODS)
def test_every_method_solves_it_before_its_first_iteration(method: str) -> None:
    for M in (NONE, SPARSE):
        result = lcpcli.solve(M, [], method, trace=True)
        assert is_solved(result)
        assert (result.route, result.iterations) == ((method,), 0)
        if METHODS[method].iterates:
            assert is_solved(lcpcli.solve(M, [], method, scale=True, finish=True))


@BOTH
def test_the_empty_vector_is_proved_to_be_the_only_solution_and_what_is_known_of_the_matrix_is_said(M: Any) -> None:
    problem = Problem(M, [], names=[], solutions=[[]])
    result, found, path = lcpcli.run(problem), lcpcli.solutions(problem), lcpcli.path(problem, problem)
    assert problem.solutions[0].size == result.error == 0
    assert ([piece.vertices for piece in found], found.complete, found.others) == ([((),)], True, False)
    bound, checked, inspected = lcpcli.error_bound(problem, []), lcpcli.check(problem, []), lcpcli.inspect(problem)
    assert (bound.value, checked.accepted, checked.residual) == (0, True, 0)
    assert not lcpcli.check(problem, y=[]).accepted
    assert {verdict.word for verdict in inspected.classes.values()} == {"yes"}
    assert (inspected.condition, inspected.spectrum, inspected.published) == (None, None, None)
    assert repr(inspected).startswith("problem: n = 0\n")
    assert (path.end, path.verified, path.z.shape, path(0.5).shape) == ("reached", True, (2, 0), (0,))
    assert result.derivative(dq=[]).z.size == result.derivative(dM=M).w.size == result.gradient([]).q.size == 0
    assert lcpcli.plan(problem)[0].method == "newton"
    pytest.importorskip("flint")
    proved = lcpcli.exact(problem).exact
    assert (proved.z, proved.w, proved.status) == ([], [], lcpcli.Status.SOLVED)


@BOTH
def test_files_hold_it_but_for_csv(tmp_path: Path, M: Any) -> None:
    for files in (["p.json"], ["p.npz"], ["p.mat"], ["p.npy", "p.q.npy"], ["p.mtx", "p.q.mtx"]):
        lcpcli.write(Problem(M, []), tmp_path / files[0])
        assert is_solved(lcpcli.run(lcpcli.read(*(tmp_path / name for name in files))))
    with pytest.raises(ProblemError, match=r"p\.csv: cannot hold a problem without unknowns; write \.json$"):
        lcpcli.write(Problem(M, []), tmp_path / "p.csv")
    assert not (tmp_path / "p.csv").exists()


def test_one_of_both_alone_is_refused_when_it_is_empty() -> None:
    for M, q, message in (
        ([[1]], [], "^M: is 1 x 1 but q has 0 entries; make them agree$"),
        ([], [1], "^M: is 0 x 0 but q has 1 entry; make them agree$"),
        ([[]], [], "^M: is 1 x 0; make it square$"),
        (csr_array((2, 2)), [], "^M: is 2 x 2 but q has 0 entries"),
    ):
        with pytest.raises(ProblemError, match=message):
            lcpcli.solve(M, q)


@pytest.mark.parametrize("form", FORMATS)
def test_commands_solve_it_in_every_format(lcp: Lcp, form: str, file: str) -> None:
    for arguments in (("solve", file), ("solve", "--all", file), ("compare", file)):
        outcome = lcp(*arguments, "--format", form)
        assert (outcome.code, outcome.err, bool(outcome.out)) == (0, "", True)


def test_commands_check_convert_follow_and_prove_it_and_figures_of_its_components_are_refused(
    tmp_path: Path, lcp: Lcp, file: str
) -> None:
    result, other, figure = (str(tmp_path / name) for name in ("result.json", "other.npz", "figure.svg"))
    assert lcp("solve", file, "--trace", "--method", "shi", "-o", result).code == lcp("check", file, result).code == 0
    assert lcp("convert", file, "-o", other).code == lcp("path", file, file).code == 0
    record = json.loads(lcp("solve", other, "--bound", "--format", "json").out)
    known = [record[key] for key in ("status", "z", "residual", "relative_residual", "error_bound", "others")]
    assert known == ["solved", [], 0, 0, 0, False]
    assert json.loads(lcp("inspect", file, "--format", "json").out)["density"] is None
    pytest.importorskip("matplotlib")
    for arguments in (("compare", "--paths"), ("solve", "--all", "--plot")):
        outcome = lcp(arguments[0], file, *arguments[1:], figure)
        assert (outcome.code, outcome.err.count("\n"), "n = 0" in outcome.err) == (2, 1, True)
    pytest.importorskip("flint")
    assert "exact z = ()\nexact w = ()\nproof: z >= 0" in lcp("solve", file, "--exact").out
    assert lcp("solve", file, "--all", "--exact").code == lcp("path", file, file, "--exact").code == 0
