"""Elastic-plastic torsion of a bar: R. Glowinski, Numerical Methods for Nonlinear Variational Problems, Springer
(1984), chapter II, with bounds instead of a constraint on the gradient: H. Brezis, M. Sibony, Équivalence de deux
inéquations variationnelles et applications, Arch. Rational Mech. Anal. 41 (1971) 254-265.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.obstacle import grid, laplacian
from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "Glowinski 1984, chapter II; Brezis and Sibony 1971; five-point differences"


def torsion(n: int, _seed: int, *, angle: float = 4.0) -> Problem:
    """The stress function z of a square bar, |z| <= its distance to the boundary; -Laplace z = 2 angle where it is
    less, times h^2.

    angle : twist per unit length, |angle| <= 1e6; the bar is plastic where z is at a bound.
    """
    require("angle", angle, abs(angle) <= 1e6, "|angle| <= 1e6")
    m, h, X, Y = grid(n)
    distance = np.minimum(np.minimum(X, 1 - X), np.minimum(Y, 1 - Y)).ravel()
    return Problem(
        laplacian(m),
        np.full(m * m, -2 * angle * h * h),
        name=f"torsion-{m * m}",
        source=SOURCE,
        note=f"Twist per unit length {angle:g}.",
        lower=-distance,
        upper=distance,
    )
