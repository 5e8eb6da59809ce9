"""Proofs that a problem has no solution, each checked against the original M and q before it is accepted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.farkas import alternative, refutes

MIXED = "no z within the bounds has w with the signs that they ask for, by the y of the certificate"


@dataclass(frozen=True, eq=False)
class Certificate:
    """Why there is no solution, or why a method gives up.

    kind : "farkas", vector y with y >= 0, M'y <= 0 and q'y < 0: no z >= 0 has M z + q >= 0. (y is rounded to floats:
           where M'y is 0, its computed value may be positive; see `farkas.refutes`.) With bounds, the y of
           `mixed_farkas`.
           "exhaustion", every complementary basis is excluded, by branch and bound or enumeration; no vector.
           "ray", Lemke's method has ended on a ray with direction vector, which alone proves nothing.
    statement : what it proves, as a clause for the user.
    vector : shape (n,), or None.
    """

    kind: Literal["farkas", "exhaustion", "ray"]
    statement: str
    vector: Vector | None = None


def proves_infeasible(problem: Problem, y: Vector) -> bool:
    """Whether y, of shape (n,), proves that no z >= 0 has M z + q >= 0: `farkas.refutes` on the original M and q.

    Exact: it is never true for a feasible problem, however nearly infeasible. With bounds, `mixed_farkas.refutes`.
    """
    if isinstance(problem.box, Box):
        with imports:
            from lcpcli.verify import mixed_farkas

        return mixed_farkas.refutes(problem.M, problem.q, problem.box, y)
    return refutes(problem.M, problem.q, y)


def farkas_statement(problem: Problem) -> str:
    """What Farkas' y proves, as a clause for the user."""
    return MIXED if problem.is_mixed else "M'y <= 0 and q'y < 0 for the y >= 0 of the certificate"


def farkas(problem: Problem, seconds: float = math.inf) -> Vector | None:
    """y of shape (n,) that proves the problem infeasible, or None; it costs at most three LPs of half the seconds each.

    The LP is solved on the equilibrated problem R M C, R q, whose proof y' gives y = R y'. The largest entry of y
    lies between 1 and 2: R and the divisor are powers of two, so nothing is rounded. None means that the problem
    is feasible, to the tolerance of the LP solver, or that no proof passed the check in exact arithmetic.
    """
    R, C = equilibrate(problem.M, problem.q)
    with np.errstate(all="ignore"):
        M, q = matrices.scaled(problem.M, R, C), R * problem.q
    if isinstance(problem.box, Box):
        with imports:
            from lcpcli.verify import mixed_farkas

        candidates = mixed_farkas.candidates(M, q, problem.box.in_units(C), seconds)
        return next((y for y in (proof_in_units(problem, R, y) for y in candidates) if y is not None), None)
    y = alternative(M, q, seconds).proof
    return None if y is None else proof_in_units(problem, R, y)


def proof_in_units(problem: Problem, R: Vector, y: Vector) -> Vector | None:
    """The proof in original units, from a proof y of infeasibility for rows scaled by R, powers of two."""
    with np.errstate(all="ignore"):
        y = R * y
        y = np.ldexp(y, 1 - int(np.frexp(np.abs(y).max())[1]))
    return y if proves_infeasible(problem, y) else None
