"""Verification of answers from the original M and q, never from what the solver reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.bench.answer import NONE, SOLUTION, Answer
from lcpcli.bench.optimality import optimality
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.sensitivity import MOST_INVERTED, sensitivity


@dataclass(frozen=True)
class Check:
    """success : claimed and accepted. false_success : claimed but wrong by every measure. Other claims are inexact.

    residual, scaled_residual, error : as in `point.Point`, and from the reference; None without a z, or a reference.
    condition, forward_error, optimality : as in `record.Measurement`.
    """

    success: bool
    false_success: bool
    residual: float | None
    scaled_residual: float | None
    error: float | None
    condition: float | None = None
    forward_error: float | None = None
    optimality: dict[str, float] | None = None


class Checker:
    """Verifies the answers to one problem.

    A claimed solution is accepted if its scaled residual is at most `accept` and the problem is not known to have none.
    It is false if not even its natural residual, in the problem's own units, is at most `accept` times the largest term
    of w, in |M| |z| or |q|; in between it is inexact: it meets a common stopping criterion, though small rows may have
    no correct digit. A claim that there is no solution is a success if that is known, false if a solution is known,
    and neither if nothing is known.
    """

    def __init__(self, problem: Problem, accept: float) -> None:
        self._problem, self._accept = problem, accept
        self._criterion = Criterion(problem)
        one = len(problem.solutions) == 1 and problem.n <= MOST_INVERTED
        self._sensitivity = sensitivity(problem, problem.solutions[0]) if one else None

    @np.errstate(over="ignore", invalid="ignore")  # overflow counts as infinite
    def check(self, answer: Answer) -> Check:
        hopeless = self._problem.verdict in WITHOUT_SOLUTION
        if answer.claim == NONE or answer.z is None:
            false = answer.claim == SOLUTION or (answer.claim == NONE and bool(self._problem.solutions))
            nothing = optimality(self._problem, None)
            return Check(answer.claim == NONE and hopeless, false, None, None, None, optimality=nothing)
        z = np.asarray(answer.z, dtype=np.float64)
        point = Point(self._criterion, z, is_admissible=False)
        claimed, scaled = answer.claim == SOLUTION, point.scaled_residual
        residual, error = point.residual, self._problem.error(z)
        success = claimed and scaled <= self._accept and not hopeless
        terms = matrices.absolute_product(self._problem.M, np.abs(z)) + np.abs(self._problem.q)
        as_said = residual <= self._accept * float(terms.max()) < np.inf and not hopeless
        false = claimed and not success and not as_said
        stability, of_program = self._stability(error), optimality(self._problem, z)
        return Check(success, false, residual, scaled, error, *stability, of_program)

    def _stability(self, error: float | None) -> tuple[float | None, float | None]:
        """The condition of the solution, and the error in units of the effect of rounding the data."""
        if not self._sensitivity or error is None:
            return None, None
        return self._sensitivity / self._problem.size_of_solutions, error / EPS / self._sensitivity
