"""MPS: sides of rows and bounds, as they are written, and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, from_qp, read, write
from lcpcli.errors import ProblemError
from lcpcli.model.problem import conditions_of
from lcpcli.model.program import Program

BOUND = """NAME p
ROWS
 N  cost
 G  row
COLUMNS
    x  cost  1  row  1
    y  cost  1  row  1
RHS
    RHS  row  -4
BOUNDS
{}
ENDATA
"""


def program_of(problem: Problem) -> Any:
    assert isinstance(problem.origin, Program)
    return problem.origin.program(conditions_of(problem))


def test_sides_are_read_back_as_the_doubles_that_they_were(tmp_path: Path) -> None:
    """In doubles 0.3 - 0.1 is not 0.2. A row without sides has none."""
    sides = {"row_lower": [0.1, -np.inf, -np.inf, 0.5], "row_upper": [0.3, np.inf, 0.7, np.inf]}
    write(from_qp(None, [1.0, 1.0], np.ones((4, 2)) + np.eye(4, 2), **sides), tmp_path / "p.mps")
    assert " 0.2\n" in (tmp_path / "p.mps").read_text()  # the range in decimals
    found = program_of(read(tmp_path / "p.mps"))
    rows = sorted(zip(found.row_lower.tolist(), found.row_upper.tolist(), strict=True))
    assert [row for row in rows if row != (-np.inf, np.inf)] == [(-np.inf, 0.7), (0.1, 0.3), (0.5, np.inf)]


@pytest.mark.parametrize(
    ("line", "bounds"),
    [
        (" FR BND x 0", (-np.inf, np.inf)),
        (" MI BND x 0", (-np.inf, np.inf)),
        (" PL BND x 0", (0, np.inf)),
        (" FR BND x", (-np.inf, np.inf)),
        (" UP BND x 3", (0, 3)),
    ],
)
def test_a_number_behind_a_bound_that_takes_none_is_left_out(
    line: str, bounds: tuple[float, float], tmp_path: Path
) -> None:
    (tmp_path / "p.mps").write_text(BOUND.format(line))
    found = program_of(read(tmp_path / "p.mps"))
    assert (found.lower[0], found.upper[0]) == bounds


def test_a_negative_upper_bound_alone_is_refused_as_it_has_two_meanings(tmp_path: Path) -> None:
    (tmp_path / "p.mps").write_text(BOUND.format(" UP BND x -3"))
    with pytest.raises(ProblemError, match="lower bound"):
        read(tmp_path / "p.mps")
    (tmp_path / "p.mps").write_text(BOUND.format(" MI BND x\n UP BND x -3"))
    found = program_of(read(tmp_path / "p.mps"))
    assert (found.lower[0], found.upper[0]) == (-np.inf, -3)
