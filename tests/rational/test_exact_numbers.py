"""The decimals of every format arrive as the rationals that they are, and no number makes the program hang."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli import Problem
from lcpcli.errors import ProblemError
from lcpcli.files import writing
from lcpcli.rational import numbers
from lcpcli.rational.exact_problem import ExactProblem

from ..conftest import read_exact

MTX = "%%MatrixMarket matrix"
TENTHS = ([[Fraction(1, 10), Fraction(-1, 5)], [Fraction(3, 10), Fraction(7)]], [Fraction(-1, 10), Fraction(1, 2)])
SAME = {
    "a.json": '{"M": [[0.1, -2e-1], [0.30, 7]], "q": [-0.1, 0.5]}',
    "coo.json": '{"M": {"format": "coo", "shape": [2, 2], "rows": [1, 0, 0, 1], "cols": [1, 0, 1, 0], '
    '"values": [7.0, 0.1, -0.2, 0.3]}, "q": [-0.1, 0.5]}',
    "a.csv": "M1;M2;q\n0.1;-.2;-0.1\n3e-1;7.;.5\n",
}
MATRICES = {
    "M.csv": "0.1,-0.2\n0.3,7\n",
    "M.mtx": f"{MTX} array real general\n2 2\n0.1\n0.3\n-0.2\n7\n",
    "coo.mtx": f"{MTX} coordinate real general\n2 2 4\n2 2 7\n1 1 0.1\n1 2 -0.2\n2 1 0.3\n",
}
VECTORS = {
    "q.csv": "-0.1\n0.5\n",
    "q.json": "[-0.1, 0.5]",
    "q.mtx": f"{MTX} array real general\n2 1\n-0.1\n0.5\n",
}


def data_of(data: ExactProblem) -> tuple[list[list[Fraction]], list[Fraction]]:
    M = [[Fraction(row.get(j, 0), s) for j in range(data.n)] for row, s in zip(data.rows, data.scales, strict=True)]
    return M, [Fraction(value, s) for value, s in zip(data.constants, data.scales, strict=True)]


def test_decimals_of_one_file_and_of_two(tmp_path: Path) -> None:
    for name, text in (SAME | MATRICES | VECTORS).items():
        (tmp_path / name).write_text(text)
    for names in [*((name,) for name in SAME), *product(MATRICES, VECTORS)]:
        assert data_of(read_exact(*(str(tmp_path / name) for name in names))) == TENTHS, names


@pytest.mark.parametrize(
    ("text", "upper"),
    [
        ("coordinate real symmetric\n2 2 2\n2 1 0.1\n1 1 3\n", [3, Fraction(1, 10)]),
        ("coordinate real skew-symmetric\n2 2 1\n2 1 0.1\n", [0, Fraction(-1, 10)]),
        ("array real symmetric\n2 2\n3\n0.1\n0\n", [3, Fraction(1, 10)]),
        ("array real skew-symmetric\n2 2\n0.1\n", [0, Fraction(-1, 10)]),
    ],
)
def test_symmetric_matrix_market_is_mirrored(text: str, upper: list[Fraction], tmp_path: Path) -> None:
    (tmp_path / "M.mtx").write_text(f"{MTX} {text}")
    (tmp_path / "q.csv").write_text("1 1")
    M, _ = data_of(read_exact(str(tmp_path / "M.mtx"), str(tmp_path / "q.csv")))
    assert [upper, [-upper[1] if "skew" in text else upper[1], 0]] == M


def test_npz_holds_doubles(tmp_path: Path) -> None:
    problem = Problem([[0.1]], [-0.3])
    writing.write(problem, tmp_path / "a.npz")
    data = read_exact(str(tmp_path / "a.npz"))
    assert data_of(data) == ([[Fraction(0.1)]], [Fraction(-0.3)])
    assert data.are_floats()


def test_numbers_below_the_range_of_doubles_count(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"M": [[1e-400]], "q": [-2e-400]}')
    assert read_exact(str(tmp_path / "a.json")).is_solution([Fraction(2)])


def test_exponents_out_of_all_proportion_are_refused(tmp_path: Path) -> None:
    for number in ("1e-999999999", "1e-99999999999999999999999999", "-1E-5300"):
        (tmp_path / "a.json").write_text(f'{{"M": [[1]], "q": [{number}]}}')
        with pytest.raises(ProblemError, match=r"a\.json: has"):
            read_exact(str(tmp_path / "a.json"))


def test_what_is_no_number_is_refused() -> None:
    for text in ("1/0", "1/00", "a", "1//2", "1/-2", "1.5/2", "", "nan", "inf", "1_0", "1_0/3", "/2"):
        with pytest.raises(ProblemError):
            numbers.ratio(text)


@given(st.fractions())
def test_text_reads_back(value: Fraction) -> None:
    assert numbers.ratio(numbers.text(value)) == value


def test_text_has_no_limit_of_digits() -> None:
    value = Fraction(10**6000 + 1, 3**9000)
    assert numbers.ratio(numbers.text(value)) == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_decimals_and_rounding_agree_with_python(value: float) -> None:
    assert numbers.rounded([numbers.fraction(repr(value))]) == value
    assert numbers.rounded([Fraction(value)]) == value


def test_only_sums_that_are_zero_are_rounded_to_zero() -> None:
    """Of 2^p 2^p, which no double represents for p < -537, the sign is left."""
    for power, sign in product((-500, -537, -538, -1074), (1.0, -1.0)):
        small = 2.0**power
        total = numbers.rounded_sum(np.array([sign * small, 3.0]), np.array([small, 5.0]), -15.0)
        assert np.sign(total) == sign
        assert total == sign * max(Fraction(small) ** 2, Fraction(5e-324))
        assert numbers.rounded_sum(np.array([small, -small]), np.array([small, small]), 0.0) == 0


def test_rounding_beyond_the_range_of_doubles_is_infinite() -> None:
    assert np.array_equal(numbers.rounded([Fraction(10**400), Fraction(-(10**400))]), [np.inf, -np.inf])
