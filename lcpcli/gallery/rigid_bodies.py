"""Rigid boxes in the plane with Coulomb friction in time: each time step is one LCP,
whose solution moves the boxes.

The boxes collide without rebound. A step of length h from the velocity v is that of D.
E. Stewart, J. C. Trinkle, Int. J. Numer. Methods Eng. 39 (1996) 2673-2691; it is
solvable by M. Anitescu, F. A. Potra, Nonlinear Dynamics 14 (1997) 231-247.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lcpcli.errors import OptionError, count, likely, unknown
from lcpcli.gallery import families, systems
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

STEP, GRAVITY = 0.01, 9.81  # the time step in seconds, and the acceleration in m/s^2
HALF = np.array([0.5, 0.25])  # half the sides of a box, whose mass is 1
INVERSE_INERTIA = 3 / (HALF @ HALF)
# Half the sides of the floor and of the ceiling, which no impulse moves.
GROUND = np.array([1000.0, 1.0])
# Two bodies are in contact if their gap is at most this plus the distance by which they
# approach in a step.
NEAR = 0.02
# The largest initial speed of a box, and the speed of the ceiling.
SLIDING, DESCENT = 1.5, 1.0
KINDS = {
    "tower": "boxes on top of each other, which slide at first",
    "pyramid": "rows of boxes, each on two others",
    "heap": "tilted boxes that fall on the floor and on each other",
    "crushed": (
        "boxes between the floor and a ceiling that comes down: at last there is no "
        "solution"
    ),
}


class Contact(NamedTuple):
    """A contact: two bodies by number, the unit normal from the first to the second,
    the point, and the gap there."""

    first: int
    second: int
    normal: Vector
    point: Vector
    gap: float


class Scene:
    """Boxes on a floor, perhaps below a ceiling that descends, and their current
    contacts.

    centres, angles, velocities : of the boxes, shapes (b, 2), (b,) and (b, 3), the last
        with the angular velocity. As attributes they include the floor as the first and
        the ceiling, if there is one, as the last.
    friction : Coulomb's coefficient. ceiling : its initial height, or None.
    contacts : the contacts of the next problem; if there are none, `advance()` makes a
        step without contacts.
    """

    def __init__(
        self,
        centres: Vector,
        angles: Vector,
        velocities: Vector,
        friction: float = 0.5,
        ceiling: float | None = None,
    ) -> None:
        n_fixed = (1, int(ceiling is not None))
        self.centres, self.velocities = (
            np.pad(rows, (n_fixed, (0, 0))) for rows in (centres, velocities)
        )
        self.angles, self.friction = np.pad(angles, n_fixed), friction
        self.centres[0, 1] = -GROUND[1]
        fixed = [0] * n_fixed[0] + [-1] * n_fixed[1]
        if ceiling is not None:
            self.centres[-1, 1], self.velocities[-1, 1] = ceiling + GROUND[1], -DESCENT
        self._half = np.tile(HALF, (self.angles.size, 1))
        self._inverse_masses = np.ones(self.velocities.shape)
        self._half[fixed] = GROUND
        self._inverse_masses[:, 2] = INVERSE_INERTIA
        self._inverse_masses[fixed] = 0.0
        self._update_contacts()

    def problem(self) -> Problem:
        """Return the LCP of the next step, for z = (normal impulses, tangential
        impulses in both directions, gamma).

        With the rows N and T of the k contacts, J = (N, T, -T), the inverse masses W
        and the velocity u after a step with gravity alone, M = [J W J' B; C 0] with B =
        [0; E'] and C = [friction I, -E], and q = (N u + gap / h, T u, -T u, 0): no
        contact penetrates after the step, if rotations during the step are neglected.
        """
        k = len(self.contacts)
        rows = self._rows * np.sqrt(self._inverse_masses.ravel())
        S, speeds = rows @ rows.T, self._rows @ self._free().ravel()
        row_indices = np.concatenate((np.arange(2 * k), np.arange(k, 2 * k)))
        signs = np.repeat([1.0, 1.0, -1.0], k)
        speeds[:k] += np.array([contact.gap for contact in self.contacts]) / STEP
        return Problem(
            systems.with_friction(
                np.outer(signs, signs) * S[np.ix_(row_indices, row_indices)],
                self.friction,
            ),
            np.concatenate((signs * speeds[row_indices], np.zeros(k))),
            name=f"rigid-boxes-{4 * k}",
            source="Stewart and Trinkle 1996, a time step of boxes in the plane",
            note=f"{count(k, 'contact')}, friction {self.friction:g}.",
        )

    def advance(self, z: Vector | None = None) -> None:
        """Move the boxes by a step of length h with the impulses of a solution z;
        without z as if there were no contacts.
        """
        self.velocities = self._free()
        if z is not None:
            k = len(self.contacts)
            impulses = np.concatenate((z[:k], z[k : 2 * k] - z[2 * k : 3 * k]))
            self.velocities += self._inverse_masses * (self._rows.T @ impulses).reshape(
                -1, 3
            )
        self.centres = self.centres + STEP * self.velocities[:, :2]
        self.angles = self.angles + STEP * self.velocities[:, 2]
        self._update_contacts()

    def _free(self) -> Vector:
        """Return the velocities after a step with gravity alone."""
        return self.velocities - STEP * GRAVITY * np.array([0.0, 1.0, 0.0]) * (
            self._inverse_masses > 0
        )

    def _update_contacts(self) -> None:
        """Compute the contacts and the rows N and T, which map the velocities of all
        bodies to the relative velocities at the contacts.
        """
        c, s = np.cos(self.angles), np.sin(self.angles)
        self._axes = np.stack(
            (np.stack((c, s), axis=1), np.stack((-s, c), axis=1)), axis=1
        )  # rows for each body
        self._margins = NEAR + STEP * _distances(self.velocities[:, :2])
        reach, moves = np.hypot(*self._half.T), self._inverse_masses[:, 0] > 0
        may_touch = (
            _distances(self.centres) <= np.add.outer(reach, reach) + self._margins
        )
        pairs = np.argwhere(
            np.triu(may_touch & np.logical_or.outer(moves, moves), 1)
        ).tolist()
        self.contacts = [contact for i, j in pairs for contact in self._between(i, j)]
        k = len(self.contacts)
        rows = np.zeros((2 * k, self.angles.size, 3))
        for row, (first, second, (x, y), point, _) in enumerate(self.contacts):
            for body, sign in ((first, -1.0), (second, 1.0)):
                a, b = point - self.centres[body]
                rows[row, body] = sign * np.array([x, y, a * y - b * x])
                rows[k + row, body] = sign * np.array([-y, x, a * x + b * y])
        self._rows = rows.reshape(2 * k, 3 * self.angles.size)

    def _between(self, i: int, j: int) -> list[Contact]:
        """Return the contacts of two bodies, at most two. The bodies are separated
        along the axis on which they are farthest apart, the normal of a side of one of
        them; the contacts are the endpoints of the closest side of the other one,
        clipped to that side.
        """
        best = -math.inf, i, j, 0, self._axes[i, 0]
        for first, second in ((i, j), (j, i)):
            between = self.centres[second] - self.centres[first]
            for axis, direction in enumerate(self._axes[first]):
                normal = direction if direction @ between >= 0 else -direction
                reach = self._half[first, axis] + self._half[second] @ abs(
                    self._axes[second] @ normal
                )
                apart = normal @ between - reach
                if apart > best[0] + 1e-9:  # rounding must not break ties
                    best = apart, first, second, axis, normal
        apart, first, second, axis, normal = best
        return (
            self._at_side(first, second, axis, normal)
            if apart <= self._margins[i, j]
            else []
        )

    def _at_side(
        self, first: int, second: int, axis: int, normal: Vector
    ) -> list[Contact]:
        """Return the contacts at a side of the first body, with this normal."""
        facing = self._axes[second] @ normal
        k = int(abs(facing).argmax())
        middle = (
            self.centres[second]
            - np.sign(facing[k]) * self._half[second, k] * self._axes[second, k]
        )
        along = self._half[second, 1 - k] * self._axes[second, 1 - k]
        width = self._half[first, 1 - axis]
        side, interval = self._axes[first, 1 - axis], np.array([-1.0, 1.0])
        at, per = side @ (middle - self.centres[first]), side @ along
        # The points middle + t along above the side of the first body.
        if abs(per) > 1e-9:
            low, high = sorted(((-width - at) / per, (width - at) / per))
            interval = np.array([max(low, -1.0), min(high, 1.0)])
        points = middle + np.outer(interval, along)
        gaps = (
            (points - self.centres[first]) @ normal - self._half[first, axis]
        ).tolist()
        contacts = [
            Contact(first, second, normal, *each)
            for each in zip(points, gaps, strict=True)
        ]
        return [
            each
            for each in contacts
            if each.gap <= self._margins[first, second] and interval[0] < interval[1]
        ]


def _distances(points: Vector) -> Vector:
    """Return the distances between all pairs of points, as a symmetric matrix."""
    x, y = points.T
    return np.asarray(np.hypot(np.subtract.outer(x, x), np.subtract.outer(y, y)))


def contact_in_time(
    kind: str, boxes: int, seed: int = 0, friction: float = 0.5
) -> Scene:
    """Return the initial scene.

    kind : one of KINDS. boxes : their number, at least 1; of a pyramid the number in
        its lowest row.
    seed : of the initial offsets, tilts and velocities. friction : Coulomb's
        coefficient, from 0 to 10.

    >>> import lcpcli
    >>> scene = contact_in_time("tower", 3)
    >>> for _ in range(3):
    ...     scene.advance(lcpcli.run(scene.problem()).z)
    >>> len(scene.contacts)
    6
    """
    if kind not in KINDS:
        raise OptionError("kind", unknown(kind), likely(kind, KINDS))
    families.require("boxes", boxes, boxes >= 1, "boxes >= 1")
    families.require("friction", friction, 0 <= friction <= 10, "0 <= friction <= 10")
    random = np.random.default_rng([seed, boxes, *kind.encode()])
    width, height = 2 * HALF
    if kind == "pyramid":
        positions = [
            (column + row / 2, row + 0.5)
            for row in range(boxes)
            for column in range(boxes - row)
        ]
        centres = np.array(positions) * (1.1 * width, height)
    else:
        spacing = 1.2 * width if kind == "heap" else height
        centres = np.stack(
            (random.uniform(-0.15, 0.15, boxes), spacing * (np.arange(boxes) + 0.5)),
            axis=1,
        )
    angles, velocities = np.zeros(len(centres)), np.zeros((len(centres), 3))
    if kind == "heap":
        centres[:, 0] *= 4
        angles = random.uniform(-1.0, 1.0, boxes)
    else:
        velocities[:, 0] = random.uniform(-SLIDING, SLIDING, len(centres))
    return Scene(
        centres,
        angles,
        velocities,
        friction,
        boxes * height + 2.75 * NEAR if kind == "crushed" else None,
    )


def rigid_boxes(
    n: int, seed: int, *, kind: str = "tower", friction: float = 0.5
) -> Problem:
    """Model the first time step with contacts of rigid boxes in the plane, as
    `Scene.problem` does.

    kind : as in KINDS. A tower of k boxes has n = 8 k unknowns, a pyramid on k boxes 8
        k^2; a heap of n / 8 boxes begins with one contact or two. friction : Coulomb's
        coefficient.
    """
    scene = contact_in_time(
        kind,
        max(1, round(math.sqrt(n / 8) if kind == "pyramid" else n / 8)),
        seed,
        friction,
    )
    while not scene.contacts:
        scene.advance()
    return scene.problem()
