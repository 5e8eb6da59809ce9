"""Switching systems of mechanics and electronics, games and markets; and free boundary
problems of physics and finance, discretized by finite differences, with sparse
matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from lcpcli.errors import count
from lcpcli.gallery.families import require
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector

# Random numbers are multiples of 1/16, so that their sums and products are exact.
UNITS = 16
# The nodes of a bridge: the two poles of its source, then plus and minus.
NODES, DIODES = 4, ((0, 2), (1, 2), (3, 0), (3, 1))
# Conductances are powers of two, so that sums are exact.
INNER, LOAD, LEAK, COUPLING = 1.0, 0.25, 0.0625, 0.5


def contact(
    n: int, seed: int, *, friction: float = 0.5, compliance: float = 0.0
) -> Problem:
    """Model the impulses in k = n / 4 contacts, rounded, between (k + 1) // 2 bodies in
    the plane and the ground.

    z = (normal impulses, tangential impulses in both directions, sliding speeds), of
    lengths k, 2k and k. With the rows N and T = (t, -t) of the contacts, unit masses,
    the velocity v before, E that sums both directions, and the coefficient of friction,
    M = [NN' NT' 0; TN' TT' E'; friction I, -E, 0] and q = (Nv, Tv, 0); a compliance is
    added to the diagonal of NN' and TT'.
    D. E. Stewart, J. C. Trinkle, Int. J. Numer. Methods Eng. 39 (1996) 2673-2691; A. M.
    Al-Fahed, G. E. Stavroulakis, P. D. Panagiotopoulos, Z. angew. Math. Mech. 71 (1991)
    257-265.
    """
    k = max(1, round(n / 4))
    random = np.random.default_rng([seed, k])
    normal, tangential = _rows(random, k)
    rows = np.concatenate((normal, tangential, -tangential))
    velocity = np.rint(UNITS * random.standard_normal(rows.shape[1])) / UNITS
    M = with_friction(rows @ rows.T + compliance * np.eye(3 * k), friction)
    q = np.concatenate((rows @ velocity, np.zeros(k)))
    law = f"{count(k, 'contact')}, friction {friction:g}, compliance {compliance:g}"
    return Problem(M, q, note=f"{law}. In theory Lemke's method finds a solution.")


def with_friction(A: Vector, friction: float) -> Matrix:
    """Return [A B; C 0] with B = [0; E'] and C = [friction I, -E] for A of shape (3 k,
    3 k), as in `contact`."""
    one, none = np.eye(len(A) // 3), np.zeros((len(A) // 3, len(A) // 3))
    E = np.hstack((one, one))
    return np.block(
        [[A, np.vstack((none, E.T))], [np.hstack((friction * one, -E)), none]]
    )


def _rows(random: Generator, k: int) -> tuple[Vector, Vector]:
    """Return normal and tangential rows of k contacts, each between random bodies or a
    random body and the ground."""
    bodies = (k + 1) // 2
    normal, tangential = np.zeros((2, k, 3 * bodies))
    for i in range(k):
        pair = random.permutation(bodies + 1)[:2]
        angle, arms = random.uniform(0, 2 * np.pi), random.uniform(-1, 1, (2, 2))
        for body, sign, (x, y) in zip(pair, (1, -1), arms, strict=True):
            if body < bodies:
                columns = slice(3 * body, 3 * body + 3)
                c, s = sign * np.cos(angle), sign * np.sin(angle)
                normal[i, columns] = c, s, x * s - y * c
                tangential[i, columns] = -s, c, x * c + y * s
    return np.rint(UNITS * normal) / UNITS, np.rint(UNITS * tangential) / UNITS


def circuit(n: int, _seed: int) -> Problem:
    """Model a row of k = n / 8 bridge rectifiers, rounded: 4 k free potentials v, then
    4 k diode currents i >= 0.

    Kirchhoff's law G v + D i = s at each node is an equation; the voltage -D'v that a
    diode blocks is not negative, and 0 where it conducts: M = [G D; -D' 0], q = (-s,
    0). Each bridge has a current source with an inner conductance, a load, and leaks to
    the ground; its plus leads to that of the next. The network and its values are
    original.
    V. Acary, O. Bonnefon, B. Brogliato, Nonsmooth Modeling and Simulation for Switched
    Circuits, Springer (2011).
    """
    from scipy.sparse import block_array, csr_array, diags_array, eye_array

    k = max(1, round(n / 8))
    size, nodes = NODES * k, NODES * np.arange(k)
    conductances = np.concatenate(
        (np.full(k, INNER), np.full(k, LOAD), np.full(k - 1, COUPLING))
    )
    at_branches = [
        (nodes, nodes + 1),
        (nodes + 2, nodes + 3),
        (nodes[:-1] + 2, nodes[1:] + 2),
    ]
    branches = _incidence(size, at_branches)
    D = _incidence(size, [(nodes + i, nodes + j) for i, j in DIODES])
    G = branches @ diags_array(conductances) @ branches.T + LEAK * eye_array(size)
    M = csr_array(block_array([[G, D], [-D.T, None]]))
    current = (7 * np.arange(k) % 11) - 5.5
    q = np.zeros(2 * size)
    q[nodes], q[nodes + 1] = -current, current
    lower = np.where(np.arange(q.size) < size, -np.inf, 0.0)
    return Problem(
        M,
        q,
        note=(
            f"{k} bridges: potentials of {size} nodes, then currents of {size} diodes."
        ),
        lower=lower,
    )


def _incidence(nodes: int, branches: Sequence[tuple[Indices, Indices]]) -> Any:
    """Return a column for each branch of a network, with 1 at its first node and -1 at
    its second node."""
    from scipy.sparse import csr_array

    first, second = map(np.concatenate, zip(*branches, strict=True))
    branch_numbers, one = np.tile(np.arange(first.size), 2), np.ones(first.size)
    return csr_array(
        (
            np.concatenate((one, -one)),
            (np.concatenate((first, second)), branch_numbers),
        ),
        (nodes, first.size),
    )


def relays(n: int, seed: int, *, step: float = 0.125) -> Problem:
    """Model the outputs -1 <= z_i <= 1 of n relays, 1 where w_i < 0 and -1 where w_i >
    0, that drive x' = A x + C'z.

    w = C x after an implicit Euler step h: M = h C (I - h A)^-1 C' and q = C (I
    - h A)^-1 x_0, with A = S - I for a random skew-symmetric S.
    V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer
    (2008).
    """
    random = np.random.default_rng([seed, n])
    R, C = np.rint(UNITS * random.standard_normal((2, n, n))) / UNITS
    A = R - R.T - np.eye(n)
    state = np.rint(UNITS * random.standard_normal(n)) / UNITS
    inverse = np.linalg.inv(np.eye(n) - step * A)
    M, q = step * (C @ inverse @ C.T), C @ (inverse @ state)
    ones = np.ones(n)
    return Problem(
        M,
        q,
        note=f"Step {step:g}. Relays with -1 < z < 1 slide.",
        lower=-ones,
        upper=ones,
    )


def bimatrix(n: int, seed: int) -> Problem:
    """Let M = [0 A; B' 0], q = -e with uniform costs A and B of shape (n // 2, n - n //
    2) in (1, 2). n is at least 2.

    C. E. Lemke, J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964)
    413-423.
    """
    n = max(2, n)
    m = n // 2
    A, B = np.random.default_rng([seed, n]).uniform(1, 2, (2, m, n - m))
    M = np.zeros((n, n))
    M[:m, m:], M[m:, :m] = A, B.T
    note = (
        "Lemke's method from e terminates on a ray at its first pivot, although every "
        "game has an equilibrium."
    )
    return Problem(M, -np.ones(n), note=note)


def spatial_prices(
    n: int, seed: int, *, capacity: float = 3.0, tax: float = 0.0
) -> Problem:
    """Model prices of one good in m regions of supply and m of demand, and flows, with
    about n = 2 m + m^2 unknowns.

    z = (supply prices, demand prices, flows by region of supply); prices are free.
    Region i supplies s_i = b_i (p_i - a_i), region j demands e_j (d_j - r_j); both
    equal the sums of flows. A flow has w = p_i + c_ij + tax - r_j, its loss per unit;
    at its capacity it may gain. Data are random.
    T. Takayama, G. G. Judge, Spatial and Temporal Price and Allocation Models,
    North-Holland (1971).

    capacity : of each flow; it moves bounds alone.
    tax : on a unit of trade, a subsidy if negative; it moves q alone. From 18 on there
        is no trade.
    """
    from scipy.sparse import (
        block_array,
        csr_array,
        diags_array,
        eye_array,
        kron,
        vstack,
    )

    m = max(1, round(math.sqrt(n + 1) - 1))
    random = np.random.default_rng([seed, m])
    a, b, d, e = (
        random.integers(low, high, m).astype(float)
        for low, high in ((1, 6), (1, 4), (10, 21), (1, 4))
    )
    costs = random.integers(1, 10, m * m).astype(float)
    one, ones = eye_array(m), np.ones((1, m))
    # Below each other: the flows out of each region of supply with the sign -, and
    # those into each region of demand.
    sums = vstack((-kron(one, ones), kron(ones, one)))
    slopes = diags_array(np.concatenate((b, e)))
    prices, regions = np.full(2 * m, np.inf), range(1, m + 1)
    flows = [f"flow{i}-{j}" for i in regions for j in regions]
    return Problem(
        csr_array(block_array([[slopes, sums], [-sums.T, None]])),
        np.concatenate((-a * b, -d * e, costs + tax)),
        note=f"{m} regions of supply, {m} of demand, capacity {capacity:g}.",
        lower=np.concatenate((-prices, np.zeros(m * m))),
        upper=np.concatenate((prices, np.full(m * m, capacity))),
        names=[
            *(f"supply{i}" for i in regions),
            *(f"demand{j}" for j in regions),
            *flows,
        ],
    )


def obstacle(n: int, _seed: int) -> Problem:
    """Discretize -Laplace z >= f, z >= 0 with complementarity on (0, 1)^2, z = 0 on its
    boundary, times h^2.

    Five-point differences on a grid of m x m interior points with m = sqrt(n), rounded.
    R. Glowinski, Numerical Methods for Nonlinear Variational Problems (1984), chapter
    II; the load is original to lcp.
    """
    return Problem(*_membrane(n), note="The membrane touches the obstacle where z = 0.")


def two_obstacles(
    n: int, _seed: int, *, gap: float = 0.3, load: float = 1.0
) -> Problem:
    """Discretize -Laplace z = load f where -gap / 2 < z < gap / 2, with the square, f
    and differences of `obstacle`.

    J. F. Rodrigues, Obstacle Problems in Mathematical Physics, North-Holland (1987).
    """
    M, q = _membrane(n)
    half_gap = np.full(q.size, gap / 2)
    note = f"The membrane touches an obstacle where |z| = {gap / 2:g}."
    return Problem(M, load * q, note=note, lower=-half_gap, upper=half_gap)


def torsion(n: int, _seed: int, *, angle: float = 4.0) -> Problem:
    """Model the stress function z of a square bar: |z| is at most the distance to the
    boundary, and where it is less, -Laplace z = 2 angle, times h^2.

    R. Glowinski, as for `obstacle`; with bounds instead of a constraint on the
    gradient: H. Brezis, M. Sibony, Arch. Rational Mech. Anal. 41 (1971) 254-265.

    angle : twist per unit length, which moves q alone; the bar is plastic where z is at
        a bound.
    """
    m, h, X, Y = grid(n)
    distance = np.minimum(np.minimum(X, 1 - X), np.minimum(Y, 1 - Y)).ravel()
    q = np.full(m * m, -2 * angle * h * h)
    return Problem(
        laplacian_of(m),
        q,
        note=f"Twist per unit length {angle:g}.",
        lower=-distance,
        upper=distance,
    )


def _membrane(n: int) -> tuple[Matrix, Vector]:
    """Return the matrix and the load of a membrane, both multiplied by h^2."""
    m, h, X, Y = grid(n)
    load = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    return laplacian_of(m), (-h * h * load).ravel()


def grid(n: int) -> tuple[int, float, Vector, Vector]:
    """Return m, h and the coordinates of the interior points of (0, 1)^2, each of shape
    (m, m)."""
    m = max(1, round(math.sqrt(n)))
    h = 1 / (m + 1)
    return m, h, *np.meshgrid(*2 * [h * np.arange(1, m + 1)])


def laplacian_of(m: int) -> Matrix:
    """Return minus the five-point Laplacian on an m x m grid, multiplied by h^2."""
    from scipy.sparse import csr_array, eye_array, kron

    T, unit = three_diagonals(np.full(m, 2.0)), eye_array(m)
    return csr_array(kron(T, unit) + kron(unit, T))


def three_diagonals(diagonal: Vector, off: Vector | None = None) -> Matrix:
    """Return the sparse symmetric tridiagonal matrix with these entries, by default -1
    off the diagonal."""
    from scipy.sparse import csr_array, diags_array

    off = -np.ones(diagonal.size - 1) if off is None else off
    return csr_array(
        diags_array(
            [off, diagonal, off], offsets=[-1, 0, 1], shape=2 * (diagonal.size,)
        )
    )


def journal_bearing(n: int, _seed: int, *, eccentricity: float = 0.8) -> Problem:
    """Model the pressure z >= 0 in the oil film of an infinitely long bearing, zero
    where the film ruptures.

    The equation is Reynolds', (h^3 z')' = h', for the film h = 1 + eccentricity cos t,
    0 < t < 2 pi, with z = 0 at both boundaries, by central differences at n interior
    points, times the square of the step. C. W. Cryer, Math. Comp. 25 (1971) 435-443.

    eccentricity : offset of the shaft from the centre, as a fraction of the clearance.
    """
    step = 2 * np.pi / (n + 1)
    film = 1 + eccentricity * np.cos(step * (np.arange(n + 1) + 0.5))
    cubes = film**3
    M = three_diagonals(cubes[:-1] + cubes[1:], -(film[1:-1] ** 3))
    q = step * np.diff(film)
    return Problem(
        M, q, note="The oil film is intact where z > 0 and ruptured where z = 0."
    )


def american_put(
    n: int,
    _seed: int,
    *,
    volatility: float = 0.4,
    rate: float = 0.1,
    years: float = 0.5,
    strike: float = 1.0,
) -> Problem:
    """Model an American put by one fully implicit step of `years` before expiry, in the
    variables of the heat equation.

    With x = log S, t = volatility^2 years / 2, k = 2 rate / volatility^2, the strike E
    and the payoff g(x, t) = exp((k + 1)^2 t / 4) max(E exp((k - 1) x / 2) - exp((k + 1)
    x / 2), 0), the unknown is z = u - g at n interior points of -2 < x < 2, where u
    solves u_t >= u_xx, u >= g with complementarity.
    P. Wilmott, J. Dewynne, S. Howison, Option Pricing, Oxford Financial Press (1993).

    volatility, rate : per year, as fractions; years : the length of the step.
    strike : E, which moves q alone. A path between two strikes passes the puts whose
        payoffs are means of both.
    """
    k, t = 2 * rate / volatility**2, volatility**2 * years / 2
    # The boundaries are so far from a strike of 1 that z is 0 there.
    x = np.linspace(-2.0, 2.0, n + 2)
    growth = (k + 1) ** 2 * t / 4
    require(
        "rate",
        rate,
        k <= 100 and growth <= 500,
        "small compared with the square of the volatility",
    )
    expiry = np.maximum(strike * np.exp((k - 1) * x / 2) - np.exp((k + 1) * x / 2), 0)
    payoff = math.exp(growth) * expiry
    alpha = t / (x[1] - x[0]) ** 2
    M = alpha * three_diagonals(np.full(n, 2 + 1 / alpha))
    q = payoff[1:-1] - alpha * np.diff(payoff, 2) - expiry[1:-1]
    return Problem(
        M, q, note="The option is held where z > 0 and exercised where z = 0."
    )
