"""Solutions of the linearizations of nonlinear problems: linear problems of which a good step is asked, not a proof."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.errors import LCPError
from lcpcli.linalg.doubles import EPS, size
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.methods import tableau
from lcpcli.methods.direct import MOST_PIVOTED, MOST_UNKNOWNS, as_dense
from lcpcli.methods.free_block import WithoutFree
from lcpcli.methods.lemke import path_to_end, reduced
from lcpcli.methods.newton import from_states
from lcpcli.methods.path_end import solution_at
from lcpcli.methods.stages import FAULTS, Finished, Iterate, Stalled, advance, ended
from lcpcli.methods.tableau import SOLVED
from lcpcli.model.box import Box, in_words
from lcpcli.model.problem import Problem
from lcpcli.options import DEFAULTS, Limits
from lcpcli.solving import driver
from lcpcli.solving.direct_run import mixed_answer
from lcpcli.typing import Matrix, States, Vector

if TYPE_CHECKING:
    from types import ModuleType

LINEAR = Limits(max_iterations=100)  # for a linearization: one that takes more may have no solution
NEARLY = 1e-8  # of the natural residual of 0: that of a solution for which no more is done
CLOSE = 1e-2  # of the natural residual of 0: from which on a step to z pays, although z is no solution
FEW_ROUNDINGS = 8  # of the terms of a row, which its w may be off by
SHORT_PATH = 50  # unknowns up to which a path from no states takes no longer than a few systems


def solution_of_linearization(
    M: Matrix,
    q: Vector,
    box: Box,
    basis: States | None,
    longer: bool,
    fast: ModuleType | None = None,
) -> tuple[Vector, States] | None:
    """Return a solution of the linear problem, or a point that all but solves it, and its states; None if none was
    found.

    basis : the states that are tried first. longer : whether a problem with few unknowns, which else is only pivoted,
    without the last digits and the proofs that `run` is for, is left to `run`. fast : the kernels, if they are wanted.
    """
    if longer and q.size > MOST_UNKNOWNS:
        return None
    try:
        problem = Problem(M, q, lower=box.lower, upper=box.upper)
        if problem.n <= MOST_PIVOTED and not longer:
            return _pivoted(as_dense(problem), basis, fast)
        if problem.n > MOST_PIVOTED and is_sparse(problem.M) and not longer:
            with suppress(SingularMatrix):
                found = _without_free(WithoutFree(problem), basis, fast)
                return found if found is not None and _is_close(problem, found[0], CLOSE) else None
        first = None if basis is None else in_words(basis)
        ends = None if longer else lambda row: _is_close(problem, row.z, NEARLY)
        result = driver.run(problem, "auto", basis=first, limits=LINEAR, callback=ends)
    except LCPError:  # numbers overflow
        return None
    if result.interrupted:
        raise KeyboardInterrupt
    if not (result.solved or _is_close(problem, result.z, CLOSE)):
        return None
    return result.z, problem.box.basis_at(result.z) if result.end is None else result.end


def _is_close(problem: Problem, z: Vector, share: float) -> bool:
    """Return whether the natural residual of z is at most this share of that of 0, or rounding."""
    gaps, most = np.abs(problem.box.gaps(z, problem.w(z))), share * size(problem.box.gaps(np.zeros(z.size), problem.q))
    if (gaps <= most).all():
        return True
    terms = np.abs(problem.q) + product(abs(problem.M), np.abs(z))
    return bool((gaps <= most + FEW_ROUNDINGS * EPS * terms).all())


def _without_free(own: WithoutFree, basis: States | None, fast: ModuleType | None) -> tuple[Vector, States] | None:
    found = _pivoted(own.reduced, None if basis is None else basis[own.bounded], fast)
    return None if found is None else own.given(*found)


def _pivoted(problem: Problem, basis: States | None, fast: ModuleType | None) -> tuple[Vector, States] | None:
    """Return a solution of a problem with few unknowns, by exchanges from the states of another one, or of the
    reference point, or along Lemke's path, up to the rounding there; None if neither ends at one."""
    if basis is None and problem.n > SHORT_PATH:
        basis = problem.box.basis_at(problem.reference_point, problem.q_ref)
    with suppress(*FAULTS), np.errstate(over="raise", invalid="raise", divide="raise"):
        stage, last = ended(Stalled()) if basis is None else from_states(problem, basis), None
        while isinstance(step := advance(stage), Iterate):
            last = step
        if last is not None and isinstance(step, Finished):
            z = problem.box.z_of(last.x)
            if _is_close(problem, z, CLOSE):
                return z, problem.box.basis_at(z)
    if fast is not None and problem.is_mixed and (answer := mixed_answer(problem, DEFAULTS.tol)) is not None:
        return answer.z, problem.box.basis_at(answer.z) if answer.end is None else answer.end
    with suppress(*FAULTS), np.errstate(over="raise", invalid="raise", divide="raise"):
        path = path_to_end(problem, tableau.follow if fast is None else fast.follow, reduced(problem))
        z, _, states = path.point()
        z = problem.box.project(z)
        if path.end == SOLVED and not _is_close(problem, z, NEARLY):
            z = solution_at(problem, path)
        if _is_close(problem, z, CLOSE):
            return z, states
    return None
