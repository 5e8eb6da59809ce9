"""Statistics of run times, as pure functions, and the statistics of a bench for its tables and its figure.

The performance profile: E. D. Dolan and J. J. Moré, Benchmarking optimization software with performance profiles, Math.
Program. 91 (2002) 201-213. The interval for a median: H. A. David and H. N. Nagaraja, Order Statistics, 3rd ed., Wiley
(2003), section 7.1.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lcpcli.bench.record import BenchRecord, Measurement
from lcpcli.bench.suites import series
from lcpcli.report.figures.data import Growth, GrowthPanel, Power

CONFIDENCE = 0.95  # the customary level of confidence intervals
SHIFT = 1e-3  # seconds, so that times of microseconds do not dominate a geometric mean
RESOLUTION = 1e-9  # seconds; a clock may show 0, which has no ratios and no logarithm
LEAST_SIZES = 4  # sizes n for a fit of two parameters, so that two degrees of freedom remain for its interval


@dataclass(frozen=True)
class Summary:
    """Median and quartiles of repeated times, in seconds, and their number."""

    median: float
    lower: float
    upper: float
    repeats: int

    @property
    def spread(self) -> float | None:
        """Return half the interquartile range, relative to the median; None for a single time."""
        return (self.upper - self.lower) / 2 / max(self.median, RESOLUTION) if self.repeats > 1 else None


def summary(times: Sequence[float]) -> Summary:
    """Return the median and the quartiles of at least one time, interpolating between the order statistics."""
    if len(times) == 1:
        return Summary(times[0], times[0], times[0], 1)
    lower, median, upper = statistics.quantiles(times, n=4, method="inclusive")
    return Summary(median, lower, upper, len(times))


def median_interval(times: Sequence[float]) -> tuple[float, float]:
    """Return the narrowest pair of symmetric order statistics that contains the median with CONFIDENCE.

    The confidence holds for any distribution. Fewer than six times never attain it; then the pair is the smallest and
    the largest time.
    """
    ordered, n = sorted(times), len(times)
    rank, tail = 0, 2.0**-n
    while rank + 1 < n - 1 - rank:
        tail += math.comb(n, rank + 1) * 2.0**-n
        if 1 - 2 * tail < CONFIDENCE:
            break
        rank += 1
    return ordered[rank], ordered[n - 1 - rank]


def shifted_geometric_mean(times: Sequence[float], shift: float = SHIFT) -> float:
    """Return exp(mean(log(t + shift))) - shift for at least one time; no very long or short time dominates it."""
    return math.exp(math.fsum(math.log(t + shift) for t in times) / len(times)) - shift


def performance_ratios(times: Mapping[str, Mapping[str, float]]) -> dict[str, list[float]]:
    """Return, in order, each solver's times on the problems that it accepts, each divided by the fastest solver's time.

    times : by solver, then by problem; infinity if it failed, no entry if it does not accept the problem. The
        performance profile of a solver at tau is the fraction of its ratios that are at most tau.
    """
    best: dict[str, float] = {}
    for own in times.values():
        for problem, seconds in own.items():
            best[problem] = min(best.get(problem, math.inf), max(seconds, RESOLUTION))
    return {
        solver: sorted(
            max(seconds, RESOLUTION) / best[problem] if seconds < math.inf else math.inf
            for problem, seconds in own.items()
        )
        for solver, own in times.items()
    }


def growth(points: Sequence[tuple[int, float]]) -> Power | None:
    """Fit the growth of times with n to pairs (n, seconds); return None for fewer than LEAST_SIZES different n."""
    if len({n for n, _ in points}) < LEAST_SIZES:
        return None
    from scipy.stats import linregress, t

    logarithms = [math.log(max(seconds, RESOLUTION)) for _, seconds in points]
    line = linregress([math.log(n) for n, _ in points], logarithms)
    margin = line.stderr * t.ppf((1 + CONFIDENCE) / 2, len(points) - 2)
    return Power(float(line.slope), float(margin), math.exp(line.intercept), float(line.rvalue**2))


def times(record: BenchRecord) -> dict[str, dict[str, float]]:
    """Return the median seconds of each solver on each problem that it accepts; infinity if it failed."""
    medians: dict[str, dict[str, float]] = {solver: {} for solver in record.solvers}
    for row in record.measurements:
        if not row.excluded:
            medians[row.solver][row.problem] = summary(row.seconds).median if row.success else math.inf
    return medians


def growths(record: BenchRecord) -> list[GrowthPanel]:
    """Return the growth of the time of each solver on each series in which it solved two sizes or more."""
    solved: dict[str, dict[str, list[Measurement]]] = {}
    for row in record.measurements:
        if row.family and row.success:
            solved.setdefault(series(row.family, row.parameters), {}).setdefault(row.solver, []).append(row)
    panels = []
    for name, by_solver in solved.items():
        found = []
        for solver in record.solvers:
            rows = sorted(by_solver.get(solver, []), key=lambda row: row.n)
            n, own = [row.n for row in rows], [summary(row.seconds) for row in rows]
            if len(set(n)) > 1:
                medians, lower, upper = ([getattr(each, key) for each in own] for key in ("median", "lower", "upper"))
                fit = growth(list(zip(n, medians, strict=True)))
                found.append(Growth(method_of(solver), solver, n, medians, lower, upper, fit))
        panels += [GrowthPanel(name, found)] * bool(found)
    return panels


def method_of(solver: str) -> str:
    """Return the method of a solver, which decides how the solver is drawn: shi for shi:p=10."""
    return solver.partition(":")[0]
