"""Rigid bodies in contact with Coulomb friction, one time step: D. E. Stewart, J. C. Trinkle, An implicit time-stepping
scheme for rigid body dynamics with inelastic collisions and Coulomb friction, Int. J. Numer. Methods Eng. 39 (1996)
2673-2691. With compliance as in A. M. Al-Fahed, G. E. Stavroulakis, P. D. Panagiotopoulos, Hard and soft fingered robot
grippers: the linear complementarity approach, Z. angew. Math. Mech. 71 (1991) 257-265.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from lcpcli.errors import count
from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

CLASS = "copositive"
SOURCE = "Stewart and Trinkle 1996, random contacts in the plane"
UNITS = 16  # coordinates are multiples of 1/16, so that M and q are free of rounding


def contact(n: int, seed: int, *, friction: float = 0.5, compliance: float = 0.0) -> Problem:
    """The impulses in k = n / 4 contacts, rounded, between (k + 1) // 2 bodies in the plane and the ground.

    z = (normal impulses, tangential impulses in both directions, sliding speeds), of lengths k, 2k and k. With the
    rows N and T = (t, -t) of the contacts, unit masses, the velocity v before, and E that sums both directions,
    M = [NN' NT' 0; TN' TT' E'; friction I, -E, 0] and q = (Nv, Tv, 0).

    friction : Coulomb's coefficient, 0 <= friction <= 10.
    compliance : added to the diagonal of NN' and TT'; 0 for rigid bodies; at most 10.
    """
    require("friction", friction, 0 <= friction <= 10, "0 <= friction <= 10")
    require("compliance", compliance, 0 <= compliance <= 10, "0 <= compliance <= 10")
    k = max(1, round(n / 4))
    random = np.random.default_rng([seed, k])
    normal, tangential = _rows(random, k)
    rows = np.concatenate((normal, tangential, -tangential))
    velocity = np.rint(UNITS * random.standard_normal(rows.shape[1])) / UNITS
    E = np.hstack((np.eye(k), np.eye(k)))
    M = np.zeros((4 * k, 4 * k))
    M[: 3 * k, : 3 * k] = rows @ rows.T + compliance * np.eye(3 * k)
    M[k : 3 * k, 3 * k :] = E.T
    M[3 * k :, : 3 * k] = np.hstack((friction * np.eye(k), -E))
    q = np.concatenate((rows @ velocity, np.zeros(k)))
    law = f"{count(k, 'contact')}, friction {friction:g}, compliance {compliance:g}"
    note = f"{law}. In theory Lemke's method finds a solution."
    return Problem(M, q, name=f"contact-{4 * k}", source=SOURCE, note=note)


def _rows(random: Generator, k: int) -> tuple[Vector, Vector]:
    """Normal and tangential rows of k contacts, each between random bodies or a random body and the ground."""
    bodies = (k + 1) // 2
    normal, tangential = np.zeros((2, k, 3 * bodies))
    for i in range(k):
        pair = random.permutation(bodies + 1)[:2]
        angle, arms = random.uniform(0, 2 * np.pi), random.uniform(-1, 1, (2, 2))
        for body, sign, (x, y) in zip(pair, (1, -1), arms, strict=True):
            if body < bodies:
                place, c, s = slice(3 * body, 3 * body + 3), sign * np.cos(angle), sign * np.sin(angle)
                normal[i, place] = c, s, x * s - y * c
                tangential[i, place] = -s, c, x * c + y * s
    return np.rint(UNITS * normal) / UNITS, np.rint(UNITS * tangential) / UNITS
