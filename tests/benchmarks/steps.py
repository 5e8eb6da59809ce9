"""Steps in time, each by itself, by a Solver from the last states, and by QuantEcon:
steps.py [seconds]

Microseconds of a step in the median, and milliseconds of all steps, from arrays in
memory to the verified answer, in turns; each sequence again for so many seconds (2).
Each step depends on the last solution, or on time alone: a sequence is a function whose
last argument `solve` takes a SequenceStep and returns its z, or None where it has none.
M is the same object in steps that have the same M, and q is a new array.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from statistics import median
from typing import Any, NamedTuple

import numpy as np

import lcpcli
from lcpcli import Solver
from lcpcli.gallery.rigid_bodies import contact_in_time
from lcpcli.gallery.systems import obstacle
from lcpcli.model.problem import Problem
from lcpcli.peers import registry
from lcpcli.typing import Matrix, Vector


class SequenceStep(NamedTuple):
    """The data of one problem. bounds : `lower` and `upper`, or none for an LCP."""

    M: Matrix
    q: Vector
    bounds: Mapping[str, Any] = {}


Solve = Callable[[SequenceStep], "Vector | None"]


def boxes(kind, number, steps, solve):
    """Move the boxes of `contact_in_time` by so many steps with contacts; a step
    without a solution has no impulses."""
    scene = contact_in_time(kind, number)
    for _ in range(steps):
        while not scene.contacts:
            scene.advance()
        problem = scene.problem()
        scene.advance(solve(SequenceStep(problem.M, problem.q)))


def put(n, steps, solve):
    """Value an American put on n prices by implicit time steps backwards from expiry,
    over one year.

    z is the value beyond the payoff in x, the logarithm of the price over the strike,
    by central differences of the Black-Scholes equation. M. J. Brennan, E. S. Schwartz,
    The valuation of American put options, J. Finance 32 (1977) 449-462.
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
    z = np.zeros(n)
    for _ in range(steps):
        beyond = z
        z = solve(SequenceStep(M, fixed - payoff[1:-1] - beyond))
        z = beyond if z is None else z


def market(hours, solve):
    """Clear an electricity market of 8 regions hour by hour: 24 plants, 12 lines, 8
    free prices.

    M = [D 0 -S'; 0 L -N'; S N 0] with the slopes D of marginal costs, the losses L, the
    places S of the plants and the incidences N of the lines; demand and the capacities
    of the plants that depend on the wind change with the hour. Data are random. B. F.
    Hobbs, Linear complementarity models of Nash-Cournot competition in bilateral and
    POOLCO power markets, IEEE Trans. Power Syst. 16 (2001) 194-202.
    """
    regions, plants, lines = 8, 24, 12
    random, k = np.random.default_rng(regions), plants + lines
    M = np.zeros((k + regions, k + regions))
    M[np.arange(k), np.arange(k)] = np.concatenate(
        (random.uniform(0.05, 0.2, plants), np.full(lines, 0.02))
    )
    M[k + np.arange(plants) % regions, np.arange(plants)] = 1.0
    for line in range(lines):  # a ring, and lines across it
        one, other = (
            (line, (line + 1) % regions)
            if line < regions
            else (line - regions, line - regions // 2)
        )
        M[k + one, plants + line], M[k + other, plants + line] = -1.0, 1.0
    M[:k, k:] = -M[k:, :k].T
    is_wind, costs = np.arange(plants) < regions, random.uniform(10, 60, plants)
    costs[is_wind] = 0.0
    demand = random.uniform(60, 120, regions)
    most = np.where(is_wind, 60.0, np.where(np.arange(plants) < 16, 50, 200))
    wind = random.uniform(0.2, 0.8, regions)
    lower = np.concatenate(
        (np.zeros(plants), np.full(lines, -30.0), np.full(regions, -np.inf))
    )
    for hour in range(hours):
        wind = np.clip(wind + random.normal(0, 0.05, regions), 0.05, 1.0)
        now = demand * (
            1
            + 0.25 * np.sin(2 * np.pi * (hour - 9) / 24)
            + random.normal(0, 0.01, regions)
        )
        upper = np.concatenate((most, np.full(lines, 30.0), np.full(regions, np.inf)))
        upper[:regions] *= wind
        solve(
            SequenceStep(
                M,
                np.concatenate((costs, np.zeros(lines), -now)),
                {"lower": lower, "upper": upper},
            )
        )


def moving_load(m, steps, solve):
    """Press a membrane on m x m points against the obstacle of `obstacle`, from which a
    load lifts it on its way around a circle in 100 steps."""
    M, h = obstacle(m * m, 0).M, 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    for step in range(steps):
        x = 0.5 + 0.25 * np.cos(0.02 * np.pi * step)
        y = 0.5 + 0.25 * np.sin(0.02 * np.pi * step)
        load = 60 * np.exp(-((X - x) ** 2 + (Y - y) ** 2) / 0.02) - 10
        solve(SequenceStep(M, (-h * h * load).ravel()))


CASES = {
    "tower of 5": partial(boxes, "tower", 5, 100),
    "tower of 10": partial(boxes, "tower", 10, 100),
    "heap of 8": partial(boxes, "heap", 8, 200),
    "pyramid of 6": partial(boxes, "pyramid", 6, 30),
    "crushed": partial(boxes, "crushed", 3, 8),
    "put 400": partial(put, 400, 50),
    "put 1000": partial(put, 1000, 50),
    "market 44": partial(market, 168),
    "obstacle 100 x 100": partial(moving_load, 100, 20),
}
TOL, TIME_LIMIT = 1e-10, 10.0  # of a step, the latter in seconds


class Ways:
    """The seconds of each step in each way. solver : is made anew where the number of
    unknowns changes."""

    def __init__(self):
        self.seconds: dict[str, list[float]] = {
            "run": [],
            "Solver": [],
            "quantecon": [],
        }
        self.steps, self.M, self.solver = 0, np.zeros((0, 0)), None

    def by_itself(self, step):
        result = lcpcli.run(
            Problem(step.M, step.q, **step.bounds), tol=TOL, time_limit=TIME_LIMIT
        )
        return result.z if result.solved else None

    def from_last_basis(self, step):
        if self.solver is None or self.M.shape != step.M.shape:
            self.solver = Solver(step.M, **step.bounds, tol=TOL, time_limit=TIME_LIMIT)
        elif step.M is not self.M:
            self.solver.update(step.M)
        self.M = step.M
        result = self.solver.solve(step.q, **step.bounds)
        return result.z if result.solved else None

    def by_quantecon(self, step):
        return (
            registry.load("quantecon")
            .solve(Problem(step.M, step.q, **step.bounds), TOL, TIME_LIMIT)
            .z
        )

    def solve(self, step):
        ways = {"run": self.by_itself, "Solver": self.from_last_basis}
        peer = registry.load("quantecon")
        if peer.version() and not peer.excludes(Problem(step.M, step.q, **step.bounds)):
            ways["quantecon"] = self.by_quantecon
        found, names = {}, list(ways)
        # In another order at each step, as the first one fills caches for the others.
        for turn in range(len(names)):
            name = names[(self.steps + turn) % len(names)]
            began = time.perf_counter()
            found[name] = ways[name](step)
            self.seconds[name].append(time.perf_counter() - began)
        self.steps += 1
        return found["run"] if found["run"] is not None else found["Solver"]


def main(budget):
    for name, follow in CASES.items():
        follow(Ways().solve)  # compiles, and warms up
        ways, passes, began = Ways(), 0, time.perf_counter()
        while not passes or time.perf_counter() - began < budget:
            follow(ways.solve)
            passes += 1
        cells = [
            f"{way} {1e6 * median(own):.3g} us, all {1e3 * sum(own) / passes:.3g} ms"
            for way, own in ways.seconds.items()
            if own
        ]
        print(f"{name}, {ways.steps // passes} steps: {'; '.join(cells)}", flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
