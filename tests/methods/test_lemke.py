"""The method `lemke` follows the path of the published algorithm, cannot cycle, and
says what its rays prove."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import eye_array

from lcpcli import Problem, Status, Trace, inspect
from lcpcli.basis import tableau
from lcpcli.gallery import families
from lcpcli.methods.lemke import lemke, refine_small_components
from lcpcli.methods.registry import LEXICOGRAPHIC, METHODS, ONES
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.verify.certificate import Proof

from .programs import random_program, spread

TEXTBOOK = {"cover": ONES, "ties": LEXICOGRAPHIC}


def exactly(M, q):
    """The algorithm in fractions on the full tableau [I, -M, -e, q]: its solution (None
    on a ray) and its pivots."""
    n = len(q)
    if min(q) >= 0:
        return [Fraction(0)] * n, 0
    T = [
        [
            Fraction(v)
            for v in [*np.eye(n, dtype=int)[i].tolist(), *(-m for m in M[i]), -1, q[i]]
        ]
        for i in range(n)
    ]
    basic, entering, pivots = list(range(n)), 2 * n, 0
    row = min(range(n), key=lambda i: [T[i][-1], *T[i][:n]])
    while True:
        T[row] = [v / T[row][entering] for v in T[row]]
        for i in range(n):
            if i != row and T[i][entering]:
                T[i] = [
                    a - T[i][entering] * b for a, b in zip(T[i], T[row], strict=True)
                ]
        leaving, basic[row] = basic[row], entering
        pivots += 1
        if leaving == 2 * n:
            value = {variable: T[i][-1] for i, variable in enumerate(basic)}
            return [value.get(n + i, Fraction(0)) for i in range(n)], pivots
        entering = leaving - n if leaving >= n else leaving + n
        rows = [i for i in range(n) if T[i][entering] > 0]
        if not rows:
            return None, pivots
        shares = {i: [v / T[i][entering] for v in T[i]] for i in rows}
        row = min(rows, key=lambda i: [shares[i][-1], basic[i] < 2 * n, *shares[i][:n]])


@pytest.mark.parametrize("n", [2, 8])
def test_number_of_pivots_doubles_with_every_unknown_on_the_worst_cases(n):
    """Murty 1978 and, symmetric positive definite, Fathi 1979: all 2^n complementary
    cones are passed."""
    for M in (families.make("murty", n).M.T, families.make("fathi", n).M):
        result = run(Problem(M, -np.ones(n)), "lemke", **TEXTBOOK)
        assert result.solved
        assert result.z.tolist() == np.eye(n)[0].tolist()
        assert result.evaluations == result.iterations == 2**n


def integers(generator, kind):
    n = int(generator.integers(1, 10))
    square = generator.integers(-2, 3, (n, n))
    wide = generator.integers(-1, 2, (max(1, n // 2), n))
    matrices = {
        "any": square,
        "P": 2 * n * np.eye(n, dtype=int) + square,
        "positive semidefinite": wide.T @ wide + square - square.T,
        "copositive": abs(square),
    }
    return matrices[kind].tolist(), generator.integers(-2, 2, n).tolist()


@pytest.mark.parametrize("kind", ["any", "P", "positive semidefinite", "copositive"])
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_path_is_that_of_exact_arithmetic_however_many_ties(kind, seed):
    M, q = integers(np.random.default_rng(seed), kind)
    z, pivots = exactly(M, q)
    result = run(Problem(M, q, x0=-np.ones(len(q))), "lemke", **TEXTBOOK)
    assert result.solved == (z is not None)
    assert result.evaluations == pivots
    if z is not None:
        exact = np.array([float(t) for t in z])
        assert np.allclose(result.z, exact, rtol=0, atol=1e-12 * max(1.0, exact.max()))
    elif kind == "positive semidefinite":
        assert result.status is Status.INFEASIBLE
        assert Proof("farkas", result.certificate.vector).holds(result.problem)


def test_iterates_are_complementary_and_their_F_is_minus_the_covering_vector():
    problem = families.make("harker-pang", 20, 3)
    first = next(lemke(problem, np.zeros(20), cover=ONES))
    F = problem.w(2 * np.maximum(first.x, 0)) - 2 * np.maximum(-first.x, 0)
    assert np.allclose(first.F, F)
    assert np.allclose(F, problem.q.min())


def test_infeasible_problem_is_proved_by_the_multipliers_of_z_0():
    """As the ray proves nothing."""
    M = np.array([[-2, -1, 1], [-0.5, -0.5, -2], [0.5, 0.5, -1]])
    result = run(Problem(M, [1.5, -1.5, 1.5]), "lemke")
    assert result.status is Status.INFEASIBLE
    assert result.certificate.vector.astype(bool).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("corner", "q"), [(0, 0), (1, 1)], ids=["solvable", "feasible but unsolvable"]
)
def test_ray_of_a_feasible_problem_is_no_proof(corner, q):
    result = run(Problem([[0, 1], [corner, 0]], [-1, q]), "lemke", **TEXTBOOK)
    assert result.status == Status.RAY
    assert result.message == "ended on a ray: that alone proves nothing"
    assert result.certificate.kind == "ray"
    assert (result.certificate.vector >= 0).all()
    assert result.certificate.vector.any()


def test_too_many_unknowns_to_pivot_are_refused_and_overflow_breaks_down():
    most = METHODS["lemke"].max_unknowns
    n = most + 1
    refused = run(Problem(eye_array(n), -np.ones(n)), "lemke")
    assert refused.status == Status.BREAKDOWN
    assert str(most) in refused.message
    assert run(Problem(eye_array(n), np.ones(n), x0=-np.ones(n)), "lemke").solved
    assert run(Problem([[1e-200]], [-1e200]), "lemke").status is Status.BREAKDOWN


def test_a_path_goes_on_from_upper_bounds():
    """With bounds on both sides every problem has a solution, at which Lemke's path
    ends."""
    for seed in range(20, 120, 5):
        rng = default_rng(seed)
        n = int(rng.integers(2, 7))
        M, q = rng.integers(-3, 4, (n, n)), rng.integers(-9, 10, n)
        problem = Problem(M, q, lower=-1, upper=rng.integers(1, 4, n))
        assert run(problem, "lemke").solved, seed


def test_in_doubles_ties_are_broken_as_in_integers_so_that_a_path_does_not_cycle():
    M, q = [[-1, 2, 0], [0, 1, 1], [0, -1, 0]], np.array([-1.0, -1.0, 0.0])
    steps = []
    for factor in (1.0, 1 / 3):
        given, trace = Problem(M, factor * q), Trace()
        run(given, "lemke", **TEXTBOOK, trace=trace, limits=Limits(max_iterations=30))
        steps.append([row.step for row in trace.rows])
    assert steps[0] == steps[1]
    assert len(steps[0]) < 10


UNITS = np.diag([1.0, 1e4, 1.0, 1.0])
SINGULAR = {
    "variables in units far apart": (
        UNITS @ [[4, -3, -1, -3], [7, 1, 0, -2], [-3, -2, 1, 3], [3, 2, -3, 0]] @ UNITS,
        UNITS @ [3, -9, 15, -6],
        1,
    ),
    "an objective that is not along the equations": (
        [
            [1, 1, -1, 1, 1],
            [1, 2, -1, -1, -2],
            [-1, -1, 1, -2, 2],
            [-1, 1, 2, 0, 0],
            [-1, 2, -2, 0, 0],
        ],
        [2, 2, 0, -3, 4],
        2,
    ),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_monotone_problems_whose_free_variables_have_a_singular_block_are_solved(name):
    M, q, free = SINGULAR[name]
    lower = np.append(np.zeros(len(q) - free), np.full(free, -np.inf))
    assert run(Problem(M, q, lower=lower), "lemke").solved


INF = np.inf
# M, q, lower, upper: positive semidefinite, and without a solution.
CONTRADICTIONS = {
    "an equation without unknowns": (
        [[2, 1, 0], [1, 2, 0], [0, 0, 0]],
        [1, 1, -2],
        [0, -1, -INF],
        [0, INF, INF],
    ),
    "a bound from above": (
        [[2, 3, 0], [1, 2, -1], [0, 1, 0]],
        [-2, -1, 2],
        [-1, 0, -INF],
        [INF, 0, INF],
    ),
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_ray_proves_that_equations_of_free_variables_contradict_each_other(name):
    M, q, lower, upper = CONTRADICTIONS[name]
    problem = Problem(M, q, lower=lower, upper=upper)
    assert inspect(problem).guarantees["lemke"].word == "yes"
    assert run(problem, "lemke").status is Status.INFEASIBLE


def test_a_path_solves_programs_with_free_variables_in_units_of_their_own():
    for seed in range(10):
        program = spread(random_program(seed, 20, "minimum"), 5, seed)
        assert run(program.problem(), "lemke").solved


def test_a_contradiction_that_the_tolerance_hides_does_not_end_a_run_of_auto():
    """e'z >= 1 and e'z <= 1 - 3e-11: the path ends on a ray that is a proof, beside a
    point that is accepted."""
    n = 23
    e, none = np.ones((1, n)), np.zeros((2, 2))
    M = np.block([[np.eye(n), -e.T, e.T], [np.vstack((e, -e)), none]])
    problem = Problem(M, np.append(np.linspace(-1, 1, n), [-1.0, 1.0 - 3e-11]))
    assert run(problem, "auto").solved


def test_a_tableau_that_is_computed_anew_is_that_of_the_pivots():
    """With variables at both bounds."""
    random, n_upper = default_rng(0), 0
    for n in (3, 6, 9):
        B = random.standard_normal((n, n))
        M, q = B @ B.T + np.eye(n), -random.random(n) - 0.1
        d, cover = np.where(random.random(n) < 0.7, 0.05, np.inf), np.ones(n)
        made = tableau.tableau_of(M, q, d, cover)
        row, *following = tableau.begin(made, cover, False)
        end = tableau.PAUSED
        while end == tableau.PAUSED:
            end, _, *following = tableau.follow(made, *following, row, False, 1)
            T, values = made.T.copy(), made.values.copy()
            n_upper += np.count_nonzero(made.at_upper)
            tableau.refactorize(made, np.column_stack((M, cover)), q)
            assert np.abs(made.T - T).max() <= 1e-9
            assert np.abs(made.values - values).max() <= 1e-9
        assert end == tableau.SOLVED
    assert n_upper > 10


def test_a_tableau_that_is_computed_anew_forgets_the_bound_that_a_variable_has_left():
    """As in 2 z - 4 nothing remains of the 4 if z is 1e20."""
    made = tableau.tableau_of(
        np.full((1, 1), 2.0), np.full(1, -4.0), np.full(1, 1e20), np.ones(1)
    )
    made.at_upper[0] = True
    made.basic[0], made.nonbasic[0] = 1, 0
    tableau.refactorize(made, np.array([[2.0, 1.0]]), np.full(1, -4.0))
    assert made.values.tolist() == [2.0]


def test_the_rounding_of_a_variable_that_enters_is_that_of_its_own_size():
    """A z of 1e-6 takes the place of z_0 = 1."""
    cover, d = np.ones(1), np.full(1, np.inf)
    made = tableau.tableau_of(np.full((1, 1), 1e6), -cover, d, cover)
    row, *following = tableau.begin(made, cover, False)
    tableau.follow(made, *following, row, False, 1)
    assert made.values == pytest.approx([1e-6])
    assert made.noise.max() < 1e-5 * tableau.NOISE


def test_z_0_leaves_where_rounding_alone_keeps_it_from_0():
    """Before the variable of the other row, whose pivot is larger."""
    change, no_bound = np.array([-1.0, -2.0]), np.full(2, np.inf)
    made = tableau.tableau_of(np.eye(2), np.ones(2), no_bound, np.ones(2))
    made.values[:] = 1.0 + 2.0**-52, 2.0
    made.noise[:] = 1e-15
    assert tableau.choose(made, 0, change, 0, False) == (0, 1.0 + 2.0**-52)


def test_a_ray_that_is_one_by_rounding_alone_is_not_the_end():
    """z_1 is 3.75e6 by its second row, and its own term in the first row is tiny."""
    M = [[2e-20, -8e-9, -1e-12], [8e-9, 0, 0], [1e-12, 0, 0]]
    assert run(Problem(M, [-2e-7, -0.03, 5e-6]), "lemke").solved


@pytest.mark.parametrize(("sign", "lower", "upper"), [(1, -1, 0), (-1, 0, 1)])
def test_a_small_component_leaves_a_bound_where_w_has_the_wrong_sign(
    sign, lower, upper
):
    """Beside an unknown of size 1: z = -1e-10 or 1e-10 from z = 0."""
    problem = Problem(
        np.eye(2), [-1.0, sign * 1e-10], lower=[0, lower], upper=[2, upper]
    )
    z = refine_small_components(problem, np.array([1.0, 0.0]), tableau.follow)
    assert z.tolist() == [1.0, pytest.approx(-sign * 1e-10, abs=0.0)]
