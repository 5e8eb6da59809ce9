"""Branch and bound over complementary sets, in which every pruned node has a proof.

A set P of indices stands for all z with w_i = 0 for i in P and z_i = 0 elsewhere; every solution belongs to one. A node
of the tree fixes, for some indices, which of the two holds. What remains is a system of linear inequalities, and the
node is pruned only by a Farkas proof that the system is infeasible, checked in exact arithmetic (`farkas.refutes`),
or, where all indices are decided, by an exact solution of M_PP z_P = -q_P that has a negative component.
"""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from lcpcli import clock
from lcpcli.linalg import matrices
from lcpcli.methods.iterate import Finished, OutOfTime, Stalled
from lcpcli.typing import Matrix, Vector
from lcpcli.verify import farkas
from lcpcli.verify.alternative import alternative

UNDECIDED, ACTIVE, INACTIVE = 0, 1, 2  # an index: undecided; in P, w_i = 0; not in P, z_i = 0
MAX_NODES = 1 << 14  # enough for any problem of up to 12 unknowns

Decisions = NDArray[np.int8]
Mask = NDArray[np.bool_]


def candidates(
    M: Matrix, q: Vector, deadline: float = math.inf, nodes: int = MAX_NODES
) -> Generator[Mask, None, Finished | Stalled | OutOfTime]:
    """The sets P, as masks of shape (n,), that appear to have a solution. A set may be yielded more than once.

    M, q : the problem, exactly equilibrated; the proofs refer to these numbers.
    deadline : by `clock.seconds`.
    nodes : how many nodes may be examined, each at the cost of one or two LPs.

    Returns Finished if the problem is proved to have no solution, except on the sets that were yielded: the caller
    tries each and stops at a success. Otherwise the proof is incomplete: the limit on nodes or time is reached, or a
    set that gave the caller no solution has not been excluded.
    """
    pending, examined, unresolved = [np.full(q.size, UNDECIDED, np.int8)], 0, False
    while pending:
        decided = pending.pop()
        seconds = deadline - clock.seconds()
        if seconds <= 0:
            return OutOfTime("the time limit is reached")
        if examined == nodes:
            return Stalled(f"{nodes} systems have been examined")
        examined += 1
        found = alternative(*_system(M, q, decided), seconds)
        if found.proof is not None:
            continue
        undecided = decided == UNDECIDED
        if not undecided.any():
            if not _excluded(M, q, decided == ACTIVE):
                yield decided == ACTIVE
                unresolved = True
            continue
        z, w = _point(M, q, decided, found.point)
        overlap = np.where(undecided, np.minimum(z, w), -np.inf)
        branch = int(np.argmax(overlap))
        if found.point is not None and overlap[branch] <= farkas.ACTIVE * max(float(z.max()), 1.0):
            yield (decided == ACTIVE) | (undecided & (z > w))
        order = (ACTIVE, INACTIVE) if z[branch] < w[branch] else (INACTIVE, ACTIVE)  # likelier last: popped first
        for decision in order:
            child = decided.copy()
            child[branch] = decision
            pending.append(child)
    return Stalled("one complementary set is too close to having a solution") if unresolved else Finished()


def _system(M: Matrix, q: Vector, decided: Decisions) -> tuple[Matrix, Vector]:
    """The inequalities of a node: M z + q >= 0, for the columns with z_j not 0, and its negative where w_i = 0."""
    rows, columns = np.flatnonzero(decided == ACTIVE), np.flatnonzero(decided != INACTIVE)
    kept = M[:, columns]
    return matrices.stack([[kept], [-kept[rows]]]), np.append(q, -q[rows])


def _point(M: Matrix, q: Vector, decided: Decisions, point: Vector | None) -> tuple[Vector, Vector]:
    """z and w at the point found by the LP, if any; else at 0."""
    z = np.zeros(q.size)
    if point is not None:
        z[decided != INACTIVE] = point
    return z, M @ z + q


def _excluded(M: Matrix, q: Vector, P: Mask) -> bool:
    """Whether M_PP z_P = -q_P has no solution, or only one, which violates z_P >= 0 or M_NP z_P + q_N >= 0."""
    if np.count_nonzero(P) > farkas.LARGEST_EXACT:
        return False
    from lcpcli.verify.exact_solution import exact_basis

    found = exact_basis(M, q, P)
    return found is None or (found.unique and not found.solves)
