"""`lcpcli.solve` takes M and q in any form, leaves them unchanged, and returns a
result; options are checked before anything is solved, so that a mistake shows whatever
the problem is. A problem without unknowns, as a time step without contacts is, has one
solution, the empty vector.
"""

import re
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Status, solve
from lcpcli.errors import ProblemError
from lcpcli.methods.registry import METHODS, Method, options_of, parameters_of
from lcpcli.options import Option
from lcpcli.solving.call import (
    COMMON_OPTIONS,
    NonlinearOptions,
    RunOptions,
    SolverOptions,
)

M = [[2.0, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 2.0]]
Q = [-5.0, -6.0, 1.0]
Z = [1.8, 1.4, 0.0]


def test_starts_and_q_are_never_changed():
    given = {"q": np.array(Q), "x0": np.full(3, 2.0), "x1": np.full(3, 1.0)}
    before = {name: array.tolist() for name, array in given.items()}
    assert solve(M, **given, method="shi", trace=True).z == pytest.approx(Z, abs=1e-8)
    assert {name: array.tolist() for name, array in given.items()} == before
    z = np.array(Z)
    result = solve(M, Q, z0=z)
    assert result.iterations == 0
    assert z.tolist() == Z
    assert result.z is not z


def test_solve_and_run_take_the_same_options():
    for call in (
        partial(solve, M, Q),
        partial(lcpcli.run, lcpcli.Problem(M, Q)),
    ):
        assert call().method == "auto"
        assert call(max_iterations=0).status is Status.ITERATION_LIMIT
        assert call(time_limit=1e-9).status is Status.TIME_LIMIT
        assert call(method="shi", tol=0.5).iterations < call(method="shi").iterations
        trace = lcpcli.Trace(every=2)
        assert call(method="shi", trace=trace).trace is trace
        options = {"p": 1e9, "k_star": 3, "rho": 0.01, "sigma": 0.5, "x1": None}
        assert call(method="shi", **options).options == options


def test_options_for_type_checkers_are_those_of_the_calls_and_of_the_registry():
    declared = {*RunOptions.__annotations__}
    assert declared == {
        *COMMON_OPTIONS,
        *(name for method in METHODS for name in parameters_of(method)),
    }
    assert all(re.search(rf"\b{name}\b", solve.__doc__) for name in COMMON_OPTIONS)
    assert all(
        re.search(rf"\b{name}\b", lcpcli.solve_mcp.__doc__)
        for name in NonlinearOptions.__annotations__
    )
    assert all(
        re.search(rf"\b{name}\b", lcpcli.Solver.__doc__)
        for name in SolverOptions.__annotations__
    )


def test_methods_may_share_an_option_and_no_name_belongs_to_two():
    one, same = (
        Option("tol", float, 1e-10, "0 < tol", lambda tol: tol > 0, "It ends.")
        for _ in range(2)
    )
    assert options_of({"one": Method("", (one,)), "other": Method("", (one,))}) == {
        "tol": one
    }
    with pytest.raises(ValueError, match=r"^one and other have two options tol: "):
        options_of({"one": Method("", (one,)), "other": Method("", (same,))})


NONE, SPARSE = np.zeros((0, 0)), csr_array((0, 0))
BOTH = pytest.mark.parametrize("M", [NONE, SPARSE], ids=["dense", "sparse"])


def is_solved(result):
    """Whether the empty vector is the solution, and a result of it can be shown in
    every way."""
    assert result.to_dict()["z"] == result.digits == result.basis == []
    assert "n = 0" in repr(result)
    return (
        result.solved
        and result.z.shape == (0,)
        and result.residual == result.relative_residual == 0
    )


@pytest.mark.parametrize(
    "bounds", [{}, {"lower": [], "upper": []}, {"lower": None, "upper": 1.0}]
)
def test_all_ways_to_solve_end_at_the_empty_vector(bounds):
    for M in (NONE, SPARSE, []):
        for start in (
            {},
            {"z0": []},
            {"basis": []},
            {"callback": print},
        ):
            assert is_solved(solve(M, [], **bounds, **start))
        assert "()" in solve(M, [], **bounds)._repr_html_()
        solver = lcpcli.Solver(M, **bounds)
        results = [solver.solve([]), solver.solve([], lower=-1.0)]
        solver.update(M)
        assert all(map(is_solved, [*results, solver.solve([])]))
        for Q in (np.zeros((0, 1)), np.zeros((0, 8)), iter([[], []])):
            assert all(map(is_solved, lcpcli.solve_many(M, Q, **bounds)))


@pytest.mark.parametrize("method", METHODS)
def test_every_method_solves_it_before_its_first_iteration(method):
    for M in (NONE, SPARSE):
        result = solve(M, [], method, trace=True)
        assert is_solved(result)
        assert result.route == (method,)
        assert result.iterations == 0
        if METHODS[method].iterates:
            assert is_solved(solve(M, [], method, scale=True, finish=True))


@BOTH
def test_the_empty_vector_is_the_only_solution_and_the_matrix_is_described(M):
    problem = Problem(M, [], names=[], solutions=[[]])
    result = lcpcli.run(problem)
    found = lcpcli.solutions(problem)
    path = lcpcli.path(problem, problem)
    inspected = lcpcli.inspect(problem)
    assert result.error == 0
    assert [piece.vertices for piece in found] == [((),)]
    assert found.complete
    assert lcpcli.error_bound(problem, []).value == 0
    assert lcpcli.check(problem, []).accepted
    assert not lcpcli.check(problem, y=[]).accepted
    assert {verdict.word for verdict in inspected.classes.values()} == {"yes"}
    assert repr(inspected).startswith("problem: n = 0\n")
    assert path.verified
    assert path(0.5).shape == (0,)
    assert (
        result.derivative(dq=[]).z.size
        == result.derivative(dM=M).w.size
        == result.gradient([]).q.size
        == 0
    )
    assert lcpcli.plan(problem)[0].method == "newton"
    pytest.importorskip("flint")
    assert lcpcli.exact(problem).exact.z == []


@BOTH
def test_files_hold_it_but_for_csv(tmp_path, M):
    for files in (
        ["p.json"],
        ["p.npz"],
        ["p.mat"],
        ["p.npy", "p.q.npy"],
        ["p.mtx", "p.q.mtx"],
    ):
        lcpcli.write(Problem(M, []), tmp_path / files[0])
        assert is_solved(lcpcli.run(lcpcli.read(*(tmp_path / name for name in files))))
    with pytest.raises(
        ProblemError,
        match=r"p\.csv: cannot hold a problem without unknowns; write \.json$",
    ):
        lcpcli.write(Problem(M, []), tmp_path / "p.csv")
    assert not (tmp_path / "p.csv").exists()


def test_integers_of_numpy_are_checked_without_overflow():
    """4 times 2^62 is 0 in arithmetic modulo 2^64."""
    problem = Problem([[1, 0], [0, 4]], [-0.5, 0])
    z = [Fraction(1, 2), np.int64(2**62)]
    assert not lcpcli.check(problem, z=z).accepted
    y = [Fraction(4, 3), 10**400]
    assert not lcpcli.check(problem, z=y).accepted
