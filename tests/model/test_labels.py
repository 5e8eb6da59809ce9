"""Tables with labels, as of pandas, are taken by their labels or refused, never
silently in another order."""

import sys
from types import ModuleType

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, solve

from ..refusals import calls, raised


class Series:
    """What is used of pandas."""

    def __init__(self, values, index=None):
        self.values = np.array(values, dtype=float)
        self.index = range(len(self.values)) if index is None else index

    def to_numpy(self):
        return self.values

    def take(self, places, axis):
        assert axis == "index"
        return Series(self.values[places], [self.index[i] for i in places])


class Frame(Series):
    def __init__(self, values, index=None, columns=None):
        super().__init__(values, index)
        self.columns = range(self.values.shape[1]) if columns is None else columns
        self.shape = self.values.shape

    def take(self, places, axis):
        if axis == "columns":
            return Frame(
                self.values[:, places], self.index, [self.columns[i] for i in places]
            )
        return Frame(self.values[places], [self.index[i] for i in places], self.columns)


M, Q = [[4.0, 1.0], [0.0, 2.0]], [-9.0, -4.0]
Z = [1.75, 2.0]


M3, Q3, Z3 = [[4.0, -1, 0], [-1, 4, -1], [0, -1, 4]], [-1.0, 2, -3], [0.25, 0.0, 0.75]
P, C, A = [[2.0, 0.0], [0.0, 4.0]], [-4.0, -1.0], [[3.0, 5.0], [7.0, 9.0]]


def square(values, names):
    """A table whose columns are in the order of the unknowns, and its rows in the
    opposite one."""
    return Frame(np.array(values)[::-1], names[::-1], names)


def wide(values, rows, columns):
    return Frame(np.array(values)[:, ::-1], rows, columns[::-1])


def table(values, rows, columns):
    return Frame(np.array(values)[::-1, ::-1], rows[::-1], columns[::-1])


def vector(values, names):
    return Series(values[::-1], names[::-1])


def plain(values, *_):
    return np.array(values, dtype=float)


def parts(problem):
    return [problem.M, problem.q, *problem.box.vectors(problem.n)]


def results(s, w, t, v):
    """What comes of tables and vectors that these functions make, with labels or
    without."""
    names = ["a", "b", "c"]
    problem = Problem(s(M3, names), v(Q3, names))
    result, solver = lcpcli.run(problem), lcpcli.Solver(s(M3, names))
    return {
        "a problem": solve(s(M, "ab"), v(Q, "ab")).z,
        "a vector alone": solve(Frame(M), v(Q, range(2))).z,
        "a matrix alone": solve(s(M, "ab"), Q).z,
        "a matrix that counts its unknowns": solve(Frame(M), Series(Q, "ab")).z,
        "bounds": Problem(s(M, "ab"), Q, upper=v([1.0, 9], "ab")).upper,
        "a start": Problem(s(M, "ab"), Q, x0=v([1.0, 2], "ab")).x0,
        "a known solution": Problem(s(M, "ab"), Q, solutions=[v(Z, "ab")]).solutions[0],
        "columns": next(
            lcpcli.solve_many(s(M, "ab"), t([[-9, -9], [-4, -4]], "ab", range(2)))
        ).z,
        "a program": parts(
            lcpcli.from_qp(
                s(P, "ab"),
                v(C, "ab"),
                w(A, "rs", "ab"),
                row_lower=v([1, 2], "rs"),
                upper=v([8, 9], "ab"),
            )
        ),
        "payoffs": lcpcli.from_game(
            Frame(A, "ob", "lr"), t(M, "ob", "lr")
        ).origin.data()["B"],
        "qpsolvers": lcpcli.solve_qp(
            s(P, "ab"), v(C, "ab"), w([[1.0, 0]], ["row"], "ab"), [0.25]
        ),
        "its bounds": lcpcli.solve_qp(s(P, "ab"), v(C, "ab"), ub=v([9.0, 0.1], "ab")),
        "a later q": solver.solve(v(Q3, names)).z,
        "later bounds": solver.solve(v(Q3, names), upper=v([9, 9, 0.5], names)).z,
        "a stream": next(lcpcli.solve_many(s(M3, names), iter([v(Q3, names)]))).z,
        "an answer": lcpcli.check(problem, v(Z3, names)).accepted,
        "a start of a run": lcpcli.run(
            problem, "fixed-point", z0=v(Z3, names), max_iterations=0
        ).z,
        "a derivative": result.derivative(dq=v([4.0, 0, 0], names)).z,
        "a gradient": result.gradient(v([1.0, 0, 0], names)).q,
    }


def test_labels_decide_the_order():
    known = results(plain, plain, plain, plain)
    for name, found in results(square, wide, table, vector).items():
        ours, theirs = (
            each if isinstance(each, list) else [each] for each in (found, known[name])
        )
        for one, other in zip(ours, theirs, strict=True):
            assert np.asarray(one) == pytest.approx(np.asarray(other), abs=1e-12), name


OTHER_LABELS = calls(
    "ProblemError",
    r"""
solve(Frame(M, "ab", "ab"), Series(Q, "xy"))
    => q: has an index with labels other than the columns of M; give them the same
    labels, or arrays, as by to_numpy()
solve(Frame(M, "xy", "ab"), Series(Q))
    => M: has an index with labels other than the columns of M; give them the same
    labels, or arrays, as by to_numpy()
from_qp(Frame(M, "ab", "ab"), Series(Q, "ac"))
    => c: has an index with labels other than the columns of Q; give them the same
    labels, or arrays, as by to_numpy()
from_game(Frame(M, "ab", "ab"), Frame(M, "ab", "ax"))
    => B: has an index with labels other than the columns of A; give them the same
    labels, or arrays, as by to_numpy()
Solver(Frame(M, "ab", "ab")).solve(Series(Q, "ad"))
    => q: has an index with labels other than the names of the unknowns; give them the
    same labels, or arrays, as by to_numpy()
""",
)


@pytest.mark.parametrize("refusal", OTHER_LABELS, ids=str)
def test_other_labels_are_refused(refusal):
    names = {"Frame": Frame, "Series": Series, "M": M, "Q": Q}
    assert raised(refusal.command, names) == refusal.line


def test_labels_of_payoffs_name_the_strategies():
    game = lcpcli.from_game(
        Frame([[3.0, 0, 1], [0, 2, 1]], ["opera", "box"], ["l", "r", "m"]),
        np.ones((2, 3)),
    )
    assert list(game.names) == ["opera", "box", "l", "r", "m"]
    assert list(lcpcli.from_game(Frame(A), np.ones((2, 2))).names) == [""] * 4


def test_unknowns_have_the_labels_of_columns_of_M_unless_named():
    result = solve(Frame(M, "ab", "ab"), Series(Q, "ab"))
    assert list(result.names) == ["a", "b"]
    assert result["b"] == pytest.approx(Z[1])
    assert list(Problem(Frame(M, "ab", "ab"), Q, names=["x", "y"]).names) == [
        "x",
        "y",
    ]
    assert not any(Problem(Frame(M), Q).names)
    assert not any(Problem(Frame(M, "aa", "aa"), Q).names)


def test_a_result_is_a_frame_with_a_row_for_each_unknown(monkeypatch):
    made = []
    module = ModuleType("pandas")
    monkeypatch.setattr(
        module,
        "DataFrame",
        lambda columns, index: made.append((columns, index)),
        raising=False,
    )
    monkeypatch.setitem(sys.modules, "pandas", module)
    result = lcpcli.run(Problem(M, [-9.0, 4.0], names=["wheat", ""]))
    result.to_frame()
    ((columns, index),) = made
    assert index == ["wheat", "z2"]
    assert list(columns["w"]) == [0.0, 4.0]
    assert list(columns["state"]) == ["basic", "lower"]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        lcpcli.errors.ParameterError, match="to_frame: needs pandas; pip install pandas"
    ):
        result.to_frame()
