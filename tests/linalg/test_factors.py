"""Systems with M + diag(d) and with principal submatrices: borders, tridiagonal ones,
many at once, and orders. Linear programs: the dual simplex method beside HiGHS, which
prints nothing, and HiGHS in its own package beside the one in scipy; numbers that
overflow reach none of the singular values of LAPACK, on which these might never end.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array, diags_array

from lcpcli.basis.dual_simplex import DualSimplex
from lcpcli.basis.free_variables import combinations
from lcpcli.linalg import factors, krylov, matrices, programs, shifted_systems
from lcpcli.linalg.compressed_rows import block
from lcpcli.linalg.doubles import in_range
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.patterns import is_structurally_singular
from lcpcli.linalg.programs import minimized
from lcpcli.linalg.shifted_systems import Bordered
from lcpcli.linalg.units import PseudoInverse


def test_a_finish_with_few_dense_rows_eliminates_the_diagonal_rest_densely():
    """The conditions of min x'Dx / 2 with 40 full rows, for one set of basic variables;
    some D_ii are 0."""
    pytest.importorskip("qdldl")
    random = default_rng(3)
    A, D = random.normal(size=(40, 300)), np.arange(300.0) % 3
    M = np.block([[np.diag(D), -A.T], [A, np.zeros((40, 40))]])
    chosen = shifted_systems.systems(
        csr_array(M), np.repeat([1.0, -1.0], [300, 40]), once=True
    )
    assert isinstance(chosen, Bordered)
    d, b = np.full(340, 1e-3), random.normal(size=340)
    chosen.factorize(d)
    expected = np.linalg.solve(M + np.diag(d), b)
    assert np.abs(chosen.solve(b) - expected).max() <= 1e-9 * np.abs(expected).max()
    with pytest.raises(SingularMatrix):
        chosen.factorize(np.zeros(340))


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.integers(1, 12), st.integers(0, 12))
def test_blocks_and_products_of_sparse_matrices_are_those_of_dense_ones(seed, m, n):
    random = np.random.default_rng(seed)
    A = random.integers(-3, 4, (m, n)) * (random.random((m, n)) < random.random())
    M = csr_array(A.astype(float))
    rows, columns = (
        np.flatnonzero(random.random(size) < random.random()) for size in (m, n)
    )
    indptr, indices, data = block(M, rows, columns)
    found = csr_array((data, indices, indptr), shape=(rows.size, columns.size))
    assert np.array_equal(found.toarray(), A[rows][:, columns])
    assert found.has_canonical_format
    wide = random.integers(-9, 10, (n, 2)).astype(float)
    for form in (M, M.tocsc(), M.astype(np.float32)):
        for each in (wide, wide[:, 0], wide[:, 1].astype(np.float32)):
            assert np.array_equal(matrices.product(form, each), A @ each)
            assert np.array_equal(
                matrices.absolute_product(form, each), np.abs(A) @ each
            )
    with pytest.raises(ValueError, match=r"(?i)dimension|mismatch"):
        matrices.product(M, np.zeros(n + 1))


@settings(max_examples=25)
@given(st.integers(2, 12), st.integers(0, 2**32 - 1))
def test_principal_systems_of_tridiagonal_matrices_are_those_of_the_dense_matrix(
    n, seed
):
    random = np.random.default_rng(seed)
    below, diagonal, above = (random.normal(size=size) for size in (n - 1, n, n - 1))
    M = csr_array(diags_array([below, diagonal, above], offsets=[-1, 0, 1]))
    P = np.flatnonzero(random.random(n) < 0.7)
    A, b = M.toarray()[np.ix_(P, P)], random.normal(size=P.size)
    if not P.size or np.linalg.cond(A) > 1e6:
        return
    expected = np.linalg.solve(A, b)
    assert np.abs(PrincipalSolver(M).at(P)(b) - expected).max() <= 1e-7 * max(
        1.0, np.abs(expected).max()
    )


@pytest.mark.parametrize("form", [np.array, csr_array])
def test_a_matrix_is_solved_as_a_definite_one_only_if_it_is(form):
    one, other = form([[2.0, 1.0], [1.0, 2.0]]), form([[1.0, 2.0], [2.0, 1.0]])
    assert factors.definite_solver(one)(np.ones(2)) == pytest.approx(1 / 3)
    assert factors.definite_solver(other) is None


def test_each_submatrix_is_factorized_once(monkeypatch):
    generator = default_rng(0)
    n, m = 70, 90
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((5, n))[generator.integers(5, size=m)] < 0.5
    sets[7] = False
    B = generator.standard_normal((m, n))
    factorized = []
    real = np.linalg.solve
    monkeypatch.setattr(
        np.linalg, "solve", lambda A, b: factorized.append(A.shape[0]) or real(A, b)
    )
    X = factors.solve_principal(M, sets, B)
    assert sum(factorized) == 5
    for x, P, b in zip(X, sets, B, strict=True):
        assert np.allclose(M[np.ix_(P, P)] @ x[P], b[P], rtol=0, atol=1e-12)
        assert not x[~P].any()


def test_sets_of_most_indices_are_solved_for_by_their_complements():
    generator = default_rng(0)
    n, m = 30, 40
    M = generator.standard_normal((n, n)) + 3 * np.sqrt(n) * np.eye(n)
    sets = generator.random((m, n)) < np.linspace(0, 1.1, m)[:, np.newaxis]
    assert sets[-1].all()
    B, inverse = generator.standard_normal((m, n)), factors.well_conditioned_inverse(M)
    assert inverse is not None
    ours = factors.solve_principal(M, sets, B, inverse)
    plain = factors.solve_principal(M, sets, B)
    assert np.allclose(ours, plain, rtol=0, atol=1e-12)
    assert np.array_equal(ours != 0, sets)
    assert factors.well_conditioned_inverse(M * np.geomspace(1, 1e9, n)) is None
    assert factors.well_conditioned_inverse(np.zeros((2, 2))) is None


def test_singular_submatrices_spoil_no_others():
    M = np.diag([1.0, 0.0, 2.0, 4.0])
    sets = np.array(
        [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1], [1, 1, 0, 0]],
        dtype=bool,
    )
    X = factors.solve_principal(M, sets, np.full((5, 4), 4.0))
    assert np.isnan(X).any(axis=1).tolist() == [False, True, False, False, True]
    assert X[[0, 2, 3]].tolist() == [[4, 0, 0, 0], [0, 0, 2, 0], [0, 0, 2, 1]]


def test_patterns_of_singular_matrices_alone_are_structurally_singular():
    random = default_rng(0)
    found = set()
    for _ in range(60):
        A = np.where(random.random((12, 12)) < 0.25, random.normal(size=(12, 12)), 0.0)
        singular = is_structurally_singular(csr_array(A))
        assert singular == (np.linalg.matrix_rank(A) < 12)
        found.add(singular)
    assert found == {True, False}


def is_feasible(A, b, zero):
    """Whether some z, w >= 0 has w = A z + b and these forms 0, by an LP solver."""
    m, n = A.shape
    upper = np.full(n + m, np.inf)
    upper[zero] = 0.0
    equations = np.hstack((-A, np.eye(m)))
    return (
        minimized(np.zeros(n + m), equations, (b, b), (np.zeros(n + m), upper))
        is not None
    )


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_points_and_multipliers_agree_with_an_lp_solver(seed):
    random = np.random.default_rng(seed)
    m, n = (int(size) for size in random.integers(1, 9, 2))
    A, b = random.normal(size=(m, n)), random.normal(size=m)
    system, zero = DualSimplex(A, b), []
    y = system.feasible()
    for form in random.permutation(n + m)[: n + 1].tolist():
        assert (y is None) == is_feasible(A, b, zero)
        if y is not None:
            break
        point = system.point()
        z, w = point
        assert min(z.min(), w.min()) >= -1e-6
        np.testing.assert_allclose(w, A @ z + b, atol=1e-5 * max(1.0, float(z.max())))
        assert not np.concatenate((z, w))[zero].any()
        zero.append(form)
        y = system.fix_at_zero(form)
    if y is not None:
        product = A.T @ y
        assert b @ y < 0
        assert (
            product[[j for j in range(n) if j not in zero]] <= 1e-6 * np.abs(y).max()
        ).all()
        assert (
            y[[i for i in range(m) if n + i not in zero]] >= -1e-9 * np.abs(y).max()
        ).all()


def test_a_point_that_only_the_margin_admits_is_none():
    system = DualSimplex(np.array([[0.0]]), np.array([-1.0]))
    assert system.feasible() is not None  # a column of zeros has no margin
    system = DualSimplex(np.eye(2), np.array([-1.0, -1.0]))
    assert system.feasible() is None
    assert system.point() is not None
    # z_1 = 0, and w_1 = delta z_2 - 1 >= 0 for a z_2 of 5e8.
    assert system.fix_at_zero(0) is None
    assert system.point() is None


def by_both(monkeypatch, *program):
    pytest.importorskip("highspy")
    own = minimized(*program)
    monkeypatch.setattr(programs, "find_spec", lambda _: None)
    return own, minimized(*program)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("form", [np.asarray, csr_array])
def test_both_find_the_same_minimum_and_multipliers(seed, form, monkeypatch):
    random = default_rng(seed)
    A, x = random.integers(-3, 4, (7, 12)).astype(float), random.random(12)
    low = A @ x - np.array([0, 0, 1, 1, 1, 2, 3])
    high = A @ x + np.array([0, 0, np.inf, np.inf, 1, 2, 3])
    low[4] = -np.inf
    bounds = np.where(random.random(12) < 0.2, -5.0, 0.0), np.full(12, 5.0)
    objective = random.standard_normal(12)
    for found in by_both(monkeypatch, objective, form(A), (low, high), bounds):
        assert found.value == pytest.approx(objective @ found.x)
        reduced = objective - A.T @ found.y
        for multipliers, values, ends in (
            (found.y, A @ found.x, (low, high)),
            (reduced, found.x, bounds),
        ):
            nonzero = np.abs(multipliers) > 1e-9
            assert values[nonzero] == pytest.approx(
                np.where(multipliers > 0, *ends)[nonzero]
            )


@pytest.mark.parametrize(
    ("c", "high"), [(-1.0, np.inf), (1.0, -1.0)], ids=["unbounded", "infeasible"]
)
def test_neither_finds_a_minimum_where_there_is_none_nor_prints(
    c, high, monkeypatch, capfd
):
    ends = (np.array([-np.inf]), np.array([high]))
    bounds = (np.zeros(1), np.full(1, np.inf))
    assert by_both(monkeypatch, np.full(1, c), np.eye(1), ends, bounds) == (None, None)
    assert capfd.readouterr() == ("", "")


@np.errstate(all="ignore")
def test_a_matrix_whose_numbers_overflow_has_no_generalized_inverse():
    with pytest.raises(SingularMatrix):
        PseudoInverse(np.array([[-1e308, 5e-324], [1.0, 1.0]]))


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_equations_that_overflow_are_not_combined(value):
    G = np.diag([1.0, value, 1.0])
    with pytest.raises(SingularMatrix):
        combinations(G, G)


@pytest.mark.parametrize("n", [6, 20])
def test_bicgstab_ends_within_as_many_steps_as_there_are_unknowns(n):
    random = default_rng(n)
    A = 3 * np.eye(n) + random.standard_normal((n, n)) / np.sqrt(n)
    x = random.standard_normal(n)
    found, _ = krylov.bicgstab(
        lambda v: A @ v,
        A @ x,
        np.zeros(n),
        krylov.StoppingCriterion(0.0, n),
        krylov.identity,
    )
    assert np.abs(found - x).max() <= 1e-8 * np.abs(x).max()


def test_a_vector_in_range_is_that_of_exact_numbers_but_for_one_power_of_two():
    """Also times factors that are no powers of two, whose exponents carry."""
    random = default_rng(0)
    for _ in range(50):
        y = np.ldexp(random.integers(-9, 10, 8).astype(float), random.integers(-99, 99))
        R = random.choice([0.75, 1.0, 3.0, 5.0, 7.0], 8)
        scaled = in_range(y, R)
        exact = [Fraction(a) * Fraction(b) for a, b in zip(y, R, strict=True)]
        pairs = zip(scaled.tolist(), exact, strict=True)
        (factor,) = {Fraction(a) / b for a, b in pairs if b}
        assert math.frexp(factor)[0] == 0.5
        assert 1 <= np.abs(scaled).max() < 2
