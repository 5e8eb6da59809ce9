"""The sparse route, with the active set from coarse versions of the problem, solves
what it is made for, to rounding, and fails in words elsewhere; Krylov methods, whose
steps smoothed aggregation makes independent of the grid; elimination for tridiagonal
M-matrices, in O(n) operations.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import coo_array, csr_array, diags_array, eye_array

import lcpcli
from lcpcli import Problem, run
from lcpcli.gallery import families
from lcpcli.linalg.krylov import StoppingCriterion, conjugate_gradients
from lcpcli.linalg.matrices import is_symmetric
from lcpcli.methods import z_matrix
from lcpcli.methods.active_set import multilevel, sparse_route
from lcpcli.methods.multilevel import FullApproximation, Hierarchy, VCycles
from lcpcli.methods.stages import Breakdown, Finished, Stalled, limited
from lcpcli.methods.z_matrix import eliminated
from lcpcli.model.box import ORTHANT
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify.point import Criterion, Point

from .. import exact
from .grids import line, plane, smooth, space, stream
from .stages import through

TOL = 1e-10


def graph(n, edges, shift):
    """The Laplacian of a path with random edges and weights, plus a diagonal."""
    random = default_rng(0)
    i = np.concatenate((np.arange(n - 1), random.integers(0, n, edges)))
    j = np.concatenate((np.arange(1, n), random.integers(0, n, edges)))
    i, j = i[i != j], j[i != j]
    weights = 10.0 ** random.uniform(-1, 1, i.size)
    W = coo_array((weights, (i, j)), shape=(n, n)).tocsr()
    W = W + W.T
    return csr_array(diags_array(W.sum(axis=0) + shift) - W)


def scaled(M):
    units = diags_array(np.exp2(default_rng(3).integers(-20, 20, M.shape[0])))
    return csr_array(units @ M @ units)


MATRICES = {
    "line": lambda: line(1000),
    "anisotropic": lambda: plane(30, 0.02),
    "space": lambda: space(10),
    "slow stream": lambda: stream(30, 5),
    "fast stream": lambda: stream(30, 2000),
    "graph": lambda: graph(1200, 120, 1e-3),
    "other units": lambda: scaled(plane(30)),
}


def tridiagonal(n):
    return Problem(line(n, 4.0), default_rng(0).standard_normal(n))


def dominant(n):
    """A nonsymmetric strictly diagonally dominant matrix with random places, whose
    factors would be full."""
    generator = default_rng(1)
    A = csr_array(
        (generator.standard_normal(9 * n), tuple(generator.integers(0, n, (2, 9 * n)))),
        shape=(n, n),
    )
    A = A - diags_array(A.diagonal())
    return Problem(
        A + diags_array(1.1 * abs(A).sum(axis=1) + 0.01), generator.standard_normal(n)
    )


def solve(problem, x0=None):
    """The first z that meets the tolerance by its residual, and the methods of the
    route."""
    criterion, methods = Criterion(problem), []
    for k, iterate in enumerate(
        sparse_route(problem, np.zeros(problem.n) if x0 is None else x0)
    ):
        methods.append(iterate.method)
        z = ORTHANT.z_of(iterate.x)
        if Point(criterion, z).relative_residual <= TOL:
            return z, list(dict.fromkeys(methods))
        assert k < 1000
    raise AssertionError("ended without a solution")


def assert_equal_to_newton(problem, z):
    assert Point(Criterion(problem), z).relative_residual <= TOL
    expected = run(problem, "newton")
    assert expected.solved
    assert np.allclose(z, expected.z, rtol=1e-6, atol=1e-7 * np.abs(expected.z).max())


@pytest.mark.parametrize("name", MATRICES)
def test_the_route_gives_the_solution_of_newton_from_any_start(name):
    M = MATRICES[name]()
    for start in (0.0, 1.0):
        problem = Problem(M, smooth(M.shape[0]) * np.sqrt(M.diagonal()))
        iterates, _ = through(sparse_route(problem, np.full(problem.n, start)))
        assert_equal_to_newton(problem, problem.box.z_of(iterates[-1].x))


def test_auto_solves_what_the_route_leaves():
    """The square of a difference matrix is positive definite, with positive entries off
    the diagonal."""
    problem = Problem(csr_array(plane(30) @ plane(30)), smooth(900))
    assert_equal_to_newton(problem, run(problem).z)


@pytest.mark.parametrize("name", ["space", "slow stream", "graph"])
def test_bounds_on_both_sides(name):
    M = MATRICES[name]()
    n = M.shape[0]
    upper = np.where(np.arange(n) % 7 == 0, np.inf, 0.02 + 0.05 * np.linspace(0, 1, n))
    problem = Problem(M, smooth(n), lower=-0.05, upper=upper)
    iterates, ending = through(multilevel(problem, is_symmetric(problem.M)))
    assert isinstance(ending, Stalled)
    assert_equal_to_newton(
        problem, problem.box.project(problem.box.z_of(iterates[-1].x))
    )


def test_coarse_versions_leave_little_to_be_pivoted():
    M = plane(60)
    problem = Problem(M, smooth(3600))
    z = FullApproximation(Hierarchy(M), problem.q, problem.box).solution()
    expected = run(problem, "newton").z
    states = z - problem.w(z) / M.diagonal() > 0
    assert np.count_nonzero(states != (expected > 0)) <= 0.05 * problem.n
    assert len(through(multilevel(problem, is_symmetric(problem.M)))[0]) <= 8
    assert len(through(multilevel(families.make("american-put", 5000), True))[0]) <= 4


def test_solutions_at_the_extremes():
    for q in (np.ones(900), -np.ones(900), np.zeros(900)):
        problem = Problem(plane(30), q)
        iterates, _ = through(multilevel(problem, is_symmetric(problem.M)))
        last = problem.box.z_of(iterates[-1].x)
        for z in (last, solve(problem, np.ones(900))[0]):
            assert Point(Criterion(problem), z).relative_residual <= TOL
            assert q[0] < 0 or np.abs(z).max() <= 1e-9


@pytest.mark.parametrize("make", [tridiagonal, dominant])
def test_well_conditioned_matrices_are_not_factorized(make, monkeypatch):
    monkeypatch.setattr("scipy.sparse.linalg.splu", None)
    assert solve(make(20_000))[1] == ["krylov"]


def test_what_rounding_stops_is_finished_by_one_factorization():
    """The condition number is 4e9: no z in double precision meets the tolerance, but
    the active set can be right."""
    n = 50_000
    problem = Problem(line(n), default_rng(6).standard_normal(n))
    *_, last = sparse_route(problem, np.zeros(n))
    assert last.method == "multilevel"
    assert last.step == "finish"
    z = ORTHANT.z_of(last.x)
    rounding = np.finfo(float).eps * (abs(problem.M) @ z + np.abs(problem.q))
    assert np.all(np.abs(np.minimum(z, problem.w(z))) <= 8 * rounding)


@pytest.mark.parametrize(
    "M",
    [-plane(30), csr_array((900, 900)), plane(30) - 0.5 * eye_array(900)],
    ids=["negative", "zero", "indefinite"],
)
def test_matrices_it_is_not_made_for_end_in_words(M):
    criterion = Criterion(Problem(M, -np.ones(900)))
    with np.errstate(over="raise", invalid="raise"):
        iterates, ending = through(
            limited(sparse_route(criterion.problem, np.zeros(900)), 300)
        )
    assert isinstance(ending, (Breakdown, Stalled))
    assert all(
        Point(criterion, ORTHANT.z_of(step.x)).relative_residual > TOL
        for step in iterates
    )


def disc(m):
    X, Y = np.meshgrid(*2 * [np.linspace(-1, 1, m)])
    return (X**2 + Y**2 < 0.6).ravel()


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("m", [40, 160])
def test_number_of_steps_does_not_grow_with_the_grid(m, masked):
    M = plane(m) / 4
    basic = disc(m) if masked else np.ones(m * m, dtype=bool)
    steps = []

    def product(v):
        steps.append(v)
        return (M @ v) * basic

    b = default_rng(m).standard_normal(basic.size) * basic
    cycle, target = VCycles(Hierarchy(M))(basic), 1e-8 * np.linalg.norm(b)
    stopping = StoppingCriterion(target, 100)
    x, _ = conjugate_gradients(product, b, np.zeros(b.size), stopping, cycle)
    assert not x[~basic].any()
    assert np.linalg.norm(b - (M @ x) * basic) <= 1e-7 * np.linalg.norm(b)
    assert len(steps) <= 22


def m_matrix(rng, n, spread):
    """A tridiagonal M-matrix: M v > 0 for some v > 0, with entries off the diagonal of
    any size, some of them 0."""
    below, above = (
        rng.uniform(0, 1, n - 1) * 10.0 ** rng.integers(-spread, spread + 1, n - 1)
        for _ in range(2)
    )
    N = np.diag(below * (rng.random(n - 1) < 0.9), -1) + np.diag(
        above * (rng.random(n - 1) < 0.9), 1
    )
    v = 10.0 ** rng.uniform(-1, 1, n)
    return np.array(np.diag((N @ v) / v * (1 + rng.uniform(0.01, 1, n)) + 1e-6) - N)


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(2, 30), st.integers(0, 2))
def test_the_solution_is_found_wherever_the_basic_variables_lie(seed, n, spread):
    rng = np.random.default_rng(seed)
    M, q = m_matrix(rng, n, spread), rng.standard_normal(n)
    iterates, ending = through(eliminated(Problem(csr_array(M), q)))
    assert isinstance(ending, Finished)
    expected = lcpcli.solve(M, q, "lemke").z
    np.testing.assert_allclose(
        2 * np.maximum(iterates[-1].x, 0), expected, rtol=1e-6, atol=1e-9
    )


def stopping(n, drift):
    """Optimal stopping of a diffusion with the payoff |x| - 1/5: both ends stop, and
    the middle goes on."""
    x, h = np.linspace(-3, 3, n, retstep=True)
    up, down = 0.045 / h**2 + max(drift, 0) / h, 0.045 / h**2 + max(-drift, 0) / h
    diagonal = np.full(n, 0.05 + up + down)
    diagonal[[0, -1]] -= down, up
    M = diags_array(
        [-down, diagonal, -up], offsets=(-1, 0, 1), shape=(n, n), format="csr"
    )
    return M, M @ (np.abs(x) - 0.2)


@pytest.mark.parametrize("drift", [0.1, -0.1])
def test_optimal_stopping_with_two_free_boundaries_takes_a_few_passes_on_every_grid(
    drift, monkeypatch
):
    passes = []
    monkeypatch.setattr(z_matrix, "raise_if_timed_out", lambda: passes.append(None))
    for n in (201, 2001, 20001):
        passes.clear()
        result = lcpcli.solve(*stopping(n, drift))
        assert result.solved
        assert result.route == ("elimination",)
        assert result.evaluations == 1
        assert len(passes) < 6
        assert np.count_nonzero(np.diff((result.z > 0).astype(int))) == 2


def american_put(volatility, n=405):
    """An implicit step of an American put by central differences, whose first rows have
    positive entries off the diagonal where the square of the volatility is below the
    rate; and the payoff, below which the value must not fall."""
    i, rate = np.arange(n), 0.06
    diffusion, drift = 0.5 * volatility**2 * i**2, 0.5 * rate * i
    diagonals = [(drift - diffusion)[1:], 2 * diffusion + rate, -(diffusion + drift)]
    diagonals[2] = diagonals[2][:-1]
    diagonals[0][-1] = diagonals[1][-1] = diagonals[2][0] = 0.0
    L = diags_array(diagonals, offsets=(-1, 0, 1))
    payoff = np.maximum(40 - i * 200 / (n - 1), 0)
    return csr_array(eye_array(n) + L / 50), payoff


@pytest.mark.parametrize("volatility", [0.1, 0.3])
def test_a_few_positive_entries_leave_elimination_the_right_states(volatility):
    M, payoff = american_put(volatility)
    exact = lcpcli.solve(M, M @ payoff - payoff, "lemke").z
    result = lcpcli.solve(M, M @ payoff - payoff)
    assert result.solved
    assert result.route == ("elimination",)
    assert result.evaluations <= 2
    np.testing.assert_allclose(result.z, exact, rtol=1e-6, atol=1e-9)
    with_bounds = lcpcli.solve(M, -payoff, lower=payoff)
    assert with_bounds.solved
    assert with_bounds.route == ("elimination",)
    np.testing.assert_allclose(with_bounds.z, exact + payoff, rtol=1e-6, atol=1e-12)


def test_a_dense_tridiagonal_matrix_takes_the_route_of_compressed_rows():
    M, q = stopping(401, 0.1)
    for form in (M.toarray(), M, M.tocsc()):
        result = lcpcli.solve(form, q)
        assert result.solved
        assert result.route == ("elimination",)
    problem = Problem(M.toarray(), q)
    assert lcpcli.run(problem).problem is problem


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_a_z_matrix_has_a_solution_or_a_proof_in_fractions(seed):
    """Also where the rows have different denominators."""
    random = default_rng(seed)
    n = int(random.integers(1, 7))
    M = exact.z_matrix(random, n) / random.choice([1, 2, 5, 16], (n, 1))
    q = random.integers(-5, 3, n) / random.choice([1, 10], n)
    data = ExactProblem.of_decimals(Problem(M, q))
    z, y = z_matrix.decided(data, Effort())
    assert data.is_solution(z) if y is None else data.refuted_by(y)


def tree(n):
    """The Laplacian of a tree in which each node has one of the fifty before it above
    it."""
    random, i = default_rng(1), np.arange(1, n)
    above = np.maximum(i - 1 - random.integers(0, 50, n - 1), 0)
    links = coo_array((np.ones(n - 1), (i, above)), shape=(n, n)).tocsr()
    links = links + links.T
    return csr_array(diags_array(links.sum(axis=1)) - links)


@pytest.mark.parametrize("upper", [np.inf, 0.1])
@pytest.mark.parametrize("shift", [0.5, 1000.0])
@pytest.mark.parametrize(
    "make", [lambda: plane(60), lambda: tree(4000)], ids=["plane", "tree"]
)
def test_a_solution_that_decays_along_zeros_of_q_is_found(make, shift, upper):
    M = make()
    M = csr_array(M / M.diagonal().max() + shift * eye_array(M.shape[0]))
    i, n = np.arange(M.shape[0]), M.shape[0]
    result = lcpcli.solve(
        M, np.where(i < 5, -1.0, np.where(i > 0.95 * n, 0.01, 0.0)), upper=upper
    )
    assert result.solved
    assert result.iterations < 1000


@pytest.mark.parametrize("upper", [np.inf, 0.5])
def test_a_solution_that_decays_to_the_smallest_doubles_is_found(upper):
    """Products with bounds on its rows may overflow where it is judged."""
    M = csr_array(eye_array(450) - 0.00958 * eye_array(450, k=-1))
    q = np.zeros(450)
    q[[10, 200]] = -1.0
    assert lcpcli.solve(M, q, upper=upper).solved


@pytest.mark.parametrize("diagonal", [2.001, 2.0 + 1e-7])
def test_a_solution_that_reaches_far_along_a_shuffled_chain_takes_few_steps(diagonal):
    n = 2500
    order = default_rng(3).permutation(n)
    chain = csr_array(
        diags_array([-1.0, diagonal, -1.0], offsets=(-1, 0, 1), shape=(n, n))
    )
    q = np.full(n, 1e-6)
    q[[0, 1, n // 2]] = -30.0, 0.0, -30.0
    result = lcpcli.solve(chain[order][:, order], q)
    assert result.solved
    # Each step of newton finds the neighbours of the last ones.
    assert np.count_nonzero(result.z) > 500
    assert result.iterations < 100


def test_a_start_takes_no_more_steps_than_elimination_without_it():
    """The basis of one time step of an American put starts the next one."""
    n, dt = 400, 0.02
    M = diags_array([-3.0, 8.0, -4.0], offsets=[-1, 0, 1], shape=(n, n)).tocsr()
    payoff = np.maximum(1.0 - np.exp(np.linspace(-1.2, 1.2, n)), 0.0)
    fixed, value = M @ payoff, payoff
    first = lcpcli.solve(M, fixed - value)
    q = fixed - (1 + dt) * (first.z + payoff)
    cold, warm = lcpcli.solve(M, q), lcpcli.solve(M, q, basis=first.basis)
    assert warm.solved
    assert warm.iterations <= cold.iterations
    assert warm.route == cold.route == ("elimination",)
