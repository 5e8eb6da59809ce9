"""`interior` as a whole, between the arrays of a problem and its solution, compiled by numba."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.kernels import interior_point_kernels as point
from lcpcli.kernels.interior_finish_kernels import (
    CLOSE,
    NOISE,
    Best,
    Work,
    finish,
    keep,
    largest_ratio,
    without_noise,
    work_of,
)
from lcpcli.kernels.interior_point_kernels import Steps
from lcpcli.kernels.interior_scaling_kernels import mirrored, scaled, signs_of, without_fixed
from lcpcli.kernels.interior_step_kernels import advance
from lcpcli.kernels.interior_system_kernels import FINITE, LEAST_RHO, MOST_RHO, RHO, systems_of
from lcpcli.kernels.ldl_kernels import borrowing
from lcpcli.methods.interior import (
    CLOSE_MERIT,
    IMPATIENT_STEPS,
    MERIT_DROP,
    MOST_INTERIOR_STEPS,
    NEAR_MERIT,
    PATIENT_STEPS,
    PROOF_EVERY,
    RECENT_STEPS,
    SLOW_LENGTH,
    VANISHED_MU,
    WARM_UP_STEPS,
)

INDICATED_MERIT, CERTAIN_MERIT = 1e-3, 1e-10  # Tapia's active set is tried below, and no longer needed
LEAST_MERIT = 1e-13  # below which the active set is tried at each step
SLACKS = (1.0, 1e4, 1e2, 1.0)  # at the start of each attempt
RHOS = ((1e-9, 1e-13, 1e-8), (1e-11, 1e-14, 1e-7), (1e-8, 1e-13, 1e-7), (1e-8, 1e-8, 1e-8))  # at first, least, most
WELL_SOLVED = 1e-8  # the measure at which no further attempt is made


@borrowing
def _is_due(own: Steps, count: int, merit: float, tried: float, changes_before: int) -> int:
    """Return whether an active set is to be tried now: 2 for the one by sizes, 1 for the one by Tapia's indicators, 0
    for none."""
    if merit < CLOSE_MERIT and (merit < MERIT_DROP * tried or merit < LEAST_MERIT):
        return 1 if count > 0 and merit > CERTAIN_MERIT else 2
    settled = own.changes[0] == 0 and changes_before > 0
    return 1 if count > 0 and merit < INDICATED_MERIT and settled else 0


@borrowing
def _is_slow(lengths: Any, count: int) -> bool:
    """Return whether the last steps were short on average."""
    total = 0.0
    for k in range(count - RECENT_STEPS if count >= WARM_UP_STEPS else count, count):
        total += lengths[k]
    return count >= WARM_UP_STEPS and total < SLOW_LENGTH * RECENT_STEPS


@borrowing
def _diverges(own: Steps) -> Any:
    """Return whether the point tends to infinity along a proof that there is no solution."""
    return point.is_nearly_proof(own.systems.problem, own.at.z, own.right, own.found.z, own.other.z)


@borrowing
def _attempt(
    own: Steps, slack: float, gives_up: bool, stop: Any, best: Best, last: Best, work: Work, lengths: Any
) -> int:
    """Follow the central path from a start and keep the best solution in `best`; return the number of steps.

    last : where the point with the least merit is kept. lengths : of steps, written.
    """
    states, least_states, n = work.states, work.least_states, last.z.size
    point.start(own, slack)
    last.measure[0] = tried = np.inf
    idle, changes_before, count = 0, n, 0
    own.changes[0] = n
    while count < MOST_INTERIOR_STEPS and stop[0] == 0:
        merit, mu, residual = point.measure(own)
        if not merit < FINITE:
            break
        idle = 0 if merit < 0.9 * last.measure[0] else idle + 1
        point.by_size(own, states)
        if merit < last.measure[0]:
            for i in range(n):
                least_states[i] = states[i]
        keep(last, own.at.z, merit)
        due = _is_due(own, count, merit, tried, changes_before)
        changes_before = own.changes[0]
        if due > 0:
            tried = min(merit, tried)
            finish(own.systems, own.tapia if due == 1 else states, own.at.z, best, work)
            if best.measure[0] <= CLOSE:
                return count
        if count % PROOF_EVERY == PROOF_EVERY - 1 and merit > CLOSE_MERIT and _diverges(own):
            return count
        if gives_up and _is_slow(lengths, count):
            return count
        if mu < VANISHED_MU or idle > (PATIENT_STEPS if last.measure[0] > NEAR_MERIT else IMPATIENT_STEPS):
            break
        lengths[count] = advance(own, mu, residual)
        count += 1
        if lengths[count - 1] == 0.0:
            break
    if last.measure[0] < np.inf:
        finish(own.systems, least_states, last.z, best, work)
        problem = own.systems.problem
        for i in range(n):
            last.z[i] = min(max(last.z[i], problem.lower[i]), problem.upper[i])
        keep(best, last.z, largest_ratio(problem, last.z, own.dual, NOISE))
    return count


def entry(version: int) -> Any:
    """Return the kernel, to be compiled: from M in compressed rows with ascending columns, q, the bounds, the most
    operations that a factorization may take, and `stop`, of shape (1,), where another thread may end it by a 1.

    It returns a z of shape (n,) within the bounds that may be a solution; a z that tends to infinity along a proof that
    there is none, or else an empty one; the numbers of steps and of factorizations; and the operations of one of these,
    infinitely many if no signs S make S M symmetric. No step is made if these are too many.

    numba's cache knows of changes in this file and of the values in the closure of the kernel: the version, which is to
    be computed from all files that it is made of, is one of them.
    """

    def interior(
        begin: Any, columns: Any, values: Any, q: Any, lower: Any, upper: Any, most: float, stop: Any
    ) -> tuple[Any, Any, int, int, float]:
        version  # noqa: B018
        z, ray = np.zeros(q.size), np.zeros(0)
        variables, own_begin, own_columns, own_values, own_q = without_fixed(begin, columns, values, q, lower, upper, z)
        M, n = (own_begin, own_columns, own_values), own_q.size
        mirror, is_symmetric = mirrored(n, *M)
        signs, has_signs = signs_of(n, *M, mirror) if is_symmetric else (mirror, False)
        if not has_signs:
            return z, ray, 0, 0, np.inf
        problem, factors, diagonal, operations = scaled(variables, M, mirror, own_q, lower, upper, signs, most)
        if operations > most:
            return z, ray, 0, 0, operations
        own = systems_of(problem, diagonal, factors)
        best, last = Best(problem.z_ref.copy(), np.full(1, np.inf)), Best(np.empty(n), np.empty(1))
        steps, work, lengths, count = point.steps_of(own), work_of(n), np.empty(MOST_INTERIOR_STEPS), 0
        for k in range(len(SLACKS)):
            own.state[:] = 0.0
            own.state[RHO], own.state[LEAST_RHO], own.state[MOST_RHO] = RHOS[k]
            count += _attempt(steps, SLACKS[k], k == 0, stop, best, last, work, lengths)
            if best.measure[0] <= WELL_SOLVED or stop[0] != 0:
                break
            if _diverges(steps):
                ray = np.zeros(q.size)
                ray[problem.variables] = steps.at.z * problem.units
                break
        without_noise(problem, best.z, own.other, own.trial)
        z[problem.variables] = best.z * problem.units
        z[:] = np.minimum(np.maximum(z, lower), upper)
        return z, ray, max(count, 1), own.counts[0], operations

    return interior
