"""Nonlinear problems in a bench: what takes them, and by what their answers are checked."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lcpcli.bench import record as records
from lcpcli.bench.suites import SUITES, methods_of, problem_of
from lcpcli.bench.timing import SOLUTION, Checker, TimedAnswer
from lcpcli.gallery import nonlinear as gallery
from lcpcli.model.nonlinear import NonlinearProblem

from ..cli.conftest import Lcp, assert_refused
from ..cli.test_nl_models import MARKET
from .bench_problems import install, liar, write


def test_cases_of_the_suite_have_the_stated_numbers_of_unknowns() -> None:
    cases = SUITES["nonlinear"].cases
    assert [problem_of(each).n for each in cases] == [each.n for each in cases]
    assert {each.family for each in cases} == set(gallery.FAMILIES)
    assert methods_of(["nonlinear"]) == ["josephy-newton"]


def test_answers_are_checked_by_f_evaluated_again() -> None:
    problem = gallery.josephy()
    undefined = NonlinearProblem(lambda z: np.log(z - 2), x0=[3.0])

    def checked(given: NonlinearProblem, z: list[float], claim: str = SOLUTION) -> tuple[bool, bool]:
        found = Checker(given, 1e-6).check(TimedAnswer(np.array(z), claim, "", "", 0.1))
        return found["success"], found["false_success"]

    solution = problem.solutions[0].tolist()
    assert checked(problem, solution) == (True, False)
    assert checked(problem, solution, "") == (False, False)
    assert checked(problem, [1.2, 0, 0, 0.5]) == (False, True)
    assert checked(undefined, [3.0]) == (True, False)
    assert checked(undefined, [1.0]) == (False, True)


def test_bench_of_linear_and_nonlinear_problems_leaves_out_what_does_not_take_them(
    lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(monkeypatch, "liar", liar)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "market.nl").write_bytes(MARKET)
    (path,) = write(tmp_path, "one")
    solvers = [word for name in ("auto", "newton", "josephy-newton") for word in ("--method", name)]
    done = lcp("bench", "market.nl", path, *solvers, "--peer", "liar", "--budget", "0", "-o", "b.json", "-q")
    assert done.code == 1
    rows = {row.key: row for row in records.read("b.json").measurements}
    by_verdict = {key: (row.status, row.success, row.false_success) for key, row in rows.items()}
    for key in [("market.nl", "auto"), ("market.nl", "josephy-newton"), ("one.json", "auto"), ("one.json", "newton")]:
        assert by_verdict[key] == ("solved", True, False)
    for key in [("market.nl", "newton"), ("market.nl", "liar"), ("one.json", "josephy-newton")]:
        assert by_verdict[key][0] == records.EXCLUDED
    assert rows["market.nl", "liar"].statement == "solves linear problems only"
    assert by_verdict["one.json", "liar"][2]
    assert rows["market.nl", "auto"].curve_of == "residual"
    assert json.loads(Path("b.json").read_text())["cases"][0]["file"].endswith("market.nl")
    assert_refused(lcp("bench", "market.nl", "--infinity", "1e20"), "--infinity: has no effect on a nonlinear model")
