"""Data of pandas with labels in another order are matched by label, at each door."""

import numpy as np
import pytest

import lcpcli

pd = pytest.importorskip("pandas")

A_B, B_A = ["a", "b"], ["b", "a"]
H = pd.DataFrame([[2.0, 1], [1, 3]], A_B, A_B)
LAW = pd.DataFrame([[1, 0.2], [0.2, 2]], A_B, A_B)
A = pd.DataFrame([[1.0, 1], [1, 2], [1, 4]], list("uvw"), A_B)
B = [1.0, 0, 2.5]


def swapped(values):
    """Return a vector or a row of two entries, in the other order with labels."""
    return pd.Series(values, A_B)[B_A]


def row(values):
    return pd.DataFrame([values], columns=A_B)[B_A]


def plain(values):
    return values


def plain_row(values):
    return [values]


def answer(problem):
    return lcpcli.run(problem).answer.x


def solved():
    return lcpcli.run(lcpcli.Problem(H, [-5, -6]))


# Each takes a function that makes a vector, and one that makes a row.
DOORS = {
    "from_players c": lambda v, _: answer(lcpcli.from_players([1, 1], H, v([-9, -6]))),
    "from_players upper": lambda v, _: answer(
        lcpcli.from_players([1, 1], H, [-9, -6], upper=v([2.0, 9]))
    ),
    "from_players A": lambda _, r: answer(
        lcpcli.from_players([1, 1], H, [-9, -6], r([0.0, 1]), row_upper=0.5)
    ),
    "from_avi h": lambda v, _: answer(lcpcli.from_avi(H, v([-9, -6]))),
    "from_qp c": lambda v, _: answer(lcpcli.from_qp(H, v([-9, -6]))),
    "from_qp lower": lambda v, _: answer(
        lcpcli.from_qp(None, [1, 2], A[:1], [3], lower=v([1.0, 0.5]))
    ),
    "from_contact q": lambda v, _: answer(lcpcli.from_contact(LAW, v([-3.0, -1]), 0.5)),
    "from_contact before": lambda v, _: answer(
        lcpcli.from_contact(LAW, [-3.0, -1], 0.5, restitution=0.5, before=v([-2.0, 1]))
    ),
    "from_findex b": lambda v, _: answer(
        lcpcli.from_findex(LAW, v([-3.0, -1]), [0, -0.5], [np.inf, 0.5], [-1, 0])
    ),
    "from_findex upper": lambda v, _: answer(
        lcpcli.from_findex(LAW, [-3.0, -1], 0, v([1.0, 9]), [-1, -1])
    ),
    "from_osqp q": lambda v, _: answer(
        lcpcli.from_osqp(H, v([-9, -6]), np.eye(2), [0, 0], [9, 9])
    ),
    "from_osqp A": lambda _, r: answer(
        lcpcli.from_osqp(H, [-9, -6], r([0.0, 1]), [0], [0.5])
    ),
    "lsq E": lambda _, r: lcpcli.lsq(A, B, E=r([1.0, 3]), d=1).answer.x,
    "lsq E of one row": lambda v, _: lcpcli.lsq(A, B, E=v([1.0, 3]), d=1).answer.x,
    "lsq d": lambda v, _: (
        lcpcli.lsq(A, B, E=pd.DataFrame(np.eye(2), A_B, A_B), d=v([0.1, 0.9])).answer.x
    ),
    "lsq upper": lambda v, _: lcpcli.lsq(A, B, upper=v([0.2, 0.1])).answer.x,
    "derivative dq": lambda v, _: solved().derivative(dq=v([1.0, 0])).z,
    "gradient": lambda v, _: solved().gradient(v([1.0, 0])).q,
    "optimum": lambda v, _: float(lcpcli.optimum(solved().problem, v([1.0, 0])).value),
    "solve lower": lambda v, _: lcpcli.solve(H, [-5, -6], lower=v([2.0, 0])).z,
    "check": lambda v, _: lcpcli.check(solved().problem, v([1.8, 1.4])).accepted,
}


@pytest.mark.parametrize("door", DOORS)
def test_labels_in_another_order_are_matched(door):
    expected = DOORS[door](plain, plain_row)
    assert np.allclose(DOORS[door](swapped, row), expected)


def test_change_of_M_is_matched_by_both_labels():
    dM = pd.DataFrame([[1.0, 2], [0, 0]], A_B, A_B)
    expected = solved().derivative(dM=dM.to_numpy()).z
    assert np.allclose(solved().derivative(dM=dM.loc[B_A, B_A]).z, expected)


def test_read_only_bounds_are_taken_and_others_stay_as_they_are():
    lower = np.array([1.0, 0.5])
    for writeable in (True, False):
        lower.flags.writeable = writeable
        program = lcpcli.from_qp(None, [1, 2], [[1, 1]], [3], lower=lower)
        assert lcpcli.run(program).answer.x == pytest.approx([2.5, 0.5])
        assert lower.tolist() == [1.0, 0.5]
