"""No method is believed that says a problem has no solution: wrong vectors, empty exhaustions, rays that are none."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.sparse import diags_array

import lcpcli
from lcpcli import Problem, Status, from_qp
from lcpcli.gallery import families
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import NoSolution
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify import certificate
from lcpcli.verify.certificate import KINDS, RAY, Certificate, proves_infeasible

from .. import exact
from .liars import LIE, Liar, assert_refused, at

ULP = 2.0**-52
IDENTITY = np.eye(2)
TEXTBOOK = Problem([[0, -1], [1, 0]], [-1, -1])  # y = (1, 0)
SWAP = Problem([[0, 1], [1, 0]], [-1, 1])  # feasible without solution
COLUMN = np.array([7.7, -1.4, -6.232258064516128])  # in any order of summation, with or without fused products
MANY = Problem(diags_array([-np.ones(29), 3 * np.ones(30), -np.ones(29)], offsets=[-1, 0, 1]), -np.ones(30))
FREE, BELOW, ABOVE, BOX = (-math.inf, math.inf), (0.0, math.inf), (-math.inf, 0.0), (0.0, 1.0)


def farkas(y: Any) -> NoSolution:
    return NoSolution(Certificate("farkas", LIE, None if y is None else np.asarray(y, dtype=float)))


def mixed(M: Any, q: Any, *bounds: tuple[float, float]) -> Problem:
    lower, upper = zip(*bounds, strict=True)
    return Problem(M, q, lower=lower, upper=upper)


TILTED = [[1, -1, 0], [-1, 1 + ULP, 0], [0, 0, 1]]
FOUR = [[1, -1, 0, 0], [-1, 1 + 4 * ULP, 0, 0], [0, 1e-20, 0, 0], [0, 0, 0, 1]]
CANCELLING = mixed(np.zeros((5, 5)), [1e16, 1, 1, -1e16 - 2, 1], *4 * [BELOW], BOX)
# What each y violates: without that condition, it would be a proof.
WRONG: dict[str, tuple[Problem, Any]] = {
    "sign": (Problem(IDENTITY, [1, -1]), [-1, 0]),
    "q'y positive": (Problem([[-1, 0], [0, 1]], [1, -1]), [1, 0]),
    "q'y zero": (Problem([[-1, 0], [0, 1]], [0, -1]), [1, 0]),
    "q'y zero, negative by rounding": (Problem(-np.eye(4), [1e16, 1, 1, -1e16 - 2]), [1, 1, 1, 1]),
    "M'y": (Problem(IDENTITY, [1, -1]), [0, 1]),
    "M'y by rounding": (Problem([[1, -1], [-1, 1 + ULP]], [-1, 0]), [1, 1]),
    "M'y positive, negative by rounding": (Problem(np.outer(COLUMN, [1, 0, 0]), -(2.0**60) * COLUMN), [9.2, 9.2, 9.3]),
    "M'y of one column": (Problem([[0, 0.5], [-1, 0]], [-1, 1]), [1, 1e-9]),
    "zero": (TEXTBOOK, [0, 0]),
    "nan": (TEXTBOOK, [1, math.nan]),
    "infinite": (TEXTBOOK, [math.inf, 0]),
    "none": (TEXTBOOK, None),
    "length": (TEXTBOOK, [1, 0, 0]),
    "another problem": (Problem([[0, 1], [1, 0]], [-1, -1]), [1, 0]),
    "sign once corrected": (Problem([[1, -1, 0], [-1, 1 + 4 * ULP, 0], [0, 1e-20, 0]], [-1, 0, 0]), [1, 1, 2]),
    "M'y once corrected": (Problem([[1, -1, 0], [-1, 1 + 4 * ULP, -10], [0, -1e-20, 1]], [-1, 0, 0]), [1, 1, 2]),
    "q'y once corrected": (Problem([[1, -1, 0], [-1, 1 + 4 * ULP, 0], [0, -1e-20, 0]], [-1, 0, 1]), [1, 1, 0.5]),
    "mixed: between two bounds": (mixed(IDENTITY, [-5, -1], BOX, BELOW), [1, 0]),
    "mixed: sign at an upper bound": (mixed(IDENTITY, [1, 1], ABOVE, BELOW), [0, -1]),
    "mixed: sign at a lower bound": (mixed(IDENTITY, [-1, -1], ABOVE, BELOW), [1, 0]),
    "mixed: M'y of a free variable": (mixed([[0, -1], [1, 0]], [-1, -1], BELOW, FREE), [1, 0]),
    "mixed: M'y by rounding": (mixed(TILTED, [-1, 0, -3], BELOW, BELOW, BOX), [1, 1, 0]),
    "mixed: M'y against a bound": (mixed([[0, 1], [1, 0]], [-1, 1], BELOW, (0, 2)), [1, 0]),
    "mixed: total zero": (mixed([[0, 1], [1, 0]], [-1, 1], BELOW, BOX), [1, 0]),
    "mixed: total zero, negative by rounding": (CANCELLING, [1, 1, 1, 1, 0]),
    "mixed: sign once corrected": (mixed(FOUR, [-1, 0, 0, 0], *3 * [BELOW], BOX), [1, 1, 2, 0]),
    "mixed: zero": (mixed(IDENTITY, [-1, -1], FREE, FREE), [0, 0]),
    "mixed: none": (mixed(IDENTITY, [-1, -1], FREE, FREE), None),
    "program": (from_qp(None, [1, 1], [[1, 1]], row_lower=2), [0, 0, 1]),
    "unbounded program": (from_qp([[1, 0], [0, 1]], [-1, 1], [[1, 1]], row_lower=2), [1, 0, 0]),
}


@pytest.mark.parametrize("name", WRONG)
def test_vector_that_proves_nothing_is_refused_in_rational_arithmetic_too(name: str, liar: Liar) -> None:
    problem, y = WRONG[name]
    result = liar.run(problem, ending=farkas(y))
    assert_refused(result)
    assert result.message == f"stalled: {KINDS['farkas'].unverified}"
    if y is not None and len(y) == problem.n and np.isfinite(y).all():
        fractions = [Fraction(value) for value in y]
        assert not lcpcli.check(problem, y=fractions).accepted
        assert not ExactProblem.of_floats(problem).refuted_by(fractions)
    if "corrected" in name and not problem.is_mixed:
        assert exact.feasible(problem)  # though rounding or a correction would spoil the vector


def test_vector_that_is_wrong_in_other_variables_is_refused_in_all_of_them(liar: Liar) -> None:
    """Those of the equilibrated problem, of one with its reference point at 0, and of the standard form."""
    M, q = np.diag([2.0**40, 1.0]), [-1, -1]
    problems = [Problem(M, q), Problem(M, q, lower=[3, -1]), Problem(M, q, lower=[-1, 0], upper=[math.inf, 9])]
    for problem in problems:
        for vector in (np.ones, lambda n: -np.ones(n), np.zeros):
            for takes_bounds in (True, False):
                declaration = {"iterates": True, "takes_bounds": takes_bounds}
                result = liar.run(problem, [], lambda own, v=vector: farkas(v(own.n)), declaration, scale=True)
                assert_refused(result)
                assert result.message == f"stalled: {KINDS['farkas'].unverified}"


def test_true_proof_of_the_same_method_is_believed(liar: Liar) -> None:
    result = liar.run(TEXTBOOK, ending=farkas([1, 0]))
    assert result.status is Status.INFEASIBLE
    assert proves_infeasible(TEXTBOOK, result.certificate.vector)
    assert liar.run(SWAP, ending=NoSolution(Certificate("exhaustion", "it is"))).status is Status.UNSOLVABLE


EXHAUSTED = NoSolution(Certificate("exhaustion", LIE, np.ones(2)))
SOLVABLE = {
    "lcp": Problem([[2, 1], [1, 2]], [-5, -6]),
    "mixed": mixed(IDENTITY, [-1, -1], FREE, BOX),
    "far bounds": mixed(IDENTITY, [-2e6, -1], (1e6, math.inf), BOX),
    "program with a stationary point": from_qp([[-1, 0], [0, 1]], [-0.25, 1], upper=1),
    "twenty unknowns": Problem(np.eye(20) + 1, -np.arange(1.0, 21)),
}


@pytest.mark.parametrize("name", SOLVABLE)
def test_exhaustion_of_a_small_problem_with_a_solution_is_refused(name: str, liar: Liar) -> None:
    """Even if a method declares that its proofs are exact; through a standard form too."""
    for takes_bounds, excludes_exactly in itertools.product((True, False), repeat=2):
        declaration = {"excludes_exactly": excludes_exactly, "takes_bounds": takes_bounds}
        result = liar.run(SOLVABLE[name], [], EXHAUSTED, declaration)
        assert_refused(result)
        assert result.message.startswith(("stalled: the claim that every", "stalled: no solution was found, and"))


def test_exhaustion_that_is_not_verified_is_believed_only_of_methods_that_declare_it(
    liar: Liar, monkeypatch: pytest.MonkeyPatch
) -> None:
    declaring = [name for name, method in METHODS.items() if method.excludes_exactly]
    assert declaring == ["auto", "milp"], "which search all sets"
    for problem in (MANY, families.make("unsolvable", 24)):
        result = liar.run(problem, ending=EXHAUSTED)
        assert_refused(result)
        assert result.message == f"stalled: {KINDS['exhaustion'].unverified}"
    monkeypatch.setattr(certificate, "EXHAUSTION_EFFORT", 0.0)
    assert_refused(liar.run(SWAP, ending=EXHAUSTED))
    believed = liar.run(SWAP, [], EXHAUSTED, {"excludes_exactly": True})
    assert believed.status is Status.UNSOLVABLE
    assert believed.certificate.vector is None, "as a proof by exhaustion has none"


def test_no_proof_is_believed_against_a_point_that_solves_the_problem(liar: Liar) -> None:
    for problem in (SOLVABLE["lcp"], MANY):
        solution = at(lcpcli.run(problem).z)
        for ending in (EXHAUSTED, farkas(np.ones(problem.n)), NoSolution(Certificate("ray", LIE, np.ones(problem.n)))):
            result = liar.run(problem, [solution], ending, {"excludes_exactly": True})
            assert (result.status, result.message) == (Status.SOLVED, "solved")
            assert result.certificate is None


RAYS: dict[str, tuple[Problem, list[float]]] = {
    "zero": (TEXTBOOK, [0, 0]),
    "negative": (TEXTBOOK, [0, -1]),
    "not complementary": (Problem([[2, 1], [1, 3]], [-5, -6]), [1, 1]),
    "not complementary, as w falls unevenly": (Problem(np.diag([-1, -2]), [-1, -1]), [1, 1]),
    "any": (Problem([[2, 1], [1, 3]], [-5, -6]), [1, 0]),
    "nan": (TEXTBOOK, [1, math.nan]),
    "infinite": (TEXTBOOK, [math.inf, 0]),
    "length": (TEXTBOOK, [1, 0, 0]),
    "overflow": (Problem(1e300 * IDENTITY, [-1, -1]), [1e300, 1]),
    "beyond a bound": (mixed(np.zeros((2, 2)), [-1, -1], BOX, BELOW), [1, 0]),
    "many unknowns": (MANY, [1.0] * 30),
}


@pytest.mark.parametrize("name", RAYS)
def test_ray_that_is_none_is_refused(name: str, liar: Liar) -> None:
    problem, z = RAYS[name]
    result = liar.run(problem, [at(np.full(problem.n, 0.5))], NoSolution(Certificate("ray", LIE, np.array(z))))
    assert_refused(result)
    assert result.message == f"stalled: {KINDS['ray'].unverified}"


def test_ray_proves_nothing_whatever_a_method_says(liar: Liar) -> None:
    """Along (1, 0) w = Mz does not change; the first problem has a solution, and its M is semidefinite. So are those of
    the last two, and in exact arithmetic a ray of Lemke's method would prove that there is none."""
    for problem, z in ((Problem([[0, 0], [0, 1]], [1, -1]), np.array([1.0, 0.0])), (MANY, None)):
        result = liar.run(problem, ending=NoSolution(Certificate("ray", LIE, z)))
        assert (result.status, result.message) == (Status.RAY, f"ended on a ray: {RAY}")
        assert LIE not in result.to_json()
    for problem in (families.make("hilbert", 60), exact.random_problem(3962, largest=12)):
        assert lcpcli.run(problem).solved
        result = lcpcli.run(problem, "lemke")
        assert result.solved or not (result.status.has_no_solution or "infeasible" in result.message)
