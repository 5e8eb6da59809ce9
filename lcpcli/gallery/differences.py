"""Free boundary problems of physics and finance by finite differences, all with sparse matrices."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.families import require
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

LOG_PRICE = 2.0  # the grid reaches from exp(-2) to exp(2), so far from a strike of 1 that z is 0 at both ends


def obstacle(n: int, _seed: int) -> Problem:
    """Discretize -Laplace z >= f, z >= 0 with complementarity on the unit square, z = 0 on its boundary, times h^2.

    Five-point differences on a grid of m x m interior points with m = sqrt(n), rounded; M is sparse.
    R. Glowinski, Numerical Methods for Nonlinear Variational Problems, Springer (1984), chapter II; the load is
    original to lcp.
    """
    M, q = _membrane(n)
    source = "Glowinski 1984, chapter II, five-point differences"
    note = "The membrane touches the obstacle where z = 0."
    return Problem(M, q, name=f"obstacle-{q.size}", source=source, note=note)


def two_obstacles(n: int, _seed: int, *, gap: float = 0.3, load: float = 1.0) -> Problem:
    """Discretize -Laplace z = load f where -gap / 2 < z < gap / 2, with the square, f and differences of `obstacle`.

    J. F. Rodrigues, Obstacle Problems in Mathematical Physics, North-Holland (1987).

    gap : the distance between the flat obstacles, 0 < gap <= 1e6. load : |load| <= 1e6; it moves q alone.
    """
    require("gap", gap, 0 < gap <= 1e6, "0 < gap <= 1e6")
    require("load", load, abs(load) <= 1e6, "|load| <= 1e6")
    M, q = _membrane(n)
    end = np.full(q.size, gap / 2)
    source = "Rodrigues 1987, five-point differences"
    note = f"The membrane touches an obstacle where |z| = {gap / 2:g}."
    return Problem(M, load * q, name=f"two-obstacles-{q.size}", source=source, note=note, lower=-end, upper=end)


def torsion(n: int, _seed: int, *, angle: float = 4.0) -> Problem:
    """Model the stress function z of a square bar: |z| is at most the distance to the boundary, and where it is less,
    -Laplace z = 2 angle, times h^2.

    R. Glowinski, as for `obstacle`; with bounds instead of a constraint on the gradient: H. Brezis, M. Sibony,
    Équivalence de deux inéquations variationnelles et applications, Arch. Rational Mech. Anal. 41 (1971) 254-265.

    angle : twist per unit length, |angle| <= 1e6, which moves q alone; the bar is plastic where z is at a bound.
    """
    require("angle", angle, abs(angle) <= 1e6, "|angle| <= 1e6")
    m, h, X, Y = _grid(n)
    M, q = _laplacian(m), np.full(m * m, -2 * angle * h * h)
    distance = np.minimum(np.minimum(X, 1 - X), np.minimum(Y, 1 - Y)).ravel()
    source = "Glowinski 1984, chapter II; Brezis and Sibony 1971; five-point differences"
    note = f"Twist per unit length {angle:g}."
    return Problem(M, q, name=f"torsion-{m * m}", source=source, note=note, lower=-distance, upper=distance)


def _membrane(n: int) -> tuple[Matrix, Vector]:
    """Return M and q of -Laplace z = f, times h^2."""
    m, h, X, Y = _grid(n)
    load = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    return _laplacian(m), (-h * h * load).ravel()


def _grid(n: int) -> tuple[int, float, Vector, Vector]:
    """Return m, h and the coordinates of the interior points of the unit square, each of shape (m, m)."""
    m = max(1, round(math.sqrt(n)))
    h = 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    return m, h, X, Y


def _laplacian(m: int) -> Matrix:
    """Return the matrix of five-point differences for -h^2 times the Laplacian on m x m points."""
    from scipy.sparse import csr_array, eye_array, kron

    T, unit = three_diagonals(np.full(m, 2.0)), eye_array(m)
    return csr_array(kron(T, unit) + kron(unit, T))


def three_diagonals(diagonal: Vector, off: Vector | None = None) -> Matrix:
    """Return the sparse symmetric tridiagonal matrix with these entries, by default -1 off the diagonal."""
    from scipy.sparse import csr_array, diags_array

    off = -np.ones(diagonal.size - 1) if off is None else off
    return csr_array(diags_array([off, diagonal, off], offsets=[-1, 0, 1], shape=2 * (diagonal.size,)))


def journal_bearing(n: int, _seed: int, *, eccentricity: float = 0.8) -> Problem:
    """Model the pressure z >= 0 in the oil film of an infinitely long bearing, zero where the film ruptures.

    The equation is Reynolds', (h^3 z')' = h', for the film h = 1 + eccentricity cos t, 0 < t < 2 pi, with z = 0 at both
    ends, by central differences at n interior points, times the square of the step; M is tridiagonal and sparse.
    C. W. Cryer, The method of Christopherson for solving free boundary problems for infinite journal bearings by means
    of finite differences, Math. Comp. 25 (1971) 435-443.

    eccentricity : offset of the shaft from the centre, as a fraction of the clearance, 0 < eccentricity < 1.
    """
    require("eccentricity", eccentricity, 0 < eccentricity < 1, "0 < eccentricity < 1")
    step = 2 * np.pi / (n + 1)
    film = 1 + eccentricity * np.cos(step * (np.arange(n + 1) + 0.5))
    cubes = film**3
    M, q = three_diagonals(cubes[:-1] + cubes[1:], -(film[1:-1] ** 3)), step * np.diff(film)
    note = "The oil film is intact where z > 0 and ruptured where z = 0."
    return Problem(M, q, name=f"journal-bearing-{n}", source="Cryer 1971", note=note)


def american_put(
    n: int, _seed: int, *, volatility: float = 0.4, rate: float = 0.1, years: float = 0.5, strike: float = 1.0
) -> Problem:
    """Model an American put by one fully implicit step of `years` before expiry, in the variables of the heat equation.

    With x = log S, t = volatility^2 years / 2, k = 2 rate / volatility^2, the strike E and the payoff
    g(x, t) = exp((k + 1)^2 t / 4) max(E exp((k - 1) x / 2) - exp((k + 1) x / 2), 0), the unknown is z = u - g at n
    interior points of -2 < x < 2, where u solves u_t >= u_xx, u >= g with complementarity. M is tridiagonal and sparse.
    P. Wilmott, J. Dewynne, S. Howison, Option Pricing: Mathematical Models and Computation, Oxford Financial Press
    (1993), chapters on the American option as a linear complementarity problem.

    volatility, rate : per year, as fractions; years : the length of the step; all from 0.001 to 10.
    strike : E, from 0.5 to 2; it moves q alone. A path between two strikes passes the puts whose payoffs are means of
        both.
    """
    require("strike", strike, 0.5 <= strike <= 2, "0.5 <= strike <= 2")
    for name, value in (("volatility", volatility), ("rate", rate), ("years", years)):
        require(name, value, 0.001 <= value <= 10, f"0.001 <= {name} <= 10")
    k, t = 2 * rate / volatility**2, volatility**2 * years / 2
    x = np.linspace(-LOG_PRICE, LOG_PRICE, n + 2)
    growth = (k + 1) ** 2 * t / 4
    require("rate", rate, k <= 100 and growth <= 500, "small compared with the square of the volatility")
    expiry = np.maximum(strike * np.exp((k - 1) * x / 2) - np.exp((k + 1) * x / 2), 0)
    payoff = math.exp(growth) * expiry
    alpha = t / (x[1] - x[0]) ** 2
    M = alpha * three_diagonals(np.full(n, 2 + 1 / alpha))
    q = payoff[1:-1] - alpha * np.diff(payoff, 2) - expiry[1:-1]
    source = "Wilmott, Dewynne and Howison 1993"
    note = "The option is held where z > 0 and exercised where z = 0."
    return Problem(M, q, name=f"american-put-{n}", source=source, note=note)
