"""The LCP as a mixed-integer linear program: for any M, and the one method that can say "feasible, yet no solution".

P. M. Pardalos and J. B. Rosen, Global optimization approach to the linear complementarity problem, SIAM Journal on
Scientific and Statistical Computing 9 (1988) 341-353, section 3: maximise alpha subject to 0 <= M y + alpha q <= e - b,
0 <= y <= b, 0 <= alpha <= 1, b binary. Its feasible points with alpha > 0 are the solutions z = y / alpha scaled to
max(z, w) <= 1 / alpha; the maximum is 0 exactly if there is none. No bound on z has to be guessed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lcpcli.interrupts import interruptibly, silence
from lcpcli.linalg import matrices
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.linalg.linear_program import linprog
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.methods import enumeration
from lcpcli.methods.enumeration import Mask
from lcpcli.methods.iterate import Iterate, NoSolution, OutOfTime, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify import farkas
from lcpcli.verify.certificate import Certificate, proof_in_units

GAP = 1e3  # any alpha > 0 will do: the solver may stop at one that is 1 / GAP of the largest
NO_POINT = "M'y <= 0 and q'y < 0 for the y >= 0 of the certificate"
EXHAUSTED = "each complementary set is excluded by a proof in exact arithmetic"


def milp(problem: Problem, x0: Vector, *, time_limit: float = math.inf) -> Iterator[Iterate]:
    """Solve one mixed-integer program, and from its active set one linear system. x0 has no influence.

    It works on R M C, R q with the powers of two of `scaling.equilibrate`, which rounds nothing, as alpha is about
    1 / max(z, w) in those units and the solver sees no alpha below 1e-6. In order: a proof that the problem is
    infeasible, by an LP; the program, for half the time limit at most, and the solution on each active set that it
    suggests; branch and bound over complementary sets, in which exact arithmetic has the last word (`enumeration`).
    Exponential in n at worst.

    Parameters
    ----------
    problem : the LCP, n unknowns.
    x0 : start, shape (n,), handed out as the first iterate, as every method does.
    time_limit : seconds after which it gives up.

    Yields
    ------
    Iterate : x0, then (z - w) / 2 for the solution of each complementary set that looks as if it had one. In `step`,
        "program" or "tree", where the set comes from. Those that are solutions to rounding come at once; those that
        are one to the LP solver's tolerance only come last, unless it is proved that there is none.

    Raises
    ------
    NoSolution : with a Farkas proof, or after the exhaustion of all complementary sets. Neither rests on rounding or
        tolerances: what alpha = 0 says is never a proof, as a tiny alpha may hide a large solution.
    Stalled : the time limit, the size of the tree or rounding keeps it from finding a solution or a proof.
    """
    return _iterates(problem, x0, time_limit)


def _iterates(problem: Problem, x0: Vector, time_limit: float) -> Iterator[Iterate]:
    deadline = time.perf_counter() + time_limit
    yield Iterate(x0, None, "", 0)
    scaled = _Scaled(problem)
    if not scaled.finite:
        raise Stalled("the problem overflows when it is equilibrated")
    proof = farkas.alternative(scaled.M, scaled.q, time_limit).proof
    y = None if proof is None else proof_in_units(problem, scaled.R, proof)
    if y is not None:
        raise NoSolution(Certificate("farkas", NO_POINT, y))
    tried: set[bytes] = set()
    rough: list[Iterate] = []
    try:
        for step, P in _sets(scaled, deadline):
            if P.tobytes() in tried:
                continue
            tried.add(P.tobytes())
            x, to_rounding = scaled.solution(P)
            if to_rounding and x is not None:
                yield Iterate(x, None, step, len(tried))
            elif x is not None:
                rough.append(Iterate(x, None, step, len(tried)))
    except enumeration.Unfinished as reason:
        yield from rough
        ending = OutOfTime if isinstance(reason, enumeration.Late) else Stalled
        raise ending(f"no solution is found, and none is excluded: {reason}") from None
    if not scaled.exact:
        raise Stalled("no solution is found, and equilibration underflows, so that there is no proof either")
    raise NoSolution(Certificate("exhaustion", EXHAUSTED))


def _sets(scaled: _Scaled, deadline: float) -> Iterator[tuple[str, Mask]]:
    """Complementary sets that may have a solution, the likeliest first, with the step that suggests them."""
    for P in _program(scaled.M, scaled.q, deadline):
        yield "program", P
    for P in enumeration.candidates(scaled.M, scaled.q, deadline):
        yield "tree", P


def _program(M: Matrix, q: Vector, deadline: float) -> list[Mask]:
    """The active sets at the best (y, b, alpha) that is found by the deadline; none if alpha is 0."""
    from scipy.optimize import LinearConstraint, milp

    n = q.size
    seconds = deadline - time.perf_counter()
    if seconds <= 0:
        raise enumeration.Late
    one, zero = np.eye(n), np.zeros((n, n))
    column = q[:, np.newaxis]
    A = stack([[M, zero, column], [M, one, column], [one, -one, np.zeros((n, 1))]])
    low = np.concatenate((np.zeros(n), np.full(2 * n, -np.inf)))
    high = np.concatenate((np.full(n, np.inf), np.ones(n), np.zeros(n)))

    def solved() -> Any:
        with np.errstate(all="ignore"):
            return milp(
                np.append(np.zeros(2 * n), -1.0),
                integrality=np.concatenate((np.zeros(n), np.ones(n), np.zeros(1))),
                bounds=(0.0, 1.0),
                constraints=LinearConstraint(A, low, high),
                options={"mip_rel_gap": GAP} | ({"time_limit": seconds / 2} if seconds < math.inf else {}),
            )

    with silence():
        found = interruptibly(solved)
    if found.x is None or not found.x[-1] > 0:
        return []
    y, b = found.x[:n], found.x[n : 2 * n]
    return [y > M @ y + found.x[-1] * q, b > 0.5]


class _Scaled:
    """The equilibrated problem R M C z' + s R q = w', with z = C z' / s and w = w' / (s R); all powers of two."""

    def __init__(self, problem: Problem) -> None:
        with np.errstate(all="ignore"):
            self.R, self.C = equilibrate(problem.M, problem.q)
            self.M, q = matrices.scaled(problem.M, self.R, self.C), self.R * problem.q
            self.s = float(np.exp2(-math.frexp(np.abs(q).max())[1]))
            self.q = self.s * q
            back = matrices.scaled(self.M, 1 / self.R, 1 / self.C) - problem.M
            self.finite = bool(
                np.isfinite(self.M.sum()) and np.isfinite(self.q).all() and np.isfinite(1 / self.R).all()
            )
            self.exact = abs(back).max() == 0 and np.array_equal(self.q / self.s / self.R, problem.q)

    def solution(self, P: Mask) -> tuple[Vector | None, bool]:
        """x = (z - w) / 2 in the problem's units with z_N = 0, M_PP z_P = -q_P, z >= 0, w >= 0, None if there is none
        to the LP solver's tolerance, and whether that is a solution to rounding, row by row."""
        x, inside = None, np.flatnonzero(P)
        with np.errstate(all="ignore"):
            for solve in (_regular, _singular):
                z = np.zeros(self.q.size)
                z_P = solve(self.M, self.q, P)
                if z_P is None:
                    continue
                z[inside] = np.maximum(z_P, 0.0)
                w = self.M @ z + self.q
                if min(z_P.min(initial=0.0), w.min()) < -farkas.ACTIVE * max(z.max(), 1.0):
                    continue
                x = (self.C * z - np.where(P, 0.0, np.maximum(w, 0.0)) / self.R) / (2 * self.s)
                wrong = np.where(P, np.abs(w), -w)
                rounding = 4 * (w.size + 2) * farkas.EPS * (abs(self.M) @ z + np.abs(self.q))
                if np.isfinite(x).all() and (wrong <= rounding).all():
                    return x, True
        return (x if x is not None and np.isfinite(x).all() else None), False


def _regular(M: Matrix, q: Vector, P: Mask) -> Vector | None:
    """z_P with M_PP z_P = -q_P, by one solve and one step of refinement; None if M_PP is singular."""
    inside = np.flatnonzero(P)
    A = _block(M, inside, inside)
    try:
        z = np.linalg.solve(A, -q[inside])
        refined: Vector = z - np.linalg.solve(A, A @ z + q[inside])
    except np.linalg.LinAlgError:
        return None
    return refined if np.isfinite(refined).all() else None


def _singular(M: Matrix, q: Vector, P: Mask) -> Vector | None:
    """z_P >= 0 with M_PP z_P = -q_P and M_NP z_P + q_N >= 0: a vertex by an LP, then least squares on its support."""
    inside, outside = np.flatnonzero(P), np.flatnonzero(~P)
    A, beside = _block(M, inside, inside), _block(M, outside, inside)
    found = linprog(np.ones(inside.size), -beside, q[outside], equal=(A, -q[inside])) if inside.size else None
    if found is None:
        return None
    support = np.flatnonzero(found.x > farkas.SNAP * found.x.max())
    z: Vector = np.zeros(inside.size)
    for _ in range(2):
        z[support] -= np.linalg.lstsq(A[:, support], A @ z + q[inside], rcond=None)[0]
    return z if z.min() >= 0 else found.x


def _block(M: Matrix, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Vector:
    part: Vector = M[rows][:, columns].toarray() if is_sparse(M) else M[np.ix_(rows, columns)]
    return part
