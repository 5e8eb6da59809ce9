"""Where neither iteration solves a problem, comparisons say why; and a p that smooths
nothing is named as such."""

import math

import numpy as np
import pytest

from lcpcli import Problem, read, run, write
from lcpcli.gallery import families
from lcpcli.inspection.failure import explanation
from lcpcli.methods.shi import default_p

from ..seeds import few_of

EXAMPLE = "paper-example-1"


REASONS = {
    "no P-matrix": (
        read("bimatrix"),
        "M is not a P-matrix (M(1, 1) = 0 is not positive)",
        "auto solves it",
    ),
    "scaling": (
        families.make("diagonal", 20),
        "the largest entries of rows or columns of M differ by 12 decades",
        "the option scale equilibrates M, and auto solves it",
    ),
    "condition": (
        families.make("hilbert", 12),
        "the condition of M is about 4e+16, and linear convergence slows down with it",
        "auto solves it",
    ),
    "no solution": (families.make("infeasible", 6), "as it has no solution", ""),
}


@pytest.mark.parametrize("name", REASONS)
def test_a_comparison_in_which_neither_solves_says_why_and_what_does(
    name, lcp, in_folder
):
    problem, cause, remedy = REASONS[name]
    write(problem, in_folder / "hard.json")
    asked = "compare hard.json --max-iterations 30"
    out = lcp(asked).out
    (line,) = [line for line in out.splitlines() if line.startswith("neither ")]
    assert line.startswith("neither fixed-point nor shi solves the problem")
    assert cause in line
    assert remedy in line
    if name == "no P-matrix":
        alone = lcp(f"{asked} --method shi").out
        assert f"shi does not solve the problem: {cause}" in alone


def test_a_comparison_says_nothing_where_it_knows_nothing(lcp):
    for limit in ("3", "1000"):
        out = lcp(f"compare {EXAMPLE} --max-iterations {limit}").out
        assert "the problem" not in out
    alone = lcp("solve bimatrix --method shi --max-iterations 30").out
    assert "solve the problem" not in alone


def test_kinks_count_where_z_and_w_are_both_0():
    problem = families.make("degenerate", 20)
    found = explanation(problem, ["shi"])
    assert found.causes == ["z_i = w_i = 0 for 10 of 20 i, close to which F has a kink"]
    assert found.guarantee == "newton is guaranteed to solve it, as M is a P-matrix"
    assert explanation(problem, ["fixed-point"]).causes == []


@pytest.mark.parametrize("seed", few_of(range(40), 10))
def test_a_method_named_as_guaranteed_solves_the_problem_or_proves_it_has_none(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    problem = Problem(
        rng.integers(-1, 4, (n, n)).astype(float),
        rng.integers(-3, 3, n).astype(float),
        lower=rng.choice([0, 0, -np.inf], n),
        upper=rng.choice([np.inf, np.inf, 3], n),
    )
    guarantee = explanation(problem, ["fixed-point"]).guarantee
    if guarantee:
        name = guarantee.split()[0]
        result = run(problem, method=name)
        proved = " or to prove that it has no solution" in guarantee
        assert result.status.name in ("SOLVED", "INFEASIBLE" if proved else "SOLVED")


@pytest.mark.parametrize("family", ["degenerate", "harker-pang", "growth", "obstacle"])
def test_the_default_p_smooths_nothing(family):
    """phi differs from |x| by less than the rounding of the largest of z and w."""
    problem = families.make(family, 10)
    result = run(problem)
    largest = max(np.abs(result.z).max(), np.abs(result.w).max())
    assert math.log(3) / default_p(problem) <= 2.0**-52 * largest
