"""Small dense LCPs take a short way, in numpy or compiled: what it answers solves the
problem, and is what the loop over iterates answers; all else is left to that loop."""

import logging
import math
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem
from lcpcli.gallery import families
from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.methods import direct as module
from lcpcli.methods.direct import (
    BLOCK_PATIENCE,
    HASTY_PATIENCE,
    DirectAnswer,
    exchanges,
)
from lcpcli.model import problem as problems
from lcpcli.solving import direct_run
from lcpcli.solving.direct_run import exhausted
from lcpcli.verify import enclosure
from lcpcli.verify.measure import Measure

from .. import (
    exact,
    exact_measure,
    kernels_together,  # noqa: F401
    mixed_problems,
)
from ..direct_answers import direct
from .conftest import assert_same

TOL = 1e-10
compiled = pytest.importorskip("lcpcli.kernels.compiled")
loading = pytest.importorskip("lcpcli.kernels.loading")
kernels = pytest.importorskip("lcpcli.kernels.kernels")


def at_once(problem, tol):
    """The answer of `direct_many` to a batch of one."""
    data = problem.M[np.newaxis], problem.q[np.newaxis], np.array([problem.largest])
    z, found = module.direct_many(*data, tol, problem.box)
    return (
        DirectAnswer(z[0], found[0, 0] == module.CERTAIN, int(found[0, 1]))
        if found[0, 0] != module.NOTHING
        else None
    )


WAYS = {"numpy": direct, "compiled": compiled.direct, "at once": at_once}
of_each_way = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


@pytest.fixture(autouse=True)
def compiled_from_the_first_problem(monkeypatch):
    monkeypatch.setattr(direct_run, "uses_kernels", lambda *_: True)
    monkeypatch.setattr(direct_run, "MANY", 0)


def through_the_loop(problem, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(direct_run, "QUICK", ())
        return lcpcli.run(problem)


def definite(n, seed):
    return families.make("harker-pang", n, seed, symmetric=False)


@of_each_way
@settings(max_examples=25)
@given(
    matrix=st.integers(1, 6).flatmap(
        lambda n: arrays(float, (n, n), elements=st.integers(-4, 4))
    ),
    data=st.data(),
)
def test_what_is_certain_holds_in_exact_arithmetic(way, matrix, data):
    q = data.draw(arrays(float, len(matrix), elements=st.integers(-4, 4)))
    problem = Problem(matrix, q)
    answer = way(problem, TOL)
    if answer is not None and answer.is_certain:
        z = [Fraction(value) for value in answer.z.tolist()]
        caps = Measure(problem).caps(answer.z).tolist() if answer.z.any() else q
        for value, row, own, cap in zip(z, matrix.tolist(), q, caps, strict=True):
            products = [Fraction(entry) * z[j] for j, entry in enumerate(row)]
            w, terms = Fraction(own) + sum(products), sum(map(abs, (own, *products)))
            assert value >= 0
            violation = abs(w) if value > 0 else -w
            assert violation <= TOL * min(terms, max(cap, abs(own)))


@pytest.mark.parametrize("way", ["numpy", "compiled"])
@pytest.mark.parametrize("value", [0.0, 1e-12])
def test_zeros_and_tiny_entries_of_q_ask_for_no_units_of_M_and_no_exact_sums(
    value, way, monkeypatch
):
    rng = default_rng(0)
    A = rng.standard_normal((20, 20))
    M = A @ A.T / 20 + np.eye(20)
    asked = []
    units = problems.units
    monkeypatch.setattr(problems, "units", lambda *M: asked.append(M) or units(*M))
    certain = 0
    for _ in range(20):
        q = rng.standard_normal(20)
        problem = Problem(M, np.where(np.abs(q) > 0.5, q, value))
        with monkeypatch.context() as patch:
            patch.setattr(enclosure, "why_unproved", lambda *_: "not asked for")
            answer = WAYS[way](problem, TOL)
        certain += answer is not None and answer.is_certain
    assert asked == []
    # A z_i that is far smaller than others takes exact sums.
    assert certain == 20 or (value > 0 and certain >= 16)


@of_each_way
def test_its_answer_is_that_of_newton_and_a_nonnegative_q_needs_no_system(way):
    for n in (1, 2, 5, 20, 21, module.MAX_UNKNOWNS):
        problem = definite(n, n)
        answer = way(problem, TOL)
        result = lcpcli.run(problem, "newton", x0=-0.5 * problem.q)
        assert answer.steps == result.iterations
        assert np.allclose(answer.z, result.z, rtol=1e-10, atol=1e-12 * result.z.max())
    answer = way(Problem(np.triu(2 * np.ones((5, 5)), 1) + np.eye(5), -np.ones(5)), TOL)
    assert (answer.z.tolist(), answer.is_certain) == ([0, 0, 0, 0, 1], True), (
        "by the safeguard, as blocks cycle"
    )
    answer = way(Problem([[0, 1], [1, 0]], [1, 0]), TOL)
    assert answer.z.tolist() == [0.0, 0.0]
    assert answer.is_certain
    assert answer.steps == 0


def test_zeros_of_M_and_q_are_decided_by_units_that_are_known():
    M = 2.5 * np.eye(20) - np.eye(20, k=1) - np.eye(20, k=-1)
    q = default_rng(0).standard_normal(20)
    problem = Problem(M, np.where(np.abs(q) > 0.5, q, 0.0))
    assert not direct(problem, TOL).is_certain
    assert problem.units.parts == 1
    assert direct(problem, TOL).is_certain


def within_bounds(problem):
    with np.errstate(all="ignore"):
        return exhausted(module.exchanges_within_bounds(problem, TOL))


@pytest.mark.parametrize("seed", range(12))
def test_what_is_certain_within_bounds_solves_by_the_exact_measure(seed):
    generator = default_rng(seed)
    n = 2 + seed % 9
    M, q = mixed_problems.monotone(n, generator)
    lower, upper = mixed_problems.with_all_bounds(n, generator)
    if seed % 2:
        q, lower = np.rint(q), np.rint(lower * 1e3)
        upper = np.maximum(np.rint(upper), lower)
    problem = Problem(M, q, lower=lower, upper=upper)
    answer = within_bounds(problem)
    if answer is not None and answer.is_certain:
        assert exact_measure.relative_residual(problem, answer.z) <= TOL


def test_a_call_with_a_bound_is_judged_without_a_look_at_units_or_rows(monkeypatch):
    rng = default_rng(0)
    A = rng.standard_normal((20, 20))
    M = A @ A.T / 20 + np.eye(20)
    judged = []
    rows = Measure.rows
    monkeypatch.setattr(
        Measure, "rows", lambda *given: judged.append(given) or rows(*given)
    )
    monkeypatch.setattr(direct_run, "uses_kernels", lambda *_: False)
    for bound in ("lower", "upper"):
        bounds = {"lower": np.zeros(20), "upper": np.full(20, np.inf)}
        bounds[bound][0] = 0.5
        for _ in range(20):
            result = lcpcli.solve(M, rng.standard_normal(20), **bounds)
            assert result.solved
            assert result.route == ("newton",)
    assert judged == []


@pytest.mark.parametrize(
    ("M", "q"),
    [
        ([[1, 1], [0, 1e-9]], [-1 - 1e9, -1]),  # a z that hides another one in a row
        ([[1, -1], [1, 1]], [-3, -(2.0**53)]),  # integers that doubles round
    ],
)
def test_a_term_that_rounding_hides_is_solved_for_exactly_on_the_way(M, q):
    problem = Problem(M, q)
    answer, solution = direct(problem, TOL), exact.solution(problem)
    assert answer.z.tolist() == [float(value) for value in solution]


def test_exchanges_end_early_where_most_signs_stay_wrong_but_not_on_a_p_matrix():
    """The example of Murty takes about n block exchanges, with new minima all along."""
    for seed in range(5):
        steps = [*exchanges(families.make("gaussian", 60, seed), TOL)]
        assert len(steps) < 2 * HASTY_PATIENCE + 5
        assert direct(families.make("gaussian", 60, seed), TOL) is None
    answer = direct(families.make("murty", 20), TOL)
    assert answer.steps > BLOCK_PATIENCE


@pytest.mark.parametrize("distance", [3e-10, 1e-11, 1e-12])
def test_solved_means_a_small_residual_or_said_rounded_if_nearly_singular(distance):
    """Rounding of z, whose entries reach 10^10 and more, leaves a w of up to 10^-3
    where z > 0 and |q_i| = 1."""
    # More unknowns than those for which exact arithmetic decides.
    M, q = np.eye(21), -np.ones(21)
    M[:2, :2] = [[1.1, -0.3], [-0.3, 0.09 / 1.1 * (1 + distance)]]
    batches = [
        lcpcli.solve_many(np.array([M, M]), np.array([q, q]), compiled=fast)
        for fast in (False, True)
    ]
    for result in (lcpcli.solve(M, q), batches[0][0], batches[1][0]):
        assert result.solved
        assert (
            result.relative_residual <= TOL
            or "an exact solution with the basis of z is proved to exist"
            in result.message
        )


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_both_ways_and_the_loop_agree(seed):
    """Every third M is nonnegative, so that Lemke's path goes on where block pivoting
    ends. Where pivots are tied, as of integers, or within bounds, the ways may reach
    different solutions."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 7 if seed % 3 else 30))
    M = (
        generator.random((n, n)),
        generator.integers(-3, 4, (n, n)).astype(float),
        generator.standard_normal((n, n)),
    )
    q = generator.integers(-3, 4, n).astype(float) if seed % 3 else -generator.random(n)
    problem = Problem(
        M[seed % 3], q, lower=-float(seed % 2), upper=math.inf if seed % 5 else 2.0
    )
    with pytest.MonkeyPatch.context() as patch:
        results = [through_the_loop(problem, patch), lcpcli.run(problem)]
        patch.setattr(direct_run, "compiled", lambda: None)
        results.append(lcpcli.run(problem))
    assert len({result.status for result in results}) == 1
    assert all(result.relative_residual <= TOL for result in results if result.solved)
    if problem.box.is_orthant and seed % 3 != 1:
        same = {(result.route[0], result.iterations) for result in results[1:]}
        assert len(same) == 1
        assert np.allclose(results[1].z, results[2].z, rtol=1e-9, atol=1e-9)


@pytest.mark.usefixtures("way")
def test_a_result_has_what_the_loop_reports(monkeypatch):
    problem = definite(8, 0)
    short, long = lcpcli.run(problem), through_the_loop(problem, monkeypatch)
    assert_same(short, long)
    for field in ("iterations", "evaluations", "route", "verified"):
        assert getattr(short, field) == getattr(long, field)


LOADED = """
import sys, lcpcli, numpy as np
from scipy import sparse
from lcpcli.model import problem as problems
from lcpcli.solving import direct_run
from lcpcli.solving.direct_run import exhausted
direct_run.MANY = 4
for _ in range(30):
    lcpcli.solve([[2]], [-1])
large = sparse.eye_array(400, format="csr"), -np.ones(400)
for each, method in (([[2]], [-1]), "newton"), (large, "auto"):
    results = lcpcli.solve_many(5 * [lcpcli.Problem(*each)], method)
    assert all(result.solved for result in results)
list(lcpcli.solve_many(3 * [lcpcli.Problem([[2]], [-1])]))
print("numba" in sys.modules)
lcpcli.solve([[2]], [-1], compiled=True)
print("numba" in sys.modules)
"""


def test_kernels_are_loaded_when_asked_for_and_not_where_they_are_not_used():
    done = subprocess.run(
        [sys.executable, "-c", LOADED], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", "True"]


def test_kernels_are_compiled_when_they_are_loaded_and_not_during_a_run():
    made = [
        compiled.path,
        compiled.follow,
        compiled.solve_one,
        compiled.basic_solution,
        compiled.acceptance_test,
    ]
    before = [len(kernel.signatures) for kernel in made]
    for problem in (
        families.make("contact", 24, 0),
        families.make("boxes", 10, 0),
        families.make("harker-pang", 8, 0),
    ):
        for M in (problem.M, np.asfortranarray(problem.M), problem.M.copy()):
            lcpcli.solve(
                M, problem.q, lower=problem.lower, upper=problem.upper, compiled=True
            )
    assert [len(kernel.signatures) for kernel in made] == before == len(made) * [1]


def test_it_is_said_once_that_kernels_are_compiled(caplog):
    listener = loading.Announcement()
    with caplog.at_level(logging.WARNING, "lcpcli"):
        listener.on_start(None)
        listener.on_start(None)
    assert [record.message for record in caplog.records] == [loading.ANNOUNCEMENT]


def functions_of(call):
    """The functions of the package through which a call passes."""
    names = set()

    def note(frame, event, _):
        if event == "call" and "lcpcli" in frame.f_globals.get("__name__", ""):
            names.add(frame.f_globals["__name__"] + "." + frame.f_code.co_name)

    call()
    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return names


def test_a_small_dense_call_passes_through_few_functions():
    M = np.eye(4) + 1.0
    q = np.array([-1.0, 2.0, -3.0, 4.0])
    upper = np.array([0.5, np.inf, np.inf, np.inf])
    assert len(functions_of(lambda: lcpcli.solve(M, q))) <= 35
    assert len(functions_of(lambda: lcpcli.solve(M, q, upper=upper))) <= 48


def test_the_first_attempts_that_nobody_sees_have_the_time_limit(monkeypatch):
    left = []

    def steps(*_):
        left.append(remaining())
        raise TimeIsUp
        yield

    monkeypatch.setattr(direct_run, "first_steps", steps)
    problem = families.make("murty", 40)
    assert lcpcli.run(problem, time_limit=1000.0, compiled=False).solved
    assert 0.0 < left[0] <= 1000.0
