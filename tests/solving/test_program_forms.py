"""One program in native names, in those of qpsolvers and of OSQP, in NPZ, MAT and MPS, and as a mixed problem: the same
answer.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix, csr_array

import lcpcli
from lcpcli import Problem, from_osqp, from_qp, from_qpsolvers, read, run, write

SEEDS = range(4)


def program(seed: int) -> dict[str, Any]:
    """A definite program with an equation, a range, a row from below and one from above, and bounds of every kind."""
    random = np.random.default_rng(seed)
    k = 6
    F = random.integers(-3, 4, (k, k)) / 4
    inside, A = random.integers(-2, 3, k).astype(float), random.integers(-3, 4, (4, k)).astype(float)
    inside[3] = -0.5
    at = A @ inside
    slack = random.integers(1, 4, (2, 4)) / 2
    return {
        "Q": F @ F.T + np.eye(k) / 2,
        "c": random.integers(-9, 10, k) / 2,
        "A": A,
        "row_lower": np.array([at[0], at[1] - slack[0, 1], at[2] - slack[0, 2], -np.inf]),
        "row_upper": np.array([at[0], at[1] + slack[1, 1], np.inf, at[3] + slack[1, 3]]),
        "lower": np.array([-np.inf, -3.0, -2.5, -0.5, -np.inf, -2.0]),
        "upper": np.array([np.inf, 3.0, np.inf, -0.5, 2.5, np.inf]),
    }


def qpsolvers_names(p: dict[str, Any]) -> dict[str, Any]:
    """The same program: the rows from above, then those from below, and the equation."""
    A, low, high = p["A"], p["row_lower"], p["row_upper"]
    equal = low == high
    above, below = np.isfinite(high) & ~equal, np.isfinite(low) & ~equal
    G, h = np.vstack((A[above], -A[below])), np.concatenate((high[above], -low[below]))
    objective = {"P": p["Q"], "q": p["c"], "lb": p["lower"], "ub": p["upper"]}
    return objective | {"G": G, "h": h, "A": A[equal], "b": low[equal]}


def osqp_names(p: dict[str, Any], infinity: float = np.inf) -> dict[str, Any]:
    """The same program with the bounds as rows, and with that number for none."""
    l, u = (np.concatenate((p[f"row_{side}"], p[side])) for side in ("lower", "upper"))  # noqa: E741 (its name there)
    A = np.vstack((p["A"], np.eye(len(p["c"]))))
    return {"P": p["Q"], "q": p["c"], "A": A, "l": np.maximum(l, -infinity), "u": np.minimum(u, infinity)}


def lists(p: dict[str, Any]) -> dict[str, Any]:
    """For JSON: null in place of infinite numbers."""
    return {key: [None if np.ndim(v) == 0 and np.isinf(v) else v.tolist() for v in values] for key, values in p.items()}


def forms(p: dict[str, Any], folder: Path) -> dict[str, Problem]:
    native = from_qp(**p)
    (folder / "native.json").write_text(json.dumps(lists(p)))
    (folder / "foreign.json").write_text(json.dumps(lists(qpsolvers_names(p))))
    np.savez(folder / "native.npz", **p)
    savemat(folder / "foreign.mat", qpsolvers_names(p) | {"P": csr_array(p["Q"]), "comment": "of the workspace"})
    write(native, folder / "p.mps")
    write(native, folder / "mixed.npz")
    names = ("native.json", "foreign.json", "native.npz", "foreign.mat", "p.mps", "mixed.npz")
    others = {"native": native, "foreign": from_qpsolvers(**qpsolvers_names(p))}
    return others | {name: read(folder / name) for name in names}


@pytest.mark.parametrize("seed", SEEDS)
def test_each_form_has_the_same_answer(seed: int, tmp_path: Path) -> None:
    p = program(seed)
    answers = {name: run(problem).answer for name, problem in forms(p, tmp_path).items()}
    expected = answers["native"]
    for name, answer in answers.items():
        assert answer.x == pytest.approx(expected.x, rel=1e-11, abs=1e-12), name
        assert answer.objective == pytest.approx(expected.objective, rel=1e-12), name
        assert answer.bound_multipliers == pytest.approx(expected.bound_multipliers, rel=1e-9, abs=1e-11), name
        if "foreign" not in name:
            assert answer.y == pytest.approx(expected.y, rel=1e-9, abs=1e-11), name
    assert lcpcli.check(from_qp(**p), expected.x)
    assert not lcpcli.check(from_qp(**p), expected.x + 0.1)
    M, q, lower, upper = (getattr(from_qp(**p), name) for name in ("M", "q", "lower", "upper"))
    z = lcpcli.solve(M, q, lower=lower, upper=upper).z
    assert z[:6] == pytest.approx(expected.x, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_osqp_bounds_rows_only_and_1e20_is_none(seed: int, tmp_path: Path) -> None:
    p = program(seed)
    expected = run(from_qp(**p)).answer
    triangle = {"P": np.triu(p["Q"])}
    (tmp_path / "null.json").write_text(json.dumps(lists(osqp_names(p))))
    (tmp_path / "1e30.json").write_text(json.dumps(lists(osqp_names(p, 1e30) | triangle)))
    np.savez(tmp_path / "1e20.npz", **osqp_names(p, 1e20))
    sparse = {"P": csr_array(triangle["P"]), "A": csr_array(osqp_names(p)["A"])}
    savemat(tmp_path / "1e25.mat", osqp_names(p, 1e25) | sparse | {"m": 10, "n": 6, "comment": "of the workspace"})
    files = [read(tmp_path / name) for name in ("null.json", "1e30.json", "1e20.npz", "1e25.mat")]
    for problem in [*files, from_osqp(**osqp_names(p)), from_osqp(**osqp_names(p, 1e20) | sparse)]:
        answer = run(problem).answer
        assert answer.x == pytest.approx(expected.x, rel=1e-11, abs=1e-12)
        assert answer.objective == pytest.approx(expected.objective, rel=1e-12)
        assert answer.y[:4] == pytest.approx(expected.y, rel=1e-9, abs=1e-11)
        assert answer.y[4:] == pytest.approx(expected.bound_multipliers, rel=1e-9, abs=1e-11)
        assert not answer.bound_multipliers.any()


def test_osqp_itself_finds_the_same_x_and_minus_the_multipliers() -> None:
    osqp = pytest.importorskip("osqp")
    given = osqp_names(program(1), 1e30)
    solver = osqp.OSQP()
    columns = {name: csc_matrix(given[name]) for name in ("P", "A")}
    solver.setup(**given | columns, verbose=False, eps_abs=1e-9, eps_rel=1e-9, max_iter=100_000)
    theirs, ours = solver.solve(raise_error=False), run(from_osqp(**given)).answer
    assert ours.x == pytest.approx(theirs.x, abs=1e-6)
    assert ours.y == pytest.approx(-theirs.y, abs=1e-6)


def test_linear_programs_those_without_rows_and_infinite_ends_are_taken_as_others_take_them(tmp_path: Path) -> None:
    (tmp_path / "lp.json").write_text('{"P": null, "q": [1, 2], "A": [[1, 1], [0, 1]], "l": [2, 0], "u": 3}')
    for problem in (read(tmp_path / "lp.json"), from_osqp(None, [1, 2], [[1, 1], [0, 1]], [2, 0], 3)):
        assert run(problem).answer.x.tolist() == [2, 0]
    assert run(from_osqp([[2, 1], [0, 2]], [-3, -3])).answer.x.tolist() == [1, 1]
    x = lcpcli.solve_qp(np.eye(2), np.ones(2), np.array([[1.0, 1.0], [1.0, 0.0]]), np.array([np.inf, -3.0]))
    assert x.tolist() == [-3, -1]


@pytest.mark.parametrize("seed", SEEDS)
def test_solve_qp_and_the_solver_of_qpsolvers_return_the_same_x(seed: int) -> None:
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    assert "lcp" in qpsolvers.available_solvers
    p = program(seed)
    given = qpsolvers_names(p)
    expected = run(from_qp(**p)).z[:6]
    assert lcpcli.solve_qp(**given) == pytest.approx(expected, rel=1e-11, abs=1e-12)
    assert qpsolvers.solve_qp(**given, solver="lcp") == pytest.approx(expected, rel=1e-11, abs=1e-12)
    solution = qpsolvers.solve_problem(qpsolvers.Problem(**given), solver="lcp", tol=1e-9)
    assert solution.is_optimal(1e-9)
    assert solution.primal_residual() < 1e-9
    assert solution.dual_residual() < 1e-9
    assert abs(solution.duality_gap()) < 1e-8
    assert solution.obj == pytest.approx(run(from_qp(**p)).answer.objective)


def test_qpsolvers_learns_that_there_is_no_solution_and_gets_no_stationary_point_for_a_minimizer() -> None:
    """min -x^2 + x: 0.5 satisfies the conditions, and is the maximizer."""
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    given = {"P": np.eye(1), "q": np.zeros(1), "G": np.array([[1.0], [-1.0]]), "h": np.array([1.0, -2.0])}
    assert lcpcli.solve_qp(**given) is None
    solution = qpsolvers.solve_problem(qpsolvers.Problem(**given), solver="lcp")
    assert not solution.found
    assert solution.extras["statement"] == "the program is infeasible: no x satisfies its constraints"
    given = {"P": np.array([[-2.0]]), "q": np.array([1.0])}
    answer = lcpcli.run(lcpcli.from_qpsolvers(**given)).answer
    assert (answer.proved, answer.x.tolist()) == ("stationary", [0.5])
    assert answer.statement.startswith("x is a stationary point and need not be a minimizer")
    with pytest.warns(UserWarning, match="stationary"):
        assert lcpcli.solve_qp(**given) is None
    with pytest.warns(UserWarning, match="stationary"):
        assert not qpsolvers.solve_problem(qpsolvers.Problem(**given), "lcp").found


def test_a_maximum_is_the_minimum_of_the_opposite_in_fractions_too() -> None:
    p = program(3)
    least = run(from_qp(**p, constant=2.0)).answer
    most = run(from_qp(**p | {"Q": -p["Q"], "c": -p["c"]}, sense="max", constant=-2.0)).answer
    assert most.objective == pytest.approx(-least.objective)
    assert most.y == pytest.approx(-least.y)
    assert most.statement == "x is the unique maximizer, as Q is negative definite"
    for sense, sign in ("min", 1), ("max", -1):
        answer = lcpcli.exact(from_qp(None, [-3 * sign, -2 * sign], [[1, 1]], row_upper=4, sense=sense)).answer
        assert (answer.exact["x"], answer.exact["y"]) == ([4, 0], [-3 * sign])
        assert answer.y.tolist() == [-3 * sign]
