"""lcp bench path: exact breakpoints, our own and other packages' times and errors, and its reports."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.bench import paths
from lcpcli.bench.exact_breakpoints import ExactBreakpoints, exact_shares
from lcpcli.bench.paths import Case, measure
from lcpcli.gallery import families as gallery
from lcpcli.parametric.following import path
from lcpcli.parametric.path import Path
from lcpcli.peers import paths as followers
from lcpcli.peers import registry

Lcp = Callable[..., Any]
CASES = (
    Case("frontier", 12, paths.RETURN, peer="cvxcla"),
    Case("lasso", 20, paths.PENALTY, {"samples": 20}, peer="lars_path"),
    Case("spatial-prices", 24, {"tax": (0.0, 18.0)}),
)


def test_exact_breakpoints_of_the_line_of_murty_are_its_whole_numbers() -> None:
    first, last = (gallery.make("all-cones", 6, t=t) for t in (-1.0, 63.0))
    found = exact_shares(path(first, last), 1000)
    assert found == [(k, Fraction(k, 64)) for k in range(1, 64)]
    assert len(exact_shares(path(first, last), 10)) == 10


def test_exact_breakpoints_with_bounds_are_those_of_a_hand_calculation() -> None:
    """z_1 = (6 s - 1/2) / 3 between 0 and 1; z_2 is positive from the start."""
    M = [[3.0, 0.0], [0.0, 3.0]]
    first, last = (Problem(M, q, upper=[1, np.inf]) for q in ([0.5, -1], [-5.5, -7]))
    followed = path(first, last)
    assert exact_shares(followed, 10) == [(1, Fraction(1, 12)), (2, Fraction(7, 12))]
    assert followed.t.tolist() == pytest.approx([0, 1 / 12, 7 / 12, 1])


def test_moving_bounds_count_in_exact_breakpoints() -> None:
    """z_1 = 1 + s meets the bound 3 - 2 s at s = 2/3."""
    first, last = Problem([[1.0]], [-1], upper=3), Problem([[1.0]], [-2], upper=1)
    exact = exact_shares(path(first, last), 10)
    assert [share.limit_denominator(10**9) for _, share in exact] == [Fraction(2, 3)]
    assert abs(exact[0][1] - Fraction(2, 3)) < Fraction(1, 10**100)


def test_a_singular_basis_has_no_exact_breakpoint() -> None:
    first, last = Problem(np.ones((2, 2)), [-1, -1]), Problem(np.ones((2, 2)), [-1, 1])
    family = path(first, last).family
    assert ExactBreakpoints(family).share(np.zeros(2, dtype=int), 0, -1) is None


def test_frontier_and_lasso_agree_with_exact_breakpoints_as_others_do() -> None:
    for case in CASES:
        row = measure(case, 0.0)
        assert (row.end, row.verified) == ("reached", True)
        assert row.error is not None
        assert row.error < 1e-12
        assert len(row.seconds) == 3
        is_there = bool(case.peer) and registry.installed(registry.FOLLOWERS[case.peer][0]) is not None
        assert (row.ratio is not None) == is_there
        assert bool(row.missing) == (bool(case.peer) and not is_there)
        if is_there:
            assert row.peer_breakpoints is not None
            assert row.peer_breakpoints >= row.breakpoints  # cvxcla lists points at which nothing changes
            assert row.peer_error is not None
            assert row.peer_error < 1e-12


def test_the_error_of_a_wrong_peer_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paths, "installed", lambda _: "1.0")
    monkeypatch.setattr(followers, "lars_path", lambda X, y: np.linspace(1, 0, 5) * abs(X.T @ y).max())
    row = measure(CASES[1], 0.0)
    assert row.peer_breakpoints == 5
    assert row.peer_error is not None
    assert row.peer_error > 1e-3
    assert row.error is not None
    assert row.error < 1e-12


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two cases, whose peers are not installed."""
    monkeypatch.setattr(paths, "CASES", CASES[1:])
    monkeypatch.setattr(paths, "installed", lambda _: None)


@pytest.mark.usefixtures("few")
def test_the_table_says_what_to_install(lcp: Lcp) -> None:
    outcome = lcp("bench", "path", "--budget", "0")
    assert outcome.code == 0
    assert "lasso penalty=1..0" in outcome.out
    assert "not installed: scikit-learn; pip install 'linear-complementarity[peers]'" in outcome.out.replace("\n", " ")


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("form", "start"),
    [("csv", "# "), ("markdown", "## lcp bench path: 2 paths"), ("latex", "% "), ("html", "<!DOCTYPE html>")],
)
def test_the_table_comes_in_the_formats_of_benches(form: str, start: str, lcp: Lcp) -> None:
    outcome = lcp("bench", "path", "--budget", "0", "--format", form)
    assert outcome.code == 0
    assert outcome.out.lower().startswith(start.lower())
    assert "spatial-prices" in outcome.out


@pytest.mark.usefixtures("few")
def test_json_has_all_times(lcp: Lcp, tmp_path: Any) -> None:
    file = tmp_path / "paths.json"
    assert lcp("bench", "path", "--budget", "0", "-o", str(file), "-q").out == ""
    rows = json.loads(file.read_text())["paths"]
    assert [row["path"] for row in rows] == ["lasso penalty=1..0", "spatial-prices tax=0..18"]
    assert all(len(row["seconds"]) == 3 for row in rows)
    assert [row["missing"] for row in rows] == ["scikit-learn", ""]


@pytest.mark.usefixtures("few")
def test_an_interrupted_path_ends_the_bench_with_what_is_measured(monkeypatch: pytest.MonkeyPatch, lcp: Lcp) -> None:
    follow = paths.path

    def interrupted(problem: Problem, to: Problem) -> Path:
        return replace(follow(problem, to), end="interrupted" if problem.is_mixed else "reached")

    monkeypatch.setattr(paths, "path", interrupted)
    outcome = lcp("bench", "path", "--budget", "0")
    assert outcome.code == 130
    assert "lasso" in outcome.out
    assert "spatial-prices" not in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--method", "shi"), "--method: has no effect on lcp bench path"),
        (("--peer", "piqp"), "--peer: has no effect"),
        (("--plot", "a.svg"), "--plot: has no effect"),
        (("quick",), "path: is measured alone"),
    ],
)
def test_what_has_no_effect_on_paths_is_refused(arguments: tuple[str, ...], words: str, lcp: Lcp) -> None:
    outcome = lcp("bench", "path", *arguments)
    assert outcome.code == 2
    assert words in outcome.err
