"""What counts as a verified path: each breakpoint by the criterion of `solve` for the problem at its t."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli import Path, Problem, from_qp, path
from lcpcli.parametric import following, parts

from .families import Pair, general, integers, positive

TOL = Fraction(1, 10**10)


def is_backward_stable(problem: Problem, z: list[float]) -> bool:
    """Return whether each condition of an LCP holds up to 1e-10 of the terms of its row, in fractions."""
    Z = list(map(Fraction, z))
    for i, row in enumerate(problem.M.tolist()):
        terms = [Fraction(a) * value for a, value in zip(row, Z, strict=True)] + [Fraction(float(problem.q[i]))]
        violation = abs(sum(terms)) if Z[i] else -sum(terms)
        if Z[i] < 0 or violation > TOL * sum(map(abs, terms)):
            return False
    return True


def check_breakpoints(found: Path) -> None:
    """Each breakpoint that is not on a jump is a solution by fractions, and by `lcpcli.check`."""
    assert found.verified
    for t, z in zip(found.t.tolist(), found.z.tolist(), strict=True):
        if np.count_nonzero(found.t == t) == 1:
            problem = found.family.at(t)
            assert problem.is_mixed or is_backward_stable(problem, z)
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


@pytest.mark.parametrize("make", [positive, integers, general, spread, extreme])
def test_each_breakpoint_of_a_verified_path_solves_its_problem(make: object) -> None:
    verified = 0
    for seed in range(40):
        found = path(*make(seed), turns=seed % 4 == 0)  # type: ignore[operator]
        if found.verified:
            check_breakpoints(found)
            verified += 1
    assert verified >= 10


def test_a_path_on_which_z_overflows_ends_before() -> None:
    found = path(Problem([[1e-300]], [1]), Problem([[1e-300]], [-1e300]))
    assert (found.end, found.complete) == ("breakdown", False)
    assert found.message == "broke down: z is too large for double precision"
    assert np.isfinite(found.z).all()


def test_the_end_is_no_solution_by_the_size_of_the_beginning() -> None:
    found = path(Problem([[1]], [-1e16]), Problem([[1]], [-1]))
    assert found.verified
    assert found.z[-1] == [1.0]


def test_a_point_that_is_not_finite_is_not_verified() -> None:
    from lcpcli.parametric.family import Family
    from lcpcli.parametric.verified import verify

    family, t = Family(Problem([[1.0]], [-1]), Problem([[1.0]], [-2])), np.array([0.0, 1.0])
    assert verify(family, t, np.array([[1.0], [2.0]]), np.array([[0]]), 1e-10).is_verified
    for value in (np.nan, np.inf):
        for k in (0, 1):
            z = np.array([[1.0], [2.0]])
            z[k] = value
            assert not verify(family, t, z, np.array([[0]]), 1e-10).is_verified


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


@pytest.mark.parametrize("exact", [False, True])
def test_a_path_in_parts_is_the_same_path(exact: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    if exact:
        first, last = positive(3, 14, 14)
    whole = path(first, last, exact=exact)
    monkeypatch.setattr(following, "KEPT_AT_ONCE", 1)
    found = path(first, last, exact=exact)
    assert whole.t.size > 2 * parts.LEAST_AT_ONCE
    for name in ("t", "z", "w", "states"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))
    assert (found.end, found.verified, found.exact) == (whole.end, True, whole.exact)


def test_memory_bounds_a_path_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    first, last = positive(30, 40, 40)
    monkeypatch.setattr(following, "MOST_NUMBERS", 200)
    part = path(first, last)
    assert (part.end, part.t.size, part.verified) == ("breakpoint_limit", 6, True)
    assert "5 with 40 unknowns fill the memory" in part.message


@pytest.mark.parametrize("q", [-1, 0])
def test_an_exact_path_without_a_first_point_says_so(q: int) -> None:
    found = path(Problem([[0]], [-1]), Problem([[0]], [q]), exact=True)
    assert (found.end, found.complete, found.t.size, found.verified) == ("infeasible", False, 0, False)


def test_the_fractions_of_a_path_are_made_within_its_time_limit() -> None:
    first, last = positive(30, 50, 50)
    found = path(first, last, exact=True, time_limit=1e-9)
    assert (found.end, found.t.size) == ("time_limit", 0)
