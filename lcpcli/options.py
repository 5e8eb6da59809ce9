"""Every numeric option, written once: its default, its range and its meaning.

The methods' signatures take their defaults from here, the command line its types and help. Nothing heavy is
imported, so that help and completion are instant.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass

from lcpcli.errors import OptionError


def flag(name: str) -> str:
    """An option's name on the command line."""
    return "--" + name.replace("_", "-")


INSPECTION_SECONDS = 2.0  # after which an inspection begins nothing further, unless told otherwise
AUTO = "auto"  # the value of an option that is to be derived from the problem


@dataclass(frozen=True)
class Option:
    """One numeric option.

    name : as in Python; the command line writes it with dashes.
    kind : int or float.
    default : the value when nothing is said; None where it follows from the problem.
    range : the admissible values, as the user reads them.
    admits : whether a value lies in that range (never called with NaN).
    meaning : one sentence for help.
    auto : whether the word "auto" stands for a value derived from the problem.
    """

    name: str
    kind: type[int] | type[float]
    default: float | None
    range: str
    admits: Callable[[float], bool]
    meaning: str
    auto: bool = False

    def check(self, value: float | str) -> None:
        """Raise OptionError unless the value is of this option's kind and in its range."""
        if self.auto and isinstance(value, str) and value == AUTO:
            return
        if not isinstance(value, numbers.Real) or isinstance(value, bool) or not self._admits(value):
            raise OptionError(flag(self.name), f"{value} is out of range", f"it must be: {self.range}")

    def _admits(self, given: numbers.Real) -> bool:
        try:
            value = float(given)
        except OverflowError:
            raise OptionError(flag(self.name), "is too large", f"it must be: {self.range}") from None
        whole = self.kind is not int or (math.isfinite(value) and value == int(value))
        return whole and not math.isnan(value) and self.admits(value)


OPTIONS = {
    option.name: option
    for option in (
        Option(
            "p",
            float,
            None,
            "0 < p < infinity",
            lambda p: 0 < p < math.inf,
            "Smoothing parameter; by default so large that the smoothing error is below rounding.",
        ),
        Option(
            "k_star",
            int,
            100,
            "whole number >= 1",
            lambda k: k >= 1,
            "A steepest-descent step is inserted at every multiple of k*.",
        ),
        Option(
            "rho",
            float,
            1e-4,
            "0 < rho < 1/2",
            lambda rho: 0 < rho < 0.5,
            "Sufficient decrease in the line search.",
        ),
        Option(
            "sigma",
            float,
            0.9,
            "rho < sigma < 1",
            lambda sigma: 0 < sigma < 1,
            "Curvature in the line search.",
        ),
        Option(
            "omega",
            float,
            1.0,
            "0 < omega < infinity, or auto",
            lambda omega: 0 < omega < math.inf,
            "Modulus parameter; 1 is the published method, auto is estimated from the spectrum of M.",
            auto=True,
        ),
        Option(
            "anderson",
            int,
            0,
            "whole number >= 0",
            lambda memory: memory >= 0,
            "Accelerate the iteration by that many earlier steps; 0 is the published method.",
        ),
        Option(
            "tol",
            float,
            1e-10,
            "0 < tol < 1",
            lambda tol: 0 < tol < 1,
            "Solved when the relative residual is at most this.",
        ),
        Option(
            "max_iterations",
            int,
            10_000,
            "whole number >= 0",
            lambda k: k >= 0,
            "Stop after this many iterations.",
        ),
        Option(
            "time_limit",
            float,
            math.inf,
            "seconds > 0",
            lambda seconds: seconds > 0,
            "Stop after this many seconds of set-up and iterations.",
        ),
        Option(
            "warm",
            float,
            None,
            "0 < size < infinity",
            lambda size: 0 < size < math.inf,
            "Run each method once more from a solution disturbed by that much of its largest component.",
        ),
        Option(
            "accept",
            float,
            1e-6,
            "0 < accept < 1",
            lambda level: 0 < level < 1,
            "A claimed solution counts where its residual, recomputed and scaled, is at most this.",
        ),
        Option(
            "budget",
            float,
            None,
            "seconds >= 0",
            lambda seconds: 0 <= seconds < math.inf,
            "Repeat a measurement until its median is known or these are spent; by default as the suite says.",
        ),
        Option(
            "every",
            int,
            5,
            "whole number >= 1",
            lambda k: k >= 1,
            "Show every Nth iterate, besides the first and the last three; all in CSV and --trace unless given.",
        ),
    )
}


def check(**values: float | str | None) -> None:
    """Check values against the options of the same names; None stands for "not given"."""
    for name, value in values.items():
        if value is not None:
            OPTIONS[name].check(value)
    rho, sigma = (float(values.get(name) or OPTIONS[name].default or 0.0) for name in ("rho", "sigma"))
    if not rho < sigma:
        raise OptionError("--sigma", f"{sigma} is out of range", f"with rho = {rho} it must be: rho < sigma < 1")
