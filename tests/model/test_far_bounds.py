"""Bounds of 1e20 and beyond: none by the convention of a format or where the user says
so, else bounds like others, which make no program slower to solve; and changes of
variables, one after another, and the way back in reverse."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Status, from_qp, from_qpsolvers, read, run, solve, write
from lcpcli.model.block_form import Blocks
from lcpcli.model.changes import (
    Composed,
    composed,
    relaxed,
    scale,
    shifted,
    with_infinity,
)
from lcpcli.verify.certificate import Proof

from ..far_bounds import FAR, lists, random_program, with_far_bounds
from ..seeds import few_of

INF = np.inf


def minimum(problem, **options):
    return run(problem, **options).answer


def same(one, other):
    """Whether two problems have the same numbers, and come from programs of the same
    size."""
    if one.n != other.n or (one.M != other.M).sum() or one.origin != other.origin:
        return False
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("q", "lower", "upper")
    )


@pytest.mark.parametrize(("seed", "size"), [(0, 1e30), (12, 1e20)])
def test_programs_with_far_bounds_have_the_minima_of_those_without_in_as_many_steps(
    seed, size
):
    program = random_program(seed, 20 + 3 * seed)
    plain = run(from_qp(**program))
    far = run(from_qp(**with_far_bounds(program, size)), time_limit=60)
    assert plain.solved
    assert far.solved
    assert far.answer.objective == pytest.approx(
        plain.answer.objective, rel=1e-9, abs=1e-9
    )
    assert far.iterations <= 2 * plain.iterations + 10


def test_all_ways_to_say_it_make_the_same_problem(tmp_path):
    program = random_program(0, 8)
    far, plain = with_far_bounds(program, 1e20), from_qp(**program)
    assert same(from_qp(**far, infinity=1e20), plain)
    (tmp_path / "own.json").write_text(json.dumps(lists(far)))
    for name in ("own.json", "z.json", "z.npz"):
        if name != "own.json":
            write(from_qp(**far), tmp_path / name)
        assert not same(read(tmp_path / name), plain), name
        assert same(read(tmp_path / name, infinity=1e20), plain), name
        assert same(with_infinity(read(tmp_path / name), 1e19), plain), name


def test_sparse_programs_names_senses_and_starts_stay_what_they_are():
    names = {"rows": list("abcd"), "columns": ["x", "y"], "sense": "max"}
    parts = FAR | {"Q": None, "A": csr_array(np.array(FAR["A"], dtype=float))}
    given = from_qp(**parts, **names)
    z = np.arange(given.n) + 0.5
    known = {"name": "far", "x0": z, "solutions": [2 * z], "verdict": "ray"}
    changed = with_infinity(replace(given, **known), 1e20)
    assert same(changed, from_qp(**parts, **names, infinity=1e20))
    assert changed.origin.sense == "max"
    assert changed.origin.columns == ("x", "y")
    assert changed.origin.ranges == 0
    assert changed.name == "far"
    assert changed.verdict == ""
    assert changed.x0.tolist() == z[:6].tolist()
    assert changed.solutions[0].tolist() == (2 * z[:6]).tolist()


def test_bounds_of_z_are_none_from_infinity_on_wherever_they_are_given():
    M, q = [[2.0, 1.0], [1.0, 2.0]], [-5.0, 6.0]
    lower, upper = [-1e20, -1e21], [1e19, 1e20]
    plain = {"lower": -INF, "upper": [1e19, INF]}
    problem = Problem(M, q, lower=lower, upper=upper, infinity=1e20)
    assert same(problem, Problem(M, q, **plain))
    assert not Problem(M, q, upper=1e30, infinity=1e30).is_mixed
    expected = solve(M, q, **plain).z.tolist()
    assert solve(M, q, lower=lower, upper=upper, infinity=1e20).z.tolist() == expected
    Q = np.tile(np.reshape(q, (-1, 1)), 5)
    for bound in (lower, np.tile(np.reshape(lower, (-1, 1)), 5)):
        for result in lcpcli.solve_many(M, Q, lower=bound, upper=1e30, infinity=1e20):
            assert result.problem.box.kinds == {"free": 2}
    G, h = [[1.0, 0.0], [0.0, 1.0]], [1e20, 5.0]
    assert same(
        from_qpsolvers(M, q, G, h, lb=lower, infinity=1e20),
        from_qpsolvers(M, q, G, [INF, 5.0]),
    )
    x = lcpcli.solve_qp(M, [-4.0, -2.0], G, h, ub=1e25, infinity=1e20)
    assert x.tolist() == [2, 0]


def test_a_minimum_at_a_far_bound_is_found_where_nobody_takes_it_for_none():
    for variables in (1, 8):
        program = {"Q": None, "c": -np.ones(variables), "upper": 1e20}
        x = minimum(from_qp(**program)).x
        assert set(x.tolist()) == {1e20}
        assert (
            minimum(from_qp(**program, infinity=1e20)).statement
            == "the program is unbounded below"
        )


@pytest.mark.parametrize("size", [1e20, 1e30])
def test_proofs_are_of_the_program_with_its_far_bounds(size):
    program = random_program(4, 30)
    row = np.zeros((2, 30))
    row[:, 0] = 1
    opposed = {"A": np.vstack((program["A"], row))}
    opposed |= {
        name: np.append(program[name], ends)
        for name, ends in (("row_lower", [5, -INF]), ("row_upper", [INF, 4]))
    }
    problem = from_qp(**with_far_bounds(program | opposed, size))
    result = run(problem, time_limit=60)
    assert result.status is Status.INFEASIBLE
    assert lcpcli.check(problem, y=result.certificate.vector).accepted


def test_changes_are_made_in_turn_and_undone_in_reverse():
    """Numbers that doubles have exactly: nothing is rounded on either way."""
    problem = Problem([[256.0, 1], [-1, 64]], [3.0, -5], lower=[-4, 2], upper=[INF, 8])
    change = composed(problem, shifted, scale)
    assert isinstance(change, Composed)
    first, second = change.first, change.second
    assert second.original is first.problem
    assert change.problem is second.problem
    assert not change.is_identity
    x = np.array([-3.0, 3.5])
    assert np.array_equal(change.start(x), second.start(first.start(x)))
    assert np.array_equal(change.back(change.start(x)), x)
    F = np.array([0.25, -3.0])
    assert np.array_equal(
        change.residual(second.problem.q), first.residual(first.problem.q)
    )
    assert np.array_equal(change.residual(F), first.residual(second.residual(F)))
    assert change.is_exact


def test_a_change_that_loses_a_bound_makes_the_whole_inexact():
    problem = Problem([[2.0, 1], [1, 2]], [-5, -6], lower=-1, upper=1e30)
    assert shifted(relaxed(problem).problem).is_exact
    assert not composed(problem, relaxed, shifted).is_exact


@pytest.mark.parametrize("seed", few_of(range(12), 4))
@pytest.mark.parametrize("kind", ["linear", "convex"])
def test_sides_that_nothing_reaches_change_no_answer(kind, seed):
    """A planted minimizer, and sides from 1e13 to 1e22 where others have none."""
    generator = np.random.default_rng([seed, kind == "convex"])
    n, m = int(generator.integers(5, 20)), int(generator.integers(3, 12))

    def far(size):
        conventions = generator.choice([1e15, 1e18, 1e19, 9.99e19, 1e20], size)
        others = 10.0 ** generator.uniform(13, 22, size)
        return np.where(generator.random(size) < 0.5, conventions, others)

    A = np.where(generator.random((m, n)) < 0.5, generator.standard_normal((m, n)), 0)
    x = np.where(generator.random(n) < 0.5, generator.uniform(0, 5, n), 0.0)
    y = np.where(generator.random(m) < 0.6, generator.uniform(0.1, 5, m), 0.0)
    y *= generator.choice([-1, 1], m)
    Q = np.zeros((n, n))
    if kind == "convex":
        F = generator.standard_normal((n, 3))
        Q = F @ F.T
    c = A.T @ y - Q @ x + np.where(x > 0, 0.0, generator.uniform(0, 3, n))
    low = np.where(y > 0, A @ x, -far(m))
    high = np.where(y < 0, A @ x, far(m))
    bounds = {"row_lower": low, "row_upper": high, "lower": 0.0, "upper": far(n)}
    problem = from_qp(Q, c, A, **bounds)
    assert problem.has_far_sides
    result = lcpcli.run(problem)
    assert result.solved
    assert lcpcli.check(problem, result.z).accepted
    least = x @ Q @ x / 2 + c @ x
    assert abs(result.answer.objective - least) <= 1e-9 * (1 + np.abs(c) @ x)


def test_only_sides_ahead_are_met():
    """As x1 grows to its far bound, it moves away from the far side of the row; x2
    grows towards that of the other row."""
    A, ends = [[2.0, 0.0], [0.0, 1.0]], {"row_lower": -1e18, "row_upper": [INF, 1e17]}
    problem = from_qp(None, [-1.0, -1.0], A, upper=[1e19, INF], **ends)
    result = lcpcli.run(problem)
    assert result.solved
    assert result.z[:2].tolist() == [1e19, 1e17]
    problem = from_qp(None, [-1.0], [[2.0]], row_upper=1e18, upper=1e19)
    assert lcpcli.run(problem).z[0] == 5e17


@pytest.mark.parametrize("bound", [1.9e22, 8e22])
def test_far_sides_that_are_met_together_keep_their_ratio(bound):
    """x1 / 2 is at most 1e22 in a row, beside sides that are far smaller."""
    A = np.diag([0.5, *np.ones(12)])
    A[1:, 1:] += np.eye(12, k=1) / 2
    upper, low = np.append(bound, np.full(12, 1e13)), np.append(-1e20, np.ones(12))
    costs = np.append(-1.0, np.arange(1.0, 13))
    high = np.append(1e22, np.full(12, 1e18))
    problem = from_qp(None, costs, A, row_lower=low, row_upper=high, upper=upper)
    result = lcpcli.run(problem)
    assert result.solved
    assert result.z[0] == min(bound, 2e22)
    assert (A @ result.z[:13])[1:].min() >= 1 - 1e-12


@pytest.mark.parametrize("size", [1e13, 1e20, 1e30])
def test_rounding_of_a_proof_times_a_far_bound_counts_as_0(size):
    """Two opposed rows: their exact multipliers are equal, and those given are not. If
    the rows differ in the last digit, a large x satisfies both."""
    row = np.array([0.1, 0.7, -0.3])
    y = np.array([0.0, 0.0, 0.0, 11.3, -11.3 * (1 + 2**-50)])
    sides = {"row_lower": [2.0, -INF], "row_upper": [INF, 1.0], "upper": size}
    problem = from_qp(None, [1.0, 1.0, 1.0], [row, row], **sides)
    assert Proof("farkas", y).holds(problem)
    assert lcpcli.run(problem).status is Status.INFEASIBLE
    other = row.copy()
    other[1] -= 2**-53
    differs = from_qp(None, [1.0, 1.0, 1.0], [row, other], **sides)
    assert Proof("farkas", y).holds(differs) == (size < 1e15)


def test_far_sides_of_unknowns_without_reduced_costs_do_not_count():
    """A minimizer at the bounds of x1, which costs, and of x2, which costs nothing."""
    ends = {"row_lower": [1.0], "lower": [0.0, -1e18], "upper": [1e22, 1e13]}
    problem = from_qp(None, [-1.0, 0.0], [[1.0, 0.0]], **ends)
    assert lcpcli.run(problem).z[0] == 1e22


def test_a_basis_with_an_infinite_bound_is_no_error():
    """Without far sides, unknowns are at bounds that they do not have there."""
    f = np.array([0, 0, 1, -1, 0, 1, -1, -1.0])
    A = [
        [0, -1, 1, -3, 0, 0, 3, -1],
        [0, -2, 0, 0, -1, 2, 2, 0],
        [-3, 1, 0, 0, 0, 3, -3, 3],
    ]
    problem = from_qp(
        np.outer(f, f),
        [0, 0, -1, -1, 2, -3, -2, 0],
        A,
        row_lower=[-3, -INF, -INF],
        row_upper=[1e15, 1e13, 6],
        lower=[0, 0, 0, -1e14, 0, 0, 0, -1e17],
        upper=[2, 1e22, 1e14, 1e20, INF, 1e16, 1e19, INF],
    )
    result = lcpcli.run(problem)
    assert result.solved
    assert lcpcli.check(problem, result.z).accepted


def test_an_objective_keeps_its_digits_where_its_terms_cancel():
    """Qx is rounding of terms of 1e12, which x times it is not."""
    F, c, x = np.array([0.3, -0.7]), np.array([1.0, -2.0]), np.array([7e12, 3e12])
    Q, no_rows, ends = np.outer(F, F), np.zeros((0, 2)), np.zeros((4, 0))
    f, g = (list(map(Fraction, values.tolist())) for values in (c, x))
    exactly = f[0] * g[0] + f[1] * g[1]
    for i, row in enumerate(Q.tolist()):
        exactly += sum(g[i] * Fraction(a) * b for a, b in zip(row, g, strict=True)) / 2
    for stored in (Q, csr_array(Q)):
        data = Blocks(stored, c, no_rows, *ends)
        assert data.objective(x) == pytest.approx(float(exactly), rel=1e-14)
