"""Classes decided by the entries: symmetric, skew-symmetric, Z and strictly diagonally dominant matrices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.classes.context import Context, signs
from lcpcli.classes.verdict import NO, YES, Verdict, entry
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Matrix


def symmetric(context: Context) -> Verdict:
    """M' = M."""
    if matrices.is_symmetric(context.M):
        return Verdict(YES, "M' = M, entrywise")
    with np.errstate(over="ignore"):
        i, j = _first(context.M - context.M.T)
    return Verdict(NO, f"{entry(i, j)} = {context.M[i, j]:.6g}, {entry(j, i)} = {context.M[j, i]:.6g}", (i, j))


def skew_symmetric(context: Context) -> Verdict:
    """M' = -M."""
    total = context.symmetric_part
    if not (total.data if is_sparse(total) else total).any():
        return Verdict(YES, "M' = -M, entrywise")
    i, j = _first(total)
    if i == j:
        return Verdict(NO, f"{entry(i, i)} = {context.M[i, i]:.6g} is not 0", (i,))
    return Verdict(NO, f"{entry(i, j)} = {context.M[i, j]:.6g}, {entry(j, i)} = {context.M[j, i]:.6g}", (i, j))


def z_matrix(context: Context) -> Verdict:
    """No positive entry off the diagonal."""
    M = context.M
    if is_sparse(M):
        coordinates = M.tocoo()
        positive = np.flatnonzero((coordinates.data > 0) & (coordinates.row != coordinates.col))
        places = [(int(coordinates.row[k]), int(coordinates.col[k])) for k in positive[:1]]
    else:
        mask = M > 0
        np.fill_diagonal(mask, False)
        places = [(int(i), int(j)) for i, j in [np.unravel_index(int(mask.argmax()), mask.shape)] if mask[i, j]]
    if not places:
        return Verdict(YES, "no entry off the diagonal is positive")
    i, j = places[0]
    return Verdict(NO, f"{entry(i, j)} = {M[i, j]:.6g} is positive", (i, j))


def strictly_diagonally_dominant(context: Context) -> Verdict:
    """|M_ii| > sum of |M_ij|, j != i, for every row i."""
    i = weak_row(context.M, context.check)
    if i is None:
        return Verdict(YES, "in every row |M_ii| exceeds the sum of the other |M_ij|")
    return Verdict(NO, f"row {i + 1}: |M_ii| does not exceed the sum of the other |M_ij|", (i,))


def weak_row(M: Matrix, check: Callable[[], None]) -> int | None:
    """The first row that is not strictly diagonally dominant; None if there is none. `check` may raise Late."""
    weak = np.flatnonzero(signs(matrices.comparison(M), np.ones(M.shape[0]), check) <= 0)
    return int(weak[0]) if weak.size else None


def _first(A: Matrix) -> tuple[int, int]:
    """Row and column of the first nonzero entry of a nonzero A."""
    if is_sparse(A):
        coordinates = A.tocoo()
        k = int(np.flatnonzero(coordinates.data)[0])
        return int(coordinates.row[k]), int(coordinates.col[k])
    i, j = np.unravel_index(int((A != 0).argmax()), A.shape)
    return int(i), int(j)
