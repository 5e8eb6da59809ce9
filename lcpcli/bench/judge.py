"""What an answer is worth, found out from the original M and q and never from the solver's word."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.accuracy import Accuracy
from lcpcli.bench.answer import NONE, SOLUTION, Answer
from lcpcli.problem import WITHOUT_SOLUTION, Problem


@dataclass(frozen=True)
class Judgement:
    """success : claimed, and so. false_success : claimed, and not so. The measures are those of `accuracy.Accuracy`."""

    success: bool
    false_success: bool
    residual: float | None
    relative_residual: float | None
    error: float | None


class Judge:
    """The judge of all answers to one problem.

    A claimed solution holds if its relative residual is at most `accept` and the problem is not known to have none. A
    claim that there is no solution holds where that is known, is false where a solution is known, and is neither
    success nor false success where nothing is known.
    """

    def __init__(self, problem: Problem, accept: float) -> None:
        self._problem, self._accept = problem, accept
        self._accuracy = Accuracy(problem)

    @np.errstate(over="ignore", invalid="ignore")  # what overflows is judged as infinite
    def judge(self, answer: Answer) -> Judgement:
        hopeless = self._problem.verdict in WITHOUT_SOLUTION
        if answer.claim == NONE or answer.z is None:
            false = answer.claim == SOLUTION or (answer.claim == NONE and bool(self._problem.solutions))
            return Judgement(answer.claim == NONE and hopeless, false, None, None, None)
        z = np.asarray(answer.z, dtype=np.float64)
        w = self._problem.w(z)
        relative = self._accuracy.relative_residual(z, w)
        claimed = answer.claim == SOLUTION
        holds = relative <= self._accept and not hopeless
        residual, error = self._accuracy.natural_residual(z, w), self._accuracy.error(z)
        return Judgement(claimed and holds, claimed and not holds, residual, relative, error)
