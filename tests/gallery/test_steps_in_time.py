"""Steps in time: boxes with friction obey mechanics, by momentum, energy, friction cones, and no body that passes
through another."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from lcpcli import Status, inspect, run
from lcpcli.errors import OptionError
from lcpcli.gallery.rigid_bodies import GRAVITY, HALF, NEAR, STEP, Contact, Scene, contact_in_time

INERTIA = float(HALF @ HALF) / 3  # of a box, whose mass is 1


def steps(scene: Scene, count: int) -> Iterator[tuple[list[Contact], np.ndarray, np.ndarray, np.ndarray]]:
    """Move a scene on, and yield the contacts of each step with their normal impulses, their tangential impulses, and
    their sliding speeds gamma."""
    for _ in range(count):
        contacts, z = scene.contacts, None
        if contacts:
            result = run(scene.problem())
            assert result.solved
            z = result.z
        scene.advance(z)
        normal, one, other, gamma = np.zeros((4, 0)) if z is None else np.split(z, 4)
        yield contacts, normal, one - other, gamma


def momentum(scene: Scene) -> np.ndarray:
    """Return the linear momentum of the boxes, and their angular momentum about the origin."""
    (x, y), (u, v, spin) = scene.centres[1:].T, scene.velocities[1:].T
    return np.array([u.sum(), v.sum(), (x * v - y * u + INERTIA * spin).sum()])


def energy(scene: Scene) -> float:
    return float((scene.velocities[1:] ** 2 @ [0.5, 0.5, INERTIA / 2] + GRAVITY * scene.centres[1:, 1]).sum())


@pytest.mark.parametrize(("kind", "boxes"), [("tower", 4), ("pyramid", 3), ("heap", 5)])
def test_only_gravity_and_the_floor_change_the_momentum_and_energy_is_lost(kind: str, boxes: int) -> None:
    """Impulses are in the friction cones, and on them where contacts slide, and no box sinks into another one."""
    scene, slid = contact_in_time(kind, boxes), 0
    last = first = energy(scene)
    expected, x = momentum(scene), scene.centres[1:, 0]
    for contacts, normal, tangential, gamma in steps(scene, 50):
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


def test_a_tower_comes_to_rest_where_it_is_and_a_heap_keeps_making_and_losing_contacts() -> None:
    tower = contact_in_time("tower", 4)
    numbers = {len(contacts) for contacts, *_ in steps(tower, 50)}
    assert numbers == {8}
    assert abs(tower.velocities).max() < 1e-9
    assert tower.centres[1:, 1] == pytest.approx([0.25, 0.75, 1.25, 1.75], abs=1e-6)
    numbers = {len(contacts) for contacts, *_ in steps(contact_in_time("heap", 5), 100)}
    assert min(numbers) == 0
    assert len(numbers) >= 4


def test_a_ceiling_that_comes_down_leaves_no_solution_in_the_end() -> None:
    scene, statuses = contact_in_time("crushed", 1), []
    while len(statuses) < 8:
        result = run(scene.problem())
        statuses.append(result.status)
        scene.advance(result.z if result.solved else None)
    assert statuses == 5 * [Status.SOLVED] + 3 * [Status.INFEASIBLE]


def test_the_same_seed_gives_the_same_motion_and_another_one_another() -> None:
    scenes = [contact_in_time("heap", 2, seed) for seed in (2, 2, 3)]
    assert all(len(list(steps(scene, 30))) == 30 for scene in scenes)
    assert np.array_equal(scenes[0].centres, scenes[1].centres)
    assert not np.array_equal(scenes[0].centres, scenes[2].centres)
    with pytest.raises(OptionError, match="boxes: 0 is out of range"):
        contact_in_time("heap", 0)


def test_the_matrix_of_bricks_on_two_others_is_singular_symmetric_in_friction_and_copositive_by_its_layout() -> None:
    scene = contact_in_time("pyramid", 3)
    assert len(scene.contacts) == 2 * 3 + 4 * (2 + 1)
    assert np.linalg.matrix_rank(scene.problem().M[:18, :18]) < 18
    problem = contact_in_time("tower", 4).problem()
    assert np.array_equal(problem.M[8:16, :24], -problem.M[16:24, :24])
    assert np.array_equal(problem.q[8:16], -problem.q[16:24])
    found = inspect(contact_in_time("tower", 4, 1).problem()).classes["copositive"]
    assert found.word == "yes"
    assert "where its diagonal is 0" in found.evidence
