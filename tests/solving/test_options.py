"""Options are checked before anything is solved, so that a mistake shows whatever the problem is."""

from __future__ import annotations

from typing import Any

import pytest

import lcpcli
from lcpcli.errors import OptionError
from lcpcli.methods.registry import Method, options_of
from lcpcli.options import Option

WRONG: list[tuple[Any, dict[str, Any], str]] = [
    ("shi", {"p": -1}, r"^p: -1 is out of range"),
    ("shi", {"rho": 0.4, "sigma": 0.2}, r"^sigma: 0.2 is out of range"),
    ("fixed-point", {"omega": "best"}, r"^omega: best is out of range"),
    ("interior", {"start_slack": -1}, r"^start_slack: -1 is out of range"),
    ("interior", {"regularization": 2}, r"^regularization: 2 is out of range"),
    ("newton", {"p": 3}, r"^p: has no effect with the method newton"),
    ("auto", {"omga": 3}, r"^omga: is not an option of auto"),
    ("auto", {"threads": 0}, r"^threads: 0 is out of range"),
    ("auto", {"time_limit": -1}, r"^time_limit: -1 is out of range"),
    ("auto", {"tol": 2}, r"^tol: 2 is out of range"),
]


@pytest.mark.parametrize(("method", "given", "message"), WRONG, ids=[" ".join(given) for _, given, _ in WRONG])
@pytest.mark.parametrize("q", [1, -1], ids=["start solves", "start does not solve"])
def test_wrong_option_is_refused_whether_or_not_the_start_is_a_solution(
    method: Any, given: dict[str, Any], message: str, q: float
) -> None:
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
