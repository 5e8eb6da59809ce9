"""`--exact` proves what is true of the numbers as they are written, and nothing else;
and the solution that errors are measured against is right to its last digits.
"""

import json
import sys
from dataclasses import replace
from fractions import Fraction
from functools import partial
from operator import mul

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy import sparse
from scipy.io import savemat

import lcpcli
from lcpcli import Problem, Status, read
from lcpcli.files import contents
from lcpcli.linalg.matrices import accurate_residual
from lcpcli.options import Limits
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving import proof
from lcpcli.solving.driver import run
from lcpcli.solving.proof import prove, with_reference

from .. import exact as oracle
from ..conftest import FACE
from ..enumeration.solution_sets import random_problem as random_mixed_problem

EXAMPLE = contents.shipped_path("paper-example-2.json")


def proved(problem):
    return prove(lambda: ExactProblem.of_floats(problem), run(problem, "auto"))


def assert_proved(result, whole, units=1):
    """The verdict is the true one about a problem whose rows are those of the result's
    times the units."""
    found = result.exact
    if oracle.solution(whole) is not None:
        assert result.status == Status.SOLVED
        assert found.status == Status.SOLVED
        assert oracle.solves(whole, found.z)
    elif found.y is None if whole.is_mixed else oracle.feasible(whole):
        assert found.status is Status.UNSOLVABLE
    else:
        assert found.status is Status.INFEASIBLE
        own = np.broadcast_to(units, len(found.y)).tolist()
        assert oracle.refutes(
            whole, [value / int(unit) for value, unit in zip(found.y, own, strict=True)]
        )


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.booleans())
def test_verdict_is_that_of_enumeration(seed, mixed):
    M, q, lower, upper = random_mixed_problem(np.random.default_rng(seed), 4)
    problem = (
        Problem(M, q, lower=lower, upper=upper)
        if mixed
        else oracle.random_problem(seed, 4)
    )
    assert_proved(proved(problem), problem)


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_verdict_on_decimals_is_that_of_enumeration_on_integers(seed):
    """Rows are divided by powers of ten, which rounds them; many of these q are
    degenerate."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 5))
    M, q = random.integers(-3, 4, (n, n)), random.integers(-4, 5, n)
    if random.integers(2):
        q = -M @ random.integers(0, 3, n)
    units = 10 ** random.integers(1, 4, n)
    result = run(Problem(M / units[:, None], q / units), "auto")
    assert_proved(
        prove(lambda: ExactProblem.of_decimals(result.problem), result),
        Problem(M, q),
        units,
    )


def test_hilbert_matrix_of_twenty_in_fractions_and_in_doubles():
    n = 20
    H = [[Fraction(1, i + j + 1) for j in range(n)] for i in range(n)]
    q = [-sum(row) for row in H]
    problem = Problem([list(map(float, row)) for row in H], list(map(float, q)))
    lost = run(problem, "newton", limits=Limits(max_iterations=20))
    assert np.abs(lost.z - 1).max() > 0.01, "as accurate as the rounded data determine"
    result = prove(
        lambda: ExactProblem(problem, [dict(enumerate(row)) for row in H], q), lost
    )
    assert result.exact.z == [1] * n
    assert result.z.tolist() == [1.0] * n


# Its z has states of its own.
def test_a_solution_far_from_the_doubles_is_found_by_search_or_not_proved(
    lcp, tmp_path, monkeypatch
):
    file = tmp_path / "face.json"
    file.write_text(FACE)
    assert lcpcli.exact(Problem(**json.loads(FACE))).exact.status is Status.SOLVED
    monkeypatch.setattr(proof, "EXACT_SEARCH_EFFORT", 0.0)
    outcome = lcp(f"solve {file} --exact --format json")
    record = outcome.record
    assert outcome.code == 1
    assert record["status"] == "solved"
    assert record["exact"]["status"] is None
    assert record["message"].endswith(
        "no exact proof is known for the numbers as written"
    )
    assert (
        "no exact proof is known for the numbers as written\n"
        in lcp(f"solve {file} --exact").out
    )


def test_missing_library_is_named_with_its_extra(lcp, monkeypatch):
    monkeypatch.setitem(sys.modules, "flint", None)
    outcome = lcp(f"solve {EXAMPLE} --exact")
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err == "lcp: --exact: needs python-flint; pip install python-flint\n"


def test_a_deadline_in_the_past_proves_nothing_but_says_so():
    late = replace(
        run(oracle.random_problem(1), "auto"), limits=Limits(time_limit=1e-9)
    )
    assert (
        prove(lambda: ExactProblem.of_floats(late.problem), late).exact.status is None
    )


def test_integers_beyond_those_that_are_doubles_are_read_as_they_are(lcp, tmp_path):
    largest = 2**64 - 1
    M, q = np.array([[largest]], dtype=np.uint64), np.array([-1], dtype=np.int64)
    savemat(tmp_path / "p.mat", {"M": M, "q": q.reshape(1, 1)})
    np.save(tmp_path / "p.npy", M)
    np.save(tmp_path / "q.npy", q)
    for names in (["p.mat"], ["p.npy", "q.npy"]):
        files = [str(tmp_path / name) for name in names]
        record = lcp("solve", *files, "--exact", "--format", "json").record
        assert record["exact"]["z"] == [f"1/{largest}"]
        assert record["z"] == [1 / largest]


def test_a_proof_is_printed_in_fractions():
    assert "exact y = (1)" in repr(lcpcli.exact(Problem([[-1]], [-2])))


def test_a_proved_solution_beyond_the_range_of_doubles_says_so():
    result = lcpcli.exact(Problem([[1.5e-323, -3.0], [0.0, 3.0]], [-0.0124, 0.0]))
    assert result.solved
    assert float(result.exact.z[0] / 10**300) == pytest.approx(8.3e20, rel=0.01)
    assert "beyond the range of doubles" in result.message


def test_residuals_are_rounded_but_once():
    """Sums that cancel, to 0 or to a last digit; rows of equal lengths, and one that is
    much longer."""
    random = default_rng(0)
    A = sparse.random_array((60, 300), density=0.02, rng=random, format="lil")
    A[7] = random.standard_normal(300)
    A = sparse.csr_array(A)
    A.data *= 2.0 ** random.integers(-60, 60, A.nnz)
    x = random.standard_normal(300)
    b = np.where(random.random(60) < 0.5, A @ x, random.integers(-1, 2, 60))
    dense, exact_x = A.toarray(), list(map(Fraction, x.tolist()))
    true = [
        float(Fraction(right) - sum(map(mul, map(Fraction, row), exact_x)))
        for right, row in zip(b.tolist(), dense.tolist(), strict=True)
    ]
    for matrix in (A, dense):
        assert accurate_residual(matrix, x, b).tolist() == true


def test_reference_is_exact_where_rational_arithmetic_can_be_had(monkeypatch):
    known = read(contents.shipped_path("paper-example-2.json"))
    assert with_reference(known) == known
    assert known.reference == "known"
    problem = Problem([[3.0, 1.0], [1.0, 3.0]], [-1.0, 2.0])
    exactly = with_reference(problem)
    assert exactly.reference == "exact"
    assert exactly.solutions[0].tolist() == [1 / 3, 0.0]
    monkeypatch.setitem(sys.modules, "flint", None)
    assert with_reference(problem).reference == "exact"
    monkeypatch.setattr(proof, "MAX_EXACT_UNKNOWNS", 1)
    assert with_reference(problem).reference == "computed"
    assert with_reference(problem).solutions[0].tolist() == [1 / 3, 0.0]


def test_no_solution_of_the_doubles_proves_nothing_of_the_decimals():
    """w1 = 10 z3 - 1 with z3 = 0.1: only where it is 0, z1 may be 1, as w2 = z1 - 1
    asks for."""
    pytest.importorskip("flint")
    M, end = [[0, 0, 10], [1, 0, 0], [0, 0, 0]], [0.1]
    problem = Problem(M, [-1, -1, 0], lower=[0, 0, *end], upper=[np.inf, np.inf, *end])
    result = run(problem, "auto")
    assert (
        prove(lambda: ExactProblem.of_floats(problem), result).status.word
        == "unsolvable"
    )
    decimals = prove(lambda: ExactProblem.of_decimals(problem), result)
    assert decimals.status.word == "solved"
    assert decimals.exact.z == [1, 0, Fraction(1, 10)]


def program_with_rows(seed, sense):
    """With rows of all kinds, of decimals whose sums are rounded, some of them
    degenerate."""
    random = default_rng(seed)
    A = random.integers(-3, 4, (4, 4)) / 10
    at = A @ (random.integers(0, 3, 4) / 10)
    low = np.round(at - random.integers(0, 2, 4) / 10, 3)
    high = np.round(low + random.integers(0, 3, 4) / 10, 3)
    low[1], high[0] = -np.inf, np.inf
    factor = random.integers(-3, 4, (4, 4)) / 10
    sign = 1 if sense == "min" else -1
    Q = sign * np.round(factor @ factor.T, 4) if seed % 3 else None
    sides = {"row_lower": low, "row_upper": high, "lower": 0, "upper": 1}
    c = random.integers(-3, 4, 4) / 10
    return lcpcli.from_qp(Q, c, A, **sides, sense=sense, constant=3.1)


@pytest.mark.parametrize("make", [ExactProblem.of_floats, ExactProblem.of_decimals])
@pytest.mark.parametrize("sense", ["min", "max"])
def test_measures_of_an_exact_minimum_are_rounded_once(make, sense):
    n_solved = 0
    for seed in range(8):
        problem = program_with_rows(seed, sense)
        solved = run(problem, "auto")
        result = prove(partial(make, problem), solved)
        if result.exact is None or not result.exact.z:
            continue
        n_solved += 1
        answer, z = result.answer, result.exact.z
        objective = float(problem.formulation.meaning(make(problem)).objective(z))
        assert answer.objective == objective
        A = problem.M[4:8, :4]
        exact = [
            sum(Fraction(str(a)) * b for a, b in zip(row, z[:4], strict=False))
            for row in A.tolist()
        ]
        assert np.abs(answer.activities - np.array(exact, float)).max() <= 1e-16
        assert (answer.slacks >= 0).all()
        assert not answer.slacks[answer.y != 0].any()
        # Those of the run are 0 too, not rounding of 0.
        assert not solved.answer.slacks[solved.answer.y != 0].any()
    assert n_solved >= 4
