"""Proofs that a problem has no solution, each checked against the original M and q
before it is accepted.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Literal

import numpy as np

from lcpcli.basis.dual_simplex import MAX_DENSE
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, each_step, in_range
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import absolute_product, product
from lcpcli.model.box import BASIC
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import rounded_direction
from lcpcli.rational.tree import first_solution
from lcpcli.typing import Vector
from lcpcli.verify import farkas
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

# For a search of all complementary sets: mostly milliseconds, half a second for some
# with 20 unknowns.
EXHAUSTION_EFFORT = 2.0
# Relative to the natural size of w in a row: larger than the tolerance.
CLEAR_VIOLATION = 1e-9
RAY = "that alone proves nothing"
# Unknowns from which a proof up to rounding counts: fewer leave it to exact arithmetic.
MANY = FEW_UNKNOWNS + 1
UNVERIFIED = {  # what is said of a claim of a kind that does not hold
    "farkas": "the certificate of infeasibility failed exact verification",
    "exhaustion": (
        "the claim that every complementary set is excluded failed verification"
    ),
    "ray": "the direction of the ray failed verification",
}


@dataclass(frozen=True, eq=False)
class Proof:
    """Why there is no solution, or why a method gave up: a claim until it `holds`.

    kind : "farkas", vector y with y >= 0, M'y <= 0 and q'y < 0: no z >= 0 has M z + q
        >= 0. With bounds, the y that `farkas` describes. It consists of integers, for
        which all this holds without rounding, if `verify_claim` finds them; else it is
        rounded: where M'y is 0, its computed value may be positive (see
        `farkas.refutes`). "exhaustion", every complementary basis is excluded, by
        branch and bound or enumeration; no vector. "ray", Lemke's method has ended on a
        ray with direction vector, if it is known; that alone proves nothing.
    vector : shape (n,), or None. statement : what it proves, as a clause for the user.
    is_rounded : whether only the rounding of M keeps the vector from being a proof (see
        `farkas.cancellation`).
    exact : the proof in fractions, if it is known and no doubles were found that form a
        proof; vector is near it.
    """

    kind: Literal["farkas", "exhaustion", "ray"]
    vector: Vector | None = None
    statement: str = ""
    is_rounded: bool = False
    exact: Sequence[Fraction] | None = None

    @classmethod
    def of_fractions(
        cls, data: ExactProblem, y: Sequence[Fraction], statement: str = ""
    ) -> Proof:
        """Return the proof by an exact Farkas vector: by a multiple of it in doubles,
        beside y itself if that is none."""
        vector = rounded_direction(y)
        exact = None if data.refuted_by(fractions_of(vector)) else y
        statement = statement or data.problem.box.wording.farkas
        return cls("farkas", vector, statement, exact=exact)

    def holds(self, problem: Problem, excludes_exactly: bool = False) -> bool:
        """Return whether the claim is true of a problem: never for a feasible one,
        however nearly infeasible, nor for a vector that is not of shape (n,).

        excludes_exactly : whether the method that claims exhaustion excludes
            complementary sets by exact arithmetic alone: of more than FEW_UNKNOWNS,
            whose sets are not searched again, only such a method is believed.
        """
        if self.kind == "exhaustion":
            return _is_exhausted(problem, excludes_exactly)
        y = self.vector
        if self.kind == "ray":
            return y is None or _is_ray(problem, y)
        if self.exact is not None:
            return ExactProblem.of_floats(problem).refuted_by(self.exact)
        if y is None or y.shape != problem.q.shape:
            return False
        test = farkas.cancellation if self.is_rounded else farkas.refutes
        return bool(test(problem.M, problem.q, y, problem.box))

    def is_clear(self, problem: Problem) -> bool:
        """Return whether the vector, if a proof, also excludes small violations, so
        that it is no effect of rounding in the data."""
        y = self.vector
        assert y is not None
        with np.errstate(all="ignore"):
            total = farkas.Multiplied(problem.M, problem.q, y, problem.box).total
            caps = Measure(problem).caps(problem.reference_point)
            return -total > CLEAR_VIOLATION * float(
                np.where(np.isfinite(caps), caps, 0.0) @ np.abs(y)
            )


def _is_exhausted(problem: Problem, excludes_exactly: bool) -> bool:
    """Return whether all complementary sets are excluded: by the tree in exact
    arithmetic, for few unknowns and with some effort."""
    if problem.n <= FEW_UNKNOWNS:
        data = ExactProblem.of_floats(problem)
        with suppress(TimeIsUp):
            return first_solution(data, Effort(EXHAUSTION_EFFORT).steps(data)) is None
    return excludes_exactly


@np.errstate(all="ignore")
def _is_ray(problem: Problem, z: Vector) -> bool:
    """Return whether Lemke's method may end on a ray in direction z, up to rounding: z
    >= 0, not 0, and z'w = 0 for w = M z + t e >= 0 with some t >= 0, and no bound in
    the way."""
    if z.shape != problem.q.shape or not (
        np.isfinite(z).all() and (z >= 0).all() and z.any()
    ):
        return False
    # It leads beyond a bound.
    if np.where(z > 0, problem.box.upper, np.inf).min() < np.inf:
        return False
    w, largest = product(problem.M, z), float(absolute_product(problem.M, z).max())
    w += max(-float(w.min()), 0.0)
    return largest < math.inf and bool(
        (w[z > 0] <= farkas.ACTIVE_COLUMN * largest).all()
    )


def first_proof(
    problem: Problem,
    ys: Iterable[Vector],
    statement: str = "",
    rounded_from: float = math.inf,
    whole: bool = False,
) -> Proof | None:
    """Return the proof by the first y that is one, times a power of two that keeps it
    in range; if none is, by the first that is one but for the rounding of M (see
    `farkas.cancellation`); else None.

    statement : by default, what its bounds refute. rounded_from : unknowns from which
        rounding counts; by default the proof has to hold exactly. whole : whether a
        vector of integers near a multiple of y is sought first.
    """
    rejected = list[Vector]()
    for y in ys:
        vector = _whole(problem, y) if whole else _in_range(problem, y)
        if vector is not None:
            return Proof("farkas", vector, statement or problem.box.wording.farkas)
        rejected.append(y)
    if problem.n < rounded_from:
        return None
    for y in rejected:
        if y.shape == problem.q.shape and (
            times := farkas.cancellation(problem.M, problem.q, y, problem.box)
        ):
            size = f"1e{math.floor(math.log10(times))}"
            rounded_statement = problem.box.wording.rounded.format(size)
            return Proof("farkas", y, rounded_statement, is_rounded=True)
    return None


def _in_range(problem: Problem, y: Vector) -> Vector | None:
    y = in_range(y)
    return y if Proof("farkas", y).holds(problem) else None


def _whole(problem: Problem, y: Vector) -> Vector | None:
    """Return a vector near a multiple of y that proves the problem infeasible; None if
    y proves nothing.

    The vector consists of integers for which the proof holds exactly, for the doubles
    of the problem or, if no such integers are found, for their shortest decimals: small
    ones near y or near another proof, or else up to 2^53. Else, as for large problems
    and long numbers, it is y times a power of two.
    """
    if y.shape != problem.q.shape or not (np.isfinite(y).all() and y.any()):
        return None
    with imports:
        from lcpcli.verify.alternative import with_margin

    def proofs(start: Vector, small: bool) -> Iterator[Vector]:
        candidates = farkas.whole_proofs(problem, start, small)
        return (v for v in candidates if Proof("farkas", v).holds(problem))

    if (proof := next(proofs(y, small=True), None)) is not None:
        return proof
    scaled_y = _in_range(problem, y)
    others = with_margin(problem) if scaled_y is not None else ()
    small = (v for other in others for v in proofs(other, small=True))
    return next(chain(small, proofs(y, small=False)), scaled_y)


def verify_claim(
    problem: Problem, claim: Proof, excludes_exactly: bool = False
) -> Proof | None:
    """Return what a method claims if it holds for the original M and q, with a Farkas
    vector of integers if they are found (see `first_proof`); else None."""
    if claim.kind != "farkas":
        is_ray = claim.kind == "ray"
        sure = replace(claim, statement=RAY) if is_ray else replace(claim, vector=None)
        return sure if claim.holds(problem, excludes_exactly) else None
    if claim.vector is None:
        return None
    proof = first_proof(problem, [claim.vector], rounded_from=MANY, whole=True)
    if proof is not None and not proof.is_rounded:
        statement = claim.statement or proof.statement
        return _stated(
            problem, replace(claim, vector=proof.vector, statement=statement)
        )
    return claim if claim.exact is not None and claim.holds(problem) else proof


def _stated(problem: Problem, claim: Proof) -> Proof:
    """Return the proof by a Farkas vector that is a proof as it is, if there is one in
    doubles, else by one in fractions, for few unknowns; else with the statement that it
    is rounded."""
    y, exact = claim.vector, None
    assert y is not None
    if farkas.is_exact(problem, y):
        return claim
    if problem.n <= FEW_UNKNOWNS:
        data = ExactProblem.of_floats(problem)
        with suppress(TimeIsUp):
            exact = farkas.exact_proof(data, y) or farkas.farkas_vector(
                data, Effort(EXHAUSTION_EFFORT).steps(data)
            )
            if exact is not None:
                return Proof.of_fractions(data, exact, claim.statement)
    return replace(claim, statement=f"{claim.statement}, up to rounding of y")


EFFORT = 2.0  # of LPs for a proof, by the seconds that they usually take


def proof_near(problem: Problem, z: Vector) -> Proof | None:
    """Return a proof that the problem is infeasible, up to the rounding of M if there
    is no other one; None if none is found. z : a run-off, or an exact solution, whose
    basis leads to most of these proofs."""
    has_dictionary = (
        not matrices.is_sparse(problem.M)
        and problem.box.is_orthant
        and problem.n <= MAX_DENSE
    )
    with imports:
        from lcpcli.verify.alternative import farkas_multipliers
    with suppress(TimeIsUp):
        candidates = _candidates(problem, z, has_dictionary)
        proof = first_proof(problem, candidates, rounded_from=0)
        if proof is not None or has_dictionary:
            return proof
        multipliers = farkas_multipliers(problem, EFFORT)
        return first_proof(problem, multipliers, rounded_from=MANY)
    return None


@each_step(all="ignore")
def _candidates(
    problem: Problem, z: Vector, has_dictionary: bool
) -> Generator[Vector, None, None]:
    with imports:
        from lcpcli.verify.alternative import dictionaries, simplest
    units = scale(problem)
    inner = units.problem
    y = _null_vector(inner, units.z_inside(z))
    others = dictionaries(inner.M, inner.q) if has_dictionary else ()
    # Of the first, rounding decides the sign.
    multipliers = chain((y, -y), (y for _, _, y in others))
    for y in map(problem.box.as_multipliers, multipliers):
        size = float(np.abs(y).max())
        if 0 < size < math.inf:
            yield from map(units.multipliers, (y / size, *simplest(y / size)))


def _null_vector(problem: Problem, z: Vector) -> Vector:
    """Return the left null vector of the M_BB of the states of z, by a step of inverse
    iteration from z, which is a null vector itself but for rounding; with a shift of
    the size of rounding if M_BB is singular."""
    y = np.zeros(problem.n)
    active = np.flatnonzero(problem.box.basis_at(z) == BASIC)
    M = problem.M
    if not active.size:
        return y
    solver = PrincipalSolver(matrices.compressed(M.T) if matrices.is_sparse(M) else M.T)
    start, block = z[active] / np.abs(z).max(), solver.block(active)
    for shift in (0.0, EPS * matrices.norm_inf(block)):
        with suppress(SingularMatrix, OverflowError, ValueError):
            y[active] = solver.factorized(matrices.plus_diagonal(block, shift))(start)
            break
    return y
