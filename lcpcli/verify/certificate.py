"""Proofs that a problem has no solution, each verified with the original M and q before
it is accepted.

A proof is a Farkas vector (see `farkas`) or the exclusion of all complementary bases.
The direction of a ray at which Lemke's method stops is reported in the same form, but
proves nothing in general. Candidates for Farkas vectors are the claims of methods,
multipliers of linear programs, and left null vectors of bases of points that tend to
infinity.
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
from lcpcli.rational import pivoting
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import rounded_direction
from lcpcli.rational.tree import first_solution
from lcpcli.rational.written import are_same, as_written, readings
from lcpcli.typing import Vector
from lcpcli.verify import farkas
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

# Work limit for a search of all complementary sets: it mostly takes milliseconds, and
# half a second for some problems with 20 unknowns.
EXHAUSTION_EFFORT = 2.0
# Violations relative to the cap of a row that a clear proof excludes: they are larger
# than the tolerance 1e-10, so that no z close to a solution exists either.
CLEAR_VIOLATION = 1e-9
RAY = "that alone proves nothing"
# Unknowns from which a proof up to rounding is accepted; for fewer, exact arithmetic
# decides.
MANY = FEW_UNKNOWNS + 1
# The message for a claim of each kind that fails verification.
UNVERIFIED = {
    "farkas": "the certificate of infeasibility failed exact verification",
    "exhaustion": (
        "the claim that every complementary set is excluded failed verification"
    ),
    "ray": "the direction of the ray failed verification",
}


@dataclass(frozen=True, eq=False)
class Proof:
    """The reason why there is no solution, or why a method stopped: a claim until it
    `holds`.

    kind : "farkas", a vector y with y >= 0, M'y <= 0 and q'y < 0: no z >= 0 has M z + q
        >= 0; with bounds, the y that `farkas` describes. If `verify_claim` can, it
        makes y a vector of integers, for which all this holds without rounding;
        otherwise y is rounded, and where M'y is 0, its computed value may be positive
        (see `farkas.refutes`). "exhaustion", every complementary basis is excluded, by
        branch and bound or enumeration; no vector. "ray", Lemke's method has ended on a
        ray whose direction is the vector, if it is known; that alone proves nothing.
    vector : shape (n,), or None. statement : what it proves, as a clause for the user.
    is_rounded : whether the vector is a proof only up to the rounding of M (see
        `farkas.cancellation`).
    exact : the proof in fractions, if it is known and no double precision vector is a
        proof; vector is then close to it.
    is_certain_for_all : whether an exhaustion is known to hold for all data that round
        to those of the problem.
    """

    kind: Literal["farkas", "exhaustion", "ray"]
    vector: Vector | None = None
    statement: str = ""
    is_rounded: bool = False
    exact: Sequence[Fraction] | None = None
    is_certain_for_all: bool = False

    @classmethod
    def of_fractions(
        cls, data: ExactProblem, y: Sequence[Fraction], statement: str = ""
    ) -> Proof:
        """Return the proof by an exact Farkas vector: by a multiple of it in double
        precision, together with the exact y if that multiple is no proof.
        """
        vector = rounded_direction(y)
        exact = None if data.refuted_by(fractions_of(vector)) else y
        statement = statement or data.problem.box.wording.farkas
        return cls("farkas", vector, statement, exact=exact)

    def holds(
        self,
        problem: Problem,
        excludes_exactly: bool = False,
        is_original: bool = False,
    ) -> bool:
        """Return whether the claim is true of a problem: never for a feasible one,
        however close to infeasible, nor for a vector that is not of shape (n,).

        excludes_exactly : whether the method that claims exhaustion excludes
            complementary sets in exact arithmetic only. For more than FEW_UNKNOWNS,
            where the search is not repeated, only the claim of such a method is
            accepted, if it holds for the numbers as written.
        is_original : whether it is the problem as somebody gave it, for which a claim
            has to hold with its numbers as written (`rational.written`), and not one in
            other variables, whose numbers are computed. A problem that was read from a
            text always is.
        """
        is_original = is_original or problem.written is not None
        if self.kind == "exhaustion":
            return self._is_exhausted(problem, excludes_exactly, is_original)
        y = self.vector
        if self.kind == "ray":
            return y is None or _is_ray(problem, y)
        if self.exact is not None:
            exact_problems = _readings(problem, is_original)
            return all(data.refuted_by(self.exact) for data in exact_problems)
        if y is None or y.shape != problem.q.shape:
            return False
        if is_original and not self.is_rounded:
            return farkas.refutes_as_written(problem, y)
        test = farkas.cancellation if self.is_rounded else farkas.refutes
        return bool(test(problem.M, problem.q, y, problem.box))

    def _is_exhausted(
        self, problem: Problem, excludes_exactly: bool, is_original: bool
    ) -> bool:
        """Return whether all complementary sets are excluded: for few unknowns by
        branch and bound in exact arithmetic, within EXHAUSTION_EFFORT; otherwise if the
        method did so, for the numbers as written if it is the original problem."""
        if problem.n <= FEW_UNKNOWNS:
            with suppress(TimeIsUp):
                return all(
                    first_solution(data, Effort(EXHAUSTION_EFFORT).steps(data)) is None
                    for data in _readings(problem, is_original)
                )
        if not excludes_exactly:
            return False
        return not is_original or self.is_certain_for_all or are_same(problem)

    def is_clear(self, problem: Problem) -> bool:
        """Return whether the vector, if it is a proof, also excludes violations of
        CLEAR_VIOLATION, so that infeasibility is not an effect of rounding errors in
        the data.
        """
        y = self.vector
        assert y is not None
        with np.errstate(all="ignore"):
            total = farkas.Multiplied(problem.M, problem.q, y, problem.box).total
            caps = Measure(problem).caps(problem.reference_point)
            return -total > CLEAR_VIOLATION * float(
                np.where(np.isfinite(caps), caps, 0.0) @ np.abs(y)
            )


def _readings(problem: Problem, is_original: bool) -> Iterable[ExactProblem]:
    """Return the exact problems for which a claim has to hold."""
    return readings(problem) if is_original else [ExactProblem.of_floats(problem)]


@np.errstate(all="ignore")
def _is_ray(problem: Problem, z: Vector) -> bool:
    """Return whether Lemke's method may terminate on a ray in the direction z, up to
    rounding: z >= 0, z is not 0 and reaches no bound, and z'w = 0 for w = M z + t e >=
    0 with some t >= 0.
    """
    if z.shape != problem.q.shape or not (
        np.isfinite(z).all() and (z >= 0).all() and z.any()
    ):
        return False
    # The ray leads beyond a finite upper bound.
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
    is_original: bool = False,
) -> Proof | None:
    """Return the proof by the first y that is one, multiplied by a power of two that
    keeps it in the range of double precision. If there is none, return the proof by the
    first y that is one up to the rounding of M (see `farkas.cancellation`); otherwise
    None.

    statement : by default, the statement for the bounds of the problem. rounded_from :
        the number of unknowns from which proofs up to rounding are accepted; by default
        the proof has to hold exactly. whole : whether a vector of integers close to a
        multiple of y is tested first. is_original : as in `Proof.holds`.
    """
    rejected = list[Vector]()
    of_vector = _whole if whole else _in_range
    for y in ys:
        vector = of_vector(problem, y, is_original)
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


def _in_range(problem: Problem, y: Vector, is_original: bool) -> Vector | None:
    """Return y times the power of two that scales it to about 1 if that is a proof;
    otherwise None."""
    y = in_range(y)
    holds = Proof("farkas", y).holds(problem, is_original=is_original)
    return y if holds else None


def _whole(problem: Problem, y: Vector, is_original: bool) -> Vector | None:
    """Return a vector close to a multiple of y that proves the problem infeasible; None
    if y proves nothing.

    If possible, it consists of integers for which the proof holds exactly, for the
    double precision numbers of the problem or, failing that, for their shortest
    decimals: small integers close to y or to another proof, or else integers up to
    2^53. Otherwise, as for large problems and long numbers, it is y times a power of
    two.
    """
    if y.shape != problem.q.shape or not (np.isfinite(y).all() and y.any()):
        return None
    with imports:
        from lcpcli.verify.alternative import with_margin

    is_original = is_original or problem.written is not None
    of_doubles = problem.written is None

    def holds(v: Vector) -> bool:
        if of_doubles and not Proof("farkas", v).holds(problem):
            return False
        return not is_original or farkas.is_exact(problem, v)

    def proofs(start: Vector, small: bool) -> Iterator[Vector]:
        return filter(holds, farkas.whole_proofs(problem, start, small))

    if (proof := next(proofs(y, small=True), None)) is not None:
        return proof
    scaled_y = _in_range(problem, y, is_original)
    others = with_margin(problem) if scaled_y is not None else ()
    small = (v for other in others for v in proofs(other, small=True))
    return next(chain(small, proofs(y, small=False)), scaled_y)


def verify_claim(
    problem: Problem, claim: Proof, excludes_exactly: bool = False
) -> Proof | None:
    """Return the claim of a method if it holds for the original problem with its
    numbers as written, with a Farkas vector of integers if possible (see `_whole`);
    otherwise None.
    """
    if claim.kind != "farkas":
        is_ray = claim.kind == "ray"
        sure = replace(claim, statement=RAY) if is_ray else replace(claim, vector=None)
        holds = claim.holds(problem, excludes_exactly, is_original=True)
        return sure if holds else None
    if claim.vector is None:
        return None
    proof = first_proof(
        problem, [claim.vector], rounded_from=MANY, whole=True, is_original=True
    )
    if proof is not None and not proof.is_rounded:
        statement = claim.statement or proof.statement
        return _stated(
            problem, replace(claim, vector=proof.vector, statement=statement)
        )
    if claim.exact is not None and claim.holds(problem, is_original=True):
        return claim
    return proof


# Unknowns up to which exact arithmetic looks for a solution of the numbers as written.
MAX_DECIDED_AS_WRITTEN = 200


def solution_as_written(problem: Problem) -> Sequence[Fraction] | None:
    """Return an exact solution for the numbers of a problem as written; None if there
    is none. Raises TimeIsUp if this is not decided within EXHAUSTION_EFFORT.
    """
    if problem.n > MAX_DECIDED_AS_WRITTEN:
        raise TimeIsUp
    data = as_written(problem)
    solution = pivoting.solve(data, Effort(EXHAUSTION_EFFORT / 2))
    return solution or first_solution(data, Effort(EXHAUSTION_EFFORT).steps(data))


def proof_as_written(problem: Problem, claim: Proof) -> Proof:
    """Return the proof that a problem has no solution for its numbers as written, where
    that is known and a claim holds for its doubles: a Farkas vector, if the claim has
    one and there is one for these numbers; else an exhaustion."""
    if claim.kind == "farkas":
        data = as_written(problem)
        with suppress(TimeIsUp):
            y = farkas.farkas_vector(data, Effort(EXHAUSTION_EFFORT).steps(data))
            if y is not None:
                return Proof.of_fractions(data, y)
    return Proof("exhaustion")


def _stated(problem: Problem, claim: Proof) -> Proof:
    """Return the claim if its Farkas vector is a proof exactly as it is; for few
    unknowns, otherwise a proof in double precision or in fractions; failing these, the
    claim with the statement that y is rounded.
    """
    y, exact = claim.vector, None
    assert y is not None
    if farkas.is_exact(problem, y):
        return claim
    if problem.n <= FEW_UNKNOWNS:
        data = as_written(problem)
        with suppress(TimeIsUp):
            exact = farkas.exact_proof(data, y) or farkas.farkas_vector(
                data, Effort(EXHAUSTION_EFFORT).steps(data)
            )
            if exact is not None:
                return Proof.of_fractions(data, exact, claim.statement)
    return replace(claim, statement=f"{claim.statement}, up to rounding of y")


EFFORT = 2.0  # limit on linear programs for a proof, in seconds that they usually take


def proof_near(problem: Problem, z: Vector) -> Proof | None:
    """Return a proof that the problem is infeasible, up to the rounding of M if there
    is no other one; None if no proof is obtained.

    z : a point that tends to infinity, or an exact solution; its basis leads to most of
        these proofs.
    """
    has_dictionary = (
        not matrices.is_sparse(problem.M)
        and problem.box.is_orthant
        and problem.n <= MAX_DENSE
    )
    with imports:
        from lcpcli.verify.alternative import farkas_multipliers
    with suppress(TimeIsUp):
        candidates = _candidates(problem, z, has_dictionary)
        proof = first_proof(problem, candidates, rounded_from=0, is_original=True)
        if proof is not None or has_dictionary:
            return proof
        multipliers = farkas_multipliers(problem, EFFORT)
        return first_proof(problem, multipliers, rounded_from=MANY, is_original=True)
    return None


@each_step(all="ignore")
def _candidates(
    problem: Problem, z: Vector, has_dictionary: bool
) -> Generator[Vector, None, None]:
    """Yield candidates for Farkas vectors: the left null vector of the basis of z, then
    the multipliers of dictionaries, both as computed and rounded to simple numbers."""
    with imports:
        from lcpcli.verify.alternative import dictionaries, simplest
    units = scale(problem)
    inner = units.problem
    y = _null_vector(inner, units.z_inside(z))
    others = dictionaries(inner.M, inner.q) if has_dictionary else ()
    # The sign of the null vector is arbitrary, so that both are tested.
    multipliers = chain((y, -y), (y for _, _, y in others))
    for y in map(problem.box.as_multipliers, multipliers):
        size = float(np.abs(y).max())
        if 0 < size < math.inf:
            yield from map(units.multipliers, (y / size, *simplest(y / size)))


def _null_vector(problem: Problem, z: Vector) -> Vector:
    """Return an approximate left null vector of M_BB for the basic variables B at z, by
    one step of inverse iteration from z, which is a right null vector up to rounding;
    with a shift of the size of rounding errors if M_BB is singular.
    """
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
