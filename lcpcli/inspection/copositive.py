"""Copositive (v'Mv >= 0 for all v >= 0), strictly copositive (> 0 for v != 0) and copositive-plus matrices.

Copositive-plus: copositive, and (M + M')v = 0 wherever v >= 0 and v'Mv = 0. Small matrices are decided exactly, with S
= M + M' and one linear system per index set P. S is copositive unless, for some P with det S_PP < 0, u = -S_PP^-1 e is
nonnegative (K. P. Hadeler, On copositive matrices, Linear Algebra and its Applications 49 (1983) 79-89; R. W. Cottle,
G. J. Habetler and C. E. Lemke, On classes of copositive matrices, ibid. 3 (1970) 295-310); then u'S_PP u = -e'u < 0.
The zeros of a copositive form are sums of those of minimal support, where S_PP has only the null vector u > 0 (R.
Hildebrand, Minimal zeros of copositive matrices, ibid. 459 (2014) 154-174). Of any size, a sum of a positive
semidefinite matrix and one without negative entries is copositive: that of contact with friction (D. E. Stewart and J.
C. Trinkle, An implicit time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb friction,
International Journal for Numerical Methods in Engineering 39 (1996) 2673-2691), in whatever order the rows are.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli.inspection.definite import positive_definite, positive_semidefinite
from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Context, Verdict, block, entry, index_set, index_sets, text_of
from lcpcli.linalg import matrices
from lcpcli.rational import elimination
from lcpcli.rational.elimination import Rows
from lcpcli.typing import Vector

ALL_SETS = 9  # n up to which all 2^n - 1 index sets are examined, each by a linear system in exact arithmetic

Entries = list[Fraction]


def copositive(context: Context) -> Verdict:
    """Decide whether v'Mv >= 0 for every v >= 0."""
    found = context.implied("positive_semidefinite")
    if found is not None:
        return found
    if context.symmetric_part.min() >= 0:
        return Verdict(YES, "no entry of M + M' is negative")
    v = _simple(context)
    if v is not None:
        return Verdict(NO, f"v'Mv < 0 for v = {text_of(v)} >= 0", vector=v)
    found = _beside_zeros_on_diagonal(context)
    if found is not None or context.n > ALL_SETS:
        return found or _undecided(context)
    for P, S in _blocks(context):
        u, free = elimination.solve(S, [-1] * len(P))
        if u is not None and not free and min(u) >= 0:  # then u'Su < 0
            return _excluded(context, P, u, "v'Mv < 0")
    return Verdict(YES, f"none of {2**context.n - 1} index sets supports a v >= 0 with v'Mv < 0, in exact arithmetic")


def strictly_copositive(context: Context) -> Verdict:
    """Decide whether v'Mv > 0 for every v >= 0, v != 0."""
    found = context.implied("positive_definite") or context.low_diagonal() or _not_copositive(context)
    if found is not None:
        return found
    if context.symmetric_part.min() >= 0:
        return Verdict(YES, "no entry of M + M' is negative, and its diagonal is positive")
    return _by_zeros(context, plus=False)


def copositive_plus(context: Context) -> Verdict:
    """Decide whether M is copositive, and (M + M')v = 0 for every v >= 0 with v'Mv = 0."""
    found = context.implied("positive_semidefinite", "strictly_copositive") or _not_copositive(context)
    return found or _by_zero_on_diagonal(context) or _by_zeros(context, plus=True)


def _beside_zeros_on_diagonal(context: Context) -> Verdict | None:
    """Return YES if M + M' has no negative entry in the rows where its diagonal is 0, as those of the slacks of
    friction cones, and is positive semidefinite without them; else None."""
    rows, rest = np.flatnonzero(context.diagonal == 0), np.flatnonzero(context.diagonal)
    if not rows.size or not rest.size or context.symmetric_part[rows].min() < 0:
        return None
    part = Context(context.M[rest][:, rest], context.check)
    part.verdicts["positive_definite"] = positive_definite(part)
    if positive_semidefinite(part).word != YES:
        return None
    rows_of_zeros = "the row" if rows.size == 1 else f"the {rows.size} rows"
    where = f"{rows_of_zeros} where its diagonal is 0, and is positive semidefinite without them"
    return Verdict(YES, f"M + M' has no negative entry in {where}")


def _undecided(context: Context) -> Verdict:
    sets = f"2^{context.n} - 1 index sets"
    return Verdict(UNDECIDED, f"{sets} are too many; no sufficient condition or counterexample was found")


def _not_copositive(context: Context) -> Verdict | None:
    known = context.verdicts["copositive"]
    return Verdict(NO, "it is not copositive", vector=known.vector) if known.word == NO else None


def _excluded(context: Context, P: tuple[int, ...], u: Entries, claim: str) -> Verdict:
    """Return NO by the v with v_P = u, which is given in doubles if they represent it exactly."""
    v = context.vector(P, u)
    if v is None:
        return Verdict(NO, f"{claim} for some v >= 0 with support {index_set(P)}, in exact arithmetic", P)
    return Verdict(NO, f"{claim} for v = {text_of(v)} >= 0", P, v)


def _simple(context: Context) -> Vector | None:
    """Return v >= 0 with v'Mv < 0 among e, unit vectors and sums of two unit vectors; None if there is none."""
    S, n = context.symmetric_part, context.n
    candidates = [np.ones(n), np.zeros(n), np.zeros(n)]
    candidates[1][int(context.diagonal.argmin())] = 1.0
    candidates[2][list(np.unravel_index(int(S.argmin()), S.shape))] = 1.0
    return next((v for v in candidates if context.form_is_low(v, strict=False)), None)


def _by_zero_on_diagonal(context: Context) -> Verdict | None:
    """Return NO to copositive-plus by i and j with M_ii = 0 and M_ij + M_ji != 0, if there are any; else None."""
    zero = np.flatnonzero(context.diagonal == 0)
    rows = abs(context.symmetric_part[zero])
    loose = np.flatnonzero(rows.sum(axis=1))
    if not loose.size:
        return None
    i, j = int(zero[loose[0]]), int(matrices.dense(rows[loose[:1]])[0].argmax())
    wrong = f"{entry(i, i)} = 0, but {entry(i, j)} + {entry(j, i)} is not"
    return Verdict(NO, wrong, (i, j), context.vector((i,), (1,)))


def _blocks(context: Context) -> Iterator[tuple[tuple[int, ...], Rows]]:
    """Yield every index set P, the smallest first, with S_PP in integers."""
    S = context.whole_symmetric_part()
    for P in index_sets(context.n):
        context.check()
        yield P, block(S, P)


def _by_zeros(context: Context, plus: bool) -> Verdict:
    """Decide whether a copositive M is strictly copositive, or copositive-plus, by the zeros v >= 0 of minimal support
    of its form, for which some v_P > 0 spans the null space of S_PP."""
    if context.n > ALL_SETS:
        return _undecided(context)
    if not context.yes("copositive"):
        return Verdict(UNDECIDED, "copositivity is not decided")
    whole = context.whole_symmetric_part()
    for P, S in _blocks(context):
        _, free = elimination.solve(S, [0] * len(P))
        if len(free) != 1:
            continue
        u = free[0] if sum(free[0]) > 0 else [-value for value in free[0]]
        if min(u) <= 0:
            continue
        if not plus:
            return _excluded(context, P, u, "v'Mv = 0")
        if any(sum(row[i] * value for i, value in zip(P, u, strict=True)) for row in whole):
            return _excluded(context, P, u, "v'Mv = 0 but (M + M')v is not")
    zero = "(M + M')v = 0 whenever v'Mv = 0 and v >= 0" if plus else "v'Mv = 0 for v >= 0 only if v = 0"
    return Verdict(YES, f"it is copositive, and {zero}, in exact arithmetic")
