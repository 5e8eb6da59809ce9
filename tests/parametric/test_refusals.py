"""Derivatives that do not exist, and paths that lead nowhere, are refused in a line."""

import numpy as np
import pytest

from lcpcli import Problem, run, solve, solve_many

from ..refusals import calls, raised

M = np.array([[2.0, 1], [1, 2]])
NAMES = {
    "M": M,
    "mixed": solve(np.eye(3), [1, 2, 3], lower=[0, None, 1], upper=[None, None, 1]),
    "batch": solve_many([np.eye(2), 2 * np.eye(2)], [[-1, -2], [-3, 4]]),
    "unsolvable": solve([[0, 1], [1, 0]], [-1, 1]),
    "two_pairs": solve(
        np.kron(np.diag([1.0, 2.0]), np.ones((2, 2))), [-1, -1, -4, -4], "interior"
    ),
    "line": solve([[1, 1], [1, 1]], [-2, -2], lower=None),
    "segment": run(
        Problem([[1, 1], [1, 1]], [-1, -1]), z0=[0.5, 0.5], max_iterations=1
    ),
    "rounded_line": solve([[0.1, 0.3], [0.3, 0.9]], [-0.1, -0.3], lower=-np.inf),
}
# Solutions that are not strongly regular, each with z.
IRREGULAR = [
    (run(Problem([[-1]], [0])), [0.0]),
    (run(Problem([[0]], [0])), [0.0]),
    (run(Problem([[1, 1], [1, 1]], [0, 0])), [0.0, 0.0]),
    (run(Problem([[1, 1], [1, 0]], [-1, -1]), z0=[1, 0], max_iterations=1), [1.0, 0.0]),
    (
        run(
            Problem([[2, 3], [3, 2]], [-5, -5], upper=1.0), z0=[1, 1], max_iterations=1
        ),
        [1.0, 1.0],
    ),
]
NAMES |= {f"irregular_{i}": result for i, (result, _) in enumerate(IRREGULAR)}

REFUSALS = [
    *calls(
        "ProblemError",
        r"""
mixed.gradient([1, 2]) => g: {ENTRIES:2 entries|3 unknowns}; {AGREE}
mixed.gradient([1, 2], J=[[1, 2, 3]]) => g: {ENTRIES:2 entries|1 row of J}; {AGREE}
mixed.gradient([1], J=[[1, 2]])
    => J: {HAS_SHAPE:(1, 2)}; give rows of 3 numbers, one for each unknown
mixed.derivative(dM=np.eye(2)) => dM: {SHAPE_BESIDE:2 x 2|q|3 entries}; {AGREE}
mixed.derivative(dq=[1, 2]) => dq: {ENTRIES:2 entries|3 unknowns}; {AGREE}
mixed.derivative(dq=[1, nan, 2]) => dq[1]: {NOT_FINITE}; {FINITE}{FROM_0}
mixed.derivative(dlower=[0, -1, 0]) => dlower[1]: {NO_SUCH_BOUND:-1}; {GIVE_0}{FROM_0}
mixed.derivative(dupper=[2, 0, 0]) => dupper[0]: {NO_SUCH_BOUND:2}; {GIVE_0}{FROM_0}
mixed.derivative(dlower=[0, 0, 1])
    => dlower[2]: is 1 and dupper[2] is 0, but lower[2] = upper[2]; move both by the
    same{FROM_0}
batch.derivative(dq=np.ones((3, 2))) => dq: {HAS_SHAPE:(3, 2)}; {GIVE_SHAPE:(2, 2)}
batch.derivative(dM=np.ones(2)) => dM: {HAS_SHAPE:(2,)}; {GIVE_SHAPE:(2, 2, 2)}
batch.derivative(J=np.ones((2, 3))) => J: {HAS_SHAPE:(2, 3)}; {GIVE_SHAPE:(2, k, 2)}
batch.derivative(dupper=[[0, 0], [0, 1]])
    => dupper[1][1]: {NO_SUCH_BOUND:1}; {GIVE_0}{FROM_0}
path(Problem(M, [1, 1]), Problem([[2, 1], [1, 3]], [1, 1])) => M: {OTHER_M}; {ONE_M}
path(Problem(M, [1, 1]), Problem([[2]], [1])) => n: {TWO_VALUES:2|1}; {SAME_UNKNOWNS}
path(Problem(M, [1, 1]), Problem(M, [1, 1], upper=[1, inf]))
    => upper[0]: {FINITE_IN_ONE}; {FINITE_IN_BOTH}{FROM_0}
""",
    ),
    *calls(
        "OptionError",
        r"""
path(Problem(M, [1, 1]), Problem(M, [1, 1]), start=1, stop=1)
    => start: is 1, and stop 1; give finite numbers, start < stop
path(Problem(M, [1, 1]), Problem(M, [1, 1]))(2)
    => t: is 2, and the path is known from 0 to 1; give a t there
""",
    ),
    *calls(
        "ParameterError",
        """
batch.gradient([1, 2], unsolved="no") => unsolved: {UNKNOWN:'no'}; give "raise" or "nan"
""",
    ),
    *calls(
        "DerivativeError",
        r"""
unsolvable.derivative(dq=[1, 0]) => {NOT_SOLVED}
unsolvable.gradient([1, 0]) => {NOT_SOLVED}
solve([[2, -1], [-2, 1]], [-2, 2], lower=-1, upper=1).derivative(dM=np.ones((2, 2)), \
dq=[1, -2], one_sided=True)
    => no derivative could be computed in this direction: has no solution: no z within
    the bounds has w with the signs required by complementarity, by the y of the
    certificate
two_pairs.derivative(dq=[1, 1, 0, 0], J=[[1, 0, 0, 0]]) => {DIFFERS_IN_J}{FROM_0}
two_pairs.derivative(dq=[1, 1, 0, 0], J=[[0, 0, 0, 1]]) => {DIFFERS_IN_J}{FROM_0}
two_pairs.derivative(dq=[1, 1, 0, 0], J=[[1, 1, 1, 0]]) => {DIFFERS_IN_J}{FROM_0}
line.gradient([1, 0]) => {SINGULAR}
line.derivative(dq=[1, 1]) => {SINGULAR}
segment.gradient([1, 0]) => {SINGULAR}
segment.derivative(dq=[1, 0]) => {SINGULAR}
rounded_line.gradient([1, 0]) => {SINGULAR}
rounded_line.derivative(dq=[1, 0]) => {SINGULAR}
irregular_0.derivative(dq=[1], one_sided=True) => {NOT_REGULAR}
irregular_1.derivative(dq=[1], one_sided=True) => {NOT_REGULAR}
irregular_2.derivative(dq=[1, 1], one_sided=True) => {NOT_REGULAR}
irregular_3.derivative(dq=[1, 1], one_sided=True) => {NOT_REGULAR}
irregular_4.derivative(dq=[1, 1], one_sided=True) => {NOT_REGULAR}
""",
    ),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_what_has_no_derivative_or_no_path_is_refused(refusal):
    assert raised(refusal.command, NAMES) == refusal.line


def test_solutions_that_are_not_strongly_regular_are_found():
    assert [(result.solved, result.z.tolist()) for result, _ in IRREGULAR] == [
        (True, z) for _, z in IRREGULAR
    ]
    assert NAMES["segment"].z.tolist() == [0.5, 0.5]
