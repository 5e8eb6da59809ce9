"""Quadratic programs and games become LCPs, in native names, in those of qpsolvers and
of OSQP, and in files; the solutions come back as minima and as equilibria. What a
result means for them is worked out when it is read, and is no part of the run; its
components have the names of the unknowns.
"""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from scipy.sparse import csr_array

import lcpcli
from lcpcli import (
    Problem,
    from_game,
    from_osqp,
    from_qp,
    from_qpsolvers,
    read,
    run,
    solve,
    write,
)
from lcpcli.errors import ProblemError
from lcpcli.formulations.quadratic_program import no_minimum
from lcpcli.formulations.quadratic_program.conclusions import data_of
from lcpcli.report.result_formats import plain
from lcpcli.verify.certificate import Proof
from lcpcli.verify.point import Criterion, Point

from ..methods.programs import bounded_program

PORTFOLIO_Q = [[0.10, 0.02, 0.01], [0.02, 0.06, 0.00], [0.01, 0.00, 0.03]]
PORTFOLIO_ROWS = [[1, 1, 1], [-1, -1, -1], [0.12, 0.08, 0.04]], [1, -1, 0.07]
BATTLE = [[3, 0], [0, 2]], [[2, 0], [0, 3]]


@settings(max_examples=10)
@given(st.floats(10, 40), st.integers(0, 2**20))
def test_one_of_several_minimizers_is_said_whatever_the_last_digits_of_x(moved, seed):
    """Dantzig's transport program: New York may be served from either plant, at the
    same cost."""
    result = run(read("problems/programs/transport.json"), "auto")
    x = np.array([moved, 300, 0, 325 - moved, 0, 275, 0, 0, 0.225, 0.153, 0.126])
    z = x * (1 + 2e-16 * np.random.default_rng(seed).integers(0, 4, x.size))
    again = replace(result, point=Point(Criterion(result.problem), z))
    assume(again.solved)
    assert (
        again.answer.statement == "x is one of several minimizers of the linear program"
    )


@pytest.mark.parametrize(
    ("options", "sense"),
    [({"max_iterations": 3}, "min"), ({"time_limit": 1e-9}, "max")],
)
def test_at_a_limit_the_best_x_of_a_program_is_given_with_its_residual(options, sense):
    sign = 1 if sense == "min" else -1
    Q, c = sign * np.array(PORTFOLIO_Q), np.array([1.0, 2.0, 3.0])
    result = run(
        from_qp(Q, c, *PORTFOLIO_ROWS, sense=sense, constant=7), "shi", **options
    )
    answer = result.answer
    assert not result.status.has_no_solution
    assert np.array_equal(answer.x, result.z[:3])
    assert np.array_equal(answer.y, sign * result.z[3:])
    assert answer.objective == pytest.approx(
        answer.x @ Q @ answer.x / 2 + c @ answer.x + 7
    )
    assert answer.proved is answer.exact is answer.ray is answer.certificate is None
    assert answer.statement == (
        "x does not solve the program: it is the best iterate, with a relative "
        f"residual of {result.relative_residual:.1e}"
    )


def test_a_game_that_is_not_solved_has_no_strategies():
    game = run(from_game(*BATTLE), "shi", max_iterations=1).answer
    assert game.row is game.payoffs is None
    assert game.statement == "not solved, so there are no strategies"


def qpsolvers_names(p):
    """The same program: the rows from above, then those from below, and the
    equation."""
    A, low, high = p["A"], p["row_lower"], p["row_upper"]
    equal = low == high
    above, below = np.isfinite(high) & ~equal, np.isfinite(low) & ~equal
    G, h = np.vstack((A[above], -A[below])), np.concatenate((high[above], -low[below]))
    objective = {"P": p["Q"], "q": p["c"], "lb": p["lower"], "ub": p["upper"]}
    return objective | {"G": G, "h": h, "A": A[equal], "b": low[equal]}


def osqp_names(p, infinity=np.inf):
    """The same program with the bounds as rows, and with that number for none."""
    # Its name there.
    l, u = (  # noqa: E741
        np.concatenate((p[f"row_{side}"], p[side])) for side in ("lower", "upper")
    )
    A = np.vstack((p["A"], np.eye(len(p["c"]))))
    return {
        "P": p["Q"],
        "q": p["c"],
        "A": A,
        "l": np.maximum(l, -infinity),
        "u": np.minimum(u, infinity),
    }


def lists(p):
    """For JSON: null in place of infinite numbers."""
    return {
        key: [None if np.ndim(v) == 0 and np.isinf(v) else v.tolist() for v in values]
        for key, values in p.items()
    }


def forms(p, folder):
    """The program in all forms, by the kind of its multipliers, and what else tells it
    from the others."""
    native, names, osqp = from_qp(**p), qpsolvers_names(p), osqp_names(p)
    triangle = {"P": np.triu(p["Q"])}
    sparse = {"P": csr_array(triangle["P"]), "A": csr_array(osqp["A"])}
    workspace = {"m": 10, "n": 6, "comment": "of the workspace"}
    files = {
        "native:native.json": lists(p),
        "foreign:foreign.json": lists(names),
        "native:native.npz": p,
        "foreign:foreign.mat": names
        | {"P": csr_array(p["Q"]), "comment": "of the workspace"},
        "native:p.mps": native,
        "native:mixed.npz": native,
        "osqp:null.json": lists(osqp),
        "osqp:1e30.json": lists(osqp_names(p, 1e30) | triangle),
        "osqp:1e20.npz": osqp_names(p, 1e20),
        "osqp:1e25.mat": osqp_names(p, 1e25) | sparse | workspace,
    }
    found = {
        "native": native,
        "foreign": from_qpsolvers(**names),
        "osqp": from_osqp(**osqp),
    }
    for name, content in files.items():
        file = folder / name.split(":")[1]
        if isinstance(content, Problem):
            write(content, file)
        elif file.suffix == ".json":
            file.write_text(json.dumps(content))
        elif file.suffix == ".npz":
            np.savez(file, **content)
        else:
            savemat(file, content)
        found[name] = read(file)
    return found | {"osqp:sparse": from_osqp(**osqp_names(p, 1e20) | sparse)}


@pytest.mark.parametrize("seed", range(2))
def test_each_form_has_the_same_answer_and_of_osqp_bounds_are_rows_and_1e20_is_none(
    seed, tmp_path
):
    p, own = bounded_program(seed), {"rel": 1e-11, "abs": 1e-12}
    answers = {
        name: run(problem).answer for name, problem in forms(p, tmp_path).items()
    }
    expected = answers["native"]
    multipliers = {
        "native": expected.y,
        "osqp": np.append(expected.y, expected.bound_multipliers),
    }
    for name, answer in answers.items():
        kind = name.split(":")[0]
        assert answer.x == pytest.approx(expected.x, **own), name
        assert answer.objective == pytest.approx(expected.objective, rel=1e-12), name
        of_bounds = 0 * expected.x if kind == "osqp" else expected.bound_multipliers
        assert answer.bound_multipliers == pytest.approx(
            of_bounds, rel=1e-9, abs=1e-11
        ), name
        assert kind == "foreign" or answer.y == pytest.approx(
            multipliers[kind], rel=1e-9, abs=1e-11
        ), name
    problem = from_qp(**p)
    assert lcpcli.check(problem, expected.x)
    assert not lcpcli.check(problem, expected.x + 0.1)
    z = lcpcli.solve(problem.M, problem.q, lower=problem.lower, upper=problem.upper).z
    assert z[:6] == pytest.approx(expected.x, **own)


def test_linear_programs_and_infinite_ends_are_taken_as_others_take_them(tmp_path):
    (tmp_path / "lp.json").write_text(
        '{"P": null, "q": [1, 2], "A": [[1, 1], [0, 1]], "l": [2, 0], "u": 3}'
    )
    assert run(read(tmp_path / "lp.json")).answer.x.tolist() == [2, 0]
    assert run(from_osqp([[2, 1], [0, 2]], [-3, -3])).answer.x.tolist() == [1, 1]
    x = lcpcli.solve_qp(
        np.eye(2),
        np.ones(2),
        np.array([[1.0, 1.0], [1.0, 0.0]]),
        np.array([np.inf, -3.0]),
    )
    assert x.tolist() == [-3, -1]


@pytest.mark.parametrize("seed", range(2))
def test_solve_qp_and_the_solver_of_qpsolvers_return_the_same_x(seed):
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    assert "lcp" in qpsolvers.available_solvers
    p = bounded_program(seed)
    given = qpsolvers_names(p)
    expected = run(from_qp(**p)).z[:6]
    assert lcpcli.solve_qp(**given) == pytest.approx(expected, rel=1e-11, abs=1e-12)
    assert qpsolvers.solve_qp(**given, solver="lcp") == pytest.approx(
        expected, rel=1e-11, abs=1e-12
    )
    solution = qpsolvers.solve_problem(
        qpsolvers.Problem(**given), solver="lcp", tol=1e-9
    )
    assert solution.is_optimal(1e-8)
    assert solution.obj == pytest.approx(run(from_qp(**p)).answer.objective)


def test_qpsolvers_learns_of_no_solution_and_gets_no_stationary_point():
    """min -x^2 + x: 0.5 satisfies the conditions, and is the maximizer."""
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    given = {
        "P": np.eye(1),
        "q": np.zeros(1),
        "G": np.array([[1.0], [-1.0]]),
        "h": np.array([1.0, -2.0]),
    }
    assert lcpcli.solve_qp(**given) is None
    solution = qpsolvers.solve_problem(qpsolvers.Problem(**given), solver="lcp")
    assert not solution.found
    assert (
        solution.extras["statement"]
        == "the program is infeasible: no x satisfies its constraints"
    )
    given = {"P": np.array([[-2.0]]), "q": np.array([1.0])}
    answer = lcpcli.run(lcpcli.from_qpsolvers(**given)).answer
    assert answer.proved == "stationary"
    assert answer.x.tolist() == [0.5]
    assert answer.statement.startswith(
        "x is a stationary point and need not be a minimizer"
    )
    with pytest.warns(UserWarning, match="stationary"):
        assert lcpcli.solve_qp(**given) is None
    with pytest.warns(UserWarning, match="stationary"):
        assert not qpsolvers.solve_problem(qpsolvers.Problem(**given), "lcp").found


INF = np.inf


@pytest.mark.parametrize(
    ("sides", "reason"),
    [
        ({"lb": [0.0, 1.0], "ub": [1.0, 0.0]}, "lb[1] is 1, above ub[1] = 0"),
        ({"lb": [INF, 0.0]}, "lb[0] is infinite"),
    ],
)
def test_bounds_without_a_number_between_them_are_no_error_for_qpsolvers(sides, reason):
    """As with its other solvers, which return no x, so that a loop goes on."""
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    arrays = {name: np.array(values) for name, values in sides.items()}
    problem = qpsolvers.Problem(np.eye(2), np.ones(2), **arrays)
    solution = qpsolvers.solve_problem(problem, solver="lcp")
    assert (solution.found, solution.x) == (False, None)
    assert solution.extras["statement"] == f"the program is infeasible: {reason}"
    assert qpsolvers.solve_qp(np.eye(2), np.ones(2), **arrays, solver="lcp") is None
    with pytest.raises(ProblemError, match=reason.split("[", maxsplit=1)[0]):
        from_qpsolvers(np.eye(2), np.ones(2), **arrays)


def test_other_input_errors_are_errors_for_qpsolvers_too():
    qpsolvers = pytest.importorskip("qpsolvers")
    lcpcli.add_to_qpsolvers()
    with pytest.raises(ProblemError, match="q"):
        qpsolvers.solve_qp(np.eye(2), np.array([1.0, np.nan]), solver="lcp")


@pytest.mark.parametrize("form", [np.array, csr_array, np.ndarray.tolist])
def test_matrices_without_rows_are_no_constraints(form):
    rows, sides = form(np.zeros((0, 2))), np.zeros(0)
    Q, c = np.array([[2.0, 1.0], [1.0, 2.0]]), [-3.0, -3.0]
    free = {"lower": -INF}
    for problem in (
        from_qp(Q, c, rows, row_lower=sides, row_upper=sides, rows=[]),
        from_qpsolvers(Q, c, rows, sides, [[1.0, -1.0]], [0.0]),
        from_qpsolvers(Q, c, None, None, rows, sides),
        from_osqp(Q, c, rows, sides, sides),
        lcpcli.from_avi(Q, c, rows, sides, **free),
        lcpcli.from_players([1, 1], Q, c, rows, sides, owner=[]),
    ):
        assert run(problem).answer.x == pytest.approx([1, 1])
    assert lcpcli.solve_qp(Q, c, rows, sides).tolist() == pytest.approx([1, 1])
    fit = lcpcli.lsq(np.eye(2), [1.0, 2.0], E=rows, d=sides)
    assert fit.answer.x == pytest.approx([1, 2])


def test_many_variables_without_rows_have_an_answer():
    """Products with matrices without rows are not for BLAS, which refuses them."""
    square = np.diag([0.0, *np.ones(99)])
    result = lcpcli.run(lcpcli.from_qp(square, np.zeros(100), lower=-1, upper=1))
    assert result.answer.proved == "several_optima"


def test_a_maximum_is_the_minimum_of_the_opposite_in_fractions_too():
    p = bounded_program(3)
    least = run(from_qp(**p, constant=2.0)).answer
    most = run(
        from_qp(**p | {"Q": -p["Q"], "c": -p["c"]}, sense="max", constant=-2.0)
    ).answer
    assert most.objective == pytest.approx(-least.objective)
    assert most.y == pytest.approx(-least.y)
    assert most.statement == "x is the unique maximizer, as Q is negative definite"
    for sense, sign in ("min", 1), ("max", -1):
        answer = lcpcli.exact(
            from_qp(None, [-3 * sign, -2 * sign], [[1, 1]], row_upper=4, sense=sense)
        ).answer
        assert answer.exact["x"] == [4, 0]
        assert answer.exact["y"] == [-3 * sign]
        assert answer.y.tolist() == [-3 * sign]


SEMIDEFINITE = [[1, 1], [1, 1]], [-1, -1], [[-1, -1]], [-4]
SEVERAL = "x is one of several minimizers, as Q is positive semidefinite"


def test_what_a_solution_is_is_worked_out_when_it_is_read():
    result = run(from_qp(*SEMIDEFINITE), "auto")
    x, seconds = result.answer.x, result.seconds
    assert x is result.answer.x
    assert result.answer.statement == SEVERAL
    assert result.answer.seconds > 0
    assert result.seconds == seconds
    assert replace(result, label="again").answer.proved == "several_optima"


@pytest.mark.parametrize("read_before", [False, True])
def test_answers_of_pickled_results_are_those_of_the_results(read_before):
    unbounded = from_qp(None, [-1], [[1]], [0])
    for problem in (from_qp(*SEMIDEFINITE), unbounded, from_game(*BATTLE)):
        result = run(problem, "auto")
        statement = result.answer.statement if read_before else None
        again = pickle.loads(pickle.dumps(result)).answer
        assert again.statement == (statement or result.answer.statement)
        assert plain(getattr(again, "x", None)) == plain(
            getattr(result.answer, "x", None)
        )
        assert plain(getattr(again, "ray", None)) == plain(
            getattr(result.answer, "ray", None)
        )


M, q = [[2, 1], [1, 2]], [-5, -6]


def test_component_is_found_by_the_name_that_the_problem_or_the_program_gives_it():
    result = run(Problem(M, q, names=["price", "flow"]))
    assert (result["price"], result["flow"]) == tuple(result.z.tolist())
    result = run(
        from_qp([[2.0, 0.0], [0.0, 2.0]], [-2.0, -4.0], columns=["bread", "wine"])
    )
    assert round(result["bread"], 9) == 1.0
    assert round(result["wine"], 9) == 2.0
    with pytest.raises(KeyError):
        solve(M, q)["bread"]


@pytest.mark.parametrize(
    ("e", "words"), [(0.0, "one of several minimizers"), (1e-11, "a minimizer")]
)
def test_minimizers_up_to_rounding_are_not_several(e, words):
    """min -x - (1 + e) y over x + y <= 1 is attained at (0, 1) alone, unless e = 0."""
    statement = run(
        from_qp(None, [-1.0, -1.0 - e], [[-1.0, -1.0]], [-1.0])
    ).answer.statement
    assert statement == f"x is {words} of the linear program"


def test_a_program_that_hardly_contradicts_itself_is_not_called_unbounded():
    result = run(
        from_qp(
            None,
            [0.0, 0.0, -1.0],
            [[1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]],
            [1.0, -1.0 + 1e-11],
        )
    )
    assert result.word == "infeasible"


def test_every_proof_for_the_constraints_is_one_for_the_program(monkeypatch):
    """Also one with multipliers of columns without entries, which have costs in the
    program alone."""
    y = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    monkeypatch.setattr(no_minimum, "farkas_multipliers", lambda *_: iter([y]))
    monkeypatch.setattr(no_minimum, "MAX_FRACTIONS", 0)
    rows = [[1.0, 1.0, 0.0, 0.0], [-1.0, -1.0, 0.0, 0.0]]
    result = run(from_qp(None, [0.0, 0.0, -1.0, 5.0], rows, [1.0, -0.5]))
    assert result.word == "infeasible"
    assert result.answer.certificate.tolist() == [1.0, 1.0]


def test_a_solver_tells_of_a_program_only_where_q_and_bounds_are_those_of_one():
    """A row whose multiplier has other bounds is none of a program."""
    program = from_qp([[2, 0], [0, 2]], [-4, -4], [[1, 1]], row_upper=2)
    solver = lcpcli.Solver(program)
    assert solver.solve().answer.x == pytest.approx([1, 1])
    assert solver.solve(lower=[0.0, 0.0, -1.0]).answer is None
    other = solver.solve(np.array([-2.0, -4.0, -2.0]))
    assert other.answer.x == pytest.approx([0.5, 1.5])


@pytest.mark.parametrize(("sense", "sign"), [("max", 1), ("min", -1)])
def test_derivatives_with_respect_to_bounds_have_the_sense_of_the_program(sense, sign):
    """The best is 3 x + y = 6 at (1, 3), and rises by 2 for each unit that x may."""
    sides = {"row_upper": [4], "lower": 0, "upper": [1, 5], "sense": sense}
    answer = run(from_qp(None, [3 * sign, sign], [[1, 1]], **sides)).answer
    for side in ("", "_down", "_up"):
        bound_multipliers = getattr(answer, f"bound_multipliers{side}")
        assert bound_multipliers == pytest.approx([2 * sign, 0])
        assert getattr(answer, f"y{side}") == pytest.approx([sign])


@pytest.mark.parametrize("power", [-40, 50])
def test_a_variable_inside_its_bounds_has_no_multiplier_in_any_unit(power):
    """Its w is rounding of terms that are as large as the objective."""
    random = np.random.default_rng(0)
    for _ in range(5):
        A = random.standard_normal((4, 4))
        Q, x = A @ A.T + np.eye(4), random.uniform(0.5, 2.0, 4)
        problem = lcpcli.from_qp(Q * 2.0**power, -(Q @ x) * 2.0**power, upper=2.5)
        answer = lcpcli.run(problem).answer
        assert answer.x == pytest.approx(x)
        assert not answer.bound_multipliers.any()


@pytest.mark.parametrize("units", [(1, 1), (1, 0), (0, 1), (1, -1)])
@pytest.mark.parametrize("scale", [1e-12, 1e-8, 1e8])
def test_several_minimizers_are_seen_in_any_unit(units, scale):
    """min x_1 + x_2 with x_1 + x_2 >= 3, 0 <= x <= 5, in units of costs and rows."""
    cost, row = scale ** np.array(units, dtype=float)
    sides = {"row_lower": 3.0 * row, "upper": 5.0}
    result = run(from_qp(None, [cost, cost], [[row, row]], **sides))
    assert result.answer.proved == "several_optima"


A = [0.4, 0.2, 0.1, 0.2]
ONE_OF_TWO = {"Q": np.diag([1.0, 0.0]), "c": [0, 0], "A": [[1, 0]], "upper": [INF, 1]}
SEVERAL_MINIMA = {
    "a row with two sides": {"c": A, "A": [A], "row_lower": 1.7, "row_upper": 6.7},
    "an equation": {"c": A, "A": [A], "row_lower": 1.7, "row_upper": 1.7},
    "a far larger variable": {**ONE_OF_TWO, "row_lower": 1e4, "row_upper": 1e4},
}


@pytest.mark.parametrize("name", SEVERAL_MINIMA)
def test_several_minimizers_are_seen_beside(name):
    """Also where A'x of another minimizer is at its side up to rounding."""
    given = {"Q": None, "upper": 100} | SEVERAL_MINIMA[name]
    assert run(from_qp(**given)).answer.proved == "several_optima"


def test_a_proof_up_to_rounding_makes_no_program_unbounded():
    """The minimizer is 1e20."""
    problem = from_qp([[1e-20]], [-1.0])
    proof = Proof("farkas", np.ones(1), is_rounded=True)
    program = problem.origin
    data = data_of(problem, program)
    found = no_minimum.without_minimum(problem, proof, program, data)
    end = "the program has no minimum up to the rounding of its data"
    assert (found.statement, found.proved) == (end, None)
