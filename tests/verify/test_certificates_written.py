"""Certificates in JSON, read back and checked in fractions, for problems whose numbers range over all doubles."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
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
from lcpcli.report import json_lines
from lcpcli.solving.driver import run

FEASIBLE = (9, 13, 24, 27, 36, 50)  # seeds for which rounding leaves some z >= 0 with Mz + q >= 0
Lcp = Callable[..., Any]


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
    for result in (run(problem, "auto", limits=Limits(time_limit=5)), lcpcli.exact(problem, time_limit=5)):
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
    assert "M'y = (0, 0, 0), q'y = -1e+507: y'(Mz + q) < 0" in lcp("solve", str(file), "--exact").out


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
