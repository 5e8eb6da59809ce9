"""Column and row sufficient matrices (R. W. Cottle, J.-S. Pang and V. Venkateswaran, Sufficient matrices and the linear
complementarity problem, Linear Algebra and its Applications 114/115 (1989) 231-249).

M is column sufficient if z_i (Mz)_i <= 0 for all i implies that all are 0, and row sufficient if M' is column
sufficient. Both imply P0. Small matrices are decided exactly: let z be a counterexample of smallest support P, I
the indices with z_i (Mz)_i < 0, and J the others in P. M_PP + T is singular for the diagonal T of -(Mz)_i / z_i. Its
determinant is a sum over the principal minors from J to P, each times a positive number; in a P0-matrix they are
therefore all 0, and M_PP + T is singular for every T >= 0 with support in I. No null vector of it vanishes on I, as it
could be subtracted from z to make P smaller. So the null space of M_PP + t diag(1_I), t > 0, has a counterexample; it
suffices to examine all I and P.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import chain, combinations

import numpy as np

from lcpcli.classes.context import Context
from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict, as_floats, index_set, shown
from lcpcli.rational import linear

EXACT = 8  # n up to which all pairs of index sets are examined


def column_sufficient(context: Context) -> Verdict:
    """z_i (Mz)_i <= 0 for all i only if all are 0."""
    return _implied(context) or _decided(context, context.whole, "Mz")


def row_sufficient(context: Context) -> Verdict:
    """z_i (M'z)_i <= 0 for all i only if all are 0."""
    if context.yes("symmetric"):
        own = context.verdicts["column_sufficient"]
        return Verdict(own.word, "it is symmetric, so this is column sufficiency", own.indices, own.vector)
    return _implied(context) or _decided(context, lambda: list(map(list, zip(*context.whole(), strict=True))), "M'z")


def _implied(context: Context) -> Verdict | None:
    for name, called in (("p_matrix", "a P-matrix"), ("positive_semidefinite", "positive semidefinite")):
        if context.yes(name):
            return Verdict(YES, f"it is {called}")
    if context.no("p0_matrix"):
        witness = context.verdicts["p0_matrix"]
        return Verdict(NO, "it is not a P0-matrix", witness.indices, witness.vector)
    return None


def _decided(context: Context, matrix: Callable[[], linear.Rows], product: str) -> Verdict:
    if context.n > EXACT:
        return Verdict(UNDECIDED, f"3^{context.n} pairs of index sets are too many; no sufficient condition was found")
    if not context.yes("p0_matrix"):
        return Verdict(UNDECIDED, "whether it is a P0-matrix is not decided")
    A = matrix()
    for P in _subsets(range(context.n)):
        block = [[A[i][j] for j in P] for i in P]
        if linear.determinant(block):
            continue
        for inside in _subsets(range(len(P))):
            context.check()
            z = _exception(block, set(inside))
            if z is not None:
                return _no(context, P, z, product)
    return Verdict(YES, f"no z on any of {2**context.n - 1} index sets is a counterexample, in exact arithmetic")


def _exception(block: linear.Rows, inside: set[int]) -> list[Fraction] | None:
    """z, not 0 on I, with (M_PP + t diag(1_I)) z = 0, if there is one: z_i (Mz)_i = -t z_i^2 on I, 0 elsewhere."""
    t = max(abs(v) for row in block for v in row) or 1
    shifted = [[v + t * (i == j and i in inside) for j, v in enumerate(row)] for i, row in enumerate(block)]
    _, free = linear.solve(shifted, [0] * len(block))
    return next((z for z in free if any(z[i] for i in inside)), None)


def _no(context: Context, P: tuple[int, ...], u: list[Fraction], product: str) -> Verdict:
    floats = as_floats(u)
    claim = f"z_i ({product})_i <= 0 for all i and < 0 for one"
    if floats is None:
        return Verdict(NO, f"{claim}, for a z with support {index_set(P)}, in exact arithmetic", P)
    z = np.zeros(context.n)
    z[list(P)] = floats
    return Verdict(NO, f"{claim}, z = {shown(z)}", P, z)


def _subsets(items: range) -> chain[tuple[int, ...]]:
    """All nonempty subsets, the smallest first."""
    return chain.from_iterable(combinations(items, size) for size in range(1, len(items) + 1))
