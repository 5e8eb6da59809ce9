"""Components of a result by the names of the unknowns."""

from __future__ import annotations

import pytest

from lcpcli import Problem, from_qp, run, solve

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
        with pytest.raises(KeyError, match="is no name of an unknown; "):
            named[name]
        with pytest.raises(KeyError):
            nameless[name]


def test_what_is_gone_from_results_says_what_to_ask_instead() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'exit_code'; ask result\.solved"):
        _ = solve([[2]], [-1]).exit_code  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match=r"no attribute 'solvd'$"):
        _ = solve([[2]], [-1]).solvd  # type: ignore[attr-defined]
