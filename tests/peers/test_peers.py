"""Other solvers: what they claim is passed on as it is, what they exclude has a reason,
what they lack is said."""

import os
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.files import reading
from lcpcli.gallery import families as gallery
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.peers import packages
from lcpcli.peers import registry as peers
from lcpcli.verify.point import Criterion, Point

from .. import literature

TOL, TIME_LIMIT = 1e-9, 20.0
INDEFINITE = Problem([[0, 1], [1, 0]], [-1, -1])
QUADRATIC = ("piqp", "daqp", "highs")
# Those that take more than games.
GENERAL = [name for name in peers.PEERS if name != "gambit"]
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
TRIDIAGONAL = sparse.csr_array(
    sparse.diags_array(
        [-np.ones(29), np.full(30, 3.0), -np.ones(29)], offsets=[-1, 0, 1]
    )
)


def loaded(name):
    """The peer of that name; the test is skipped where it is not installed, and where
    its licence has expired."""
    peer = peers.load(name)
    if peer.version() is None:
        pytest.skip(f"{name} is not installed")
    if (reason := peer.excludes(Problem([[1]], [1]))).startswith("licence"):
        pytest.skip(reason)
    return peer


def relative_residual(problem, claim):
    assert claim.z is not None
    return Point(Criterion(problem), claim.z, is_admissible=False).scaled_residual


COMPILING = pytest.param("quantecon", marks=pytest.mark.slow("numba compiles it"))


@pytest.mark.parametrize(
    "name", [name if name != "quantecon" else COMPILING for name in GENERAL]
)
def test_claims_what_it_solves_and_leaves_read_only_arrays_as_they_were(name):
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
def test_a_quadratic_program_needs_symmetry_and_convexity(name):
    """But daqp takes a monotone problem that is not symmetric."""
    peer, skew = peers.load(name), gallery.make("harker-pang", 20)
    assert peer.excludes(INDEFINITE).startswith("needs ")
    assert peer.excludes(skew) == (
        "" if name == "daqp" else "needs a symmetric positive semidefinite M"
    )
    if name == "daqp":
        claim = loaded(name).solve(skew, TOL, TIME_LIMIT)
        assert claim.solved
        assert relative_residual(skew, claim) < TOL


def test_matrices_are_converted_up_to_a_size_and_some_solvers_take_no_bounds():
    n = packages.MAX_CONVERTED + 1
    large = Problem(sparse.eye_array(n, format="csr"), -np.ones(n))
    highs, quantecon = peers.load("highs"), peers.load("quantecon")
    told = "takes dense matrices only; others are converted up to n = 2000"
    assert quantecon.excludes(large) == told
    boxes = gallery.make("boxes", 5)
    assert quantecon.excludes(boxes) == "takes no bounds but z >= 0"
    assert highs.excludes(large) == ""
    dense = Problem(np.eye(n), -np.ones(n))
    assert highs.excludes(dense).startswith("takes sparse")


@settings(max_examples=30)
@given(
    st.integers(1, 6),
    st.integers(1, 6),
    st.integers(0, 2**32 - 1),
    st.booleans(),
    st.booleans(),
)
def test_gram_matrices_in_any_units_are_semidefinite_but_not_if_turned(
    n, rank, seed, turned, stored_sparse
):
    random = np.random.default_rng(seed)
    A = random.integers(-3, 4, (min(rank, n), n)).astype(float)
    units = np.exp2(random.integers(-30, 31, n))
    M = A.T @ A
    if turned:
        v = random.integers(1, 4, n).astype(float)  # v'Mv = |Av|^2 - |Av|^2 - |v|^4 < 0
        M = M - np.outer(v, v) * (1 + float(np.sum((A @ v) ** 2)) / float(v @ v) ** 2)
    M = units[:, None] * M * units
    # The second one is semidefinite only if its row is empty.
    for each in (M, np.array([[0, 1e-12 * turned], [1e-12 * turned, 1]])):
        stored = sparse.csr_array(each) if stored_sparse else each
        found = packages.not_convex(Problem(stored, np.ones(len(each))))
        assert (found == "") is not turned


# Where it is not the name.
MODULES = {"highs": "highspy", "path-start": "gamspy_base", "gambit": "pygambit"}


@pytest.mark.parametrize("name", peers.PEERS)
def test_a_missing_package_has_no_version_and_solving_names_it(name, monkeypatch):
    peer, module = peers.load(name), MODULES.get(name, name)
    for known in [module, *(m for m in sys.modules if m.startswith(f"{module}."))]:
        monkeypatch.delitem(sys.modules, known, raising=False)
    monkeypatch.setattr(sys, "path", [p for p in sys.path if "site-packages" not in p])
    with pytest.raises(OptionError, match=rf"needs {module}; pip install {module}$"):
        peer.solve(INDEFINITE, TOL, 1.0)
    assert peer.version() is None


@pytest.mark.parametrize(
    ("lacking", "error"), [("daqp", OptionError), ("cdaqp", ModuleNotFoundError)]
)
def test_a_solver_is_missing_only_where_it_is_what_is_not_found(
    lacking, error, monkeypatch
):
    def find(_):
        raise ModuleNotFoundError(f"No module named {lacking!r}", name=lacking)

    monkeypatch.setattr(packages, "import_module", find)
    with pytest.raises(error, match=f"needs {lacking}|module named '{lacking}'"):
        peers.load("daqp").solve(INDEFINITE, TOL, 1.0)


def test_a_prefix_selects_each_peer_once_and_an_unknown_peer_gets_a_hint():
    assert peers.select(["path-start", "path"]) == ["path-start"]
    assert peers.select([]) == []
    for call in (partial(peers.select, ["daqp", "PIPQ"]), partial(peers.load, "PIPQ")):
        with pytest.raises(OptionError, match=r"'PIPQ' .*; .*piqp"):
            call()


@pytest.mark.slow("compiles a solver in a process of its own")
def test_nothing_is_compiled_while_the_clock_runs():
    loaded("quantecon")
    done = subprocess.run(
        [sys.executable, "-c", COMPILED], capture_output=True, text=True, check=True
    )
    before, after = done.stderr.split()
    assert before == after == "1"


ENDINGS = {
    "import os; os.abort()": "failed with exit code -6",
    "import time; time.sleep(600)": "stopped at the time limit",
}


@pytest.mark.parametrize("action", ENDINGS)
def test_a_process_that_dies_or_hangs_is_told_from_one_that_answers(
    action, monkeypatch
):
    if os.name != "posix":
        pytest.skip("exit codes differ")
    monkeypatch.setattr(packages, "SOLVE", action)
    monkeypatch.setattr(
        packages, "SECONDS_TO_LOAD", 0.1 if "sleep" in action else 300.0
    )
    claim = loaded("gambit").solve(gallery.make("bimatrix", 4), TOL, 0.1)
    assert claim.z is None
    assert not claim.solved
    assert claim.statement == ENDINGS[action]


def test_highs_is_not_led_astray_by_a_degenerate_problem_without_rows():
    problem = Problem([[7, 4, -7], [4, 20, 0], [-7, 0, 11]], [4, -20, -11])
    claim = loaded("highs").solve(problem, TOL, TIME_LIMIT)
    assert claim.z == pytest.approx([0, 1, 1])
    assert claim.solved


@pytest.mark.parametrize("name", [name for name in GENERAL if name != "quantecon"])
@pytest.mark.parametrize("family", ["boxes", "torsion", "two-obstacles"])
def test_quadratic_programming_solvers_get_the_bounds(family, name):
    peer, problem = loaded(name), gallery.make(family, 25)
    assert peer.excludes(problem) == ""
    claim = peer.solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert claim.z is not None
    assert np.abs(claim.z - lcpcli.run(problem).z).max() <= 1e-4


def test_gambit_takes_games_only():
    peer = peers.load("gambit")
    assert (
        peer.excludes(gallery.make("bimatrix", 11))
        == peer.excludes(reading.read("winkels"))
        == ""
    )
    others = Problem([[0, 1], [1, 0]], [-1, -2]), Problem([[-1, 1], [1, 0]], [-1, -1])
    for other in (gallery.make("boxes", 5), *others):
        assert peer.excludes(other) == "takes games of two players only"


@pytest.mark.slow("pygambit takes a second to load")
def test_gambit_finds_an_equilibrium():
    problem = gallery.make("bimatrix", 11)
    claim = loaded("gambit").solve(problem, TOL, TIME_LIMIT)
    assert claim.solved
    assert relative_residual(problem, claim) < 1e-12
    assert claim.seconds > 0


@pytest.mark.parametrize(
    "problem",
    [literature.josephy(), literature.mathiesen(), literature.nash_cournot(5)],
)
def test_library_of_path_solves_nonlinear_problems_by_their_functions(problem):
    claim = loaded("path-start").solve(problem, 1e-10, TIME_LIMIT)
    assert claim.solved
    assert claim.statement == "solution found"
    assert claim.z is not None
    gaps = problem.box.gaps(claim.z, problem.values(claim.z))
    assert np.abs(gaps).max() < 1e-8


def test_library_of_path_excludes_what_its_licence_does_not_cover():
    peer = loaded("path-start")
    if not (reason := peer.excludes(gallery.make("tridiagonal", 301))):
        pytest.skip("a full licence is installed")
    assert (
        reason
        == "licence: without one, up to 300 unknowns and 2000 entries of the Jacobian"
    )
    assert peer.excludes(gallery.make("tridiagonal", 300)) == ""
    filling = NonlinearProblem(
        lambda z: z - 1, lambda z: np.eye(50) + (z[0] > 0), x0=np.zeros(50)
    )
    assert peer.excludes(filling) == ""
    assert (
        "has more than 2000 entries" in peer.solve(filling, TOL, TIME_LIMIT).statement
    )


def test_errors_of_functions_called_by_path_are_raised():
    def faulty(z):
        if z[0]:
            raise RuntimeError("not again")
        return [z[0] - 1.0]

    with pytest.raises(RuntimeError, match="not again"):
        loaded("path-start").solve(
            NonlinearProblem(faulty, lambda _: [[1.0]], x0=[0.0]), TOL, TIME_LIMIT
        )


def test_a_missing_library_is_the_reason_why_a_problem_is_excluded(monkeypatch):
    monkeypatch.setattr(packages.PackageSolver, "version", lambda _: None)
    assert (
        peers.load("path-start").excludes(INDEFINITE)
        == "needs gamspy_base; pip install gamspy_base"
    )
