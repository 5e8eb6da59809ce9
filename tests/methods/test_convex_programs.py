"""Convex programs by PIQP: what it answers, and what it leaves to other methods."""

from importlib.util import find_spec

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import block_diag, csr_array, random_array

from lcpcli import Problem, from_qp, run
from lcpcli.linalg import shifted_systems
from lcpcli.linalg.units import units
from lcpcli.methods import convex_program, interior
from lcpcli.methods.direct import may_be_program
from lcpcli.model import problem as problem_module

from .programs import random_program, sparse, spread

pytestmark = pytest.mark.skipif(
    find_spec("piqp") is None, reason="piqp is not installed"
)


def dependent(rows):
    """The same program with each third row once more, so that multipliers are not
    unique."""
    return rows._replace(
        A=np.vstack((rows.A, rows.A[::3])),
        low=np.append(rows.low, rows.low[::3]),
        high=np.append(rows.high, rows.high[::3]),
    )


def solved(problem):
    result = run(problem)
    assert result.solved == (
        result.relative_residual <= result.tol or result.relative_residual <= 1e-15
    )
    return result


# With each third row once more, 2003 has rows that are 0 = 0 but for rounding, which
# differs between processors.
@pytest.mark.parametrize("seed", [2001, 2004, 2007])
def test_programs_are_solved_in_all_units_and_with_dependent_rows(seed):
    rows = random_program(seed, kind="minimum")
    minima = set()
    for given in (
        rows,
        spread(rows, 1, seed),
        dependent(rows),
        spread(dependent(rows), 1, seed),
    ):
        problem = sparse(given)
        if problem.n == given.c.size:
            continue
        result = solved(problem)
        assert result.solved
        assert problem.n < 50 or "piqp" in result.route
        minima.add(float(result.answer.objective))
    assert max(minima, default=0.0) - min(minima, default=0.0) <= 1e-7 * (
        1 + max(map(abs, minima), default=0.0)
    )


@pytest.mark.parametrize("seed", [2028, 2048])
def test_multipliers_of_redundant_rows_may_be_rounding_of_0(seed):
    """Rows of M are then violated by their own terms, multipliers of 1e-20 to
    1e-240."""
    assert solved(sparse(dependent(random_program(seed, kind="minimum")))).solved


@pytest.mark.parametrize("seed", range(2001, 2004))
def test_programs_without_a_minimum_are_never_solved(seed):
    for kind in ("infeasible", "unbounded", "both"):
        problem = sparse(random_program(seed, 60, kind))
        result = solved(problem)
        assert not result.solved
        assert result.status.word == "infeasible"
        assert result.certificate is not None


def test_bounds_of_1e20_are_as_good_as_none():
    rows = random_program(2001, kind="minimum")
    lower, upper = np.clip(rows.lower, -1e20, None), np.clip(rows.upper, None, 1e20)
    assert (lower > rows.lower).any()
    results = [
        solved(sparse(each)) for each in (rows, rows._replace(lower=lower, upper=upper))
    ]
    assert [result.route for result in results] == 2 * [("piqp",)]
    first, second = (result.answer.objective for result in results)
    assert first == pytest.approx(second, rel=1e-9)


def test_a_row_without_ends_is_solved_and_nothing_is_printed(capfd):
    """PIQP would print a line about such rows."""
    rows = random_program(2004, kind="minimum")
    A = np.vstack((rows.A, rows.A[:1]))
    low = np.append(rows.low, -np.inf)
    high = np.append(rows.high, np.inf)
    expected = solved(sparse(rows))
    result = solved(sparse(rows._replace(A=A, low=low, high=high)))
    assert result.route == ("piqp",)
    assert result.answer.objective == pytest.approx(expected.answer.objective, rel=1e-9)
    assert capfd.readouterr() == ("", "")


def test_what_is_no_program_takes_the_usual_way():
    for problem in (
        from_qp(csr_array(np.diag(np.arange(1.0, 31))), -np.ones(30)),
        Problem(
            csr_array(np.diag(np.full(400, 4.0)) - np.eye(400, k=1)), -np.ones(400)
        ),
    ):
        assert not may_be_program(problem)
        assert "piqp" not in solved(problem).route


def test_options_and_limits_hold():
    problem = sparse(random_program(2001, kind="minimum"))
    usual = run(problem)
    assert run(problem, max_iterations=usual.iterations).route == ("piqp",)
    assert run(problem, max_iterations=usual.iterations - 1).route != ("piqp",)
    assert run(problem, trace=True).trace is not None
    assert run(problem, time_limit=1e-9).status.word == "time_limit"
    again = run(problem.anew())
    assert np.array_equal(again.z, usual.z)


def test_variables_may_be_fixed_where_they_are_at_the_minimum():
    rows = random_program(2001, kind="minimum")
    free = solved(sparse(rows)).answer
    is_fixed = np.arange(rows.c.size) % 3 == 1
    lower, upper = (
        np.where(is_fixed, free.x, bound) for bound in (rows.lower, rows.upper)
    )
    result = solved(sparse(rows._replace(lower=lower, upper=upper)))
    assert result.route == ("piqp",)
    assert np.array_equal(result.answer.x[is_fixed], free.x[is_fixed])
    assert result.answer.objective == pytest.approx(free.objective, rel=1e-9)


def test_a_point_that_only_rounding_separates_from_the_solution_needs_no_factorization(
    monkeypatch,
):
    """min |x|^2 / 2 - 2 x_1 with x_1 + x_2 = 1 and x >= 0, in sixty copies: x = (1, 0),
    y = -1."""
    A = block_diag([csr_array([[1.0, 1.0]])] * 60, format="csr")
    c = np.tile([-2.0, 0.0], 60)
    problem = from_qp(csr_array(np.eye(120)), c, A, row_lower=1, row_upper=1)
    z = np.concatenate((np.tile([1.0, 0.0], 60), np.full(60, -1.0)))
    own = interior.Run(problem, by_units=True)
    monkeypatch.setattr(interior, "systems", None)
    first = next(
        own.at_point(problem.box.x_of(z, problem.w(z)), initial_guess=z * (1 + 1e-15))
    )
    assert np.abs(problem.box.z_of(first.x) - z).max() <= 1e-14
    assert not first.signs_final


@pytest.mark.parametrize(("moved", "is_used"), [(0.0, True), (1.0, False)])
def test_a_point_at_which_piqp_was_stopped_is_used_if_it_is_near(
    moved, is_used, monkeypatch
):
    problem = sparse(random_program(2001, kind="minimum"))
    usual = convex_program.convex_minimum

    def stopped(*given):
        ended = usual(*given)
        return ended._replace(x=ended.x + moved, status="PIQP_MAX_ITER_REACHED")

    expected = solved(problem)
    assert expected.route == ("piqp",)
    monkeypatch.setattr(convex_program, "convex_minimum", stopped)
    result = solved(problem)
    assert result.solved
    assert (result.route == ("piqp",)) == is_used
    assert result.answer.objective == pytest.approx(expected.answer.objective, rel=1e-9)


def test_programs_whose_costs_depend_on_sums_have_the_minimum_of_dense_ones():
    """PIQP gets the sums as variables."""
    random, groups, members = default_rng(0), 6, 20
    n = groups * members
    order = random.permutation(n)
    sums = np.kron(np.eye(groups), random.uniform(0.5, 2, (1, members)))[:, order]
    Q = sums.T @ np.diag(random.uniform(0.5, 2.0, groups)) @ sums
    A = random.integers(-2, 3, (15, n)).astype(float)
    x = random.random(n)
    ends = {"row_lower": A @ x, "row_upper": A @ x + np.arange(15) % 3, "lower": 0.0}
    c = random.uniform(0.1, 2.0, n)
    results = [
        run(from_qp(make(Q), c, make(A), **ends)) for make in (csr_array, np.asarray)
    ]
    assert all(result.solved for result in results)
    assert results[0].route == ("piqp",)
    first, second = (float(result.answer.objective) for result in results)
    assert abs(first - second) <= 1e-9 * abs(second)


def test_rows_between_two_bounds_need_no_further_variables_of_piqp(monkeypatch):
    """Both multipliers of such a row are told apart, and its value is within its
    bounds, also where variables are fixed, whatever the units of the rows."""
    counts = []

    def counted(program, *options):
        counts.append(program.c.size)
        return convex_minimum(program, *options)

    convex_minimum = convex_program.convex_minimum
    monkeypatch.setattr(convex_program, "convex_minimum", counted)
    random = default_rng(0)
    A, middle = random.standard_normal((40, 30)), random.uniform(-0.5, 0.5, 30)
    units = 10.0 ** random.uniform(-4, 4, 40)
    A = units[:, np.newaxis] * A
    ends = {
        "row_lower": A @ middle - 0.2 * units,
        "row_upper": A @ middle + 0.2 * units,
    }
    lower = np.where(np.arange(30) < 3, middle, -3.0)
    upper = np.where(np.arange(30) < 3, middle, 3.0)
    c = random.standard_normal(30)
    problem = from_qp(np.eye(30), c, A, **ends, lower=lower, upper=upper)
    result = solved(problem)
    assert (result.route, counts) == (("piqp",), [27])
    y, values = result.answer.y, A @ result.answer.x
    assert (y > 0).any()
    assert (y < 0).any()
    ends_there = np.where(y > 0, ends["row_lower"], ends["row_upper"])
    differences = (values - ends_there) / units
    assert np.abs(differences[y != 0]).max() <= 1e-9
    linear = from_qp(None, c, A, **ends, lower=-3.0, upper=3.0)
    assert solved(linear).route == ("piqp",)


def test_arrays_with_few_zeros_reach_piqp_without_a_sparse_form(monkeypatch):
    """Its minimizer is that of the same program with sparse matrices; equations, rows
    with one side and rows between two bounds each have their own sign."""
    random = default_rng(1)
    factors, A = random.standard_normal((50, 40)), random.standard_normal((18, 40))
    Q, c = factors.T @ factors, 10 * random.standard_normal(40)
    low = A @ random.uniform(-0.5, 0.5, 40)
    high = low + np.repeat([0.0, np.inf, 0.1], 6)
    high[9:12] = low[9:12]
    low[9:12] = -np.inf
    ends = {"row_lower": low, "row_upper": high, "lower": -1.0, "upper": 1.0}
    expected = solved(from_qp(csr_array(Q), c, csr_array(A), **ends))

    def refused(*_):
        raise AssertionError("the program is made sparse")

    monkeypatch.setattr(convex_program, "block", refused)
    result = solved(from_qp(Q, c, A, **ends))
    assert result.route == expected.route == ("piqp",)
    np.testing.assert_allclose(result.z, expected.z, rtol=1e-9, atol=1e-9)


def test_scaling_factors_are_computed_once_for_both_forms_of_a_dense_program(
    monkeypatch,
):
    """PIQP scales the compressed M, and its answer is verified with the dense one."""
    computed = []
    monkeypatch.setattr(
        problem_module, "units", lambda *given: computed.append(given) or units(*given)
    )
    generator = default_rng(0)
    A = generator.integers(-3, 4, (20, 60)).astype(float)
    program = from_qp(np.eye(60), -np.ones(60), A, row_lower=0.0, row_upper=0.0)
    assert run(program).route == ("piqp",)
    assert len(computed) == 1


def feasible(A):
    """A linear program with the constraints A x >= b, x >= 0, where A x > b and the
    costs are positive."""
    random = default_rng(0)
    b = A @ random.uniform(0.0, 1.0, A.shape[1]) - 0.1
    return from_qp(None, random.uniform(0.0, 1.0, A.shape[1]), A, row_lower=b)


def test_the_simplex_method_solves_linear_programs_whose_factors_take_long(monkeypatch):
    """Neither their number of operations nor a solution is worth a factorization."""
    A = random_array((900, 1500), density=6e-3, rng=default_rng(0)).tocsr()

    def refused(*_):
        raise AssertionError("a factorization is begun")

    monkeypatch.setattr(shifted_systems.LDL, "factorize", refused)
    result = run(feasible(A))
    assert (result.solved, result.route) == (True, ("linear",))


@pytest.mark.parametrize("make", [np.asarray, csr_array])
def test_programs_whose_factors_fill_are_solved_with_dense_matrices(make):
    """However A is stored: factors of the sparse M would take many times as long."""
    random = default_rng(0)
    A = random.standard_normal((400, 400))
    x, y = np.split(np.maximum(random.standard_normal(800), 0.0), 2)
    c = A.T @ y + (x == 0)
    result = run(from_qp(None, c, make(A), row_lower=A @ x - (y == 0)))
    assert result.route == ("piqp",)
    assert result.answer.objective == pytest.approx(c @ x, rel=1e-9)


def flow(n):
    """A linear program of flows through a random graph of n nodes and 4 n edges."""
    random = default_rng(0)
    edges = np.arange(4 * n)
    begin = random.integers(0, n, edges.size)
    end = (begin + random.integers(1, n, edges.size)) % n
    A = csr_array(
        (np.repeat([1.0, -1.0], edges.size), (np.r_[begin, end], np.r_[edges, edges])),
        shape=(n, edges.size),
    )
    b = A @ random.uniform(0.0, 1.0, edges.size)
    costs = random.uniform(0.0, 1.0, edges.size)
    return from_qp(None, costs, A, row_lower=b, row_upper=b)


@pytest.mark.parametrize(("n", "method"), [(200, "piqp"), (2000, "linear")])
def test_a_linear_program_goes_to_the_method_that_takes_less_time(n, method):
    """With more nodes, factors have more entries for each row, and the simplex method
    gets as many iterations as take the time of interior."""
    result = run(flow(n))
    assert (result.solved, result.route) == (True, (method,))
