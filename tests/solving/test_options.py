"""Options are checked before anything is solved, so that a mistake shows whatever the problem is."""

from __future__ import annotations

import math
from typing import Any

import pytest

import lcpcli
from lcpcli.errors import OptionError
from lcpcli.methods.registry import Method, options_of
from lcpcli.options import Option

WRONG: list[tuple[Any, dict[str, Any], str]] = [
    ("shi", {"p": -1}, r"^p: -1 is out of range"),
    ("shi", {"rho": 0.4, "sigma": 0.2}, r"^sigma: 0.2 is out of range"),
    ("shi", {"k_star": 0}, r"^k_star: 0 is out of range; it must be: whole number >= 1$"),
    ("shi", {"K_star": 3}, "^K_star: .*did you mean k_star"),
    ("shi", {"%": 3}, "^%: .*it has x1, p, k_star, rho, sigma, x0, z0, basis, tol"),
    ("shi", {"omega": 2.0}, "^omega: has no effect with the method shi"),
    ("fixed-point", {"omega": "best"}, r"^omega: best is out of range"),
    ("fixed-point", {"omgea": 2.0}, "^omgea: is not an option of fixed-point; did you mean omega"),
    ("interior", {"start_slack": -1}, r"^start_slack: -1 is out of range"),
    ("interior", {"regularization": 2}, r"^regularization: 2 is out of range"),
    ("newton", {"p": 3}, r"^p: has no effect with the method newton"),
    ("newtn", {}, "'newtn' is unknown; did you mean newton"),
    ("auto", {"every": 2}, r"^every: is not an option of auto"),
    ("auto", {"threads": 0}, r"^threads: 0 is out of range"),
    ("auto", {"time_limit": 0.0}, r"^time_limit: 0.0 is out of range"),
    ("auto", {"max_iterations": -1}, r"^max_iterations: -1 is out of range"),
    ("auto", {"max_iteration": 3}, "^max_iteration: .*did you mean max_iterations"),
    ("auto", {"tol": 0.0}, r"^tol: 0.0 is out of range"),
    ("auto", {"tol": 1.0}, r"^tol: 1.0 is out of range"),
    ("auto", {"tol": math.nan}, r"^tol: nan is out of range"),
]


@pytest.mark.parametrize(("method", "given", "message"), WRONG, ids=[message for *_, message in WRONG])
def test_wrong_option_is_refused_whether_or_not_the_start_is_a_solution(
    method: Any, given: dict[str, Any], message: str
) -> None:
    for q in (1, -1):
        with pytest.raises(OptionError, match=message):
            lcpcli.solve([[1]], [q], method, **given)
        for columns in (1, 6):
            with pytest.raises(OptionError, match=message):
                lcpcli.solve_many([[1]], [[q] * columns], method=method, **given)


def test_methods_may_share_an_option_and_no_name_belongs_to_two() -> None:
    one, same = (Option("tol", float, 1e-10, "0 < tol", lambda tol: tol > 0, "It ends.") for _ in range(2))
    assert options_of({"one": Method("", (one,)), "other": Method("", (one,))}) == {"tol": one}
    with pytest.raises(ValueError, match=r"^one and other have two options tol: "):
        options_of({"one": Method("", (one,)), "other": Method("", (same,))})
