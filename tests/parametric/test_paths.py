"""The path between two problems is what solving each problem on the way would give; in
fractions each piece is proved, and turns and rays are those that the set of all
solutions has. What counts as a verified path: each breakpoint by the criterion of
`solve` for the problem at its t; and corners of paths: starts among several solutions,
proofs at an end.
"""

from fractions import Fraction
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem, from_qp, path, run, solutions
from lcpcli.parametric import following
from lcpcli.parametric.following import basic_states
from lcpcli.parametric.path import Family
from lcpcli.parametric.pivoting import ExactFamily, ExactPivoting, Pivoting
from lcpcli.parametric.verified import Breakpoints, verify
from lcpcli.rational.exact_problem import ExactProblem, fractions_of

from .. import exact
from ..exact_measure import relative_residual
from ..seeds import few_of
from .families import boxed, general, integers, positive, sparsely


@pytest.mark.parametrize("seed", few_of(range(0, 500, 50), 4))
def test_between_breakpoints_z_is_that_of_solve(seed):
    first, last = positive(seed)
    found = path(first, last)
    assert found.end == "reached"
    assert found.verified
    for t in default_rng(seed).random(5):
        result = run(found.family.at(t))
        assert result.solved
        assert np.abs(found(t) - result.z).max() <= 1e-12 * np.abs(result.z).max()


def check_without_gap(found):
    """The pieces join, states change at each breakpoint, and a path of a semidefinite M
    does not turn."""
    assert found.verified, found.message
    assert found.t[0] == 0
    assert (np.diff(found.t) >= 0).all()
    assert len(found.states) == found.t.size - 1
    if found.end == "reached":
        assert found.t[-1] == 1
    else:
        assert found.end == "ray"
        assert found.certificate is not None
    for k, states in enumerate(found.states):
        for z, w, t in zip(
            found.z[k : k + 2], found.w[k : k + 2], found.t[k : k + 2], strict=True
        ):
            low, high = found.family.bounds(float(t))
            assert np.array_equal(z[states < 0], low[states < 0])
            assert np.array_equal(z[states > 0], high[states > 0])
            assert np.abs(w[states == 0]).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("make", [integers, boxed])
def test_ties_leave_no_gap_and_no_cycle(make):
    for seed in range(20):
        check_without_gap(path(*make(seed)))


@pytest.mark.parametrize("make", [lambda seed: positive(seed, 5, 25), integers, boxed])
def test_a_sparse_matrix_has_the_same_path(make):
    for seed in range(6):
        dense, sparse = path(*make(seed)), path(*sparsely(make(seed)))
        assert sparse.end == dense.end
        assert dense.t.size == sparse.t.size
        assert sparse.verified
        assert sparse.z == pytest.approx(dense.z, abs=1e-10)


@settings(max_examples=10)
@given(st.integers(0, 10**6), st.integers(-30, 30), st.integers(-30, 30))
def test_units_of_rows_and_columns_do_not_matter(seed, row, column):
    first, last = positive(3 * seed, 2, 8)
    random = np.random.default_rng(seed)
    R, C = (np.exp2(power * random.random(first.n)) for power in (row, column))
    scaled = [
        Problem(R[:, np.newaxis] * first.M * C, R * each.q) for each in (first, last)
    ]
    found, own = path(first, last), path(*scaled)
    assert own.verified
    assert own.t == pytest.approx(found.t, abs=1e-11)
    assert own.z * C == pytest.approx(
        found.z, rel=1e-9, abs=1e-11 * np.abs(found.z).max()
    )


@pytest.mark.parametrize("exact", [False, True])
def test_an_interrupted_path_is_the_part_up_to_there(exact, monkeypatch):
    first, last = positive(3, 12, 12)
    whole = path(first, last, exact=exact)
    pivoting = ExactPivoting if exact else Pivoting
    edges = pivoting.edges

    def interrupted(self):
        yield from islice(edges(self), 3)
        raise KeyboardInterrupt

    monkeypatch.setattr(pivoting, "edges", interrupted)
    part = path(first, last, exact=exact)
    assert part.end == "interrupted"
    assert not part.complete
    assert part.verified
    assert np.array_equal(part.t, whole.t[:4])
    assert np.array_equal(part.z[:3], whole.z[:3])


def test_limits_end_a_path_and_what_is_known_of_it_is_verified():
    first, last = positive(30, 50, 50)
    part = path(first, last, max_breakpoints=3)
    assert part.end == "breakpoint_limit"
    assert not part.complete
    assert part.verified
    assert part.t.size == 4
    late = path(first, last, time_limit=1e-9)
    assert late.end == "time_limit"
    assert not late.complete


def test_a_path_that_turns_has_all_points_at_a_t_that_it_passes_twice():
    """For M = -1 and q = 1 - 3 t, z = 0 solves the problems up to t = 1/3, and so does
    z = q."""
    found = path(Problem([[-1]], [1]), Problem([[-1]], [-2]), turns=True)
    assert found.end == "returned"
    assert sorted(found(0.1).ravel().tolist()) == pytest.approx([0, 0.7])
    assert sorted(found(0.0).ravel().tolist()) == pytest.approx([0, 1])


@pytest.mark.parametrize(("start", "stop"), [(0.7, 3.4), (0.1, 0.3), (-1 / 3, 1e17)])
def test_t_begins_and_ends_exactly_where_it_is_asked_to(start, stop):
    """In doubles, 0.7 + (3.4 - 0.7) is not 3.4."""
    problem, to = Problem([[2]], [1]), Problem([[2]], [-1])
    found = path(problem, to, start=start, stop=stop)
    assert found.t[0] == start
    assert found.t[-1] == stop
    assert found(stop).tolist() == [0.5]


@pytest.mark.parametrize("large", [1e9, 1e13, 1e15])
def test_a_large_component_hides_no_breakpoint(large):
    """z_2 = max(0, 5 - 10 t)."""
    decreasing = path(*(Problem(np.eye(2), [-large, q]) for q in (-5, 5)))
    assert decreasing.verified
    assert decreasing.t.tolist() == [0, 0.5, 1]
    assert decreasing(0.25).tolist() == [large, 2.5]


@pytest.mark.parametrize("bound", [1.0, 1e-14, 1e-300])
def test_a_jump_is_no_slope_however_short(bound):
    first, last = (
        Problem([[0.0]], [q], lower=[-bound], upper=[bound]) for q in (1, -1)
    )
    jump = path(first, last)
    assert jump.verified
    assert jump(0.25).tolist() == [-bound]
    assert jump(0.75).tolist() == [bound]


NEAR = 1e-6  # how far from a turn the number of solutions is counted


def at(found, s):
    """Return z at s, between two breakpoints in fractions."""
    whole = found.exact
    k = next(k for k in range(len(whole.t) - 1) if whole.t[k] <= s <= whole.t[k + 1])
    share = (s - whole.t[k]) / (whole.t[k + 1] - whole.t[k])
    return [
        a + share * (b - a) for a, b in zip(whole.z[k], whole.z[k + 1], strict=True)
    ]


@pytest.mark.parametrize("seed", few_of(range(0, 30, 5), 3))
def test_paths_in_fractions_are_solutions_in_fractions(seed):
    """All complementary sets of small P-matrices are tried; at sixteenths, doubles
    represent the data of all t."""
    pair = positive(3 * seed, 2, 6)
    first, last = (
        Problem(pair[0].M, np.rint(2.0**44 * each.q) / 2.0**44) for each in pair
    )
    found = path(first, last, exact=True)
    assert found.reached
    assert found.verified
    for k in range(1, 16, 3):
        assert at(found, Fraction(k, 16)) == exact.solution(found.family.at(k / 16))


@pytest.mark.parametrize("make", [integers, boxed])
def test_ties_in_fractions_leave_no_gap(make):
    for seed in range(8):
        found = path(*make(seed), exact=True)
        assert found.verified
        assert found.end in ("reached", "ray")
        assert sorted(found.exact.t) == found.exact.t
        assert found.exact.t[-1] == 1 or found.certificate is not None


def near(problem, z, reach):
    """Return how many isolated solutions lie within a distance of z, by a search
    through all bases."""
    vertices = {
        tuple(vertex) for piece in solutions(problem) for vertex in piece.vertices
    }
    return sum(
        np.abs(np.array([float(value) for value in vertex]) - z).max() <= reach
        for vertex in vertices
    )


def test_at_a_turn_two_solutions_meet_and_beyond_it_there_is_none_near():
    met = 0
    for seed in range(50):
        found = path(*general(seed))
        assert found.verified, seed
        if found.end != "turn" or np.diff(found.t[-2:]) == 0 or found.t[-1] > 1 - NEAR:
            continue
        t, z = float(found.t[-1]), found.z[-1]
        slope = max(
            np.abs(found.z[-1] - found.z[-2]).max() / (found.t[-1] - found.t[-2]), 1
        )
        whole = path(*general(seed), turns=True)
        if whole.t.size == found.t.size or whole.t[found.t.size] >= t:  # no way back
            continue
        away = np.abs(whole.z[found.t.size] - z).max() / (t - whole.t[found.t.size])
        reach = 2 * NEAR * max(slope, away)
        assert near(found.family.at(t + NEAR), z, reach) == 0, seed
        assert near(found.family.at(t - NEAR), z, reach) >= 2, seed
        met += 1
    assert met >= 2


def test_a_ray_consists_of_solutions():
    met = 0
    for seed in range(50):
        found = path(*general(seed), turns=True, exact=True)
        assert found.verified, seed
        assert found.end in ("reached", "returned", "ray"), (seed, found.message)
        if found.end == "ray":
            direction, t, start = found.direction, found.exact.t[-1], found.exact.z[-1]
            whole = fractions_of(
                np.rint(direction / direction[direction > 0].min() * 2520)
            )
            family = ExactFamily(
                *map(ExactProblem.of_floats, (found.problem, found.to))
            )
            for length in (Fraction(1, 7), 3):
                z = [a + length * b for a, b in zip(start, whole, strict=True)]
                w = family.w(t, z)
                assert min(*z, *w) >= 0, seed
                assert not any(a and b for a, b in zip(z, w, strict=True)), seed
            met += 1
    assert met >= 1


def test_a_path_is_verified_where_a_row_has_one_variable_that_becomes_0():
    """The last row is y >= 0, for a multiplier y: what rounding leaves of 0 would be
    large beside its terms."""
    Q = np.array([[14, 9, -13], [9, 13, -12], [-13, -12, 14]]) / 100
    M = np.zeros((5, 5))
    M[:3, :3], M[:3, 3], M[3, :3], M[3, 4], M[4, 3] = Q, -1, 1, -1, 1
    first, last = (
        Problem(
            M,
            [0, 0, 0, b, 0],
            lower=[0, 0, 0, -np.inf, 0],
            upper=[np.inf, 0.5, np.inf, np.inf, 0.09],
        )
        for b in (-0.07, 0.5)
    )
    found = path(first, last)
    assert found.end == "ray"
    assert found.verified


def test_a_proof_at_a_ray_is_right():
    for seed in range(1, 60, 4):
        first, last = integers(seed)
        found = path(first, last)
        if found.end == "ray":
            y = found.certificate
            assert exact.refutes(last, fractions_of(y))
            assert not list(solutions(last))


def test_a_proof_at_the_start_is_about_the_first_problem_alone():
    first, last = Problem([[0]], [-1]), Problem([[0]], [1])
    found = path(first, last)
    y = fractions_of(found.certificate)
    assert found.end == "infeasible"
    assert exact.refutes(first, y)
    assert not exact.refutes(last, y)


def check_breakpoints(found):
    """Each breakpoint that is not on a jump is a solution by fractions, and by
    `lcpcli.check`."""
    assert found.verified
    for t, z in zip(found.t.tolist(), found.z, strict=True):
        if np.count_nonzero(found.t == t) == 1:
            problem = found.family.at(t)
            # Others are rounded to the grid near 0.
            if (np.abs(z[z != 0]) >= np.finfo(float).tiny).all():
                assert relative_residual(problem, z) <= 1e-10
            assert lcpcli.check(problem, z).accepted


def extreme(seed):
    """Two problems with up to three unknowns and numbers from 1e-300 to 1e300."""
    random = default_rng(seed)
    n = int(random.integers(1, 4))
    sizes = 10.0 ** random.uniform(-300, 300, (3, n))
    return tuple(
        Problem(np.diag(sizes[0]), random.choice([-1, 1], n) * q) for q in sizes[1:]
    )


@pytest.mark.parametrize(
    "make", [lambda seed: positive(seed, 5, 12), integers, general, extreme]
)
def test_each_breakpoint_of_a_verified_path_solves_its_problem(make):
    verified = 0
    for seed in range(5):
        found = path(*make(seed), turns=seed % 4 == 0)
        if found.verified:
            check_breakpoints(found)
            verified += 1
    assert verified >= 2


@pytest.mark.parametrize(
    ("ends", "t", "z", "states", "is_verified"),
    [
        ((-1, 1), [0, 0.5, 1], [1, 0, 0], [0, -1], True),
        # Basic throughout, although w is 1 at the end.
        ((-1, 1), [0, 1], [1, 0], [0], False),
        ((1, -1), [0, 0.5, 1], [0, 0, 1], [-1, 0], True),
        ((1, -1), [0, 1], [0, 1], [0], False),  # the ends alone are solutions
        ((-1, 1), [0.5, np.inf], [0, 1], [0], False),
        ((-1, -2), [0, 1], [1, 2], [0], True),
        *(
            ((-1, -2), [0, 1], z, [0], False)
            for z in ([np.nan, 2], [1, np.nan], [np.inf, 2], [1, np.inf])
        ),
    ],
)
def test_only_a_path_whose_pieces_are_solutions_throughout_is_verified(
    ends, t, z, states, is_verified
):
    family = Family(*(Problem([[1.0]], [q]) for q in ends))
    columns = (np.array(values, float)[:, np.newaxis] for values in (z, states))
    breakpoints = Breakpoints(np.array(t, float), *columns)
    assert verify(family, breakpoints, 1e-10)[-1] == is_verified


@pytest.mark.parametrize(
    ("costs", "span", "at"),
    [((-1, 2), (0, 1), 1 / 3), ((-1e6 + 0.123, 1.123), (-1e6, 1), -0.123)],
    ids=["at a third", "near 0, far from the start"],
)
def test_a_jump_is_verified_up_to_the_last_bit_of_t(costs, span, at):
    """min c x1 + 2 c x2, 0 <= x <= 1, as c rises: x jumps at c = 0 in two steps,
    between which x solves the program there only."""
    first, last = (
        from_qp(None, [c, 2 * c], [[-1, 0], [0, -1]], [-1, -1]) for c in costs
    )
    found = path(first, last, start=span[0], stop=span[1])
    assert found.verified
    assert list(found.jumps) == [1, 2]
    assert sorted({*found.t.tolist()}) == pytest.approx([span[0], at, span[1]], 1e-9)


@pytest.mark.parametrize(("n", "exact"), [(40, False), (20, True)])
def test_a_path_verified_in_parts_is_the_same_path(n, exact, monkeypatch):
    first, last = positive(30, n, n)
    whole = path(first, last, exact=exact)
    monkeypatch.setattr(following, "AT_ONCE", 1)
    found = path(first, last, exact=exact)
    assert whole.t.size > 2 * following.MIN_AT_ONCE
    for name in ("t", "z", "w", "states"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))
    assert found.end == whole.end
    assert found.verified
    assert found.exact == whole.exact


def test_a_path_is_not_verified_if_its_first_part_is_not(monkeypatch):
    real, made = following.verify, []

    def doubtful_at_first(*given):
        *found, is_verified = real(*given)
        made.append(is_verified)
        return *found, len(made) > 1

    monkeypatch.setattr(following, "AT_ONCE", 1)
    monkeypatch.setattr(following, "MAX_EXACT", 0)
    monkeypatch.setattr(following, "verify", doubtful_at_first)
    found = path(*positive(30, 40, 40))
    assert len(made) > 2
    assert all(made)
    assert not found.verified


def test_memory_bounds_a_path_that_is_kept(monkeypatch):
    first, last = positive(30, 40, 40)
    monkeypatch.setattr(following, "MAX_NUMBERS", 200)
    part = path(first, last)
    assert part.end == "breakpoint_limit"
    assert part.t.size == 6
    assert part.verified
    assert "5 with 40 unknowns fill the memory" in part.message


@pytest.mark.parametrize(
    ("z", "states"), [([0.25, 0.75], [-1, 0]), ([0.75, 0.25], [0, -1])]
)
def test_of_a_segment_of_solutions_the_nearer_end_is_the_start(z, states):
    problem = Problem([[1, 1], [1, 1]], [-1, -1])
    assert (
        basic_states(problem, np.array(z), np.zeros(2), np.zeros(2, bool)).tolist()
        == states
    )


def test_a_fixed_component_stays_fixed_where_a_segment_of_solutions_ends():
    """w_3 < 0 is no violation, as z_3 cannot move; z_1 = z_2 moves down to 0."""
    M, q = [[1, -1, 0], [-1, 1, 0], [1, 0, 1]], [0, 0, -5]
    problem = Problem(M, q, upper=[np.inf, np.inf, 0])
    z = np.array([2.0, 2.0, 0.0])
    is_fixed = np.array([False, False, True])
    states = basic_states(problem, z, problem.w(z), is_fixed)
    assert sorted(states[:2].tolist()) == [-1, 0]
    assert states[2] == -1


# The ray in z1 is no proof, the multipliers of the rows are: z2 >= 4 and 2 - 2 z2 >= 0.
RAY = [[0, -2], [0, 1]]
PROVED = "the second problem is proved to have no solution"
# z is of both ends.
ENDS = {
    "z overflows": (
        [[1e-300]],
        [1],
        [-1e300],
        {},
        "breakdown",
        "z is too large for double precision",
        [[0], [0]],
    ),
    "small beside its beginning": (
        [[1]],
        [-1e16],
        [-1],
        {},
        "reached",
        "",
        [[1e16], [1]],
    ),
    "no first point, but a last one": (
        [[0]],
        [-1],
        [0],
        {"exact": True},
        "infeasible",
        "",
        [],
    ),
    "a ray": (RAY, [2, 2], [2, -4], {}, "ray", PROVED, [[0, 0], [0, 1]]),
    # w is 0 at once, and no z helps.
    "one point": ([[0]], [0], [-1], {}, "ray", PROVED, [[0], [0]]),
}


@pytest.mark.parametrize("name", ENDS)
def test_ends_of_paths(name):
    M, q, last, options, end, words, z = ENDS[name]
    found = path(Problem(M, q), Problem(M, last), **options)
    assert found.end == end
    assert found.complete == (end in ("reached", "ray"))
    assert found.message.endswith(words)
    assert (found.certificate is not None) == (end in ("ray", "infeasible"))
    assert found.z[[0, -1][: 2 * found.t.size]].tolist() == z
    assert found.verified == bool(z)
    assert z == [] or found(0.0).tolist() == z[0]
