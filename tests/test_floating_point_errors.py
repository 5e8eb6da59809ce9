"""numpy's warnings never reach a user, and what a host program asks numpy to raise changes no result."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.errors import LCPError

VALUES = [0.0, 1.0, -1.0, 2.0, -3.0, 1.7e308, -1e308, 5e-324, 1e-310, 1e-300, -1e-200, 1e200, 1e150, -1e-150, 1e16]
OF_RESULT = ("z", "w", "residual", "relative_residual", "basis", "digits", "advice", "to_dict", "to_json", "__repr__")
SECONDS = 0.05


def extreme_problem(random: np.random.Generator) -> Problem:
    n = int(random.choice([1, 3, 5, 22]))
    M = random.choice(VALUES, (n, n)) * (random.random((n, n)) < random.choice([0.3, 1.0]))
    np.fill_diagonal(M, np.abs(random.choice(VALUES[1:], n)))
    q, lower, upper = random.choice(VALUES, n), 0.0, np.inf
    if random.random() < 0.5:
        lower = random.choice([0, -np.inf, -1, -1e308, -5e-324], n)
        upper = np.where(random.random(n) < 0.5, np.inf, np.maximum(lower, random.choice([0, 5e-324, 1e308], n)))
    return Problem(csr_array(M) if random.random() < 0.3 else M, q, lower=lower, upper=upper)


def use(problem: Problem, random: np.random.Generator) -> None:
    """Call what is public with a problem."""
    n = problem.n
    q, z = random.choice(VALUES, n), np.abs(random.choice(VALUES, n))
    result = lcpcli.run(problem, time_limit=SECONDS)
    for name in OF_RESULT:
        value = getattr(result, name)
        _ = value() if callable(value) else value
    functions: list[Callable[[], Any]] = [
        lambda: lcpcli.run(problem, str(random.choice(["newton", "lemke", "shi", "interior"])), time_limit=SECONDS),
        lambda: lcpcli.check(problem, z),
        lambda: lcpcli.error_bound(problem, z),
        lambda: lcpcli.path(problem, Problem(problem.M, q, **problem.bounds), time_limit=SECONDS)(0.5),
        lambda: list(lcpcli.solve_many(problem.M, random.choice(VALUES, (n, 3)), time_limit=SECONDS)),
        lambda: result.derivative(dq=q, one_sided=True).z,
        lambda: result.gradient(q).M,
        lambda: result.gradient(q).lower,
        lambda: lcpcli.exact(problem, time_limit=SECONDS),
    ]
    if n < 10:
        functions += [lambda: lcpcli.inspect(problem, 0.1), lambda: lcpcli.solutions(problem, time_limit=SECONDS)]
    for function in functions:
        try:
            function()
        except LCPError:
            continue


MOST = {0, 2, 4, 5, 8, 11, 12, 16, 23, 24}  # seeds that reach nearly all lines that all reach
HOSTS: tuple[tuple[dict[str, Any], set[int]], ...] = (({"all": "raise"}, MOST), ({}, {1, 23}))


@pytest.mark.parametrize(
    ("host", "seed"),
    [
        pytest.param(host, seed, marks=() if seed in quick else pytest.mark.slow("more of the same"))
        for host, quick in HOSTS
        for seed in range(25)
    ],
)
def test_extreme_numbers_cause_no_warning_and_no_error_if_a_host_asks_for_them(host: dict[str, Any], seed: int) -> None:
    random = np.random.default_rng(seed)
    with warnings.catch_warnings(), np.errstate(**host):
        warnings.simplefilter("error")
        use(extreme_problem(random), random)


@pytest.mark.parametrize("n", [2, 30, 120])
def test_host_that_raises_floating_point_errors_gets_the_same_result(n: int) -> None:
    random = np.random.default_rng(n)
    A = random.standard_normal((n, n))
    M, q = A @ A.T / n + np.eye(n), random.standard_normal(n)
    M[0, 0] = 1e-290
    usual = lcpcli.solve(M, q)
    with np.errstate(all="raise"):
        assert lcpcli.solve(M, q).z.tolist() == usual.z.tolist()
