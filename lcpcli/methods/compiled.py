"""The compiled form of `methods.direct`, by the extra `fast`: to import it takes half a second, or seconds if numba has
to compile its kernels, once on a machine."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from numba import njit
from numba.core import event
from numba.extending import overload, register_jitable

from lcpcli.linalg.units import Units
from lcpcli.methods import tableau
from lcpcli.methods.direct import CERTAIN, Answer
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

NUMBERS_AT_ONCE = 1 << 18  # in the systems that are solved before Ctrl-C can take effect
ANNOUNCEMENT = "lcpcli: compiling the kernels of the extra fast; later processes load them from a cache"
MOST_WITH_UNITS = 100  # unknowns up to which the units of M take microseconds, so that it matters little who needs them
OPTIONS = {"nogil": True, "error_model": "numpy"}


@overload(tableau.exchange, jit_options=OPTIONS)
def _exchange(T: Any, row: Any, column: Any) -> Any:  # noqa: ARG001
    """Return the body of `tableau.exchange` that is compiled: one pass over the tableau in place of three."""

    def exchange(T: Any, row: Any, column: Any) -> Any:
        pivot, own = T[row, column], T[row]
        own /= -pivot
        own[column] = 0.0
        for i in range(T.shape[0]):
            factor = T[i, column]
            if i != row and factor != 0.0:
                for j in range(own.size):
                    T[i, j] += factor * own[j]
                T[i, column] = factor / pivot
        own[column] = 1.0 / pivot

    return exchange


class _Announcement(event.Listener):
    """The message that kernels are compiled, when the first of them is."""

    is_due = True

    def on_start(self, event: event.Event) -> None:  # noqa: ARG002
        if self.is_due:
            logging.getLogger("lcpcli").warning(ANNOUNCEMENT)
        self.is_due = False

    def on_end(self, event: event.Event) -> None:
        pass


with event.install_listener("numba:compile", _Announcement()):
    from lcpcli.methods.kernels import solve_one, solve_rows, units_of

    for function in (tableau.lexicographic_minimum, tableau.choose, tableau.move):
        register_jitable(**OPTIONS)(function)
    follow = njit(cache=True, **OPTIONS)(tableau.follow)
    follow(tableau.tableau_of(np.eye(1), np.ones(1), np.ones(1)), np.ones(1), 0, 1.0, 0, False, 0)  # compiles it


def direct(problem: Problem, tol: float, basic: Mask | None = None) -> Answer | None:
    """Return the answer of the kernels, as `direct.direct` returns that of numpy."""
    start = problem.q < 0 if basic is None else basic
    found, steps, z = solve_one(np.ascontiguousarray(problem.M), problem.q, start, problem.largest, tol)
    return Answer(z, found == CERTAIN, steps) if found else None


def with_units(problem: Problem) -> Problem:
    """Return a problem with dense M and moderate numbers, for which `Problem.units` is known if n is small."""
    if problem.n <= MOST_WITH_UNITS:
        vars(problem).setdefault("units", Units(*units_of(np.ascontiguousarray(problem.M))))
    return problem


def direct_many(M: Vector, Q: Vector, largest: Vector, tol: float) -> tuple[Vector, Indices]:
    """Return for LCPs what `direct_rows.direct_many` returns; M and `largest` may have one row for all problems."""
    M, Z, found = np.ascontiguousarray(M), np.empty(Q.shape), np.empty((len(Q), 2), dtype=np.int64)
    size = max(NUMBERS_AT_ONCE // Q.shape[1] ** 2, 1)
    for rows in (slice(first, first + size) for first in range(0, len(Q), size)):
        own = rows if len(M) == len(Q) else slice(1)
        solve_rows(M[own], Q[rows], largest[own], tol, Z[rows], found[rows])
    return Z, found
