"""What counts as a verified path: each breakpoint by the criterion of `solve` for the problem at its t; and corners of
paths: starts among several solutions, and proofs at an end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Path, Problem, from_qp, path
from lcpcli.parametric import following
from lcpcli.parametric.following import basic_states
from lcpcli.parametric.path import Family
from lcpcli.parametric.verified import verify

from ..exact_measure import relative_residual
from .families import Pair, general, integers, positive


def check_breakpoints(found: Path) -> None:
    """Each breakpoint that is not on a jump is a solution by fractions, and by `lcpcli.check`."""
    assert found.verified
    for t, z in zip(found.t.tolist(), found.z, strict=True):
        if np.count_nonzero(found.t == t) == 1:
            problem = found.family.at(t)
            if (np.abs(z[z != 0]) >= np.finfo(float).tiny).all():  # others are rounded to the grid near 0
                assert relative_residual(problem, z) <= 1e-10
            assert lcpcli.check(problem, z).accepted


def spread(seed: int) -> Pair:
    """Two problems with a positive definite M and numbers of very different sizes in q."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 6))
    A, B = random.normal(size=(2, n, n))
    M = A @ A.T + B - B.T + 0.1 * np.eye(n)
    first, last = random.normal(size=(2, n)) * 10.0 ** random.choice([0, 0, 8, 12, 16, -8, -16], (2, n))
    return Problem(M, first), Problem(M, last)


def extreme(seed: int) -> Pair:
    """Two problems with up to three unknowns and numbers from 1e-300 to 1e300."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4))
    sizes = 10.0 ** random.uniform(-300, 300, (3, n))
    return tuple(Problem(np.diag(sizes[0]), random.choice([-1, 1], n) * q) for q in sizes[1:])  # type: ignore[return-value]


@pytest.mark.parametrize("make", [lambda seed: positive(seed, 5, 12), integers, general, spread, extreme])
def test_each_breakpoint_of_a_verified_path_solves_its_problem(make: Callable[[int], Pair]) -> None:
    verified = 0
    for seed in range(12):
        found = path(*make(seed), turns=seed % 4 == 0)
        if found.verified:
            check_breakpoints(found)
            verified += 1
    assert verified >= 3


@pytest.mark.parametrize(
    ("ends", "t", "z", "states", "is_verified"),
    [
        ((-1, 1), [0, 0.5, 1], [1, 0, 0], [0, -1], True),
        ((-1, 1), [0, 1], [1, 0], [0], False),  # basic throughout, although w is 1 at the end
        ((1, -1), [0, 0.5, 1], [0, 0, 1], [-1, 0], True),
        ((1, -1), [0, 1], [0, 1], [0], False),  # the ends alone are solutions
        ((-1, 1), [0.5, np.inf], [0, 1], [0], False),
        ((-1, -2), [0, 1], [1, 2], [0], True),
        *(((-1, -2), [0, 1], z, [0], False) for z in ([np.nan, 2], [1, np.nan], [np.inf, 2], [1, np.inf])),
    ],
)
def test_only_a_path_whose_pieces_are_solutions_throughout_is_verified(
    ends: tuple[int, int], t: list[float], z: list[float], states: list[int], is_verified: bool
) -> None:
    family = Family(*(Problem([[1.0]], [q]) for q in ends))
    columns = (np.array(values, float)[:, np.newaxis] for values in (z, states))
    assert verify(family, np.array(t, float), *columns, 1e-10).is_verified == is_verified


def test_a_corner_at_a_third_lies_on_the_side_that_has_solutions() -> None:
    """At t = 1/3 rounded up the problem has no solution near."""
    for first, last in (([1], [-2]), ([2], [-1]), ([7], [-2.3])):
        check_breakpoints(path(Problem([[-1]], first), Problem([[-1]], last), turns=True))


def test_a_jump_at_a_third_is_verified_up_to_the_last_bit_of_t() -> None:
    """min c x1 + 2 c x2, 0 <= x <= 1, as c goes from -1 to 2: x jumps at c = 0 in two steps, between which x solves the
    program there only."""
    first, last = (from_qp(None, [c, 2 * c], [[-1, 0], [0, -1]], [-1, -1]) for c in (-1, 2))
    found = path(first, last)
    assert found.verified
    assert list(found.jumps) == [1, 2]
    assert set(found.t.tolist()) == {0, 1 / 3, 1}


@pytest.mark.parametrize(("n", "exact"), [(40, False), (20, True)])
def test_a_path_verified_in_parts_is_the_same_path(n: int, exact: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, n, n)
    whole = path(first, last, exact=exact)
    monkeypatch.setattr(following, "AT_ONCE", 1)
    found = path(first, last, exact=exact)
    assert whole.t.size > 2 * following.LEAST_AT_ONCE
    for name in ("t", "z", "w", "states"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))
    assert (found.end, found.verified, found.exact) == (whole.end, True, whole.exact)


def test_a_path_is_not_verified_if_its_first_part_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    real, made = following.verify, list[bool]()

    def doubtful_at_first(*given: Any) -> Any:
        found = real(*given)
        made.append(found.is_verified)
        return found._replace(is_verified=len(made) > 1)

    monkeypatch.setattr(following, "AT_ONCE", 1)
    monkeypatch.setattr(following, "verify", doubtful_at_first)
    found = path(*positive(30, 40, 40))
    assert len(made) > 2
    assert all(made)
    assert not found.verified


def test_memory_bounds_a_path_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    monkeypatch.setattr(following, "MOST_NUMBERS", 200)
    part = path(first, last)
    assert (part.end, part.t.size, part.verified) == ("breakpoint_limit", 6, True)
    assert "5 with 40 unknowns fill the memory" in part.message


@pytest.mark.parametrize(("z", "states"), [([0.25, 0.75], [-1, 0]), ([0.75, 0.25], [0, -1])])
def test_of_a_segment_of_solutions_the_nearer_end_is_the_start(z: list[float], states: list[int]) -> None:
    problem = Problem([[1, 1], [1, 1]], [-1, -1])
    assert basic_states(problem, np.array(z), np.zeros(2), np.zeros(2, bool)).tolist() == states


RAY = [[0, -2], [0, 1]]  # the ray in z1 is no proof, the multipliers of the rows are: z2 >= 4 and 2 - 2 z2 >= 0
PROVED = "the second problem is proved to have no solution"
ENDS: dict[str, tuple[Any, Any, Any, dict[str, Any], str, str, list[list[float]]]] = {  # z is of both ends
    "z overflows": ([[1e-300]], [1], [-1e300], {}, "breakdown", "z is too large for double precision", [[0], [0]]),
    "its end is small beside its beginning": ([[1]], [-1e16], [-1], {}, "reached", "", [[1e16], [1]]),
    "no first point": ([[0]], [-1], [-1], {"exact": True}, "infeasible", "", []),
    "no first point, but a last one": ([[0]], [-1], [0], {"exact": True}, "infeasible", "", []),
    "a ray": (RAY, [2, 2], [2, -4], {}, "ray", PROVED, [[0, 0], [0, 1]]),
    "one point": ([[0]], [0], [-1], {}, "ray", PROVED, [[0], [0]]),  # w is 0 at once, and no z helps
}


@pytest.mark.parametrize("name", ENDS)
def test_ends_of_paths(name: str) -> None:
    M, q, last, options, end, words, z = ENDS[name]
    found = path(Problem(M, q), Problem(M, last), **options)
    assert (found.end, found.complete) == (end, end in ("reached", "ray"))
    assert found.message.endswith(words)
    assert (found.certificate is not None) == (end in ("ray", "infeasible"))
    assert found.z[[0, -1][: 2 * found.t.size]].tolist() == z
    assert found.verified == bool(z)
    assert z == [] or found(0.0).tolist() == z[0]
