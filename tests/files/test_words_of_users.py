"""Programs and games as other packages and other programs write them."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli.errors import ProblemError

MPS = """NAME
ROWS
 N cost
 G row
COLUMNS
 y cost 1 row 1
RHS
 RHS row 1
BOUNDS
 LO BND x 2
QUADOBJ
 {0} {0} 1
ENDATA
"""


def test_a_variable_of_the_quadratic_part_alone_needs_no_column_in_mps(tmp_path: Path) -> None:
    path = tmp_path / "program.mps"
    path.write_text(MPS.format("x"))
    answer = lcpcli.run(lcpcli.read(path), "auto").answer
    assert answer.x == pytest.approx([1, 2])
    assert answer.objective == pytest.approx(3)


def test_a_misspelt_name_in_the_bounds_is_refused_still(tmp_path: Path) -> None:
    path = tmp_path / "program.mps"
    path.write_text(MPS.format("y"))
    with pytest.raises(ProblemError, match="'x', which is not in COLUMNS"):
        lcpcli.read(path)


def test_a_remark_after_a_dollar_sign_is_passed_over_in_mps(tmp_path: Path) -> None:
    path = tmp_path / "program.mps"
    lines = [f"{line} $ a remark" if line.startswith(" ") else line for line in MPS.format("x").splitlines()]
    path.write_text("\n".join(lines))
    assert lcpcli.run(lcpcli.read(path), "auto").answer.objective == pytest.approx(3)


def test_a_variable_of_the_quadratic_part_alone_in_lp(tmp_path: Path) -> None:
    pytest.importorskip("highspy")
    path = tmp_path / "program.lp"
    path.write_text("Minimize\n obj: y + [ x^2 ] / 2\nSubject To\n c: y >= 1\nBounds\n 2 <= x <= 40\nEnd\n")
    answer = lcpcli.run(lcpcli.read(path), "auto").answer
    assert answer.objective == pytest.approx(3)


@pytest.mark.parametrize("last", [1, 0])
def test_whole_numbers_as_text_are_payoffs_as_str_writes_them(last: int, tmp_path: Path) -> None:
    payoffs = [[Fraction(1, 2), Fraction(0)], [Fraction(-3), Fraction(last)]]
    path = tmp_path / "game.json"
    path.write_text(json.dumps({"A": [[str(v) for v in row] for row in payoffs], "B": [["1", "0"], ["0", "1"]]}))
    found = lcpcli.read(path).origin.A
    assert found.tolist() == [[0.5, 0], [-3, last]]


def test_one_row_of_constraints_may_be_a_list_of_numbers() -> None:
    for name, side in (("G", "h"), ("A", "b")):
        for row in ([-1.0, -1.0], np.array([-1.0, -1.0])):
            found = lcpcli.solve_qp(np.eye(2), [0, 0], **{name: row, side: [-1.0]})
            assert found.tolist() == pytest.approx([0.5, 0.5])


def test_a_game_without_payoffs_of_the_second_player_says_what_to_give() -> None:
    with pytest.raises(ProblemError, match="in a zero-sum game B = -A"):
        lcpcli.from_game([[1, 2], [3, 0]])


def test_a_solver_with_bounds_refuses_a_matrix_of_another_order_by_its_rows() -> None:
    solver = lcpcli.Solver(np.eye(2), upper=[1, 1])
    with pytest.raises(ProblemError, match="M: has 3 rows for 2 bounds"):
        solver.update(np.eye(3))


@pytest.mark.parametrize(("key", "here"), [("H", "P"), ("f", "q"), ("Aeq", "A"), ("A_ub", "G"), ("b_ub", "h")])
def test_keys_of_quadprog_and_linprog_are_refused_with_their_counterparts(key: str, here: str, tmp_path: Path) -> None:
    path = tmp_path / "program.json"
    path.write_text(json.dumps({"c": [1], key: [[1]]}))
    with pytest.raises(ProblemError, match=f"{key}: is not a key of a program; it is called {here} in the second"):
        lcpcli.read(path)
