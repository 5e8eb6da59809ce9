"""PATH and Gambit, which run in processes of their own: what they are given, what they say, and what ends them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import reading
from lcpcli.gallery import families as gallery
from lcpcli.gallery import nonlinear
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.peers import path
from lcpcli.peers import registry as peers

from .claims import INDEFINITE, TIME_LIMIT, TOL, loaded, relative_residual, stand_in


def test_path_takes_what_gams_would_refuse() -> None:
    peer = loaded("path-zeros")
    for q, solved in (([1.0, 0, 2], True), ([-1.0, 0, 1], False)):  # equations without variables
        claim = peer.solve(Problem(np.zeros((3, 3)), q), TOL, TIME_LIMIT)
        assert (claim.solved, claim.statement) == (solved, "solution found" if solved else "infeasible")
    claim = peer.solve(Problem([[1e300]], [-1]), TOL, TIME_LIMIT)
    assert (claim.z, claim.solved) == (None, False)
    assert "errors" in claim.statement


def test_path_starts_from_zero_or_one_and_its_tolerance_grows_with_q() -> None:
    problem = Problem([[1, 2], [3, 1]], [-1, -1])  # solutions (1, 0), (0, 1), (0.2, 0.4)
    for name in peers.select(["path"]):
        claim = loaded(name).solve(problem, TOL, TIME_LIMIT)
        assert claim.solved
        assert relative_residual(problem, claim) < TOL
    large = gallery.make("boxes", 300)
    assert loaded("path-zeros").solve(large, 1e-10, TIME_LIMIT).solved


def test_path_reports_its_own_seconds_and_stops_at_the_time_limit() -> None:
    problem = Problem(np.random.default_rng(0).standard_normal((150, 150)), -np.ones(150))
    claim = loaded("path-zeros").solve(problem, TOL, 0.001)
    assert (claim.solved, claim.statement) == (False, "time limit")
    assert 0 < claim.seconds < 1


def test_problems_beyond_the_licence_of_path_are_excluded_with_what_gams_says() -> None:
    peer = loaded("path-zeros")
    if "demo" not in (reason := peer.excludes(gallery.make("tridiagonal", 1001))):
        pytest.skip("a full licence is installed")
    assert reason.startswith("licence: The model exceeds the demo license limits")
    assert peer.excludes(gallery.make("tridiagonal", 1000)) == ""


@pytest.fixture
def gams(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Path]]:
    """Put a script in place of GAMS."""
    monkeypatch.setitem(sys.modules, path.PACKAGE, SimpleNamespace(directory=str(tmp_path)))
    monkeypatch.setattr(path.path_zeros, "version", lambda: "1")
    path._refusal.cache_clear()
    yield lambda text: stand_in(tmp_path / "gams", text)
    path._refusal.cache_clear()


def test_an_expired_licence_excludes_every_problem(gams: Callable[[str], Path]) -> None:
    gams("echo '--- Job'; echo '*** Time-limited license expired 3 days ago'; exit 7")
    assert peers.load("path-zeros").excludes(INDEFINITE) == "licence: Time-limited license expired 3 days ago"


def test_a_gams_that_ends_without_an_answer_gives_an_unsolved_claim(
    gams: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    gams("exec sleep 20")
    monkeypatch.setattr(path, "START_SECONDS", 0.1)
    claim = peers.load("path-zeros").solve(INDEFINITE, TOL, 0.1)
    assert (claim.z, claim.solved, claim.statement) == (None, False, "stopped at the time limit")


def test_gambit_takes_games_and_finds_an_equilibrium() -> None:
    peer, problem = peers.load("gambit"), gallery.make("bimatrix", 11)
    assert peer.excludes(problem) == peer.excludes(reading.read("winkels")) == ""
    for other in (gallery.make("boxes", 5), gallery.make("lp", 6), Problem([[0, 1], [1, 0]], [-1, -2])):
        assert peer.excludes(other) == "takes games of two players only"
    claim = loaded("gambit").solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) < 1e-12
    assert 0 < claim.seconds < 1


@pytest.mark.parametrize("problem", [nonlinear.josephy(), nonlinear.mathiesen(), nonlinear.nash_cournot(5)])
def test_library_of_path_solves_nonlinear_problems_by_their_functions(problem: NonlinearProblem) -> None:
    claim = loaded("path-start").solve(problem, 1e-10, TIME_LIMIT)
    assert (claim.solved, claim.statement) == (True, "solution found")
    assert claim.z is not None
    gaps = problem.box.gaps(claim.z, problem.values(claim.z))
    assert np.abs(gaps).max() < 1e-8


def test_library_of_path_solves_linear_problems_with_bounds() -> None:
    problem = gallery.make("boxes", 30)
    claim = loaded("path-start").solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) < 1e-6


def test_library_of_path_excludes_what_its_licence_does_not_cover() -> None:
    peer = loaded("path-start")
    if not (reason := peer.excludes(gallery.make("tridiagonal", 301))):
        pytest.skip("a full licence is installed")
    assert reason == "licence: without one, up to 300 unknowns and 2000 entries of the Jacobian"
    assert peer.excludes(gallery.make("tridiagonal", 300)) == ""
    filling = NonlinearProblem(lambda z: z - 1, lambda z: np.eye(50) + (z[0] > 0), x0=np.zeros(50))
    assert peer.excludes(filling) == ""
    assert "has more than 2000 entries" in peer.solve(filling, TOL, TIME_LIMIT).statement


def test_errors_of_functions_called_by_path_are_raised() -> None:
    def faulty(z: np.ndarray) -> list[float]:
        if z[0]:
            raise RuntimeError("not again")
        return [z[0] - 1.0]

    with pytest.raises(RuntimeError, match="not again"):
        loaded("path-start").solve(NonlinearProblem(faulty, lambda _: [[1.0]], x0=[0.0]), TOL, TIME_LIMIT)
