"""Statistics of run times, as pure functions.

The performance profile: E. D. Dolan and J. J. Moré, Benchmarking optimization software with performance profiles, Math.
Program. 91 (2002) 201-213. The interval for a median: H. A. David and H. N. Nagaraja, Order Statistics, 3rd ed., Wiley
(2003), section 7.1.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

CONFIDENCE = 0.95
SHIFT = 1e-3  # seconds
RESOLUTION = 1e-9  # seconds; a clock may show 0, which has no ratios and no logarithm
LEAST_SIZES = 4


@dataclass(frozen=True)
class Summary:
    """Median and quartiles of repeated times, in seconds, and their number."""

    median: float
    lower: float
    upper: float
    repeats: int

    @property
    def spread(self) -> float | None:
        """Half the interquartile range, relative to the median; None for a single time."""
        return (self.upper - self.lower) / 2 / max(self.median, RESOLUTION) if self.repeats > 1 else None


@dataclass(frozen=True)
class Fit:
    """seconds = coefficient n^exponent, by least squares on the logarithms.

    margin : of the exponent: the interval exponent +- margin has CONFIDENCE, for independent normal errors in the
        logarithms. r_squared : the fraction of the variance explained by the fit. sizes : the number of different n.
    """

    exponent: float
    coefficient: float
    margin: float
    r_squared: float
    sizes: int


def summary(times: Sequence[float]) -> Summary:
    """Median and quartiles of at least one time; the quartiles are interpolated between the order statistics."""
    if len(times) == 1:
        return Summary(times[0], times[0], times[0], 1)
    lower, median, upper = statistics.quantiles(times, n=4, method="inclusive")
    return Summary(median, lower, upper, len(times))


def median_interval(times: Sequence[float]) -> tuple[float, float]:
    """The narrowest pair of symmetric order statistics that contains the median with CONFIDENCE, for any distribution.

    Fewer than six times never give that confidence: then it is the smallest and the largest time.
    """
    ordered, n = sorted(times), len(times)
    rank, missed = 0, 2.0**-n
    while rank + 1 < n - 1 - rank:
        missed += math.comb(n, rank + 1) * 2.0**-n
        if 1 - 2 * missed < CONFIDENCE:
            break
        rank += 1
    return ordered[rank], ordered[n - 1 - rank]


def shifted_geometric_mean(times: Sequence[float], shift: float = SHIFT) -> float:
    """exp(mean(log(t + shift))) - shift of at least one time, dominated neither by the longest nor by the shortest."""
    return math.exp(math.fsum(math.log(t + shift) for t in times) / len(times)) - shift


def performance_ratios(times: Mapping[str, Mapping[str, float]]) -> dict[str, list[float]]:
    """For each solver, its time on each problem that it accepts, over the shortest time of any solver, in order.

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


def growth(points: Sequence[tuple[int, float]]) -> Fit | None:
    """The growth of times with n, from pairs (n, seconds); None for fewer than LEAST_SIZES different n."""
    sizes = len({n for n, _ in points})
    if sizes < LEAST_SIZES:
        return None
    from scipy.special import stdtrit

    x = [math.log(n) for n, _ in points]
    y = [math.log(max(seconds, RESOLUTION)) for _, seconds in points]
    exponent, intercept = statistics.linear_regression(x, y)
    mean_x, mean_y = statistics.fmean(x), statistics.fmean(y)
    unexplained = math.fsum((b - intercept - exponent * a) ** 2 for a, b in zip(x, y, strict=True))
    total = math.fsum((b - mean_y) ** 2 for b in y)
    error = math.sqrt(unexplained / (len(x) - 2) / math.fsum((a - mean_x) ** 2 for a in x))
    margin = float(stdtrit(len(x) - 2, (1 + CONFIDENCE) / 2)) * error
    return Fit(exponent, math.exp(intercept), margin, 1 - unexplained / total if total > 0 else 1.0, sizes)
