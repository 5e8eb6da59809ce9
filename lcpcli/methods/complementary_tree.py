"""Branch and bound over complementary sets, in which a proof in exact arithmetic excludes each branch that is cut.

A set P of indices stands for all z with w_i = 0 for i in P and z_i = 0 elsewhere; every solution belongs to such a set.
A node of the tree fixes, for some indices, which of the two holds. What remains is a system of linear inequalities, for
which the dual simplex method goes on from the parent's point, and the node is pruned only by a Farkas proof that the
system is infeasible, checked in exact arithmetic (`farkas.refutes`), or, where all indices are decided, by an exact
solution of M_PP z_P = -q_P that has a negative component.
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import check, remaining
from lcpcli.linalg.dual_simplex import MOST_DENSE, DualSimplex
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.methods.stages import TIME_LIMIT_REACHED, Finished, OutOfTime, Stalled
from lcpcli.model.box import of_masks
from lcpcli.typing import Mask, Matrix, Vector
from lcpcli.verify import farkas
from lcpcli.verify.alternative import alternative

OPEN, ACTIVE, INACTIVE = 0, 1, 2  # an index: undecided; in P, w_i = 0; not in P, z_i = 0
MAX_NODES = 1 << 17  # in seconds, with a warm start each; 2^14 are enough for any problem of up to 12 unknowns
DOUBTFUL = 8  # nodes for which a node counts whose point is sought by linear programs: these take ten times as long

_Node = tuple[Vector, DualSimplex | None, int | None]
"""Decisions, the system of those before the last, and the form that the last one restricts to 0."""


def candidates(
    M: Matrix, q: Vector, nodes: int = MAX_NODES, root: DualSimplex | None = None
) -> Generator[Mask, None, Finished | Stalled | OutOfTime]:
    """Yield the sets P, as masks of shape (n,), that appear to have a solution; a set may be yielded more than once.

    M, q : the problem, exactly equilibrated; the proofs refer to these numbers.
    nodes : the largest number of nodes to examine; one that takes linear programs beside its system counts as DOUBTFUL.
    root : the system of M z + q, if it has been made before.

    Returns Finished if it is proved that only the sets that were yielded can have a solution: the caller tries each and
    stops at a success. Otherwise a limit is reached, or a set where the caller found no solution has no proof.
    """
    n, examined, cost, unresolved = q.size, 0, 0, False
    whole = None if is_sparse(M) or n > MOST_DENSE else root or DualSimplex(M, q)
    pending: list[_Node] = [(np.full(n, OPEN, np.int8), whole, None)]
    while pending:
        decided, before, form = pending.pop()
        if remaining() <= 0:
            return OutOfTime(TIME_LIMIT_REACHED)
        if cost >= nodes:
            return Stalled(f"{examined} systems have been examined")
        system = None if before is None else before.copy()
        found, own_cost = _point(M, q, decided, system, form)
        examined, cost = examined + 1, cost + own_cost
        if found is None:
            continue
        undecided = decided == OPEN
        if not undecided.any():
            if not _excluded(M, q, decided == ACTIVE):
                yield decided == ACTIVE
                unresolved = True
            continue
        z, w = found
        overlap = np.where(undecided, np.minimum(z, w), -np.inf)
        branch = int(np.argmax(overlap))
        if overlap[branch] <= farkas.ACTIVE_COLUMN * max(float(z.max()), 1.0):
            yield (decided == ACTIVE) | (undecided & (z > w))
        order = (ACTIVE, INACTIVE) if z[branch] < w[branch] else (INACTIVE, ACTIVE)  # likelier last: popped first
        for decision in order:
            child = decided.copy()
            child[branch] = decision
            pending.append((child, system, branch + n * (decision == ACTIVE)))
    return Stalled("one complementary set is too close to having a solution") if unresolved else Finished()


def _point(
    M: Matrix, q: Vector, decided: Vector, system: DualSimplex | None, form: int | None
) -> tuple[tuple[Vector, Vector] | None, int]:
    """Return z and w of a point that fits the decisions, or None if a proof excludes that there is one; and for how
    many nodes this counts.

    system : of the decisions but the last, which restricts a form to 0; None for sparse or large M.
    """
    rows, columns = np.flatnonzero(decided == ACTIVE), np.flatnonzero(decided != INACTIVE)
    y = None
    if system is not None:
        check()
        y = system.feasible() if form is None else system.vanish(form)
        if y is None and (point := system.point()) is not None:
            return point, 1
    # M z + q >= 0, for the columns with z_j not 0, and its negative where w_i = 0
    kept = M[:, columns]
    A, b = stack([[kept], [-kept[rows]]]), np.append(q, -q[rows])
    if y is not None and farkas.refutes(A, b, np.concatenate((np.maximum(y, 0.0), np.maximum(-y[rows], 0.0)))):
        return None, 1
    found = alternative(A, b)
    cost = 1 if system is None else DOUBTFUL
    if found.proof is not None:
        return None, cost
    z = np.zeros(q.size)
    if found.point is not None:
        z[columns] = found.point
    return (z, M @ z + q), cost


def _excluded(M: Matrix, q: Vector, P: Mask) -> bool:
    """Return whether M_PP z_P = -q_P has no solution, or only one, which violates z_P >= 0 or M_NP z_P + q_N >= 0."""
    if np.count_nonzero(P) > farkas.LARGEST_EXACT:
        return False
    with imports:
        from lcpcli.verify.exact_solution import exact_basis
    found = exact_basis(M, q, of_masks(P))
    return found is None or (found.unique and not found.solves)
