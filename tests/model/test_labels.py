"""Tables with labels, as of pandas, are taken by their labels or refused, never silently in another order."""

from __future__ import annotations

import sys
from types import ModuleType
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
        self.shape = self.values.shape


M, Q = [[4.0, 1.0], [0.0, 2.0]], [-9.0, -4.0]
Z = [1.75, 2.0]


def test_labels_decide_the_order() -> None:
    for matrix, q in (
        (Frame(M, "ab", "ab"), Series(Q[::-1], "ba")),
        (Frame(M[::-1], "ba", "ab"), Series(Q[::-1], "ba")),
        (Frame(M[::-1], "ba", "ab"), Series(Q, "ab")),
        (Frame(M), Series(Q[::-1], [1, 0])),
        (Frame(M), Series(Q, "ab")),
        (Frame(M, "ab", "ab"), Series(Q)),
        (Frame(M, columns="ab"), Q),
    ):
        assert lcpcli.solve(matrix, q).z == pytest.approx(Z)


def test_bounds_starts_columns_and_known_solutions_are_taken_by_label_too() -> None:
    matrix = Frame(M, "ab", "ab")
    given: dict[str, Any] = {"upper": Series([9.0, 1.0], "ba"), "x0": Series([2.0, 1.0], "ba")}
    problem = lcpcli.Problem(matrix, Q, **given)
    assert (np.asarray(problem.upper).tolist(), np.asarray(problem.x0).tolist()) == ([1.0, 9.0], [1.0, 2.0])
    many = lcpcli.solve_many(matrix, Frame(np.transpose(6 * [Q[::-1]]), "ba", range(6)))
    assert all(result.z == pytest.approx(Z) for result in many)
    problem = lcpcli.Problem(matrix, Q, solutions=[Series(Z[::-1], "ba")])  # type: ignore[list-item]
    assert [z.tolist() for z in problem.solutions] == [Z]


def test_other_labels_are_refused() -> None:
    for rows, labels, field in (("ab", "xy", "q"), ("xy", None, "M")):
        told = f"^{field}: has an index with labels other than the columns of M; .*to_numpy"
        with pytest.raises(ProblemError, match=told):
            lcpcli.solve(Frame(M, rows, "ab"), Series(Q, labels))


def test_programs_are_taken_by_label() -> None:
    Q2, A2 = np.array([[2.0, 0.0], [0.0, 4.0]]), np.array([[3.0, 5.0], [7.0, 9.0]])
    plain = lcpcli.from_qp(Q2, [1, 2], A2, row_lower=[10, 20], upper=[8, 9])
    for order in ([0, 1], [1, 0]):
        columns, rows = ["".join(text[i] for i in order) for text in ("ab", "rs")]
        own: dict[str, Any] = {
            "c": Series(np.array([1, 2])[order], columns),
            "upper": Series(np.array([8, 9])[order], columns),
        }
        made = lcpcli.from_qp(
            Frame(Q2[order], columns, "ab"),
            A=Frame(A2[:, order], "rs", columns),
            row_lower=Series(np.array([10, 20])[order], rows),
            **own,
        )
        assert (made.M == plain.M).all()
        assert (made.q == plain.q).all()
        assert (np.asarray(made.upper) == plain.upper).all()
        linear = lcpcli.from_qp(None, A=Frame(A2[order], rows, "ab"), b=Series([20, 10], "sr"), **own)
        assert linear.q.tolist() == [1, 2, *(-np.array([10.0, 20.0])[order])]
    with pytest.raises(ProblemError, match="c: has an index with labels other than the columns of Q; give"):
        lcpcli.from_qp(Frame(Q2, "ab", "ab"), Series([1, 2], "ac"))  # type: ignore[arg-type]


def test_payoffs_are_taken_by_label_and_name_the_strategies() -> None:
    A, B = np.array([[3.0, 0, 1], [0, 2, 1]]), np.array([[1.0, 2, 3], [4, 5, 6]])
    for rows in ([0, 1], [1, 0]):
        for columns in ([0, 1, 2], [2, 0, 1]):
            other = Frame(B[rows][:, columns], [("opera", "box")[i] for i in rows], ["lrm"[j] for j in columns])
            game = lcpcli.from_game(Frame(A, ["opera", "box"], ["l", "r", "m"]), other)
            assert game.origin.data()["B"] == B.tolist()
            assert list(game.names) == ["opera", "box", "l", "r", "m"]
    with pytest.raises(ProblemError, match="B: has an index with labels other than the columns of A"):
        lcpcli.from_game(Frame(A, "ob", "lrm"), Frame(B, "ob", "lrx"))
    assert list(lcpcli.from_game(Frame(A), B).names) == [""] * 5


def test_pandas_itself_is_taken_by_label() -> None:
    pandas = pytest.importorskip("pandas")
    matrix = pandas.DataFrame(M, index=["a", "b"], columns=["a", "b"])
    q = pandas.Series(Q[::-1], index=["b", "a"])
    for dtype in ("int64", "Int64", "Float64", object):
        assert lcpcli.solve(matrix.astype(dtype), q.astype(dtype)).z == pytest.approx(Z)
    assert lcpcli.solve(matrix.loc[["b", "a"]], q).z == pytest.approx(Z)
    for wrong in (q[["a"]], pandas.Series([1, None], index=["a", "b"]), pandas.Series(Q, index=["a", "c"])):
        with pytest.raises(ProblemError):
            lcpcli.solve(matrix, wrong)
    bound = pandas.Series({"b": None, "a": 3.0})
    with pytest.raises(ProblemError, match="is not a number; give inf for no bound"):
        lcpcli.Problem(matrix, q, upper=bound)


def test_texts_that_label_the_columns_of_M_name_the_unknowns_unless_others_are_given() -> None:
    result = lcpcli.solve(Frame(M, "ab", "ab"), Series(Q, "ab"))
    assert list(result.names) == ["a", "b"]
    assert result["b"] == pytest.approx(Z[1])
    assert list(lcpcli.Problem(Frame(M, "ab", "ab"), Q, names=["x", "y"]).names) == ["x", "y"]
    assert not any(lcpcli.Problem(Frame(M), Q).names)
    assert not any(lcpcli.Problem(Frame(M, "aa", "aa"), Q).names)


def test_a_result_is_a_frame_with_a_row_for_each_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    module = ModuleType("pandas")
    monkeypatch.setattr(module, "DataFrame", lambda columns, index: made.append((columns, index)), raising=False)
    monkeypatch.setitem(sys.modules, "pandas", module)
    result = lcpcli.run(lcpcli.Problem(M, [-9.0, 4.0], names=["wheat", ""]))
    result.to_frame()
    ((columns, index),) = made
    assert index == ["wheat", "z2"]
    assert [list(columns[name]) for name in ("z", "w", "state")] == [[2.25, 0.0], [0.0, 4.0], ["basic", "lower"]]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(lcpcli.errors.ParameterError, match="to_frame: needs pandas; pip install pandas"):
        result.to_frame()


def test_an_argument_that_belongs_to_the_problem_says_where_it_goes() -> None:
    with pytest.raises(ValueError, match=r"names: belongs to the problem; write Problem\(M, q, names=\.\.\.\)"):
        lcpcli.solve(M, Q, names=["a", "b"])


def test_vectors_given_later_are_in_the_order_of_the_names() -> None:
    """The right-hand sides of a Solver, starts, answers to check, directions of derivatives."""
    M, names = [[4.0, -1, 0], [-1, 4, -1], [0, -1, 4]], ["a", "b", "c"]
    table = Frame(M, names, names)
    q, z = Series([-3.0, -1, 2], ["c", "a", "b"]), Series([0.75, 0.25, 0.0], ["c", "a", "b"])
    solver = lcpcli.Solver(table)
    assert solver.solve(q).z == pytest.approx([0.25, 0, 0.75])
    assert solver.solve(q, upper=Series([0.5, 9.0, 9.0], ["c", "a", "b"])).z == pytest.approx([0.25, 0, 0.5])
    assert next(lcpcli.solve_many(table, iter([q]))).z == pytest.approx([0.25, 0, 0.75])
    problem = lcpcli.Problem(table, q)
    assert lcpcli.check(problem, z).accepted
    assert lcpcli.run(problem, "fixed-point", z0=z, max_iterations=0).z == pytest.approx([0.25, 0, 0.75])
    result = lcpcli.run(problem)
    by_name = result.derivative(dq=Series([0.0, 4.0, 0.0], ["c", "a", "b"])).z
    assert by_name == pytest.approx(result.derivative(dq=[4.0, 0, 0]).z)
    assert result.gradient(Series([0.0, 1.0, 0.0], ["c", "a", "b"])).q == pytest.approx(result.gradient([1.0, 0, 0]).q)
    with pytest.raises(ProblemError, match="has an index with labels other than the names of the unknowns"):
        solver.solve(Series([-3.0, -1, 2], ["c", "a", "d"]))


def test_programs_of_qpsolvers_are_in_the_order_of_the_columns_of_P() -> None:
    names, other = ["x", "y"], ["y", "x"]
    P = Frame([[2.0, 0.0], [0.0, 4.0]], names, names)
    q = Series([-4.0, -1.0], other)
    assert lcpcli.solve_qp(P, q) == pytest.approx([0.5, 1.0])
    G = Frame([[0.0, 1.0]], ["row"], other)  # x <= 1/4
    assert lcpcli.solve_qp(P, q, G, [0.25]) == pytest.approx([0.25, 1.0])
    assert lcpcli.solve_qp(P, q, ub=Series([0.75, 9.0], other)) == pytest.approx([0.5, 0.75])
