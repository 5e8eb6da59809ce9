"""What is remarkable about the gallery's families, seen: cycles, exponential pivoting,
margins, free boundaries; and parameters that move q or bounds alone, so that a path
goes from one member to another."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest

from lcpcli import Status, inspect, run
from lcpcli.formulations.quadratic_program import families as programs
from lcpcli.gallery import families as gallery
from lcpcli.gallery.rigid_bodies import (
    GRAVITY,
    HALF,
    NEAR,
    STEP,
    contact_in_time,
)
from lcpcli.linalg.matrices import dense
from lcpcli.parametric.following import path

from ..methods.bands import product


def newton_without_safeguard(problem, steps):
    """The active sets of steps z_P = -M_PP^-1 q_P, P = {z > w}, from the problem's
    x0."""
    P, sets = problem.x0 > 0, []
    for _ in range(steps + 1):
        sets.append(tuple(np.flatnonzero(P)))
        z = np.zeros(problem.n)
        z[P] = np.linalg.solve(dense(problem.M)[np.ix_(P, P)], -problem.q[P])
        P = z > np.where(P, 0, problem.w(z))
    return sets


def test_newton_without_safeguard_cycles_from_the_starts_in_the_literature():
    for n in (3, 7, 11):
        sets = newton_without_safeguard(gallery.make("ben-gharbia-gilbert", n), n)
        assert sets[n] == sets[0]
        assert len(set(sets)) == n
    sets = newton_without_safeguard(gallery.make("curtis-han-robinson"), 20)
    assert sets[0] in sets[1:]
    assert (1, 2) not in sets


def test_half_of_all_places_and_an_eigenvalue_have_the_margin_asked_for():
    problem = gallery.make("degenerate", 30)
    (z,) = problem.solutions
    assert np.count_nonzero((z == 0) & (problem.w(z) == 0)) == 15
    assert 0 < np.count_nonzero(z) < 15
    for epsilon in (0.1, 1e-8):
        problem = gallery.make("near-degenerate", 30, epsilon=epsilon)
        (z,) = problem.solutions
        margins = np.maximum(z, problem.w(z))
        assert 0.7 * epsilon <= margins.min() <= 1.5 * epsilon
        assert np.count_nonzero(margins == 1) == 15
    for epsilon in (1e-2, 1e-6, 1e-12):
        M = gallery.make("near-singular", 30, epsilon=epsilon).M
        assert np.linalg.eigvalsh(M)[0] == pytest.approx(epsilon, abs=1e-14)


def test_pressure_of_the_infinite_bearing_vanishes_where_the_film_opens():
    """It rises while the film narrows, up to t = pi, and the film breaks at some t in
    (pi, 2 pi) (Cryer 1971)."""
    z = run(gallery.make("journal-bearing", 200), "auto").z
    wet = np.flatnonzero(z > 0)
    assert np.array_equal(wet, np.arange(wet.size))
    assert 100 < wet.size < 200
    assert 50 < np.argmax(z) < 100


def test_american_put_is_worth_the_formula_and_exercised_below_some_price():
    """The European put by Black and Scholes; one time step is eight per cent below it,
    the American put a bit above."""
    r, s, T = 0.1, 0.4, 0.5
    normal = [
        (1 + math.erf(-(r + sign * s * s / 2) * math.sqrt(T / 2) / s)) / 2
        for sign in (1, -1)
    ]
    european = math.exp(-r * T) * normal[1] - normal[0]
    z = run(gallery.make("american-put", 399, rate=r, volatility=s, years=T), "auto").z
    k, t = 2 * r / s**2, s * s * T / 2
    assert math.exp(-((k + 1) ** 2) * t / 4) * z[199] == pytest.approx(
        european, rel=0.1
    )
    held = np.flatnonzero(z > 0)
    assert np.array_equal(held, np.arange(held[0], 399))
    assert 0 < held[0] < 199
    assert 190 <= np.argmax(z) <= 210


def test_unknowns_of_spatial_prices_have_names_in_the_order_of_z():
    problem = gallery.make("spatial-prices", 8)
    assert list(problem.names[:5]) == [
        "supply1",
        "supply2",
        "demand1",
        "demand2",
        "flow1-1",
    ]
    assert list(problem.names[5:]) == ["flow1-2", "flow2-1", "flow2-2"]
    flow = problem.names.index("flow1-2")
    column = problem.M.toarray()[:, flow]
    assert {problem.names[i]: column[i] for i in column.nonzero()[0]} == {
        "supply1": -1,
        "demand2": 1,
    }


MOVES = [
    ("frontier", 12, {"target": (0.0, 0.08)}),
    ("frontier", 12, {"weight": (0.0, 64.0)}),
    ("frontier", 12, {"most": (0.2, 0.5)}),
    ("lasso", 12, {"penalty": (1.0, 0.0)}),
    ("two-obstacles", 25, {"load": (0.0, 4.0)}),
    ("two-obstacles", 25, {"gap": (0.3, 0.1)}),
    ("torsion", 25, {"angle": (0.0, 8.0)}),
    ("american-put", 25, {"strike": (1.0, 1.2)}),
    ("spatial-prices", 24, {"tax": (0.0, 18.0)}),
    ("spatial-prices", 24, {"capacity": (1.0, 3.0)}),
    ("all-cones", 5, {"t": (-1.0, 31.0)}),
]


@pytest.mark.parametrize(("family", "n", "moved"), MOVES)
def test_the_parameter_leaves_m_alone_and_a_verified_path_joins_its_values(
    family, n, moved
):
    values = [{name: ends[k] for name, ends in moved.items()} for k in (0, 1)]
    first, last = (gallery.make(family, n, **given) for given in values)
    assert np.array_equal(dense(first.M), dense(last.M))
    moves_bounds = set(moved) & {"most", "gap", "capacity"}
    assert np.array_equal(first.q, last.q) == bool(moves_bounds)
    assert np.array_equal(first.upper, last.upper) != bool(moves_bounds)
    found = path(first, last)
    assert found.end == "reached"
    assert found.verified


def test_frontier_has_its_target_as_return_or_more_if_less_risk_has_more():
    problem = gallery.make("frontier", 22, 3)
    returns = problem.M[-1, :20]
    least = float(returns @ run(problem).z[:20])
    best = float(np.sort(returns)[-5:].mean())
    for target in (0.0, 0.9 * least, 1.1 * least, best - 1e-6):
        z = run(gallery.make("frontier", 22, 3, target=target)).z
        assert z[:20].sum() == pytest.approx(1)
        assert returns @ z[:20] == pytest.approx(max(least, target))
        # a target is met with the multiplier of its row as the weight
        other = run(gallery.make("frontier", 22, 3, weight=float(z[-1]))).z
        assert other[:20] == pytest.approx(z[:20], abs=1e-9)
    assert (
        run(gallery.make("frontier", 22, 3, target=best + 1e-6)).status
        is Status.INFEASIBLE
    )


def test_the_lasso_satisfies_its_optimality_conditions_in_the_features():
    X, y = programs.regression(30, 1, 12)
    for penalty, least in ((1.0, 0), (0.999, 1), (0.2, 1), (0.0, 1)):
        result = run(gallery.make("lasso", 60, 1, penalty=penalty, samples=12))
        b = result.z[:30] - result.z[30:]
        slopes, level = X.T @ (y - X @ b), penalty * abs(X.T @ y).max()
        assert np.abs(slopes).max() <= level * (1 + 1e-12) + 1e-12
        assert slopes[b != 0] == pytest.approx(level * np.sign(b[b != 0]), abs=1e-12)
        assert least <= np.count_nonzero(b) <= 12 * least
        assert result.answer.objective == pytest.approx(
            ((y - X @ b) ** 2).sum() / 2 + level * abs(b).sum()
        )


def test_a_tax_ends_trade_and_leaves_the_prices_without_it():
    names = gallery.make("spatial-prices", 24).names
    flows = [i for i, name in enumerate(names) if name.startswith("flow")]
    volumes = [
        run(gallery.make("spatial-prices", 24, tax=tax)).z[flows].sum()
        for tax in (0.0, 2.0, 6.0, 18.0)
    ]
    assert volumes == sorted(volumes, reverse=True)
    assert volumes[0] > 0
    assert volumes[-1] == 0


INERTIA = float(HALF @ HALF) / 3  # of a box, whose mass is 1


def steps(scene, count):
    """Move a scene on, and yield the contacts of each step with their normal impulses,
    their tangential impulses, and their sliding speeds gamma."""
    for _ in range(count):
        contacts, z = scene.contacts, None
        if contacts:
            result = run(scene.problem())
            assert result.solved
            z = result.z
        scene.advance(z)
        normal, one, other, gamma = np.zeros((4, 0)) if z is None else np.split(z, 4)
        yield contacts, normal, one - other, gamma


def momentum(scene):
    """Return the linear momentum of the boxes, and their angular momentum about the
    origin."""
    (x, y), (u, v, spin) = scene.centres[1:].T, scene.velocities[1:].T
    return np.array([u.sum(), v.sum(), (x * v - y * u + INERTIA * spin).sum()])


def energy(scene):
    return float(
        (
            scene.velocities[1:] ** 2 @ [0.5, 0.5, INERTIA / 2]
            + GRAVITY * scene.centres[1:, 1]
        ).sum()
    )


@pytest.mark.parametrize(
    ("kind", "boxes", "count"), [("pyramid", 3, 20), ("heap", 5, 50)]
)
def test_only_gravity_and_the_floor_change_the_momentum_and_energy_is_lost(
    kind, boxes, count
):
    """Impulses are in the friction cones, and on them where contacts slide, and no box
    sinks into another one."""
    scene, slid = contact_in_time(kind, boxes), 0
    last = first = energy(scene)
    expected, x = momentum(scene), scene.centres[1:, 0]
    for contacts, normal, tangential, gamma in steps(scene, count):
        expected -= STEP * GRAVITY * np.array([0, x.size, x.sum()])
        for contact, upwards, along in zip(contacts, normal, tangential, strict=True):
            if contact.first == 0:
                assert contact.normal.tolist() == [0, 1]
                a, b = contact.point
                expected += [-along, upwards, a * upwards + b * along]
        assert momentum(scene) == pytest.approx(expected, abs=1e-9)
        assert (abs(tangential) <= 0.5 * normal + 1e-9).all()
        slides = (gamma > 1e-6) & (normal > 1e-6)
        slid += np.count_nonzero(slides)
        assert abs(tangential[slides]) == pytest.approx(0.5 * normal[slides], abs=1e-8)
        assert min((contact.gap for contact in contacts), default=0.0) > -2 * NEAR
        assert energy(scene) <= last + 1e-9
        expected, x, last = momentum(scene), scene.centres[1:, 0], energy(scene)
    assert slid > 0
    assert last < first - 0.01


def test_a_tower_comes_to_rest_in_place_and_a_heap_keeps_changing_contacts():
    tower = contact_in_time("tower", 4)
    numbers = {len(contacts) for contacts, *_ in steps(tower, 30)}
    assert numbers == {8}
    assert abs(tower.velocities).max() < 1e-9
    assert tower.centres[1:, 1] == pytest.approx([0.25, 0.75, 1.25, 1.75], abs=1e-6)
    numbers = {len(contacts) for contacts, *_ in steps(contact_in_time("heap", 5), 70)}
    assert min(numbers) == 0
    assert len(numbers) >= 4


def test_a_ceiling_that_comes_down_leaves_no_solution_in_the_end():
    scene, statuses = contact_in_time("crushed", 1), []
    while len(statuses) < 8:
        result = run(scene.problem())
        statuses.append(result.status)
        scene.advance(result.z if result.solved else None)
    assert statuses == 5 * [Status.SOLVED] + 3 * [Status.INFEASIBLE]


def test_matrices_of_bricks_are_singular_or_copositive_by_their_layout():
    scene = contact_in_time("pyramid", 3)
    assert len(scene.contacts) == 2 * 3 + 4 * (2 + 1)
    assert np.linalg.matrix_rank(scene.problem().M[:18, :18]) < 18
    problem = contact_in_time("tower", 4).problem()
    assert np.array_equal(problem.M[8:16, :24], -problem.M[16:24, :24])
    assert np.array_equal(problem.q[8:16], -problem.q[16:24])
    found = inspect(contact_in_time("tower", 4, 1).problem()).classes["copositive"]
    assert found.word == "yes"  # as the rest is definite once opposite rows are merged
    assert re.search("diagonal is 0, and is positive semidef", found.evidence)


@pytest.mark.parametrize(("n", "contrast"), [(200, 1.0), (400, 1e6)])
def test_q_of_a_beam_is_rounded_once_although_it_cancels(n, contrast):
    """q = M g + h^4 for the obstacle g, by fractions: in doubles M g alone is off by
    more than h^4 from some hundred nodes on."""
    problem = gallery.make("beam", n, contrast=contrast)
    M, deflection = problem.M, Fraction(1 / 384)
    obstacle = []
    for i in range(1, n + 1):
        u = (Fraction(2 * i, n + 1) - 1) ** 2
        humps = 1 - u * (3 - 4 * u) ** 2
        obstacle.append(-(humps * Fraction(0.8) + Fraction(0.4)) * deflection)
    h = Fraction(1, n + 1)
    for found, value in zip(problem.q, product(M, obstacle), strict=True):
        right = value + h**4
        # Of terms of 16 * contrast * 0.003, twice the precision of doubles
        size = 16 * contrast * 0.003 * 1e-30
        assert abs(Fraction(float(found)) - right) <= 1e-15 * abs(right) + size


@pytest.mark.parametrize("name", ["ben-gharbia-gilbert", "kostreva"])
def test_cyclic_shifts_have_odd_orders_of_which_they_make_p_matrices(name):
    problems = [gallery.make(name, n) for n in range(1, 7)]
    assert [problem.n for problem in problems] == [3, 3, 3, 5, 5, 7]
    for problem in problems:
        assert inspect(problem).classes["p_matrix"].word == "yes"


def test_an_even_load_on_a_frame_is_shared_by_its_nodes():
    """Inner nodes have a half of the loads of two elements, whose moments cancel."""
    one, two = (gallery.make("frame", 10, support="springs", load=k) for k in (1, 2))
    loads, moments = (two.q - one.q).reshape(-1, 2).T
    assert loads / loads[1] == pytest.approx([0.5, 1, 1, 1, 0.5])
    assert moments / loads[1] == pytest.approx([1 / 12, 0, 0, 0, -1 / 12], abs=1e-9)


@pytest.mark.parametrize("support", ["clamped", "hinged", "cantilever", "springs"])
def test_frames_bend_as_beams_do(support):
    """Of the same length, load and obstacle, by elements and by differences; only the
    nodes of the frame are above those of the beam."""
    k = 40
    of_frame = run(gallery.make("frame", 2 * k, support=support), "interior")
    of_beam = run(gallery.make("beam", k, support=support), "interior")
    assert of_frame.solved
    assert of_beam.solved
    lower = of_frame.problem.lower
    assert lower is not None
    deflections = of_frame.z[np.isfinite(lower)]
    largest = float(of_beam.z.max())
    assert float(deflections.max()) == pytest.approx(largest, rel=0.1)
