"""Numbers anywhere in double range: every run ends in a status that is true, without a
warning or an exception, and what a host program asks numpy to raise changes no result.
Problems of few unknowns are decided where doubles leave it open, in exact arithmetic.
"""

import math
import warnings
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Status, Trace, solve
from lcpcli.errors import LCPError
from lcpcli.gallery import families
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.verify.error_theorems import error_bound
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import verify

from .. import exact, exact_measure

SPECIAL = [
    0.0,
    1.0,
    -1.0,
    5e-324,
    -5e-324,
    1e-310,
    2.3e-308,
    -1e-300,
    1e-150,
    1e150,
    -1e150,
    1e300,
    1.7e308,
    -1.7e308,
]


@np.errstate(all="ignore")
def data(seed):
    """M and q of at most four unknowns, which the oracle decides at once: an ordinary
    problem, in units far apart, with M of one size and q of another, or
    ill-conditioned; or every entry of a size of its own, or zeros, ones, subnormals and
    the ends of double range."""
    random = default_rng(seed)
    n, kind, special = (int(random.integers(most)) for most in (4, 6, 12))
    problem = exact.random_problem(int(random.integers(2**31)), n + 1)
    M, q, n = problem.M, problem.q, problem.n
    powers = random.integers(-1000, 1000, 2).astype(float)
    if kind == 1:
        R, C = np.exp2(np.rint(powers.max() / 2 * random.uniform(-1, 1, (2, n))))
        M, q = R[:, np.newaxis] * M * C, R * q
    elif kind == 2:
        M, q = M * np.exp2(powers[0]), q * np.exp2(powers[1])
    elif kind == 3:
        spread = int(random.choice([10, 40, 150, 300]))  # decades on either side of 1
        M, q = (
            random.standard_normal(shape)
            * 10.0 ** random.uniform(-spread, spread, shape)
            for shape in ((n, n), n)
        )
        M = np.where(np.eye(n) * random.integers(2), np.abs(M), M) * (
            random.random((n, n)) < 0.8
        )
    elif kind == 4:
        M, q = random.choice(SPECIAL, (n, n)), random.choice(SPECIAL, n)
    elif kind == 5:
        Q = np.linalg.qr(random.standard_normal((n, n)))[0]
        M = (Q * 10.0 ** random.uniform(-16, 0, n)) @ Q.T
        growing = (
            np.eye(n) - 10.0 ** random.uniform(0, 12) * np.tril(np.ones((n, n)), -1),
            -np.ones(n),
        )
        M, q = growing if special % 2 else (0.5 * (M + M.T), random.standard_normal(n))
    q = {0: np.abs(q), 1: np.zeros(n)}.get(special, q)
    M = np.zeros((n, n)) if special == 2 else M
    return np.clip(M, -1.7e308, 1.7e308), np.clip(q, -1.7e308, 1.7e308)


def is_solution_rounded(problem, z):
    """Whether z is an exact solution, each component of it to within a few units of the
    last digit."""
    M, q = exact.rational(problem)
    inside = np.flatnonzero(z > 0).tolist()
    z_P = exact.regular(
        [[M[i][j] for j in inside] for i in inside], [-q[i] for i in inside]
    )
    if z_P is None:
        return False
    right = dict(zip(inside, z_P, strict=True))
    near = all(
        abs(Fraction(z[i].item()) - value) <= abs(value) / 2**50
        for i, value in right.items()
    )
    return near and exact.solves(
        problem, [right.get(i, Fraction(0)) for i in range(z.size)]
    )


ADDED = [
    {},
    {"scale": True},
    {"finish": True},
    {"scale": True, "finish": True},
]
ITERATIONS = [
    {},
    {"omega": "auto"},
    {"anderson": 5},
    {"omega": "auto", "anderson": 5},
]
VARIANTS = [
    *((method, {}) for method in ("auto", "newton", "lemke", "milp")),
    *(("shi", added) for added in ADDED),
    *(("fixed-point", added | own) for added in ADDED for own in ITERATIONS),
]
LIMITS = Limits(max_iterations=200, time_limit=5.0)
TOL = 1.01e-10

seeds = st.integers(0, 2**32 - 1)


def check(result, problem):
    """What a run says of a problem is so, by exact arithmetic; `problem` is the same in
    rows."""
    assert np.isfinite(result.z).all()
    assert (result.z >= 0).all()
    assert not np.isnan(result.w).any()
    assert not math.isnan(result.residual + result.relative_residual)
    assert (
        min(
            result.iterations,
            result.evaluations,
            result.setup_seconds,
            result.solve_seconds,
        )
        >= 0
    )
    if result.solved:
        if "with the numbers as stored" in result.message:
            problem = without_sides_of_empty_rows(problem)
        small = exact_measure.relative_residual(problem, result.z) <= TOL
        assert small or is_solution_rounded(problem, result.z)
    if result.status is Status.INFEASIBLE:
        assert not exact.feasible(problem)
    if result.status is Status.UNSOLVABLE:
        assert exact.solution(problem) is None
    if (problem.q >= 0).all():
        assert result.solved
        assert result.iterations <= 1


def without_sides_of_empty_rows(problem):
    """The problem that is solved where such a side is said to have no solution."""
    assert isinstance(problem.M, np.ndarray)
    has_none = ~problem.M.any(axis=1) & (problem.q < 0)
    assert has_none.any()
    return Problem(problem.M, np.where(has_none, 0.0, problem.q))


@pytest.mark.slow("400 random problems, each against exact arithmetic")
@settings(deadline=None, max_examples=400)
@given(
    seed=seeds,
    as_sparse=st.booleans(),
    variant=st.sampled_from(VARIANTS),
    p=st.none() | st.floats(-3, 308).map(lambda power: 10.0**power),
    traced=st.booleans(),
)
def test_every_method_ends_in_a_true_status(seed, as_sparse, variant, p, traced):
    method, options = variant
    M, q = data(seed)
    given_M, given_q = csr_array(M) if as_sparse else M.copy(), q.copy()
    trace = Trace() if traced else None
    chosen = options | ({"p": p} if method == "shi" else {})
    result = run(
        Problem(given_M, given_q), method, limits=LIMITS, trace=trace, **chosen
    )
    check(result, Problem(M, q))
    assert np.array_equal(given_q, q)
    assert np.array_equal(given_M.toarray() if as_sparse else given_M, M)
    assert trace is None or all(
        row.residual is None or not math.isnan(row.residual) for row in trace.rows
    )


@pytest.mark.slow("many random problems, each against exact arithmetic")
@settings(deadline=None, max_examples=150)
@given(seed=seeds, as_sparse=st.booleans(), power=st.floats(-300, 300))
def test_auto_finds_every_solution_in_doubles_and_says_nothing_false(
    seed, as_sparse, power
):
    """z and w, that is; or a z whose residual is small, where the problem is so close
    to having a solution. Nearly always: 12 of 82,398 random ones end stalled, and say
    so."""
    M, q = data(seed)
    problem, plain = Problem(csr_array(M) if as_sparse else M, q), Problem(M, q)
    solution, result = (
        exact.solution(plain),
        run(problem, "auto", limits=Limits(time_limit=120.0)),
    )
    check(result, plain)
    if solution is not None:
        rows = zip(M.tolist(), q.tolist(), strict=True)
        w = [
            sum(
                (Fraction(a) * b for a, b in zip(row, solution, strict=True)),
                Fraction(value),
            )
            for row, value in rows
        ]
        normal, largest = (
            float(np.finfo(np.float64).smallest_normal),
            float(np.finfo(np.float64).max),
        )
        assert result.solved or not all(
            value == 0 or normal <= value <= largest for value in (*solution, *w)
        )
    for z in (result.z, 10.0**power * np.abs(np.sin(seed + np.arange(q.size)))):
        bound = error_bound(problem, z)
        if bound is not None and bound.proved:
            error = max(
                abs(Fraction(a) - b) for a, b in zip(z.tolist(), solution, strict=True)
            )
            assert error <= Fraction(bound.value)
        if verify(problem, z, 1e-10).accepted:
            assert is_near_a_solution(plain, z) or approximates(z, solution)


def approximates(z, solution):
    """Whether each component is that of the exact solution, to four digits; its rows
    hold by their own terms."""
    pairs = zip(z.tolist(), solution or (), strict=False)
    return solution is not None and all(
        abs(Fraction(a) - b) <= abs(b) / 10**4 for a, b in pairs
    )


def is_near_a_solution(problem, z):
    """Whether z, or the point near it that has components put on their bounds, has a
    small relative residual."""
    with np.errstate(all="ignore"):
        near = Point(Criterion(problem), z, is_admissible=False).alternatives()
        return any(
            exact_measure.relative_residual(problem, other) <= TOL
            for other in (z, *(each.z for each in near))
        )


@settings(max_examples=25)
@given(
    seed=seeds,
    kind=st.sampled_from(
        ["singular", "indefinite", "hollow", "z_matrix", "small_integers"]
    ),
)
def test_problem_without_solution_is_not_called_solved(seed, kind):
    """In units that exact arithmetic sees through, where z may run off to where its
    rounding hides the residual."""
    problem = exact.random_problem(seed, 4, kind)
    if exact.solution(problem) is None:
        rescaled = exact.rescaled(problem, np.random.default_rng(seed), 200)
        for each in (problem, rescaled):
            assert run(
                each, "auto", limits=Limits(time_limit=120.0)
            ).status.has_no_solution


def test_answer_that_is_there_ends_the_search():
    """Far eccentric bearings, and rows and columns in units up to 1e8 apart, leave a
    residual near the tolerance."""
    assert run(families.make("journal-bearing", 2500), "auto").route == ("elimination",)
    for seed in range(8):
        random, n = default_rng(seed), 30
        skew = random.standard_normal((n, n))
        (R, C) = 10 ** random.uniform(-8, 8, (2, n))
        result = solve(
            R[:, None] * (skew - skew.T + np.eye(n) / 10) * C,
            R * random.standard_normal(n),
        )
        assert result.solved
        assert "milp" not in result.route


def test_solutions_beyond_the_range_of_doubles_are_called_that():
    for M, q in (
        ([[1e-200]], [-1e200]),
        ([[1e-300, 1], [-1, 1e-300]], [-1e200, -1e250]),
        (np.diag([1e-200, 1]), [-1e200, -1]),
    ):
        result = run(Problem(M, q), "auto")
        assert result.status is Status.STALLED
        assert "there is a solution, but doubles cannot represent it" in result.message


VALUES = [
    0.0,
    1.0,
    -1.0,
    2.0,
    -3.0,
    1.7e308,
    -1e308,
    5e-324,
    1e-310,
    1e-300,
    -1e-200,
    1e200,
    1e150,
    -1e-150,
    1e16,
]
OF_RESULT = (
    "z",
    "w",
    "residual",
    "relative_residual",
    "basis",
    "digits",
    "advice",
    "to_dict",
    "to_json",
    "__repr__",
)
SECONDS = 0.05


def extreme_problem(random):
    n = int(random.choice([1, 3, 5, 22]))
    M = random.choice(VALUES, (n, n)) * (
        random.random((n, n)) < random.choice([0.3, 1.0])
    )
    np.fill_diagonal(M, np.abs(random.choice(VALUES[1:], n)))
    q, lower, upper = random.choice(VALUES, n), 0.0, np.inf
    if random.random() < 0.5:
        lower = random.choice([0, -np.inf, -1, -1e308, -5e-324], n)
        upper = np.where(
            random.random(n) < 0.5,
            np.inf,
            np.maximum(lower, random.choice([0, 5e-324, 1e308], n)),
        )
    return Problem(
        csr_array(M) if random.random() < 0.3 else M, q, lower=lower, upper=upper
    )


def use(problem, random):
    """Call what is public with a problem."""
    n = problem.n
    q, z = random.choice(VALUES, n), np.abs(random.choice(VALUES, n))
    result = lcpcli.run(problem, time_limit=SECONDS)
    for name in OF_RESULT:
        value = getattr(result, name)
        _ = value() if callable(value) else value
    functions = [
        lambda: lcpcli.run(
            problem,
            str(random.choice(["newton", "lemke", "shi", "interior"])),
            time_limit=SECONDS,
        ),
        lambda: lcpcli.check(problem, z),
        lambda: lcpcli.error_bound(problem, z),
        lambda: lcpcli.path(
            problem, Problem(problem.M, q, **problem.bounds), time_limit=SECONDS
        )(0.5),
        lambda: list(
            lcpcli.solve_many(
                problem.M, random.choice(VALUES, (n, 3)), time_limit=SECONDS
            )
        ),
        lambda: result.derivative(dq=q, one_sided=True).z,
        lambda: result.gradient(q).M,
        lambda: result.gradient(q).lower,
        lambda: lcpcli.exact(problem, time_limit=SECONDS),
    ]
    if n < 10:
        functions += [
            lambda: lcpcli.inspect(problem, 0.1),
            lambda: lcpcli.solutions(problem, time_limit=SECONDS),
        ]
    for function in functions:
        try:
            function()
        except LCPError:
            continue


HOSTS = (({"all": "raise"}, {0, 5, 8, 12, 24}), ({}, {1}))


@pytest.mark.parametrize(
    ("host", "seed"),
    [
        pytest.param(
            host,
            seed,
            marks=() if seed in quick else pytest.mark.slow("more of the same"),
        )
        for host, quick in HOSTS
        for seed in range(25)
    ],
)
def test_extreme_numbers_cause_no_warning_and_no_error_if_a_host_asks_for_them(
    host, seed
):
    random = default_rng(seed)
    with warnings.catch_warnings(), np.errstate(**host):
        warnings.simplefilter("error")
        use(extreme_problem(random), random)
