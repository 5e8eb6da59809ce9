"""The digits that are said to be determined by the data are those that the solution of the rounded data has right."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, run
from lcpcli.gallery import families
from lcpcli.verify.digits import DOUBLE_DIGITS, fewest

from ..conftest import Outcome

Lcp = Callable[..., Outcome]


def rational_problem(seed: int, condition: float) -> tuple[Problem, list[Fraction]]:
    """A problem with M symmetric positive definite but for rounding, in thirds, and its solution; both exact, and
    rounded to doubles only in the end."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 12))
    Q = np.linalg.qr(random.standard_normal((n, n)))[0]
    A = Q * np.geomspace(1, 1 / condition, n) @ Q.T
    M = [[Fraction(value) / 3 for value in row] for row in ((A + A.T) / 2).tolist()]
    z = [Fraction(int(random.integers(1, 100)), 7) for _ in range(n)]
    q = [-sum((a * b for a, b in zip(row, z, strict=True)), Fraction(0)) for row in M]
    return Problem([[float(a) for a in row] for row in M], [float(value) for value in q]), z


def right_digits(z: np.ndarray, solution: list[Fraction]) -> float:
    errors = [abs(Fraction(a) - b) / b for a, b in zip(z.tolist(), solution, strict=True)]
    digits = (float(np.clip(-np.log10(float(error)), 0, DOUBLE_DIGITS)) if error else DOUBLE_DIGITS for error in errors)
    return min(digits)


def test_digits_of_two_hundred_problems_with_conditions_up_to_1e16() -> None:
    """Within one for nearly all, and never more than two too many."""
    excess = []
    for seed in range(200):
        problem, solution = rational_problem(seed, 10 ** (16 * seed / 199))
        result = run(problem, "newton")
        if not (result.solved and (result.z > 0).all()):
            continue  # rounding the data has changed the basis
        assert result.digits is not None
        excess.append(fewest(problem, result.z, np.array(result.digits))[0] - round(right_digits(result.z, solution)))
    assert len(excess) >= 150
    assert max(excess) <= 2
    assert np.mean(np.abs(excess) <= 1) >= 0.9
    assert min(excess) >= -3


def test_digits_do_not_depend_on_the_units_nor_on_how_M_is_stored() -> None:
    problem, _ = rational_problem(5, 1e6)
    R, C = np.exp2(np.random.default_rng(0).integers(-300, 301, (2, problem.n)).astype(float))
    other = Problem(R[:, None] * problem.M * C, R * problem.q)
    digits = [run(each, "newton").digits for each in (problem, other, Problem(csr_array(problem.M), problem.q))]
    for own in digits[1:]:
        assert own is not None
        assert digits[0] is not None
        assert max(abs(a - b) for a, b in zip(own, digits[0], strict=True)) <= 1


def test_bounds_are_exact_and_several_solutions_have_no_digits() -> None:
    assert run(Problem([[2.0, 0.0], [0.0, 1.0]], [-1.0, 1.0])).digits == [DOUBLE_DIGITS, DOUBLE_DIGITS]
    assert run(Problem([[1.0, 1.0], [1.0, 1.0]], [-1.0, -1.0], lower=-1.0, upper=3.0), z0=[0.4, 0.6]).digits is None
    assert run(Problem([[0.0, -1.0], [1.0, 0.0]], [-1.0, -1.0])).digits is None, "not solved"


@pytest.mark.parametrize(("n", "said"), [(6, False), (14, True)])
def test_few_digits_are_said(n: int, said: bool, lcp: Lcp, tmp_path: Any) -> None:
    problem = families.make("hilbert", n)
    file = tmp_path / "hilbert.json"
    file.write_text(json.dumps({"M": problem.M.tolist(), "q": problem.q.tolist()}))
    outcome = lcp("solve", str(file), "--method", "newton")
    assert ("the data determine" in outcome.out) is said
    digits = json.loads(lcp("solve", str(file), "--method", "newton", "--format", "json").out)["digits"]
    assert len(digits) == n
    assert (min(digits) < 6) is said
