"""Conflicts: the conditions named cannot hold together, and without any one of them the
others can, by every combination of states; with proofs that are checked here."""

from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli import why
from lcpcli.explanation.conditions import COMPLEMENTARITY

from ..refusals import calls, raised
from ..seeds import few_of
from .brute_force import keys_of, unsolvable

KINDS = pytest.mark.parametrize(
    ("most", "is_mixed"), [(6, False), (4, True)], ids=["lcp", "mixed"]
)


@KINDS
def test_a_conflict_has_no_point_and_without_any_member_it_has_one(most, is_mixed):
    kinds = set()
    for seed, small in unsolvable(12, most, is_mixed):
        found = why(small.problem())
        keys = keys_of(found.conflict)
        assert found.status == "unsolvable", seed
        assert found.irreducible, seed
        assert not small.is_possible(keys), seed
        for key in keys:
            assert small.is_possible([each for each in keys if each != key]), seed
        kinds.add(any(kind == COMPLEMENTARITY for kind, _ in keys))
    assert kinds == {False, True}


def test_what_is_kept_is_never_blamed():
    for seed, small in unsolvable(10, 4, False):
        problem = small.problem()
        blamed = why(problem).conflict
        first = f"{blamed[0].name} {blamed[0].what}"
        found = why(problem, keep=[first])
        keys, kept = keys_of(found.conflict), keys_of(blamed[:1])
        assert kept[0] not in keys, seed
        assert found.irreducible, seed
        assert not small.is_possible(keys + kept), seed
        for key in keys:
            rest = [each for each in keys if each != key]
            assert small.is_possible(rest + kept), seed


def infeasible_program(seed):
    """A program whose rows hold at a point, but for the last one, which is excluded by
    some of them."""
    random = np.random.default_rng(seed)
    m, k, size = int(random.integers(20, 60)), int(random.integers(4, 12)), 3
    A = random.integers(-9, 10, (m, k)) * (random.random((m, k)) < 0.5)
    x = random.integers(0, 6, k)
    low = (A @ x - random.integers(0, 9, m)).astype(float)
    high = np.where(random.random(m) < 0.5, np.inf, low + random.integers(9, 20, m))
    factors = random.integers(1, 4, size)
    A = np.vstack((A, -factors @ A[:size]))
    low = np.append(low, 1 + random.integers(0, 9) - factors @ low[:size])
    return {
        "c": random.integers(-5, 9, k),
        "A": A,
        "row_lower": low,
        "row_upper": np.append(high, np.inf),
        "lower": np.where(random.random(k) < 0.7, 0.0, -np.inf),
        "rows": [f"row {i}" for i in range(m + 1)],
        "columns": [f"x {j}" for j in range(k)],
    }


def inequality(program, of):
    """The a and b of a'x >= b, which a bound, or a side of a row, asks for."""
    kind, number = of.name.split()
    end, _ = of.what.split()
    i, sign = int(number), 1 if end == "lower" else -1
    if kind == "row":
        return sign * program["A"][i], sign * program[f"row_{end}"][i]
    return sign * np.eye(program["c"].size, dtype=int)[i], sign * program[end][i]


@pytest.mark.parametrize("seed", few_of(range(12), 5))
def test_multipliers_prove_that_rows_of_a_program_conflict(seed):
    """They add up to 0 >= a positive number, and the rows of no part do so: the system
    of the multipliers has one solution."""
    program = infeasible_program(seed)
    found = why(lcpcli.from_qp(None, **program))
    assert found.irreducible
    assert 1 < len(found.conflict) <= 12
    rows, sides = zip(
        *(inequality(program, each) for each in found.multipliers), strict=True
    )
    multipliers = np.array([*found.multipliers.values()])
    assert multipliers.min() > 0
    assert not (multipliers @ np.array(rows)).any()
    assert multipliers @ [*map(Fraction, sides)] > 0
    assert np.linalg.matrix_rank(rows) == len(rows) - 1 == len(found.conflict) - 1


WRONG = calls(
    "ParameterError",
    r"""
why(P, keep=["z2"])
    => keep: 'z2' names nothing in this problem; write a name, or a name and what it is,
    as in 'z1 lower bound'
why(P, change="upper")
    => change: 'upper' names nothing in this problem; write a name, or a name and what
    it is, as in 'z1 lower bound'
why(P, weights={"z1": 0}) => weights: {IS:0 for 'z1'}; give a positive number
why(P, weights={"z1": "a"}) => weights: {IS:a for 'z1'}; give a positive number
why(P, time_limit=0) => time_limit: {OUT_OF_RANGE:0}; {IT_MUST_BE:seconds > 0}
why(P, keep=[1]) => keep: {IS:not a list of names}; write ["z1", "z2"]
""",
)
WRONG += calls("ProblemError", r"why([[1]]) => problem: {IS:a list}; {BY_READING}")


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_wrong_problems_and_parameters_are_refused(refusal):
    names = {"P": lcpcli.Problem([[-1]], [-1])}
    assert raised(refusal.command, names) == refusal.line
