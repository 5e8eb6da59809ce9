"""Presolve: a mixed problem is reduced by the free variables that single equations
determine, and its equations are rewritten so that the matrix shows its structure.

The rules are those of A. L. Brearley, G. Mitra, H. P. Williams, Analysis of
mathematical programming problems prior to applying the simplex algorithm, Mathematical
Programming 8 (1975) 54-83, that were measured to matter, and the signs of equations of
`rules.signs_of_equations`, without which markov, an MCP in 329 unknowns, takes 7 times
as long. Without other rules of Brearley, Mitra and Williams, on fixed variables, on
rows of one sign or that are bounds, on equations of one or two variables and on
repeated ones, no verdict was lost.
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
from lcpcli.presolve.system import LARGEST_INTEGER, PresolveStep, ReducedProblem
from lcpcli.typing import Indices, Vector

Rule = Callable[[ReducedProblem], Iterator[PresolveStep]]

DEFINITIONS = "definitions of free variables"
# The rules by what they remove; they are applied cyclically until none removes
# anything.
RULES: dict[str, Rule] = {
    DEFINITIONS: rules.definitions_of_free_variables,
    "single entries of free variables": rules.single_entries_of_free_variables,
}
SIGNS = "signs of equations"  # comes last, and removes nothing
ALL = (*RULES, SIGNS)
# Fraction of the variables that has to be removed: the methods for large problems gain
# little if fewer are.
WORTHWHILE = 0.4
# Each round costs some passes over the entries of M, and the methods solve the
# remaining equations as well.
MAX_ROUNDS = 20


@dataclass(eq=False, repr=False)
class Presolved(Change):
    """The reduced problem of the `kept_columns`; if there are none, a problem of one
    unknown whose solution is 0.

    rows, factors : their rows, and the factors by which these were multiplied. steps :
        the steps that removed the other rows and columns.
    removed : the number of unknowns that each rule has removed. is_exact : whether
        nothing was rounded or replaced by 0: the rules applied do not do so, or small
        integers have remained integers.
    """

    kept_columns: Indices
    rows: Indices
    factors: Vector
    steps: tuple[PresolveStep, ...]
    removed: dict[str, int]
    is_exact: bool = False

    @property
    def is_worthwhile(self) -> bool:
        """Return whether presolve removes many unknowns, or multiplies rows by factors,
        which may make the matrix monotone.
        """
        return self.kept_columns.size <= (1 - WORTHWHILE) * self.original.n or bool(
            (self.factors != 1).any()
        )

    @property
    def has_new_rows(self) -> bool:
        """Return whether rows are multiplied by factors, or equations are assigned to
        other variables.
        """
        return bool((self.factors != 1).any() or (self.rows != self.kept_columns).any())

    def start(self, x: Vector) -> Vector:
        """Return a starting point of the reduced problem from one of the original."""
        return x[self.kept_columns] if self.kept_columns.size else np.zeros(1)

    def back(self, x: Vector) -> Vector:
        """Return x of the original problem from x of the reduced one (postsolve).

        The z of removed columns follow from the steps. In rows that still belong to
        their columns, w is that of the reduced problem divided by the factor.
        """
        z, inner = np.zeros(self.original.n), self.problem.box
        z[self.kept_columns] = inner.z_of(x)[: self.kept_columns.size]
        for step in reversed(self.steps):
            step.postsolve_primal(z)
        z = self.original.box.project(z)
        original_x = self.original.box.x_of(z, self.original.w(z))
        is_paired = self.rows == self.kept_columns
        w = ((inner.reflected(x) - x)[: self.kept_columns.size] / self.factors)[
            is_paired
        ]
        original_x[self.kept_columns[is_paired]] = (
            z[self.kept_columns[is_paired]] - w
        ) / 2
        return original_x

    def residual(self, F: Vector) -> Vector:
        """Return F of the original problem, 0 for the removed rows."""
        original_F = np.zeros(self.original.n)
        original_F[self.rows] = F[: self.rows.size] / self.factors
        return original_F

    def multipliers(self, y: Vector) -> Vector:
        """Return a Farkas vector of the original problem from one of the reduced."""
        original_y = np.zeros(self.original.n)
        original_y[self.rows] = y[: self.rows.size]
        return _carried(self.original, original_y, self.steps)


@np.errstate(all="ignore")  # Problem raises an error if numbers have overflowed
def presolved(problem_before: Problem, only: Collection[str] = ALL) -> Presolved | None:
    """Return the problem after presolve by these rules, or None if they change
    nothing.
    """
    system = ReducedProblem(problem_before)
    steps = list[PresolveStep]()
    removed = dict[str, int]()
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
    kept_columns = system.columns
    rows = system.row_of[kept_columns]
    if not steps and np.array_equal(rows, np.arange(problem_before.n)):
        return None
    try:
        problem = (
            _problem(problem_before, system)
            if kept_columns.size
            else Problem([[1.0]], [0.0])
        )
    except ProblemError:  # numbers have overflowed
        return None
    is_lossless = system.is_lossless and float(system.terms.max()) <= LARGEST_INTEGER
    is_lossless &= (
        all(step.keeps_integers for step in steps)
        and problem_before.has_small_integers
        and problem.has_small_integers
    )
    is_lossless |= DEFINITIONS in only and len(only) == 1
    return Presolved(
        problem,
        problem_before,
        kept_columns,
        rows,
        system.factors[rows],
        tuple(steps),
        removed,
        is_lossless,
    )


def substituted(problem: Problem) -> Change:
    """Return the problem without the free variables that equations define; the problem
    itself if there are none.
    """
    presolved_problem = (
        presolved(problem, only=(DEFINITIONS,))
        if problem.is_mixed and problem.box.free.any()
        else None
    )
    return Change(problem, problem) if presolved_problem is None else presolved_problem


def _problem(problem_before: Problem, system: ReducedProblem) -> Problem:
    """Return the reduced problem, sparse or dense as the original one is."""
    kept_columns, position = system.columns, np.zeros(system.n, dtype=np.intp)
    position[kept_columns] = np.arange(kept_columns.size)
    rows = position[system.column_of[system.entries.rows]]
    columns = position[system.entries.columns]
    shape = (kept_columns.size, kept_columns.size)
    if is_sparse(problem_before.M):
        with imports:
            from scipy.sparse import coo_array
        M = coo_array((system.entries.values, (rows, columns)), shape=shape).tocsr()
    else:
        M = np.zeros(shape)
        M[rows, columns] = system.entries.values
    return Problem(
        M,
        system.q[system.row_of[kept_columns]],
        lower=system.lower[kept_columns],
        upper=system.upper[kept_columns],
    )


def _carried(problem: Problem, y: Vector, steps: Sequence[PresolveStep]) -> Vector:
    """Return a Farkas vector y of the problem from that of the rows after the steps,
    with components of infeasible sign, which are rounding errors, replaced by 0.
    """
    for step in reversed(steps):
        step.postsolve_dual(y)
    low, high = (np.isfinite(bound) for bound in problem.box.vectors(problem.n))
    return np.clip(y, np.where(low, 0.0, -np.inf), np.where(high, 0.0, np.inf))
