"""Sequences of problems in which each step depends on the last solution, or on time alone.

A sequence is a function whose last argument `solve` takes a Step and returns its z, or None where it has none. M is the
same object in steps that have the same M, and q is a new array.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from lcpcli.gallery.differences import obstacle
from lcpcli.gallery.rigid_bodies import contact_in_time
from lcpcli.typing import Matrix, Vector


class SequenceStep(NamedTuple):
    """The data of one problem. bounds : `lower` and `upper`, or none for an LCP."""

    M: Matrix
    q: Vector
    bounds: Mapping[str, Any] = {}


Solve = Callable[[SequenceStep], "Vector | None"]


def boxes(kind: str, number: int, steps: int, solve: Solve) -> None:
    """Move the boxes of `contact_in_time` by so many steps with contacts; a step without a solution has no impulses."""
    scene = contact_in_time(kind, number)
    for _ in range(steps):
        while not scene.contacts:
            scene.advance()
        problem = scene.problem()
        scene.advance(solve(SequenceStep(problem.M, problem.q)))


def put(n: int, steps: int, solve: Solve) -> None:
    """Value an American put on n prices by implicit time steps backwards from expiry, over one year.

    z is the value beyond the payoff in x, the logarithm of the price over the strike, by central differences of the
    Black-Scholes equation. M. J. Brennan, E. S. Schwartz, The valuation of American put options, J. Finance 32 (1977)
    449-462.
    """
    from scipy.sparse import csr_array, diags_array

    strike, rate, volatility, dt = 100.0, 0.05, 0.2, 1 / steps
    x, h = np.linspace(-1.2, 1.2, n + 2, retstep=True)
    payoff = np.maximum(strike - strike * np.exp(x), 0.0)
    a, b = volatility**2 / (2 * h**2), (rate - volatility**2 / 2) / (2 * h)
    diagonals = [-(a - b) * dt, 1 + (2 * a + rate) * dt, -(a + b) * dt]
    M = csr_array(diags_array(diagonals, offsets=[-1, 0, 1], shape=(n, n)))
    fixed = M @ payoff[1:-1]
    fixed[0] -= (a - b) * dt * payoff[0]
    z: Vector | None = np.zeros(n)
    for _ in range(steps):
        beyond = z
        z = solve(SequenceStep(M, fixed - payoff[1:-1] - beyond))
        z = beyond if z is None else z


def market(hours: int, solve: Solve) -> None:
    """Clear an electricity market of 8 regions hour by hour: 24 plants, 12 lines, 8 free prices.

    M = [D 0 -S'; 0 L -N'; S N 0] with the slopes D of marginal costs, the losses L, the places S of the plants and the
    incidences N of the lines; demand and the capacities of the plants that depend on the wind change with the hour.
    Data are random. B. F. Hobbs, Linear complementarity models of Nash-Cournot competition in bilateral and POOLCO
    power markets, IEEE Trans. Power Syst. 16 (2001) 194-202.
    """
    regions, plants, lines = 8, 24, 12
    random, k = np.random.default_rng(regions), plants + lines
    M = np.zeros((k + regions, k + regions))
    M[np.arange(k), np.arange(k)] = np.concatenate((random.uniform(0.05, 0.2, plants), np.full(lines, 0.02)))
    M[k + np.arange(plants) % regions, np.arange(plants)] = 1.0
    for line in range(lines):  # a ring, and lines across it
        one, other = (line, (line + 1) % regions) if line < regions else (line - regions, line - regions // 2)
        M[k + one, plants + line], M[k + other, plants + line] = -1.0, 1.0
    M[:k, k:] = -M[k:, :k].T
    is_wind, costs = np.arange(plants) < regions, random.uniform(10, 60, plants)
    costs[is_wind] = 0.0
    demand, most = random.uniform(60, 120, regions), np.where(is_wind, 60.0, np.where(np.arange(plants) < 16, 50, 200))
    wind = random.uniform(0.2, 0.8, regions)
    lower = np.concatenate((np.zeros(plants), np.full(lines, -30.0), np.full(regions, -np.inf)))
    for hour in range(hours):
        wind = np.clip(wind + random.normal(0, 0.05, regions), 0.05, 1.0)
        now = demand * (1 + 0.25 * np.sin(2 * np.pi * (hour - 9) / 24) + random.normal(0, 0.01, regions))
        upper = np.concatenate((most, np.full(lines, 30.0), np.full(regions, np.inf)))
        upper[:regions] *= wind
        solve(SequenceStep(M, np.concatenate((costs, np.zeros(lines), -now)), {"lower": lower, "upper": upper}))


def moving_load(m: int, steps: int, solve: Solve) -> None:
    """Press a membrane on m x m points against the obstacle of `obstacle`, from which a load lifts it on its way
    around a circle in 100 steps."""
    M, h = obstacle(m * m, 0).M, 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    for step in range(steps):
        x, y = 0.5 + 0.25 * np.cos(0.02 * np.pi * step), 0.5 + 0.25 * np.sin(0.02 * np.pi * step)
        load = 60 * np.exp(-((X - x) ** 2 + (Y - y) ** 2) / 0.02) - 10
        solve(SequenceStep(M, (-h * h * load).ravel()))
