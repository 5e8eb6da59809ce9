"""lcp inspect: what it says is what the problem is, what the methods do, and what the
numbers are, with bounds too; the rate of the fixed point iteration is that which theory
gives."""

import json
import math

import numpy as np
import pytest
from numpy.random import default_rng
from scipy import sparse
from scipy.sparse import eye_array

import lcpcli
from lcpcli import Problem
from lcpcli.gallery.families import make
from lcpcli.inspection.inspection import inspect
from lcpcli.inspection.theory import smoothing
from lcpcli.inspection.verdict import CLASSES
from lcpcli.methods.registry import METHODS
from lcpcli.report import inspection_text

OWN = ("auto", "shi", "fixed-point", "newton", "interior", "lemke", "milp")
OBJECT = json.loads(
    inspection_text.inspection_report(inspect(Problem([[1.0]], [1.0]))).render("json")
)


def tridiagonal(n):
    M = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n)).tocsr()
    return Problem(M, default_rng(n).standard_normal(n))


def test_estimates_for_large_and_sparse_matrices_agree_with_the_exact_figures():
    n = 210
    # Row sums differ from column sums.
    M = 4 * np.eye(n) - 2 * np.eye(n, k=1) - np.eye(n, k=-1)
    M[:, 0] *= 1e3
    exact = np.linalg.cond(M, 1)
    for matrix in (M, sparse.csr_array(M)):
        found = inspect(Problem(matrix, np.ones(n)), math.inf)
        assert exact / 3 <= found.condition <= exact * (1 + 1e-8)
    found = inspect(tridiagonal(2000), math.inf)
    assert found.spectrum.estimated
    assert 1 / 3 < found.spectrum.smallest / (4 * math.sin(math.pi / 2 / 2001) ** 2) < 3
    assert 1 / 3 < found.spectrum.largest / 4 <= 1
    assert found.cost.bandwidth == 1


def test_modulus_iteration_is_not_guaranteed_for_the_matrix_of_kostreva():
    guarantees = inspect(make("kostreva", 5), math.inf).guarantees
    denied = {name for name in OWN if guarantees[name].word != "yes"}
    assert denied == {"fixed-point", "interior"}
    assert guarantees["fixed-point"].word == guarantees["interior"].word == "no"


ODD = [
    Problem([[0.0]], [-1.0]),
    Problem(np.zeros((3, 3)), np.zeros(3)),
    Problem(sparse.csr_array((3, 3)), -np.ones(3)),
    Problem([[1e308, -1e308], [1e308, 1e308]], [-1e308, 1e308]),
    Problem([[1e-320, 0.0], [0.0, 1e300]], [-1e-320, -1.0]),
    Problem(sparse.csr_array(np.diag([1e308, 1e-308])), [-1.0, -1.0]),
    Problem([[-1.0, 0.0], [0.0, -1.0]], [-1.0, 1.0]),
    Problem(np.ones((70, 70)), -np.ones(70)),
    Problem(sparse.csr_array(np.ones((70, 70))), -np.ones(70)),
    Problem(np.ones((201, 201)), -np.ones(201)),
]


@pytest.mark.parametrize("problem", ODD, ids=range(len(ODD)))
def test_odd_problems_are_inspected_without_a_warning(problem):
    """Each in one line of JSON with all the keys, and no number that JSON does not
    have, and in a table."""
    for seconds in (0.0, 10.0):
        found = inspect(problem, seconds)
        text = inspection_text.inspection_report(found).render("json")
        assert text.count("\n") == 1
        shown = json.loads(text, parse_constant=lambda word: pytest.fail(word))
        assert shown.keys() == OBJECT.keys()
        assert shown["classes"].keys() == CLASSES.keys()
        assert shown["methods"].keys() == METHODS.keys()
        assert (
            max(
                map(len, inspection_text.inspection_report(found).render().splitlines())
            )
            <= 80
        )


INF = math.inf


def random_mixed_problem(kind, random):
    """Small integers, with bounds of every kind."""
    n = int(random.integers(1, 6))
    A = random.integers(-2, 3, size=(n, n)).astype(float)
    half, S = A[:, : (n + 1) // 2], np.triu(A, 1) - np.triu(A, 1).T
    M = {
        "semidefinite": half @ half.T + S,
        "definite": A @ A.T + 0.5 * np.eye(n) + S,
        "nonnegative": np.abs(A) + np.eye(n),
    }[kind]
    lower = np.where(
        random.random(n) < 0.3, random.choice([-INF, 0.0]), random.integers(-3, 3, n)
    )
    upper = np.where(np.isinf(lower), 1, lower) + random.choice([0, 1, 3, INF], n)
    return Problem(M, random.integers(-5, 6, n).astype(float), lower=lower, upper=upper)


@pytest.mark.parametrize("kind", ["semidefinite", "definite", "nonnegative"])
def test_guaranteed_methods_solve_the_problem_or_prove_it_has_no_solution(kind):
    guaranteed = set()
    for seed in range(4):
        problem = random_mixed_problem(kind, default_rng(seed))
        for method, guarantee in inspect(problem, INF).guarantees.items():
            if guarantee.word == "yes" and method != "shi":  # which rounding may stall
                guaranteed.add(method)
                assert lcpcli.run(problem, method).status.word in (
                    "solved",
                    "infeasible",
                    "unsolvable",
                )
    assert {"auto", "lemke", "milp"} <= guaranteed


@pytest.mark.parametrize(("n", "word"), [(2600, "yes"), (6000, "no")])
def test_lemke_is_guaranteed_up_to_a_size_in_which_upper_bounds_do_not_count(n, word):
    problem = Problem(eye_array(n, format="csr"), -np.ones(n), upper=0.5)
    assert inspect(problem, 0.1).guarantees["lemke"].word == word


def test_smoothing_parameter_is_the_one_that_shi_uses():
    problem = Problem([[2, 1], [1, 2]], [1e-3, 2e-3], lower=1e6)
    assert (
        smoothing(problem)[0]
        == lcpcli.run(problem, "shi", max_iterations=1).options["p"]
    )


def test_presolve_ends_with_the_time_of_an_inspection():
    problem = Problem([[2, 0], [0, 1]], [1, -1], lower=[0, -INF])
    assert inspect(problem).presolve is not None
    assert inspect(problem, 0).presolve is None
