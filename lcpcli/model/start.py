"""Where a run on a problem starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from lcpcli.errors import ParameterError
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector


def starting_point(problem: Problem, x0: ArrayLike | None, z0: ArrayLike | None) -> Vector:
    """x0, or the x of z0 and w = M z0 + q, or the problem's own starting point, or the origin."""
    if z0 is not None:
        if x0 is not None:
            raise ParameterError("z0", "gives the starting point, and so does x0", "leave one out")
        z = as_vector("z0", z0, problem.n)
        return as_vector("M z0 + q", problem.box.x_of(z, problem.w(z)))
    if x0 is not None:
        return as_vector("x0", x0, problem.n)
    return np.zeros(problem.n) if problem.x0 is None else problem.x0
