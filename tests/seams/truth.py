"""Whether a claim about a problem is right, decided in fractions by code that shares nothing with the package."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from record import exact
from scipy import sparse
from scipy.sparse import csgraph, linalg

TOL = 2e-10  # twice that of the program, as units from least squares have few digits
ROUNDING, DROWNED = 4 * 2.0**-52, 1e8
NOISE = 1e-13  # of the largest component: what is removed from z before it is measured a third time
NEAR = 1e-6  # distance of a z from an exact solution with its states, relative to each component
MOST_ENUMERATED, MOST_STATES = 6, 729
MOST_EXACT = 20  # unknowns up to which the states of z are solved exactly
NO_SOLUTION = ("infeasible", "unsolvable")
Numbers = list[Fraction]


class Measure:
    """The componentwise backward error with the cap of each row, of one problem.

    Row i has the violation v_i and the terms t_i = |q|_i + (|M| |z|)_i, or, if they are smaller, those from the
    reference point, the admissible z nearest to 0. It passes if v_i <= max(TOL min(t_i, c_i), ROUNDING min(t_i,
    DROWNED c_i)), with the cap c_i = k / R_i, where k is the largest violation at the reference point and distance
    from it of a z_j on a bound, in the units R and C of the problem's connected part.
    """

    def __init__(self, problem: Any) -> None:
        self.n = problem.n
        coo = sparse.coo_array(problem.M)
        kept = coo.data != 0
        i, j, values = coo.row[kept], coo.col[kept], coo.data[kept]
        self.entries = list(zip(i.tolist(), j.tolist(), map(Fraction, values.tolist()), strict=True))
        self.q = [Fraction(value) for value in problem.q.tolist()]
        self.lower, self.upper = bounds(problem)
        self.reference = np.clip(np.zeros(self.n), self.lower, self.upper)
        self.R, self.C, self.row_part, self.column_part = units(self.n, i, j, values)

    def passes(self, z: Sequence[float]) -> bool:
        """Return whether z as it is, put on the bounds, or freed from noise, passes."""
        given = np.asarray(z, dtype=float)
        if not np.isfinite(given).all() or (given < self.lower).any() or (given > self.upper).any():
            return False
        far = np.abs(given - self.reference) / self.C
        largest = np.zeros(2 * self.n + 1)
        np.maximum.at(largest, self.column_part, far)
        clean = np.where(far <= NOISE * largest[self.column_part], self.reference, given)
        return any(self._passes(point) for point in (given, self._on_bounds(given), self._on_bounds(clean)))

    def _on_bounds(self, z: np.ndarray) -> np.ndarray:
        w = self.R * np.array([float(value) for value in self._w(z)[0]])
        z = np.where((z - self.lower) / self.C < w, self.lower, z)
        return np.where((self.upper - z) / self.C < -w, self.upper, z)

    def _passes(self, z: np.ndarray) -> bool:
        w, terms = self._w(z)
        w_there, _ = self._w(self.reference)
        moved = [Fraction(a) - Fraction(b) for a, b in zip(z.tolist(), self.reference.tolist(), strict=True)]
        from_there = [abs(value) for value in w_there]
        for i, j, value in self.entries:
            from_there[i] += abs(value * moved[j])
        violations, caps = self._violations(z, w), self._caps(z, w_there, moved)
        for v, a, b, cap in zip(violations, terms, from_there, caps, strict=True):
            t = min(a, b)
            if v > max(Fraction(TOL) * min(t, cap), Fraction(ROUNDING) * min(t, Fraction(DROWNED) * cap)):
                return False
        return True

    def _w(self, z: np.ndarray) -> tuple[Numbers, Numbers]:
        """Return w and the sums of the absolute values of its terms."""
        w, terms, point = list(self.q), [abs(value) for value in self.q], [Fraction(value) for value in z.tolist()]
        for i, j, value in self.entries:
            product = value * point[j]
            w[i] += product
            terms[i] += abs(product)
        return w, terms

    def _violations(self, z: np.ndarray, w: Numbers) -> Numbers:
        ends = zip(z.tolist(), w, self.lower.tolist(), self.upper.tolist(), strict=True)
        return [
            Fraction(0) if low == high else max(-b, 0) if a <= low else max(b, 0) if a >= high else abs(b)
            for a, b, low, high in ends
        ]

    def _caps(self, z: np.ndarray, w_there: Numbers, moved: Numbers) -> Numbers:
        sizes = [Fraction(0)] * (2 * self.n + 1)
        R, C = map(Fraction, self.R.tolist()), [Fraction(value) for value in self.C.tolist()]
        R = list(R)
        for i, violation in enumerate(self._violations(self.reference, w_there)):
            sizes[self.row_part[i]] = max(sizes[self.row_part[i]], R[i] * violation)
        for j in range(self.n):
            if self.lower[j] < self.upper[j] and not self.lower[j] < z[j] < self.upper[j]:
                sizes[self.column_part[j]] = max(sizes[self.column_part[j]], abs(moved[j]) / C[j])
        fallback = [Fraction(0)] * len(sizes)
        for i, value in enumerate(w_there):
            fallback[self.row_part[i]] = max(fallback[self.row_part[i]], R[i] * abs(value))
        infinite = Fraction(2) ** 4000
        return [(sizes[p] or fallback[p] or infinite) / R[i] for i, p in enumerate(self.row_part)]


def units(n: int, i: np.ndarray, j: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return R and C from the least squares of log|M_ij| + log R_i - log C_j (Curtis and Reid), R_i |M_ij| C_j near 1,
    and the connected part of each row and of each column."""
    m = values.size
    graph = sparse.coo_array((np.ones(m), (i, n + j)), shape=(2 * n, 2 * n))
    part = csgraph.connected_components(graph, directed=False)[1]
    if not m:
        return np.ones(n), np.ones(n), part[:n], part[n:]
    columns = np.r_[i, n + j], np.r_[np.arange(m), np.arange(m)]
    A = sparse.coo_array((np.ones(2 * m), columns[::-1]), shape=(m, 2 * n)).tocsr()
    x = linalg.lsqr(A, -np.log2(np.abs(values)), atol=1e-13, btol=1e-13, iter_lim=20 * n)[0]
    return 2.0 ** x[:n], 2.0 ** x[n:], part[:n], part[n:]


def bounds(problem: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of the problem as arrays."""
    lower, upper = (
        np.array(np.broadcast_to(bound, problem.n), dtype=float) for bound in (problem.lower, problem.upper)
    )
    return lower, upper


def without_noise(z: list[float]) -> list[float]:
    """Return z with 0 in place of components that may be rounding of 0 beside the largest one."""
    least = NOISE * max(map(abs, z), default=0.0)
    return [value if abs(value) > least else 0.0 for value in z]


def judge(problem: Any, entry: dict[str, Any]) -> str:
    """Return what a recorded outcome is worth: "right", "refused", "undecided", or "false: ..." with the reason."""
    status = entry["status"]
    if status == "solved":
        if near_solution(problem, entry["z"]):
            return "right"
        if problem.n <= 500 and any(map(Measure(problem).passes, (entry["z"], without_noise(entry["z"])))):
            return "right"
        return "false: z violates the conditions" if problem.n <= 500 else "undecided"
    if status not in NO_SOLUTION:
        return "refused"
    known = any(exact.solves(problem, [Fraction(v) for v in z.tolist()]) for z in problem.solutions)
    if known or (has_few_states(problem) and exact.solution(problem) is not None):
        return "false: there is a solution"
    if "y" in entry and "rounding" not in entry["proof"]:
        y = [Fraction(value) for value in entry["y"]]
        holds = exact.refutes(problem, y) or exact.refutes(problem, y, as_written=True)
        return "right" if holds else "false: y is no proof in exact arithmetic"
    return "right" if has_few_states(problem) else "undecided"


def has_few_states(problem: Any) -> bool:
    """Return whether the states of all unknowns can be enumerated."""
    number = 1
    for low, high in zip(*bounds(problem), strict=True):
        number *= 1 if low == high else 1 + int(np.isfinite(low)) + int(np.isfinite(high))
    return number <= MOST_STATES and problem.n <= MOST_ENUMERATED


def near_solution(problem: Any, z: Sequence[float]) -> bool:
    """Return whether z is near an exact solution with its states, in each component."""
    if problem.n > MOST_EXACT or not np.isfinite(z).all():
        return False
    M, q = exact._rational(problem)
    lower, upper = (bound.tolist() for bound in bounds(problem))
    found = exact.of_states(M, q, lower, upper, exact.states_of(problem, z))
    return found is not None and all(
        abs(Fraction(a) - b) <= Fraction(NEAR) * abs(b) for a, b in zip(z, found, strict=True)
    )
