"""Copositive matrices (v'Mv >= 0 for all v >= 0), strictly copositive (> 0 for v != 0) and copositive-plus ones.

Copositive-plus: copositive, and (M + M')v = 0 wherever v >= 0 and v'Mv = 0. Small matrices are decided exactly, with S
= M + M' and one linear system per index set P. S is copositive unless, for some P with det S_PP < 0, u = -S_PP^-1 e is
nonnegative (K. P. Hadeler, On copositive matrices, Linear Algebra and its Applications 49 (1983) 79-89; R. W. Cottle,
G. J. Habetler and C. E. Lemke, On classes of copositive matrices, ibid. 3 (1970) 295-310); then u'S_PP u = -e'u < 0.
The zeros of a copositive form are sums of those of minimal support, where S_PP has only the null vector u > 0 (R.
Hildebrand, Minimal zeros of copositive matrices, ibid. 459 (2014) 154-174).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations

import numpy as np

from lcpcli.classes.context import Context
from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict, as_floats, entry, index_set, shown
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import linear
from lcpcli.typing import Vector

EXACT = 9  # n up to which all index sets are examined

Entries = list[Fraction]


def copositive(context: Context) -> Verdict:
    """v'Mv >= 0 for every v >= 0."""
    if context.yes("positive_semidefinite"):
        return Verdict(YES, "it is positive semidefinite")
    if _smallest(context) >= 0:
        return Verdict(YES, "no entry of M + M' is negative")
    v = _simple(context)
    if v is not None:
        return Verdict(NO, f"v'Mv < 0 for v = {shown(v)} >= 0", vector=v)
    if context.n > EXACT:
        return _open(context)
    S = context.whole_symmetric_part()
    for P in _index_sets(context):
        u = _descent(S, P)
        if u is not None:
            return _no(context, P, u, "v'Mv < 0")
    return Verdict(YES, f"none of {2**context.n - 1} index sets supports a v >= 0 with v'Mv < 0, in exact arithmetic")


def strictly_copositive(context: Context) -> Verdict:
    """v'Mv > 0 for every v >= 0, v != 0."""
    if context.yes("positive_definite"):
        return Verdict(YES, "it is positive definite")
    low = np.flatnonzero(context.diagonal <= 0)
    if low.size:
        return Verdict(NO, f"{entry(low[0], low[0])} = {context.diagonal[low[0]]:.6g} is not positive", (int(low[0]),))
    if context.no("copositive"):
        return Verdict(NO, "it is not copositive", vector=context.verdicts["copositive"].vector)
    if _smallest(context) >= 0:
        return Verdict(YES, "no entry of M + M' is negative, and its diagonal is positive")
    if context.n > EXACT:
        return _open(context)
    if not context.yes("copositive"):
        return Verdict(UNDECIDED, "copositivity is not decided")
    found = next(_zeros(context), None)
    if found is not None:
        return _no(context, *found, "v'Mv = 0")
    return Verdict(YES, "it is copositive, and v'Mv = 0 for v >= 0 only if v = 0, in exact arithmetic")


def copositive_plus(context: Context) -> Verdict:
    """Copositive, and (M + M')v = 0 for every v >= 0 with v'Mv = 0."""
    for name, called in (
        ("positive_semidefinite", "positive semidefinite"),
        ("strictly_copositive", "strictly copositive"),
    ):
        if context.yes(name):
            return Verdict(YES, f"it is {called}")
    if context.no("copositive"):
        return Verdict(NO, "it is not copositive", vector=context.verdicts["copositive"].vector)
    loose = _loose(context)
    if loose is not None:
        i, j = loose
        v = np.zeros(context.n)
        v[i] = 1.0
        return Verdict(NO, f"{entry(i, i)} = 0, but {entry(i, j)} + {entry(j, i)} is not", (i, j), v)
    if context.n > EXACT:
        return _open(context)
    if not context.yes("copositive"):
        return Verdict(UNDECIDED, "copositivity is not decided")
    S = context.whole_symmetric_part()
    for P, u in _zeros(context):
        if any(sum(row[i] * value for i, value in zip(P, u, strict=True)) for row in S):
            return _no(context, P, u, "v'Mv = 0 but (M + M')v is not")
    return Verdict(YES, "it is copositive, and (M + M')v = 0 whenever v'Mv = 0 and v >= 0, in exact arithmetic")


def _open(context: Context) -> Verdict:
    return Verdict(
        UNDECIDED, f"2^{context.n} - 1 index sets are too many; no sufficient condition or counterexample was found"
    )


def _smallest(context: Context) -> float:
    """The smallest entry of M + M', whose sign is exact."""
    S = context.symmetric_part
    return float((S.data if is_sparse(S) else S).min(initial=0.0))


def _simple(context: Context) -> Vector | None:
    """v >= 0 with v'Mv < 0 among unit vectors, e and sums of two unit vectors."""
    S, n = context.symmetric_part, context.n
    candidates = [np.ones(n), np.zeros(n), np.zeros(n)]
    candidates[1][int(context.diagonal.argmin())] = 1.0
    if is_sparse(S):
        coordinates = S.tocoo()
        k = int(coordinates.data.argmin())
        candidates[2][[coordinates.row[k], coordinates.col[k]]] = 1.0
    else:
        candidates[2][list(np.unravel_index(int(S.argmin()), S.shape))] = 1.0
    return next((v for v in candidates if context.form_is(lambda sign: sign < 0, v)), None)


def _loose(context: Context) -> tuple[int, int] | None:
    """i, j with M_ii = 0 and M_ij + M_ji != 0, if there are any."""
    zero = np.flatnonzero(context.diagonal == 0)
    rows = abs(context.symmetric_part[zero])
    sizes = np.asarray(rows.sum(axis=1)).ravel()
    if not sizes.any():
        return None
    k = int(np.flatnonzero(sizes)[0])
    row = rows[[k]].toarray()[0] if is_sparse(rows) else rows[k]
    return int(zero[k]), int(row.argmax())


def _index_sets(context: Context) -> Iterator[tuple[int, ...]]:
    for size in range(1, context.n + 1):
        for P in combinations(range(context.n), size):
            context.check()
            yield P


def _descent(S: linear.Rows, P: tuple[int, ...]) -> Entries | None:
    """u >= 0 on P with S_PP u = -e, if S_PP is nonsingular: u'Su < 0."""
    u, free = linear.solve([[S[i][j] for j in P] for i in P], [-1] * len(P))
    return None if u is None or free or min(u) < 0 else u


def _zeros(context: Context) -> Iterator[tuple[tuple[int, ...], Entries]]:
    """The zeros v >= 0 of minimal support of a copositive form: P and v_P > 0, which spans the null space of S_PP."""
    S = context.whole_symmetric_part()
    for P in _index_sets(context):
        _, free = linear.solve([[S[i][j] for j in P] for i in P], [0] * len(P))
        if len(free) == 1:
            u = free[0] if sum(free[0]) > 0 else [-value for value in free[0]]
            if min(u) > 0:
                yield P, u


def _no(context: Context, P: tuple[int, ...], u: Entries, claim: str) -> Verdict:
    """No, for the v with v_P = u, given in floats if exactly representable."""
    floats = as_floats(u)
    if floats is None:
        return Verdict(NO, f"{claim} for some v >= 0 with support {index_set(P)}, in exact arithmetic", P)
    v = np.zeros(context.n)
    v[list(P)] = floats
    return Verdict(NO, f"{claim} for v = {shown(v)} >= 0", P, v)
