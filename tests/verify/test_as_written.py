"""A claim holds for the numbers as somebody wrote them: where rows depend on each other
as decimals, the doubles nearest to these decide otherwise."""

import json
from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli import Status

from .. import exact

NO_SOLUTION = {"infeasible", "unsolvable"}
FACTORS = (-3, -2, -1, 1, 2, 3, Fraction(1, 2))
# Each as its doubles decide wrongly, and whether it has a solution.
KNOWN = {
    "proportional rows": (
        {"M": [[-0.3, 0.3], [-0.2, 0.2]], "q": [-0.9, -0.6]},
        True,
    ),
    "a vector with q'y = 0": (
        {"M": [[-0.1, 0], [0.3, 0]], "q": [0.3, -0.9]},
        True,
    ),
    "equal rows": (
        {
            "M": [[0.7, 0.5, -0.4], [-0.6, -0.7, -0.5], [0.7, 0.5, -0.4]],
            "q": [-2.1, 1.8, -2.1],
        },
        True,
    ),
    "a variational inequality": (
        {"H": [[-0.9, 0.0], [0.3, 0.0]], "h": [2.7, -0.9]},
        True,
    ),
    "contact with a singular W": (
        {
            "W": [
                [0.1, -0.1, 0.3, -0.3],
                [-0.1, 0.1, -0.3, 0.3],
                [0.3, -0.3, 0.9, -0.9],
                [-0.3, 0.3, -0.9, 0.9],
            ],
            "q": [-2.0, 2.0, -6.0, 5.0],
            "mu": 1.0,
        },
        True,
    ),
    "huge values solve the doubles": (
        {
            "M": [[0.0, 0.2, -0.6], [0.0, -0.3, 0.9], [0.0, -0.1, 0.3]],
            "q": [0.8, -0.2, 0.0],
        },
        False,
    ),
}


def read(data, folder):
    file = folder / "problem.json"
    file.write_text(json.dumps(data))
    return lcpcli.read(file)


@pytest.mark.parametrize("name", KNOWN)
def test_dependent_decimals_are_decided_as_they_are_written(name, tmp_path, lcp):
    data, is_solvable = KNOWN[name]
    result = lcpcli.run(read(data, tmp_path))
    assert (result.status.word == "solved") is is_solvable
    assert result.status.has_no_solution is not is_solvable
    assert result.solved is False or result.relative_residual < 1e-12
    outcome = lcp("solve", str(tmp_path / "problem.json"))
    assert outcome.code == (0 if is_solvable else 3)


@pytest.mark.parametrize("name", ["proportional rows", "equal rows"])
def test_check_and_exact_agree_with_solve(name, tmp_path, lcp):
    data, _ = KNOWN[name]
    problem = read(data, tmp_path)
    file = str(tmp_path / "problem.json")
    result = lcpcli.run(problem)
    assert lcp("check", file, ",".join(map(str, result.z))).code == 0
    assert lcp("solve", file, "--exact").code == 0
    assert list(lcpcli.solutions(problem))


def test_a_number_of_many_digits_is_the_number_of_the_text(tmp_path):
    """Twenty digits, whose double is that of 0.1: rows are proportional with it, and
    not with 0.1."""
    long = "0.10000000000000000001"
    text = f'{{"M": [[-{long}, 0], [0.3, 0]], "q": [0.3, -0.9]}}'
    file = tmp_path / "long.json"
    file.write_text(text)
    problem = lcpcli.read(file)
    assert problem.written.are_short() is False
    # z_1 <= .3 / long < 3 <= z_1
    assert lcpcli.run(problem).status is Status.INFEASIBLE
    shorter = lcpcli.read(_replaced(file, long, "0.1"))
    assert lcpcli.run(shorter).solved


def _replaced(file, old, new):
    file.write_text(file.read_text().replace(old, new))
    return file


@pytest.mark.parametrize("name", KNOWN)
def test_of_arrays_no_solution_is_claimed_where_their_decimals_have_one(name):
    data, is_solvable = KNOWN[name]
    if "M" not in data:
        pytest.skip("made from M and q")
    result = lcpcli.solve(data["M"], data["q"])
    assert result.solved is is_solvable
    assert not result.status.has_no_solution
    problem = lcpcli.Problem(data["M"], data["q"])
    assert bool(list(lcpcli.solutions(problem))) is is_solvable
    assert bool(lcpcli.why(problem).conflict) is not is_solvable


def test_doubles_and_decimals_that_decide_otherwise_are_told_apart():
    data, _ = KNOWN["huge values solve the doubles"]
    result = lcpcli.solve(data["M"], data["q"])
    assert result.status is Status.ILL_POSED
    assert "as written" in result.message


def decimals(random, n, kind):
    """A problem in decimals of one or two places, with rows that depend on each other,
    whose w and z are planted or, for about a third, moved afterwards."""
    unit = Fraction(1, int(random.choice([10, 10, 100])))

    def number():
        return int(random.integers(-30, 31)) * unit

    own = max(1, n - int(random.integers(1, max(2, n // 2 + 1))))
    rows = [
        [number() if random.random() < 0.7 else Fraction(0) for _ in range(n)]
        for _ in range(own)
    ]
    while len(rows) < n:
        one, other = (rows[int(random.integers(len(rows)))] for _ in range(2))
        factor, times = random.choice(FACTORS), int(random.integers(-1, 2))
        rows.append([factor * a + times * b for a, b in zip(one, other, strict=True)])
    rows = [rows[i] for i in random.permutation(n)]
    lower, upper, z, w = [], [], [], []
    for _ in range(n):
        low, high, at, slack = planted(random, kind, number)
        lower.append(low)
        upper.append(high)
        z.append(at)
        w.append(slack)
    q = [b - exact.dot(row, z) for row, b in zip(rows, w, strict=True)]
    if random.random() < 0.35:
        q = [value + (number() if random.random() < 0.3 else 0) for value in q]
    data = {"M": floats(rows), "q": floats([q])[0]}
    if kind != "plain":
        data |= {"lower": floats([lower])[0], "upper": floats([upper])[0]}
    return data


def planted(random, kind, number):
    """Bounds of an unknown, its value, and w that fits them."""
    choice = random.random()
    if kind == "mixed" and choice < 0.4:
        return None, None, number(), Fraction(0)
    low = number() if kind == "boxed" else Fraction(0)
    high = low + 1 + abs(number()) if kind == "boxed" and choice < 0.5 else None
    place = random.random()
    if place < 0.45:
        return low, high, low, abs(number())
    if place < 0.6 and high is not None:
        return low, high, high, -abs(number())
    return low, high, low + Fraction(1, 2), Fraction(0)


def floats(rows):
    return [[None if a is None else float(a) for a in row] for row in rows]


def verdicts(seed, folder):
    """Whether a random problem has a solution as written, as the oracle says, and the
    words for the file and for the arrays."""
    random = np.random.default_rng([142, seed])
    n = int(random.integers(1, 5))
    data = decimals(random, n, str(random.choice(["plain", "boxed", "mixed"])))
    problem = read(data, folder)
    is_solvable = exact.solution(problem, number=exact.written) is not None
    bounds = {
        name: [end * np.inf if value is None else value for value in data[name]]
        for name, end in (("lower", -1), ("upper", 1))
        if name in data
    }
    of_file = lcpcli.run(problem).status.word
    of_arrays = lcpcli.solve(data["M"], data["q"], **bounds).status.word
    return is_solvable, of_file, of_arrays


@pytest.mark.parametrize(
    "seeds",
    [range(120), pytest.param(range(120, 1500), marks=pytest.mark.slow("a minute"))],
)
def test_random_dependent_decimals_have_the_verdict_of_the_oracle(seeds, tmp_path):
    for seed in seeds:
        is_solvable, of_file, of_arrays = verdicts(seed, tmp_path)
        if is_solvable:
            assert of_file == "solved", seed
            assert of_arrays == "solved", seed
        else:
            assert of_file in NO_SOLUTION, seed
            assert of_arrays in {*NO_SOLUTION, "ill_posed"}, seed
