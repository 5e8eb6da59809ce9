"""Results are of the numbers that were passed, whatever the caller's arrays hold
later: answers are computed when they are read."""

import numpy as np
import pytest

import lcpcli

A = np.array([[2.0, 1], [1, 2], [1, 0]])
GAME = np.array([[3.0, 0, 1], [0, 2, 1]])
DEFINITE = np.array([[2.0, 1, 1], [1, 2, 1], [1, 1, 2]])
# Each with a call and the arrays that it takes.
CALLS = {
    "nnls": (lcpcli.nnls, [A, np.array([5.0, 6, 1])]),
    "nnls, several b": (
        lambda A, b: lcpcli.nnls(A, b)[0],
        [A, np.array([[5.0, 1], [6, 2], [1, 3]])],
    ),
    "lsq": (
        lcpcli.lsq,
        [A, np.array([5.0, 6, 1]), np.zeros(2), np.full(2, 4.0), np.ones((1, 2)), [3]],
    ),
    "from_lsq": (
        lambda *arrays: lcpcli.run(lcpcli.from_lsq(*arrays)),
        [A, np.array([5.0, 6, 1])],
    ),
    "from_qp": (
        lambda Q, c, A, b: lcpcli.run(lcpcli.from_qp(Q, c, A, row_lower=b)),
        [DEFINITE, np.array([-1.0, 2, 3]), np.ones((1, 3)), np.ones(1)],
    ),
    "solve_qp": (lcpcli.solve_qp, [DEFINITE, np.array([-1.0, 2, 3])]),
    "from_avi": (
        lambda H, h: lcpcli.run(lcpcli.from_avi(H, h)),
        [np.array([[2.0, 1], [-1, 2]]), np.array([-4.0, -4])],
    ),
    "from_game": (
        lambda A, B: lcpcli.run(lcpcli.from_game(A, B)),
        [GAME, GAME[::-1].copy()],
    ),
    "from_polymatrix": (
        lambda A, B: lcpcli.run(lcpcli.from_polymatrix({(0, 1): A, (1, 0): B})),
        [GAME, GAME.T.copy()],
    ),
    "from_players": (
        lambda H, c: lcpcli.run(lcpcli.from_players([1, 1, 1], H, c)),
        [DEFINITE, np.array([-10.0, -9, -8])],
    ),
    "from_contact": (
        lambda W, q, mu: lcpcli.run(lcpcli.from_contact(W, q, mu)),
        [np.array([[2.0, 0.5], [0.5, 1]]), np.array([-1.0, 0.3]), np.array([0.5])],
    ),
    "solve": (lcpcli.solve, [DEFINITE, np.array([-5.0, -6, 1])]),
}


def numbers(value, depth=0):
    """All that a result says in numbers and texts, without times."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if value is None or isinstance(value, (bool, int, float, str)) or depth > 4:
        return repr(value)
    if isinstance(value, (list, tuple)):
        return [numbers(each, depth + 1) for each in value]
    names = ("answer", "z", "w", "residual", "relative_residual", "certificate")
    if not hasattr(value, "relative_residual"):
        names = [
            name
            for name in dir(value)
            if not name.startswith("_")
            and name != "seconds"
            and isinstance(
                getattr(value, name, None), (np.ndarray, float, str, list, tuple)
            )
        ]
    return {name: numbers(getattr(value, name, None), depth + 1) for name in names}


@pytest.mark.parametrize("name", CALLS)
def test_what_the_caller_writes_later_changes_no_result(name):
    call, arrays = CALLS[name]
    expected = numbers(call(*(np.array(each, dtype=float) for each in arrays)))
    passed = [np.array(each, dtype=float) for each in arrays]
    result = call(*passed)
    for array in passed:
        array[...] = 7.0
    assert numbers(result) == expected
