"""Derivatives of solutions: against differences of exact solutions, reverse against
forward, refusals, and kinks, where a component is at a bound and w is 0. Those of a
batch are those of its results one by one; and of J z where z is one of several
solutions, as with redundant contacts.
"""

import pickle
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, run
from lcpcli.errors import DerivativeError
from lcpcli.gallery import families
from lcpcli.linalg.matrices import dense
from lcpcli.parametric import derivative
from lcpcli.parametric.derivative import Linearizations

from .. import exact, mixed_problems
from ..dependent_rows import dependent_program, of_states, strict_states
from ..seeds import few_of
from .families import exact_derivative, exact_z, random_change, random_problem


def pairing(gradient, change):
    """The sum of the products of all derivatives with the changes."""
    return sum(
        float(np.sum(dense(getattr(gradient, name[1:])) * dense(move)))
        for name, move in change.items()
    )


@pytest.mark.parametrize("n", [1, 3, 8, 20])
@pytest.mark.parametrize("mixed", [False, True])
def test_derivatives_by_all_data_are_those_of_the_exact_solutions(n, mixed):
    for seed in range(2 if n < 10 else 1):
        random = default_rng(seed)
        problem = random_problem(n, random, mixed)
        change = random_change(problem, random)
        result = run(problem)
        for one in ({"dM": change["dM"]}, {"dq": change["dq"]}, change):
            found, known = result.derivative(**one), exact_derivative(problem, one)
            assert found.kinks == []
            assert found.strongly_regular
            assert (
                np.abs(found.z - known).max()
                <= (1e-12 if n < 10 else 1e-11) * np.abs(known).max()
            )


@pytest.mark.parametrize(
    ("seed", "sparse"), few_of(product(range(8), (False, True)), 6)
)
def test_gradient_is_the_adjoint_of_the_derivative(seed, sparse):
    random = default_rng(seed)
    problem = random_problem(int(random.integers(1, 40)), random, mixed=seed % 2 > 0)
    change = random_change(problem, random)
    if sparse:
        pattern = np.eye(problem.n) + (random.random((problem.n, problem.n)) < 0.2) > 0
        M = csr_array(problem.M * pattern + 10 * np.eye(problem.n))
        problem = Problem(M, problem.q, lower=problem.lower, upper=problem.upper)
        change["dM"] = csr_array(change["dM"] * (M.toarray() != 0))
    result, g = run(problem), random.normal(size=problem.n)
    gradient, derivative = result.gradient(g), result.derivative(**change)
    if sparse:
        assert np.array_equal(gradient.M.indices, problem.M.indices)
        assert np.array_equal(gradient.M.indptr, problem.M.indptr)
    sizes = {name: abs(move) for name, move in change.items()}
    terms = abs(pairing(gradient, sizes)) + np.abs(g) @ np.abs(derivative.z)
    assert abs(pairing(gradient, change) - g @ derivative.z) <= 1e-11 * terms
    w = dense(change["dM"]) @ result.z + change["dq"] + problem.M @ derivative.z
    assert np.abs(w - derivative.w).max() <= 1e-11 * np.abs(w).max(initial=1.0)


def test_results_of_columns_are_pickled_with_their_derivatives():
    (result,) = lcpcli.solve_many([[4.0, 1.0], [1.0, 4.0]], [[-1.0], [1.0]])
    gradient = result.gradient([1.0, 2.0])
    again = pickle.loads(pickle.dumps(result)).gradient([1.0, 2.0])
    assert gradient.q.tolist() == again.q.tolist()
    assert pickle.loads(pickle.dumps(gradient)).M.tolist() == gradient.M.tolist()


def with_kinks(n, kinks, random, mixed):
    """A random problem, of integers, with z and w that are 0 in some components, the
    bounds apart from 0 if mixed."""
    M = np.rint(4 * mixed_problems.monotone(n, random)[0]) + 4 * np.eye(n)
    lower = random.integers(-3, 3, n).astype(float) if mixed else np.zeros(n)
    upper = lower + random.integers(3, 6, n) if mixed else np.full(n, np.inf)
    states = random.integers(-1, 2 if mixed else 1, n)
    states[:kinks] = np.where(states[:kinks] == 0, -1, states[:kinks])
    z = np.where(states < 0, lower, np.where(states > 0, upper, lower + 1))
    w = -states * random.integers(1, 5, n).astype(float)
    w[:kinks] = 0.0
    order = random.permutation(n)
    return Problem(
        M[order][:, order],
        (w - M @ z)[order],
        lower=lower[order],
        upper=upper[order],
        note=" ".join(map(str, np.flatnonzero(order < kinks))),
    )


@pytest.mark.parametrize(("seed", "mixed"), few_of(product(range(8), (False, True)), 4))
def test_at_kinks_one_sided_derivatives_are_those_of_small_steps(seed, mixed):
    """But for rounding, unless M changes too."""
    random = default_rng(seed)
    n = int(random.integers(1, 9))
    problem = with_kinks(n, int(random.integers(1, n + 1)), random, mixed)
    result, h = run(problem), 2.0**-30
    dq = random.integers(-5, 6, n).astype(float)
    dM = random.integers(-5, 6, (n, n)).astype(float)
    low, high = random.integers(-2, 3, (2, n)) * np.isfinite(problem.box.vectors(n))
    z = exact_z(problem, {}, 0.0)
    for change in (
        {"dq": dq},
        {"dq": dq, "dlower": low, "dupper": high},
        {"dM": dM, "dq": dq},
    ):
        found = result.derivative(**change, one_sided=True)
        assert (
            found.kinks
            == result.gradient(dq).kinks
            == [int(i) for i in problem.note.split()]
        )
        assert found.strongly_regular
        known = np.array(
            [
                float((a - b) / Fraction(h))
                for a, b in zip(exact_z(problem, change, h), z, strict=True)
            ]
        )
        error = (
            1e-6 * np.abs(known).max(initial=1.0)
            if "dM" in change
            else 1e-12 * np.abs(known).max()
        )
        assert np.abs(found.z - known).max() <= error


def test_the_direction_at_many_kinks_of_an_unclassified_matrix_is_unproved():
    random = default_rng(0)
    M, d = exact.p_matrix(random, 16), random.normal(size=16)
    found = lcpcli.solve(M, np.zeros(16)).derivative(dq=d, one_sided=True)
    assert found.strongly_regular is None
    assert found.kinks == list(range(16))
    known = lcpcli.solve(M, d).z
    assert np.abs(found.z - known).max() <= 1e-11 * np.abs(known).max()


@pytest.mark.parametrize("unit", [2.0**-60, 1.0, 2.0**60])
def test_a_complement_that_may_be_rounding_gives_no_direction(unit):
    """1e-13 is far above rounding, 4e-16 is not: 1 over it is no derivative, in any
    units of w."""
    nearly, singular = (
        run(
            Problem(
                [[0.1 * unit, 0.3 * unit], [unit, 3 * (1 + far) * unit]],
                [-0.1 * unit, -unit],
            ),
            z0=[1, 0],
        )
        for far in (1e-13, 4e-16)
    )
    found = nearly.derivative(dq=[0, -unit], one_sided=True)
    assert found.kinks == [1]
    assert found.strongly_regular
    with pytest.raises(
        DerivativeError, match="no derivative could be computed in this"
    ):
        singular.derivative(dq=[0, -unit], one_sided=True)


@pytest.mark.parametrize("power", [-12, -6])
def test_components_that_are_nearly_at_a_kink_are_not(power):
    problem = families.make("near-degenerate", 40, epsilon=10.0**power)
    found = run(problem).derivative(dq=np.ones(40))
    assert found.kinks == []
    assert found.strongly_regular


# Without a solution, and with several.
@pytest.mark.parametrize("M", [[[0, 1], [1, 0]], [[1, 1], [1, 1]]])
def test_a_function_that_does_not_depend_on_z_has_the_gradient_0(M):
    result = lcpcli.solve(M, [-1, 1] if M[0][0] == 0 else [-1, -1])
    for J in (None, np.eye(2)):
        gradient = result.gradient([0, 0], J=J)
        for values in (gradient.M, gradient.q, gradient.lower, gradient.upper):
            assert not np.any(values)
    if not result.solved:
        with pytest.raises(DerivativeError):
            result.gradient([1, 0])


B = 10
ARRAYS = ("q", "M", "lower", "upper")


def assert_close(found, known, size):
    assert np.allclose(found, known, rtol=1e-9, atol=1e-10 * size, equal_nan=True)


def assert_as_one_by_one(batch, g, changes, J, sided):
    """All derivatives of a batch, with nan for none, against those of its results."""
    by = batch.gradient(g, J=J, unsolved="nan")
    along = batch.derivative(**changes, one_sided=sided, J=J, unsolved="nan")
    for i, result in enumerate(batch):
        try:
            alone = result.gradient(g[i], J=J)
        except DerivativeError:
            assert all(np.isnan(getattr(by, name)[i]).all() for name in ARRAYS)
        else:
            size = float(np.abs(alone.M).max(initial=1.0))
            for name in ARRAYS:
                assert_close(getattr(by, name)[i], getattr(alone, name), size)
            assert by.kinks.get(i, []) == alone.kinks
        try:
            there = result.derivative(
                **{name: change[i] for name, change in changes.items()},
                one_sided=sided,
                J=J,
            )
        except DerivativeError:
            assert np.isnan(along.z[i]).all()
            assert np.isnan(along.w[i]).all()
            assert along.strongly_regular[i] is None
        else:
            size = float(np.abs(there.z).max(initial=1.0))
            assert_close(along.z[i], there.z, size)
            assert_close(along.w[i], there.w, 100 * size)
            assert along.kinks.get(i, []) == there.kinks
            assert along.strongly_regular[i] == there.strongly_regular


@pytest.mark.parametrize(("seed", "mixed"), few_of(product(range(3), (False, True)), 3))
def test_derivatives_of_random_batches_are_those_of_their_results(
    seed, mixed, monkeypatch
):
    stacks = []

    class Noted(Linearizations):
        def __init__(self, *given):
            super().__init__(*given)
            stacks.append(self)

    monkeypatch.setattr(derivative, "Linearizations", Noted)
    random = default_rng(seed)
    n = int(random.integers(1, 15))
    problems = [random_problem(n, random, mixed) for _ in range(B)]
    moves = [random_change(problem, random) for problem in problems]
    changes = {name: np.array([move[name] for move in moves]) for name in moves[0]}
    bounds = np.array([problem.box.vectors(n) for problem in problems])
    M, q = (
        np.array([getattr(problem, name) for problem in problems])
        for name in ("M", "q")
    )
    batch = lcpcli.solve_many(M, q, lower=bounds[:, 0], upper=bounds[:, 1])
    for J in (None, random.normal(size=(2, n))):
        g = random.normal(size=(B, n if J is None else 2))
        assert_as_one_by_one(batch, g, changes, J, sided=False)
    (stack,) = stacks
    assert stack.clear.sum() > B / 2, "most are computed at once"


@settings(max_examples=12)
@given(
    arrays(float, (5, 3, 3), elements=st.integers(-2, 2)),
    arrays(float, (5, 3), elements=st.integers(-2, 2)),
    st.sampled_from([(0.0, np.inf), (-1.0, 1.0)]),
    st.booleans(),
    st.booleans(),
)
def test_kinks_singular_and_unsolved_problems_are_those_of_their_results(
    M, q, bounds, sided, with_J
):
    g, changes = (
        np.ones((5, 3)),
        {"dq": np.tile([1.0, -2, 3], (5, 1)), "dM": np.ones((5, 3, 3))},
    )
    J = np.array([[1.0, 1, 0], [0, 1, 1], [0, 0, 1]]) if with_J else None
    assert_as_one_by_one(
        lcpcli.solve_many(M, q, lower=bounds[0], upper=bounds[1]), g, changes, J, sided
    )


# One has no solution.
M, Q = [np.eye(2), [[0.0, 1], [1, 0]], np.ones((2, 2))], [[-1.0, -2], [-1, 1], [-1, -1]]


def test_the_first_problem_without_derivatives_is_named_or_its_row_is_nan():
    batch, g = lcpcli.solve_many(M, Q), np.ones((3, 2))
    for call in (batch.gradient, lambda g: batch.derivative(dq=g)):
        with pytest.raises(
            DerivativeError,
            match=r"^batch\[1\]: no derivative, as the problem is not solved: has no",
        ):
            call(g)
    gradient = batch.gradient(g, unsolved="nan")
    assert np.isnan(gradient.q).all(axis=1).tolist() == [False, True, False]
    assert gradient.q[0].tolist() == [-1.0, -1.0]


def test_what_is_given_without_a_first_dimension_is_the_same_for_all():
    batch = lcpcli.solve_many([np.eye(2), 2 * np.eye(2)], [[-1, -2], [-3, 4]])
    assert batch.gradient([1, 2]).q.tolist() == [[-1.0, -2.0], [-0.5, 0.0]]
    assert batch.derivative(dM=np.eye(2)).z.tolist() == [[-1.0, -2.0], [-0.75, 0.0]]
    assert batch.derivative(dq=[1, 1], J=[[1, 0]]).z.tolist() == [[-1.0], [-0.5]]


# Whose z is within the set of solutions, or a vertex of it.
METHODS = ("interior", "lemke", "auto")


G = np.array([[1.0, 1, 0], [0, 0, 1]])


@pytest.mark.parametrize("scale", [1e-6, 1e9])
@pytest.mark.parametrize("method", METHODS)
def test_it_does_not_depend_on_units_and_names_what_is_not_determined(method, scale):
    R = np.array([1.0, scale, 1.0])
    M = R[:, np.newaxis] * (G.T @ G) * R
    result, J = lcpcli.solve(M, R * (G.T @ [-3, -2]), method), G * R
    assert result.solved
    direction = R * (G.T @ [1.0, 0])
    assert result.derivative(dq=direction, J=J).z == pytest.approx([-1, 0], abs=1e-9)
    assert G @ (result.gradient([1, 0], J=J).q * R) == pytest.approx([-1, 0], abs=1e-9)
    for call in (
        lambda J: result.derivative(dq=direction, J=J),
        lambda J: result.gradient(np.ones(len(J)), J=J),
    ):
        with pytest.raises(
            DerivativeError,
            match="several solutions, which differ in J z, in row 1 of J",
        ):
            call(np.array([J[0], [1.0, 0, 0]]))
    with pytest.raises(
        DerivativeError,
        match="no derivative in this direction: M, q and the bounds change so that",
    ):
        result.derivative(dq=[1, 0, 0], J=J)
    assert result.derivative(dq=[0, 0, 1], J=J).z == pytest.approx([0, -1], abs=1e-9)


def test_w_is_nan_where_the_solutions_differ_in_it():
    """z_1 + z_2 = 1, and w_3 = z_1 - z_2 + 5 depends on which of them it is."""
    M, q = np.array([[1.0, 1, 0], [1, 1, 0], [1, -1, 1]]), np.array([-1.0, -1, 5])
    result = lcpcli.solve(M, q, "interior")
    found = result.derivative(dq=[1, 1, 0], J=[[1, 1, 0]])
    assert found.z == pytest.approx([-1.0])
    assert np.isnan(found.w).tolist() == [False, False, True]
    assert found.strongly_regular is None


@pytest.mark.parametrize("unsolved", ["raise", "nan"])
def test_an_unsolved_problem_of_a_batch_that_is_left_out_has_gradient_0(unsolved):
    batch = lcpcli.solve_many(np.array([[[1.0]], [[-1.0]]]), np.array([[-1.0], [-1.0]]))
    found = batch.gradient(np.array([[1.0], [0.0]]), unsolved=unsolved)
    assert found.q.ravel().tolist() == found.M.ravel().tolist() == [-1, 0]


def test_of_programs_with_rows_that_follow_from_others_x_has_derivatives():
    """J z is differentiated for each component that the equations determine, whatever
    the others are, and for no other; by the gradient of the objective, in fractions."""
    regular = refused = 0
    for seed in range(8):
        program, random = dependent_program(seed), default_rng(seed)
        result = run(program.problem())
        states = strict_states(result)
        if states is None:
            continue
        k, n = len(program.c), result.problem.n
        u = random.integers(-3, 4, k)
        change = [Fraction(int(value)) for value in u]
        moved = [a + b for a, b in zip(program.c, change, strict=True)]
        before = of_states(program, *states)
        after = of_states(program._replace(c=moved), *states)
        assert before is not None
        assert after is not None
        dq = np.concatenate((u, np.zeros(n - k)))
        for i, value in before.items():
            J = np.eye(n)[i : i + 1]
            if value is None:
                with pytest.raises(DerivativeError, match="which differ in J z"):
                    result.derivative(dq=dq, J=J)
                with pytest.raises(DerivativeError, match="which differ in J z"):
                    result.gradient([1.0], J=J)
                refused += 1
                continue
            exact = float(after[i] - value)
            scale = max(1.0, abs(exact))
            found = result.derivative(dq=dq, J=J).z[0]
            gradient = result.gradient([1.0], J=J).q @ dq
            assert found == pytest.approx(exact, abs=1e-7 * scale), (seed, i)
            assert gradient == pytest.approx(exact, abs=1e-7 * scale), (seed, i)
            regular += 1
    assert regular > 15
    assert refused > 2


def at_a_vertex(random):
    """Q, A and the y of c = A'y of min x'Qx / 2 + c'x with its minimum at x = 0. The
    first three rows are A_i x = 0, the others A_i x >= 0; some follow from others."""
    n = int(random.integers(3, 6))
    A = random.normal(size=(2, n))
    A = np.vstack((A, A[0] - A[1], 2 * A[0], random.integers(-2, 3, (n - 1, n))))
    A = np.vstack((A, A[4] + A[5]))
    B = random.normal(size=(n, n))
    y = np.concatenate((random.normal(size=3), random.integers(0, 2, len(A) - 3)))
    return B @ B.T + np.eye(n), A, y


@pytest.mark.parametrize("seed", few_of(range(25), 5))
def test_x_has_one_sided_derivatives_where_several_multipliers_are_at_a_kink(seed):
    """At a vertex in which more rows meet than determine it, for changes of c. The
    derivative is the solution of the program on the critical cone (J. F. Bonnans, A.
    Shapiro, Perturbation Analysis of Optimization Problems, 2000, chapter 5): here one
    with the same rows, of which those with a multiplier are equations."""
    random = default_rng(seed)
    Q, A, y = at_a_vertex(random)
    c = A.T @ y
    n, m = len(c), len(A)
    high = np.where(np.arange(m) < 3, 0.0, np.inf)
    program = {"row_lower": np.zeros(m), "row_upper": high, "lower": None}
    result = run(lcpcli.from_qp(Q, c, A, **program))
    assert np.abs(result.z[:n]).max() <= 1e-12
    change = random.normal(size=n)
    found = result.derivative(
        dq=np.append(change, np.zeros(result.problem.n - n)),
        one_sided=True,
        J=np.eye(n, result.problem.n),
    )
    sides = {"row_lower": np.zeros(m), "row_upper": np.where(y > 0, 0.0, high)}
    cone = lcpcli.from_qp(Q, change, A, **sides, lower=None)
    d = run(cone).z[:n]
    assert found.z == pytest.approx(d, abs=1e-9)
