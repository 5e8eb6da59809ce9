"""Proofs and verifications of problems with bounds: exact solutions, Farkas vectors, and answers that are wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Status

from ..conftest import Outcome
from ..mixed_problems import monotone, with_all_bounds

Lcp = Callable[..., Outcome]

INFEASIBLE = Problem([[0, 1], [-1, 0]], [1, 1], lower=[None, None], upper=[None, -2])  # z1 = 1, w1 = z2 + 1 = 0
UNSOLVABLE = Problem([[0, 1], [1, 0]], [-1, 1], lower=[0, 0], upper=[np.inf, np.inf])


def test_an_exact_solution_is_one_in_fractions_with_bounds_as_written(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    file.write_text('{"M": [[3, 1], [1, 3]], "q": [-1, 0.7], "lower": [0.1, -0.2], "upper": [0.3, null]}')
    found = json.loads(lcp("solve", str(file), "--exact", "--format", "json").out)["exact"]
    assert (found["status"], found["z"], found["w"]) == ("solved", ["3/10", "-1/5"], ["-3/10", "2/5"])
    assert lcp("check", str(file), "3/10,-1/5", "--exact").code == 0
    assert lcp("check", str(file), "0.1,-1/5", "--exact").code == 1
    given = lcp("solve", str(file), "--upper", "0.2,1/7", "--exact", "--format", "json").out
    assert json.loads(given)["exact"]["z"] == ["1/5", "-1/5"]


def test_exact_solutions_agree_with_rounded_ones() -> None:
    pytest.importorskip("flint")
    for seed in range(5):
        generator = np.random.default_rng(seed)
        M, q = monotone(6, generator)
        lower, upper = with_all_bounds(6, generator)
        result = lcpcli.exact(Problem(M, q, lower=lower, upper=upper))
        assert np.abs(result.z - [float(value) for value in result.exact.z or []]).max() <= 1e-12


def test_infeasible_problems_have_a_vector_that_check_accepts_and_no_other() -> None:
    result = lcpcli.run(INFEASIBLE)
    assert result.status is Status.INFEASIBLE
    assert "z >= 0" not in result.message
    y = result.certificate.vector
    assert lcpcli.check(INFEASIBLE, y=y).accepted
    for wrong in (-y, np.ones(2), np.array([0.0, 1.0])):
        assert not lcpcli.check(INFEASIBLE, y=wrong).accepted
    loose = Problem(INFEASIBLE.M, INFEASIBLE.q, lower=None, upper=[np.inf, -1])
    assert not lcpcli.check(loose, y=y).accepted
    assert lcpcli.run(loose).solved


def test_a_vector_of_complementarity_problems_proves_nothing_about_free_variables() -> None:
    lcp, y = Problem([[-1]], [-2]), [1.0]
    assert lcpcli.check(lcp, y=y).accepted
    assert not lcpcli.check(Problem([[-1]], [-2], lower=None), y=y).accepted


def test_feasible_problems_without_solution_are_told_by_exhaustion() -> None:
    mixed = Problem([[0, 1, 0], [1, 0, 0], [0, 0, 1]], [-1.1, 1.3, -0.7], lower=[0, 0, 0.1], upper=[None, None, 0.2])
    result = lcpcli.run(mixed)
    assert result.status is Status.UNSOLVABLE, result.message
    assert lcpcli.run(UNSOLVABLE).status is Status.UNSOLVABLE


def test_each_violation_is_named() -> None:
    problem = Problem(np.eye(4), [-1, -1, 1, 0], lower=[0, None, -2, 1], upper=[2, 0.5, 2, 1])
    verified = lcpcli.check(problem, [-1, 1, 0, 5])
    found = [(violation.index, violation.kind) for violation in verified.violations]
    assert sorted(found) == [(0, "z < lower"), (1, "z > upper"), (2, "w > 0"), (3, "z > upper")]
    assert verified.backward_error == np.inf
    assert lcpcli.check(problem, [1, 0.5, -1, 1]).accepted


def test_the_backward_error_is_the_smallest_change_of_the_data() -> None:
    """At z = 2, w = -1 has its sign; at 1, w = -3 has to vanish."""
    problem = Problem([[2.0]], [-5.0], lower=0.0, upper=2.0)
    assert lcpcli.check(problem, [2.0]).backward_error == 0
    assert lcpcli.check(problem, [1.0]).backward_error == pytest.approx(3 / 7)
    below = lcpcli.Problem([[2.0, 1.0], [1.0, 3.0]], [1.0, 2.0], lower=-9.0)
    z = [-1.0, 2.0]  # w = (1, 7), of terms of size 2 + 2 + 1 and 1 + 6 + 2
    assert lcpcli.check(below, z).backward_error == pytest.approx(max(1 / 5, 7 / 9))


def test_solutions_in_a_file_are_judged_by_its_bounds(lcp: Lcp, tmp_path: Path) -> None:
    text = '{"M": [[1]], "q": [-5], "upper": 2, "solution": %s}'
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(text % "[2]")
    bad.write_text(text % "[5]")
    assert lcp("solve", str(good), "-q").err == ""
    assert "z1 = 5 and w1 = 0" in lcp("solve", str(bad)).err
    assert lcpcli.run(lcpcli.read(good)).z.tolist() == [2]
