"""Exact arithmetic: the same rational numbers by elimination in integers and by FLINT,
of systems of any rank; decimals arrive as the rationals that they are, and no number
makes the program hang."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng

from lcpcli import Problem
from lcpcli.errors import ProblemError
from lcpcli.files import writing
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.rational import elimination, numbers
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.elimination import particular, solve

from .. import exact
from ..conftest import read_exact
from ..seeds import few_of


def systems(rows, columns):
    """Small integers, of which many are 0, so that many systems are singular."""
    entry = st.integers(-2, 2)
    row = st.lists(entry, min_size=columns, max_size=columns)
    return st.tuples(
        st.lists(row, min_size=rows, max_size=rows),
        st.lists(entry, min_size=rows, max_size=rows),
    )


def times(A, x):
    return [exact.dot(row, x) for row in A]


@pytest.mark.parametrize(("m", "n"), [(3, 3), (2, 4), (4, 2)])
@settings(max_examples=15)
@given(data=st.data())
def test_every_solution_is_found(m, n, data):
    A, b = data.draw(systems(m, n))
    x, null_space = solve(A, b)
    rank = int(np.linalg.matrix_rank(np.array(A)))
    assert len(null_space) == n - rank
    assert all(not any(times(A, v)) for v in null_space)
    assert (x is None) == (int(np.linalg.matrix_rank(np.column_stack((A, b)))) > rank)
    assert x is None or times(A, x) == b


@settings(max_examples=25)
@given(systems(4, 4))
def test_flint_gives_the_same_numbers(system):
    pytest.importorskip("flint")
    own = solve(*system)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elimination, "MAX_PLAIN_ROWS", 0)
        assert solve(*system) == own


@pytest.mark.parametrize(("m", "n"), [(20, 30), (30, 20), (24, 24)])
def test_large_systems_of_any_shape_and_rank_are_solved(m, n):
    generator = default_rng(m)
    A = generator.integers(-9, 10, (m, 18)) @ generator.integers(-9, 10, (18, n))
    b = A @ generator.integers(-9, 10, n)
    x = particular(A.tolist(), b.tolist())
    assert x == solve(A.tolist(), b.tolist())[0]
    assert times(A.tolist(), x) == b.tolist()


def test_long_call_of_flint_in_another_process_gives_the_same(monkeypatch):
    pytest.importorskip("flint")
    A = [[int(i == j) * 7 + (i * j) % 5 for j in range(20)] for i in range(20)]
    b = list(range(20))
    here = elimination.solve(A, b), elimination.solve(A[:18], b[:18])
    monkeypatch.setattr(elimination, "LONG_CALL_SECONDS", -1.0)
    assert (elimination.solve(A, b), elimination.solve(A[:18], b[:18])) == here
    with pytest.raises(TimeIsUp), deadline_after(0.0):
        elimination.solve(A, b)
    monkeypatch.setattr("sys.executable", "/no/such/interpreter")
    assert elimination.solve(A, b) == here[0]


@pytest.mark.parametrize("seed", few_of(range(24), 10))
def test_determinants_are_those_by_expansion(seed):
    """Of matrices with many zeros, so that pivots come from any row."""
    generator = default_rng(seed)
    n = int(generator.integers(1, 6))
    A = (
        generator.integers(-9, 10, (n, n)) * (generator.random((n, n)) < 0.5)
        + np.eye(n, dtype=int)[::-1]
    )
    assert elimination.determinant(A.tolist()) == exact.determinant(A.tolist())


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_principal_minors_are_determinants_each_once(seed):
    """Of matrices with many zeros, where Schur complements lack pivots."""
    A = default_rng(seed).integers(-1, 2, (5, 5))
    minors = list(elimination.principal_minors(A.tolist(), lambda: None))
    assert len(minors) == len(dict(minors)) == 2**5 - 1
    for indices, minor in minors:
        assert minor == exact.determinant(A[np.ix_(indices, indices)].tolist())


@pytest.mark.parametrize("seed", few_of(range(24), 10))
def test_minors_that_prove_a_symmetric_matrix_indefinite_are_negative_or_zero(seed):
    """Of matrices with many zeros on the diagonal, so that pairs of rows are pivots."""
    generator = default_rng(seed)
    n = int(generator.integers(1, 7))
    A = np.triu(generator.integers(-2, 3, (n, n)) * (generator.random((n, n)) < 0.4))
    A = A + A.T + np.diag(generator.integers(0, 3, n))
    if seed % 3 == 0:
        A = A @ A
    found = elimination.definiteness(A.tolist(), lambda: None)
    least = float(np.linalg.eigvalsh(A)[0])
    assert (found.negative is None) is (least > -1e-9)
    assert (found.zero is None and found.negative is None) is (least > 1e-9)
    minors = [
        None if P is None else elimination.determinant(A[np.ix_(P, P)].tolist())
        for P in found
    ]
    assert minors[0] in (None, 0)
    assert minors[1] is None or minors[1] < 0


def test_of_the_minors_that_are_0_the_first_is_named():
    assert elimination.definiteness(
        [[1, 0, 0, 0], [0] * 4, [0, 0, 1, 0], [0] * 4], lambda: None
    ) == ((0, 1), None)


def test_npz_holds_doubles(tmp_path):
    problem = Problem([[0.1]], [-0.3])
    writing.write(problem, tmp_path / "a.npz")
    data = read_exact(str(tmp_path / "a.npz"))
    assert data.is_solution([Fraction(0.3) / Fraction(0.1)])
    assert data.are_floats()


def test_a_decimal_that_rounds_to_an_integer_is_not_taken_for_it(tmp_path):
    number = "0." + 20 * "9"
    (tmp_path / "a.json").write_text(f'{{"M": [[{number}]], "q": [-1]}}')
    assert read_exact(str(tmp_path / "a.json")).is_solution([1 / Fraction(number)])


def test_exponents_out_of_all_proportion_are_refused(tmp_path):
    for number in ("1e-999999999", "1e-99999999999999999999999999", "-1E-5300"):
        (tmp_path / "a.json").write_text(f'{{"M": [[1]], "q": [{number}]}}')
        with pytest.raises(ProblemError, match=r"a\.json: q: has"):
            read_exact(str(tmp_path / "a.json"))
    # Whose zeros are all written.
    (tmp_path / "a.json").write_text(f'{{"M": [[1]], "q": [-0.{5005 * "0"}1]}}')
    assert read_exact(str(tmp_path / "a.json")).is_solution([Fraction(1, 10**5006)])


def test_what_is_no_number_is_refused():
    for text in (
        "1/0",
        "1/00",
        "a",
        "1//2",
        "1/-2",
        "1.5/2",
        "",
        "nan",
        "inf",
        "1_0",
        "1_0/3",
        "/2",
    ):
        with pytest.raises(ProblemError):
            numbers.ratio(text)


@settings(max_examples=30)
@given(st.fractions())
def test_text_reads_back(value):
    assert numbers.ratio(numbers.text(value)) == value


@settings(max_examples=40)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_decimals_and_rounding_agree_with_python(value):
    assert numbers.rounded([numbers.fraction(repr(value))]) == value
    assert numbers.rounded([Fraction(value)]) == value


def test_only_sums_that_are_zero_are_rounded_to_zero():
    """Of 2^p 2^p, which no double represents for p < -537, the sign is left."""
    for power, sign in product((-500, -537, -538, -1074), (1.0, -1.0)):
        small = 2.0**power
        total = numbers.rounded_sum(
            np.array([sign * small, 3.0]), np.array([small, 5.0]), -15.0
        )
        assert np.sign(total) == sign
        assert total == sign * max(Fraction(small) ** 2, Fraction(5e-324))
        assert (
            numbers.rounded_sum(
                np.array([small, -small]), np.array([small, small]), 0.0
            )
            == 0
        )


@pytest.mark.parametrize(
    ("row", "signs", "is_it"),
    [
        ([0, 0, 0], (0, 0), True),
        ([0, -1, 0], (0, -1), False),
        ([0, 1, 0], (1, 0), False),
        ([0, -1, 1], (1, -1), False),
        ([1, -1, 0], (1, -1), False),
    ],
)
def test_a_form_is_0_throughout_if_it_has_no_sign_anywhere(row, signs, is_it):
    """Forms of x, y >= 0, which may have any sign, and then are required to have
    one."""

    def polyhedron():
        return Dictionary({2: row}, [0, 1], [0, 1], lambda: None)

    found = (polyhedron().can_have_sign(2, 1), -polyhedron().can_have_sign(2, -1))
    assert found == signs
    assert polyhedron().is_zero(2) == is_it
    signed = polyhedron()
    assert signed.require(2)
    assert signed.is_zero(2) == (signs[0] == 0)


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_ties_are_broken_as_by_small_changes_of_the_forms(seed):
    """Which relax a form by a positive amount, or tighten it."""
    random = default_rng(seed)
    cobasic, basic, order = [0, 1, 2], range(3, 8), random.permutation(8).tolist()
    rows = {form: [0, *random.integers(-1, 2, 3).tolist()] for form in basic}
    less = {form for form in order if random.random() < 0.5}
    change = {
        form: Fraction(-1 if form in less else 1, 1000**k)
        for k, form in enumerate(order, 1)
    }

    def ratio(form):
        _, *slopes = rows[form]
        moved = (a * change[j] for j, a in zip(cobasic, slopes, strict=True))
        return (change[form] - sum(moved)) / -slopes[0]

    dictionary = Dictionary(rows, cobasic, order, lambda: None)
    tied = dictionary.nearest(1)
    first = min(tied, key=ratio, default=None)
    assert dictionary.lexicographic(tied, 1, order, less) == first


@settings(max_examples=40)
@given(st.fractions())
def test_a_bound_remains_one_in_a_few_digits(value):
    below, above = (Fraction(numbers.approximate(value, side)) for side in (-1, 1))
    assert below <= value <= above
