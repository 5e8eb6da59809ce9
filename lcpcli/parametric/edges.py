"""The edges of a path, and what moves along them."""

from __future__ import annotations

from typing import NamedTuple

from lcpcli.typing import States, Vector

Z, W, T = "z", "w", "t"


class Variable(NamedTuple):
    """A variable at an end: its kind, its index, and the sign with which it leaves that end, or by which it came."""

    kind: str
    at: int
    sign: float


class Direction(NamedTuple):
    """How the vertex changes along an edge: z and w, each of shape (n,), and t; size is the largest of the changes of t
    and of the basic z."""

    z: Vector
    w: Vector
    t: float
    size: float


class Edge(NamedTuple):
    """An edge of the path, with the vertex at its end.

    states : shape (n,), of the components on it.
    rise : the sign of the change of t. is_point : whether it has no length, at a degenerate vertex.
    s, z : the vertex, in the units of the problem; on a ray the last s and the direction of z.
    multipliers : on a ray, which has no end, those of the rows with w = 0; else None. is_last : whether it is the last.
    """

    states: States
    rise: float
    is_point: bool
    s: float
    z: Vector
    multipliers: Vector | None = None
    is_last: bool = False

    @property
    def is_ray(self) -> bool:
        return self.multipliers is not None
