"""Paths for tests, put together by hand: solutions at known breakpoints, and states as given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lcpcli import Problem
from lcpcli.parametric.family import Family
from lcpcli.parametric.path import BASIC, ENDS, LOWER, Path

SMALL = Problem([[2, 1], [1, 2]], [1, 1], name="small"), Problem([[2, 1], [1, 2]], [-5, -6], name="small")


def made(family: Family, t: Sequence[float], z: Any, states: Any, end: str = "reached", **others: Any) -> Path:
    """A path with these breakpoints, and w as it follows from z."""
    z = np.array(z, dtype=float).reshape(len(t), family.problem.n)
    w = np.array([family.at(each).w(own) for each, own in zip(t, z, strict=True)]).reshape(z.shape)
    own = {"message": ENDS[end], "verified": True, "seconds": 1e-3, **others}
    shape = max(len(t) - 1, 0), family.problem.n
    return Path(family, np.array(t, dtype=float), z, w, np.array(states).reshape(shape), end, **own)


def small(**others: Any) -> Path:
    """q goes from (1, 1) to (-5, -6): z2 enters at 1/7, and z1 at 1/5."""
    family = Family(*SMALL)
    z = [[0, 0], [0, 0], [0, 0.2], [4 / 3, 7 / 3]]
    states = [[LOWER, LOWER], [LOWER, BASIC], [BASIC, BASIC]]
    return made(family, [0, 1 / 7, 1 / 5, 1], z, states, **others)


def turning(end: str = "turn") -> Path:
    """z1 of M = [-1] with 0 <= z <= 3: t comes back from 1 at z = 0, as z enters, and a jump is added at its end."""
    first, last = (Problem([[-1.0]], [q], name="turning", upper=3.0) for q in (2.0, -1.0))
    family = Family(first, last, 0.0, 1.5)
    return made(family, [0, 1, 1, 0], [[3], [3], [0], [0]], [[1], [BASIC], [LOWER]], end)
