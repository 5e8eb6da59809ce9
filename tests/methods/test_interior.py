"""The interior point method: monotone problems of every kind, degenerate ones too, are
solved, others refuted."""

import itertools

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import Problem, Status, Trace, check, from_qp, run
from lcpcli.gallery import families as gallery
from lcpcli.methods.interior_steps import RefinedShiftedSolver

from .planted import KINDS, solvable
from .programs import Rows, random_program, sparse, spread


def natural_residual(problem, z):
    """The largest component of z - mid(l, u, z - w), from the definition."""
    w = problem.M @ z + problem.q
    return float(np.abs(z - np.clip(z - w, problem.lower, problem.upper)).max())


def relative_residual(problem, z):
    """The same relative to the terms of w."""
    return natural_residual(problem, z) / float(
        (abs(problem.M) @ np.abs(z) + np.abs(problem.q)).max()
    )


@pytest.mark.parametrize(("degenerate", "sparse"), [(True, False), (False, True)])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_monotone_problem_is_solved_in_few_steps(
    kind, degenerate, sparse
):
    """With free variables, boxes, fixed variables and equations in each, and z_i = w_i
    = 0 in the degenerate ones; others end at the basic solution of the active set, not
    at a point of the path near it. In other units too. Whether the first basic solution
    counts as exact may hang on its last digit, so that single runs may take twice as
    long."""
    steps = []
    for seed in range(2):
        random = default_rng(seed)
        problem = solvable(
            kind, int(random.integers(3, 40)), random, degenerate, sparse
        )
        result = run(problem, "interior")
        assert result.solved
        steps.append(result.iterations)
        assert relative_residual(problem, result.z) <= (1e-9 if degenerate else 1e-12)
        assert ((problem.lower <= result.z) & (result.z <= problem.upper)).all()
        d = 2.0 ** random.integers(-20, 21, problem.n)
        M = problem.M * d[:, np.newaxis] * d
        scaled = Problem(
            M, d * problem.q, lower=problem.lower / d, upper=problem.upper / d
        )
        assert run(scaled, "interior", tol=1e-8).solved
    assert sparse or np.median(steps) <= 13


@pytest.mark.parametrize("make", [Rows.problem, sparse])
@pytest.mark.parametrize("kind", ["infeasible", "unbounded", "both"])
def test_programs_without_a_feasible_point_or_a_minimum_are_refuted(kind, make):
    for seed in range(2):
        problem = make(random_program(seed, 30, kind))
        result = run(problem, "interior")
        assert result.status is Status.INFEASIBLE
        assert check(problem, y=result.certificate.vector).accepted


MODELS = [("circuit", 40), ("spatial-prices", 40), ("qp", 40), ("lp", 40)]
MODELS += [("portfolio", 300), ("transport", 300)]
# Small components lose their digits in differences from the reference point.
MODELS += [("control", 10_000)]


@pytest.mark.parametrize(("family", "n"), MODELS)
def test_models_are_solved_to_rounding(family, n):
    problem = gallery.make(family, n)
    result = run(problem, "interior")
    assert result.solved
    assert relative_residual(problem, result.z) < 1e-10


def test_the_options_change_the_iterates():
    problem = solvable("program", 24, default_rng(1), sparse=True)
    firsts = []
    for options in ({}, {"start_slack": 50.0}, {"regularization": 1e-3}):
        trace = Trace()
        assert run(problem, "interior", trace=trace, **options).solved
        firsts.append(trace.rows[1])
    assert not np.allclose(firsts[0].z, firsts[1].z)
    assert "rho 1e-08" in firsts[0].step
    assert "rho 1e-03" in firsts[2].step


@pytest.mark.parametrize(
    ("cut", "status"),
    [(MemoryError, Status.BREAKDOWN), (KeyboardInterrupt, Status.INTERRUPTED)],
)
@pytest.mark.parametrize("at", [1, 6])
def test_a_cut_off_in_a_factorization_leaves_the_best_iterate(
    cut, status, at, monkeypatch
):
    factorize, count = RefinedShiftedSolver.factorize, itertools.count(1)

    def cut_off(self, D):
        if next(count) == at:
            raise cut
        factorize(self, D)

    monkeypatch.setattr(RefinedShiftedSolver, "factorize", cut_off)
    problem = gallery.make("control", 200)
    result = run(problem, "interior", interrupts="return")
    assert result.status == status
    assert result.iterations == max(at - 2, 0)
    assert ("memory" in result.message) == (cut is MemoryError)
    assert result.residual == pytest.approx(natural_residual(problem, result.z))


def test_a_singular_basis_is_solved_although_diagonal_pivots_lose_the_shift():
    """Equal rows of equations: the basis [0 -A'; A 0] has rank 2 rather than 4, and
    QDLDL meets pivots that are 0."""
    A = np.array([[1.0, 2.0, 0.0, 1.0], [1.0, 2.0, 0.0, 1.0], [3.0, 6.0, 0.0, 3.0]])
    c, b = np.array([1.0, 2.0, 1.0, 1.0]), np.array([4.0, 4.0, 12.0])
    M = csr_array(np.block([[np.zeros((4, 4)), -A.T], [A, np.zeros((3, 3))]]))
    problem = Problem(
        M, np.append(c, -b), lower=np.append(np.zeros(4), np.full(3, -np.inf))
    )
    result = run(problem, "interior")
    assert result.solved
    assert relative_residual(problem, result.z) <= 1e-13


def test_a_proof_from_a_diverging_iterate_is_rounded_to_one_that_holds_exactly():
    """A chain x_1 >= x_2 >= ... >= x_n >= x_1 + 1: y is constant, on more columns than
    are corrected exactly."""
    n = 80
    A = np.eye(n) - np.roll(np.eye(n), 1, axis=1)
    M = csr_array(np.block([[np.zeros((n, n)), -A.T], [A, np.zeros((n, n))]]))
    q = np.append(np.zeros(2 * n - 1), -1.0)
    result = run(
        Problem(M, q, lower=np.append(np.full(n, -np.inf), np.zeros(n))), "interior"
    )
    assert result.status is Status.INFEASIBLE
    y = result.certificate.vector[n:]
    assert y.min() == y.max() > 0


def test_convex_programs_in_units_that_are_far_apart_are_solved():
    """The variables and rows are in units of up to 2^19, and down to 2^-19."""
    for seed in range(3):
        program = spread(random_program(seed, kind="minimum"), 6, seed)
        assert run(sparse(program), "interior").solved


@pytest.mark.parametrize("is_sparse", [False, True])
@pytest.mark.parametrize("is_linear", [False, True])
def test_a_program_with_rows_in_other_units_is_solved(is_linear, is_sparse):
    random, columns = default_rng(0), 30
    A = random.normal(size=(60, columns)) * (random.random((60, columns)) < 0.3)
    x = random.normal(size=columns)
    below, above = random.random((2, 60))
    below[:15] = above[:15] = 0
    units = 10 ** random.uniform(-8, 8, 60)
    F = np.zeros((columns, 1)) if is_linear else random.normal(size=(columns, 5))
    scaled = units[:, np.newaxis] * A
    problem = from_qp(
        F @ F.T,
        random.normal(size=columns),
        csr_array(scaled) if is_sparse else scaled,
        row_lower=units * (A @ x - below),
        row_upper=units * (A @ x + above),
        lower=x - 1,
        upper=x + 1,
    )
    result = run(problem, "interior")
    assert result.solved
    rows = A @ result.answer.x
    assert (A @ x - below - 1e-8 <= rows).all()
    assert (rows <= A @ x + above + 1e-8).all()
