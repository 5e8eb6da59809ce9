"""The extreme rays of a polyhedral cone in exact arithmetic, by the double description
method (T. S. Motzkin, H. Raiffa, G. L. Thompson and R. M. Thrall, in: Contributions to
the Theory of Games II, Princeton 1953, 51-73; K. Fukuda and A. Prodon, Double
description method revisited, Lecture Notes in Computer Science 1120 (1996) 91-111).

Inequalities are added one by one. The rays that violate the new one are replaced by
combinations with rays that satisfy it strictly, one for each edge of the cone that the
inequality cuts. Two rays span an edge if and only if no third ray is zero wherever both
are. They then have at least d - 2 zeros in common, where d is the dimension; this is
tested first, as few pairs have so many. Degenerate cones, of which a method that pivots
visits many bases for each ray, take no longer than others.

Where rays are positive is stored in floating point, as a product of such matrices
counts how many positive entries each pair of rays has in common.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.rational.numbers import dot, primitive
from lcpcli.typing import Indices, Mask, Support

# Entries of the matrices with a row for each pair of rays: they take 16 megabytes.
MAX_ENTRIES = 4_000_000


class Rays(NamedTuple):
    """Extreme rays. values : the unknowns of each ray, integers without a common
    divisor. positive : 1 for each unknown, and then for each form, that is positive.
    """

    values: list[list[int]]
    positive: Support


def extreme_rays(
    forms: Sequence[Sequence[int]],
    partners: Support,
    max_rays: int,
    check: Callable[[], None],
) -> Rays | None:
    """Return the extreme rays of the cone {v >= 0, forms v >= 0} that are zero wherever
    one of the partners is positive; None if there are more than `max_rays`, also before
    all forms are added.

    forms : shape (k, d), integers. partners : shape (p, d + k), 1 where an unknown or a
    form is positive. check : called before each step; it may raise.

    Rays that no partner allows are dropped at once. The others are complete, as each
    partner belongs to a face of the cone, whose rays are combinations of its rays only.
    """
    d = len(forms[0])
    rays = Rays(np.eye(d, dtype=int).tolist(), np.eye(d, dtype=np.float32))
    for form in forms:
        cut = _cut(rays, form, partners, max_rays, check)
        if cut is None:
            return None
        rays = cut
    return rays


def _cut(
    rays: Rays,
    form: Sequence[int],
    partners: Support,
    max_rays: int,
    check: Callable[[], None],
) -> Rays | None:
    """Return the rays of the part of a cone where one more form is nonnegative."""
    check()
    heights = [dot(form, ray) for ray in rays.values]
    signs = np.array([(height > 0) - (height < 0) for height in heights])
    parents = [np.zeros((2, 0), dtype=int)]
    for pairs in _edges(rays.positive, signs, len(form), check):
        both = np.maximum(*rays.positive[pairs])
        parents.append(pairs[:, _allowed(both, partners, check)])
        if sum(each.shape[1] for each in parents) > max_rays:
            return None
    above, below = np.concatenate(parents, axis=1)
    feasible = np.flatnonzero(signs >= 0)
    values = [rays.values[i] for i in feasible]
    for p, q in zip(above.tolist(), below.tolist(), strict=True):
        check()
        up, down = heights[p], -heights[q]
        ends = zip(rays.values[p], rays.values[q], strict=True)
        values.append(primitive([down * a + up * b for a, b in ends]))
    new = np.maximum(rays.positive[above], rays.positive[below])
    positive = np.zeros((len(values), rays.positive.shape[1] + 1), np.float32)
    positive[:, :-1] = np.concatenate((rays.positive[feasible], new))
    positive[: len(feasible), -1] = signs[feasible] > 0
    chosen = np.flatnonzero(_allowed(positive, partners, check))
    if len(chosen) > max_rays:
        return None
    return Rays([values[i] for i in chosen], positive[chosen])


def _edges(
    positive: Support, signs: Indices, d: int, check: Callable[[], None]
) -> Iterator[Indices]:
    """Yield the edges from rays with the sign 1 to rays with the sign -1, each as an
    array of shape (2, m).
    """
    above, below = np.flatnonzero(signs > 0), np.flatnonzero(signs < 0)
    sizes = positive.sum(axis=1)
    max_size = positive.shape[1] - (d - 2)
    for part in parts(above, len(below), check):
        common = positive[part] @ positive[below].T
        sizes_of_both = sizes[part, np.newaxis] + sizes[below] - common
        candidates = np.argwhere(sizes_of_both <= max_size)
        for some in parts(candidates, len(positive), check):
            i, j = some.T
            pairs = np.array([part[i], below[j]])
            # A ray with d - 1 zeros has an edge for each d - 2 of them.
            is_edge = (sizes_of_both[i, j] == max_size) & (
                sizes[pairs[0]] == max_size - 1
            )
            zero = 1 - np.maximum(*positive[pairs[:, ~is_edge]])
            is_edge[~is_edge] = (zero @ positive.T == 0).sum(axis=1) == 2
            yield pairs[:, is_edge]


def _allowed(positive: Support, partners: Support, check: Callable[[], None]) -> Mask:
    """Return which of some rays are zero wherever one of the partners is positive."""
    others = partners[:, : positive.shape[1]].T
    allowed = [
        (positive[some] @ others == 0).any(axis=1)
        for some in parts(np.arange(len(positive)), len(partners), check)
    ]
    return np.concatenate([np.zeros(0, dtype=bool), *allowed])


def parts(indices: Indices, width: int, check: Callable[[], None]) -> Iterator[Indices]:
    """Yield indices in parts, so that matrices with a row of this width for each index
    have at most MAX_ENTRIES entries, or one row."""
    step = max(MAX_ENTRIES // max(width, 1), 1)
    for start in range(0, len(indices), step):
        if start:
            check()
        yield indices[start : start + step]
