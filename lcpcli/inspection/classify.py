"""Matrix classes of M, with evidence: the table of all classes, and the classes that the entries decide.

The entries of M are taken as exact numbers, and no "yes" or "no" depends on rounding: what is found in double precision
is either guaranteed by an error bound or decided in exact arithmetic, or else it is "not decided".
"""

from __future__ import annotations

import math
from importlib import import_module
from itertools import count

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Check, Context, Verdict, entry, signs
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Matrix


def symmetric(context: Context) -> Verdict:
    """Decide whether M' = M."""
    with np.errstate(over="ignore"):
        return _nonzero_entry(context, context.M - context.M.T) or Verdict(YES, "M' = M, entrywise")


def skew_symmetric(context: Context) -> Verdict:
    """Decide whether M' = -M."""
    return _nonzero_entry(context, context.symmetric_part) or Verdict(YES, "M' = -M, entrywise")


def _nonzero_entry(context: Context, difference: Matrix) -> Verdict | None:
    """Return NO with the first pair of entries of M whose difference is not 0; None if there is none."""
    place = _first(difference)
    if place is None:
        return None
    i, j = place
    own = f"{entry(i, j)} = {context.M[i, j]:.6g}"
    if i == j:
        return Verdict(NO, f"{own} is not 0", (i,))
    return Verdict(NO, f"{own}, {entry(j, i)} = {context.M[j, i]:.6g}", (i, j))


def z_matrix(context: Context) -> Verdict:
    """Decide whether no entry off the diagonal is positive."""
    place = _first(matrices.comparison(context.M) < context.M)
    if place is None:
        return Verdict(YES, "no entry off the diagonal is positive")
    return Verdict(NO, f"{entry(*place)} = {context.M[place]:.6g} is positive", place)


def _first(A: Matrix) -> tuple[int, int] | None:
    """Return row and column of the first entry that is not 0; None if there is none."""
    if is_sparse(A):
        rows, columns = A.nonzero()
        return (int(rows[0]), int(columns[0])) if rows.size else None
    i, j = divmod(int((A != 0).argmax()), A.shape[1])
    return (i, j) if A[i, j] else None


def strictly_diagonally_dominant(context: Context) -> Verdict:
    """Decide whether |M_ii| > sum of |M_ij|, j != i, for every row i."""
    i = weak_row(context.M, context.check)
    if i is None:
        return Verdict(YES, "in every row |M_ii| exceeds the sum of the other |M_ij|")
    return Verdict(NO, f"row {i + 1}: |M_ii| does not exceed the sum of the other |M_ij|", (i,))


def weak_row(M: Matrix, check: Check) -> int | None:
    """Return the first row that is not strictly diagonally dominant, or None. `check` may raise TimeIsUp."""
    weak = np.flatnonzero(signs(matrices.comparison(M), np.ones(M.shape[0]), check) <= 0)
    return int(weak[0]) if weak.size else None


CLASSES = {  # the file of each, in which a function of that name decides it; each relies on those before it
    **dict.fromkeys(("symmetric", "skew_symmetric", "z_matrix", "strictly_diagonally_dominant"), "classify"),
    **dict.fromkeys(("h_plus", "m_matrix"), "p_matrices"),
    **dict.fromkeys(("positive_definite", "positive_semidefinite"), "definite"),
    **dict.fromkeys(("p_matrix", "p0_matrix", "column_sufficient", "row_sufficient"), "p_matrices"),
    **dict.fromkeys(("copositive", "strictly_copositive", "copositive_plus"), "copositive"),
}


def classify(M: Matrix, last: str = "", steps: float = math.inf) -> dict[str, Verdict]:
    """Return for each of CLASSES, or up to the class `last`, whether M belongs to it.

    M is dense or sparse of shape (n, n) with finite entries. When the time is up, expensive tests end, and no
    further one is started, but implications are still reported.

    steps : of exact elimination and of searches, after which they end too.
    """
    if not M.shape[0]:
        return dict.fromkeys(CLASSES, Verdict(YES, "M has no entries"))
    counter = count()

    def check() -> None:
        if next(counter) >= steps:
            raise TimeIsUp
        interrupts.check()

    context = Context(M, check)
    for name, file in CLASSES.items():
        with imports:
            decide = getattr(import_module(f"lcpcli.inspection.{file}"), name)
        try:
            context.verdicts[name] = decide(context)
        except TimeIsUp:
            why = "the time was used up" if steps == math.inf else "it takes too many steps"
            context.verdicts[name] = Verdict(UNDECIDED, why)
        if name == last:
            break
    return context.verdicts
