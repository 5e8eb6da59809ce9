"""Copositive matrices (v'Mv >= 0 for all v >= 0), strictly copositive (> 0 for v != 0) and copositive-plus ones.

Copositive-plus: copositive, and (M + M')v = 0 wherever v >= 0 and v'Mv = 0. Small matrices are decided exactly, with
S = M + M' and one linear system an index set P. S is copositive unless, for some P with det S_PP < 0, u = -S_PP^-1 e is
nonnegative (K. P. Hadeler, On copositive matrices, Linear Algebra and its Applications 49 (1983) 79-89; R. W. Cottle,
G. J. Habetler and C. E. Lemke, On classes of copositive matrices, ibid. 3 (1970) 295-310); then u'S_PP u = -e'u < 0.
The zeros of a copositive form are sums of those of minimal support, where S_PP has the null vector u > 0 alone
(R. Hildebrand, Minimal zeros of copositive matrices, ibid. 459 (2014) 154-174).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations

import numpy as np

from lcpcli.classes.context import Subject
from lcpcli.classes.verdict import NO, OPEN, YES, Verdict, as_floats, index_set, shown
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import elimination, linear
from lcpcli.typing import Vector

EXACT = 9  # n up to which all index sets are looked at

Entries = list[Fraction]


def copositive(subject: Subject) -> Verdict:
    """v'Mv >= 0 for every v >= 0."""
    if subject.yes("positive_semidefinite"):
        return Verdict(YES, "it is positive semidefinite")
    if _smallest(subject) >= 0:
        return Verdict(YES, "no entry of M + M' is negative")
    v = _simple(subject)
    if v is not None:
        return Verdict(NO, f"v'Mv < 0 for v = {shown(v)} >= 0", vector=v)
    if subject.n > EXACT:
        return _open(subject)
    S = subject.whole_symmetric_part()
    for P in _index_sets(subject):
        u = _descent(S, P)
        if u is not None:
            return _no(subject, P, u, "v'Mv < 0")
    return Verdict(YES, f"no index set of {2**subject.n - 1} holds a v >= 0 with v'Mv < 0, exactly computed")


def strictly_copositive(subject: Subject) -> Verdict:
    """v'Mv > 0 for every v >= 0, v != 0."""
    if subject.yes("positive_definite"):
        return Verdict(YES, "it is positive definite")
    low = np.flatnonzero(subject.diagonal <= 0)
    if low.size:
        return Verdict(NO, f"M[{low[0]}][{low[0]}] = {subject.diagonal[low[0]]:.6g} is not positive", (int(low[0]),))
    if subject.no("copositive"):
        return Verdict(NO, "it is not copositive", vector=subject.verdicts["copositive"].vector)
    if _smallest(subject) >= 0:
        return Verdict(YES, "no entry of M + M' is negative, and its diagonal is positive")
    if subject.n > EXACT:
        return _open(subject)
    if not subject.yes("copositive"):
        return Verdict(OPEN, "it is not decided whether it is copositive")
    found = next(_zeros(subject), None)
    if found is not None:
        return _no(subject, *found, "v'Mv = 0")
    return Verdict(YES, "it is copositive, and v'Mv = 0 for no other v >= 0 than 0, exactly computed")


def copositive_plus(subject: Subject) -> Verdict:
    """Copositive, and (M + M')v = 0 for every v >= 0 with v'Mv = 0."""
    for name, called in (
        ("positive_semidefinite", "positive semidefinite"),
        ("strictly_copositive", "strictly copositive"),
    ):
        if subject.yes(name):
            return Verdict(YES, f"it is {called}")
    if subject.no("copositive"):
        return Verdict(NO, "it is not copositive", vector=subject.verdicts["copositive"].vector)
    loose = _loose(subject)
    if loose is not None:
        i, j = loose
        v = np.zeros(subject.n)
        v[i] = 1.0
        return Verdict(NO, f"M[{i}][{i}] = 0, but M[{i}][{j}] + M[{j}][{i}] is not", (i, j), v)
    if subject.n > EXACT:
        return _open(subject)
    if not subject.yes("copositive"):
        return Verdict(OPEN, "it is not decided whether it is copositive")
    S = subject.whole_symmetric_part()
    for P, u in _zeros(subject):
        if any(sum(row[i] * value for i, value in zip(P, u, strict=True)) for row in S):
            return _no(subject, P, u, "v'Mv = 0 but (M + M')v is not")
    return Verdict(YES, "it is copositive, and (M + M')v = 0 where v'Mv = 0 and v >= 0, exactly computed")


def _open(subject: Subject) -> Verdict:
    return Verdict(
        OPEN, f"2^{subject.n} - 1 index sets are too many, no sufficient condition and no exception was found"
    )


def _smallest(subject: Subject) -> float:
    """The least entry of M + M', whose sign is exact."""
    S = subject.symmetric_part
    return float((S.data if is_sparse(S) else S).min(initial=0.0))


def _simple(subject: Subject) -> Vector | None:
    """v >= 0 with v'Mv < 0 among unit vectors, e and sums of two unit vectors."""
    S, n = subject.symmetric_part, subject.n
    candidates = [np.ones(n), np.zeros(n), np.zeros(n)]
    candidates[1][int(subject.diagonal.argmin())] = 1.0
    if is_sparse(S):
        coordinates = S.tocoo()
        k = int(coordinates.data.argmin())
        candidates[2][[coordinates.row[k], coordinates.col[k]]] = 1.0
    else:
        candidates[2][list(np.unravel_index(int(S.argmin()), S.shape))] = 1.0
    return next((v for v in candidates if subject.form_is(lambda sign: sign < 0, v)), None)


def _loose(subject: Subject) -> tuple[int, int] | None:
    """i, j with M_ii = 0 and M_ij + M_ji != 0, if there are any."""
    zero = np.flatnonzero(subject.diagonal == 0)
    rows = abs(subject.symmetric_part[zero])
    sizes = np.asarray(rows.sum(axis=1)).ravel()
    if not sizes.any():
        return None
    k = int(np.flatnonzero(sizes)[0])
    row = rows[[k]].toarray()[0] if is_sparse(rows) else rows[k]
    return int(zero[k]), int(row.argmax())


def _index_sets(subject: Subject) -> Iterator[tuple[int, ...]]:
    for size in range(1, subject.n + 1):
        for P in combinations(range(subject.n), size):
            subject.check()
            yield P


def _descent(S: elimination.Rows, P: tuple[int, ...]) -> Entries | None:
    """u >= 0 on P with S_PP u = -e, if S_PP is regular: u'Su < 0."""
    u, free = linear.solve([[S[i][j] for j in P] for i in P], [-1] * len(P))
    return None if u is None or free or min(u) < 0 else u


def _zeros(subject: Subject) -> Iterator[tuple[tuple[int, ...], Entries]]:
    """The zeros v >= 0 of minimal support of a copositive form: P and v_P > 0 with S_PP v_P = 0, v_P alone."""
    S = subject.whole_symmetric_part()
    for P in _index_sets(subject):
        _, free = linear.solve([[S[i][j] for j in P] for i in P], [0] * len(P))
        if len(free) == 1:
            u = free[0] if sum(free[0]) > 0 else [-value for value in free[0]]
            if min(u) > 0:
                yield P, u


def _no(subject: Subject, P: tuple[int, ...], u: Entries, claim: str) -> Verdict:
    """No, for the v with v_P = u, given in floats where they hold it."""
    floats = as_floats(u)
    if floats is None:
        return Verdict(NO, f"{claim} for some v >= 0 with support {index_set(P)}, exactly computed", P)
    v = np.zeros(subject.n)
    v[list(P)] = floats
    return Verdict(NO, f"{claim} for v = {shown(v)} >= 0", P, v)
