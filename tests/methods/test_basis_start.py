"""A start given by states: what newton makes of it, and how wrong ones are refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, Trace, run
from lcpcli.errors import LCPError
from lcpcli.files import contents, writing
from lcpcli.gallery import families
from lcpcli.gallery.differences import american_put
from lcpcli.methods.newton import from_start, from_states
from lcpcli.methods.stages import Finished, Iterate, advance
from lcpcli.model.box import in_words, of_masks
from lcpcli.model.start import basis_of_words, x_in
from lcpcli.verify.basic_solution import BasicSolutions

Lcp = Callable[..., Any]

MIXED = Problem(
    [[2, 1, 0], [1, 2, 1], [0, 1, 3]],
    [-5, -6, 4],
    lower=[-np.inf, 0, -1],
    upper=[np.inf, 2, np.inf],
)


def boxed(n: int, seed: int = 0) -> Problem:
    """A P-matrix with random boxes, from the origin several block steps away from the solution."""
    random = np.random.default_rng(seed)
    A, S = random.normal(size=(2, n, n))
    return Problem(A @ A.T + S - S.T + np.eye(n), 10 * random.normal(size=n), lower=-1, upper=random.random(n))


def orthant(n: int) -> Problem:
    """The same without upper bounds and z >= 0: an LCP."""
    problem = boxed(n)
    return Problem(problem.M, problem.q)


@pytest.mark.parametrize("size", [0.0, 1.0, 1e12, 1e300])
def test_start_stands_for_the_states_given_however_large_the_bounds(size: float) -> None:
    low = np.array([-size, -size, -size, -np.inf, -np.inf, -np.inf, size])
    high = np.array([np.inf, size + 1, 3 * size + 1, np.inf, -size, -size, size])
    states = ["basic", "lower", "upper", "basic", "basic", "upper", "lower"]
    problem = Problem(np.eye(7), np.zeros(7), lower=low, upper=high)
    basis = problem.box.basis_of(x_in(problem, basis_of_words(problem, states)))
    assert in_words(basis) == states


def test_newton_needs_one_step_from_the_basis_of_a_solution() -> None:
    for problem in (boxed(30), orthant(30)):
        first = run(problem, "newton")
        again = run(problem, "newton", basis=first.basis)
        assert first.solved
        assert again.solved
        assert (first.iterations > 1, again.iterations) == (True, 1)
        assert np.array_equal(again.z, first.z)


@pytest.mark.parametrize("problem", [boxed(30), orthant(30)], ids=["boxed", "LCP"])
def test_command_starts_from_a_list_of_states_or_from_an_earlier_result(
    lcp: Lcp, tmp_path: Path, problem: Problem
) -> None:
    names = ("problem.json", "result.json", "result.csv", "states.json")
    file, result, table, states = (str(tmp_path / name) for name in names)
    writing.write(problem, file)
    for output in (result, table):
        lcp("solve", file, "-o", output)
    basis = run(problem).basis
    Path(states).write_text(json.dumps(basis))
    for given in (result, table, states, ",".join(basis), " ".join(basis)):
        outcome = lcp("solve", file, "--method", "newton", "--basis", given, "--format", "json")
        assert json.loads(outcome.out)["iterations"] == 1


@pytest.mark.parametrize("family", ["american-put", "obstacle", "harker-pang", "degenerate", "boxes", "control"])
def test_auto_factorizes_the_basis_of_a_solution_once_and_is_done(family: str) -> None:
    problem = families.make(family, 300, 1)
    first = run(problem)
    again = run(problem, basis=first.basis)
    assert first.evaluations > 1
    assert (again.solved, again.iterations, again.evaluations, again.route) == (True, 1, 1, ("newton",))


@pytest.mark.parametrize("dense", [False, True])
def test_auto_exchanges_the_few_wrong_states_of_the_step_before(dense: bool) -> None:
    before, problem = (american_put(1000, 0, years=years) for years in (0.45, 0.5))
    if dense:
        problem = Problem(problem.M.toarray(), problem.q)
    basis = run(before).basis
    result = run(problem, basis=basis)
    changes = sum(old != new for old, new in zip(basis, result.basis, strict=True))
    assert result.solved
    assert 0 < changes <= 5
    assert result.iterations <= changes + 1


@pytest.mark.parametrize(("family", "n", "wrong"), [("harker-pang", 200, 10), ("obstacle", 400, 10)])
def test_pivoting_from_given_states_goes_on_as_long_as_it_is_fast(family: str, n: int, wrong: int) -> None:
    problem = families.make(family, n, 0)
    z = run(problem).z
    x = (z - problem.w(z)) / 2
    x[np.random.default_rng(0).permutation(n)[:wrong]] *= -1
    stage, steps = from_states(problem, problem.box.basis_of(x)), 0
    while isinstance(step := advance(stage), Iterate):
        steps += 1
    assert isinstance(step, Finished)
    assert steps > 3


def test_auto_leaves_a_basis_that_is_far_from_right_after_a_few_steps() -> None:
    problem = families.make("obstacle", 2500, 0)
    cold, result = run(problem), run(problem, basis=["lower"] * 2500)
    assert result.solved
    assert result.iterations <= cold.iterations + 15


def test_auto_solves_what_has_a_singular_basis() -> None:
    problem = Problem([[0, 0], [0, 0]], [0, 1])
    assert run(problem, basis=["basic", "basic"]).solved
    larger = families.make("contact", 100, 1)
    support = ["basic" if z > 0 else "lower" for z in run(larger).z]
    result = run(larger, basis=support)
    assert (result.solved, result.route[-1]) == (True, "lemke")


@pytest.mark.parametrize("n", [12, 60, 240])
def test_the_basis_at_which_a_path_ends_confirms_itself_where_contacts_are_redundant(n: int) -> None:
    problem = families.make("contact", n, 1)
    first = run(problem)
    again = run(problem, basis=first.basis)
    assert first.route == ("lemke",)
    assert (again.solved, again.route, again.iterations) == (True, ("newton",), 1)
    assert again.basis == first.basis


def test_start_by_states_stands_beside_a_warm_one(lcp: Lcp) -> None:
    basis = ",".join(["basic"] * 4)
    example = contents.shipped_path("paper-example-1.json")
    outcome = lcp("compare", example, "--method", "newton", "--basis", basis, "--warm", "1e-3", "--format", "json")
    assert [json.loads(line)["warm"] for line in outcome.out.splitlines()] == [False, True]


@pytest.mark.parametrize(
    ("basis", "said"),
    [
        (["basic", "basic"], "basis: has 2 entries for 3 unknowns"),
        (["basic", "top", "lower"], "basis[1]: is the text 'top'"),
        (["basic", 1, "lower"], "basis[1]: is a number"),
        (["upper", "upper", "lower"], "basis[0]: is upper, but there is no such bound"),
        (["lower", "upper", "lower"], "basis[0]: is lower, but there is no such bound"),
        ("basic", "basis: is the text 'basic'"),
        (7, "basis: is a number"),
    ],
)
def test_wrong_states_are_refused(basis: Any, said: str) -> None:
    with pytest.raises(LCPError) as refusal:
        run(MIXED, basis=basis)
    assert str(refusal.value).startswith(said)


def test_fixed_variable_cannot_be_basic() -> None:
    fixed = Problem([[1]], [1], lower=2, upper=2)
    with pytest.raises(LCPError, match=r"basis\[0\]: is basic, but that variable is fixed"):
        run(fixed, basis=["basic"])
    assert run(fixed, basis=["lower"]).solved


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--basis", "basic,upper"), "--basis: has 2 entries for 4 unknowns"),
        (("--basis", "basic,upper,lower,basic"), "--basis[1]: is upper, but there is no such bound"),
        (("--basis", "missing.json"), "--basis: 'missing.json' is neither a file nor states"),
        (("--basis", "Basic,basic,basic,basic"), "--basis[0]: is the text 'Basic'"),
        (("--basis", "basic,basic,basic,basic", "--z0", "1,1,1,1"), "gives the starting point, and so does"),
        (("--basis", "basic,basic,basic,basic", "--method", "lemke"), "uses no starting point"),
    ],
)
def test_command_refuses_in_one_line(lcp: Lcp, options: tuple[str, ...], said: str) -> None:
    outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), *options)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert said in outcome.err


@pytest.mark.parametrize(
    "content", ['{"x": 1}', '{"basis": 3}', "3", "{", '{"basis": ["basic"]}', "z\n1", "[1, 2, 0, 1]"]
)
def test_file_without_states_is_named(lcp: Lcp, tmp_path: Path, content: str) -> None:
    for suffix in (".json", ".csv", ".npy"):
        path = tmp_path / f"states{suffix}"
        path.write_text(content)
        outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), "--basis", str(path))
        assert (outcome.code, outcome.err.count("\n")) == (2, 1)
        assert path.name in outcome.err


@pytest.mark.parametrize(("family", "n"), [("obstacle", 900), ("harker-pang", 200)])
def test_auto_goes_on_from_its_own_start_where_a_basis_is_far_from_right(family: str, n: int) -> None:
    problem, cold, warm = families.make(family, n, 0), Trace(), Trace()
    basis = np.random.default_rng(0).choice(["lower", "basic"], problem.n).tolist()
    assert run(problem, trace=cold).solved
    assert run(problem, basis=basis, trace=warm).solved
    own = [row.z for row in cold.rows[1:]]
    assert len(warm.rows) >= len(cold.rows)
    assert all(map(np.array_equal, own, [row.z for row in warm.rows[-len(own) :]]))


def test_right_states_are_taken_where_m_is_far_from_monotone() -> None:
    problem = families.make("planted", 300, 0)
    states = ["basic" if z > 0 else "lower" for z in problem.solutions[0]]
    result = run(Problem(problem.M, problem.q), basis=states)
    assert (result.status.word, result.route, result.iterations) == ("solved", ("newton",), 1)


@pytest.mark.parametrize(("family", "n"), [("obstacle", 2500), ("harker-pang", 300)])
def test_states_that_are_far_from_right_cost_no_factorization(
    family: str, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = families.make(family, n, 0)
    right = problem.box.basis_at(run(problem).z)
    monkeypatch.setattr(BasicSolutions, "at", lambda *_: pytest.fail("a basic solution was computed"))
    random = of_masks(np.random.default_rng(0).random(n) < 0.5)
    assert list(from_start(problem, random)) == []
    with pytest.raises(pytest.fail.Exception):
        next(from_start(problem, right))
