"""The dual simplex method of dictionaries, against the primal one."""

from __future__ import annotations

import numpy as np

from lcpcli.rational.dictionary import Dictionary

OBJECTIVE = 100


def random_dictionary(random: np.random.Generator) -> Dictionary:
    """A polyhedron, often with degenerate vertices, in signed forms and one cobasic form of any sign, and an objective
    that has a least value there."""
    n, m = 4, 6
    rows = {n + i: random.integers(-3, 4, n + 1).tolist() for i in range(m)}
    for row in rows.values():
        row[0] = abs(row[0]) * int(random.integers(2))
    costs = np.sum([weight * np.array(row) for weight, row in zip([1, 0, 2], rows.values(), strict=False)], axis=0)
    rows[OBJECTIVE] = (costs + np.array([5, *random.integers(0, 3, n - 1), 0])).tolist()
    return Dictionary(rows, list(range(n)), [*range(n - 1), *range(n, n + m - 1)], lambda: None)


def test_the_dual_method_moves_to_the_same_least_value_or_finds_nothing_left() -> None:
    random = np.random.default_rng(0)
    empty = moved = 0
    for _ in range(300):
        here = random_dictionary(random)
        assert here.minimize(OBJECTIVE)
        zero, sign = random.permutation(10)[:2].tolist()
        primal, before = here.copy(), here.value(OBJECTIVE) / int(here.divisor)
        is_there = here.restrict(OBJECTIVE, zero, [sign])
        assert is_there == (primal.vanish(zero) and primal.require(sign))
        if not is_there:
            empty += 1
            continue
        assert primal.minimize(OBJECTIVE)
        assert here.value(OBJECTIVE) * int(primal.divisor) == primal.value(OBJECTIVE) * int(here.divisor)
        assert all(here.value(form) >= 0 for form in here.signed)
        assert here.value(zero) == 0
        moved += here.value(OBJECTIVE) / int(here.divisor) > before
    assert min(empty, moved) > 20
