"""Bimatrix games, judged by best responses in fractions, and game trees."""

from fractions import Fraction
from functools import partial

import numpy as np
import populations
from record import GENEROUS_SECONDS, Case, main, of_result

from lcpcli import from_game, run

GAMES, LARGEST, MAX_LARGE = 600, 12, 60
GAIN = Fraction(1, 10**9)  # relative to the payoffs that are reached
PAYOFFS = {
    "normal": lambda random, shape: random.standard_normal(shape),
    "ties": lambda random, shape: random.integers(-1, 2, shape).astype(float),
    "integers": lambda random, shape: random.integers(-50, 51, shape).astype(float),
    "penalties": lambda random, shape: np.where(
        random.random(shape) < 0.1,
        -(10.0 ** random.integers(3, 16)),
        random.integers(-3, 5, shape),
    ),
}


def cases(seed):
    """Return games of each kind, some of them large, and trees."""
    kinds = list(PAYOFFS)
    found = [
        Case(f"{kinds[k % 4]} {k}", partial(_game, kinds[k % 4], 1000 * seed + k))
        for k in range(GAMES)
    ]
    trees = [("poker", n) for n in (30, 60, 100)] + [
        ("bargaining", n) for n in (20, 40)
    ]
    return found + [
        Case(f"{family} {n}", partial(populations.gallery, family, n, seed))
        for family, n in trees
    ]


def _game(kind, seed):
    random = np.random.default_rng(seed)
    most = MAX_LARGE if seed % 10 == 0 else LARGEST
    A, B = PAYOFFS[kind](random, (2, *random.integers(2, most + 1, 2)))
    return from_game(A, B)


def outcome(case, problem):
    """Return what is compared; an equilibrium is false if a player gains by another
    strategy."""
    result = run(
        problem, time_limit=GENEROUS_SECONDS, compiled=sum(map(ord, case.key)) % 3 == 0
    )
    entry = of_result(result)
    origin = problem.origin
    if result.solved and hasattr(origin, "A"):
        x, y = (
            [Fraction(value) for value in part]
            for part in (result.answer.row, result.answer.column)
        )
        rows = [
            sum(Fraction(a) * p for a, p in zip(row, y, strict=True))
            for row in origin.A.tolist()
        ]
        columns = [
            sum(Fraction(b) * p for b, p in zip(column, x, strict=True))
            for column in origin.B.T.tolist()
        ]
        for player, payoffs, plan in (("row", rows, x), ("column", columns, y)):
            reached = sum(p * value for p, value in zip(plan, payoffs, strict=True))
            if max(payoffs) - reached > GAIN * (1 + abs(max(payoffs))):
                entry["false"] = (
                    f"the {player} player gains {float(max(payoffs) - reached):.2g}"
                )
    return entry


if __name__ == "__main__":
    main(cases, outcome)
