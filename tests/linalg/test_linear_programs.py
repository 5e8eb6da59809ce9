"""Linear programs: the dual simplex method beside HiGHS, which prints nothing, and HiGHS in its own package beside the
one in scipy; numbers that overflow reach none of LAPACK's singular values, on which these might never end."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli.basis.dual_simplex import DualSimplex
from lcpcli.basis.free_variables import combinations
from lcpcli.linalg import linear_program
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.linear_program import Optimum, linprog, minimized
from lcpcli.linalg.units import PseudoInverse


def is_feasible(A: np.ndarray, b: np.ndarray, zero: list[int]) -> bool:
    """Whether some z, w >= 0 has w = A z + b and these forms 0, by an LP solver."""
    m, n = A.shape
    upper = np.full(n + m, np.inf)
    upper[zero] = 0.0
    equations = np.hstack((-A, np.eye(m))), b
    return linprog(np.zeros(n + m), np.zeros((0, n + m)), [], upper=upper, equal=equations) is not None


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_points_and_multipliers_agree_with_an_lp_solver(seed: int) -> None:
    random = np.random.default_rng(seed)
    m, n = (int(size) for size in random.integers(1, 9, 2))
    A, b = random.normal(size=(m, n)), random.normal(size=m)
    system, zero = DualSimplex(A, b), []
    y = system.feasible()
    for form in random.permutation(n + m)[: n + 1].tolist():
        assert (y is None) == is_feasible(A, b, zero)
        if y is not None:
            break
        point = system.point()
        z, w = point
        assert min(z.min(), w.min()) >= -1e-6
        np.testing.assert_allclose(w, A @ z + b, atol=1e-5 * max(1.0, float(z.max())))
        assert not np.concatenate((z, w))[zero].any()
        zero.append(form)
        y = system.vanish(form)
    if y is not None:
        product = A.T @ y
        assert b @ y < 0
        assert (product[[j for j in range(n) if j not in zero]] <= 1e-6 * np.abs(y).max()).all()
        assert (y[[i for i in range(m) if n + i not in zero]] >= -1e-9 * np.abs(y).max()).all()


def test_a_point_that_only_the_margin_admits_is_none() -> None:
    system = DualSimplex(np.array([[0.0]]), np.array([-1.0]))
    assert system.feasible() is not None  # a column of zeros has no margin
    system = DualSimplex(np.eye(2), np.array([-1.0, -1.0]))
    assert system.feasible() is None
    assert system.point() is not None
    assert system.vanish(0) is None  # z_1 = 0, and w_1 = delta z_2 - 1 >= 0 for a z_2 of 5e8
    assert system.point() is None


def by_both(monkeypatch: pytest.MonkeyPatch, *program: object) -> tuple[Optimum | None, Optimum | None]:
    pytest.importorskip("highspy")
    own = minimized(*program)  # type: ignore[arg-type]
    monkeypatch.setattr(linear_program, "find_spec", lambda _: None)
    return own, minimized(*program)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("form", [np.asarray, csr_array])
def test_both_find_the_same_minimum_and_multipliers(seed: int, form: type, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(seed)
    A, x = random.integers(-3, 4, (7, 12)).astype(float), random.random(12)
    low, high = A @ x - np.array([0, 0, 1, 1, 1, 2, 3]), A @ x + np.array([0, 0, np.inf, np.inf, 1, 2, 3])
    low[4] = -np.inf
    bounds = np.where(random.random(12) < 0.2, -5.0, 0.0), np.full(12, 5.0)
    objective = random.standard_normal(12)
    for found in by_both(monkeypatch, objective, form(A), (low, high), bounds):
        assert found.value == pytest.approx(objective @ found.x)
        reduced = objective - A.T @ found.y
        for multipliers, values, ends in ((found.y, A @ found.x, (low, high)), (reduced, found.x, bounds)):
            nonzero = np.abs(multipliers) > 1e-9
            assert values[nonzero] == pytest.approx(np.where(multipliers > 0, *ends)[nonzero])


@pytest.mark.parametrize(("c", "high"), [(-1.0, np.inf), (1.0, -1.0)], ids=["unbounded", "infeasible"])
def test_neither_finds_a_minimum_where_there_is_none(c: float, high: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ends, bounds = (np.array([-np.inf]), np.array([high])), (np.zeros(1), np.full(1, np.inf))
    assert by_both(monkeypatch, np.full(1, c), np.eye(1), ends, bounds) == (None, None)


CODE = """
import numpy as np
from lcpcli.linalg import linear_program
ends = np.zeros(2), np.full(2, np.inf)
found = linear_program.minimized(np.ones(2), np.array([[1.0, 1.0]]), (np.ones(1), np.full(1, np.inf)), ends)
assert found.value == 1.0, found
"""


def test_a_linear_program_prints_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@np.errstate(all="ignore")
def test_a_matrix_whose_numbers_overflow_has_no_generalized_inverse() -> None:
    with pytest.raises(SingularMatrix):
        PseudoInverse(np.array([[-1e308, 5e-324], [1.0, 1.0]]))


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_equations_that_overflow_are_not_combined(value: float) -> None:
    G = np.diag([1.0, value, 1.0])
    with pytest.raises(SingularMatrix):
        combinations(G, G)
