"""The complementary cones of a 2 x 2 matrix as angles: sectors, or rays, lines and points where they are degenerate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

TURN = 2 * math.pi
SAME = 1e-9  # radians: directions closer than that are one, far below what a picture shows
SETS: tuple[tuple[int, ...], ...] = ((), (1,), (2,), (1, 2))  # of the j with z_j > 0 allowed; w_j for the others
SECTOR, RAY, LINE, POINT = "sector", "ray", "line", "point"


@dataclass(frozen=True)
class Cone:
    """The angles of a cone, in radians: those from `start` on, `extent` further, which is 0 unless it is a sector.

    kind : SECTOR; RAY from the origin; LINE, of which `start` is one half; or POINT, the origin alone.
    level : a number that no two cones share which overlap, the smallest that is possible in the order of SETS.
    """

    kind: str
    start: float = 0.0
    extent: float = 0.0
    level: int = 0


def angle(vector: Sequence[float]) -> float | None:
    """The direction of a vector, from 0 to 2 pi; None for the zero vector."""
    x, y = vector
    return None if x == y == 0 else math.atan2(y + 0.0, x + 0.0) % TURN


def generators(M: Sequence[Sequence[float]]) -> dict[str, float | None]:
    """The directions of the columns of I and -M by their labels."""
    units = {"$I_1$": 0.0, "$I_2$": math.pi / 2}
    return units | {f"$-M_{j + 1}$": angle((-M[0][j], -M[1][j])) for j in (0, 1)}


def cones(M: Sequence[Sequence[float]]) -> list[Cone]:
    """The cone of each of SETS, which is spanned by the columns of -M in the set and those of I that are not in it."""
    directions = generators(M)
    found: list[Cone] = []
    for chosen in SETS:
        cone = _spanned([directions[f"$-M_{j}$" if j in chosen else f"$I_{j}$"] for j in (1, 2)])
        taken = {other.level for other in found if _overlap(cone, other)}
        level = next(level for level in range(len(SETS)) if level not in taken)
        found.append(Cone(cone.kind, cone.start, cone.extent, level))
    return found


def _spanned(by: Sequence[float | None]) -> Cone:
    """The cone of two generators."""
    angles = [one for one in by if one is not None]
    if not angles:
        return Cone(POINT)
    first, last = angles[0], angles[-1]
    turn = (last - first + math.pi) % TURN - math.pi
    if abs(turn) < SAME:
        return Cone(RAY, first)
    if abs(turn) > math.pi - SAME:
        return Cone(LINE, first)
    return Cone(SECTOR, first if turn > 0 else last, abs(turn))


def rays(cone: Cone) -> list[float]:
    """The directions of a ray, or of both halves of a line."""
    return {RAY: [cone.start], LINE: [cone.start, cone.start + math.pi]}.get(cone.kind, [])


def holds(cone: Cone, direction: float) -> bool:
    """Whether a sector has a direction in its interior."""
    return cone.kind == SECTOR and SAME < (direction - cone.start) % TURN < cone.extent - SAME


def _overlap(one: Cone, other: Cone) -> bool:
    """Whether two sectors have an interior point in common, or a ray or line has one with another cone, but for 0."""
    if one.kind == other.kind == SECTOR:
        return _meet((one.start, one.extent), (other.start, other.extent), -SAME)
    parts = [
        [(cone.start, cone.extent)] if cone.kind == SECTOR else [(ray, 0.0) for ray in rays(cone)]
        for cone in (one, other)
    ]
    return any(_meet(a, b, SAME) for a in parts[0] for b in parts[1])


def _meet(one: tuple[float, float], other: tuple[float, float], margin: float) -> bool:
    between = (other[0] - one[0]) % TURN
    return between < one[1] + margin or TURN - between < other[1] + margin
