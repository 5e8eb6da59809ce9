"""Components of a result by the names of the unknowns."""

from __future__ import annotations

import pytest

from lcpcli import Problem, from_qp, path, run
from lcpcli.errors import ProblemError


def test_a_multiplier_of_a_maximization_has_the_sign_of_the_program() -> None:
    """One more hour of labour is worth 3."""
    names = {"columns": ["chairs", "tables"], "rows": ["labour", "wood"]}
    program = from_qp(None, [3.0, 2.0], [[1.0, 1.0], [1.0, 3.0]], row_upper=[4.0, 6.0], lower=0.0, sense="max", **names)
    result = run(program)
    assert (result["chairs"], result["labour"], result["wood"]) == (4.0, 3.0, 0.0)
    more = from_qp(None, [3.0, 2.0], [[1.0, 1.0], [1.0, 3.0]], row_upper=[5.0, 6.0], lower=0.0, sense="max", **names)
    assert run(more).answer.objective - result.answer.objective == pytest.approx(3.0)  # type: ignore[union-attr]


def test_components_of_a_path_are_found_by_name() -> None:
    names = ["price", "flow"]
    found = path(*(Problem([[2, 1], [1, 2]], [first, -6], names=names) for first in (-5, 5)))
    assert found["flow"].tolist() == found.z[:, 1].tolist()
    with pytest.raises(KeyError, match="did you mean price"):
        found["prise"]


def test_a_name_of_several_unknowns_is_not_taken_for_one_of_them() -> None:
    with pytest.raises(ProblemError, match="names: has 'price' for 2 unknowns; give each its own name"):
        Problem([[2, 1, 0], [1, 2, 0], [0, 0, 1]], [-5, -6, -1], names=["price", "price", "flow"])
    assert list(Problem([[2, 1], [1, 2]], [-5, -6], names=["", ""]).names) == ["", ""]
    program = from_qp([[2.0]], [-2.0], [[1.0]], row_upper=[5.0], columns=["x"], rows=["x"])
    with pytest.raises(KeyError, match="'x' is the name of 2 unknowns"):
        run(program)["x"]
