"""Derivatives of the solutions of a batch: those that are clear of kinks all at once, the others one by one.

The inverses of all M_BB are kept as matrices of shape (n, n), with zeros outside. A solution is clear of kinks, and its
M_BB regular, by the same bound as in `linearization`; what is not, `derivative` decides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from lcpcli.errors import DerivativeError, ParameterError
from lcpcli.linalg.principal_many import each_product, principal_inverses
from lcpcli.model.right_hand_sides import Stack, as_stack
from lcpcli.parametric.derivative import moved_bounds
from lcpcli.parametric.linearization import are_clear, room
from lcpcli.solving.derivatives import BatchDerivative, BatchGradient, Derivative, Gradient
from lcpcli.solving.result import Result
from lcpcli.typing import Mask, Vector
from lcpcli.verify.digits import signs

UNSOLVED = ("raise", "nan")


Found = TypeVar("Found", BatchGradient, BatchDerivative)


class Linearizations:
    """The solutions of a stack and their states, as in `linearization.Linearization`, for those that are clear.

    z, basic, upper, inverse : shapes (b, n), (b, n), (b, n) and (b, n, n). clear : shape (b,).
    """

    @np.errstate(all="ignore")
    def __init__(self, stack: Stack, z: Vector, solved: Mask) -> None:
        self._M, box = stack.M, stack.box
        self.basic = (z > box.lower) & (z < box.upper)
        w = stack.w(z)
        self.inverse = principal_inverses(stack.M, self.basic)
        change = each_product(self.inverse, w)
        moves = np.abs(each_product(self.inverse, np.broadcast_to(signs(stack.n, 1)[:, 0], z.shape)))
        self.z = z - change
        rows = room(box, self.z, w, self.basic), self.z, self.basic, np.abs(change), moves, np.abs(stack.q)
        spare, z, basic, change, moves, q = (np.ascontiguousarray(values.T) for values in rows)  # for fast maxima
        clear = are_clear(spare, z, basic, change, moves, stack.largest, q.max(axis=0, initial=0.0))
        self.clear = clear & solved & stack.are_moderate
        self.upper = ~self.basic & np.where(box.fixed, w < 0, self.z == box.upper)

    def solve(self, b: Vector, transposed: bool = False) -> Vector:
        """Return M_BB^-1 b_B, or M_BB'^-1 b_B, and 0 elsewhere, with one step of refinement, for b of shape (b, n)."""
        inverse, M = (A.swapaxes(1, 2) if transposed else A for A in (self.inverse, self._M))
        x = each_product(inverse, b)
        return x + each_product(inverse, b - each_product(M, x))


@np.errstate(all="ignore")
def gradients(
    results: Sequence[Result], stack: Stack, at: Linearizations, g: Any, J: Any, unsolved: str
) -> BatchGradient:
    """Return what `derivative.gradient` returns for each result."""
    m, n = stack.q.shape
    rows = None if J is None else as_stack("J", J, (m, None, n))
    given = as_stack("g", g, (m, n if rows is None else rows.shape[1]))
    of_z = np.array(given if rows is None else each_product(rows.swapaxes(1, 2), given))
    found = BatchGradient(
        0.0 - at.solve(of_z, transposed=True),
        stack.M,
        at.z.copy(),
        of_z,
        at.basic.copy(),
        at.upper.copy(),
        {},
    )

    def one(i: int) -> Gradient:
        return results[i].gradient(given[i], J=None if rows is None else rows[i])

    clear = at.clear & np.isfinite(found.q).all(axis=1)
    return _completed(found, ("q", "_z", "_g", "_basic", "_upper"), clear, one, unsolved)


@np.errstate(all="ignore")
def derivatives(
    results: Sequence[Result],
    stack: Stack,
    at: Linearizations,
    changes: dict[str, Any],
    one_sided: bool,
    J: Any,
    unsolved: str,
) -> BatchDerivative:
    """Return what `derivative.derivative` returns for each result."""
    m, n = stack.q.shape
    rows = None if J is None else as_stack("J", J, (m, None, n))
    given: dict[str, Any] = {
        name: as_stack(name, change, (m, n, n) if name == "dM" else (m, n))
        for name, change in changes.items()
        if change is not None
    }
    change = np.array(given.get("dq", np.zeros((m, n))))
    if "dM" in given:
        change += each_product(given["dM"], at.z)
    dz = np.where(at.basic, 0.0, moved_bounds(stack.box, at.upper, given.get("dlower"), given.get("dupper")))
    dz -= at.solve(each_product(stack.M, dz) + change)
    dw = np.where(at.basic, 0.0, each_product(stack.M, dz) + change)
    dz = dz if rows is None else each_product(rows, dz)
    found = BatchDerivative(dz, dw, {}, [True] * m)

    def one(i: int) -> Derivative:
        own = {name: change[i] for name, change in given.items()}
        return results[i].derivative(**own, one_sided=one_sided, J=None if rows is None else rows[i])

    clear = at.clear & np.isfinite(dz).all(axis=1)
    return _completed(found, ("z", "w", "strongly_regular"), clear, one, unsolved)


def _completed(found: Found, names: tuple[str, ...], clear: Mask, one: Callable[[int], Any], unsolved: str) -> Found:
    """Put into the arrays of these names what `one` returns for the problems that are not clear, None or nan where it
    raises DerivativeError and `unsolved` is "nan"."""
    if unsolved not in UNSOLVED:
        raise ParameterError("unsolved", f"{unsolved!r} is unknown", 'give "raise" or "nan"')
    for i in (~clear).nonzero()[0].tolist():
        own = None
        try:
            own = one(i)
        except DerivativeError as error:
            if unsolved == "raise":
                raise error.inside(f"batch[{i}]") from None
        for name in names:
            getattr(found, name)[i] = getattr(own, name, None)
        if own is not None and own.kinks:
            found.kinks[i] = own.kinks
    return found
