"""Small problems against exact verdicts: no statement about them is false.

Random mixed problems, singular, degenerate and infeasible ones among them; linear
programs whose costs and right-hand sides are up to 1e16 apart, also in units up to
2^400 apart, and mixed problems with bounds up to 1e17 away. The number of problems is
LCP_ORACLE, in the environment. Nor does the answer depend on units, order, signs, or
where bounds lie.

Problems that rounding of M makes solvable, or infeasible: one verdict for one thing, at
every size. M = J W J' of boxes in a column, crushed between a floor and a ceiling: its
rows sum to rounding, and q'e < 0. It is tridiagonal without a positive entry off the
diagonal. So if its exact pivots are positive, it is a P-matrix, and there is a
solution, a huge one; if the last one is not, there is a y > 0 with M'y <= 0, near e,
and no solution.
"""

import os
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem, Status, from_qp, run, solve
from lcpcli.gallery.families import make
from lcpcli.rational import elimination
from lcpcli.verify.certificate import Proof
from lcpcli.verify.nearby_solutions import is_run_off
from lcpcli.verify.point import Criterion, Point

from .. import exact, exact_measure
from ..enumeration.solution_sets import random_problem as integers
from ..mixed_problems import monotone, with_all_bounds
from .test_program_oracle import program as small_program

COUNT = int(os.environ.get("LCP_ORACLE", "400"))
COUNTS = pytest.mark.parametrize(
    "count",
    [64, pytest.param(COUNT, marks=pytest.mark.slow("each against exact arithmetic"))],
)


def random_problem(generator, most):
    """Small integers with bounds of all kinds, or decimals with bounds away from 0."""
    M, q, lower, upper = integers(generator, most)
    if generator.random() < 0.3:
        shift = generator.standard_normal(q.size).round(3)
        M, q, lower, upper = M / 3, q / 10, lower + shift, upper + shift
    return Problem(M, q, lower=lower, upper=upper)


def is_true(problem):
    """Whether the problem has a solution; it fails if what is said of it is not so, or
    nothing is decided."""
    solvable = exact.solution(problem) is not None
    result = run(problem, time_limit=120.0)
    if result.solved:
        assert solvable
        assert (
            exact_measure.relative_residual(problem, result.z) <= 1e-10
            or "last digits" in result.message
        )
    assert not (result.status.has_no_solution and solvable)
    assert result.solved or result.status.has_no_solution, "it is decided"
    return solvable


@COUNTS
def test_what_is_said_of_small_problems_is_true(count):
    generator = default_rng(13)
    solvable = sum(is_true(random_problem(generator, 4)) for _ in range(count))
    assert 0.2 * count < solvable < 0.9 * count


def linear_program(seed):
    """One to five variables and rows of small integers, some of whose costs and sides
    are 1e9 to 1e16 times as large."""
    program, random = small_program(seed), default_rng(seed)
    n = program.c.size
    m = min(len(program.low) - n, 5 - n)  # as the oracle tries all bases
    low, high = (np.array(ends, dtype=float) for ends in (program.low, program.high))
    low[np.isnan(low)], high[np.isnan(high)] = -np.inf, np.inf
    kind, powers = random.integers(4), 10.0 ** random.integers(9, 17, n + m)
    sizes = np.where(random.random(n + m) < 0.5, powers, 1.0)
    sides = sizes[n:] if kind in (0, 2) else 1.0
    return from_qp(
        None,
        program.c * (sizes[:n] if kind in (1, 2) else 1.0),
        program.G[:m],
        row_lower=low[:m] * sides,
        row_upper=high[:m] * sides,
        lower=low[-n:],
        upper=high[-n:],
    )


@COUNTS
@pytest.mark.parametrize("largest", [0, 400])
def test_linear_programs_with_numbers_far_apart(largest, count):
    """And in units up to 2^400 apart."""
    for seed in range(count // 8):
        given = linear_program(seed)
        lower, upper = given.box.vectors(given.n)
        powers = default_rng(seed).integers(-largest, largest + 1, (2, given.n))
        R, C = np.exp2(powers.astype(float))
        bounds = {"lower": lower / C, "upper": upper / C}
        is_true(Problem(R[:, None] * given.M * C, R * given.q, **bounds))


def mixed(seed):
    """Integers, and bounds up to 1e17 away from 0, and from each other."""
    random = default_rng(seed)
    M, q, lower, upper = integers(random, 3)
    n, far = q.size, 10.0 ** random.integers(6, 18, (3, q.size))
    shift, below, above = far * random.integers(0, 2, (3, n))
    shift *= random.choice([-1, 1], n)
    return Problem(M, q, lower=lower + shift - below, upper=upper + shift + above)


@COUNTS
def test_mixed_problems_with_far_bounds(count):
    for seed in range(count // 2):
        is_true(mixed(seed))


def near(z, reference, size=1.0):
    return bool(
        np.abs(z - reference).max()
        <= 1e-6 * max(size * 1e-6, 1.0) * (1 + np.abs(reference).max())
    )


@pytest.mark.parametrize("seed", range(4))
def test_units_order_signs_and_shifts_do_not_matter(seed):
    generator = default_rng(seed)
    n = int(generator.integers(1, 30))
    (M, q), (lower, upper) = monotone(n, generator), with_all_bounds(n, generator)
    own = solve(M, q, lower=lower, upper=upper)
    z = own.z
    R, C = 10.0 ** generator.uniform(-8, 8, (2, n))
    result = solve(R[:, np.newaxis] * M * C, R * q, lower=lower / C, upper=upper / C)
    assert own.solved
    assert near(C * result.z, z)
    t = 10.0 ** generator.uniform(-100, 100)
    scaled = solve(M, t * q, lower=t * lower, upper=t * upper).z / t
    assert np.allclose(scaled, z, rtol=1e-12, atol=1e-13)
    P = generator.permutation(n)
    assert near(solve(M[np.ix_(P, P)], q[P], lower=lower[P], upper=upper[P]).z, z[P])
    mirrored = solve(M, -q, lower=-upper, upper=-lower)
    assert near(-mirrored.z, z)
    exchanged = {"lower": "upper", "upper": "lower", "basic": "basic"}
    states = zip(own.basis, mirrored.basis, lower < upper, strict=True)
    assert all(one == exchanged[other] for one, other, is_free in states if is_free)
    shift = 1e6 * generator.standard_normal(n)
    moved = solve(M, q - M @ shift, lower=lower + shift, upper=upper + shift)
    assert near(moved.z - shift, z, 1e6)
    plain = solve(M, q)
    spelt = solve(M, q, lower=np.zeros(n), upper=[np.inf] * n)
    assert plain.z.tobytes() == spelt.z.tobytes()
    assert plain.w.tobytes() == spelt.w.tobytes()
    assert plain.relative_residual == spelt.relative_residual


SIZES = (5, 21)  # that are solved in different ways


def crushed(n, seed, decades=0):
    """Boxes in a column, n contacts; in units of rows and columns that spread by so
    many decades."""
    random = default_rng([n, seed])
    weights = random.uniform(0.3, 2.0, n - 1)
    units = 10.0 ** random.uniform(-decades / 2, decades / 2, n)
    diagonal = np.append(0.0, weights) + np.append(weights, 0.0)
    M = np.diag(diagonal) - np.diag(weights, 1) - np.diag(weights, -1)
    q = np.zeros(n)
    q[0], q[-1] = -0.0981, -0.9019
    return Problem(units[:, np.newaxis] * M * units, units * q)


def lifted(problem):
    """The problem with forces that can be balanced."""
    q = problem.q.copy()
    q[len(q) // 2] += 3 * np.abs(q).max() + 3 * abs(problem.M[len(q) // 2, len(q) // 2])
    return Problem(problem.M, q)


def is_solvable(problem, number=Fraction):
    """Whether all exact pivots are positive, for the doubles or another number for
    each."""
    M = [[number(value) for value in row] for row in problem.M.tolist()]
    pivot = M[0][0]
    for i in range(1, problem.n):
        assert pivot > 0
        pivot = M[i][i] - M[i][i - 1] * M[i - 1][i] / pivot
    return pivot > 0


@pytest.mark.parametrize("n", SIZES)
def test_crushed_boxes_are_ill_posed_or_infeasible_as_exact_arithmetic_says(n):
    for decades in (0, 6):
        assert_ill_posed(run(ill_posed(n, decades)))
        problem = next(
            each
            for each in map(partial(crushed, n, decades=decades), range(100))
            if not (is_solvable(each) or is_solvable(each, exact.written))
        )
        result = run(problem)
        assert result.status is Status.INFEASIBLE
        assert not result.certificate.is_rounded
        assert Proof("farkas", result.certificate.vector).holds(problem)


def ill_posed(n, decades=0):
    return next(
        problem
        for problem in map(partial(crushed, n, decades=decades), range(100))
        if is_solvable(problem)
    )


def assert_ill_posed(result):
    """Both facts are told, and nothing else is claimed."""
    assert result.status.word == "ill_posed"
    assert not result.status.has_no_solution
    assert not result.solved
    assert result.certificate.is_rounded
    assert result.certificate.holds(result.problem)
    assert not Point(Criterion(result.problem), result.z).solves()
    assert is_run_off(result.problem, result.z, result.tol)
    assert result.message.startswith("ill-posed: z ")
    assert "times their sum cancel" in result.message


@pytest.mark.parametrize("n", SIZES)
def test_boxes_that_are_not_crushed_are_solved(n):
    result = run(lifted(crushed(n, 0)))
    assert result.solved
    assert result.point.solves()
    assert run(make("hilbert", n)).solved, "as there is no such proof"


@pytest.mark.parametrize(
    "n", [8, pytest.param(22, marks=pytest.mark.slow("two seconds"))]
)
def test_mixed_forms_and_columns_have_the_same_verdict(n):
    plain = ill_posed(n)
    M, q, free = plain.M, plain.q, np.full(n, -np.inf)
    beside = np.zeros((n + 1, n + 1))  # with a free variable, half of the first one
    beside[:n, :n], beside[n, n], beside[n, 0] = M, 2.0, -1.0
    assert_ill_posed(run(Problem(M, q - M @ np.ones(n), lower=1.0)))
    assert_ill_posed(run(Problem(M, -q, lower=free, upper=0.0)))
    assert_ill_posed(
        run(Problem(beside, np.append(q, 1.0), lower=np.append(np.zeros(n), -np.inf)))
    )
    columns = np.column_stack([q, lifted(plain).q, q])
    words = [result.status.word for result in lcpcli.solve_many(M, columns)]
    assert words == ["ill_posed", "solved", "ill_posed"]


def test_doubles_as_they_are_have_an_exact_solution():
    pytest.importorskip("flint")
    exact = lcpcli.exact(ill_posed(5))
    assert exact.solved
    assert exact.certificate is None


def test_program_is_neither_solved_nor_infeasible():
    problem = ill_posed(8)
    result = run(lcpcli.from_qp(problem.M, problem.q, lower=0))
    assert_ill_posed(result)
    assert result.word == "ill_posed"
    assert result.answer.proved is None
    assert "depends on the rounding of its data" in result.answer.statement


def test_without_exact_arithmetic_a_run_off_takes_the_place_of_the_solution(
    monkeypatch,
):
    monkeypatch.setattr(elimination, "library", lambda: None)
    result = run(crushed(60, 0))
    assert_ill_posed(result)
    assert "violates no row by more than 1e-10 of its terms" in result.message


def test_forces_that_nearly_balance_crush_no_boxes():
    """Their proof but for rounding leaves more than six digits of the sums of its
    terms."""
    problem = ill_posed(5)
    assert run(Problem(problem.M, [-1.0001, 0.0, 0.0, 0.0, 1.0])).solved
    assert_ill_posed(run(Problem(problem.M, [-1.01, 0.0, 0.0, 0.0, 1.0])))
