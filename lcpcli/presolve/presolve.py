"""Presolve: a mixed problem without the free variables that single equations determine,
and with its equations written so that the matrix shows its structure.

The rules are those of A. L. Brearley, G. Mitra, H. P. Williams, Analysis of
mathematical programming problems prior to applying the simplex algorithm, Mathematical
Programming 8 (1975) 54-83, that were measured to matter: without them, a program whose
equations are written with other signs takes up to 7 times as long (markov, an MCP in
329 unknowns). Without others, on fixed variables, on rows of one sign or that are
bounds, on equations of one or two variables and on repeated ones, no verdict was lost.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem
from lcpcli.presolve import rules
from lcpcli.presolve.rules import signs_of_equations
from lcpcli.presolve.system import LARGEST_INTEGER, Step, System
from lcpcli.typing import Indices, Vector

Rule = Callable[[System], Iterator[Step]]

DEFINITIONS = "definitions of free variables"
# What each one takes away, and how; applied in turn, until none finds anything.
RULES: dict[str, Rule] = {
    DEFINITIONS: rules.definitions_of_free_variables,
    "single entries of free variables": rules.single_entries_of_free_variables,
}
SIGNS = "signs of equations"  # comes last, and takes nothing away
ALL = (*RULES, SIGNS)
# Of the variables: the methods for large problems gain little if fewer are removed.
WORTHWHILE = 0.4
# Each costs some passes over the entries of M; what they leave, the methods solve as
# well.
MAX_ROUNDS = 20


@dataclass(eq=False, repr=False)
class Presolved(Change):
    """The problem of the columns that are `kept`; if none is, a problem of one unknown
    whose solution is 0.

    rows, factors : their rows, and by what each was multiplied. steps : how the others
        were removed.
    removed : the number of unknowns that each rule has removed. is_exact : whether
    surely nothing was rounded or lost: no rule does that, or small integers have
    remained integers.
    """

    kept: Indices
    rows: Indices
    factors: Vector
    steps: tuple[Step, ...]
    removed: dict[str, int]
    is_exact: bool = False

    @property
    def is_worthwhile(self) -> bool:
        """Return whether much is removed, or what is left is monotone for all that is
        seen, and was not."""
        return self.kept.size <= (1 - WORTHWHILE) * self.original.n or bool(
            (self.factors != 1).any()
        )

    @property
    def has_new_rows(self) -> bool:
        """Return whether rows are multiplied by factors, or equations assigned to other
        variables."""
        return bool((self.factors != 1).any() or (self.rows != self.kept).any())

    def start(self, x: Vector) -> Vector:
        return x[self.kept] if self.kept.size else np.zeros(1)

    def back(self, x: Vector) -> Vector:
        z, inner = np.zeros(self.original.n), self.problem.box
        z[self.kept] = inner.z_of(x)[: self.kept.size]
        for step in reversed(self.steps):
            step.fill(z)
        z = self.original.box.project(z)
        whole = self.original.box.x_of(z, self.original.w(z))
        own = self.rows == self.kept
        w = ((inner.reflected(x) - x)[: self.kept.size] / self.factors)[own]
        whole[self.kept[own]] = (z[self.kept[own]] - w) / 2
        return whole

    def residual(self, F: Vector) -> Vector:
        """Return F of the original problem, 0 for the rows that are left out."""
        whole = np.zeros(self.original.n)
        whole[self.rows] = F[: self.rows.size] / self.factors
        return whole

    def multipliers(self, y: Vector) -> Vector:
        whole = np.zeros(self.original.n)
        whole[self.rows] = y[: self.rows.size]
        return _carried(self.original, whole, self.steps)


@np.errstate(all="ignore")  # a Problem is refused if numbers have overflowed
def presolved(given: Problem, only: Collection[str] = ALL) -> Presolved | None:
    """Return the problem after presolve by these rules; None if they change
    nothing."""
    system, steps, removed = System(given), list[Step](), dict[str, int]()
    for _ in range(MAX_ROUNDS):
        at_first = system.columns.size
        for name in (name for name in RULES if name in only):
            raise_if_timed_out()
            before = system.columns.size
            steps += RULES[name](system)
            if system.columns.size < before:
                removed[name] = removed.get(name, 0) + before - system.columns.size
        if not 0 < system.columns.size < at_first:
            break
    if SIGNS in only:
        raise_if_timed_out()
        steps += signs_of_equations(system)
    kept = system.columns
    rows = system.row_of[kept]
    if not steps and np.array_equal(rows, np.arange(given.n)):
        return None
    try:
        problem = _problem(given, system) if kept.size else Problem([[1.0]], [0.0])
    except ProblemError:  # numbers have overflowed
        return None
    keeps_all = system.keeps_all and float(system.terms.max()) <= LARGEST_INTEGER
    keeps_all &= (
        all(step.keeps_integers for step in steps)
        and given.has_small_integers
        and problem.has_small_integers
    )
    keeps_all |= DEFINITIONS in only and len(only) == 1
    return Presolved(
        problem,
        given,
        kept,
        rows,
        system.factors[rows],
        tuple(steps),
        removed,
        keeps_all,
    )


def substituted(problem: Problem) -> Change:
    """Return the problem without the free variables that equations define; where it has
    none, nothing changes."""
    found = (
        presolved(problem, only=(DEFINITIONS,))
        if problem.is_mixed and problem.box.free.any()
        else None
    )
    return Change(problem, problem) if found is None else found


def _problem(given: Problem, system: System) -> Problem:
    """Return the problem of what is left, sparse or dense as the given one is."""
    kept, place = system.columns, np.zeros(system.n, dtype=np.intp)
    place[kept] = np.arange(kept.size)
    rows, columns = (
        place[system.column_of[system.entries.rows]],
        place[system.entries.columns],
    )
    shape = (kept.size, kept.size)
    if is_sparse(given.M):
        with imports:
            from scipy.sparse import coo_array
        M = coo_array((system.entries.values, (rows, columns)), shape=shape).tocsr()
    else:
        M = np.zeros(shape)
        M[rows, columns] = system.entries.values
    return Problem(
        M,
        system.q[system.row_of[kept]],
        lower=system.lower[kept],
        upper=system.upper[kept],
    )


def _carried(problem: Problem, y: Vector, steps: Sequence[Step]) -> Vector:
    """Return Farkas' y of the problem from that of the rows after some steps, without
    signs that are rounding."""
    for step in reversed(steps):
        step.carry(y)
    low, high = (np.isfinite(bound) for bound in problem.box.vectors(problem.n))
    return np.clip(y, np.where(low, 0.0, -np.inf), np.where(high, 0.0, np.inf))
