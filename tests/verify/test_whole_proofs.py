"""Certificates and rays hold exactly as they are printed and written: they consist of whole numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.report import wording
from lcpcli.solving import proof as solving
from lcpcli.verify.certificate import proof

from .. import exact
from ..conftest import Outcome

Lcp = Callable[..., Outcome]


def tight(random: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """M and q of integers; in half of them row 0 is almost minus a positive combination of the others."""
    M, q = random.integers(-9, 10, (n, n)) * (random.random((n, n)) < 0.7), random.integers(-9, 10, n)
    if random.integers(2):
        c, k = random.integers(0, 8, n), int(random.integers(1, 8))
        M, q = k * M, k * q
        M[0], q[0] = -(c[1:] @ M[1:]) // k, -(c[1:] @ q[1:]) // k - 1
    return M, q


def bounds(random: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    lower = np.where(random.random(n) < 0.6, random.integers(-2, 3, n), -np.inf)
    width = np.where(random.random(n) < 0.3, random.integers(0, 3, n), np.inf)
    return {"lower": lower, "upper": np.where(np.isfinite(lower), lower, 0) + width}


def whole(values: Sequence[float]) -> list[Fraction]:
    assert all(value == int(value) for value in values), values
    return [Fraction(value) for value in values]


@pytest.mark.parametrize("with_bounds", [False, True])
def test_farkas_vectors_in_json_hold_exactly(with_bounds: bool) -> None:
    proofs = 0
    for seed in range(30):
        random = np.random.default_rng(seed)
        n = int(random.integers(2, 9))
        problem = Problem(*tight(random, n), **(bounds(random, n) if with_bounds else {}))
        record = json.loads(lcpcli.run(problem).to_json())
        if record["status"] == "infeasible":
            assert exact.refutes(problem, whole(record["certificate"]["vector"])), seed
            proofs += 1
    assert proofs > 9


def test_farkas_vector_holds_as_it_is_printed(lcp: Lcp, tmp_path: Path) -> None:
    file, proofs = tmp_path / "p.json", 0
    for seed in range(6):
        random = np.random.default_rng(1000 + seed)
        problem = Problem(*tight(random, int(random.integers(2, 9))))
        lcpcli.write(problem, file)
        for line in re.findall(r"certificate: farkas \((.*?)\)", lcp("solve", str(file)).out):
            assert exact.refutes(problem, list(map(Fraction, line.split(", "))))
            proofs += 1
    assert proofs >= 2


def program(random: np.random.Generator) -> dict[str, Any]:
    """min or max x'Qx / 2 + c'x, convex, of integers, with rows and bounds of every kind."""
    m, k = (int(size) for size in random.integers(1, 7, 2))
    A = random.integers(-9, 10, (m, k)) * (random.random((m, k)) < 0.7)
    B = random.integers(-2, 3, (k, k)) * (random.random(k) < 0.5) * random.integers(0, 2)
    sense, side = str(random.choice(["min", "max"])), random.integers(0, 4, m)
    b = A @ random.integers(-3, 4, k) + random.integers(-3, 4, m) * random.integers(0, 2)
    return {
        "Q": B.T @ B if sense == "min" else -B.T @ B,
        "c": random.integers(-9, 10, k),
        "A": A,
        "row_lower": np.where(side == 1, -np.inf, b),
        "row_upper": np.select([side == 3, side == 2], [np.inf, b + 2.0], b),
        "lower": np.where(random.random(k) < 0.5, random.integers(-3, 1, k), -np.inf),
        "upper": np.where(random.random(k) < 0.3, 4.0, np.inf),
        "sense": sense,
    }


def products(A: np.ndarray, x: list[Fraction]) -> list[Fraction]:
    return [sum((int(a) * value for a, value in zip(row, x, strict=True)), Fraction(0)) for row in A]


def excludes(y: list[Fraction], p: dict[str, Any]) -> bool:
    """Whether y'Ax, of all x within bounds, is below what the rows ask of it."""
    least = exact.supremum([-value for value in y], p["row_lower"].tolist(), p["row_upper"].tolist())
    largest = exact.supremum(products(p["A"].T, y), p["lower"].tolist(), p["upper"].tolist())
    return least is not None and largest is not None and largest + least < 0


def improves_for_ever(ray: list[Fraction], p: dict[str, Any]) -> bool:
    """Whether rows and bounds let x go on in that direction, with a slope of the objective that stays away from 0."""
    sides = [(ray, p["lower"], p["upper"]), (products(p["A"], ray), p["row_lower"], p["row_upper"])]
    for values, lower, upper in sides:
        for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True):
            if (value < 0 and low > -np.inf) or (value > 0 and high < np.inf):
                return False
    sign = 1 if p["sense"] == "min" else -1
    slope = sign * products(p["c"][np.newaxis], ray)[0]
    changes = exact.supremum(products(sign * p["Q"], ray), p["lower"].tolist(), p["upper"].tolist())
    return changes is not None and slope + changes < 0


def test_multipliers_and_rays_of_programs_hold_exactly() -> None:
    rows = rays = 0
    for seed in range(50):
        p = program(np.random.default_rng(seed))
        answer = json.loads(lcpcli.run(lcpcli.from_qp(**p)).to_json())["answer"]
        if answer["certificate"] is not None:
            assert excludes(whole(answer["certificate"]), p), seed
            rows += 1
        if answer["ray"] is not None:
            assert improves_for_ever(whole(answer["ray"]), p), seed
            rays += 1
    assert min(rows, rays) > 5


def test_decimals_have_a_vector_of_integers_that_holds_as_they_are_written(lcp: Lcp, tmp_path: Path) -> None:
    """y = (3, 1), although doubles of 0.1 and 0.3 are not in that ratio."""
    file = tmp_path / "p.json"
    file.write_text('{"M": [[0.1, -0.1], [-0.3, 0.3]], "q": [-0.1, 0.2]}')
    for arguments in ((), ("--exact",)):
        record = json.loads(lcp("solve", str(file), *arguments, "--format", "json").out)
        assert (record["status"], record["certificate"]["vector"]) == ("infeasible", [3, 1])
    assert record["exact"]["y"] == ["3", "1"]
    assert "certificate: farkas (3, 1)" in lcp("solve", str(file)).out


def test_doubles_of_many_digits_keep_their_vector() -> None:
    v = np.array([np.pi, -np.e, -np.sqrt(2)])
    problem, y = Problem(np.outer(v, [1, -1, 0]), [-1, -1, -1]), np.array([(np.e + np.sqrt(2)) / np.pi, 1, 1])
    kept = proof(problem, y / 8)
    assert np.array_equal(kept, y)
    assert lcpcli.check(problem, y=kept).accepted
    assert proof(Problem(problem.M, [1, 1, 1]), y) is None


def test_whole_numbers_are_shown_with_all_digits_and_others_as_rounded() -> None:
    shown = {2.0**53: "9007199254740992", 0.5: "0.5", 1 / 3: "~0.3333333", -3.0: "-3"}
    assert {value: wording.multiplier(value) for value in shown} == shown


def test_proof_in_integers_leaves_columns_of_bounded_variables_that_nearly_vanish() -> None:
    """y = (b, a, 0) is 0 in the first column exactly, and in the third one 1e-9 of its terms, which cannot both be
    0; but the third variable is between 0 and 1."""
    a, b = 1234567891.0, 987654323.0
    M = [[a, -1, 1 / b], [-b, -1, (1e-9 - 1) / a], [0, 0, 1]]
    problem = Problem(M, [-2, 1, 0], lower=[-np.inf, 0, 0], upper=[np.inf, np.inf, 1])
    y = proof(problem, np.array([b, a, 0]) / a)
    assert exact.refutes(problem, whole(y.tolist()))


def test_proof_for_integers_is_one_for_the_decimals_that_they_are_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows with different denominators, and a run that has found nothing; without the search at the end."""
    monkeypatch.setattr(solving, "_searched", lambda *given: None)  # noqa: ARG005
    problem = Problem([[0.1, -0.7], [-0.001, 0.007]], [-1, 0.0099])
    lost = lcpcli.run(problem, "shi", max_iterations=0)
    found = solving.prove(lambda: ExactProblem.of_decimals(problem), lost).exact
    assert found.y == [1, 100]
