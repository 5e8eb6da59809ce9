"""Branch and bound over complementary sets, in which a proof in exact arithmetic
excludes each branch that is cut.

A set P of indices represents all z with w_i = 0 for i in P and z_i = 0 elsewhere; every
solution belongs to such a set. A node of the tree fixes, for some indices, which of the
two holds. What remains is a system of linear inequalities, on which the dual simplex
method continues from the parent's point, and the node is pruned only by a Farkas proof
that the system is infeasible, checked in exact arithmetic (`farkas.refutes`), or, where
all indices are decided, by an exact solution of M_PP z_P = -q_P that has a negative
component.

Points are sought in the equilibrated standard form of a problem. Proofs are verified
with the original problem and its bounds, so that no rounding of that form can spoil
them.

The LCP as a mixed-integer linear program, for any M: P. M. Pardalos and J. B. Rosen,
Global optimization approach to the linear complementarity problem, SIAM Journal on
Scientific and Statistical Computing 9 (1988) 341-353, section 3: maximize alpha subject
to 0 <= M y + alpha q <= e - b, 0 <= y <= b, 0 <= alpha <= 1, b binary. Its feasible
points with alpha > 0 are the solutions z = y / alpha scaled to max(z, w) <= 1 / alpha;
the maximum is 0 exactly if there is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from copy import deepcopy
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from lcpcli.basis.dual_simplex import MAX_DENSE, DualSimplex
from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.interrupts import (
    TimeIsUp,
    interruptibly,
    raise_if_timed_out,
    remaining,
    silent,
)
from lcpcli.linalg.doubles import ROW_ROUNDING, is_finite
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import dense, is_sparse, stack, unit_columns
from lcpcli.methods import stages
from lcpcli.methods.direct import MAX_AS_DENSE, as_dense
from lcpcli.methods.stages import (
    TIME_LIMIT_REACHED,
    Finished,
    Iterate,
    NoSolution,
    OutOfTime,
    Stage,
    Stalled,
    advance,
)
from lcpcli.model.box import BASIC, of_masks
from lcpcli.model.changes import StandardForm, scale
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.tree import explored
from lcpcli.typing import BasisStatus, Mask, Matrix, Vector
from lcpcli.verify import farkas
from lcpcli.verify.alternative import alternative
from lcpcli.verify.certificate import MANY, Proof, first_proof

# The decision on an index: none; it is in P, w_i = 0; it is not in P, z_i = 0.
OPEN = 0
ACTIVE = 1
INACTIVE = 2
# Nodes take seconds in all, as each has a warm start; 2^14 are enough for any problem
# of up to 12 unknowns.
MAX_NODES = 1 << 17
# Cost, in nodes, of a node whose point is sought by linear programs, which take ten
# times as long.
DOUBTFUL = 8


class _MilpNode:
    """A node of branch and bound.

    decided : what is decided of each pair z_i, w_i. simplex : the system of all
        decisions but the last; None for sparse or large M. variable : which of the z_j
        and w_i, numbered as in `DualSimplex`, the last decision fixes at 0.
    suggested : once the node is examined, a complementary set that its point suggests,
        or None.
    """

    suggested: Mask | None = None
    is_w_larger: Mask

    def __init__(
        self, decided: Vector, simplex: DualSimplex | None, variable: int | None = None
    ) -> None:
        self.decided = decided
        self.simplex = simplex
        self.variable = variable


class ComplementarySystem:
    """The equilibrated LCP in which complementary sets are sought, with the inverse
    transformation to the original problem.

    form, units : the standard form of the original problem, and its equilibration. M, q
        : those of the equilibrated problem.
    is_choice : the indices that are decided one way or the other; those of the parts of
        free variables are not. is_certain_for_all : whether all exclusions so far hold
        for all data that round to those of the problem.
    """

    def __init__(self, standard_form: StandardForm) -> None:
        self.form, self.units = standard_form, scale(standard_form.problem, moderate=0)
        self.M, self.q = self.units.problem.M, self.units.problem.q
        self.is_choice = ~standard_form.are_parts_of_free
        self.is_certain_for_all = True

    def multipliers(self, y: Vector) -> Vector:
        """Return the Farkas vector of the original problem for a y of the equilibrated
        one."""
        return self.form.multipliers(self.units.multipliers(y))

    def refutes(self, decided: Vector, y: Vector) -> bool:
        """Return whether y, with components of infeasible sign replaced by 0, proves
        that no solution of the original problem fits the decisions."""
        original_problem = self.form.original
        boxes = self.form.restricted(decided == ACTIVE, decided == INACTIVE)
        if boxes is None:
            return True
        columns, rows = boxes
        multipliers_of_rows = rows.as_multipliers(self.multipliers(y))
        used = np.flatnonzero((columns.lower != 0) | (columns.upper != 0))
        scope = farkas.scope(
            original_problem.M[:, used],
            original_problem.q,
            multipliers_of_rows,
            columns.part(used),
            rows,
        )
        if scope is farkas.Scope.DOUBLES:
            self.is_certain_for_all = False
        return scope is not farkas.Scope.NOTHING

    def excluded(self, P: Mask) -> bool:
        """Return whether the original problem has no basic solution of this set, or a
        unique one that violates it."""
        original_problem, boxes = self.form.original, self.form.restricted(P, ~P)
        if boxes is None:
            return True
        basic = boxes[0].lower < boxes[0].upper
        at_lower = boxes[0].lower == original_problem.box.lower
        if np.count_nonzero(basic) > farkas.LARGEST_EXACT:
            return False
        with imports:
            from lcpcli.verify.exact_solution import exact_basis
        basis = of_masks(basic, ~(basic | at_lower))
        proved_basis = exact_basis(
            ExactProblem.of_basis(original_problem, basis), basis
        )
        self.is_certain_for_all = False
        return proved_basis is None or (proved_basis.unique and not proved_basis.solves)


Sets: TypeAlias = Generator[tuple[str, Mask], None, Finished | Stalled | OutOfTime]
"""Complementary sets to be tested, each with the step that suggested it; Finished if no
other can have a solution."""


def candidates(
    system: ComplementarySystem, root: DualSimplex | None = None, nodes: int = MAX_NODES
) -> Sets:
    """Yield the sets P, as masks of shape (n,), that appear to have a solution; a set
    may be yielded more than once.

    root : the system of M z + q, if it has been made before. nodes : the largest number
    of nodes to examine; one that takes linear programs in addition to its system costs
    DOUBTFUL.

    Returns Finished if it is proved that only the sets that were yielded can have a
    solution: the caller tests each and stops at a success. Otherwise a limit is
    reached, or there is no proof for a set without a solution for the caller.
    """
    M = system.M
    q = system.q
    tree = _BranchAndBound(system)
    unresolved = False
    dual_simplex = (
        None if is_sparse(M) or q.size > MAX_DENSE else root or DualSimplex(M, q)
    )
    pending = [_MilpNode(np.full(q.size, OPEN, np.int8), dual_simplex)]
    for node, is_leaf in explored(tree, pending):
        if is_leaf and not system.excluded(
            P := (node.decided == ACTIVE) | ~system.is_choice
        ):
            yield "tree", P
            unresolved = True
        elif not is_leaf and node.suggested is not None:
            yield "tree", node.suggested
        if pending and remaining() <= 0:
            return OutOfTime(TIME_LIMIT_REACHED)
        if pending and tree.cost >= nodes:
            return Stalled(f"{tree.examined} systems have been examined")
    return (
        Stalled("one complementary set is too close to having a solution")
        if unresolved
        else Finished()
    )


class _BranchAndBound:
    """The nodes of the tree in double precision. examined : how many have been
    examined; cost : their cost, in nodes."""

    def __init__(self, system: ComplementarySystem) -> None:
        self.system = system
        self.examined = 0
        self.cost = 0
        self.check = raise_if_timed_out

    def violations(self, node: _MilpNode) -> dict[int, float] | None:
        """Return min(z, w) at a point of a node, where there is no decision yet; None
        if a proof excludes it."""
        if (node_point := self._point(node)) is None:
            return None
        (z, w), undecided = node_point, (node.decided == OPEN) & self.system.is_choice
        overlap, node.is_w_larger = np.minimum(z, w)[undecided], z < w
        if overlap.max(initial=-np.inf) <= farkas.ACTIVE_COLUMN * max(
            float(z.max()), 1.0
        ):
            node.suggested = (node.decided == ACTIVE) | (
                (node.decided == OPEN) & (z > w)
            )
        return dict(
            zip(np.flatnonzero(undecided).tolist(), overlap.tolist(), strict=True)
        )

    def _point(self, node: _MilpNode) -> tuple[Vector, Vector] | None:
        """Return z and w of a point that fits the decisions of a node; None if a proof
        excludes that there is one."""
        node.simplex = simplex = deepcopy(node.simplex)
        M = self.system.M
        q = self.system.q
        decided = node.decided
        y = None
        self.examined, self.cost = self.examined + 1, self.cost + 1
        if simplex is not None:
            raise_if_timed_out()
            y = (
                simplex.feasible()
                if node.variable is None
                else simplex.fix_at_zero(node.variable)
            )
            if y is None and (point := simplex.point()) is not None:
                return point
        if y is not None and self.system.refutes(decided, y):
            return None
        self.cost += 0 if simplex is None else DOUBTFUL - 1
        rows = np.flatnonzero(decided == ACTIVE)
        columns = np.flatnonzero(decided != INACTIVE)

        def holds(y: Vector) -> bool:
            multipliers_of_rows = y[: q.size].copy()
            multipliers_of_rows[rows] -= y[q.size :]
            return self.system.refutes(decided, multipliers_of_rows)

        # M z + q >= 0, for the columns with z_j not 0, and its negative where w_i = 0.
        columns_of_M = M[:, columns]
        farkas_alternative = alternative(
            stack([[columns_of_M], [-columns_of_M[rows]]]),
            np.append(q, -q[rows]),
            holds,
        )
        if farkas_alternative.proof is not None:
            return None
        z = np.zeros(q.size)
        if farkas_alternative.point is not None:
            z[columns] = farkas_alternative.point
        return z, M @ z + q

    def branching_index(self, node: _MilpNode) -> None:
        """All indices have been decided."""

    def children(self, node: _MilpNode, branch: int) -> Iterator[_MilpNode]:
        """Yield a node with each decision on an index, the likelier one last."""
        for decision in (
            (ACTIVE, INACTIVE) if node.is_w_larger[branch] else (INACTIVE, ACTIVE)
        ):
            decided = node.decided.copy()
            decided[branch] = decision
            yield _MilpNode(
                decided, node.simplex, branch + decided.size * (decision == ACTIVE)
            )


GAP = 1e3  # any alpha > 0 suffices: the solver may stop at 1 / GAP of the maximum
EXHAUSTED = "each complementary set is excluded by a proof in exact arithmetic"
UNDECIDED = "neither a solution nor a proof that there is none is known"
MAX_DENSE_ROWS = 1 << 24  # entries of the columns of a set that may be singular
# Work limit, in nominal seconds, of the proof before the nodes that auto examines.
FIRST_EFFORT = 1.0
# Entries of M in all nodes together: in those that auto examines before its search, for
# milliseconds, as proofs rarely take more than a few nodes; in all that it examines;
# and in those of milp before its program, for seconds or less.
FEW_ENTRIES = 1 << 12
FIRST_ENTRIES = 1 << 21
MAX_ENTRIES = 1 << 23


def milp(problem: Problem, x0: Vector) -> Stage:  # noqa: ARG001 (every method has it)
    """Solve one mixed-integer program, and a linear system on its active set. x0 has no
    influence.

    In order: a proof that the problem is infeasible; the first nodes of branch and
    bound (`candidates`); the program, for at most half of the remaining time, and the
    solution on each active set that it suggests; the rest of the tree. Exponential in n
    at worst. The program is that of R M C, R q with the powers of two of equilibration,
    which rounds nothing: alpha is about 1 / max(z, w), and the solver cannot resolve
    alpha below 1e-6.

    Yields (z - w) / 2 for the solution of each complementary set that appears to have
    one, with step "program" or "tree", the origin of the set. Solutions up to rounding
    come at once; those only to the LP solver's tolerance come last, unless it is proved
    that there is none. NoSolution : with a Farkas proof, or after the exhaustion of all
    complementary sets. Neither depends on rounding or tolerances: alpha = 0 is never
    accepted as a proof, as a tiny alpha may hide a large solution.
    """
    return (yield from _decided(problem, _all_sets))


def first_nodes(problem: Problem, entries: int = FIRST_ENTRIES) -> Stage:
    """Examine the first nodes of the tree alone, with `entries` entries of M in all;
    yield and return as `milp`."""
    return (
        yield from _decided(
            problem,
            partial(candidates, nodes=entries // problem.n**2 + 1),
            FIRST_EFFORT,
        )
    )


few_nodes = partial(first_nodes, entries=FEW_ENTRIES)


def _decided(
    problem: Problem,
    sets_of: Callable[[ComplementarySystem, DualSimplex | None], Sets],
    max_seconds: float = math.inf,
) -> Stage:
    problem = as_dense(problem) if problem.n <= MAX_AS_DENSE else problem
    standard_form = stages.standard_form_of(problem)
    if standard_form is None:
        return stages.Breakdown(stages.NO_STANDARD_FORM)
    stage = _tried(standard_form, sets_of, max_seconds)
    return (
        yield from stage
        if standard_form.is_identity
        else stages.moved_back(standard_form, stage, BasicSolutions(problem))
    )


def _tried(
    standard_form: StandardForm,
    sets_of: Callable[[ComplementarySystem, DualSimplex | None], Sets],
    max_seconds: float,
) -> Stage:
    """Seek a proof that the problem is infeasible, then test complementary sets; yield
    iterates of the standard form."""
    problem = standard_form.original
    with np.errstate(all="ignore"):
        system = ComplementarySystem(standard_form)
        units = system.units
        M = system.M
        q = system.q
        finite = bool(
            np.isfinite(M.sum()) and np.isfinite(units.w_outside(np.ones(q.size))).all()
        )
    if not finite:
        return Stalled("the problem overflows when it is equilibrated")
    farkas_alternative = alternative(
        M, q, partial(system.refutes, np.full(q.size, OPEN)), max_seconds
    )
    approximate_proofs = (
        farkas_alternative.approximate_proofs
        if farkas_alternative.proof is None
        else [farkas_alternative.proof]
    )
    proof = first_proof(
        problem, map(system.multipliers, approximate_proofs), rounded_from=MANY
    )
    if proof is not None:
        return NoSolution(proof)
    visited_bases: set[bytes] = set()
    rough: list[Iterate] = []
    sets = sets_of(system, farkas_alternative.system)
    while isinstance(ending := advance(sets), tuple):
        step, P = ending
        if P.tobytes() in visited_bases:
            continue
        visited_bases.add(P.tobytes())
        inner, to_rounding = _basic_solution(units.problem, P)
        if inner is None:
            continue
        with np.errstate(all="ignore"):
            w = np.where(P, 0.0, np.maximum(M @ inner + q, 0.0))
            x = (units.z_outside(inner) - units.w_outside(w)) / 2
        iterate = Iterate(x, None, step, len(visited_bases))
        if to_rounding and is_finite(x):
            yield iterate
        elif is_finite(x):
            rough.append(iterate)
    if not isinstance(ending, Finished):
        yield from rough
        return type(ending)(f"{UNDECIDED}: {ending.reason}")
    is_certain = system.is_certain_for_all
    proof = Proof("exhaustion", statement=EXHAUSTED, is_certain_for_all=is_certain)
    return NoSolution(proof)


def _all_sets(system: ComplementarySystem, root: DualSimplex | None) -> Sets:
    """Yield complementary sets that may have a solution, the likeliest first, each with
    the step that suggested it."""
    if remaining() <= 0:
        return OutOfTime(TIME_LIMIT_REACHED)
    try:
        ending = yield from candidates(
            system, root, MAX_ENTRIES // system.q.size**2 + 1
        )
        if not isinstance(ending, Stalled):
            return ending
        for P in _program(system.M, system.q):
            yield "program", P
        return (yield from candidates(system, root))
    # The time is up in the middle of a linear program: the sets so far remain valid.
    except TimeIsUp:
        return OutOfTime(TIME_LIMIT_REACHED)


def _program(M: Matrix, q: Vector) -> list[Mask]:
    """Return the active sets at the best (y, b, alpha) after half of the remaining
    time; none if alpha is 0."""
    with imports:
        from scipy.optimize import LinearConstraint, milp
    n = q.size
    seconds = max(remaining() / 2, 1e-3)
    one = unit_columns(n, np.arange(n), is_sparse(M))
    column = q[:, np.newaxis]
    A = stack([[M, one - one, column], [M, one, column], [one, -one, np.zeros((n, 1))]])
    low = np.concatenate((np.zeros(n), np.full(2 * n, -np.inf)))
    high = np.concatenate((np.full(n, np.inf), np.ones(n), np.zeros(n)))

    def solved() -> Any:
        with np.errstate(all="ignore"):
            return milp(
                np.append(np.zeros(2 * n), -1.0),
                integrality=np.concatenate((np.zeros(n), np.ones(n), np.zeros(1))),
                bounds=(0.0, 1.0),
                constraints=LinearConstraint(A, low, high),
                options={"mip_rel_gap": GAP}
                | ({"time_limit": seconds} if seconds < math.inf else {}),
            )

    with silent():
        milp_result = interruptibly(solved)
    if milp_result.x is None or not milp_result.x[-1] > 0:
        return []
    y, b = milp_result.x[:n], milp_result.x[n : 2 * n]
    return [y > M @ y + milp_result.x[-1] * q, b > 0.5]


def _basic_solution(problem: Problem, P: Mask) -> tuple[Vector | None, bool]:
    """Return z with z_N = 0, M_PP z_P = -q_P, z >= 0, w >= 0, or None if there is none
    to the tolerance of the LP solver, and whether z is a solution up to rounding, row
    by row."""
    M = problem.M
    q = problem.q
    best = None
    with np.errstate(all="ignore"):
        for basic_solution in _solutions(problem, of_masks(P, np.zeros_like(P))):
            z = np.maximum(basic_solution, 0.0)
            w = M @ z + q
            if min(basic_solution.min(), w.min()) < -farkas.ACTIVE_COLUMN * max(
                z.max(), 1.0
            ):
                continue
            best = z
            violation = np.where(P, np.abs(w), -w)
            rounding = ROW_ROUNDING * (abs(M) @ z + np.abs(q))
            if np.isfinite(z).all() and (violation <= rounding).all():
                return z, True
    return best, False


def _solutions(problem: Problem, basis: BasisStatus) -> Iterator[Vector]:
    """Yield the basic solution of a basis; then, as M_PP may be singular, a vertex of
    the solutions with this basis, corrected by least squares on its support, if dense
    columns fit in memory."""
    with suppress(SingularMatrix):
        yield BasicSolutions(problem).at(basis).z
    active = np.flatnonzero(basis == BASIC)
    if not 0 < active.size <= MAX_DENSE_ROWS / problem.n:
        return
    with imports:
        from lcpcli.verify.exact_solution import vertex
    x = vertex(problem, basis, math.inf)
    if x is None:
        return
    z, support = np.zeros(problem.n), np.flatnonzero(x > farkas.SNAP * x.max())
    A = dense(problem.M[active][:, support])
    for _ in range(2):
        z[support] -= np.linalg.lstsq(A, problem.w(z)[active], rcond=None)[0]
    yield z if z.min() >= 0 else x
