"""The interior point method: monotone problems of every kind, degenerate ones too, and proofs of infeasibility.

LCP_SEEDS sets the number of random problems.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, Status, Trace, from_qp, run
from lcpcli.gallery import families as gallery
from lcpcli.linalg import shifted_systems
from lcpcli.linalg.patterns import signs
from lcpcli.methods.interior_scaling import proof_of, slack_form
from lcpcli.methods.interior_systems import AccurateSystems
from lcpcli.typing import Vector

SEEDS = int(os.environ.get("LCP_SEEDS", "60"))
LARGE = 120


def monotone(seed: int, sizes: Sequence[int] = (10, 20, 50, 120)) -> Problem:
    """M + M' positive semidefinite, from definite to zero, with skew parts, bounds of every kind and a known solution.

    A third of the bounded variables is degenerate: at a bound with w = 0. Large ones are sparse, with entries near the
    diagonal.
    """
    random = np.random.default_rng(seed)
    n = int(random.choice(sizes))
    rank = int(random.choice([0, n // 4, n // 2, n]))
    if n <= LARGE:
        F = random.normal(size=(n, rank)) * (random.random((n, rank)) < 0.3)
        G = random.normal(size=(n, n)) * (random.random((n, n)) < 3 / n)
    else:
        F, G = near_diagonal(n, rank, random), near_diagonal(n, n, random)
    M = F @ F.T + random.choice([0.0, 1.0]) * (G - G.T)
    z, w = np.zeros(n), np.zeros(n)
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for i, kind in enumerate(random.choice(list("flubx"), n, p=[0.2, 0.4, 0.1, 0.25, 0.05])):
        z[i] = random.integers(-3, 4)
        state = random.choice(["basic", "lower", "upper", "degenerate"])
        if kind in "lb":
            lower[i] = z[i] - (0 if state in ("lower", "degenerate") else random.integers(1, 4))
        if kind in "ub":
            upper[i] = z[i] + (0 if state == "upper" and kind == "b" else random.integers(1, 4))
        if kind == "u" and state in ("upper", "degenerate"):
            upper[i] = z[i]
        if kind == "x":
            lower[i] = upper[i] = z[i]
        if state == "lower" and lower[i] == z[i] < upper[i]:
            w[i] = random.random() + 0.1
        elif state == "upper" and upper[i] == z[i] > lower[i]:
            w[i] = -random.random() - 0.1
        elif kind == "x":
            w[i] = random.normal()
    return Problem(sparse.csr_array(M) if random.random() < 0.5 else M, w - M @ z, lower=lower, upper=upper)


def near_diagonal(n: int, columns: int, random: np.random.Generator) -> sparse.csr_array:
    """Three random entries in each column, at most 3 places from the diagonal."""
    column = np.repeat(np.arange(columns), 3)
    row = np.clip(column * n // max(columns, 1) + random.integers(-3, 4, column.size), 0, n - 1)
    return sparse.csr_array((random.normal(size=column.size), (row, column)), shape=(n, columns))


def largest_gap(problem: Problem, z: Vector) -> float:
    """The natural residual, relative to the terms of its row, from the definition."""
    w = problem.M @ z + problem.q
    gap = z - np.minimum(np.maximum(z - w, problem.lower), problem.upper)
    return float((np.abs(gap) / (1.0 + abs(problem.M) @ np.abs(z) + np.abs(problem.q))).max())


@pytest.mark.parametrize("part", range(4))
def test_monotone_problems_with_a_solution_are_solved(part: int) -> None:
    for seed in range(part, SEEDS, 4):
        problem = monotone(seed)
        result = run(problem, "interior")
        assert result.solved or result.residual < 1e-15, seed  # the reference point may be a solution but for rounding
        assert largest_gap(problem, result.z) < 1e-9, seed


@pytest.mark.parametrize("seed", range(max(SEEDS // 20, 3)))
def test_large_monotone_problems_are_solved(seed: int) -> None:
    problem = monotone(1000 + seed, [300, 1000, 3000, 10_000] if seed else [10_000])
    result = run(problem, "interior")
    assert result.solved, result.message
    assert largest_gap(problem, result.z) < 1e-9


@pytest.mark.parametrize("part", range(4))
def test_congruences_keep_monotonicity_and_the_answer(part: int) -> None:
    for seed in range(part, SEEDS // 2, 4):
        problem = monotone(seed)
        d = 2.0 ** np.random.default_rng(seed).integers(-20, 21, problem.n)
        D = sparse.diags_array(d)
        M = sparse.csr_array(D @ sparse.csr_array(problem.M) @ D)
        other = Problem(M, d * problem.q, lower=problem.lower / d, upper=problem.upper / d)
        assert run(other, "interior", tol=1e-8).solved, seed


@pytest.mark.parametrize("seed", range(8))
def test_infeasible_and_unbounded_programs_are_proved_so(seed: int) -> None:
    random = np.random.default_rng(seed)
    A = random.integers(-3, 4, (6, 8)).astype(float)
    y = random.integers(1, 4, 6).astype(float)
    A[0] -= (y @ A) / y[0]  # so that y'A = 0
    b = np.ones(6)
    infeasible = from_qp(np.eye(8), np.ones(8), A, b)
    assert run(infeasible, "interior").status is Status.INFEASIBLE
    unbounded = from_qp(np.zeros((8, 8)), -np.ones(8), np.abs(A), b)
    assert run(unbounded, "interior").status is Status.INFEASIBLE


@pytest.mark.parametrize("family", ["portfolio", "control", "transport", "circuit", "spatial-prices", "qp", "lp"])
@pytest.mark.parametrize("n", [40, 300])
def test_it_agrees_with_what_auto_finds(family: str, n: int) -> None:
    problem = gallery.make(family, n)
    result = run(problem, "interior")
    assert result.solved
    assert largest_gap(problem, result.z) < 1e-10


def test_the_basic_solution_ends_it_where_there_is_one() -> None:
    problem = gallery.make("lp", 100)
    trace = Trace()
    assert run(problem, "interior", trace=trace).solved
    assert trace.rows[-1].step == "finish"
    assert np.abs(run(problem, "interior").z - problem.solutions[0]).max() < 1e-12


def test_signs_make_the_conditions_of_programs_symmetric_and_no_others() -> None:
    for family in ("portfolio", "control", "transport"):
        M = gallery.make(family, 60).M
        S = signs(M)
        assert S is not None
        product = sparse.diags_array(S) @ M
        assert not (product != product.T).nnz
    assert signs(sparse.csr_array([[1.0, 2.0], [3.0, 1.0]])) is None
    cycle = sparse.csr_array([[0.0, 1.0, 1.0], [-1.0, 0.0, 1.0], [-1.0, -1.0, 0.0]])
    assert signs(cycle) is None


def test_without_qdldl_scipy_alone_solves_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shifted_systems, "_has_qdldl", lambda: False)
    assert run(gallery.make("control", 1000), "interior").solved


def test_superlu_takes_the_order_that_qdldl_has_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own search for one may take longer than all factorizations; every system is solved with the last factors."""
    pytest.importorskip("qdldl")
    orders: list[str] = []
    own = sparse.linalg.splu
    monkeypatch.setattr("scipy.sparse.linalg.splu", lambda A, **how: orders.append(how["permc_spec"]) or own(A, **how))
    monkeypatch.setattr(shifted_systems, "MOST_PER_ENTRY", 0.0)
    problem = gallery.make("control", 100)
    S = signs(problem.M)
    systems = shifted_systems.systems(problem.M, S)
    for shift in (1.0, 10.0, 100.0, 1000.0, 1e4):
        systems.factorize(np.full(problem.n, shift))
        z = systems.solve(problem.q)
        assert np.abs(problem.M @ z + shift * z - problem.q).max() < 1e-10
    assert set(orders) == {"NATURAL"}


@pytest.mark.parametrize("family", ["transport", "portfolio", "control"])
def test_steps_and_active_sets_share_one_analysis_of_the_pattern(family: str, monkeypatch: pytest.MonkeyPatch) -> None:
    qdldl = pytest.importorskip("qdldl")
    own, analysed = qdldl.Solver, list[int]()
    monkeypatch.setattr(qdldl, "Solver", lambda A, **how: analysed.append(A.shape[0]) or own(A, **how))
    result = run(gallery.make(family, 300), "interior")
    assert result.solved
    assert len(analysed) == 1


@pytest.mark.parametrize("limit", [0.01, 0.05])
def test_a_cut_off_leaves_the_best_iterate_and_a_true_status(limit: float) -> None:
    problem = gallery.make("transport", 10_000)
    result = run(problem, "interior", time_limit=limit)
    assert result.status in (Status.TIME_LIMIT, Status.SOLVED)
    assert np.isfinite(result.z).all()
    assert (result.relative_residual <= result.tol) == result.solved


Maker = Callable[[], Problem]


@pytest.mark.parametrize(
    "make",
    [
        lambda: Problem([[0.0]], [0.0]),
        lambda: Problem([[0.0]], [1.0]),
        lambda: Problem(np.zeros((3, 3)), np.zeros(3), lower=-1, upper=1),
        lambda: Problem(np.eye(2), [1.0, -1.0], lower=2.0, upper=2.0),
        lambda: Problem(np.eye(3), [1e200, -1e200, 1.0]),
        lambda: Problem(sparse.csr_array((4, 4)), np.ones(4)),
        lambda: Problem(np.eye(2), np.ones(2), lower=-np.inf, upper=np.inf),
    ],
)
def test_small_and_extreme_problems_end_in_a_true_status(make: Maker) -> None:
    result = run(make(), "interior")
    assert result.solved


@pytest.mark.parametrize(("cut", "status"), [(MemoryError, Status.BREAKDOWN), (KeyboardInterrupt, Status.INTERRUPTED)])
@pytest.mark.parametrize("at", [1, 3, 6])
def test_a_cut_off_in_a_factorization_leaves_the_best_iterate(
    cut: type[BaseException], status: Status, at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    factorize, count = AccurateSystems.factorize, itertools.count(1)

    def cut_off(self: AccurateSystems, D: Vector) -> None:
        if next(count) == at:
            raise cut
        factorize(self, D)

    monkeypatch.setattr(AccurateSystems, "factorize", cut_off)
    problem = gallery.make("control", 200)
    result = run(problem, "interior", interrupts="return")
    assert result.status is status
    assert not result.solved
    assert ("memory" in result.message) == (cut is MemoryError)
    assert result.iterations == max(at - 2, 0)
    z = result.z
    gap = z - np.clip(z - (problem.M @ z + problem.q), problem.lower, problem.upper)
    assert result.residual == pytest.approx(np.abs(gap).max())


@pytest.mark.parametrize(("total", "proves"), [(-1.0, True), (-(2.0**-52), False)])
def test_what_rounding_alone_excludes_is_not_proved_infeasible(total: float, proves: bool) -> None:
    """x_1 + x_2 = -2e-16 for x >= 0, as in files that programs have written."""
    problem = from_qp(Q=np.eye(3), c=[1, 2, 3], A=[[1, 1, 0], [1, 2, 3]], row_lower=[total, 1], row_upper=[total, 5])
    direction = np.array([0.0, 0.0, 0.0, -1e3, 0.0, 0.0])
    assert (proof_of(problem, slack_form(problem), [direction]) is not None) == proves
