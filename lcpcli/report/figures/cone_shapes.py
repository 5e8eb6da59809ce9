"""The complementary cones of a 2 x 2 matrix as angles: sectors, or rays, lines and points where they are degenerate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

TURN = 2 * math.pi
SAME = 1e-9  # radians: closer directions count as equal; far below what a picture shows, far above rounding
SETS: tuple[tuple[int, ...], ...] = ((), (1,), (2,), (1, 2))  # the j for which z_j > 0 is allowed, not w_j > 0
SECTOR, RAY, LINE, POINT = "sector", "ray", "line", "point"
ARC, APART = 84.0, 13.5  # in points: the radius of the outermost arc, and how much smaller the next is


@dataclass(frozen=True)
class Cone:
    """The angles of a cone, in radians.

    parts : the start and the extent of a sector; for any other cone, the direction of each ray and the extent 0.
    level : the smallest number that no overlapping cone before this one, in the order of SETS, has.
    """

    parts: tuple[tuple[float, float], ...]
    level: int = 0

    @property
    def kind(self) -> str:
        """Return SECTOR; RAY, from the origin; LINE, through it; or POINT, the origin alone."""
        return SECTOR if any(extent for _, extent in self.parts) else (POINT, RAY, LINE)[len(self.parts)]

    @property
    def radius(self) -> float:
        return ARC - APART * self.level

    def overlaps(self, other: Cone) -> bool:
        """Return whether two sectors have a common interior point, or a ray or line and another cone have a common
        point other than 0."""
        margin = -SAME if self.kind == other.kind == SECTOR else SAME
        turns = [((there - here) % TURN, own, its) for here, own in self.parts for there, its in other.parts]
        return any(turn < own + margin or TURN - turn < its + margin for turn, own, its in turns)


def angle(vector: Sequence[float]) -> float | None:
    """Return the direction of a vector, from 0 to 2 pi; None for the zero vector."""
    x, y = vector
    return None if x == y == 0 else math.atan2(y + 0.0, x + 0.0) % TURN


def generators(M: Sequence[Sequence[float]]) -> dict[str, float | None]:
    """Return the directions of the columns of I and -M by their labels."""
    units = {"$I_1$": 0.0, "$I_2$": math.pi / 2}
    return units | {f"$-M_{j + 1}$": angle((-M[0][j], -M[1][j])) for j in (0, 1)}


def cones(M: Sequence[Sequence[float]]) -> list[Cone]:
    """Return the cone of each of SETS, spanned by the columns of -M in the set and the columns of I outside the set."""
    directions = generators(M)
    made: list[Cone] = []
    for chosen in SETS:
        cone = Cone(_span([directions[f"$-M_{j}$" if j in chosen else f"$I_{j}$"] for j in (1, 2)]))
        taken = {other.level for other in made if cone.overlaps(other)}
        made.append(Cone(cone.parts, min(set(range(len(SETS))) - taken)))
    return made


def _span(by: Sequence[float | None]) -> tuple[tuple[float, float], ...]:
    angles = [one for one in by if one is not None]
    if not angles:
        return ()
    first, last = angles[0], angles[-1]
    turn = turn_to(first, last)
    if abs(turn) < SAME:
        return ((first, 0.0),)
    if abs(turn) > math.pi - SAME:
        return ((first, 0.0), (first + math.pi, 0.0))
    return ((first if turn > 0 else last, abs(turn)),)


def turn_to(first: float, last: float) -> float:
    """Return the angle from one direction to another, from -pi to pi."""
    return (last - first + math.pi) % TURN - math.pi
