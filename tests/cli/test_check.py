"""`lcp check` verifies an answer, of a program x alone too, and says which conditions
it violates."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli import check
from lcpcli.files import contents
from lcpcli.formulations.quadratic_program.answers import Minimum

from ..conftest import save_json
from ..methods.programs import bounded_program

# z = (0, 15/29, 17/29, 0), w = (14/29, 0, 0, 99/29)
EXAMPLE = contents.shipped_path("paper-example-2.json")
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.fixture
def checked(lcp, tmp_path, monkeypatch):
    """Check an answer, a text or an object for a file, to a problem in a file or an
    object for one."""

    def run(answer, options="", problem=EXAMPLE, name="answer"):
        monkeypatch.chdir(tmp_path)
        if not isinstance(problem, str):
            save_json(Path("p.json"), problem)
            problem = "p.json"
        Path(name).write_text(answer if isinstance(answer, str) else json.dumps(answer))
        return lcp(f"check {problem} {name} {options}")

    return run


def test_results_of_solve_are_accepted_and_any_changed_digit_is_refused(lcp, checked):
    solved = lcp(f"solve {EXAMPLE} --exact --format json").record
    found = checked(solved, "--exact --format json").record
    right = {"accepted": True, "residual": 0, "backward_error": 0, "violations": []}
    assert right.items() <= found.items()
    for vector, told in (
        ("z", "not an exact solution"),
        ("w", "the specified w is not Mz + q"),
    ):
        for i, text in enumerate(solved["exact"][vector]):
            own = [*solved["exact"][vector]]
            own[i] = text[:-1] + str((int(text[-1]) + 1) % 10)
            answer = solved["exact"] | {vector: own}
            outcome = checked(solved | {"exact": answer}, "--exact")
            assert (outcome.code, told in outcome.out) == (1, True), own


PORTFOLIO = contents.shipped_path("programs/portfolio.json")
UNIQUE = "x is the unique minimizer, as Q is positive definite"
SHIPPED = sorted(Path(contents.shipped_path("programs")).glob("*.json"))


def minimum(problem):
    answer = lcpcli.run(problem).answer
    assert isinstance(answer, Minimum)
    return answer


@pytest.mark.parametrize("distance", [1e-3, -0.09])
def test_what_is_missing_to_the_minimum_is_said_exactly_where_a_short_step_leads_there(
    distance,
):
    """x^2 - 2x has its minimum at 1, and x exceeds it by the square of the distance."""
    verification = check(lcpcli.from_qp([[2]], [-2]), [1 + distance])
    assert not verification.accepted
    (gain,) = re.findall(
        r" is at least (\S+) above the minimum$", verification.statement
    )
    assert 0.95 * distance**2 <= float(gain) <= distance**2


@pytest.mark.parametrize(
    "problem",
    [
        *map(lcpcli.read, SHIPPED),
        lcpcli.from_qp(**bounded_program(0)),
    ],
)
def test_x_alone_and_x_with_its_multipliers_are_accepted_and_a_changed_one_is_not(
    problem,
):
    answer = minimum(problem)
    alone = check(problem, answer.x)
    both = check(problem, np.concatenate((answer.x, answer.y)))
    assert alone.accepted
    assert both.accepted
    assert check(problem, np.concatenate((answer.x, alone.multipliers))).accepted
    changed = check(problem, answer.x + 0.01)
    assert not changed.accepted
    assert changed.statement.startswith("x is ")


def test_x_at_the_end_of_a_range_is_not_beyond_it_by_rounding():
    """0.1 + 0.1 + 0.1 is 0.30000000000000004."""
    program = lcpcli.from_qp(
        np.eye(3), [-5] * 3, [[0.1, 0.1, 0.1]], row_lower=-1, row_upper=0.3
    )
    assert (
        max(check(program, x).relative_residual for x in ([1, 1, 1], [1, 1, 1, -40]))
        <= 1e-15
    )


def test_multipliers_of_a_maximum_have_either_sign_and_wrong_ones_are_told():
    for bounds in ({"row_upper": [4, 6]}, {"row_lower": [0, -9], "row_upper": [4, 6]}):
        problem = lcpcli.from_qp(None, [3, 2], [[1, 1], [1, 3]], sense="max", **bounds)
        answer = minimum(problem)
        for y in (answer.y, -answer.y):
            found = check(problem, np.concatenate((answer.x, y)))
            assert found.accepted
            assert found.statement == "x is a maximizer of the linear program"
    found = check(lcpcli.read(PORTFOLIO), [13 / 62, 41 / 124, 57 / 124, 0.1, 0.2])
    assert not found.accepted
    assert found.statement == f"{UNIQUE}, but with other multipliers"


def test_stationary_point_is_not_called_a_minimizer():
    problem = lcpcli.from_qp(
        [[-2, 0], [0, 1]], [1, 0], [[1, 1]], row_lower=-1, row_upper=2
    )
    found = check(problem, [0.5, 0])
    assert found.accepted
    assert found.statement.startswith(
        "x is a stationary point and need not be a minimizer"
    )


NAMED = '{{"name": "{}", "M": [[2, 1], [1, 2]], "q": [-5, {}]}}\n'


def test_a_log_that_another_program_has_written_again_without_blanks_is_read(
    lcp, folder
):
    for i in range(3):
        (folder / f"p{i}.json").write_text(NAMED.format("trial", -i))
    found = lcp("solve p0.json p1.json p2.json -f json").records
    bare = (json.dumps(record, separators=(",", ":")) for record in found)
    Path("bare.jsonl").write_text("\n".join(bare))
    for i in range(3):
        assert lcp(f"check p{i}.json bare.jsonl -q").code == 0
