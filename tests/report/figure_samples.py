"""Data of figures for tests: a few runs, many, strange ones, and some that really ran."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from lcpcli import Trace, read, run
from lcpcli.files import contents
from lcpcli.report.figures import run_figures, style
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Power, Profile

METHODS = ("auto", "shi", "fixed-point", "newton", "lemke", "milp")
PEERS = ("piqp", "clarabel", "quantecon", "osqp", "daqp")


def convergence(*panels: Panel) -> Figure:
    """The figure of error against run time and iteration."""
    with style.context():
        return run_figures.draw_convergence(list(panels))


def bench(
    profiles: Sequence[Profile],
    panels: Sequence[Panel] = (),
    growths: Sequence[GrowthPanel] = (),
) -> Figure:
    """The figure of a benchmark."""
    with style.context():
        return run_figures.draw_bench(profiles, panels, growths)


def decaying(name: str, rate: float = 0.5, count: int = 40, label: str = "", solved: bool = True) -> Curve:
    """A run that starts at time 0 with error 10 and gains by a constant factor, faster for a smaller rate."""
    k = list(range(count))
    return Curve(name, label or name, k, [1e-5 * i / rate for i in k], [10 * rate**i for i in k], solved)


def crowd(count: int) -> Panel:
    """As many runs: methods with many iterates, then peers with one; some unsolved."""
    runs = [decaying(name, 0.2 + 0.12 * i, 5 + 17 * i, solved=i != 1) for i, name in enumerate(METHODS)]
    runs += [Curve(name, name, [None], [1e-4 * (i + 1)], [1e-9 * i], i != 2) for i, name in enumerate(PEERS)]
    return Panel(f"{count} solvers, n = 100", "error", runs[:count])


def paper_panel() -> Panel:
    """The paper's first example by its two methods, as they really run."""
    problem = read(contents.shipped_path("paper-example-1.json"))
    runs = []
    for method in ("shi", "fixed-point"):
        result = run(problem, method, trace=Trace(components=np.array([], int), residuals=False))
        rows = result.trace.rows if result.trace else []
        columns = [row.k for row in rows], [row.seconds for row in rows], [row.error for row in rows]
        runs.append(Curve(method, method, *columns, result.solved))
    return Panel(problem.name, "error", runs)


def profiles(count: int) -> list[Profile]:
    names = (METHODS + PEERS)[:count]
    return [Profile(n, n, [1 + i * j / 3 for j in range(8)] + [math.inf] * i) for i, n in enumerate(names)]


def growth(count: int) -> GrowthPanel:
    n = [10, 100, 1000, 10000]
    growths = []
    for i, name in enumerate((METHODS + PEERS)[:count]):
        times = [1e-6 * v ** (2 + i / 50) for v in n]
        lower, upper = [0.9 * t for t in times], [1.2 * t for t in times]
        growths.append(Growth(name, name, n, times, lower, upper, Power(2 + i / 50, 0.1, 1e-6, 1.0)))
    return GrowthPanel("random", growths)


def odd(name: str, errors: list[float | None]) -> Curve:
    return Curve(name, name, list(range(len(errors))), [float(i) for i in range(len(errors))], errors, False)


def strange() -> Curve:
    return Curve("my $\\solver", "_$\\x\n" + "long " * 60, [0, 1], [0.0, 1.0], [1.0, 0.1], True)


def grid_panel(ps: Sequence[str] = ("1", "100", "1e4"), ks: Sequence[str] = ("1", "5", "100")) -> Panel:
    """A method with a grid of two options, the last run of which fails, and another method."""
    runs = [
        decaying("shi", 0.2 + 0.1 * i + 0.05 * j, 15 + 5 * i + 60 * j, f"shi:p={p},k-star={k}")
        for i, p in enumerate(ps)
        for j, k in enumerate(ks)
    ]
    runs[-1] = replace(runs[-1], solved=False)
    return Panel("grid, n = 2", "error", [decaying("fixed-point", 0.4, 20), *runs])
