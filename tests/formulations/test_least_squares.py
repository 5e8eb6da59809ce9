"""Least squares with signs, bounds and equations: minimizers against scipy and exact
arithmetic, what is said of them, and files."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy import optimize
from scipy.sparse import csr_array

import lcpcli
from lcpcli.formulations.least_squares import at_once
from lcpcli.formulations.least_squares.sparse_fits import minimize_sparse
from lcpcli.linalg.doubles import EPS

from ..exact import dot, regular
from ..refusals import calls, raised
from ..seeds import few_of


def exact_norm(A, b):
    """The least |A x - b| without bounds, of independent columns, in fractions."""
    columns = [list(map(Fraction, column)) for column in A.T.tolist()]
    right = list(map(Fraction, b.tolist()))
    square = [[dot(one, other) for other in columns] for one in columns]
    x = regular(square, [dot(column, right) for column in columns])
    r = [
        t - dot(row, x)
        for t, row in zip(right, zip(*columns, strict=True), strict=True)
    ]
    return float(dot(r, r)) ** 0.5


@pytest.mark.parametrize("seed", few_of(range(200), 12))
def test_a_fit_is_unique_only_where_its_norm_is_the_least(seed):
    """Of two columns that differ by a few rounding errors."""
    random = default_rng(seed)
    column = random.choice([-2.0, -1.0, 1.0, 2.0], 4)
    error = 2.0 ** -random.integers(40, 48)
    A = np.column_stack((column, column + error * np.array([0, 1, 0, -1])))
    b = random.integers(-3, 4, 4).astype(float)
    answer = lcpcli.lsq(A, b).answer
    if answer.proved == "unique":
        # A coefficient of 1e14 has no digits that make A x more accurate than this.
        terms = np.linalg.norm(np.abs(A) @ np.abs(answer.x) + np.abs(b))
        least = pytest.approx(exact_norm(A, b), rel=1e-4, abs=16 * EPS * terms)
        assert answer.norm == least


def random_fit(seed):
    """A and b of a random shape, columns in units up to 1e6 apart, some of them
    dependent."""
    rng = default_rng(seed)
    m, n = rng.integers(1, 20, 2)
    A = rng.standard_normal((m, n)) * 10.0 ** rng.integers(-3, 4, n)
    if seed % 3 == 0 and n > 2:
        A[:, 1] = 2 * A[:, 0]
    return A, rng.standard_normal(m)


@pytest.mark.parametrize("seed", few_of(range(40), 8))
def test_no_fit_is_worse_than_that_of_scipy(seed):
    A, b = random_fit(seed)
    result = lcpcli.nnls(A, b)
    assert result.solved
    assert result.answer.x.min() >= 0
    assert result.answer.norm <= optimize.nnls(A, b)[1] + 1e-12 * np.linalg.norm(b)


@pytest.mark.parametrize("seed", few_of(range(20), 5))
def test_fits_with_equations_satisfy_their_conditions(seed):
    rng = default_rng(seed)
    m, n = rng.integers(3, 12, 2)
    A, b = rng.standard_normal((m, n)), rng.standard_normal(m)
    E = np.vstack((np.ones(n), rng.standard_normal(n)))
    inside = rng.dirichlet(np.ones(n))
    answer = lcpcli.lsq(A, b, 0, 1, E, E @ inside).answer
    assert np.allclose(E @ answer.x, E @ inside, rtol=0, atol=1e-12)
    slopes = -A.T @ (b - A @ answer.x) - E.T @ answer.equation_multipliers
    assert np.allclose(slopes, answer.multipliers, rtol=0, atol=1e-10)
    assert (answer.multipliers * (answer.x - 0.5) <= 1e-12).all()


@given(st.integers(0, 30), st.integers(-200, 200), st.integers(0, 2**30))
@settings(max_examples=4, deadline=None)
def test_powers_of_two_change_nothing_but_the_powers(seed, power, other):
    A, b = random_fit(seed)
    powers = np.random.default_rng(other).integers(-100, 100, A.shape[1])
    answer = lcpcli.nnls(A, b).answer
    scaled = lcpcli.nnls(np.ldexp(A, powers), np.ldexp(b, power)).answer
    assert np.ldexp(scaled.x, powers - power).tolist() == answer.x.tolist()
    assert scaled.proved == answer.proved


def test_supports_are_those_of_fractions_where_A_A_has_no_digits_left():
    """cond(A) is 1e10: the square of it is beyond doubles."""
    rng = default_rng(3)
    planted, lost = np.array([1.0, 0, 2, 0, 3, 0]), 0
    for _ in range(5):
        left, _ = np.linalg.qr(rng.standard_normal((9, 6)))
        right, _ = np.linalg.qr(rng.standard_normal((6, 6)))
        A = left * np.logspace(0, -10, 6) @ right
        result = lcpcli.nnls(A, A @ planted + 1e-12 * rng.standard_normal(9))
        exact = lcpcli.exact(result.problem)
        support = [i for i, value in enumerate(exact.exact.z[9:]) if value]
        if result.answer.proved == "unique":
            assert result.answer.support.tolist() == support
        lost += result.answer.proved != "unique"
    assert lost < 3


@pytest.mark.parametrize(
    ("A", "b", "x", "proved"),
    [
        ([[1, 0], [0, 1]], [1, -1], [1, 0], "unique"),
        ([[1, 0], [0, 1]], [1, 0], [1, 0], "up to rounding"),
        ([[1, 1], [1, 1]], [1, 2], [1.5, 0], "several"),
        ([[1, 2, 3]], [6], [0, 0, 2], "several"),
        ([[0, 0], [0, 0]], [1, 2], [0, 0], "several"),
        ([[2]], [0], [0], "up to rounding"),
    ],
)
def test_what_is_proved_of_small_fits(A, b, x, proved):
    answer = lcpcli.nnls(A, b).answer
    assert answer.x.tolist() == pytest.approx(x)
    assert answer.proved == proved
    if proved == "several":
        assert not np.array_equal(answer.other, answer.x)
        assert answer.other.min() >= 0
        assert np.allclose(np.array(A) @ answer.other, np.array(A) @ answer.x)
    below_0 = lcpcli.lsq(-np.array(A), b, -np.inf, 0).answer
    assert below_0.proved == proved


def test_equations_that_no_x_within_the_bounds_satisfies_are_infeasible():
    result = lcpcli.lsq(np.eye(2), [1, 1], 0, 1, E=[1, 1], d=3)
    assert result.status.word == "infeasible"
    assert result.answer.x is None
    assert "no x within the bounds" in result.answer.statement


@pytest.mark.parametrize(
    ("rows", "n", "equation", "x", "proved"),
    [
        (2, 0, {}, [], "unique"),
        (0, 2, {}, [0, 0], "several"),
        (0, 0, {}, [], "unique"),
        (0, 2, {"E": [1, 2], "d": 4}, [0, 2], "several"),
    ],
)
def test_no_measurements_or_no_coefficients_are_a_fit(
    rows, n, equation, x, proved, tmp_path, capfd
):
    A, b = np.zeros((rows, n)), np.arange(rows) + 3.0
    result = lcpcli.lsq(A, b, 0, **equation)
    answer = result.answer
    assert result.solved
    assert answer.norm == np.linalg.norm(b)
    assert answer.proved == proved
    assert answer.x.tolist() == x or np.array(equation["E"]) @ answer.x == 4
    problem = lcpcli.from_lsq(A, b, 0, **equation)
    assert lcpcli.run(problem).answer.norm == answer.norm
    assert len(answer.cells()["value"]) == rows + n + len(equation) // 2
    assert capfd.readouterr() == ("", "")  # LAPACK prints what it refuses
    lcpcli.write(problem, tmp_path / "fit.npz")
    assert lcpcli.read(tmp_path / "fit.npz").n == problem.n


WRONG = calls(
    "ProblemError",
    r"""
lsq([[1, 2]], [1, 2]) => b: {ENTRIES:2 entries|1 row of A}; {AGREE}
lsq([[1, 2], [3]], [1, 2]) => A[1]: {ENTRIES_WHERE:1 entry|A[0]|2}; {ALIKE_ROWS}{FROM_0}
lsq([[1, nan]], [1]) => A[0][1]: {NOT_FINITE}; {FINITE}{FROM_0}
lsq([[]], [1, 2]) => b: {ENTRIES:2 entries|1 row of A}; {AGREE}
lsq([[1]], [1], 2, 1) => lower[0]: {ABOVE:2|upper[0]|1}; {IN_ORDER}{FROM_0}
lsq([[1]], [1], 0, 1, [[1]]) => d: is missing, though there is E; add it, or leave E out
lsq([[1]], [1], 0, 1, [1, 1], 1) => E: {ENTRIES:2 columns|1 coefficient}; {AGREE}
""",
)


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_bad_input_gets_a_line_that_names_the_argument(refusal):
    assert raised(refusal.command, {}) == refusal.line


@pytest.mark.parametrize("seed", range(4))
def test_sparse_and_dense_A_give_the_same_fit(seed):
    rng = default_rng(seed)
    A = rng.standard_normal((300, 40)) * (rng.random((300, 40)) < 0.1)
    A *= 10.0 ** rng.integers(-6, 7, 40)
    b = rng.standard_normal(300)
    if seed == 3:
        A[:, 1] = 2 * A[:, 0]  # A'A is singular
    sparse, whole = lcpcli.nnls(csr_array(A), b), lcpcli.nnls(A, b)
    assert sparse.solved
    assert np.allclose(sparse.answer.x, whole.answer.x, rtol=1e-12, atol=0)
    assert sparse.answer.norm == pytest.approx(whole.answer.norm, rel=1e-14)
    assert sparse.answer.proved == whole.answer.proved


@pytest.mark.parametrize("has_equation", [False, True])
def test_many_right_hand_sides_have_the_fits_of_each(has_equation):
    rng = default_rng(5)
    A = np.abs(rng.standard_normal((12, 4)))
    B = A @ rng.dirichlet(np.ones(4) / 2, 12).T + 0.1 * rng.standard_normal((12, 12))
    B[:, 7] = A[:, 0]  # an exact fit, which is solved by itself
    equation = {"E": np.ones(4), "d": 1} if has_equation else {}
    batch = lcpcli.lsq(A, B, 0, **equation)
    assert batch.solved.all()
    for i, result in enumerate(batch):
        alone = lcpcli.lsq(A, B[:, i], 0, **equation).answer
        assert np.allclose(batch.x[i], alone.x, rtol=0, atol=1e-13)
        assert result.answer.support.tolist() == alone.support.tolist()
        assert result.relative_residual < 1e-12
        assert result.answer.proved == alone.proved


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_sparse_products_are_taken_of_an_A_with_many_zeros_alone(share, monkeypatch):
    """The conditions of many measurements are stored sparse, whatever A is."""
    taken = []
    monkeypatch.setattr(
        at_once,
        "minimize_sparse",
        lambda data: taken.append(data) or minimize_sparse(data),
    )
    random = default_rng(0)
    A = random.standard_normal((600, 20)) * (random.random((600, 20)) < share)
    fit = lcpcli.run(lcpcli.from_lsq(A, random.standard_normal(600), lower=0.0))
    assert fit.solved
    assert bool(taken) == (share < 1.0)


def test_a_run_with_a_trace_knows_of_a_fit_what_one_without_knows():
    """Also of a spectrum whose peaks have entries such as 1e-145, which are far below
    others, and whose mixed problem is too large for bounds on rounding."""
    grid = np.linspace(0, 10, 1000)
    centres = np.linspace(0, 10, 8)
    A = np.exp(-((grid[:, np.newaxis] - centres) ** 2) / 0.3)
    b = A[:, ::3].sum(axis=1) + 0.05 * default_rng(0).standard_normal(1000)
    problem = lcpcli.from_lsq(A, b, lower=0)
    traced = lcpcli.run(problem, trace=True)
    result = lcpcli.run(problem)
    assert traced.solved
    assert traced.message == result.message
    assert traced.route == result.route
    assert np.array_equal(traced.z, result.z)
    x = result.answer.x
    assert lcpcli.check(problem, x)
    assert lcpcli.check(problem, result.z).message.endswith(result.message[8:])
    for changed in (1.000001 * x, np.where(np.arange(x.size) == 5, x + 1e-9, x)):
        assert not lcpcli.check(problem, changed)


def test_the_figure_of_a_fit_has_the_data_the_curve_and_its_parts():
    fit_figures = pytest.importorskip("lcpcli.report.figures.fit_figures")
    A = [[1, 0], [1, 1], [1, 0], [1, 0.5]]
    answer = lcpcli.nnls(A, [0.5, 1.5, 0.4, 1.1]).answer
    above, below = fit_figures.draw(*answer.picture("a fit").data).axes
    drawn = [line.get_ydata() for line in above.get_lines()]
    assert np.allclose(drawn[0], [0.5, 1.5, 0.4, 1.1])
    assert np.allclose(sum(drawn[1:-1]), drawn[-1])
    assert np.allclose(below.get_lines()[0].get_ydata(), answer.residual)


@pytest.mark.parametrize("size", [1.0, 1e14, 1e20])
def test_a_residual_that_is_not_that_of_x_is_no_solution(size):
    """However large the terms of A x are, which cancel."""
    fit = lcpcli.from_lsq([[1, -1], [1, -1]], [1, 1], 0)
    assert not lcpcli.check(fit, [5, -5, size, size]).accepted
    one_row = lcpcli.from_lsq([[1, -1]], [1], 0)
    assert not lcpcli.check(one_row, [0, size, size]).accepted


def planted_minimizer(seed):
    """A fit with equations whose minimizer, often with all coefficients at bounds, and
    multipliers are planted; None if no b makes it one."""
    random = np.random.default_rng([142, 8, seed])
    n, m = (int(size) for size in random.integers(1, 5, 2))
    k = int(random.integers(1, min(n, 3) + 1))
    A, E = random.integers(-3, 4, (m, n)), random.integers(-2, 3, (k, n))
    lower = random.integers(-1, 1, n).astype(float)
    upper = lower + random.integers(1, 3, n)
    place = random.integers(0, 2 + seed % 2, n)
    x = np.choose(place, (lower, upper, (lower + upper) / 2))
    w = np.choose(place, (1, -1, 0)) * random.integers(0, 3, n)
    slopes = w + E.T @ random.integers(-2, 3, k)
    excess = np.linalg.lstsq(A.T.astype(float), slopes, rcond=None)[0]
    if np.abs(A.T @ excess - slopes).max() > 1e-9:
        return None
    return lcpcli.from_lsq(A, A @ x - excess, lower, upper, E, E @ x), x


def test_check_finds_multipliers_wherever_the_coefficients_are_at_bounds():
    one = lcpcli.from_lsq([[-3, 0]], [-3], 0, [np.inf, 2], [[-2, 1]], [2])
    assert lcpcli.check(one, [0, 2]).accepted, "the only feasible point"
    planted = list(filter(None, map(planted_minimizer, range(120))))
    assert len(planted) > 50
    for problem, x in planted:
        assert lcpcli.check(problem, x).accepted
        inside = np.where(x == problem.origin.data_in(problem).upper, -0.25, 0.25)
        assert not lcpcli.check(problem, x + inside).accepted
