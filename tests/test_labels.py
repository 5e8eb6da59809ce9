"""Tables with labels, as of pandas, are taken by their labels or refused, never silently in another order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.errors import ProblemError


class Series:
    """What is used of pandas."""

    def __init__(self, values: Any, index: Any = None) -> None:
        self.values = np.array(values, dtype=float)
        self.index = range(len(self.values)) if index is None else index

    def to_numpy(self) -> Any:
        return self.values


class Frame(Series):
    def __init__(self, values: Any, index: Any = None, columns: Any = None) -> None:
        super().__init__(values, index)
        self.columns = range(self.values.shape[1]) if columns is None else columns


M, Q = [[4.0, 1.0], [0.0, 2.0]], [-9.0, -4.0]
Z = [1.75, 2.0]


@pytest.mark.parametrize(
    ("matrix", "q"),
    [
        (Frame(M, "ab", "ab"), Series(Q, "ab")),
        (Frame(M, "ab", "ab"), Series(Q[::-1], "ba")),
        (Frame(M[::-1], "ba", "ab"), Series(Q[::-1], "ba")),
        (Frame(M[::-1], "ba", "ab"), Series(Q, "ab")),
        (Frame(M), Series(Q[::-1], [1, 0])),
        (Frame(M), Series(Q, "ab")),
        (Frame(M, "ab", "ab"), Series(Q)),
        (Frame(M, columns="ab"), Q),
    ],
    ids=["same", "q", "rows and q", "rows", "numbers", "M without", "q without", "rows without"],
)
def test_labels_decide_the_order(matrix: Any, q: Any) -> None:
    assert lcpcli.solve(matrix, q).z == pytest.approx(Z)


def test_bounds_starts_and_columns_are_taken_by_label_too() -> None:
    matrix = Frame(M, "ab", "ab")
    problem = lcpcli.Problem(matrix, Q, upper=Series([9.0, 1.0], "ba"), x0=Series([2.0, 1.0], "ba"))  # type: ignore[arg-type]
    assert np.asarray(problem.upper).tolist() == [1.0, 9.0]
    assert problem.x0 is not None
    assert problem.x0.tolist() == [1.0, 2.0]
    many = lcpcli.solve_many(matrix, Frame(np.transpose(6 * [Q[::-1]]), "ba", range(6)))
    assert all(result.z == pytest.approx(Z) for result in many)


@pytest.mark.parametrize(
    ("matrix", "q", "field"),
    [(Frame(M, "ab", "ab"), Series(Q, "xy"), "q"), (Frame(M, "xy", "ab"), Series(Q), "M")],
    ids=["q", "rows"],
)
def test_other_labels_are_refused(matrix: Any, q: Any, field: str) -> None:
    with pytest.raises(
        ProblemError, match=f"^{field}: has an index with other labels than the columns of M; .*to_numpy"
    ):
        lcpcli.solve(matrix, q)
