"""No class is claimed or denied that does not hold exactly, and matrices of known class
are recognised, small ones by definitions in rational arithmetic that share nothing with
the package. Where a definition ranges over all vectors, those of a grid can refute it
only."""

from decimal import Decimal
from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng
from scipy import sparse

from lcpcli.gallery import families
from lcpcli.inspection.classes import definiteness, semidefinite_rank
from lcpcli.inspection.verdict import (
    CLASSES,
    NO,
    UNDECIDED,
    YES,
    classify,
)
from lcpcli.interrupts import deadline_after
from lcpcli.linalg.matrices import dense

from .. import exact
from ..methods.grids import plane
from ..seeds import few_of

IMPLIED = {
    "positive_definite": ("positive_semidefinite", "p_matrix", "strictly_copositive"),
    "positive_semidefinite": (
        "p0_matrix",
        "column_sufficient",
        "row_sufficient",
        "copositive_plus",
    ),
    "m_matrix": ("h_plus", "z_matrix"),
    "h_plus": ("p_matrix",),
    "p_matrix": ("p0_matrix", "column_sufficient", "row_sufficient"),
    "column_sufficient": ("p0_matrix",),
    "row_sufficient": ("p0_matrix",),
    "strictly_copositive": ("copositive_plus",),
    "copositive_plus": ("copositive",),
    "skew_symmetric": ("positive_semidefinite",),
}


def check(M, found, decided=True):
    """Every verdict on the small M is the true one, and what is shown as a
    counterexample is one."""
    A = rational(M)
    for name, truth in belongs(A).items():
        word = found[name].word
        assert word == (YES if truth else NO) or (word == UNDECIDED and not decided), (
            name,
            found[name],
            M,
        )
    for name, implied in IMPLIED.items():
        assert found[name].word != YES or all(
            found[other].word == YES for other in implied
        ), name
    check_witnesses(A, found)


def check_witnesses(A, found):
    """What is shown as a counterexample is one, exactly."""
    for name, sign in (
        ("positive_definite", 0),
        ("copositive", -1),
        ("strictly_copositive", 0),
    ):
        v = found[name].vector
        if found[name].word == NO and v is not None:
            value = form(A, v)
            assert any(v)
            assert value < 0 or (value == 0 and sign == 0), (name, v)
            assert name == "positive_definite" or min(v) >= 0
    v = found["positive_semidefinite"].vector
    assert found["positive_semidefinite"].word != NO or v is None or form(A, v) < 0
    for name, B in (
        ("column_sufficient", A),
        ("row_sufficient", [list(column) for column in zip(*A, strict=True)]),
    ):
        z = found[name].vector
        if found[name].word == NO and z is not None and "z_i" in found[name].evidence:
            assert max(products(B, z)) <= 0 > min(products(B, z))
    for name, zero in (("p_matrix", True), ("p0_matrix", False)):
        indices = found[name].indices
        if found[name].word == NO and indices is not None:
            size = minor(A, indices)
            assert size < 0 or (zero and size == 0), (name, indices, size)
    d = found["h_plus"].vector
    if found["h_plus"].word == YES and d is not None:
        assert min(d) > 0
        assert all(
            sum(c * Fraction(x) for c, x in zip(row, d, strict=True)) > 0
            for row in comparison(A)
        )


def whole(n, size):
    return arrays(np.float64, (n, n), elements=st.integers(-size, size).map(float))


@settings(max_examples=15)
@given(st.integers(1, 4).flatmap(lambda n: whole(n, 2)))
@example(np.array([[0.0, 1.0], [0.0, 1.0]]))  # sufficient by columns alone
def test_small_integer_matrices_are_classified_as_the_definitions_say(M):
    found = classify(M)
    check(M, found)
    for name, violated in refuted(M).items():
        assert found[name].word == NO or (found[name].word == YES and not violated), (
            name,
            M,
            found[name],
        )


@settings(max_examples=12)
@given(
    st.integers(1, 4).flatmap(lambda n: whole(n, 3)),
    st.integers(0, 4),
    st.integers(-1, 1),
)
def test_singular_semidefinite_matrices_are_told_from_others_by_less_than_rounding(
    A, r, nudge
):
    """Whole numbers, by one of 2^51."""
    M = A[:, :r] @ A[:, :r].T * 2.0**46
    M[0, 0] += nudge
    skew = np.triu(A, 1) - np.triu(A, 1).T
    for matrix in (M, M + skew):
        found = classify(matrix)
        check(matrix, found)
        assert nudge or found["positive_semidefinite"].word == YES


@settings(max_examples=12)
@given(
    st.integers(2, 4).flatmap(lambda n: whole(n, 9)),
    st.sampled_from([1, 0.1, 0.3, 1 / 3]),
    st.integers(-1, 1),
)
def test_rows_that_are_dominant_up_to_rounding_are_decided_exactly(A, unit, nudge):
    np.fill_diagonal(A, 0)
    np.fill_diagonal(A, np.abs(A).sum(axis=1))
    M = A * unit
    M[0, 0] += nudge * np.spacing(M[0, 0])
    # Of rounded numbers the definiteness of a symmetric matrix is not decided.
    check(M, classify(M), decided=not are_rounded(M) or not (M == M.T).all())


@pytest.mark.parametrize("transform", [np.array, sparse.csr_array])
@pytest.mark.parametrize("seed", few_of(range(12), 3))
def test_rounding_decides_nothing_about_definiteness(seed, transform):
    """Nor do the units in which a covariance, or a Gram matrix, is given."""
    random = default_rng(seed)
    n = int(random.integers(2, 40))
    k = int(random.integers(1, n + 1))
    B = random.standard_normal((k + n * (seed % 2), k)) @ random.standard_normal((k, n))
    D = 10 ** random.uniform(-5, 5, n)
    M = D[:, np.newaxis] * (B.T @ B) * D
    M = (M + M.T) / 2
    found = classify(transform(M))
    word = YES if k == n else UNDECIDED
    assert found["positive_definite"].word == word
    assert found["positive_semidefinite"].word == word
    assert found["p_matrix"].word == word
    decimals = B.round(1).T @ B.round(1)
    exact = classify(transform(decimals.round(2)))["positive_semidefinite"].word
    assert exact == YES or n > 20
    lower = np.eye(n) * 1e-9 * np.diag(M)
    assert classify(transform(M - lower))["positive_definite"].word == (
        YES if k == n else NO
    )


@pytest.mark.parametrize("transform", [np.array, sparse.csr_array])
@pytest.mark.parametrize("seed", few_of(range(20), 5))
def test_a_matrix_that_is_indefinite_by_more_than_rounding_is_called_so(
    seed, transform
):
    """In the units of its diagonal, by 1e-8 to 1e-3, at sizes at which no time for
    exact arithmetic is left."""
    random = default_rng(seed)
    n = int(random.integers(30, 60))
    B = random.standard_normal((n, int(random.integers(1, n))))
    S = B @ B.T
    S /= np.sqrt(np.outer(np.diag(S), np.diag(S)))
    v = np.linalg.eigh(S)[1][:, 0]
    D = 10 ** random.uniform(-5, 5, n)
    S = D[:, np.newaxis] * (S - 10 ** random.uniform(-8, -3) * np.outer(v, v)) * D
    found = definiteness(transform((S + S.T) / 2))
    assert found == (NO, NO, None)


def skew(random, n):
    A = random.standard_normal((n, n))
    return A - A.T


def dominant(random, n):
    M = random.standard_normal((n, n))
    np.fill_diagonal(M, 0)
    return M + np.diag(np.abs(M).sum(axis=1) * 1.1 + 0.1)


def nonsingular_m(random, n):
    B = random.random((n, n)) * (random.random((n, n)) < 0.5)
    return (np.abs(np.linalg.eigvals(B)).max() + 0.1) * np.eye(n) - B


def z_not_m(random, n):
    B = random.random((n, n)) + 0.1
    return 0.9 * np.abs(np.linalg.eigvals(B)).max() * np.eye(n) - B


def indefinite(random, n):
    Q = np.linalg.qr(random.standard_normal((n, n)))[0]
    return Q @ np.diag(np.append(random.uniform(1, 2, n - 1), -0.5)) @ Q.T


KNOWN = [
    (exact.positive_definite, {"symmetric": YES, "positive_definite": YES}),
    (
        lambda r, n: exact.positive_definite(r, n) + skew(r, n),
        {"symmetric": NO, "positive_definite": YES, "row_sufficient": YES},
    ),
    (skew, {"skew_symmetric": YES, "positive_definite": NO, "p_matrix": NO}),
    (dominant, {"strictly_diagonally_dominant": YES, "h_plus": YES, "p_matrix": YES}),
    (
        lambda r, n: dominant(r, n) * 10.0 ** r.uniform(-3, 3, n),
        {"h_plus": YES, "p_matrix": YES},
    ),
    (nonsingular_m, {"m_matrix": YES, "z_matrix": YES, "p_matrix": YES}),
    (z_not_m, {"z_matrix": YES, "m_matrix": NO, "h_plus": NO}),
    (
        lambda r, n: np.eye(n) + np.triu(r.uniform(5, 9, (n, n)), 1),
        {"p_matrix": YES, "positive_definite": NO, "h_plus": YES},
    ),
    (
        lambda r, n: r.random((n, n)),
        {"copositive": YES, "strictly_copositive": YES, "skew_symmetric": NO},
    ),
    (indefinite, {"positive_semidefinite": NO, "p0_matrix": NO}),
]


def known(sizes):
    for family, (make, expected) in enumerate(KNOWN):
        for n in sizes:
            yield make(default_rng([family, n]), n), expected


def test_matrices_of_known_class_are_recognised_and_nothing_else_is_claimed():
    for M, expected in known((2, 3, 4, 5)):
        found = classify(M)
        check(M, found)
        assert {name: found[name].word for name in expected} == expected, M


@pytest.mark.parametrize("n", [30, 65])
def test_larger_matrices_of_known_class_are_recognised_dense_and_sparse(n):
    for M, expected in known((n,)):
        for matrix in (M, sparse.csr_array(M)) if n == 30 else (M,):
            found = classify(matrix)
            assert {name: found[name].word for name in expected} == expected


@pytest.mark.parametrize("huge", [1e308, 1e-308])
def test_ends_of_the_range_of_floats_are_classified_without_overflow(huge):
    for pattern in (
        [[1, 0.5], [0.5, 1]],
        [[1, 1], [1, 1]],
        [[0.5, 1], [1, 0.5]],
        [[0, -1], [1, 0]],
    ):
        M = np.array(pattern) * huge
        check(M, classify(M))


def test_a_minor_that_is_0_in_doubles_only_excludes_nothing():
    """That of the first two rows is 2^-53; the other two rule out what makes it
    needless to look at minors."""
    M = [[1, 8, 0, 0], [(1 - 2**-53) / 8, 1, 0, 0], [0, 0, 1, 2], [0, 0, -2, 1]]
    assert classify(np.array(M))["p_matrix"].word == YES


def test_a_block_that_is_no_h_matrix_excludes_one_of_any_size():
    M = np.eye(70)
    M[:2, :2] = [[1, 2], [1, 1]]
    found = classify(M)["h_plus"]
    assert found.word == NO
    assert found.vector is not None
    assert np.flatnonzero(found.vector).tolist() == [0, 1]


@pytest.mark.parametrize(
    "M", [[[1, 2, 0], [0, 1, 2], [-0.25, 0, 1]], [[0, 1, 0], [0, 0, 1], [-1, 0, 0]]]
)
def test_a_determinant_that_excludes_is_found_where_no_other_minor_does(M):
    """It is 0 where all others are positive, and negative where they are 0."""
    check(M, classify(np.array(M, dtype=float)))


def test_without_time_only_what_takes_none_is_decided():
    with deadline_after(0.0):
        found = classify(exact.positive_definite(default_rng(0), 10))
    assert found.keys() == CLASSES.keys()
    assert found["symmetric"].word == YES
    assert found["positive_definite"].word == UNDECIDED
    assert "used up" in found["positive_definite"].evidence


def test_large_sparse_matrices_are_classified_without_becoming_dense():
    L = plane(60)
    H = sparse.eye_array(L.shape[0])
    saddle = sparse.block_array([[H, -L.T], [L, None]])
    unbalanced = sparse.block_array([[H, -L.T], [2 * L, None]])
    for M, words in (
        (saddle, {"positive_semidefinite": YES, "positive_definite": NO}),
        (unbalanced, {"positive_semidefinite": NO}),
        (L @ L + H, {"positive_definite": YES}),
        (L - 0.001 * H, {"positive_definite": YES, "m_matrix": YES}),
        (L @ L - 0.5 * H, {"positive_semidefinite": NO}),
    ):
        found = classify(M.tocsr())
        assert {name: found[name].word for name in words} == words


def test_singular_matrix_without_negative_minors_is_not_excluded_by_a_null_vector():
    """A triangular one, whose principal minors are products of diagonal entries, some
    of which are 0."""
    M = np.diag(np.arange(20.0) % 3) + np.diag(np.full(19, 5.0), 1)
    for matrix in (M, sparse.csr_array(M)):
        found = classify(matrix)
        assert found["p_matrix"].word == NO
        assert found["p0_matrix"].word != NO


@pytest.mark.parametrize("as_matrix", [np.asarray, sparse.csr_array])
def test_matrix_of_contact_with_friction_is_copositive_in_any_order(as_matrix):
    problem = families.make("contact", 48, 1)
    order = default_rng(0).permutation(problem.n)
    M = dense(problem.M)[order][:, order]
    found = classify(as_matrix(M), last="copositive")
    assert found["copositive"].word == YES
    assert found["positive_semidefinite"].word == NO
    slacks = np.flatnonzero(M.diagonal() == 0)
    assert (
        f"no negative entry in the {slacks.size} rows where its diagonal is 0"
        in found["copositive"].evidence
    )
    worse = M.copy()
    rest = np.flatnonzero(M.diagonal())[:2]
    worse[np.ix_(rest, rest)] = [[1.0, -3.0], [-3.0, 1.0]]
    with deadline_after(1.0):
        assert classify(as_matrix(worse), last="copositive")["copositive"].word == NO


@pytest.mark.parametrize("n", [5, 100, 300])
def test_singular_sum_of_squares_is_decided_at_every_size(n):
    """The squares of x_i - x_(i+1): one null vector, of ones, for which elimination in
    fractions needs n steps."""
    F = np.eye(n) - np.eye(n, k=1)
    S = F[:-1].T @ F[:-1] + 0.0
    assert [semidefinite_rank(matrix) for matrix in (S, sparse.csr_array(S))] == [
        n - 1,
        n - 1,
    ]
    for less in (2.0**-40, 2.0**-50):
        S[0, 0] = 1 - less
        assert semidefinite_rank(S) is None


def are_rounded(M):
    """Whether a number of the matrix has 15 digits or more, and is not whole."""
    texts = [repr(float(value)) for value in np.ravel(M) if value % 1]
    digits = (Decimal(text).normalize().as_tuple().digits for text in texts)
    return any(len(each) >= 15 for each in digits)


def rational(M):
    """The numbers of a matrix: decimals, or if some are rounded, doubles."""
    number = float if are_rounded(M) else repr
    return [[Fraction(number(float(value))) for value in row] for row in M]


def minor(A, indices):
    return exact.determinant([[A[i][j] for j in indices] for i in indices])


def minors(A):
    n = len(A)
    return [
        minor(A, P) for size in range(1, n + 1) for P in combinations(range(n), size)
    ]


def form(A, v):
    x = [Fraction(float(value)) for value in v]
    return sum(
        (x[i] * A[i][j] * x[j] for i in range(len(x)) for j in range(len(x))),
        Fraction(0),
    )


def products(A, v):
    """v_i (Av)_i for all i."""
    x = [Fraction(float(value)) for value in v]
    return [
        a * sum((value * b for value, b in zip(row, x, strict=True)), Fraction(0))
        for a, row in zip(x, A, strict=True)
    ]


def comparison(A):
    """|a_ii| on the diagonal, -|a_ij| off it."""
    return [
        [abs(v) if i == j else -abs(v) for j, v in enumerate(row)]
        for i, row in enumerate(A)
    ]


def belongs(A):
    """For each class that minors or entries decide, whether A belongs to it."""
    n = len(A)
    T = [list(column) for column in zip(*A, strict=True)]
    S = [
        [a + b for a, b in zip(row, column, strict=True)]
        for row, column in zip(A, T, strict=True)
    ]
    of_A, of_S = minors(A), minors(S)
    off = [A[i][j] for i in range(n) for j in range(n) if i != j]
    z_matrix = all(value <= 0 for value in off)
    h_plus = all(A[i][i] > 0 for i in range(n)) and min(minors(comparison(A))) > 0
    return {
        "symmetric": A == T,
        "skew_symmetric": not any(value for row in S for value in row),
        "z_matrix": z_matrix,
        "strictly_diagonally_dominant": all(sum(row) > 0 for row in comparison(A)),
        "h_plus": h_plus,
        "m_matrix": z_matrix and h_plus,
        "positive_definite": min(of_S) > 0,
        "positive_semidefinite": min(of_S) >= 0,
        "p_matrix": min(of_A) > 0,
        "p0_matrix": min(of_A) >= 0,
    }


def grid(n, size, lowest):
    """All whole vectors but 0 with entries from `lowest` to `size`."""
    return [v for v in product(range(lowest, size + 1), repeat=n) if any(v)]


def refuted(M, size=3):
    """Whether a small whole vector refutes that M, whole numbers below 2^20, belongs to
    each of the other classes."""
    M = np.asarray(M, dtype=np.int64)
    n = len(M)
    x, S = np.array(grid(n, size, 0)), M + M.T
    values = np.einsum("ki,ij,kj->k", x, S, x)
    zeros = values == 0
    plus = bool((x[zeros] @ S).any())
    found = {
        "copositive": bool((values < 0).any()),
        "strictly_copositive": bool((values <= 0).any()),
    }
    found["copositive_plus"] = found["copositive"] or plus
    z = np.array(grid(n, size, -size))
    for name, A in (("column_sufficient", M), ("row_sufficient", M.T)):
        signs = z * (z @ A.T)
        found[name] = bool(((signs <= 0).all(axis=1) & (signs < 0).any(axis=1)).any())
    return found
