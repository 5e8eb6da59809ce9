"""`lcp solve` says whether a solution is the only one, as far as it is proved for the
numbers as written."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Problem, from_qp, run, solutions
from lcpcli.enumeration import others, pieces, search
from lcpcli.gallery import families
from lcpcli.inspection.verdict import YES, classify
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.proof import with_reference

COUNT = int(os.environ.get("LCP_ORACLE", "10"))


def found(problem, z):
    return others.search_others(problem, z, lambda: ExactProblem.of_decimals(problem))


def test_nothing_is_claimed_without_a_solution_or_of_many_unknowns():
    assert found(families.make("infeasible", 5, 0), np.zeros(5)).others is None
    assert not others.is_asked(families.make("tridiagonal", others.MAX_UNKNOWNS + 1, 0))
    assert not others.is_asked(from_qp(np.eye(2), [1, 1]))


@pytest.mark.parametrize("family", ["tridiagonal", "harker-pang"])
@pytest.mark.parametrize("n", [4, 50])
def test_theorem_tells_of_definite_and_scaled_dominant_matrices_without_a_search(
    family, n
):
    problem = families.make(family, n, 0)
    assert others.search_others(
        problem, run(problem).z, lambda: pytest.fail("a search was begun")
    ) == (False, True)


def test_a_theorem_covers_every_matrix_proved_dominant_after_scaling():
    """The scaling varies by 3^39, more than the digits of a double."""
    problem = families.make("all-cones", 40, 1)
    assert classify(problem.M, last="h_plus")["h_plus"].word == YES
    assert (
        pieces.shape_of(ExactProblem.of_floats(problem), lambda: None) == pieces.POINT
    )
    assert others.search_others(
        problem, run(problem).z, lambda: pytest.fail("a search was begun")
    ) == (False, True)


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.sampled_from([2, 3, 4]), st.booleans(), st.booleans())
def test_theorem_says_only_what_all_solutions_in_fractions_show(
    seed, n, is_mixed, is_definite
):
    generator = np.random.default_rng(seed)
    A = generator.integers(-3, 4, (n, n)).astype(float)
    M = A @ A.T if is_definite else A + np.diag(generator.integers(0, 3 * n, n))
    upper = generator.integers(1, 4, n) if is_mixed else np.inf
    problem = Problem(M, generator.integers(-4, 5, n), upper=upper)
    for piece in (every := list(solutions(problem))):
        z = np.array([float(value) for value in piece.vertices[0]])
        if others.is_only(problem, z):
            assert len(every) == 1
            assert piece.is_point
        assert not others.is_only(problem, z + 1e-3)


@pytest.mark.parametrize(
    ("far", "is_told"), [(1e-5, True), (1e-7, False), (1e-12, False)]
)
def test_theorem_counts_what_rounding_the_rows_does_to_z_whatever_its_signs_are(
    far, is_told
):
    """With the rows as they are written, z_2 may differ in as many digits as 1e-16 /
    far has."""
    problem = Problem([[1, 1], [1, 1 + far]], [-2, -2 - far])
    for left in (-3e-14, 0.0, 3e-14):
        assert others.is_only(problem, np.array([1 + left, 1])) is is_told


def test_a_solution_is_not_called_the_only_one_where_the_search_has_stopped(
    monkeypatch,
):
    real, murty = search.solutions, Problem([[1, 2], [2, 1]], [-1, -1])
    first = np.array(next(real(murty)).vertices[0], dtype=float)
    monkeypatch.setattr(
        others, "quick_search", lambda data: real(data, max_solutions=1)
    )
    assert found(murty, first) == others.Findings(others=None, solvable=True)


def test_error_in_the_search_for_others_leaves_the_solution(lcp, monkeypatch, tmp_path):
    def broken(*_, **__):
        raise ValueError("broken")

    monkeypatch.setattr(others, "quick_search", broken)
    (tmp_path / "murty.json").write_text('{"M": [[1, 2], [2, 1]], "q": [-1, -1]}')
    outcome = lcp(f"solve {tmp_path / 'murty.json'} --format json")
    held = outcome.record
    assert (outcome.code, held["solved"], held["others"]) == (0, True, None)


def with_ones(generator, n, twins):
    """A sparse matrix with ones on the diagonal: the others 1 or -1, or with two equal
    rows."""
    chosen, share = (range(-3, 4), 0.3) if twins else ((-1, 1), 0.1)
    values = generator.choice(chosen, (n, n))
    M = np.where(generator.random((n, n)) < share, values, 0.0)
    np.fill_diagonal(M, 1)
    if twins:
        i, j = generator.choice(n, 2, replace=False)
        M[i, j] = 1
        M[j] = M[i]
    return M


@pytest.mark.parametrize("twins", [False, True])
def test_singular_matrices_are_searched_without_an_error(twins):
    """Where v'DMv = 0 for all D for an eigenvector v, a cut had no entry that was not
    0."""
    generator, proved = np.random.default_rng(5), 0
    for _ in range(COUNT):
        n = int(generator.integers(11, 25))
        M = with_ones(generator, n, twins)
        q = generator.integers(-3, 4, n).astype(float)
        proved += (
            pieces.shape_of(ExactProblem.of_floats(Problem(M, q)), lambda: None)
            == pieces.POINT
        )
    assert (proved > 0) == (not twins)


def test_rows_that_are_only_just_not_dominant_leave_others():
    """Diagonal entries are as large as the others of their rows together, which in
    doubles may look like more."""
    for M, q in (
        ([[2, 1, 1], [3, 9, -6], [4, -2, 6]], [-4, -6, -8]),
        ([[3, 1, -2], [0, 1, 1], [-8, 8, 16]], [-1, -1, -8]),
    ):
        problem = Problem(np.array(M) / 10, np.array(q) / 10)
        assert found(problem, run(problem).z).others is not False


def test_only_solution_is_not_said_to_be_another_point_near_it():
    for distance, known in ((1e-9, False), (1e-5, None)):
        assert found(
            Problem([[2, 1], [1, 2]], [-5, -6]), np.array([4 / 3, 7 / 3]) + distance
        ) == (known, True)


def test_errors_in_few_unknowns_refer_to_the_nearest_of_all_isolated_solutions():
    one = with_reference(Problem([[1, 3], [2, 1]], [-3, -4]))
    problem = others.with_all_references(one)
    found = sorted(z.round(12).tolist() for z in problem.solutions)
    assert found == [[0, 4], [1.8, 0.4], [3, 0]]
    assert run(problem, "fixed-point").error == 0
    of_a_ray = with_reference(Problem([[0, 0], [0, 1]], [0, -1]))
    assert others.with_all_references(of_a_ray) is of_a_ray
