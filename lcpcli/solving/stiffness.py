"""Why methods that are not made for stiff problems fail on them, and when they have
failed."""

from __future__ import annotations

import math

from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.definite_systems import condition, is_nearly_definite
from lcpcli.linalg.patterns import affordable
from lcpcli.linalg.stiffness import may_be_stiff
from lcpcli.model.problem import Problem

MADE_FOR_IT = "interior"
# A condition number from which on methods without factors need hundreds of iterations
# for a digit.
STIFF = 1e4
# Methods that fail, with why: in terms of the root of the condition number.
REASONS = {
    "newton": "exchanges of wrong signs advance by a few unknowns or cycle",
    "fixed-point": "an iteration reduces the error by one part in {:.0e} at best",
    "shi": "a step along gradients reduces the error by one part in {:.0e} at best",
    "lemke": "rounding decides the pivots of long paths",
}


def explanation(problem: Problem, method: str) -> str:
    """Return why a method has failed on a stiff problem, as a clause for the user; ""
    if it is not stiff, or that takes a long time to tell."""
    M = problem.M
    if method not in REASONS or not (may_be_stiff(M) and affordable(M)):
        return ""
    try:
        if not is_nearly_definite(M):
            return ""
        size = condition(M)
    except TimeIsUp:
        return ""
    if size < STIFF:
        return ""
    root = math.sqrt(min(size, 1e16))
    number = "above 1e+16" if size > 1e16 else f"about {size:.0e}"
    return (
        f"M is stiff: its condition number is {number} in units of its diagonal, and "
        f"{REASONS[method].format(root)}; {MADE_FOR_IT} is made for such M"
    )
