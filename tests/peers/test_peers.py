"""Other solvers: what they claim is passed on as it is, what they exclude has a reason, what they lack is said."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.gallery import families as gallery
from lcpcli.peers import packages, quadratic, registry
from lcpcli.peers import registry as peers

from .claims import INDEFINITE, TIME_LIMIT, TOL, loaded, relative_residual, stand_in

QUADRATIC = ("piqp", "clarabel", "osqp", "daqp", "highs")
GENERAL = [name for name in peers.PEERS if name != "gambit"]  # those that take more than games
COMPILED = """
import sys
import numpy as np
from quantecon.optimize import lcp_lemke
from lcpcli import Problem
from lcpcli.peers import packages
from lcpcli.peers.registry import load
problem = Problem(np.eye(3, order="F"), -np.ones(3))
problem.M.setflags(write=False)
clock = packages.clock.seconds
def spy():
    print(len(lcp_lemke.signatures), file=sys.stderr)
    return clock()
packages.clock.seconds = spy
load("quantecon").solve(problem, 1e-9, 9.0)
"""
INFEASIBLE = Problem([[1, -1], [-1, 1]], [-1, 0])
TRIDIAGONAL = sparse.csr_array(sparse.diags_array([-np.ones(29), np.full(30, 3.0), -np.ones(29)], offsets=[-1, 0, 1]))


@pytest.mark.parametrize("name", GENERAL)
def test_claims_what_it_solves_and_leaves_arrays_as_they_were_even_those_that_cannot_be_written_to(name: str) -> None:
    peer, made = loaded(name), gallery.make("harker-pang", 8, 2, symmetric=True)
    M, q = np.asfortranarray(made.M), made.q.copy()
    for array in (M, q):
        array.setflags(write=False)
    for problem in (Problem(TRIDIAGONAL, np.cos(np.arange(30))), Problem(M, q)):
        assert peer.excludes(problem) == ""
        claim = peer.solve(problem, TOL, TIME_LIMIT)
        assert claim.solved, claim.statement
        assert relative_residual(problem, claim) < 1e-6
        assert claim.seconds > 0
    assert np.array_equal(M, made.M)
    claim = peer.solve(INFEASIBLE, TOL, 0.3)
    assert not claim.solved
    assert claim.statement


@pytest.mark.parametrize("name", QUADRATIC)
def test_a_quadratic_program_needs_symmetry_and_convexity(name: str) -> None:
    peer, skew = peers.load(name), gallery.make("harker-pang", 8)
    assert peer.excludes(INDEFINITE).startswith("needs ")
    assert peer.excludes(skew) == ("" if name == "daqp" else "needs a symmetric positive semidefinite M")


def test_daqp_takes_a_monotone_problem_that_is_not_symmetric() -> None:
    problem, peer = gallery.make("harker-pang", 20), peers.load("daqp")
    assert peer.excludes(problem) == ""
    claim = peer.solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) < TOL


def test_matrices_are_converted_up_to_a_size() -> None:
    n = quadratic.MOST_CONVERTED + 1
    large = Problem(sparse.eye_array(n, format="csr"), -np.ones(n))
    assert peers.load("quantecon").excludes(large) == "takes dense matrices only; others are converted up to n = 2000"
    assert peers.load("osqp").excludes(large) == ""
    assert peers.load("osqp").excludes(Problem(np.eye(n), -np.ones(n))).startswith("takes sparse")


@settings(max_examples=30)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_gram_matrices_in_any_units_are_semidefinite_and_not_when_a_direction_is_turned_round(
    n: int, rank: int, seed: int, turned: bool, stored_sparse: bool
) -> None:
    random = np.random.default_rng(seed)
    A = random.integers(-3, 4, (min(rank, n), n)).astype(float)
    units = np.exp2(random.integers(-30, 31, n))
    M = A.T @ A
    if turned:
        v = random.integers(1, 4, n).astype(float)  # v'Mv = |Av|^2 - |Av|^2 - |v|^4 < 0
        M = M - np.outer(v, v) * (1 + float(np.sum((A @ v) ** 2)) / float(v @ v) ** 2)
    M = units[:, None] * M * units
    problem = Problem(sparse.csr_array(M) if stored_sparse else M, np.ones(n))
    assert (quadratic.not_convex(problem) == "") is not turned


def test_a_hollow_diagonal_is_semidefinite_only_if_its_rows_are_empty() -> None:
    assert quadratic.not_convex(Problem([[0, 0], [0, 1]], [1, 1])) == ""
    assert quadratic.not_convex(Problem([[0, 1e-12], [1e-12, 1]], [1, 1])) != ""


MODULES = {
    "highs": "highspy",
    "path-start": "gamspy_base",
    "gambit": "pygambit",
}  # where it is not the name


@pytest.mark.parametrize("name", ["piqp", "daqp", "clarabel", "osqp", "highs", "quantecon", "path-start", "gambit"])
def test_a_missing_package_has_no_version_and_solving_names_the_extra(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    peer, module = peers.load(name), MODULES.get(name, name)
    for known in [module, *(m for m in sys.modules if m.startswith(f"{module}."))]:
        monkeypatch.delitem(sys.modules, known, raising=False)
    monkeypatch.setattr(sys, "path", [p for p in sys.path if "site-packages" not in p])
    with pytest.raises(OptionError, match=rf"{module} is not installed; pip install '.*\[peers\]'"):
        peer.solve(INDEFINITE, TOL, 1.0)
    assert peer.version() is None


def test_a_new_peer_needs_only_its_call_and_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def guess(_: Any, problem: Problem, *__: Any) -> packages.Ending:
        return np.zeros(problem.n), None, True, "guessed"

    monkeypatch.setattr(packages, "toy_one", packages.PackageSolver("numpy", guess, ()), raising=False)
    monkeypatch.setitem(peers.REGISTRY, "toy-one", ("packages", "guesses zero"))
    assert peers.load("toy-one").version() == np.__version__
    assert peers.select(["toy"]) == ["toy-one"]
    claim = peers.load("toy-one").solve(INDEFINITE, TOL, 1.0)
    assert (claim.solved, claim.statement) == (True, "guessed")


def test_a_prefix_selects_all_of_a_package_once_and_an_unknown_peer_is_refused_with_a_likely_one() -> None:
    assert peers.select(["path-start", "path"]) == ["path-start"]
    assert peers.select([]) == []
    for name, hint in {"PIPQ": "did you mean piqp", "zzz": "choose one of quantecon, "}.items():
        for call in (partial(peers.select, ["daqp", name]), partial(peers.load, name)):
            with pytest.raises(OptionError, match=f"'{name}' is unknown; {hint}"):
                call()


@pytest.mark.slow("compiles a solver in a process of its own")
def test_nothing_is_compiled_while_the_clock_runs() -> None:
    loaded("quantecon")
    done = subprocess.run([sys.executable, "-c", COMPILED], capture_output=True, text=True, check=True)
    before, after = done.stderr.split()
    assert before == after == "1"


ENDINGS = {
    "kill -SEGV $$": "killed by SIGSEGV",
    "exit 3": "failed with exit code 3",
    "echo ready; exec sleep 600": "stopped at the time limit",
}


@pytest.mark.parametrize("action", ENDINGS)
def test_a_process_that_dies_or_hangs_is_told_from_one_that_answers(action: str, tmp_path: Path) -> None:
    ending, seconds = registry.run([str(stand_in(tmp_path / "program", action))], 0.1)
    assert ending == ENDINGS[action]
    assert seconds < 300


SEEN = {"piqp": "0.6.4", "clarabel": "0.11.1", "osqp": "1.1.3", "daqp": "0.11.0", "highs": "1.15.1"}
UNITS = [
    *((name, version, 1e-12, 1e-12) for name, version in SEEN.items()),
    ("quantecon", "0.11.4", 1.0, 1e-16),
]


@pytest.mark.parametrize(("name", "version", "M_unit", "q_unit"), UNITS)
def test_a_change_of_units_leads_peers_to_claims_that_the_residual_refutes(
    name: str, version: str, M_unit: float, q_unit: float
) -> None:
    peer = loaded(name)
    if peer.version() != version:
        pytest.skip(f"seen with version {version}")
    problem = Problem(M_unit * np.array([[2, 1], [1, 2]]), q_unit * np.array([-5, -6]))
    claim = peer.solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) > 0.05
    ours = lcpcli.run(problem, "auto")
    assert ours.solved
    assert np.allclose(ours.z, np.array([4, 7]) / 3 * (q_unit / M_unit), rtol=1e-12, atol=0)


def test_highs_is_not_led_astray_by_a_degenerate_problem_without_rows() -> None:
    problem = Problem([[7, 4, -7], [4, 20, 0], [-7, 0, 11]], [4, -20, -11])
    claim = loaded("highs").solve(problem, TOL, TIME_LIMIT)
    assert claim.z == pytest.approx([0, 1, 1])
    assert claim.solved


def test_osqp_gives_no_numbers_where_it_claims_that_there_are_none() -> None:
    claim = loaded("osqp").solve(INFEASIBLE, TOL, TIME_LIMIT)
    assert (claim.z, claim.statement) == (None, "dual infeasible")
