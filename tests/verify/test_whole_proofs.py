"""Certificates and rays hold exactly as they are printed and written, in whole numbers, for numbers of all sizes."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.options import Limits
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import approximate, brief, rounded_direction
from lcpcli.report import json_lines, wording
from lcpcli.solving import proof as solving
from lcpcli.solving.driver import run
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
        for line in re.findall(r"Farkas certificate y = \((.*?)\)", lcp("solve", str(file)).out):
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
    assert "Farkas certificate y = (3, 1)" in lcp("solve", str(file)).out


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


FEASIBLE = (9, 13, 24, 27, 36, 50)  # seeds for which rounding leaves some z >= 0 with Mz + q >= 0


def infeasible(seed: int) -> Problem:
    """Return a problem with a row of negative numbers, or two rows that contradict each other."""
    rng = random.Random(seed)
    n, span = rng.randint(1, 4), rng.choice((10, 100, 300))

    def number() -> float:
        sign = rng.choice((0, -1, 1))
        return sign * float(f"{rng.uniform(1, 10):.{rng.choice((0, 2, 16))}f}e{rng.randint(-span, span)}")

    M, q = [[number() for _ in range(n)] for _ in range(n)], [number() for _ in range(n)]
    a, b = rng.randrange(n), rng.randrange(n)
    if a == b:
        M[a] = [-abs(value) for value in M[a]]
    else:
        factor = 10.0 ** rng.randint(-span // 2, span // 2)
        M[b] = [max(min(-factor * value, 1e305), -1e305) for value in M[a]]
    q[a], q[b] = -abs(q[a]) or -1e-10, -abs(q[b]) or -1.0
    return Problem(M, q)


def exact_decimal(value: float) -> Fraction:
    return Fraction(repr(value))


def proves(problem: Problem, y: list[Fraction], number: Callable[[float], Fraction]) -> bool:
    rows = [[number(value) for value in row] for row in problem.M.tolist()]
    columns = [sum(a * b for a, b in zip(column, y, strict=True)) for column in zip(*rows, strict=True)]
    return min(y) >= 0 >= max(columns) and sum(number(b) * v for b, v in zip(problem.q.tolist(), y, strict=True)) < 0


@pytest.mark.parametrize("seed", [seed for seed in range(0, 60, 2) if seed not in FEASIBLE])
def test_what_is_written_proves_exactly_what_it_claims(seed: int) -> None:
    pytest.importorskip("flint")
    problem = infeasible(seed)
    for result in (run(problem, "auto", limits=Limits(time_limit=120)), lcpcli.exact(problem, time_limit=120)):
        held = json.loads(json_lines.line(json_lines.data(result)))
        if held["status"] == "infeasible":
            y = [Fraction(value) for value in held["certificate"]["vector"]]
            of_decimals = result.exact is None and proves(problem, y, exact_decimal)
            assert of_decimals or proves(problem, y, Fraction)
    assert held["status"] == "infeasible"


def test_proof_with_entries_far_apart_is_printed_and_accepted(lcp: Lcp, tmp_path: Path) -> None:
    """y = (1e507, 1, 0)."""
    pytest.importorskip("flint")
    file, found = tmp_path / "far.json", tmp_path / "result.json"
    file.write_text('{"M": [[1e-238, -1e-238, 0], [-1e269, 1e269, 0], [0, 0, 1]], "q": [-1, -1, 1]}')
    assert lcp("solve", str(file), "--exact", "-o", str(found)).code == 3
    held = json.loads(found.read_text())
    assert proves(lcpcli.read(file), [Fraction(value) for value in held["certificate"]["vector"]], exact_decimal)
    assert lcp("check", str(file), str(found), "--exact").code == 0
    for form in ("csv", "html", "latex"):
        assert lcp("solve", str(file), "--exact", "--format", form).code == 3
    assert "M'y = (0, 0, 0) and q'y = -1e+507, so y'(Mz + q) < 0" in lcp("solve", str(file), "--exact").out


def test_proof_that_doubles_do_not_hold_is_written_in_fractions_which_check_accepts(lcp: Lcp, tmp_path: Path) -> None:
    """y is a multiple of (b^2, a b, a^2, 0), as M'y = 0."""
    a, b = float(2**53 - 1), float(2**53 - 3)
    M = np.array([[a, -a, 0, 0], [-b, b, a, -a], [0, 0, -b, b], [0, 0, 0, 0]])
    file, found = tmp_path / "a.json", tmp_path / "result.json"
    lcpcli.write(Problem(M, [-1, -1, -1, 1]), file)
    assert lcp("solve", str(file), "-o", str(found)).code == 3
    vector = json.loads(found.read_text())["certificate"]["vector"]
    assert vector == [str(2**106 - 6 * 2**53 + 9), str(2**106 - 4 * 2**53 + 3), str(2**106 - 2 * 2**53 + 1), "0"]
    assert lcp("check", str(file), str(found)).code == 0
    assert "M'y = (0, 0, 0, 0)" in lcp("solve", str(file)).out


def test_directions_keep_small_entries_where_doubles_can() -> None:
    kept = rounded_direction([Fraction(10) ** 300, Fraction(1, 10**300)])
    assert kept.min() > 0
    assert abs(Fraction(kept[0]) / Fraction(kept[1]) / 10**600 - 1) < 1e-15
    assert np.isfinite(rounded_direction([Fraction(10) ** 900, Fraction(1)])).all()
    assert rounded_direction([Fraction(3), Fraction(1)]).tolist() == [3.0, 1.0]


def test_numbers_beyond_doubles_are_printed_as_they_are() -> None:
    huge, tiny = Fraction(10) ** 400 / 3, Fraction(1, 3 * 10**400)
    assert (brief(huge), brief(tiny), approximate(-huge)) == ("~3.333333e+399", "~3.333333e-401", "-3.333333e+399")
    assert (approximate(Fraction(0)), approximate(Fraction(1, 3))) == ("0", "0.3333333")


def test_long_proof_says_that_it_is_rounded_unless_doubles_show_it() -> None:
    """y = (1, ..., 1) proves the first; the y of the second makes M'y vanish, but for rounding."""
    rng = np.random.default_rng(0)
    clear = run(Problem(-rng.uniform(1, 2, (200, 200)), -np.ones(200)), "auto")
    A = rng.standard_normal((150, 60))
    M = np.hstack((A, -A, np.zeros((150, 30))))
    long = run(Problem(M, -np.abs(rng.standard_normal(150))), "auto")
    for result, is_said in ((clear, False), (long, True)):
        assert result.certificate.statement.endswith("up to rounding of y") == is_said
        y = fractions_of(result.certificate.vector)
        assert is_said or ExactProblem.of_floats(result.problem).refuted_by(y)
