"""A run can begin where another has ended, at a z, or from given states; and how wrong
ones are refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng

from lcpcli import Problem, Trace, from_qp, run, solve_mcp
from lcpcli.files import contents, writing
from lcpcli.gallery import families
from lcpcli.gallery.systems import american_put
from lcpcli.model.box import in_words
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.words import basis_of_words, x_in

EXAMPLE = contents.shipped_path("paper-example-1.json")


def record(lcp, method, *options):
    outcome = lcp("solve", EXAMPLE, "--method", method, *options, "--format", "json")
    assert outcome.err == ""
    return outcome.record


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_from_a_result_or_the_solution_as_z_a_run_ends_at_once(method, lcp, tmp_path):
    """Of several results the first counts, and a result may be spread over lines."""
    file = tmp_path / "start"
    result = record(lcp, method, "--tol", "1e-13")
    line = json.dumps(result)
    texts = [f'{line}{between}{{"z": []}}\n' for between in ("\r\n", "\n\n")]
    options = ("--x0", "--z0", "--x0")
    for text, option in zip(
        (json.dumps(result, indent=2), *texts), options, strict=True
    ):
        file.write_bytes(text.encode())
        again = record(lcp, method, option, str(file), "--tol", "1e-13")
        assert again["status"] == "solved"
        assert again["iterations"] == 0
    for text in ("1\n0\n1\n0\n", "[1, 0, 1, 0]"):
        file.write_text(text)
        for given in (str(file), "1,0,1,0"):
            again = record(lcp, method, "--z0", given)
            assert again["iterations"] == 0
            assert again["z"] == [1, 0, 1, 0]


def test_z0_takes_the_place_of_both_points_of_a_problem(paper_example):
    own = Problem(paper_example.M, paper_example.q, x0=np.zeros(4), x1=np.ones(4))
    assert run(own, "shi").options["x1"] is not None
    assert run(own, "shi", z0=np.ones(4)).options["x1"] is None, (
        "as it goes with the first"
    )


def test_a_start_that_violates_a_row_in_small_units_is_not_called_a_solution():
    """The row is 2^-12 (1, -1), where w is 2^-20 of q, but 2^-41 of the terms, which
    cancel."""
    pytest.importorskip("numba")
    unit, far = 2.0**-12, 2.0**20
    z0 = np.array([far + 1 + 2.0**-20, far])
    problem = Problem([[unit, -unit], [-far, 0]], [-unit, far * z0[0]])
    assert problem.w(z0).tolist() == [unit * 2.0**-20, 0]
    for compiled in (False, True):
        result = run(problem, z0=z0, compiled=compiled)
        assert result.solved
        assert result.relative_residual <= result.tol
        assert not np.array_equal(result.z, z0)


@pytest.mark.parametrize("n", [60, 400])
def test_a_rounded_solution_of_a_program_is_repaired_by_a_few_systems(n):
    """z is right to seven digits, and M has zeros on its diagonal: without it,
    `interior` takes many steps."""
    rng = default_rng(n)
    A = rng.standard_normal((n // 2, n)) * (rng.random((n // 2, n)) < 0.2)
    x = rng.random(n) * (rng.random(n) < 0.5)
    problem = from_qp(
        np.diag(rng.random(n)),
        rng.standard_normal(n),
        A,
        A @ x - rng.random(n // 2),
        lower=0.0,
    )
    cold = run(problem, "interior")
    z = cold.z * (1 + 1e-7 * rng.standard_normal(problem.n)) + 1e-9 * rng.random(
        problem.n
    )
    warm = run(problem, z0=z)
    assert cold.solved
    assert warm.solved
    assert warm.evaluations <= 4 < cold.evaluations


def test_a_start_at_the_border_of_the_domain_of_F_is_moved_into_it():
    result = solve_mcp(lambda z: np.log(z) - [1.0, -1.0], x0=[0.0, 0.0])
    assert result.solved
    np.testing.assert_allclose(result.z, np.exp([1.0, -1.0]), rtol=1e-8)


def test_a_start_beyond_the_bounds_is_brought_within_them():
    problem = NonlinearProblem(lambda z: z**2 - 4.0, lower=0.0, x0=[1.0]).starting_at(
        [-2.0]
    )
    assert problem.x0.tolist() == [0.0]


def boxed(n):
    """A P-matrix with random boxes, from the origin several block steps away from the
    solution."""
    random = default_rng(0)
    A, S = random.normal(size=(2, n, n))
    return Problem(
        A @ A.T + S - S.T + np.eye(n),
        10 * random.normal(size=n),
        lower=-1,
        upper=random.random(n),
    )


PROBLEMS = {"boxed": boxed(30), "LCP": Problem(boxed(30).M, boxed(30).q)}


def test_start_stands_for_the_states_given_however_large_the_bounds():
    states = ["basic", "lower", "upper", "basic", "basic", "upper", "lower"]
    for size in (0.0, 1.0, 1e12, 1e300):
        low = np.array([-size, -size, -size, -np.inf, -np.inf, -np.inf, size])
        high = np.array([np.inf, size + 1, 3 * size + 1, np.inf, -size, -size, size])
        problem = Problem(np.eye(7), np.zeros(7), lower=low, upper=high)
        assert (
            in_words(
                problem.box.basis_of(x_in(problem, basis_of_words(problem, states)))
            )
            == states
        )


@pytest.mark.parametrize("kind", PROBLEMS)
def test_newton_needs_one_step_from_states_or_from_an_earlier_result(
    lcp, tmp_path, kind
):
    names = ("problem.json", "result.json", "result.csv", "states.json")
    file, result, table, states = (str(tmp_path / name) for name in names)
    writing.write(PROBLEMS[kind], file)
    for output in (result, table):
        lcp(f"solve {file} -o {output}")
    first = run(PROBLEMS[kind], "newton")
    assert first.iterations > 1
    again = run(PROBLEMS[kind], "newton", basis=first.basis)
    assert again.solved
    assert again.iterations == 1
    assert again.z.tolist() == first.z.tolist()
    Path(states).write_text(json.dumps(first.basis))
    for given in (result, table, states, ",".join(first.basis), " ".join(first.basis)):
        outcome = lcp(f"solve {file} --method newton --format json --basis", given)
        assert outcome.record["iterations"] == 1


@pytest.mark.parametrize(
    "family", ["obstacle", "harker-pang", "boxes", "control", "contact"]
)
def test_auto_factorizes_the_basis_of_a_solution_once_and_is_done(family):
    """Also the basis at which a path ends where contacts are redundant."""
    problem = families.make(family, 240, 1)
    first = run(problem)
    again = run(problem, basis=first.basis)
    assert first.evaluations > 1 or "piqp" in first.route
    assert again.solved
    assert again.iterations == 1
    assert again.evaluations == 1
    assert again.route == ("newton",)
    assert again.basis == first.basis


@pytest.mark.parametrize("dense", [False, True])
def test_auto_exchanges_the_few_wrong_states_of_the_step_before(dense):
    before, problem = (american_put(1000, 0, years=years) for years in (0.45, 0.5))
    if dense:
        problem = Problem(problem.M.toarray(), problem.q)
    basis = run(before).basis
    result = run(problem, basis=basis)
    changes = sum(old != new for old, new in zip(basis, result.basis, strict=True))
    assert result.solved
    assert 0 < changes <= 5
    assert result.iterations <= changes + 1


def test_auto_solves_what_has_a_singular_basis():
    assert run(Problem([[0, 0], [0, 0]], [0, 1]), basis=["basic", "basic"]).solved
    contact = families.make("contact", 100, 1)
    result = run(contact, basis=["basic" if z > 0 else "lower" for z in run(contact).z])
    assert result.solved
    assert result.route[-1] == "lemke"


@pytest.mark.parametrize(
    ("family", "n", "words"),
    [("obstacle", 2500, ["lower"]), ("harker-pang", 200, ["lower", "basic"])],
)
def test_auto_goes_on_from_its_own_start_where_a_basis_is_far_from_right(
    family, n, words
):
    problem, cold, warm = families.make(family, n, 0), Trace(), Trace()
    assert run(problem, trace=cold).solved
    assert run(
        problem, basis=default_rng(0).choice(words, n).tolist(), trace=warm
    ).solved
    own = [row.z for row in cold.rows[1:]]
    assert len(cold.rows) <= len(warm.rows) <= len(cold.rows) + 15
    assert all(map(np.array_equal, own, [row.z for row in warm.rows[-len(own) :]]))
