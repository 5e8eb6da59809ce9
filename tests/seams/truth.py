"""Whether a claim about a problem is right, decided in fractions by code that shares
nothing with the package."""

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from record import exact, exact_measure
from scipy import sparse
from scipy.sparse import csgraph, linalg

TOL = 2e-10  # twice that of the program, as units from least squares have few digits
# Of the largest component: what is removed from z before it is measured a third time.
NOISE = 1e-13
# Distance of a z from an exact solution with its states, relative to each component.
NEAR = 1e-6
MAX_ENUMERATED, MAX_STATES = 6, 729
MAX_EXACT = 20  # unknowns up to which the states of z are solved exactly
MAX_MEASURED = 500  # unknowns up to which the conditions are measured in fractions
NO_SOLUTION = ("infeasible", "unsolvable")


def passes(problem, z):
    """Return whether z as it is, put on the bounds, or freed from noise, passes."""
    given = np.asarray(z, dtype=float)
    lower, upper = bounds(problem)
    own = Units.of(problem)
    if not np.isfinite(given).all() or (given < lower).any() or (given > upper).any():
        return False
    R = 2.0**own.rows
    C = 2.0**own.columns
    reference = np.clip(np.zeros(problem.n), lower, upper)
    far = np.abs(given - reference) / C
    largest = np.zeros(2 * problem.n + 1)
    np.maximum.at(largest, own.column_part, far)
    clean = np.where(far <= NOISE * largest[own.column_part], reference, given)

    def on_bounds(z):
        w = R * (problem.M @ z + problem.q)
        z = np.where((z - lower) / C < w, lower, z)
        return np.where((upper - z) / C < -w, upper, z)

    points = given, on_bounds(given), on_bounds(clean)
    return any(
        exact_measure.relative_residual(problem, point, own, reference) <= TOL
        for point in points
    )


class Units(NamedTuple):
    """Logarithms of R and C, in which R_i |M_ij| C_j is near 1, and the connected part
    of each row and column."""

    rows: np.ndarray
    columns: np.ndarray
    row_part: list[int]
    column_part: list[int]

    @classmethod
    def of(cls, problem):
        """Return those of the least squares of log|M_ij| + log R_i + log C_j (Curtis
        and Reid)."""
        coo, n = sparse.coo_array(problem.M), problem.n
        kept = coo.data != 0
        i, j, values = coo.row[kept], coo.col[kept], coo.data[kept]
        m = values.size
        graph = sparse.coo_array((np.ones(m), (i, n + j)), shape=(2 * n, 2 * n))
        part = csgraph.connected_components(graph, directed=False)[1].tolist()
        x = np.zeros(2 * n)
        if m:
            places = np.r_[np.arange(m), np.arange(m)], np.r_[i, n + j]
            A = sparse.coo_array((np.ones(2 * m), places), shape=(m, 2 * n)).tocsr()
            x = linalg.lsqr(
                A, -np.log2(np.abs(values)), atol=1e-13, btol=1e-13, iter_lim=20 * n
            )[0]
        return cls(x[:n], x[n:], part[:n], part[n:])


def bounds(problem):
    lower, upper = (
        np.array(np.broadcast_to(bound, problem.n), dtype=float)
        for bound in (problem.lower, problem.upper)
    )
    return lower, upper


def without_noise(z):
    """Return z with 0 in place of components that may be rounding of 0 beside the
    largest one."""
    least = NOISE * max(map(abs, z), default=0.0)
    return [value if abs(value) > least else 0.0 for value in z]


def judged(problem, entry):
    """Return the outcome with what it is worth, and what is false of it, or ""."""
    worth = judge(problem, entry)
    return entry | {
        "worth": worth,
        "false": worth if worth.startswith("false") else "",
    }


def judge(problem, entry):
    """Return what a recorded outcome is worth: "right", "refused", "undecided", or
    "false: ..." with the reason."""
    status = entry["status"]
    if status == "solved":
        z = entry["z"]
        if near_solution(problem, z):
            return "right"
        if problem.n > MAX_MEASURED:
            return "undecided"
        passed = passes(problem, z) or passes(problem, without_noise(z))
        return "right" if passed else "false: z violates the conditions"
    if status not in NO_SOLUTION:
        return "refused"
    known = any(
        exact.solves(problem, [Fraction(v) for v in z.tolist()])
        for z in problem.solutions
    )
    if known or (has_few_states(problem) and exact.solution(problem) is not None):
        return "false: there is a solution"
    if "y" in entry and "rounding" not in entry["proof"]:
        y = [Fraction(value) for value in entry["y"]]
        holds = exact.refutes(problem, y) or exact.refutes(problem, y, as_written=True)
        return "right" if holds else "false: y is no proof in exact arithmetic"
    return "right" if has_few_states(problem) else "undecided"


def has_few_states(problem):
    """Return whether the states of all unknowns can be enumerated."""
    number = 1
    for low, high in zip(*bounds(problem), strict=True):
        number *= (
            1 if low == high else 1 + int(np.isfinite(low)) + int(np.isfinite(high))
        )
    return number <= MAX_STATES and problem.n <= MAX_ENUMERATED


def near_solution(problem, z):
    """Return whether z is near an exact solution with its states, in each component."""
    if problem.n > MAX_EXACT or not np.isfinite(z).all():
        return False
    M, q = exact.rational(problem)
    lower, upper = (bound.tolist() for bound in bounds(problem))
    found = exact.of_states(M, q, lower, upper, exact.states_of(problem, z))
    return found is not None and all(
        abs(Fraction(a) - b) <= Fraction(NEAR) * abs(b)
        for a, b in zip(z, found, strict=True)
    )
