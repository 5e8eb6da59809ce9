"""Formatting of numbers in tables: rounded to useful digits, aligned by the width of their column."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

LARGEST_FIXED = 1e6
SMALLEST_FIXED = 1e-3
ELLIPSIS = "..."
PLURALS = {"lower bound": "lower bounds", "upper bound": "upper bounds"}
IN_A_LINE = 12  # most entries of a vector on a line
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"))


def components(values: Iterable[float], largest: float) -> list[str]:
    """Components of z with 7 decimals, as in the paper's tables; with 7 significant digits where those do not suffice.

    largest : the size of the largest component of the solution, which decides for a whole table.
    """
    scientific = 0 < largest < SMALLEST_FIXED or largest >= LARGEST_FIXED
    return [f"{v:.6e}" if scientific or abs(v) >= LARGEST_FIXED else f"{round(v, 7) + 0.0:.7f}" for v in values]


def vector(entries: Sequence[Any], cell: Callable[[Any], str] = "{:.7g}".format) -> str:
    """A vector in a line of text, as far as it fits."""
    more = [ELLIPSIS] if len(entries) > IN_A_LINE else []
    return f"({', '.join([*map(cell, entries[:IN_A_LINE]), *more])})"


def multiplier(value: float) -> str:
    """An entry of a proof: a whole number with all digits, another one rounded and marked by ~."""
    text = f"{value:.0f}" if float(value).is_integer() else f"{value:.7g}"
    return text if float(text) == value else f"~{text}"


def size(problem: Problem) -> str:
    """The number of unknowns, and of a mixed problem how many have which bounds."""
    kinds = problem.box.kinds
    if not kinds:
        return f"n = {problem.n}"
    own = (f"{number} {kind if number == 1 else PLURALS.get(kind, kind)}" for kind, number in kinds.items())
    return f"n = {problem.n} ({', '.join(own)})"


def short(value: float | None, rounding: float = 0.0) -> str:
    """Two significant digits of a residual or an error; 0 if it is only rounding, empty if there is none."""
    if value is None:
        return ""
    return "0" if value <= rounding else f"{value:.1e}"


def above(value: float) -> str:
    """Two significant digits of a bound, rounded up, so that the printed value is a bound too."""
    from decimal import ROUND_CEILING, Context

    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal_from_float(value)
    return short(float(rounded))


def unit(seconds: float) -> tuple[float, str]:
    """The largest unit not exceeding a time rounded to three digits: (its length in seconds, its name)."""
    return next((u for u in UNITS if seconds >= 0.9995 * u[0]), UNITS[-1])


def finite(value: float | None) -> float | None:
    """The value, or None if JSON has no number for it."""
    return value if value is not None and math.isfinite(value) else None


def title(problem: Problem) -> str:
    """The name of a problem, in one line."""
    return " ".join(problem.name.split())


def level(value: float) -> str:
    """A level of error, a power of ten: 1e-6."""
    return f"{value:.0e}".replace("e-0", "e-")


def digits(value: float) -> str:
    """Three significant digits, without an exponent in large numbers."""
    return f"{value:.3g}" if value < 999.5 else f"{value:.0f}"


def duration(seconds: float) -> str:
    """A time with its unit and three significant digits."""
    length, name = unit(seconds)
    return f"{digits(seconds / length)} {name}"
