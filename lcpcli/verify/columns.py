"""Which of many points are solutions, by bounds that are computed for all of them together.

The criterion is that of `point.Point`, with the measures of `accuracy.Accuracy`: the relative residual is at most the
tolerance whatever the rounding errors in w are. Rounding errors are allowed for LAXITY times, so that what passes here
passes there too, where products are summed in another order. What does not pass is open.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import FAR, ROW_ROUNDING
from lcpcli.model.box import Box
from lcpcli.model.columns import Block
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.accuracy import SCALE_FLOOR, Distances
from lcpcli.verify.point import SLACK

LAXITY = 3  # bounds on rounding errors: that of w here, that of w there, and the one that is added there


class Scales(NamedTuple):
    """The scales of the rows of m problems.

    greatest : the largest |min(z, w)|_i at the reference point, shape (m,); if it is 0 or less, that is a solution.
    R, C : of `equilibrate`, shape (n,). s : the scaled residual of the reference point, shape (m, 1). usable : where
        neither numbers out of range nor units that depend on q make them worthless, shape (m,).
    """

    greatest: Vector
    R: Vector
    C: Vector
    s: Vector
    usable: Mask

    def part(self, rows: Indices) -> Scales:
        """Those of some of the problems."""
        return self._replace(greatest=self.greatest[rows], s=self.s[rows], usable=self.usable[rows])


@np.errstate(over="ignore", invalid="ignore")
def scales(block: Block) -> Scales:
    """Those of a block."""
    there, units = block.references, block.columns.units
    R, C = units or np.ones((2, block.columns.n))
    sizes = np.abs(there.q)
    if isinstance(block.box, Box):
        assert there.z is not None
        gaps = block.box.gaps(there.z, there.q)
        reach = np.where(there.q > 0, there.z - block.box.lower, block.box.upper - there.z)
        s = np.minimum(R * sizes, reach / C).max(axis=1, where=gaps != 0, initial=0.0)
        greatest = np.abs(gaps).max(axis=1)
    else:
        s = (R * sizes).max(axis=1, where=there.q < 0, initial=0.0)
        greatest = -there.q.min(axis=1)
    in_range = units is not None and max(R.max(), C.max()) < FAR and min(R.min(), C.min()) > 1 / FAR
    usable: Mask = (sizes.max(axis=1) < FAR) & (s > 1 / FAR) & (s < FAR) & in_range
    return Scales(greatest, R, C, s[:, np.newaxis], usable)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def bounds(block: Block, known: Scales, z: Vector, w: Vector) -> Vector:
    """What the relative residuals of admissible z are at most, whatever the rounding errors in w = M z + q are.

    z, w : shape (m, n). The bounds, of shape (m,), are infinite where the scales are not usable.
    """
    there, terms = block.references, block.sizes(block.references.moved(z))
    terms *= known.R
    sizes = np.abs(there.q)
    sizes *= known.R
    lost = terms + sizes
    lost *= LAXITY * ROW_ROUNDING
    lost += LAXITY * known.R * there.error
    low, high = block.box.distances(z)
    distances, outer = Distances(low / known.C, None if high is None else high / known.C), known.R * w
    excess = distances.largest_gaps(outer - lost, outer + lost)
    row_scales = np.minimum(np.maximum(np.maximum(sizes, terms), SCALE_FLOOR * known.s), known.s)
    return np.where(known.usable, (excess / row_scales).max(axis=1), np.inf)


def surely_solve(bounds: Vector, tol: float) -> Mask:
    """Where the relative residual is certain to be at most tol."""
    sure: Mask = bounds <= tol * (1 - SLACK)
    return sure
