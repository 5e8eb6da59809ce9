"""Branch and bound over complementary sets, in which a proof in exact arithmetic excludes each branch that is cut.

A set P of indices stands for all z with w_i = 0 for i in P and z_i = 0 elsewhere; every solution belongs to such a set.
A node of the tree fixes, for some indices, which of the two holds. What remains is a system of linear inequalities, for
which the dual simplex method goes on from the parent's point, and the node is pruned only by a Farkas proof that the
system is infeasible, checked in exact arithmetic (`farkas.refutes`), or, where all indices are decided, by an exact
solution of M_PP z_P = -q_P that has a negative component.

Points are sought in the equilibrated standard form of a problem. Proofs are judged by the problem as given, with its
own bounds, so that no rounding of that form can spoil them.
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
from lcpcli.model.changes import StandardForm, scale
from lcpcli.typing import Mask, Vector
from lcpcli.verify import farkas
from lcpcli.verify.alternative import alternative

OPEN, ACTIVE, INACTIVE = 0, 1, 2  # an index: undecided; in P, w_i = 0; not in P, z_i = 0
MAX_NODES = 1 << 17  # in seconds, with a warm start each; 2^14 are enough for any problem of up to 12 unknowns
DOUBTFUL = 8  # nodes for which a node counts whose point is sought by linear programs: these take ten times as long

_Node = tuple[Vector, DualSimplex | None, int | None]
"""Decisions, the system of those before the last, and the form that the last one restricts to 0."""


class ComplementarySystem:
    """The LCP in whose numbers complementary sets are sought, with the way back to the problem as given.

    form, units : the standard form of the given problem, and that equilibrated. M, q : of the latter.
    is_choice : the indices that are decided one way or the other; those of the parts of free variables are not.
    """

    def __init__(self, form: StandardForm) -> None:
        self.form, self.units = form, scale(form.problem, moderate=0)
        self.M, self.q = self.units.problem.M, self.units.problem.q
        self.is_choice = ~form.are_parts_of_free

    def multipliers(self, y: Vector) -> Vector:
        """Return the Farkas vector for the given problem that y is in these numbers."""
        return self.form.multipliers(self.units.multipliers(y))

    def refutes(self, decided: Vector, y: Vector) -> bool:
        """Return whether y, but for wrong signs, proves that no solution of the given problem fits the decisions."""
        given, boxes = self.form.original, self.form.restricted(decided == ACTIVE, decided == INACTIVE)
        if boxes is None:
            return True
        (columns, rows), own = boxes, self.multipliers(y)
        own[(np.isfinite(rows.lower) & (own < 0)) | (np.isfinite(rows.upper) & (own > 0))] = 0.0
        used = np.flatnonzero((columns.lower != 0) | (columns.upper != 0))
        return farkas.refutes(given.M[:, used], given.q, own, columns.part(used), rows)

    def excluded(self, P: Mask) -> bool:
        """Return whether the given problem has no basic solution of this set, or only one that violates it."""
        given, boxes = self.form.original, self.form.restricted(P, ~P)
        if boxes is None:
            return True
        basic, at_lower = boxes[0].lower < boxes[0].upper, boxes[0].lower == given.box.lower
        if np.count_nonzero(basic) > farkas.LARGEST_EXACT:
            return False
        with imports:
            from lcpcli.verify.exact_solution import exact_basis
        found = exact_basis(given.M, given.q, of_masks(basic, ~(basic | at_lower)), given.box)
        return found is None or (found.unique and not found.solves)


def candidates(
    system: ComplementarySystem, nodes: int = MAX_NODES, root: DualSimplex | None = None
) -> Generator[Mask, None, Finished | Stalled | OutOfTime]:
    """Yield the sets P, as masks of shape (n,), that appear to have a solution; a set may be yielded more than once.

    nodes : the largest number of nodes to examine; one that takes linear programs beside its system counts as DOUBTFUL.
    root : the system of M z + q, if it has been made before.

    Returns Finished if it is proved that only the sets that were yielded can have a solution: the caller tries each and
    stops at a success. Otherwise a limit is reached, or a set where the caller found no solution has no proof.
    """
    M, q, n, examined, cost, unresolved = system.M, system.q, system.q.size, 0, 0, False
    whole = None if is_sparse(M) or n > MOST_DENSE else root or DualSimplex(M, q)
    pending: list[_Node] = [(np.full(n, OPEN, np.int8), whole, None)]
    while pending:
        decided, before, form = pending.pop()
        if remaining() <= 0:
            return OutOfTime(TIME_LIMIT_REACHED)
        if cost >= nodes:
            return Stalled(f"{examined} systems have been examined")
        simplex = None if before is None else before.copy()
        found, own_cost = _point(system, decided, simplex, form)
        examined, cost = examined + 1, cost + own_cost
        if found is None:
            continue
        undecided = (decided == OPEN) & system.is_choice
        if not undecided.any():
            if not system.excluded(P := (decided == ACTIVE) | ~system.is_choice):
                yield P
                unresolved = True
            continue
        z, w = found
        overlap = np.where(undecided, np.minimum(z, w), -np.inf)
        branch = int(np.argmax(overlap))
        if overlap[branch] <= farkas.ACTIVE_COLUMN * max(float(z.max()), 1.0):
            yield (decided == ACTIVE) | ((decided == OPEN) & (z > w))
        order = (ACTIVE, INACTIVE) if z[branch] < w[branch] else (INACTIVE, ACTIVE)  # likelier last: popped first
        for decision in order:
            child = decided.copy()
            child[branch] = decision
            pending.append((child, simplex, branch + n * (decision == ACTIVE)))
    return Stalled("one complementary set is too close to having a solution") if unresolved else Finished()


def _point(
    system: ComplementarySystem, decided: Vector, simplex: DualSimplex | None, form: int | None
) -> tuple[tuple[Vector, Vector] | None, int]:
    """Return z and w of a point that fits the decisions, or None if a proof excludes that there is one; and for how
    many nodes this counts.

    simplex : of the decisions but the last, which restricts a form to 0; None for sparse or large M.
    """
    M, q = system.M, system.q
    rows, columns = np.flatnonzero(decided == ACTIVE), np.flatnonzero(decided != INACTIVE)
    y = None
    if simplex is not None:
        check()
        y = simplex.feasible() if form is None else simplex.vanish(form)
        if y is None and (point := simplex.point()) is not None:
            return point, 1
    if y is not None and system.refutes(decided, y):
        return None, 1

    def holds(y: Vector) -> bool:
        own = y[: q.size].copy()
        own[rows] -= y[q.size :]
        return system.refutes(decided, own)

    # M z + q >= 0, for the columns with z_j not 0, and its negative where w_i = 0
    kept = M[:, columns]
    found = alternative(stack([[kept], [-kept[rows]]]), np.append(q, -q[rows]), holds=holds)
    cost = 1 if simplex is None else DOUBTFUL
    if found.proof is not None:
        return None, cost
    z = np.zeros(q.size)
    if found.point is not None:
        z[columns] = found.point
    return (z, M @ z + q), cost
