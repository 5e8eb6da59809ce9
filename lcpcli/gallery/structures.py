"""Beams, plates and frames over an obstacle: stiff problems whose matrix is positive
definite but has positive entries off the diagonal.

z is the distance of the deflected structure from the obstacle, w the contact force.
Lengths are multiples of the mesh width h, so that without mass the entries of M are
integers, and its condition number, about .032 n^4 for a beam and .05 n^2 for a plate of
constant stiffness that is clamped all around, is a property of the problem rather than
of rounding. q = M g + h^4 p, for the obstacle g and the load p, cancels all but a few
digits of M g: it is computed in double-double numbers, and rounded once.

The obstacle is a polynomial with three humps, gap + depth (1 - T_6) / 2 below the
undeflected structure, where T_6 is Chebyshev's polynomial on its whole length.

S. P. Timoshenko and S. Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed. (1959);
L. Collatz, The Numerical Treatment of Differential Equations, 3rd ed. (1960), for the
differences; J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968), section
5.6, for the elements; R. Glowinski, Numerical Methods for Nonlinear Variational
Problems (1984), for plates and beams over obstacles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from lcpcli.errors import OptionError, count, likely, quoted
from lcpcli.linalg.double_double import AccurateProduct, DoubleDouble
from lcpcli.linalg.matrices import plus_diagonal, principal, split_products
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector

SEGMENTS = 8  # segments of a structure, alternately of stiffness 1 and `contrast`
MIN_NODES = 2


class Support(NamedTuple):
    """The support of a beam: the conditions at both boundaries, and its deflection in
    the middle, or where it is free, under a unit load, for unit stiffness and length.
    """

    meaning: str
    at_ends: tuple[str, str]
    deflection: float


SUPPORTS = {
    "clamped": Support("clamped at both ends", ("clamped", "clamped"), 1 / 384),
    "hinged": Support("hinged at both ends", ("hinged", "hinged"), 5 / 384),
    "cantilever": Support("clamped at one end", ("clamped", "free"), 1 / 8),
    "springs": Support("free ends on springs", ("spring", "spring"), 5 / 384),
}
# Unknowns of a node that are fixed: the deflection, and then the rotation.
FIXED = {"clamped": 2, "hinged": 1}
# The stiffness of a spring is that of a hinged beam in the middle, 48 EI / L^3.
SPRING = 48.0
# The deflection in the middle of a square plate that is clamped, or hinged, all around.
OF_PLATE = {"clamped": 0.00126, "hinged": 0.00406}
# Of the deflection without an obstacle: its least distance, and the additional one
# between the humps.
GAP, DEPTH = 0.4, 0.8
# Of an element with E = 1 and length 1: deflection and rotation of either node.
ELEMENT = np.array(
    [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float
)
INDICES = np.indices(ELEMENT.shape)


def beam(
    n: int,
    _seed: int,
    *,
    support: str = "clamped",
    contrast: float = 1.0,
    load: float = 1.0,
    mass: float = 0.0,
) -> Problem:
    """Model a beam with n nodes, by fourth differences, over an obstacle: M = B'EB + m
    h^4 I, with the second differences B, the bending stiffness E and a mass m, as that
    of an implicit step of time, over its square.

    support : how the beam is held: clamped, hinged, cantilever, or springs, at free
        ends.
    contrast : of the stiffness of every other eighth of the beam to that of the rest,
        an integer.
    load : 1 bends the beam, with a stiffness of 1 and without the obstacle, by 2.5
        times its least distance from that; with a mass, its inertia does so besides.
    """
    support_type, n = _support(support), max(n, MIN_NODES)
    h, factor = 1 / (n + 1), float(np.rint(contrast))
    M = _differences(n, support_type.at_ends, factor)
    springs = np.zeros(n)
    springs[[0, -1]] = [
        SPRING * h**3 * (support_of_end == "spring")
        for support_of_end in support_type.at_ends
    ]
    M = plus_diagonal(M, springs + mass * h**4)
    humps = _humps(_relative_positions(np.arange(1, n + 1), n + 1))
    obstacle = (humps * DEPTH + np.full(n, GAP)) * -support_type.deflection
    force = load * h**4 * (1 + mass * support_type.deflection)
    q = AccurateProduct(M)(obstacle, np.full(n, force))
    inertia = f", mass {mass:g}" if mass else ""
    return Problem(
        M,
        q,
        note=(
            f"A beam of {count(n, 'node')}, {support_type.meaning}, contrast "
            f"{factor:g}, load {load:g}{inertia}: deflections above the obstacle."
        ),
    )


def plate(
    n: int,
    _seed: int,
    *,
    support: str = "clamped",
    contrast: float = 1.0,
    load: float = 1.0,
) -> Problem:
    """Model a square plate with k^2 nodes, k = sqrt(n) rounded, by differences with 13
    points, over an obstacle: M = L'EL, with the differences L of the Laplacian.

    support : clamped or hinged, all around.
    contrast : of the stiffness of every other strip, an eighth of the plate wide, to
        that of the rest, an integer.
    load : as for a beam.
    """
    if support not in OF_PLATE:
        raise _unknown(support, OF_PLATE)
    k, factor = max(round(math.sqrt(n)), MIN_NODES), float(np.rint(contrast))
    M = _laplacians(k, support == "clamped", factor)
    humps = _humps(_relative_positions(np.arange(1, k + 1), k + 1))
    along, across = np.repeat(np.arange(k), k), np.tile(np.arange(k), k)
    product = humps[along] * humps[across]
    # GAP and DEPTH are shares of the deflection without an obstacle.
    obstacle = (product * DEPTH + np.full(k * k, GAP)) * -OF_PLATE[support]
    q = AccurateProduct(M)(obstacle, np.full(k * k, load * (k + 1.0) ** -4))
    return Problem(
        M,
        q,
        note=(
            f"A plate of {k} x {k} nodes, {support}, contrast {factor:g}, load "
            f"{load:g}: deflections above the obstacle."
        ),
    )


def frame(
    n: int,
    _seed: int,
    *,
    support: str = "clamped",
    contrast: float = 1.0,
    load: float = 1.0,
) -> Problem:
    """Model a beam of about n / 2 elements with cubic deflections over an obstacle at
    its nodes, as a mixed problem: each deflection z >= 0 above the obstacle before the
    rotation of its node, which is free, times h.

    support, contrast, load : as for a beam.
    """
    support_type = _support(support)
    held_unknowns = sum(
        FIXED.get(support_of_end, 0) for support_of_end in support_type.at_ends
    )
    k = max(round((n + held_unknowns) / 2) - 1, MIN_NODES)
    h, factor = 1 / k, float(np.rint(contrast))
    M, end_nodes = _elements(k, factor), (0, 2 * k)
    springs, fixed = np.zeros(2 * k + 2), list[int]()
    for deflection, support_of_end in zip(end_nodes, support_type.at_ends, strict=True):
        springs[deflection] = SPRING * h**3 * (support_of_end == "spring")
        fixed += range(deflection, deflection + FIXED.get(support_of_end, 0))
    free_unknowns = np.delete(np.arange(2 * k + 2), fixed)
    M = principal(plus_diagonal(M, springs), free_unknowns)
    humps = _humps(_relative_positions(np.repeat(np.arange(k + 1), 2), k))
    is_free = free_unknowns % 2 == 1
    obstacle = (humps * DEPTH + np.full(2 * k + 2, GAP)) * -support_type.deflection
    # Of an even load, each element has half at both of its nodes, and moments.
    forces = np.tile([load * h**4, 0.0], k + 1)
    forces[[0, -2]] /= 2
    forces[[1, -1]] = load * h**4 / 12, -load * h**4 / 12
    q = AccurateProduct(M)(
        obstacle[free_unknowns] * np.where(is_free, 0.0, 1.0), forces[free_unknowns]
    )
    return Problem(
        M,
        q,
        note=(
            f"A beam of {count(k, 'element')}, {support_type.meaning}, contrast "
            f"{factor:g}, load {load:g}: each deflection above the obstacle before the "
            "rotation of its node, which is free."
        ),
        lower=np.where(is_free, -np.inf, 0.0),
    )


def _support(name: str) -> Support:
    if name not in SUPPORTS:
        raise _unknown(name, SUPPORTS)
    return SUPPORTS[name]


def _unknown(name: str, valid_names: Iterable[str]) -> OptionError:
    return OptionError(
        "support",
        f"{quoted(name)} is unknown",
        likely(name, valid_names, f"choose one of {', '.join(valid_names)}"),
    )


def _stiffness(parts: int, factor: float) -> Vector:
    """Return the stiffness of parts of a structure, alternately 1 and a factor for an
    eighth of them."""
    segments = np.arange(parts) * SEGMENTS // parts
    return np.where(segments % 2 == 1, factor, 1.0)


def _differences(n: int, supports: tuple[str, str], factor: float) -> Matrix:
    """Return B'EB for the second differences B at the nodes 0, ..., n + 1 of a beam, of
    which the first and the last are fixed; a free boundary, or one on a spring, is the
    node 1 or n."""
    from scipy.sparse import csr_array, diags_array

    # At node i, of the nodes i - 1, i and i + 1; the deflection beyond a clamped
    # boundary is that before it, and its curvature has the weight of half an interval.
    B = np.zeros((3, n + 2))
    B[:] = [[1.0], [-2.0], [1.0]]
    E = _stiffness(n + 2, factor)
    for first, second, support in zip((0, n + 1), (1, n), supports, strict=True):
        B[:, first] = 0.0
        if support == "clamped":
            B[2 if first == 0 else 0, first] = 2.0
            E[first] /= 2
        elif support in ("free", "spring"):
            B[:, second] = 0.0
    row_indices = np.repeat(np.arange(n + 2), 3)
    column_indices = row_indices + np.tile([-1, 0, 1], n + 2)
    inside = (column_indices >= 1) & (column_indices <= n)
    entries = B.T.ravel()[inside], (row_indices[inside], column_indices[inside] - 1)
    matrix = csr_array(entries, shape=(n + 2, n))
    return _without_zeros(matrix.T @ diags_array(E) @ matrix)


def _laplacians(k: int, is_clamped: bool, factor: float) -> Matrix:
    """Return L'EL for the differences L of the Laplacian at the nodes (i, j), 0 <= i, j
    <= k + 1, of a plate, whose edge is fixed; as for a beam, with E by i."""
    from scipy.sparse import csr_array, diags_array

    i, j = (each.ravel() for each in np.indices((k + 2, k + 2)))
    on_edge = (np.minimum(i, j) == 0) | (np.maximum(i, j) == k + 1)
    # As for a beam, the curvature at a clamped edge has half the weight; at a hinged
    # one there is none.
    weights = np.where(on_edge, 0.5 * is_clamped, 1.0) * _stiffness(k + 2, factor)[i]
    rows, columns = list[Indices](), list[Indices]()
    values = list[Vector]()
    for di, dj, value in ((0, 0, -4), (1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)):
        # Beyond a clamped edge the deflection is that before it.
        other = [
            np.where(v + dv < 0, 1, np.where(v + dv > k + 1, k, v + dv))
            for v, dv in ((i, di), (j, dj))
        ]
        inside = (np.minimum(*other) >= 1) & (np.maximum(*other) <= k)
        rows.append(inside.nonzero()[0])
        columns.append(((other[0] - 1) * k + other[1] - 1)[inside])
        values.append(np.full(rows[-1].size, float(value)))
    positions = np.concatenate(rows), np.concatenate(columns)
    L = csr_array((np.concatenate(values), positions), shape=((k + 2) ** 2, k * k))
    return _without_zeros(L.T @ diags_array(weights) @ L)


def _elements(k: int, factor: float) -> Matrix:
    """Return the stiffness matrix of k elements of length 1, with the deflection and
    the rotation of each of k + 1 nodes."""
    from scipy.sparse import csr_array

    rows, columns = (2 * np.arange(k)[:, np.newaxis] + each.ravel() for each in INDICES)
    values = _stiffness(k, factor)[:, np.newaxis] * ELEMENT.ravel()
    positions = rows.ravel(), columns.ravel()
    size = 2 * k + 2
    return _without_zeros(csr_array((values.ravel(), positions), shape=(size, size)))


def _without_zeros(M: Matrix) -> Matrix:
    M = M.tocsr()
    M.sum_duplicates()
    M.eliminate_zeros()
    return M


def _relative_positions(numbers: Indices, parts: int) -> DoubleDouble:
    """Return numbers / parts."""
    high = numbers / parts
    # What high leaves of the number is exact.
    product, error = split_products(high, np.full(numbers.size, float(parts)))
    return DoubleDouble(high, ((numbers + product) + error) / parts)


def _humps(x: DoubleDouble) -> DoubleDouble:
    """Return (1 - T_6(2 x - 1)) / 2 = 1 - u (3 - 4 u)^2, u = (2 x - 1)^2."""
    ones = np.ones(x.high.size)
    t = x * 2.0 - ones
    u = t * t
    inner = u * -4.0 + 3.0 * ones
    return -(u * (inner * inner)) + ones
