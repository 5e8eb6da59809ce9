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
from lcpcli.methods.newton import from_states
from lcpcli.methods.stages import Finished
from lcpcli.model.box import in_words
from lcpcli.model.start import basis_of_words, x_in

from .stages import through

Lcp = Callable[..., Any]


def boxed(n: int) -> Problem:
    """A P-matrix with random boxes, from the origin several block steps away from the solution."""
    random = np.random.default_rng(0)
    A, S = random.normal(size=(2, n, n))
    return Problem(A @ A.T + S - S.T + np.eye(n), 10 * random.normal(size=n), lower=-1, upper=random.random(n))


PROBLEMS = {"boxed": boxed(30), "LCP": Problem(boxed(30).M, boxed(30).q)}


@pytest.mark.parametrize("size", [0.0, 1.0, 1e12, 1e300])
def test_start_stands_for_the_states_given_however_large_the_bounds(size: float) -> None:
    low = np.array([-size, -size, -size, -np.inf, -np.inf, -np.inf, size])
    high = np.array([np.inf, size + 1, 3 * size + 1, np.inf, -size, -size, size])
    states = ["basic", "lower", "upper", "basic", "basic", "upper", "lower"]
    problem = Problem(np.eye(7), np.zeros(7), lower=low, upper=high)
    basis = problem.box.basis_of(x_in(problem, basis_of_words(problem, states)))
    assert in_words(basis) == states


@pytest.mark.parametrize("kind", PROBLEMS)
def test_newton_needs_one_step_from_states_or_from_an_earlier_result(lcp: Lcp, tmp_path: Path, kind: str) -> None:
    names = ("problem.json", "result.json", "result.csv", "states.json")
    file, result, table, states = (str(tmp_path / name) for name in names)
    writing.write(PROBLEMS[kind], file)
    for output in (result, table):
        lcp("solve", file, "-o", output)
    first = run(PROBLEMS[kind], "newton")
    assert first.iterations > 1
    again = run(PROBLEMS[kind], "newton", basis=first.basis)
    assert (again.solved, again.iterations, again.z.tolist()) == (True, 1, first.z.tolist())
    Path(states).write_text(json.dumps(first.basis))
    for given in (result, table, states, ",".join(first.basis), " ".join(first.basis)):
        outcome = lcp("solve", file, "--method", "newton", "--basis", given, "--format", "json")
        assert json.loads(outcome.out)["iterations"] == 1


@pytest.mark.parametrize("family", ["obstacle", "harker-pang", "boxes", "control", "contact"])
def test_auto_factorizes_the_basis_of_a_solution_once_and_is_done(family: str) -> None:
    """Also the basis at which a path ends where contacts are redundant."""
    problem = families.make(family, 240, 1)
    first = run(problem)
    again = run(problem, basis=first.basis)
    assert first.evaluations > 1 or "piqp" in first.route
    assert (again.solved, again.iterations, again.evaluations, again.route) == (True, 1, 1, ("newton",))
    assert again.basis == first.basis


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


@pytest.mark.parametrize(("family", "n"), [("harker-pang", 200), ("obstacle", 400)])
def test_pivoting_from_given_states_goes_on_as_long_as_it_is_fast(family: str, n: int) -> None:
    problem = families.make(family, n, 0)
    z = run(problem).z
    x = (z - problem.w(z)) / 2
    x[np.random.default_rng(0).permutation(n)[:10]] *= -1
    iterates, ending = through(from_states(problem, problem.box.basis_of(x)))
    assert isinstance(ending, Finished)
    assert len(iterates) > 3


def test_auto_solves_what_has_a_singular_basis() -> None:
    assert run(Problem([[0, 0], [0, 0]], [0, 1]), basis=["basic", "basic"]).solved
    contact = families.make("contact", 100, 1)
    result = run(contact, basis=["basic" if z > 0 else "lower" for z in run(contact).z])
    assert (result.solved, result.route[-1]) == (True, "lemke")


@pytest.mark.parametrize(
    ("basis", "said"),
    [
        (["basic", "basic"], "basis: has 2 entries for 4 unknowns"),
        (["basic", "top", "lower", "lower"], "basis[1]: is the text 'top'"),
        (["basic", 1, "lower", "lower"], "basis[1]: is a number"),
        (["upper", "upper", "lower", "lower"], "basis[0]: is upper, but there is no such bound"),
        (["lower", "upper", "lower", "lower"], "basis[0]: is lower, but there is no such bound"),
        (["basic", "upper", "lower", "basic"], "basis[3]: is basic, but that variable is fixed"),
        ("basic", "basis: is the text 'basic'"),
        (7, "basis: is a number"),
    ],
)
def test_wrong_states_are_refused(basis: Any, said: str) -> None:
    M = [[2, 1, 0, 0], [1, 2, 1, 0], [0, 1, 3, 0], [0, 0, 0, 1]]
    problem = Problem(M, [-5, -6, 4, 1], lower=[-np.inf, 0, -1, 2], upper=[np.inf, 2, np.inf, 2])
    assert run(problem, basis=["basic", "upper", "lower", "lower"]).solved
    with pytest.raises(LCPError) as refusal:
        run(problem, basis=basis)
    assert str(refusal.value).startswith(said)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("basic,upper,lower,basic",), "--basis[1]: is upper, but there is no such bound"),
        (("missing.json",), "--basis: 'missing.json' is neither a file nor states"),
        (("Basic,basic,basic,basic",), "--basis[0]: is the text 'Basic'"),
        (("basic,basic,basic,basic", "--z0", "1,1,1,1"), "gives the starting point, and so does"),
        (("basic,basic,basic,basic", "--method", "lemke"), "uses no starting point"),
    ],
)
def test_command_refuses_in_one_line(lcp: Lcp, options: tuple[str, ...], said: str) -> None:
    outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), "--basis", *options)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert said in outcome.err


@pytest.mark.parametrize("content", ['{"x": 1}', '{"basis": 3}', "3", "{", '{"basis": ["basic"]}', "z\n1"])
def test_file_without_states_is_named(lcp: Lcp, tmp_path: Path, content: str) -> None:
    for suffix in (".json", ".csv", ".npy"):
        path = tmp_path / f"states{suffix}"
        path.write_text(content)
        outcome = lcp("solve", contents.shipped_path("paper-example-1.json"), "--basis", str(path))
        assert (outcome.code, outcome.err.count("\n")) == (2, 1)
        assert path.name in outcome.err


@pytest.mark.parametrize(
    ("family", "n", "words"), [("obstacle", 2500, ["lower"]), ("harker-pang", 200, ["lower", "basic"])]
)
def test_auto_goes_on_from_its_own_start_where_a_basis_is_far_from_right(family: str, n: int, words: list[str]) -> None:
    problem, cold, warm = families.make(family, n, 0), Trace(), Trace()
    assert run(problem, trace=cold).solved
    assert run(problem, basis=np.random.default_rng(0).choice(words, n).tolist(), trace=warm).solved
    own = [row.z for row in cold.rows[1:]]
    assert len(cold.rows) <= len(warm.rows) <= len(cold.rows) + 15
    assert all(map(np.array_equal, own, [row.z for row in warm.rows[-len(own) :]]))


def test_right_states_are_taken_where_m_is_far_from_monotone() -> None:
    problem = families.make("planted", 150, 0)
    states = ["basic" if z > 0 else "lower" for z in problem.solutions[0]]
    result = run(Problem(problem.M, problem.q), basis=states)
    assert (result.status.word, result.route, result.iterations) == ("solved", ("newton",), 1)
