"""The last resorts. Relaxed reflections: their projections are the nearest points, and
they find solutions that pivoting does not. The tree: it solves every problem with a
solution, proves the rest to have none, and is never wrong; and problems with known
answers, those of the literature and random programs, by several methods.
"""

import math
import os
import signal
import threading
from fractions import Fraction
from itertools import count

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import Problem, Status, run, solve
from lcpcli.gallery import families
from lcpcli.methods import milp as module
from lcpcli.methods.linear import linear
from lcpcli.methods.milp import ComplementarySystem
from lcpcli.methods.reflections import Iteration
from lcpcli.methods.stages import Stalled, advance
from lcpcli.model.box import ORTHANT, Box
from lcpcli.model.changes import standard_form
from lcpcli.verify.certificate import Proof
from lcpcli.verify.point import Criterion, Point

from .. import exact
from .planted import planted, solvable
from .programs import random_program, with_rounded_combination
from .stages import through

SWAP = np.array([[0.0, 1.0], [1.0, 0.0]])
NONE = (Status.INFEASIBLE, Status.UNSOLVABLE)


def system(M, q):
    """Return the system in which the complementary sets of an LCP are sought."""
    return ComplementarySystem(standard_form(Problem(M, q)))


def is_right(problem, result):
    """Whether the result agrees with exact arithmetic; "stalled" does not, unless the
    doubles and their shortest decimals decide otherwise."""
    is_solvable = exact.solution(problem) is not None
    if is_solvable:
        return result.solved
    if exact.solution(problem, number=exact.written) is not None:
        return result.status not in NONE
    return result.status in NONE


def test_no_set_of_a_solution_is_excluded_whatever_the_parts_of_free_variables():
    """z_1 = p_1 - t is free, and -1 at the solution, where p_1 = 0; z_2 is 1/2."""
    problem = Problem([[1, 0], [1, 1]], [1, 0.5], lower=[-np.inf, 0])
    parts = ComplementarySystem(standard_form(problem))
    assert not parts.excluded(np.array([False, True, True]))
    assert parts.excluded(np.array([False, False, True]))


ENDINGS = {
    "feasible without solution": (SWAP, [-1, 1], "unsolvable"),
    "infeasible": ([[0, -1], [1, 0]], [-1, -1], "infeasible"),
    "ray of lemke": ([[0, 1], [0, 0]], [-1, 0], "solved"),
    "solution of size 1 / eps": ([[1, -1], [-1, 1 + 2.0**-52]], [-1, 0], "solved"),
}


@pytest.mark.parametrize("name", ENDINGS)
def test_known_problem_ends_as_it_must(name):
    M, q, word = ENDINGS[name]
    result = run(Problem(M, q), "milp")
    assert result.status.word == word
    assert word != "infeasible" or Proof("farkas", result.certificate.vector).holds(
        result.problem
    )


@pytest.mark.slow("many problems, each against exact arithmetic")
@pytest.mark.parametrize("start", range(0, 300, 50))
def test_agrees_with_exact_arithmetic_on_every_kind_of_problem_in_any_units_and_sparse(
    start,
):
    random = default_rng(start)
    for seed in range(start, start + 50):
        problem = exact.random_problem(seed)
        sparse = Problem(csr_array(problem.M), problem.q)
        scaled = exact.rescaled(problem, random)
        result = run(problem, "milp")
        assert is_right(problem, result), problem.name
        assert run(sparse, "milp").solved == result.solved, problem.name
        assert is_right(scaled, run(scaled, "milp")), problem.name


def test_a_solution_to_the_tolerance_does_not_solve_what_has_none():
    """Rows of R q from 5e-4 to 5e5: what violates z >= 0 by 1e-11 of the largest has a
    residual below tol."""
    M = [
        [0, 0, 0.75, -0.03125],
        [0, 0, 2, 0.75],
        [1, 0, 0, 0],
        [0.001953125, 0.5, 0, 0],
    ]
    problem = Problem(
        M, [-185688.13643428445, -524288.0, -0.25, -0.00046563688320586636]
    )
    assert exact.solution(problem) is None
    assert run(problem, "milp").status is Status.UNSOLVABLE


def test_tree_that_is_too_large_is_no_proof():
    M, q = np.kron(np.eye(3), SWAP) + 1e-3 * np.ones((6, 6)), np.tile([-1.0, 1.0], 3)
    tree = module.candidates(system(M, q), nodes=1)
    while not isinstance(ending := advance(tree), Stalled):
        assert isinstance(ending, tuple), "no proof"
    assert "1 systems" in ending.reason


def test_time_limit_is_kept_and_called_so(monkeypatch):
    """By a clock that goes on by one second each time it is read, and it is read while
    one waits."""
    random, seconds = default_rng(0), count(0.0)
    A = random.normal(size=(60, 60))
    problem = Problem(A @ A.T + 0.1 * np.eye(60), random.normal(size=60) - 0.3)
    run(Problem([[2.0]], [-1.0]), "milp")  # loads what it needs
    monkeypatch.setattr("time.perf_counter", lambda: next(seconds))
    result = run(problem, "milp", time_limit=30.0)
    assert next(seconds) < 60
    assert result.status == Status.TIME_LIMIT
    assert "time limit" in result.message


def test_a_set_neither_solved_nor_excluded_leaves_open_whether_one_solves():
    """But for last digits 3 w_1 + w_2 = 4 z_4 - 4 z_1 - 5, where z_4 = 0 as w_4 >= 1:
    so z has size 1e31."""
    rows = np.array([[-2, 1, -1], [2, -3, 3], [6, -3, 3]]) + 2.0**-52 * np.array(
        [[2, 1, 1], [-4, 6, -4], [-8, -4, 6]]
    )
    M, q = np.eye(4), np.array([-2, 1, 5, 1])
    M[:3, :3], M[:3, 3] = rows, 1
    z = exact.solution(Problem(rows, q[:3]))
    assert exact.solves(Problem(M, q), [*z, Fraction(0)])
    tree = module.candidates(system(M, q))
    while not isinstance(ending := advance(tree), Stalled):
        assert isinstance(ending, tuple), "no proof"


def test_ctrl_c_reaches_the_solver_of_programs(monkeypatch):
    """Which is called in another thread, as compiled code ignores signals."""
    # So that the tree is left after one node.
    monkeypatch.setattr(module, "MAX_ENTRIES", 0)
    threads, released = [], threading.Event()

    def solver(*_, **__):
        threads.append(threading.current_thread())
        os.kill(os.getpid(), signal.SIGINT)
        released.wait(60)

    monkeypatch.setattr("scipy.optimize.milp", solver)
    result = run(families.make("bimatrix", 20), "milp", interrupts="return")
    released.set()
    assert result.status is Status.INTERRUPTED
    assert threads[0] is not threading.main_thread()


def test_several_basic_solutions_are_not_taken_for_the_only_one():
    """z_2 = z_1 + 1: the one with z_1 = -1 is no solution, but (0, 1) is."""
    M, q = np.array([[-1.0, 1.0], [1.0, -1.0]]), np.array([-1.0, 1.0])
    assert not system(M, q).excluded(np.ones(2, dtype=bool))


KNOWN = {
    "kostreva": 3,
    "murty": 20,
    "fathi": 12,
    "curtis-han-robinson": 3,
    "ben-gharbia-gilbert": 9,
    "growth": 40,
}
TINY = [
    ([[2.0]], [-1.0], [0.5]),
    ([[2e-9]], [-1e5], [5e13]),
    ([[0, 1], [-1, 0]], [0, 0], [0, 0]),
]


@pytest.mark.parametrize("method", ["auto", "lemke", "milp"])
def test_known_solutions_are_found_and_systems_with_hilbert_matrices_solved(method):
    known = [
        families.make(name, n)
        for name, n in (*KNOWN.items(), ("murty", 8), ("diagonal", 13))
    ]
    # Of Ben Gharbia and Gilbert, q = -e.
    known += [Problem(known[4].M, -np.ones(9), solutions=[np.full(9, 1 / 3)])]
    known += [Problem(M, q, solutions=[z]) for M, q, z in TINY]
    known += [
        Problem(1 / (np.arange(n)[:, None] + np.arange(n) + 1.0), -np.ones(n))
        for n in (2, 5, 8, 12)
    ]
    for problem in known:
        result = run(Problem(problem.M, problem.q), method)
        assert result.solved
        assert all(
            np.allclose(result.z, z, rtol=1e-15, atol=1e-15) for z in problem.solutions
        ), problem.name


def test_solution_for_a_skew_matrix_is_that_of_a_linear_program():
    M = np.array([[0.0, 1, -1], [-1, 0, 1], [1, -1, 0]])
    problem = Problem(csr_array(M), [-1, 2, 0])
    iterates, _ = through(linear(problem))
    assert Point(Criterion(problem), problem.box.z_of(iterates[-1].x)).solves()


def is_decided(seed, most):
    """Return whether auto says what is so, with whole numbers as a proof that hold
    exactly."""
    data = random_program(seed, most)
    problem = data.problem()
    result = run(problem, time_limit=1e4)
    if data.has_minimum:
        return result.solved
    if result.status is not Status.INFEASIBLE or result.certificate.is_rounded:
        return False
    y = result.certificate.vector
    return bool((y != np.rint(y)).any()) or exact.refutes(
        problem, [Fraction(value) for value in y.tolist()]
    )


LARGE = pytest.param(range(100, 200), 160, marks=pytest.mark.slow("100 programs"))


@pytest.mark.parametrize(("seeds", "most"), [(range(10), 30), LARGE])
def test_integer_programs_are_decided_with_proofs(seeds, most):
    assert not [seed for seed in seeds if not is_decided(seed, most)]


def test_contradiction_hidden_by_rounding_is_said_to_be_one_but_for_rounding():
    problem = with_rounded_combination(1).problem()
    result = run(problem, time_limit=120)
    assert result.status is Status.INFEASIBLE
    if not result.certificate.is_rounded:  # rounding has left a contradiction
        assert Proof("farkas", result.certificate.vector).holds(problem)
        return
    assert "unless terms of a row of Mz that are 1e1" in result.message
    assert result.answer.proved is None
    assert "infeasible up to the rounding of its data" in result.answer.statement


def test_signs_that_rounding_has_made_wrong_cost_no_proof():
    own = system([[-1.0, 0.0], [0.0, 1.0]], [-1.0, 1.0])
    open_set = np.full(2, module.OPEN)
    assert own.refutes(open_set, np.array([1.0, -1e-17]))
    assert not own.refutes(open_set, np.array([-1.0, 0.0]))


INFINITY = math.inf


@pytest.mark.parametrize(
    ("n", "seed"),
    [(60, 0), pytest.param(300, 1, marks=pytest.mark.slow("many unknowns"))],
)
def test_planted_problems_that_pivoting_does_not_solve_are_solved(n, seed):
    M, q = planted(n, seed)
    assert solve(M, q, "reflections").solved
    assert n > 60 or not solve(M, q, "newton", max_iterations=500).solved


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_proof_by_the_equation_of_a_free_variable_is_one_for_the_problem_as_given(
    sign,
):
    problem = Problem([[1, 0], [sign, 0]], [0, sign], lower=[0, -np.inf])
    result = run(problem, "milp")
    assert result.status is Status.INFEASIBLE
    assert Proof("farkas", result.certificate.vector).holds(problem)


def test_sparse_problems_and_those_with_bounds_and_free_variables_are_solved():
    M, q = planted(60, 0, 0.15)
    assert solve(csr_array(M), q, "reflections").solved
    assert run(solvable("any", 40, default_rng(0)), "reflections").solved


@pytest.mark.parametrize(
    ("rows", "columns", "q"),
    [(2.0**20, 1.0, 1.0), (1.0, 2.0**-20, 1.0), (1.0, 1.0, 2.0**20)],
)
def test_planted_problems_in_other_units_are_solved(rows, columns, q):
    M, given = planted(40, 1)
    one = default_rng(0).random(40) < 0.5
    R, C = np.where(one, rows, 1.0), np.where(one, columns, 1.0)
    assert solve(R[:, None] * M * C, q * R * given, "reflections").solved


def test_each_option_has_an_effect():
    M, q = planted(60, 3)
    options = ({}, {"beta": 0.3}, {"walkers": 3}, {"seed": 5})
    evaluations = {solve(M, q, "reflections", **each).evaluations for each in options}
    assert len(evaluations) == len(options)


def test_reflections_claim_nothing_without_a_solution_or_without_units():
    result = solve(
        [[-1.0, 0.0], [0.0, 1.0]], [-1.0, -1.0], "reflections", max_iterations=50
    )
    assert result.status == Status.ITERATION_LIMIT
    assert result.certificate is None
    assert solve([[0.0]], [-1.0], "reflections").status is Status.BREAKDOWN


BOXES = {
    "orthant": (0.0, INFINITY),
    "box": (-1.0, 0.5),
    "free": (-INFINITY, INFINITY),
    "upper": (-INFINITY, 0.25),
    "fixed": (0.5, 0.5),
}


@pytest.mark.parametrize("kind", BOXES)
@settings(max_examples=20)
@given(z=st.floats(-3, 3, width=32), w=st.floats(-3, 3, width=32))
def test_the_nearest_complementary_point_is_nearer_than_all_others(kind, z, w):
    lower, upper = BOXES[kind]
    box = ORTHANT if kind == "orthant" else Box(np.array([lower]), np.array([upper]))
    iteration = Iteration(np.eye(1), np.zeros(1), box, 1)
    iteration.step(np.array([[z], [w]], np.float32))
    found = iteration.nearest[:, 0]
    free_w = lower == upper
    others = [(min(max(z, lower), upper), 0.0)]
    others += [(lower, w if free_w else max(w, 0.0))] * (lower > -INFINITY)
    others += [(upper, w if free_w else min(w, 0.0))] * (upper < INFINITY)
    assert any(np.allclose(found, other) for other in others)
    least = min(np.hypot(z - a, w - b) for a, b in others)
    assert np.hypot(z - found[0], w - found[1]) <= least + 1e-5
