"""The declaration of numeric options, and the options that belong to no method. Only
light modules are imported, as help needs this one.
"""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

from lcpcli.clock import imports
from lcpcli.errors import OptionError, ParameterError, missing, out_of_range, quoted

# After this time an inspection starts no further step by default, so that the user does
# not wait long.
INSPECTION_SECONDS = 2.0
AUTO = "auto"  # the value of an option that is to be derived from the problem
# The environment variable with which all calls of a process use the compiled kernels.
KERNELS = "LCPCLI_KERNELS"
NUMBA = "numba"  # the package that compiles them
MISSING = missing(NUMBA)


class Option(NamedTuple):
    """One numeric option.

    name : as in Python; the command line writes it with dashes.
    kind : int or float.
    default : the value by default; None if it is derived from the problem.
    range : the admissible values, as shown to the user.
    admits : whether a value lies in that range (never called with NaN).
    meaning : one sentence for help.
    words : the words that the option accepts instead of a number, such as "auto".
    derived : the name of the function (problem) -> value in the method's module for a
        default of that kind; else "".
    above : the option of the same method whose value this option must exceed; "" if
        there is none.
    """

    name: str
    kind: type[int] | type[float]
    default: Any
    range: str
    admits: Callable[[float], bool]
    meaning: str
    words: tuple[str, ...] = ()
    derived: str = ""
    above: str = ""

    @property
    def value(self) -> float:
        """Return the default value of an option whose default is a number."""
        assert isinstance(self.default, (int, float))
        return self.default

    @property
    def written_default(self) -> str:
        """Return the default value as help shows it, for an option that has one."""
        if isinstance(self.default, str):
            return self.default
        return f"{self.default:g}" if self.default < math.inf else "no limit"

    @property
    def metavar(self) -> str:
        """Return N or NUMBER for an option that takes numbers, and its words, as in
        NUMBER|AUTO."""
        names = [word.upper() for word in self.words]
        if not isinstance(self.default, str):
            names.insert(0, "N" if self.kind is int else "NUMBER")
        return "|".join(names)

    @property
    def hint(self) -> str:
        return f"it must be: {self.range}"

    def value_of(self, text: str) -> float | str:
        """Return the value of a text: one of the words of the option, or a number,
        which may be out of range.
        """
        if text in self.words:
            return text
        try:
            if "_" in text:
                raise ValueError
            if self.kind is int and text.strip("+- ").isdecimal():
                return int(text)
            number = float(text)
        except ValueError:
            reason = f"{quoted(text.strip())} is not a number"
            raise ParameterError(self.name, reason, self.hint) from None
        is_whole = self.kind is int and number.is_integer()
        return int(number) if is_whole else number

    def check(self, value: float | str) -> None:
        """Raise ParameterError unless the value is of this option's kind and in its
        range."""
        if isinstance(value, str) and value in self.words:
            return
        is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
        try:
            number = float(value) if is_number else math.nan
        except OverflowError:
            raise ParameterError(self.name, "is too large", self.hint) from None
        if not (
            number.is_integer() if self.kind is int else not math.isnan(number)
        ) or not self.admits(number):
            raise ParameterError(self.name, out_of_range(value), self.hint)


def check(options: Iterable[Option], option_values: Mapping[str, Any]) -> None:
    """Check the values of options, by name, each alone and all together. None means
    that the user has set no value.
    """
    declared = {option.name: option for option in options}
    values: dict[str, Any] = {}
    for name, option in declared.items():
        if option_values.get(name) is not None:
            option.check(option_values[name])
        values[name] = (
            option.default if option_values.get(name) is None else option_values[name]
        )
    for name, option in declared.items():
        if option.above and not float(values[option.above]) < float(values[name]):
            hint = f"with {option.above} = {values[option.above]} {option.hint}"
            raise ParameterError(name, out_of_range(values[name]), hint)


NATURAL: tuple[str, Callable[[float], bool]] = (
    "integer >= 0",
    lambda number: number >= 0,
)
POSITIVE: tuple[str, Callable[[float], bool]] = (
    "integer >= 1",
    lambda number: number >= 1,
)


def up_to(max_value: int) -> tuple[str, Callable[[float], bool]]:
    return (
        f"integer from 1 to {max_value}",
        lambda number: 1 <= number <= max_value,
    )


TOL = Option(
    "tol",
    float,
    1e-10,
    "0 < tol < 1",
    lambda tol: 0 < tol < 1,
    "Accepted relative residual.",
)
MAX_ITERATIONS = Option(
    "max_iterations", int, 10_000, *NATURAL, "Stop after this many iterations."
)
TIME_LIMIT = Option(
    "time_limit",
    float,
    math.inf,
    "seconds > 0",
    lambda seconds: seconds > 0,
    "Stop after this many seconds, set-up included.",
)
GAP = Option(
    "gap",
    float,
    math.inf,
    "error > 0",
    lambda error: error > 0,
    "Of a program: accepted error of the objective, relative to its size; other "
    "problems ignore it.",
)
LIMITS = (TOL, MAX_ITERATIONS, TIME_LIMIT, GAP)
MAX_BREAKPOINTS = Option(
    "max_breakpoints",
    int,
    100_000,
    *POSITIVE,
    "Stop after this many breakpoints of the path.",
)
MAX_SOLUTIONS = Option(
    "max_solutions",
    int,
    None,
    *POSITIVE,
    "List at most this many pieces of the solution set; by default all of them.",
)
THREADS = Option(
    "threads",
    int,
    None,
    *up_to(1024),
    "Threads for dense linear algebra; by default one, unless FILE is so large "
    "that more threads save time.",
)
JOBS = Option(
    "jobs",
    int,
    1,
    *POSITIVE,
    "Number of problems solved at the same time, each in a separate process; see "
    "lcp help many.",
)
ACCEPT = Option(
    "accept",
    float,
    1e-6,
    "0 < accept < 1",
    lambda level: 0 < level < 1,
    "A claimed solution counts if its recomputed and scaled residual is at most this.",
)
BUDGET = Option(
    "budget",
    float,
    None,
    "seconds >= 0",
    lambda seconds: 0 <= seconds < math.inf,
    "Repeat a measurement until its median is known or this time is spent; by "
    "default the suite's.",
)
INFINITY = Option(
    "infinity",
    float,
    None,
    "size > 0",
    lambda size: size > 0,
    "Treat bounds of at least SIZE (such as 1e20) as none, on a program's rows "
    "too; by default infinite ones.",
)
EVERY = Option(
    "every",
    int,
    5,
    *POSITIVE,
    "Show every Nth iterate; always the first and the last three; CSV and "
    "--trace have all unless it is set.",
)


@dataclass(frozen=True)
class Limits:
    """The limits of a run: it stops at a relative residual of tol, after
    max_iterations, or after time_limit seconds. A program is solved only if the error
    of its objective, relative to its size, is at most gap.

    Raises OptionError if a limit is out of range.

    >>> Limits(time_limit=60)
    Limits(tol=1e-10, max_iterations=10000, time_limit=60)
    """

    tol: float = TOL.value
    max_iterations: int = int(MAX_ITERATIONS.value)
    time_limit: float = TIME_LIMIT.value
    gap: float = field(default=GAP.value, repr=False)

    @classmethod
    def pop_from(cls, options: dict[str, Any]) -> Limits:
        """Return the limits among some options, which are then without them."""
        values = {
            name: options.pop(name)
            for name in ("tol", "max_iterations", "time_limit", "gap")
            if name in options
        }
        return cls(**values) if values else DEFAULTS

    def __post_init__(self) -> None:
        for option in LIMITS:
            if (value := getattr(self, option.name)) is not option.default:
                option.check(value)


DEFAULTS = Limits()


@cache
def has_numba() -> bool:
    """Return whether numba is installed, without loading it; the search on disk takes
    longer than a small problem."""
    with imports:
        from importlib.util import find_spec

        return find_spec(NUMBA) is not None


@cache
def wants_kernels() -> bool:
    """Return whether the environment requests the compiled kernels, as it does after
    `use_kernels()`; raise OptionError if it has another value than 0 or 1, or there is
    no numba."""
    value = os.environ.get(KERNELS, "")
    if value not in ("", "0", "1"):
        raise OptionError(
            KERNELS,
            f"is {quoted(value)}",
            "set it to 1 for the compiled kernels, or to 0",
        )
    if value == "1" and not has_numba():
        raise OptionError(KERNELS, *MISSING)
    return value == "1"
