"""Why methods that are not made for stiff problems fail on them."""

from __future__ import annotations

import math

from lcpcli.interrupts import TimeIsUp
from lcpcli.methods.definite import MADE_FOR_IT, MAX_TOLD, in_words, stiffness
from lcpcli.model.problem import Problem

# Why each of these methods fails; the number is the square root of the condition
# number.
REASONS = {
    "newton": "pivots on infeasibilities advance by a few unknowns or cycle",
    "fixed-point": "an iteration reduces the error by one part in {:.0e} at best",
    "shi": "a step along gradients reduces the error by one part in {:.0e} at best",
    "lemke": "rounding decides the pivots of long paths",
}


def explanation(problem: Problem, method: str) -> str:
    """Return why a method has failed on a stiff problem, as a clause for the user; ""
    if it is not stiff, or that takes a long time to decide."""
    if method not in REASONS:
        return ""
    try:
        condition = stiffness(problem.M)
    except TimeIsUp:
        return ""
    if condition is None:
        return ""
    reason = REASONS[method].format(math.sqrt(min(condition, MAX_TOLD)))
    return (
        f"M is stiff: its condition number is {in_words(condition)} relative to its "
        f"diagonal, and {reason}; {MADE_FOR_IT} is made for such M"
    )
