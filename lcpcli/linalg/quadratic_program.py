"""Convex quadratic programs, solved by PIQP, where it is installed: R. Schwan, Y. Jiang, D. Kuhn and C. N. Jones, PIQP:
a proximal interior-point quadratic programming solver, 62nd IEEE Conference on Decision and Control (2023) 1088-1093.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.shifted_systems import has_qdldl
from lcpcli.typing import Vector

MODULE = "piqp"


class Ended(NamedTuple):
    """How PIQP ended: x, the multipliers of the equations and of the other rows, which are the derivatives of the
    minimum with respect to their bounds, and its status, `PIQP_SOLVED` if the tolerance is reached."""

    x: Vector
    of_equations: Vector
    of_rows: Vector
    status: str


@cache
def is_installed() -> bool:
    """Return whether PIQP is installed, and QDLDL, which tells how much work it has, without loading them."""
    with imports:
        return find_spec(MODULE) is not None and has_qdldl()


def minimized(
    Q: Any,
    c: Vector,
    equations: tuple[Any, Vector],
    rows: tuple[Any, Vector, Vector],
    bounds: tuple[Vector, Vector],
    tol: float,
    most_steps: int = 250,
    most_gap: float | None = None,
) -> Ended:
    """Minimize x'Qx / 2 + c'x with A x = b, low <= G x <= high and lower <= x <= upper.

    Q, equations, rows, bounds : Q; A, b; G, low, high; lower, upper. The matrices are all dense, or all csc_matrices.
    tol : for PIQP's residuals and the duality gap: relative, and absolute in units of the largest |c_i| and |b_i|.
    most_steps : by default PIQP's own limit; it has no limit of time, and cannot be interrupted.
    most_gap : the tolerance of the duality gap, by default `tol`.
    """
    with imports:
        piqp = import_module(MODULE)
    (A, b), (G, low, high), (lower, upper) = equations, rows, bounds
    solver = piqp.DenseSolver() if isinstance(Q, np.ndarray) else piqp.SparseSolver()
    settings = solver.settings
    ends = [v[np.isfinite(v)] for v in (c, b, low, high)]
    largest, gap = max(float(np.abs(v).max(initial=0.0)) for v in ends) or 1.0, tol if most_gap is None else most_gap
    settings.eps_rel, settings.eps_abs = tol, tol * largest
    settings.eps_duality_gap_rel, settings.eps_duality_gap_abs = gap, gap * largest
    settings.max_iter = most_steps
    constraints: dict[str, Any] = {"x_l": lower} | ({"x_u": upper} if np.isfinite(upper).any() else {})
    constraints |= {"A": A, "b": b} if b.size else {}
    constraints |= {"G": G, "h_l": low, "h_u": high} if low.size else {}
    solver.setup(Q, c, **constraints)
    status, result = solver.solve(), solver.result
    return Ended(np.array(result.x), -np.array(result.y), np.array(result.z_l) - np.array(result.z_u), str(status.name))
