"""Proofs of infeasibility, with bounds too: never believed about a feasible problem,
found for infeasible ones in any units, also where rounding, or one wrong sign, would
turn them into false ones. Certificates and rays hold exactly as they are printed and
written, in whole numbers, for numbers of all sizes, whatever the way in.
"""

import json
import random
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Solver, from_qp, run, solve
from lcpcli.formulations.quadratic_program.no_minimum import Constraints
from lcpcli.interrupts import TimeIsUp
from lcpcli.model.box import ORTHANT, Box
from lcpcli.model.problem import conditions_of
from lcpcli.rational import elimination
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.tree import first_solution
from lcpcli.report import result_formats
from lcpcli.solving import proof as solving
from lcpcli.verify.alternative import FarkasSystem, farkas_multipliers
from lcpcli.verify.certificate import Proof, first_proof
from lcpcli.verify.enclosure import SIGNS, enclosure, why_unproved
from lcpcli.verify.farkas import exact_proof, refutes

from .. import exact
from ..methods.programs import random_program
from ..seeds import few_of, parts

INF = np.inf
INFEASIBLE = Problem([[0, -1], [1, 0]], [-1, -1])
ULP = 2.0**-52


def farkas(problem):
    return first_proof(problem, farkas_multipliers(problem))


def test_a_proof_may_have_any_length_and_little_room_left_by_rounding():
    assert all(
        Proof("farkas", np.array([size, 0.0])).holds(INFEASIBLE)
        for size in (1.0, 1e-300, 1e300, 5e-324)
    )
    for entry, size in ((1e-200, 1e-200), (1e300, 1e300)):
        M = [[-entry, 0], [0, 1]]
        assert Proof("farkas", np.array([size, 0.0])).holds(Problem(M, [-entry, 0]))
    assert Proof("farkas", np.ones(2)).holds(Problem([[1, -1], [-1, 1]], [-1, 0]))
    assert Proof("farkas", np.ones(2)).holds(Problem([[1, -1], [-1, 1 - ULP]], [-1, 0]))


# Both free columns vanish for y = (1, 1.9, -1) alone, and nearly for (1, 1.9, 1)
NEARLY = 2.0**-29
PAIR = np.array([[1, -1 / 1.9 + NEARLY], [1, -1 / 1.9 - NEARLY]])
# (M'y)_1 is 2^-60 for y = (0, 1, 1, 1), 0 in doubles, and z1 goes up to 2^66.
FAR = np.zeros((4, 4))
FAR[1:, 0], FAR[1:, 1], FAR[1:, 2] = (1, 2.0**-60, -1), (1, -1, 0), (-1, 0, 1)
FEASIBLE = {
    "solutions as large as 1 / eps": (
        Problem([[1, -1], [-1, 1 + ULP]], [-1, 0]),
        [1, 1],
    ),
    "M'y of 1e-400": (Problem([[0, -1], [1e-200, 0]], [0, -1]), [1, 1e-200]),
    "columns of free variables that nearly vanish": (
        Problem(
            np.column_stack(
                (np.vstack((PAIR.T, PAIR.T[0] + 1.9 * PAIR.T[1])), [-1, -1, 0])
            ),
            [-1, -1, 0],
            lower=[-INF, -INF, 0],
        ),
        [1, 1.9, 1],
    ),
    "the least deviation of the column of a free variable": (
        Problem([[1, 1], [-1 - ULP, -1]], [-1, 0], lower=[-INF, 0]),
        [1, 1],
    ),
    "a far bound beside what doubles lose": (
        Problem(FAR, [0, -1, 0, 0], upper=[2.0**66, INF, INF, INF]),
        [0, 1, 1, 1],
    ),
}


@pytest.mark.parametrize("name", FEASIBLE)
def test_what_rounding_hides_of_a_feasible_problem_makes_no_proof(name):
    problem, y = FEASIBLE[name]
    assert not exact.refutes(problem, list(map(Fraction, y)))
    assert not Proof("farkas", np.array(y, dtype=float)).holds(problem)
    assert not refutes(problem.M, problem.q, np.array(y, dtype=float), problem.box)


def chain(excess, largest):
    """x_0 = 1, x_i = r_i x_{i-1} and x_59 <= (1 - excess) r_1 ... r_59, with |x_i| <=
    largest."""
    ratios = default_rng(0).integers(5, 12, 59) / 8
    rows = csr_array(np.vstack((np.eye(60) - np.diag(ratios, -1), np.eye(60)[-1])))
    values, end = np.eye(60)[0], (1 - excess) * float(np.prod(ratios))
    low, high = np.append(values, -np.inf), np.append(values, end)
    return from_qp(
        None,
        np.zeros(60),
        rows,
        row_lower=low,
        row_upper=high,
        lower=-largest,
        upper=largest,
    )


@pytest.mark.parametrize("largest", [np.inf, 100.0])
def test_program_infeasible_by_a_millionth_is_proved_so(largest):
    """Without bounds, y has to vanish exactly in 60 columns, where it is corrected by
    FLINT."""
    if largest == np.inf:
        pytest.importorskip("flint")
    assert farkas(chain(1e-6, largest)) is not None
    assert farkas(chain(-1e-6, largest)) is None


def test_proofs_are_found_where_the_first_linear_program_fails(monkeypatch):
    monkeypatch.setattr(FarkasSystem, "least_total", lambda _: None)
    found = (
        farkas(problem) is not None
        for problem in (INFEASIBLE, chain(1e-6, 100.0), chain(-1e-6, 100.0))
    )
    assert list(found) == [True, True, False]


@pytest.mark.parametrize("seeds", parts(15, 160))
def test_every_infeasible_random_problem_is_proved_so_and_no_feasible_one(seeds):
    """In any units, dense and sparse."""
    for seed in seeds:
        problem = exact.random_problem(seed)
        given = Problem(csr_array(problem.M), problem.q) if seed % 3 == 0 else problem
        assert (farkas(given) is None) == exact.feasible(problem), problem.name


def test_problem_beyond_the_range_of_floats_when_equilibrated_has_no_proof():
    assert farkas(Problem([[0, 1e-308], [1e308, 0]], [-1e308, 1e-308])) is None


def test_a_contradiction_by_less_than_rounding_is_not_clear():
    # z1 >= 2 + 1e-12.
    problem = Problem([[0, 0], [1, 0]], [0, -2 - 1e-12], lower=[0, 0], upper=[2, INF])
    assert not Proof("farkas", np.array([0.0, 1.0])).is_clear(problem)


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_enclosure_holds_an_exact_solution(seed):
    random = default_rng(seed)
    k, n = int(random.integers(1, 6)), int(random.integers(6, 12))
    G = random.integers(-9, 10, (k, n)) * np.exp2(random.integers(-30, 30, n))
    y = np.linalg.svd(G)[2][-1]
    d = enclosure(G, y)
    changed = np.flatnonzero(d)
    rows = [
        [*(row[j] for j in changed), exact.dot(row, map(Fraction, y.tolist()))]
        for row in np.vectorize(Fraction, otypes=[object])(G).tolist()
    ]
    found = exact.solved(rows, changed.size)
    assert (np.abs(found) <= d[changed]).all()


def test_a_proof_nearby_has_the_signs_of_multipliers_too():
    """A'y = 0 asks for y_3 = -1e-9, so that y_3 = 5e-9 is near no proof: z = (-2e9,
    2e9 + 1.5) is feasible."""
    A = np.array([[1.0, 1.0], [-(1 + 1e-9), -1.0], [0.0, 1.0]])
    b, z = np.array([-1.0, 0.0, 0.0]), np.array([-2e9, 2e9 + 1.5])
    assert (A @ z + b >= 0).all()
    box = Box(np.array([-INF, 0.0]), np.full(2, INF))
    assert not refutes(A, b, np.array([1.0, 1.0, 5e-9]), box, ORTHANT)


def test_products_that_underflow_hide_the_sign_of_their_sum():
    """(A'y)_1 = 2e-324 is positive, and -5e-324 in doubles; z = 5e123 is feasible."""
    A = np.array([[2e-124], [2e-124], [2e-124], [-4e-124]])
    b, z = np.array([-1.0, -1.0, -1.0, 2.2]), np.array([5.2e123])
    assert (A @ z + b >= 0).all()
    y = np.full(4, 1e-200)
    assert (A.T @ y).item() < 0
    assert not refutes(A, b, y, ORTHANT, ORTHANT)


@pytest.mark.parametrize(
    ("q", "upper", "reason"),
    [
        ([-1, -1 + 1e-5], INF, ""),
        ([-1, -1 - 1e-7], INF, SIGNS.format(2)),
        ([-1, -1 + 1e-5], 1 - 1e-7, SIGNS.format(1)),
    ],
)
def test_no_solution_is_shown_where_the_distance_to_it_may_change_a_sign(
    q, upper, reason
):
    """z_1 is 1 - 1e-6, and 1 where w_1 = 0: that changes w_2, or is beyond a bound."""
    problem = Problem([[1, 0], [1, 1]], q, upper=[upper, INF])
    for z in (np.array([1 - 1e-6, 0.0]), np.array([1 + 1e-6, 0.0])):
        if z[0] < upper:
            assert why_unproved(problem, z, 1e-4) == reason


@pytest.mark.parametrize(("upper", "is_ray"), [(INF, True), (5, False)])
def test_a_ray_does_not_lead_beyond_a_bound(upper, is_ray):
    problem = Problem([[0]], [0], upper=[upper])
    assert Proof("ray", np.ones(1)).holds(problem) == is_ray


@pytest.mark.parametrize(("high", "holds"), [(1 + 5e-6, True), (1 - 5e-7, False)])
def test_sides_hold_near_a_point_wherever_the_enclosure_moves_it(high, holds):
    """x = 1 follows from the equation, and is 1 - 1e-6 here."""
    sides = Constraints(np.ones((2, 1)), np.array([1, -INF]), np.array([1, high]))
    assert sides.hold_near(np.array([1 - 1e-6])) == holds


def test_dependent_equations_and_too_many_have_no_enclosure():
    for shape in (2, 3), (3, 2):
        assert enclosure(np.ones(shape), np.ones(shape[1])) is None


@pytest.mark.parametrize("seed", few_of(range(6), 3))
def test_no_infeasible_program_is_said_to_have_a_point(seed):
    """Not even near points that violate one constraint by little."""
    problem = random_program(2 * seed, 30, "infeasible").problem()
    sides = Constraints.of(problem.origin.blocks(conditions_of(problem)))
    low = np.nan_to_num(sides.low, neginf=0.0)
    x = np.linalg.lstsq(
        np.asarray(sides.A @ np.eye(sides.A.shape[1])), low, rcond=None
    )[0]
    assert sides.central_point() is None
    assert not sides.hold_near(x)


@pytest.mark.parametrize("n", [20, 160])
def test_no_vector_is_corrected_where_it_takes_long(n, monkeypatch):
    """In double precision n numbers of each row have 53 bits: a system of 160 takes
    seconds, and an interior point method tests many vectors."""
    taken = []
    monkeypatch.setattr(
        elimination,
        "particular",
        lambda *given: taken.append(given),  # which returns that there is none
    )
    M = default_rng(0).standard_normal((n, n))
    y = np.ones(n)
    M[0] -= y @ M  # M'y is almost 0
    free = Box(np.full(n, -np.inf), np.full(n, np.inf))
    assert not refutes(M, -y, y, free)
    assert len(taken) == (n == 20)


def test_farkas_vector_is_corrected_where_no_double_fits():
    """3 y1 = y2 is asked for with a y1 that is no multiple: only the corrected vector
    has M'y = 0."""
    y = np.array([np.pi, 3 * np.pi * (1 + 1e-12)])
    assert (
        exact_proof(ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 1])), y)
        is None
    )  # q'y = 2 y1 > 0
    data = ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 0.25]))
    found = exact_proof(data, y)
    assert data.refuted_by(found)
    assert found[1] == 3 * found[0]


def test_farkas_vector_is_found_where_rounding_has_made_columns_independent():
    """As doubles 0.1 and 0.3 make M nonsingular: M'y = 0 has no solution, M'y < 0
    has."""
    data = ExactProblem.of_floats(Problem([[1, 3], [-0.1, -0.3]], [-1, 0]))
    assert data.refuted_by(exact_proof(data, np.array([0.1, 1.0])))


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_an_enclosure_is_as_wide_as_the_solution_is_far_in_the_units_of_y(size):
    """y1 = y2 takes a change of at least |y1 - y2|."""
    y = size * np.array([1.0, 1.25, 3.0])
    change = enclosure(np.array([[1.0, -1.0, 0.0]]), y)
    assert 0.25 * size <= change[:2].sum() <= 0.6 * size
    assert change[2] == 0


def test_each_violation_is_named():
    problem = Problem(
        np.eye(4), [-1, -1, 1, 0], lower=[0, None, -2, 1], upper=[2, 0.5, 2, 1]
    )
    verified = lcpcli.check(problem, [-1, 1, 0, 5])
    found = [(violation.index, violation.kind) for violation in verified.violations]
    assert sorted(found) == [
        (0, "z < lower"),
        (1, "z > upper"),
        (2, "w > 0"),
        (3, "z > upper"),
    ]
    assert verified.backward_error == np.inf
    assert lcpcli.check(problem, [1, 0.5, -1, 1]).accepted


def whole(values):
    assert all(value == int(value) for value in values), values
    return [Fraction(value) for value in values]


def test_proof_in_integers_leaves_columns_of_bounded_variables_that_nearly_vanish():
    """y = (b, a, 0) is 0 in the first column exactly, and in the third one 1e-9 of its
    terms, which cannot both be 0; but the third variable is between 0 and 1."""
    a, b = 1234567891.0, 987654323.0
    M = [[a, -1, 1 / b], [-b, -1, (1e-9 - 1) / a], [0, 0, 1]]
    problem = Problem(M, [-2, 1, 0], lower=[-np.inf, 0, 0], upper=[np.inf, np.inf, 1])
    found = first_proof(problem, [np.array([b, a, 0]) / a], whole=True)
    assert exact.refutes(problem, whole(found.vector.tolist()))


def test_proof_for_integers_is_one_for_the_decimals_that_they_are_made_of(monkeypatch):
    """Rows with different denominators, and a run that has found nothing; without the
    search at the end."""

    def late(_):
        raise TimeIsUp

    monkeypatch.setattr(solving, "Effort", late)
    problem = Problem([[0.1, -0.7], [-0.001, 0.007]], [-1, 0.0099])
    lost = lcpcli.run(problem, "shi", max_iterations=0)
    found = solving.prove(lambda: ExactProblem.of_decimals(problem), lost).exact
    assert found.y == [1, 100]


# Seeds for which rounding leaves some z >= 0 with Mz + q >= 0.
ROUNDED_TO_FEASIBLE = (9, 13, 24, 27, 36, 50)


def infeasible(seed):
    """Return a problem with a row of negative numbers, or two rows that contradict each
    other."""
    rng = random.Random(seed)
    n, span = rng.randint(1, 4), rng.choice((10, 100, 300))

    def number():
        sign = rng.choice((0, -1, 1))
        return sign * float(
            f"{rng.uniform(1, 10):.{rng.choice((0, 2, 16))}f}"
            f"e{rng.randint(-span, span)}"
        )

    M = [[number() for _ in range(n)] for _ in range(n)]
    q = [number() for _ in range(n)]
    a, b = rng.randrange(n), rng.randrange(n)
    if a == b:
        M[a] = [-abs(value) for value in M[a]]
    else:
        factor = 10.0 ** rng.randint(-span // 2, span // 2)
        M[b] = [max(min(-factor * value, 1e305), -1e305) for value in M[a]]
    q[a], q[b] = -abs(q[a]) or -1e-10, -abs(q[b]) or -1.0
    return Problem(M, q)


@pytest.mark.parametrize(
    "seed",
    few_of((seed for seed in range(0, 60, 2) if seed not in ROUNDED_TO_FEASIBLE), 5),
)
def test_what_is_written_proves_exactly_what_it_claims(seed):
    pytest.importorskip("flint")
    problem = infeasible(seed)
    for result in (run(problem, time_limit=120), lcpcli.exact(problem, time_limit=120)):
        held = json.loads(result_formats.line(result_formats.data(result)))
        if held["status"] == "infeasible":
            y = [Fraction(value) for value in held["certificate"]["vector"]]
            of_decimals = result.exact is None and exact.refutes(
                problem, y, as_written=True
            )
            assert of_decimals or exact.refutes(problem, y)
    # Of 44, the shortest decimals are feasible, and only as a whole without solution.
    assert held["status"] == "infeasible" or (seed, held["status"]) == (
        44,
        "unsolvable",
    )


def test_long_proof_says_that_it_is_rounded_unless_doubles_show_it():
    """y = (1, ..., 1) proves the first; the y of the second makes M'y vanish, but for
    rounding."""
    rng = default_rng(0)
    clear = run(Problem(-rng.uniform(1, 2, (200, 200)), -np.ones(200)), "auto")
    A = rng.standard_normal((150, 60))
    M = np.hstack((A, -A, np.zeros((150, 30))))
    long = run(Problem(M, -np.abs(rng.standard_normal(150))), "auto")
    for result, is_said in ((clear, False), (long, True)):
        assert result.certificate.statement.endswith("up to rounding of y") == is_said
        y = fractions_of(result.certificate.vector)
        assert is_said or ExactProblem.of_floats(result.problem).refuted_by(y)


SWAP = np.array([[0.0, 1.0], [1.0, 0.0]])
NONE = {"INFEASIBLE", "UNSOLVABLE"}


def without_solution():
    """Return a feasible problem without a solution, of 17 unknowns, whose bounds make q
    round in other variables."""
    random, n, m = default_rng(5), 17, 6
    A = random.integers(-2, 3, (n - m, n - m))
    coupling = random.integers(-1, 2, (n - m, m))
    M = np.block(
        [
            [np.kron(np.eye(m // 2), SWAP), np.zeros((m, n - m))],
            [coupling, A @ A.T + np.eye(n - m)],
        ]
    )
    q = np.append(
        np.tile([-1.0, 1.0], m // 2), random.integers(-9, 10, n - m)
    ) - M @ np.full(n, 0.1)
    lower, upper = np.full(n, 0.1), np.full(n, np.inf)
    lower[m : m + 3], upper[m + 3 : m + 6] = -np.inf, 0.7
    lower[m + 4], upper[m + 1], lower[m + 6], upper[m + 6] = -np.inf, 3.3, 0.3, 0.3
    return Problem(M, q, lower=lower, upper=upper)


WAYS = {
    **{name: partial(solve, method=name) for name in ("auto", "milp")},
    "sparse": lambda M, q, **bounds: solve(csr_array(M), q, **bounds),
    "Solver": lambda M, q, **bounds: Solver(M, **bounds).solve(q),
    "exact": lambda M, q, **bounds: lcpcli.exact(Problem(M, q, **bounds)),
}


@pytest.mark.parametrize("way", WAYS)
def test_no_way_in_loses_the_proof(way):
    problem = without_solution()
    result = WAYS[way](problem.M, problem.q, lower=problem.lower, upper=problem.upper)
    assert result.status.name == "UNSOLVABLE"
    assert way not in ("auto", "milp") or result.certificate.kind == "exhaustion"


def test_the_tree_of_milp_agrees_with_that_in_rational_arithmetic_for_any_bounds():
    random = default_rng(11)
    for _ in range(15):
        n = int(random.integers(2, 8))
        M = random.integers(-3, 4, (n, n)) * (random.random((n, n)) < 0.7)
        kind = random.integers(0, 5, n)
        lower = np.where(np.isin(kind, (0, 3)), -0.3, np.where(kind == 4, 0.7, -np.inf))
        upper = np.where(
            kind == 1, 1.1, np.where(kind == 3, 2.3, np.where(kind == 4, 0.7, np.inf))
        )
        problem = Problem(M, random.integers(-4, 5, n), lower=lower, upper=upper)
        status = run(problem, "milp").status
        z = first_solution(ExactProblem.of_floats(problem), lambda: None)
        assert status.name in ({"SOLVED"} if z else {"SOLVED", *NONE})
        assert z or status.name in NONE or run(problem).solved, (
            "a solution but for rounding"
        )
        record = json.loads(run(problem).to_json())
        if record["status"] == "infeasible":
            y = whole(record["certificate"]["vector"])
            assert exact.refutes(problem, y)


@pytest.mark.parametrize("decimals", [0, 1, 16])
def test_proofs_are_small_integers_where_there_is_room_to_round(decimals):
    random = default_rng(decimals)
    for n in (5, 15, 30):
        M = np.round(random.uniform(-5, 3, (n, n)), decimals)
        q = np.round(random.uniform(-9, 5, n), decimals)
        result = run(Problem(M, q))
        assert result.status.name == "INFEASIBLE"
        y = result.certificate.vector
        assert (y == np.rint(y)).all()
        assert y.max() <= 64


def test_a_simple_proof_replaces_a_long_one_but_not_what_proves_nothing():
    problem = Problem([[1, -2], [-2, 1]], [1, -1])
    found = first_proof(problem, [np.array([51.0, 58.0])], whole=True)
    assert found.vector.max() < 10
    assert first_proof(problem, [np.array([1.0, 0.0])], whole=True) is None
    found = lcpcli.exact(problem)
    assert max(map(abs, found.exact.y)) <= Fraction(2)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_multiplier_of_the_other_sign_proves_nothing(side):
    """z <= 0 solves w = z - 1 <= 0, and z >= 0 solves w = z + 1 >= 0."""
    lower, upper = (-np.inf, 0) if side > 0 else (0, np.inf)
    problem = Problem([[1]], [-side], lower=lower, upper=upper)
    assert not Proof("farkas", np.array([side])).holds(problem)
