"""Why the iterations on x, shi and fixed-point, fail on a problem, and which method
solves it: by facts that cost at most a few factorizations of M.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.errors import listed
from lcpcli.inspection import theory
from lcpcli.inspection.verdict import NO, YES, Verdict, called, classify
from lcpcli.linalg import matrices
from lcpcli.linalg.patterns import affordable
from lcpcli.linalg.units import equilibrate
from lcpcli.methods.registry import METHODS
from lcpcli.model.problem import Problem

# Unknowns up to which M is classified, and the limit on steps of exact elimination: all
# principal minors of order 12 take so many, about a tenth of a second.
MAX_CLASSIFIED, MAX_STEPS = 500, 5000
# Unknowns up to which the condition number is estimated, by factors of M.
MAX_FACTORIZED = 20_000
# The last class in `verdict.CLASSES` for which one of the remedies is guaranteed.
LAST_CLASS = "copositive_plus"
REMEDIES = ("newton", "interior", "lemke")
# Classes with a solution for each q and all bounds for which a remedy is guaranteed.
SOLVABLE = ("p_matrix", "positive_definite", "strictly_copositive")
# Condition number from which linear convergence takes thousands of iterations.
SLOW_CONDITION = 1e3
DEGENERATE = 1e-9  # a w_i below this, relative to the terms of its row, is considered 0


class Explanation(NamedTuple):
    """Clauses on the causes of the failure, none if none are known, on what the
    iterations need, and on a method that is guaranteed to solve the problem; "" if
    there is nothing to say.
    """

    causes: list[str]
    need: str = ""
    guarantee: str = ""


@np.errstate(all="ignore")
def explanation(problem: Problem, methods: Sequence[str]) -> Explanation:
    """Return why these iterations on x have failed on a problem."""
    classes: Mapping[str, Verdict] = {}
    if problem.n <= MAX_CLASSIFIED:
        classes = classify(problem.M, LAST_CLASS, MAX_STEPS)
    guarantee = _guarantee(classes, problem)
    if "p_matrix" in classes and classes["p_matrix"].word == NO:
        cause = f"M is not a P-matrix ({classes['p_matrix'].evidence})"
        theorem = f"as the theorems on {listed(methods)} require"
        return Explanation([f"{cause}, {theorem}"], guarantee=guarantee)
    causes, need = _of_numbers(problem)
    if "shi" in methods and (count := _degenerate(problem)):
        causes.append(
            f"z_i = w_i = 0 for {count} of {problem.n} i, close to which F has a kink"
        )
    return Explanation(causes, need, guarantee)


def _guarantee(classes: Mapping[str, Verdict], problem: Problem) -> str:
    """Return which method is guaranteed to solve a problem with M of these classes, or
    to prove that it has no solution; "" if none is."""
    members = {name for name, verdict in classes.items() if verdict.word == YES}
    for method_name in REMEDIES:
        sufficient = theory.sufficient_classes(METHODS[method_name], problem)
        for class_name in filter(members.__contains__, sufficient):
            finds = "solve it"
            if class_name not in SOLVABLE:
                finds += " or to prove that it has no solution"
            return (
                f"{method_name} is guaranteed to {finds}, as M is {called(class_name)}"
            )
    return ""


def _of_numbers(problem: Problem) -> tuple[list[str], str]:
    """Return clauses on the scaling and the condition number of M, and on what a badly
    scaled M needs.
    """
    M = problem.M
    causes = list[str]()
    need = ""
    scaled = matrices.scaled(M, *equilibrate(M, problem.q))
    before, after = max(theory.spread(M)), max(theory.spread(scaled))
    if before > theory.BAD_SPREAD and after < before - 1:
        causes.append(
            f"the largest entries of rows or columns of M differ by {before:.0f} "
            "decades"
        )
        M, need = scaled, "the option scale equilibrates M"
    is_known = problem.n <= MAX_FACTORIZED and affordable(M)
    condition = theory.condition(M) if is_known else 0.0
    if condition > SLOW_CONDITION:
        size = "infinite" if condition == math.inf else f"about {condition:.0e}"
        later = " even if it is equilibrated" if need else ""
        causes.append(
            f"the condition of M is {size}{later}, and linear convergence slows down "
            "with it"
        )
    return causes, need


def _degenerate(problem: Problem) -> int:
    """Return the number of i for which the known solution has z_i at a bound and w_i =
    0; 0 if no solution is known.
    """
    if not problem.solutions:
        return 0
    z = problem.solutions[0]
    terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    low, high = problem.box.vectors(problem.n)
    is_small = np.abs(problem.w(z)) <= DEGENERATE * terms
    return int((((z == low) | (z == high)) & is_small).sum())
