"""PATH and Gambit, which run in processes of their own: what they are given, what they say, and what ends them."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import reading
from lcpcli.gallery import families as gallery
from lcpcli.gallery import nonlinear
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.peers import registry as peers

from .claims import TIME_LIMIT, TOL, loaded, relative_residual


def test_gambit_takes_games_and_finds_an_equilibrium() -> None:
    peer, problem = peers.load("gambit"), gallery.make("bimatrix", 11)
    assert peer.excludes(problem) == peer.excludes(reading.read("winkels")) == ""
    for other in (gallery.make("boxes", 5), gallery.make("lp", 6), Problem([[0, 1], [1, 0]], [-1, -2])):
        assert peer.excludes(other) == "takes games of two players only"
    claim = loaded("gambit").solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) < 1e-12
    assert claim.seconds > 0


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
