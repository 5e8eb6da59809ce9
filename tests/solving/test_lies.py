"""No method is believed that says it has solved a problem, or that there is no
solution: points that solve nothing, made-up residuals and endings; wrong vectors, empty
exhaustions, rays that are none.
"""

import itertools
import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import diags_array

import lcpcli
from lcpcli import Problem, Status, from_game, from_qp, run
from lcpcli.gallery import families
from lcpcli.linalg.matrices import product
from lcpcli.methods.registry import METHODS
from lcpcli.methods.stages import Breakdown, Finished, NoSolution, OutOfTime, Stalled
from lcpcli.model.box import in_words
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify import certificate
from lcpcli.verify.certificate import RAY, UNVERIFIED, Proof

from .. import exact, exact_measure, mixed_problems
from ..enumeration.solution_sets import random_problem as integers
from .liars import LIE, assert_refused, at

M, Q = mixed_problems.definite(5, default_rng(0))
LOWER, UPPER = mixed_problems.with_all_bounds(5, default_rng(0))
TRIDIAGONAL = diags_array([-1.0, 3.0, -1.0], offsets=[-1, 0, 1], shape=(30, 30))
PROBLEMS = {
    "lcp": Problem([[2, 1], [1, 2]], [-5, -6]),
    "many unknowns": Problem(TRIDIAGONAL, np.sin(np.arange(30)) - 0.5),
    "large numbers": Problem([[2e250, 1e250], [1, 2]], [-5e250, -6]),
    "mixed": Problem(M, Q, lower=LOWER, upper=UPPER),
    "far bounds": Problem(M, Q, lower=1e6 + np.arange(5), upper=np.inf),
    "program": from_qp([[2, 0], [0, 2]], [-3, 1], [[1, 1]], row_lower=1, row_upper=1),
    "game": from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]),
}
ENDINGS = [
    Finished(),
    Stalled("it knows better"),
    Breakdown("it knows better"),
    OutOfTime("it knows better"),
]


def off_by(problem, z, size):
    """A z near a solution with that relative residual, by rational arithmetic: one
    component is moved."""
    box = problem.box
    inside = np.minimum(z - box.lower, box.upper - z)
    inside[inside == np.inf] = 1.0
    j, step = int(np.argmax(inside)), 1e-6
    other = z.copy()
    for _ in range(3):
        other[j] = z[j] + step
        step *= size / exact_measure.relative_residual(problem, other)
    other[j] = z[j] + step
    assert exact_measure.relative_residual(problem, other) == pytest.approx(
        size, rel=0.05
    )
    return other


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_that_solves_nothing_is_not_called_a_solution(name, liar):
    problem = PROBLEMS[name]
    z = problem.box.project(2 * run(problem).z + 1)
    for F in (None, -0.0):
        for ending in ENDINGS:
            status = "breakdown" if isinstance(ending, Breakdown) else "stalled"
            assert_refused(liar.run(problem, [at(z, F)], ending), status)
        result = liar.run(
            problem, [at(z, F)] * 3, declaration={"iterates": True}, scale=True
        )
        assert_refused(result)
        assert "does not solve the problem" in result.message


def assert_refused_or_corrected(result):
    """The point is refused, or where it satisfies each row by its own terms, it is
    replaced by the solution with its states, of which a solution is proved to be within
    the last digits."""
    if not result.solved:
        assert_refused(result)
        return
    assert "an exact solution with the basis of z is proved to exist" in result.message
    solution = exact.solution(result.problem)
    assert all(
        abs(Fraction(a) - b) <= 2**-50 * abs(b)
        for a, b in zip(result.z.tolist(), solution, strict=True)
    )


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_ten_times_as_far_off_as_the_tolerance_is_refused(name, liar):
    problem, tol = PROBLEMS[name], 1e-10
    z = run(problem).z
    far, near = (off_by(problem, z, size * tol) for size in (10, 0.1))
    for F in (None, 0.0):
        assert_refused_or_corrected(liar.run(problem, [at(far, F)]))
        assert liar.run(problem, [at(near, F)]).solved, "a tenth of it is near enough"


def plain_zero(seed):
    """A problem and a z whose w = 0 as floating point sums it, with errors of 1e-3 of
    q."""
    matrix = np.array([[0.1, -0.1], [-0.1, 0.1 * (1 + 1e-13)]])
    large = 1e14 * (1 + default_rng(seed).random())
    z = np.array([large + 10, large])
    q = -product(matrix, z)
    assert not (product(matrix, z) + q).any()
    return Problem(matrix, q), z.tolist()


def along(slope, distance, gap):
    """z_1 - z_2 >= 1 and (1 + slope) z_2 >= z_1, with large z; a z at that distance
    from the solution, and off row 1 by the gap."""
    problem = Problem([[1, -1], [-1, 1 + slope]], [-1, 0])
    solution = exact.solution(problem)
    z2 = float(solution[1]) + distance
    return problem, [z2 + 1 + gap, z2]


NEAR = {
    **{f"zero by rounding errors {seed}": plain_zero(seed) for seed in range(2)},
    "wrong in the 14th digit": along(1e-6, 0.0, 1e-8),
    "wrong in the 14th digit of very large numbers": along(1e-10, 1e-4, 2e-6),
    "near a bound far from zero": (
        Problem([[1, 0], [1e-3, 1]], [-1000.1, -1e6], lower=[1000, 0]),
        [1000.1 + 1e-8, 1e6 - 1.0001],
    ),
    "on the bounds as wrong as before": (
        Problem(np.eye(2), [-1, 5e-9]),
        [1 + 1e-9, 1e-12],
    ),
}


@pytest.mark.parametrize("name", NEAR)
def test_point_that_nearly_looks_like_a_solution_is_refused(name, liar):
    problem, z = NEAR[name]
    for F in (None, 0.0):
        assert_refused_or_corrected(liar.run(problem, [at(z, F)]))


# Without solution; from a point in a direction.
NOWHERE = {
    "difference": (Problem([[1, -1], [-1, 1]], [-1, 0.5]), [0.75, 0], [1, 1]),
    "free variables": (
        Problem([[0, 1], [-1, 0]], [1, 1], lower=None, upper=[np.inf, -2]),
        [1, -2],
        [0, -1],
    ),
    "rows that exclude each other": (
        from_qp(
            None,
            [1, 1],
            [[1, -1], [1, -1]],
            row_lower=[2, -np.inf],
            row_upper=[np.inf, 1],
        ),
        [1.5, 0, 0, 0],
        [1, 1, 0, 0],
    ),
    "unbounded": (
        from_qp(None, [-2, 1], [[1, -1]], row_upper=1),
        [1, 0, 0],
        [1, 1, -1],
    ),
}


@pytest.mark.parametrize(("F", "iterates"), [(None, False), (0.0, True)])
@pytest.mark.parametrize("name", NOWHERE)
def test_z_that_runs_off_to_infinity_solves_nothing(name, F, iterates, liar):
    problem, start, direction = NOWHERE[name]
    steps = [at(start + 10.0**k * np.array(direction), F) for k in range(0, 308, 7)]
    results = [liar.run(problem, [step]) for step in steps[::5]]
    for result in (
        liar.run(problem, steps, declaration={"iterates": iterates}),
        *results,
    ):
        # Proved while the doubt about a large z is settled.
        if result.status is Status.INFEASIBLE:
            assert exact.refutes(
                problem,
                [Fraction(value) for value in result.certificate.vector.tolist()],
            )
        else:
            assert_refused(result, "stalled", "diverged")


@pytest.mark.parametrize("name", PROBLEMS)
def test_point_that_is_not_finite_is_not_even_reported(name, liar):
    problem = PROBLEMS[name]
    solution = run(problem)
    x = problem.box.x_of(solution.z, solution.w)
    for value, F in (
        (math.nan, None),
        (math.inf, 0.0),
        (-math.inf, 0.0),
        (1.7e308, None),
        (1.7e308, 0.0),
    ):
        step = at(2 * x, F)
        for place in (0, slice(None)):
            wrong = x.copy()
            wrong[place] = value
            result = liar.run(problem, [step._replace(x=wrong)])
            if value > -math.inf or not problem.is_mixed:  # else it stands for a bound
                assert_refused(result, "breakdown" if math.isnan(value) else "stalled")
            assert np.isfinite(result.z).all()
        assert liar.run(problem, [step, step._replace(x=wrong)]).solved, (
            "by the iterate before"
        )


def test_claimed_residuals_decide_nothing(liar):
    """Neither about the best iterate and its measures nor about divergence, and a
    solution is one whatever F is."""
    problem = PROBLEMS["lcp"]
    for claims in ([0.0, 1.0, 1.0], [1.0, 1e300, math.inf], [math.nan, math.nan, 0.0]):
        steps = [at([k, 1.0], F) for k, F in enumerate(claims)]
        for iterates in (False, True):
            assert_refused(liar.run(problem, steps, declaration={"iterates": iterates}))
        assert liar.run(
            problem, [*steps, at([4 / 3, 7 / 3], 1e300)], declaration={"iterates": True}
        ).solved


def test_time_that_there_is_no_limit_on_is_not_up(liar):
    problem = PROBLEMS["lcp"]
    assert liar.run(problem, ending=OutOfTime()).status is Status.STALLED
    assert (
        liar.run(problem, ending=OutOfTime(), time_limit=60).status is Status.TIME_LIMIT
    )


@pytest.mark.parametrize("name", ["lcp", "mixed", "program"])
def test_basis_is_that_of_z_and_w_and_not_what_a_method_had_in_mind(name, liar):
    """An iterate x stands for states: here for those of another point, with every
    variable between its bounds."""
    problem = PROBLEMS[name]
    result = liar.run(problem, [at(problem.box.project(np.linspace(1, 2, problem.n)))])
    assert_refused(result)
    assert result.basis == in_words(problem.box.basis_at(result.z, problem.w(result.z)))
    solution = run(problem)
    claimed = liar.run(problem, [at(off_by(problem, solution.z, 1e-11))])
    assert claimed.solved
    assert claimed.basis == solution.basis


ULP = 2.0**-52
IDENTITY = np.eye(2)
TEXTBOOK = Problem([[0, -1], [1, 0]], [-1, -1])  # y = (1, 0)
SWAP = Problem([[0, 1], [1, 0]], [-1, 1])  # feasible without solution
# In any order of summation, with or without fused products.
COLUMN = np.array([7.7, -1.4, -6.232258064516128])
MANY = Problem(TRIDIAGONAL, -np.ones(30))
FREE = (-math.inf, math.inf)
BELOW = (0.0, math.inf)
ABOVE = (-math.inf, 0.0)
BOX = (0.0, 1.0)


def farkas(y):
    return NoSolution(
        Proof("farkas", None if y is None else np.asarray(y, dtype=float), LIE)
    )


def mixed(M, q, *bounds):
    lower, upper = zip(*bounds, strict=True)
    return Problem(M, q, lower=lower, upper=upper)


TILTED = [[1, -1, 0], [-1, 1 + ULP, 0], [0, 0, 1]]
CANCELLING = mixed(np.zeros((5, 5)), [1e16, 1, 1, -1e16 - 2, 1], *4 * [BELOW], BOX)
# What each y violates: without that condition, it would be a proof.
WRONG = {
    "q'y zero, negative by rounding": (
        Problem(-np.eye(4), [1e16, 1, 1, -1e16 - 2]),
        [1, 1, 1, 1],
    ),
    "M'y by rounding": (Problem([[1, -1], [-1, 1 + ULP]], [-1, 0]), [1, 1]),
    "M'y positive, negative by rounding": (
        Problem(np.outer(COLUMN, [1, 0, 0]), -(2.0**60) * COLUMN),
        [9.2, 9.2, 9.3],
    ),
    "nan": (TEXTBOOK, [1, math.nan]),
    "none": (TEXTBOOK, None),
    "length": (TEXTBOOK, [1, 0, 0]),
    "sign once corrected": (
        Problem([[1, -1, 0], [-1, 1 + 4 * ULP, 0], [0, 1e-20, 0]], [-1, 0, 0]),
        [1, 1, 2],
    ),
    "M'y once corrected": (
        Problem([[1, -1, 0], [-1, 1 + 4 * ULP, -10], [0, -1e-20, 1]], [-1, 0, 0]),
        [1, 1, 2],
    ),
    "q'y once corrected": (
        Problem([[1, -1, 0], [-1, 1 + 4 * ULP, 0], [0, -1e-20, 0]], [-1, 0, 1]),
        [1, 1, 0.5],
    ),
    "mixed: M'y by rounding": (
        mixed(TILTED, [-1, 0, -3], BELOW, BELOW, BOX),
        [1, 1, 0],
    ),
    "mixed: total zero, negative by rounding": (CANCELLING, [1, 1, 1, 1, 0]),
}


def is_proof(problem, y):
    return exact.refutes(problem, list(map(Fraction, y.tolist())))


def test_vectors_near_a_proof_are_believed_only_if_they_are_proofs_or_corrected(liar):
    found = Counter()
    for seed in range(80):
        M, q, lower, upper = integers(default_rng(seed), 3)
        problem = Problem(M, q, lower=lower, upper=upper)
        proof = run(problem).certificate
        if proof is None or proof.vector is None:
            continue
        for change in (0 * proof.vector, *np.eye(q.size), *-np.eye(q.size)):
            y = proof.vector + change
            result = liar.run(problem, ending=farkas(y))
            is_believed = result.status is Status.INFEASIBLE
            assert is_believed >= is_proof(problem, y)
            assert not is_believed or is_proof(problem, result.certificate.vector)
            found[is_believed] += 1
    assert min(found[True], found[False]) > 20


@pytest.mark.parametrize("name", WRONG)
def test_vector_that_proves_nothing_is_refused_in_rational_arithmetic_too(name, liar):
    problem, y = WRONG[name]
    result = liar.run(problem, ending=farkas(y))
    assert_refused(result)
    assert result.message == f"stalled: {UNVERIFIED['farkas']}"
    if y is not None and len(y) == problem.n and np.isfinite(y).all():
        fractions = [Fraction(value) for value in y]
        assert not lcpcli.check(problem, y=fractions).accepted
        assert not ExactProblem.of_floats(problem).refuted_by(fractions)
    if "corrected" in name and not problem.is_mixed:
        # Though rounding or a correction would spoil the vector.
        assert exact.feasible(problem)


def test_vector_that_is_wrong_in_other_variables_is_refused_in_all_of_them(liar):
    """Those of the equilibrated problem, of one with its reference point at 0, and of
    the standard form."""
    M, q = np.diag([2.0**40, 1.0]), [-1, -1]
    problems = [
        Problem(M, q),
        Problem(M, q, lower=[3, -1]),
        Problem(M, q, lower=[-1, 0], upper=[math.inf, 9]),
    ]
    for problem in problems:
        for vector in (np.ones, lambda n: -np.ones(n), np.zeros):
            for takes_bounds in (True, False):
                declaration = {"iterates": True, "takes_bounds": takes_bounds}
                result = liar.run(
                    problem,
                    [],
                    lambda own, v=vector: farkas(v(own.n)),
                    declaration,
                    scale=True,
                )
                assert_refused(result)
                assert result.message == f"stalled: {UNVERIFIED['farkas']}"


def test_true_proof_of_the_same_method_is_believed(liar):
    result = liar.run(TEXTBOOK, ending=farkas([1, 0]))
    assert result.status is Status.INFEASIBLE
    assert Proof("farkas", result.certificate.vector).holds(TEXTBOOK)
    # Through a standard form, in which integers remain integers.
    bounded = mixed(SWAP.M, SWAP.q, BELOW, (0.0, 9.0))
    result = liar.run(bounded, [], EXHAUSTED, {"takes_bounds": False})
    assert result.status is Status.UNSOLVABLE


EXHAUSTED = NoSolution(Proof("exhaustion", np.ones(2), LIE))
SOLVABLE = {
    "lcp": PROBLEMS["lcp"],
    "mixed": mixed(IDENTITY, [-1, -1], FREE, BOX),
    "program with a stationary point": from_qp([[-1, 0], [0, 1]], [-0.25, 1], upper=1),
    "twenty unknowns": Problem(np.eye(20) + 1, -np.arange(1.0, 21)),
}


@pytest.mark.parametrize("name", SOLVABLE)
def test_exhaustion_of_a_small_problem_with_a_solution_is_refused(name, liar):
    """Even if a method declares that its proofs are exact; through a standard form
    too."""
    for takes_bounds, excludes_exactly in itertools.product((True, False), repeat=2):
        declaration = {
            "excludes_exactly": excludes_exactly,
            "takes_bounds": takes_bounds,
        }
        result = liar.run(SOLVABLE[name], [], EXHAUSTED, declaration)
        assert_refused(result)
        assert result.message.startswith(
            ("stalled: the claim that every", "stalled: no solution was computed, and")
        )


def test_exhaustion_that_is_not_verified_is_believed_only_of_methods_that_declare_it(
    liar, monkeypatch
):
    declaring = [name for name, method in METHODS.items() if method.excludes_exactly]
    assert declaring == ["auto", "milp"], "which search all sets"
    for problem in (MANY, families.make("unsolvable", 24)):
        result = liar.run(problem, ending=EXHAUSTED)
        assert_refused(result)
        assert result.message == f"stalled: {UNVERIFIED['exhaustion']}"
    monkeypatch.setattr(certificate, "EXHAUSTION_EFFORT", 0.0)
    assert_refused(liar.run(SWAP, ending=EXHAUSTED))
    believed = liar.run(SWAP, [], EXHAUSTED, {"excludes_exactly": True})
    assert believed.status is Status.UNSOLVABLE
    assert believed.certificate.vector is None, "as a proof by exhaustion has none"


def test_no_proof_is_believed_against_a_point_that_solves_the_problem(liar):
    for problem in (SOLVABLE["lcp"], MANY):
        solution = at(lcpcli.run(problem).z)
        for ending in (
            EXHAUSTED,
            farkas(np.ones(problem.n)),
            NoSolution(Proof("ray", np.ones(problem.n), LIE)),
        ):
            result = liar.run(problem, [solution], ending, {"excludes_exactly": True})
            assert result.status == Status.SOLVED
            assert result.message == "solved"
            assert result.certificate is None


def test_a_solution_has_no_proof_up_to_rounding_beside_it(liar):
    """z_1 = z_2 = 2^52 is exact, and y = (1, 1) a proof but for the last bit of M; the
    point is looked at only once the method has ended."""
    M, q = np.eye(24), np.ones(24)
    M[:2, :2], q[:2] = [[1, -1], [-1, 1 + 2.0**-52]], [0, -1]
    z, y = np.zeros((2, 24))
    z[:2], y[:2] = 2.0**52, 1.0
    problem, proof = Problem(M, q), Proof("farkas", y, LIE, is_rounded=True)
    assert proof.holds(problem)
    steps = [*[at(0 * z, 1.0)] * 2, at(z, 1.0)]
    result = liar.run(problem, steps, NoSolution(proof))
    assert result.status == Status.SOLVED
    assert result.certificate is None


RAYS = {
    "zero": (TEXTBOOK, [0, 0]),
    "negative": (TEXTBOOK, [0, -1]),
    "not complementary": (Problem([[2, 1], [1, 3]], [-5, -6]), [1, 1]),
    "not complementary, as w falls unevenly": (
        Problem(np.diag([-1, -2]), [-1, -1]),
        [1, 1],
    ),
    "nan": (TEXTBOOK, [1, math.nan]),
    "length": (TEXTBOOK, [1, 0, 0]),
    "overflow": (Problem(1e300 * IDENTITY, [-1, -1]), [1e300, 1]),
    "beyond a bound": (mixed(np.zeros((2, 2)), [-1, -1], BOX, BELOW), [1, 0]),
    "many unknowns": (MANY, [1.0] * 30),
}


@pytest.mark.parametrize("name", RAYS)
def test_ray_that_is_none_is_refused(name, liar):
    problem, z = RAYS[name]
    result = liar.run(
        problem,
        [at(np.full(problem.n, 0.5))],
        NoSolution(Proof("ray", np.array(z), LIE)),
    )
    assert_refused(result)
    assert result.message == f"stalled: {UNVERIFIED['ray']}"


def test_ray_proves_nothing_whatever_a_method_says(liar):
    """Along (1, 0) w = Mz does not change; the first problem has a solution, and its M
    is semidefinite."""
    for problem, z in (
        (Problem([[0, 0], [0, 1]], [1, -1]), np.array([1.0, 0.0])),
        (MANY, None),
    ):
        result = liar.run(problem, ending=NoSolution(Proof("ray", z, LIE)))
        assert result.status == Status.RAY
        assert result.message == f"ended on a ray: {RAY}"
        assert LIE not in result.to_json()
