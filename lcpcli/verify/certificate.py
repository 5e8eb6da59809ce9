"""Proofs that a problem has no solution, each checked against the original M and q
before it is accepted.

Ill-posed problems: with a solution of their doubles, and infeasible but for the
rounding of M.

The solution is exact, but so large that rounding of its digits leaves more than the
criterion allows, as its cap keeps out points that tend to infinity; or, where exact
arithmetic takes too long, it is such a point. The proof is one of
`farkas.cancellation`. Which of the two holds for the data before they were rounded, the
doubles do not tell.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Literal, NamedTuple

import numpy as np

from lcpcli.basis.dual_simplex import MOST_DENSE
from lcpcli.basis.exchanges import BasicSolutions
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
from lcpcli.verify import enclosure, farkas
from lcpcli.verify.exact_solution import (
    finitely_rounded,
    from_point,
    is_rounded_solution,
    refined,
)
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

# For a search of all complementary sets: mostly milliseconds, half a second for some
# with 20 unknowns.
EXHAUSTION_EFFORT = 2.0
# Relative to the natural size of w in a row: larger than the tolerance.
CLEAR_VIOLATION = 1e-9
RAY = "that alone proves nothing"


@dataclass(frozen=True, eq=False)
class Certificate:
    """Why there is no solution, or why a method gave up.

    kind : "farkas", vector y with y >= 0, M'y <= 0 and q'y < 0: no z >= 0 has M z + q
        >= 0. With bounds, the y that `farkas` describes. It consists of integers, for
        which all this holds without rounding, if `proof` finds them; else it is
        rounded: where M'y is 0, its computed value may be positive (see
        `farkas.refutes`). "exhaustion", every complementary basis is excluded, by
        branch and bound or enumeration; no vector. "ray", Lemke's method has ended on a
        ray with direction vector, if it is known; that alone proves nothing.
    statement : what it proves, as a clause for the user. vector : shape (n,), or None.
    is_rounded : whether only the rounding of M keeps the vector from being a proof (see
        `rounded_proof`).
    exact : the proof in fractions, if it is known and no doubles were found that form a
        proof; vector is near it.
    """

    kind: Literal["farkas", "exhaustion", "ray"]
    statement: str
    vector: Vector | None = None
    is_rounded: bool = False
    exact: Sequence[Fraction] | None = None


def confirm(
    problem: Problem, claim: Certificate, excludes_exactly: bool
) -> Certificate | None:
    """Return the certificate that a method claims if it holds for the original M and q,
    with a Farkas vector as `proof` returns it; None if it does not hold.
    excludes_exactly : whether the method excludes complementary sets by exact
    arithmetic alone: of more than FEW_UNKNOWNS, whose sets are not searched again, only
    such a method is believed."""
    if claim.kind == "exhaustion":
        return _exhaustion(problem, claim, excludes_exactly)
    return (_farkas if claim.kind == "farkas" else _ray)(problem, claim)


def _farkas(problem: Problem, claim: Certificate) -> Certificate | None:
    if claim.vector is None:
        return None
    y = proof(problem, claim.vector)
    if (
        y is None
        and claim.exact is not None
        and ExactProblem.of_floats(problem).refuted_by(claim.exact)
    ):
        return claim
    return (
        rounded_proof(problem, claim.vector)
        if y is None
        else _stated(problem, replace(claim, vector=y))
    )


def _exhaustion(
    problem: Problem, claim: Certificate, excludes_exactly: bool
) -> Certificate | None:
    """All complementary sets are excluded: by the tree in exact arithmetic, for few
    unknowns and with some effort."""
    has_none = excludes_exactly
    if problem.n <= FEW_UNKNOWNS:
        data = ExactProblem.of_floats(problem)
        with suppress(TimeIsUp):
            has_none = (
                first_solution(data, Effort(EXHAUSTION_EFFORT).steps(data)) is None
            )
    return replace(claim, vector=None) if has_none else None


@np.errstate(all="ignore")
def _ray(problem: Problem, claim: Certificate) -> Certificate | None:
    """A direction z in which Lemke's method may end on a ray, up to rounding: z >= 0,
    not 0, and z'w = 0 for w = M z + t e >= 0 with some t >= 0, and no bound in the
    way."""
    z, own = claim.vector, replace(claim, statement=RAY)
    if z is None:
        return own
    if z.shape != problem.q.shape or not (
        np.isfinite(z).all() and (z >= 0).all() and z.any()
    ):
        return None
    # It leads beyond a bound.
    if np.where(z > 0, problem.box.upper, np.inf).min() < np.inf:
        return None
    w, largest = product(problem.M, z), float(absolute_product(problem.M, z).max())
    w += max(-float(w.min()), 0.0)
    return (
        own
        if largest < math.inf and (w[z > 0] <= farkas.ACTIVE_COLUMN * largest).all()
        else None
    )


UNVERIFIED = {  # what is said of a claim of a kind that does not hold
    "farkas": "the certificate of infeasibility failed exact verification",
    "exhaustion": (
        "the claim that every complementary set is excluded failed verification"
    ),
    "ray": "the direction of the ray failed verification",
}


def _stated(problem: Problem, claim: Certificate) -> Certificate:
    """Return the certificate with a Farkas vector that is a proof as it is, if there is
    one in doubles, else with one in fractions, for few unknowns; else with the
    statement that it is rounded."""
    assert claim.vector is not None
    if farkas.is_exact(problem, claim.vector):
        return claim
    if problem.n <= FEW_UNKNOWNS:
        data = ExactProblem.of_floats(problem)
        with suppress(TimeIsUp):
            exact = farkas.exact_proof(data, claim.vector)
            if (
                exact
                or (
                    exact := farkas.farkas_vector(
                        data, Effort(EXHAUSTION_EFFORT).steps(data)
                    )
                )
                is not None
            ):
                return exact_certificate(data, claim.statement, exact)
    return replace(claim, statement=f"{claim.statement}, up to rounding of y")


def exact_certificate(
    data: ExactProblem, statement: str, y: Sequence[Fraction]
) -> Certificate:
    """Return the certificate with an exact proof y: a multiple of it in doubles, beside
    y itself if that is none."""
    vector = rounded_direction(y)
    return Certificate(
        "farkas",
        statement,
        vector,
        exact=None if data.refuted_by(fractions_of(vector)) else y,
    )


def proves_infeasible(problem: Problem, y: Vector) -> bool:
    """Return whether y proves that no z within its bounds has w with the signs that the
    bounds ask for, by `farkas.refutes`: never for a feasible problem, however nearly
    infeasible, nor for a y that is not of shape (n,)."""
    return y.shape == problem.q.shape and farkas.refutes(
        problem.M, problem.q, y, problem.box
    )


def is_clear(problem: Problem, y: Vector) -> bool:
    """Return whether y, if a proof, also excludes small violations, so that it is no
    effect of rounding in the data."""
    with np.errstate(all="ignore"):
        total = farkas.Multiplied(problem.M, problem.q, y, problem.box).total
        caps = Measure(problem).caps(problem.reference_point)
        return -total > CLEAR_VIOLATION * float(
            np.where(np.isfinite(caps), caps, 0.0) @ np.abs(y)
        )


def proof(problem: Problem, y: Vector) -> Vector | None:
    """Return a vector of shape (n,) near a multiple of y that proves the problem
    infeasible; None if y proves nothing.

    The vector consists of integers for which the proof holds exactly, for the doubles
    of the problem or, if no such integers are found, for their shortest decimals: small
    ones near y or near another proof, or else up to 2^53. Else, as for large problems
    and long numbers, it is y times a power of two.
    """
    if y.shape != problem.q.shape or not (np.isfinite(y).all() and y.any()):
        return None
    with imports:
        from lcpcli.verify.alternative import with_room
    if (
        found := _first(problem, farkas.whole_proofs(problem, y, small=True))
    ) is not None:
        return found
    own = in_range_if_proof(problem, y)
    others = with_room(problem) if own is not None else ()
    small = (
        v for other in others for v in farkas.whole_proofs(problem, other, small=True)
    )
    found = _first(problem, chain(small, farkas.whole_proofs(problem, y, small=False)))
    return own if found is None else found


def _first(problem: Problem, candidates: Iterable[Vector]) -> Vector | None:
    return next((y for y in candidates if proves_infeasible(problem, y)), None)


def rounded_proof(problem: Problem, y: Vector, few: bool = False) -> Certificate | None:
    """Return the certificate if y is a proof but for the rounding of M (see
    `farkas.cancellation`); None if it is not, or if the unknowns are so few that exact
    arithmetic decides, unless it is wanted for few unknowns, too."""
    if (problem.n <= FEW_UNKNOWNS and not few) or y.shape != problem.q.shape:
        return None
    times = farkas.cancellation(problem.M, problem.q, y, problem.box)
    if not times:
        return None
    statement = problem.box.wording.rounded.format(f"1e{math.floor(math.log10(times))}")
    return Certificate("farkas", statement, y, is_rounded=True)


def infeasible(problem: Problem, y: Vector, statement: str = "") -> Certificate:
    """Return the certificate of a Farkas vector that is a proof, which by default
    states what its bounds refute."""
    return Certificate("farkas", statement or problem.box.wording.farkas, y)


def farkas_certificate(
    problem: Problem, effort: float = math.inf, exactly: bool = False
) -> Certificate | None:
    """Return a proof that the problem is infeasible, by at most three LPs of half the
    effort each, for the equilibrated problem R M C, R q, whose proof y' gives y = R y';
    a `rounded_proof` if there is no other one, unless it has to hold exactly. None if
    it is feasible, to the tolerance of the LP solver, or no proof passed the check."""
    with imports:
        from lcpcli.verify.alternative import candidates
    with np.errstate(all="ignore"):
        units = scale(problem)
    found = candidates(units.problem.M, units.problem.q, units.problem.box, effort)
    return first_proof(problem, map(units.multipliers, found), exactly)


def first_proof(
    problem: Problem, ys: Iterable[Vector], exactly: bool = False, few: bool = False
) -> Certificate | None:
    """Return the certificate by the first y that is a proof; if none is, by the first
    that is a `rounded_proof`, for few unknowns only if asked for, unless it has to hold
    exactly; else None."""
    tried = []
    for y in ys:
        if (own := in_range_if_proof(problem, y)) is not None:
            return infeasible(problem, own)
        tried.append(y)
    rounded = () if exactly else (rounded_proof(problem, y, few) for y in tried)
    return next(filter(None, rounded), None)


def in_range_if_proof(problem: Problem, y: Vector) -> Vector | None:
    """Return y times a power of two that keeps it in range, if it proves the problem
    infeasible; else None."""
    y = in_range(y)
    return y if proves_infeasible(problem, y) else None


# Of an exact solution, and of LPs for a proof, by the seconds that they usually take.
EFFORT = 2.0
EXACT = "z is an exact solution of size {size} up to its last digits, but {proof}"
NO_RUN_OFF = "a row is violated by its own terms"
RUN_OFF = (
    "z of size {size} violates no row by more than {tol:g} of its terms, but {proof}"
)


@np.errstate(all="ignore")
def is_run_off(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether no row is violated by more than the measure allows by its own
    terms, whatever its cap."""
    if not (
        problem.is_moderate
        and np.isfinite(z).all()
        and (z == problem.box.project(z)).all()
    ):
        return False
    measure = Measure(problem)
    rows = measure.rows(z)
    return bool(
        (measure.violations(z, rows.w) <= measure.allowed(rows, np.inf, tol)).all()
    )


class Settled(NamedTuple):
    """What became of a doubt about a point. z : the basic solution of its states, shape
    (n,), if a solution is shown to exist near that; else the point. fault : why no
    solution is shown to exist; "" if one is. certificate : a proof that the problem is
    infeasible, up to the rounding of M; None if none was found."""

    z: Vector
    fault: str
    certificate: Certificate | None


@np.errstate(all="ignore")
def settled(problem: Problem, z: Vector, tol: float) -> Settled | None:
    """Settle whether a z is a solution that is a run-off, or that is exact but for its
    last digits; None if it is neither. One system with the states of z is solved, with
    bounds on its rounding or else exactly; then a proof that the problem is infeasible
    but for rounding is sought."""
    near, fault = enclosed(problem, z, tol)
    # A proof but for rounding would be one for other entries that differ by up to n
    # EPS.
    if not fault:
        is_stable = enclosure.is_surely_definite(problem) or not enclosure.fault(
            problem, near, math.inf, problem.n * EPS
        )
        return Settled(near, "", None if is_stable else proof_near(problem, near))
    if is_rounded_solution(problem, z):
        return Settled(z, "", proof_near(problem, z))
    return Settled(z, fault, proof_near(problem, near)) if fault != NO_RUN_OFF else None


@np.errstate(all="ignore")
def enclosed(problem: Problem, z: Vector, tol: float) -> tuple[Vector, str]:
    """Return the basic solution of a run-off, and why none is shown to exist near it,
    "" if one is; or z itself."""
    if not is_run_off(problem, z, tol):
        return z, NO_RUN_OFF
    near = refined(problem, z, problem.box.basis_at(z))
    return near, enclosure.fault(problem, near, tol)


def large_solution(
    problem: Problem, points: Sequence[Vector], proof: Certificate, tol: float
) -> tuple[Vector, str] | None:
    """Return a solution beyond the criterion, with why the problem is ill-posed then,
    as a clause for the user: the exact solution of the basis of one of the points, or
    of a basis near it, rounded; else a run-off: one of the points, or a basic solution
    in doubles, whose sign rounding decides, of a point or of the proof. None if there
    is neither."""
    points = [z for z in points if np.isfinite(z).all()]
    large, sentence = (
        next((z for z in points if is_rounded_solution(problem, z)), None),
        EXACT,
    )
    if large is None:
        with suppress(TimeIsUp):
            data, effort = ExactProblem.of_floats(problem), Effort(EFFORT)
            found = (from_point(data, z, effort, farkas.most_exact()) for z in points)
            large = next((finitely_rounded(z) for z in found if z is not None), None)
    if large is None:
        assert proof.vector is not None
        basic = (
            z
            for point in (*points, proof.vector)
            for z in _basic_solutions(problem, point)
        )
        large, sentence = (
            next(
                (z for z in chain(points, basic) if is_run_off(problem, z, tol)), None
            ),
            RUN_OFF,
        )
    if large is None:
        return None
    size = f"{np.abs(large).max():.0e}".replace("e+", "e")
    return large, sentence.format(size=size, tol=tol, proof=proof.statement)


def _basic_solutions(problem: Problem, point: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the states of a point, and its opposite with respect
    to the reference point."""
    with suppress(SingularMatrix):
        z = BasicSolutions(problem).at(problem.box.basis_at(point)).z
        yield from map(problem.box.project, (z, 2 * problem.reference_point - z))


def proof_near(problem: Problem, z: Vector) -> Certificate | None:
    """Return a proof that the problem is infeasible, up to the rounding of M if there
    is no other one; None if none is found. z : a run-off, or an exact solution, whose
    basis leads to most of these proofs."""
    has_dictionary = (
        not matrices.is_sparse(problem.M)
        and problem.box.is_orthant
        and problem.n <= MOST_DENSE
    )
    with suppress(TimeIsUp):
        found = first_proof(problem, _candidates(problem, z, has_dictionary), few=True)
        return (
            found
            if found is not None or has_dictionary
            else farkas_certificate(problem, EFFORT)
        )
    return None


@each_step(all="ignore")
def _candidates(
    problem: Problem, z: Vector, has_dictionary: bool
) -> Generator[Vector, None, None]:
    with imports:
        from lcpcli.verify.alternative import dictionaries, simplest
    units = scale(problem)
    inner, bounds = units.problem, problem.box.vectors(problem.n)
    least, most = (
        np.where(np.isfinite(bounds[0]), 0.0, -np.inf),
        np.where(np.isfinite(bounds[1]), 0.0, np.inf),
    )
    y = _null_vector(inner, units.z_inside(z))
    others = dictionaries(inner.M, inner.q) if has_dictionary else ()
    # Of the first, rounding decides the sign.
    multipliers = chain((y, -y), (y for _, _, y in others))
    for y in (np.clip(y, least, most) for y in multipliers):
        size = float(np.abs(y).max())
        if 0 < size < math.inf:
            yield from map(units.multipliers, (y / size, *simplest(y / size)))


def _null_vector(problem: Problem, z: Vector) -> Vector:
    """Return the left null vector of the M_BB of the states of z, by a step of inverse
    iteration from z, which is a null vector itself but for rounding; with a shift of
    the size of rounding if M_BB is singular."""
    y, active, M = (
        np.zeros(problem.n),
        np.flatnonzero(problem.box.basis_at(z) == BASIC),
        problem.M,
    )
    if not active.size:
        return y
    solver = PrincipalSolver(matrices.compressed(M.T) if matrices.is_sparse(M) else M.T)
    start, block = z[active] / np.abs(z).max(), solver.block(active)
    for shift in (0.0, EPS * matrices.norm_inf(block)):
        with suppress(SingularMatrix, OverflowError, ValueError):
            y[active] = solver.factorized(matrices.plus_diagonal(block, shift))(start)
            break
    return y
