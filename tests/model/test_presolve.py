"""Presolve: what each rule takes away, and that solutions, states and proofs come back
from what it leaves; that it knows whether it may have rounded; that conditions of
programs as models write them are shown to be monotone."""

import os
import pickle
from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array, kron

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.doubles import generator
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.linalg.matrices import dense
from lcpcli.methods.direct import MAX_PIVOTED
from lcpcli.model.box import BASIC
from lcpcli.presolve.presolve import (
    ALL,
    DEFINITIONS,
    SIGNS,
    presolved,
    substituted,
)
from lcpcli.presolve.rules import signs_of_equations
from lcpcli.presolve.system import ReducedProblem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import rounded, rounded_direction
from lcpcli.rational.tree import first_solution
from lcpcli.verify.certificate import Proof
from lcpcli.verify.farkas import farkas_vector

from ..exact import refutes
from ..seeds import few_of

COUNT = int(os.environ.get("LCP_ORACLE", "25"))
ONE_BY_ONE = [*((rule,) for rule in ALL), ALL]

INF = np.inf


def check():
    """No time limit."""


def says_the_truth(problem, rules, has_solution):
    """Whether presolve by these rules changes something; it fails if what is said, or
    what comes back, is false."""
    change = presolved(problem, rules)
    if change is not None:
        data = ExactProblem.of_floats(change.problem)
        z = first_solution(data, check)
        assert (z is not None) == has_solution
        if z is not None:
            comes_back(change, rounded(z), rounded(data.w(z)))
        elif (y := farkas_vector(data, check)) is not None:
            vector = change.multipliers(rounded_direction(y))
            assert not Proof("farkas", vector).holds(problem) or refutes(
                problem, list(map(Fraction, vector.tolist()))
            )
    return change is not None


def comes_back(change, z, w):
    """Check that a solution of the problem after presolve is one of the problem before
    it, with the same states."""
    after, before = change.problem.box, change.original.box
    x = after.x_of(z, w)
    back = change.back(x)
    whole = before.z_of(back)
    own = change.original.w(whole)
    assert np.abs(before.gaps(whole, own)).max() <= 1e-13
    assert np.abs(own - (whole - 2 * back)).max() <= 1e-13
    count = change.kept_columns.size
    assert np.array_equal(whole[change.kept_columns], z[:count])
    inside = (before.basis_of(back) == BASIC)[change.kept_columns]
    there = (after.basis_of(x) == BASIC)[:count]
    assert np.array_equal(inside, there)


def test_what_each_rule_says_and_what_comes_back_from_it_are_true_of_small_problems():
    random, used = default_rng(31), dict.fromkeys(ONE_BY_ONE, 0)
    for _ in range(COUNT):
        problem = random_problem(random)
        has_solution = (
            first_solution(ExactProblem.of_floats(problem), check) is not None
        )
        for rules in ONE_BY_ONE:
            used[rules] += says_the_truth(problem, rules, has_solution)
    del used[(DEFINITIONS,)]  # which few random problems have
    assert min(used.values()) >= COUNT / 60


@pytest.mark.parametrize("seed", few_of(range(10), 4))
def test_definitions_of_free_variables_are_substituted_exactly(seed):
    """F(z) >= 0 for bounds of all kinds, written as b >= 0 with free b = F(z)."""
    random = default_rng(seed)
    n, one = 5, np.eye(5)
    M, q = random.integers(-5, 6, (n, n)) / 3, random.integers(-5, 6, n) / 10
    lower = np.where(random.random(n) < 0.7, random.integers(-2, 3, n) / 10, -INF)
    upper = np.where(random.random(n) < 0.5, 0.4, INF)
    lower[np.isinf(lower) & np.isinf(upper)] = 0.1
    whole = Problem(
        np.block([[np.zeros((n, n)), one], [M, -one]]),
        np.append(np.zeros(n), q),
        lower=np.append(lower, np.full(n, -INF)),
        upper=np.append(upper, np.full(n, INF)),
    )
    change = substituted(whole)
    assert change.is_exact
    assert np.array_equal(change.problem.M, M)
    assert np.array_equal(change.problem.q, q)
    z = first_solution(ExactProblem.of_floats(change.problem), check)
    assert (z is None) == (first_solution(ExactProblem.of_floats(whole), check) is None)


def test_presolve_can_be_switched_off():
    one = linear_program(0, "signs")
    copies = MAX_PIVOTED // one.n + 1  # so that Lemke's path does not come first
    q, lower, upper = (np.tile(each, copies) for each in (one.q, one.lower, one.upper))
    problem = Problem(
        kron(np.eye(copies), csr_array(one.M)), q, lower=lower, upper=upper
    )
    with_it, without = (lcpcli.run(problem, presolve=own) for own in (True, False))
    assert with_it.solved
    assert without.solved
    assert with_it.route != without.route
    assert (with_it.options["presolve"], without.options["presolve"]) == (True, False)


def test_what_presolve_finds_is_in_the_inspection():
    text = " ".join(repr(lcpcli.inspect(linear_program(1, "signs"))).split())
    assert "presolve removes 1 of 79 unknowns: 1 by single entries" in text
    assert "writes equations in another way" in text
    assert lcpcli.inspect(Problem(np.eye(2), [-1, 1])).presolve is None
    assert presolved(Problem(np.array([[2.0, 1], [1, 2]]), [-1, -1])) is None, (
        "no bounds but zero"
    )


def test_solutions_and_proofs_come_back_from_what_was_pickled():
    problems = [
        linear_program(0, written)
        for written in ("plainly", "signs", "disorder", "units")
    ]
    problems += [random_problem(generator(seed)) for seed in range(15)]
    changes = [presolved(given, rules) for given in problems for rules in ONE_BY_ONE]
    found = [change for change in changes if change is not None]
    assert {*ALL} - {DEFINITIONS, SIGNS} == set().union(
        *(change.removed for change in found)
    )
    for change in found:
        x = generator(1).standard_normal(change.problem.n)
        again = pickle.loads(pickle.dumps(change))
        assert again.back(x).tolist() == change.back(x).tolist()
        assert again.multipliers(x).tolist() == change.multipliers(x).tolist()
        assert again.is_exact == change.is_exact
        assert again.has_new_rows == change.has_new_rows


def test_ratios_of_mirror_images_that_underflow_are_no_factors():
    M = [[0, 1e-200, 1, 1], [1e200, 0, 2, 1], [1, 1, 3, 1], [1, 2, 1, 4]]
    problem = Problem(M, [1, -2, 3, 1], lower=-INF)
    assert lcpcli.run(problem).solved == lcpcli.run(problem, presolve=False).solved


@pytest.mark.parametrize("written", ["plainly", "signs", "disorder", "units"])
@pytest.mark.parametrize("seed", range(2))
def test_conditions_of_linear_programs_are_monotone_however_they_are_written(
    seed, written
):
    problem = linear_program(seed, written)
    change = presolved(problem)
    assert not is_semidefinite(problem.M)
    assert is_semidefinite(change.problem.M)
    result = lcpcli.run(problem)
    assert result.solved
    assert "milp" not in result.route


def test_an_equation_with_a_negative_diagonal_gets_the_other_sign():
    problem = Problem([[-1, 1], [1, 0]], [1, -2], lower=[-INF, 0])
    change = presolved(problem, [SIGNS])
    assert dense(change.problem.M).tolist() == [[1, -1], [1, 0]]
    assert change.problem.q.tolist() == [-1, -2]


def test_a_constant_that_counts_as_rounding_is_lost():
    for size, is_it in ((2.0**20, True), (2.0**51, False)):
        system = ReducedProblem(
            Problem([[1, 1], [0, 1]], [size + 1, size], lower=[0, -INF])
        )
        system.pivot(np.array([1]), np.array([1]), np.ones(1))
        assert system.q[0] == float(is_it)
        assert system.is_lossless is is_it


def test_what_counts_as_rounding_is_in_the_units_of_the_row():
    """q_1 = 2^-40 is left of numbers of size 1, far above their rounding."""
    system = ReducedProblem(
        Problem([[1, 1, 1], [0, 1, 0], [0, 0, 1]], [1, 1 - 2.0**-40, 0], lower=-INF)
    )
    system.pivot(np.array([1]), np.array([1]), np.ones(1))
    system.multiply(np.array([2.0**-20, 1, 1]))
    system.pivot(np.array([2]), np.array([2]), np.ones(1))
    assert system.q[0] == 2.0**-60


def test_entries_that_rounding_moved_from_their_mirror_images_are_not_exact():
    size = 2.0**20
    for entry, is_it in ((size, True), (size + 2.0**-25, False)):
        system = ReducedProblem(
            Problem([[0, -size], [entry, 0]], [1, 1], lower=[0, -INF])
        )
        assert list(signs_of_equations(system)) == []
        assert system.is_lossless is is_it


def random_problem(random):
    """Small integers; bounds of all kinds; a pattern that a rule looks for; a solution,
    for more than half of them."""
    n = int(random.integers(1, 7))
    M = np.where(
        random.random((n, n)) < random.choice([0.2, 0.35, 0.5, 0.8]),
        random.integers(-2, 3, (n, n)),
        0,
    )
    lower, upper = bounds(random, n)
    if n > 1:
        PATTERNS[random.integers(len(PATTERNS))](random, M, lower, upper)
    q = random.integers(-2, 3, n)
    if random.random() < 0.6:
        z, w = solution(random, lower, upper)
        q = w - M @ z
    return Problem(
        csr_array(M.astype(float)) if random.random() < 0.3 else M,
        q,
        lower=lower,
        upper=upper,
    )


def bounds(random, n):
    low, high = np.sort(random.integers(-2, 3, (2, n)), axis=0).astype(float)
    # 0 and 1: z >= 0; 2: one more lower bound; 3: an upper one; 4: both; 5: fixed.
    kind = random.integers(7, size=n)
    lower = np.select([kind <= 1, np.isin(kind, (2, 4, 5))], [0.0, low], -np.inf)
    return lower, np.select([np.isin(kind, (3, 4)), kind == 5], [high, low], np.inf)


def solution(random, lower, upper):
    """z within the bounds, and w with the signs for it."""
    inside = np.clip(
        np.where(np.isfinite(lower), lower, 0) + random.integers(0, 2, lower.size),
        lower,
        upper,
    )
    z = np.where(np.isfinite(lower) & (random.random(lower.size) < 0.5), lower, inside)
    low, high = np.where(z == upper, -1, 0), np.where(z == lower, 2, 1)
    return z, random.integers(low, high).astype(float)


def repeated(random, M, lower, upper):
    i, j = random.choice(lower.size, 2, replace=False)
    M[j] = M[i] * random.choice([-1, 1, 2])
    M[:, j] = M[:, i] * random.choice([-1, 1, 2])
    lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def single_in_row(random, M, lower, upper):
    i, j = random.integers(lower.size, size=2)
    M[i], M[i, j] = 0, random.choice([-1, 1, 2])
    if random.random() < 0.5:
        lower[i], upper[i] = -np.inf, np.inf


def single_in_column(random, M, lower, upper):
    i, j = random.integers(lower.size, size=2)
    M[:, j], M[i, j] = 0, random.choice([-1, 1, 2])
    lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def bound(random, M, lower, upper):
    """Rows that are bounds of one variable, each with its multiplier."""
    j, *rows = random.permutation(lower.size)[:3].tolist()
    for i in rows:
        M[i], M[:, i] = 0, 0
        M[i, j], M[j, i] = random.choice([-1, 1], 2)
        lower[i], upper[i] = (0, np.inf) if random.random() < 0.7 else (-np.inf, 0)


def pair(random, M, lower, upper):
    """An equation of two variables, with its multiplier."""
    i, j, k = random.permutation(max(lower.size, 3))[:3] % lower.size
    if i not in (j, k) and j != k:
        M[i], M[:, i] = 0, 0
        M[i, j], M[i, k] = M[j, i], M[k, i] = random.choice([-2, -1, 1, 2], 2)
        M[:, i] *= random.choice([-1, 1])
        lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def skew(random, M, lower, upper):
    """Skew-symmetric but for the signs and the order of equations."""
    M[:] = np.triu(M, 1) - np.triu(M, 1).T
    free = np.flatnonzero(np.isinf(lower) & np.isinf(upper))
    M[free] = M[random.permutation(free)] * random.choice([-1, 1], (free.size, 1))


PATTERNS = (repeated, single_in_row, single_in_column, bound, pair, skew)


def linear_program(seed, written):
    """Conditions of a linear program in x >= 0 with equations and inequalities, as
    models have them: a free variable for the objective, and rows x - l >= 0 with
    multipliers of their own.

    written : "plainly", with "signs" of equations, in "disorder", or with rows in other
        "units".
    """
    random, n, m = default_rng(seed), 30, 18
    is_equation = np.arange(m) < 8
    A = np.where(random.random((m, n)) < 0.2, random.integers(-5, 6, (m, n)), 0)
    x = np.where(random.random(n) < 0.5, random.integers(1, 5, n), 0)
    y = random.integers(-3, 4, m)
    y = np.where(is_equation, y, np.abs(y))
    c = A.T @ y + np.where(x == 0, random.integers(0, 4, n), 0)
    b = A @ x - np.where(is_equation | (y > 0), 0, random.integers(0, 3, m))
    has_signs = is_equation & (written != "plainly")
    s = np.where(has_signs, random.choice([-1, 1], m), 1)
    M = np.block(
        [
            [np.zeros((n, n)), -A.T, -np.eye(n), np.zeros((n, 1))],
            [
                np.vstack((s[:, np.newaxis] * A, np.eye(n))),
                np.zeros((m + n, m + n + 1)),
            ],
            [-c, np.zeros(m + n), 1],
        ]
    )
    q = np.concatenate((c, -s * b, np.zeros(n + 1)))
    is_free = np.concatenate((np.zeros(n), is_equation, np.zeros(n), [1])) > 0
    rows, units = np.arange(q.size), np.ones(q.size)
    if written == "disorder":
        rows[is_free] = random.permutation(rows[is_free])
    if written == "units":
        units = 10 ** random.uniform(-2, 2, q.size)
    order = random.permutation(q.size)
    M, q = (units[:, np.newaxis] * M[rows])[order][:, order], (units * q[rows])[order]
    return Problem(csr_array(M), q, lower=np.where(is_free, -INF, 0)[order])
