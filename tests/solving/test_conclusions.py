"""What a result means for a program or a game is worked out when it is read, and is no part of the run; its components
have the names of the unknowns.
"""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from lcpcli import Problem, from_game, from_qp, run, solve
from lcpcli.errors import ProblemError
from lcpcli.report.result_formats import plain
from lcpcli.solving import no_minimum
from lcpcli.verify.certificate import Certificate

SEMIDEFINITE = [[1, 1], [1, 1]], [-1, -1], [[-1, -1]], [-4]
SEVERAL = "x is one of several minimizers, as Q is positive semidefinite"
BATTLE = [[3, 0], [0, 2]], [[2, 0], [0, 3]]


def test_what_a_solution_is_is_worked_out_when_it_is_read() -> None:
    result = run(from_qp(*SEMIDEFINITE), "auto")
    x, seconds = result.answer.x, result.seconds
    assert x is result.answer.x
    assert result.answer.statement == SEVERAL
    assert result.answer.seconds > 0
    assert result.seconds == seconds
    assert replace(result, label="again").answer.proved == "several_optima"


@pytest.mark.parametrize("read_before", [False, True])
def test_answers_of_pickled_results_are_those_of_the_results(read_before: bool) -> None:
    unbounded = from_qp(None, [-1], [[1]], [0])
    for problem in (from_qp(*SEMIDEFINITE), unbounded, from_game(*BATTLE)):
        result = run(problem, "auto")
        statement = result.answer.statement if read_before else None
        again = pickle.loads(pickle.dumps(result)).answer
        assert again.statement == (statement or result.answer.statement)
        assert plain(getattr(again, "x", None)) == plain(getattr(result.answer, "x", None))
        assert plain(getattr(again, "ray", None)) == plain(getattr(result.answer, "ray", None))


M, q = [[2, 1], [1, 2]], [-5, -6]


def test_component_is_found_by_the_name_that_the_problem_or_the_program_gives_it() -> None:
    result = run(Problem(M, q, names=["price", "flow"]))
    assert list(result.names) == ["price", "flow"]
    assert (result["price"], result["flow"]) == tuple(result.z.tolist())
    result = run(from_qp([[2.0, 0.0], [0.0, 2.0]], [-2.0, -4.0], columns=["bread", "wine"]))
    assert (round(result["bread"], 9), round(result["wine"], 9)) == (1.0, 2.0)


def test_another_name_is_an_error_that_suggests_one() -> None:
    named, nameless = run(Problem(M, q, names=["price", "flow"])), solve(M, q)
    for name in ("prise", "", 0):
        with pytest.raises(KeyError, match="is not the name of an unknown; "):
            named[name]
        with pytest.raises(KeyError):
            nameless[name]


def test_what_is_gone_from_results_says_what_to_ask_instead() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'exit_code'; ask result\.solved"):
        _ = solve([[2]], [-1]).exit_code  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match=r"no attribute 'solvd'$"):
        _ = solve([[2]], [-1]).solvd  # type: ignore[attr-defined]


def test_a_name_of_several_unknowns_is_not_taken_for_one_of_them() -> None:
    with pytest.raises(ProblemError, match="names: has 'price' for 2 unknowns; give each its own name"):
        Problem([[2, 1, 0], [1, 2, 0], [0, 0, 1]], [-5, -6, -1], names=["price", "price", "flow"])
    assert list(Problem([[2, 1], [1, 2]], [-5, -6], names=["", ""]).names) == ["", ""]
    program = from_qp([[2.0]], [-2.0], [[1.0]], row_upper=[5.0], columns=["x"], rows=["x"])
    with pytest.raises(KeyError, match="'x' is the name of 2 unknowns"):
        run(program)["x"]


@pytest.mark.parametrize(("e", "words"), [(0.0, "one of several minimizers"), (1e-11, "a minimizer")])
def test_minimizers_up_to_rounding_are_not_several(e: float, words: str) -> None:
    """min -x - (1 + e) y over x + y <= 1 is attained at (0, 1) alone, unless e = 0."""
    statement = run(from_qp(None, [-1.0, -1.0 - e], [[-1.0, -1.0]], [-1.0])).answer.statement
    assert statement == f"x is {words} of the linear program"


def test_a_program_that_contradicts_itself_by_less_than_linear_programs_see_is_not_called_unbounded() -> None:
    result = run(from_qp(None, [0.0, 0.0, -1.0], [[1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]], [1.0, -1.0 + 1e-11]))
    assert result.word == "infeasible"


def test_every_proof_for_the_constraints_is_one_for_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one with multipliers of columns without entries, which have costs in the program alone."""
    found = Certificate("farkas", "", np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))
    monkeypatch.setattr(no_minimum, "farkas_certificate", lambda *_, **__: found)
    monkeypatch.setattr(no_minimum, "MOST_FRACTIONS", 0)
    rows = [[1.0, 1.0, 0.0, 0.0], [-1.0, -1.0, 0.0, 0.0]]
    result = run(from_qp(None, [0.0, 0.0, -1.0, 5.0], rows, [1.0, -0.5]))
    assert result.word == "infeasible"
    assert result.answer.certificate.tolist() == [1.0, 1.0]
