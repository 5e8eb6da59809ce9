"""The best replies of the players of a 2 x 2 game, as sets in the unit square of the probabilities of first strategies.

Points are (p, q): the probabilities that the row and the column player play their first strategies.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

Point: TypeAlias = tuple[Fraction, Fraction]
Line: TypeAlias = list[Point]
SQUARE: Line = [(Fraction(p), Fraction(q)) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]


def of_row(A: Sequence[Sequence[Fraction]]) -> Line:
    """Return the p that are best against each q, as a line of points from q = 0 to q = 1; SQUARE if all p are."""
    return [(p, q) for q, p in _replies(A[0][1] - A[1][1], A[0][0] - A[1][0])] or SQUARE


def of_column(B: Sequence[Sequence[Fraction]]) -> Line:
    """Return the q that are best against each p, as a line of points from p = 0 to p = 1; SQUARE if all q are."""
    return list(_replies(B[1][0] - B[1][1], B[0][0] - B[0][1])) or SQUARE


def _replies(at_0: Fraction, at_1: Fraction) -> Line:
    """Return the best replies as points (probability of the other, own probability); none if all are best.

    at_0, at_1 : what a player gains by the first strategy instead of the second, against the second and against the
        first strategy of the other. The gain is linear in mixed strategies, and where it is 0, all replies are best.
    """
    if at_0 == at_1 == 0:
        return []
    zero, one = Fraction(0), Fraction(1)
    if at_0 * at_1 > 0:
        reply = one if at_0 > 0 else zero
        return [(zero, reply), (one, reply)]
    turn, falls = at_0 / (at_0 - at_1), at_0 > at_1
    corners = [(zero, one * falls), (turn, one * falls), (turn, one * (not falls)), (one, one * (not falls))]
    return list(dict.fromkeys(corners))
