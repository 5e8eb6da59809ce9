"""The minimum of a linear or quadratic program as text, tables, CSV and JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from itertools import islice, repeat
from operator import add, mul
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np

from lcpcli.clock import seconds
from lcpcli.errors import count
from lcpcli.formulations.quadratic_program.conclusions import (
    conclusion,
    data_of,
    variations,
)
from lcpcli.formulations.quadratic_program.no_minimum import Conclusion
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.formulations.quadratic_program.sensitivity import Sensitivities
from lcpcli.linalg.matrices import absolute_product, product, row_errors
from lcpcli.model.block_form import Blocks
from lcpcli.model.formulation import Answer
from lcpcli.rational.numbers import brief, rounded, shortest_decimal
from lcpcli.report import wording
from lcpcli.report.document import Table
from lcpcli.solving.result import Result
from lcpcli.typing import Vector

MAX_ROWS = 100  # rows, and variables, in the table of a report: a few screens
MAX_ON_SCREEN = 12  # rows, and variables, in a table on the screen
# The keys in JSON.
KEYS = (
    "x",
    "y",
    "bound_multipliers",
    "unique_multipliers",
    "y_down",
    "y_up",
    "bound_multipliers_down",
    "bound_multipliers_up",
    "activities",
    "slacks",
    "objective",
    "statement",
    "proved",
    "exact",
    "ray",
    "certificate",
)
# The columns in CSV.
COLUMNS = ("part", "value", "bound_multiplier", "activity", "slack")
T = TypeVar("T")


def _concluded(read: Callable[[Minimum], T]) -> T:
    """Return a property of a Minimum; for type checkers it is the value."""
    return cast(T, property(read))


@dataclass(frozen=True, eq=False)
class Minimum(Answer):
    """What a result on the conditions says about a program, min or max x'Qx / 2 + c'x +
    constant under its rows and bounds.

    x : the point, shape (k,), or the best iterate if the conditions are not solved;
        None if the conditions are proved to have no solution, as are all the following
        up to the objective.
    y, bound_multipliers : the multipliers of the m rows and of the bounds of the k
        variables, 0 where no bound is active. If the program is convex and they are
        unique, they are the derivatives of the optimal objective with respect to the
        active bounds.
    activities, slacks : the values Ax of the rows, and their distances from the nearer
        of their bounds, negative where a row is violated.
    objective : the value at x, in the sense of the program and with its constant.
    exact : x and y as fractions if they are proved, otherwise None.
    unique_multipliers : whether there are no other multipliers; None if it would take
        too long to find out, rounding errors hide it, or the program is not known to be
        convex.
    y_down, y_up, bound_multipliers_down, bound_multipliers_up : the derivatives of the
        optimal objective as the active bound decreases and as it increases, of the
        shapes of y and bound_multipliers: the same number where multipliers are unique,
        and infinite where no such change is feasible. Equal bounds move together. None
        if it would take too long, rounding errors hide it, or the program is not known
        to be convex.

    These four and `unique_multipliers` are computed when one of them is first read, and
    so are the following:

    statement : what x is, or what the absence of a solution means.
    proved : what is proved, one of the words in PROVED; None if nothing is.
    ray : a direction of shape (k,) in which the objective improves without limit within
        rows and bounds; None if none is proved.
    certificate : multipliers of the rows, shape (m,), positive for lower and negative
        for upper bounds, such that no x within its bounds satisfies this combination of
        the rows; None if none is proved. Ray and certificate are integers if
        `certificate.proof` finds such vectors, and rounded otherwise.
    seconds : how long that took; it is not part of the run's time.
    """

    x: Vector | None
    y: Vector | None
    bound_multipliers: Vector | None
    activities: Vector | None
    slacks: Vector | None
    objective: float | None
    _program: Program = field(repr=False)
    _is_solved: bool = field(repr=False)
    # The s of z = (x, y, s), in fractions if they are proved.
    _sides: Sequence[Any] = field(repr=False)
    _conclude: Callable[[], Conclusion] = field(repr=False)
    _vary: Callable[[], Sensitivities | None] = field(repr=False)
    exact: dict[str, list[Fraction]] | None = None

    @cached_property
    def _conclusion(self) -> tuple[Conclusion, float]:
        began = seconds()
        return self._conclude(), seconds() - began

    @cached_property
    def _variation(self) -> tuple[Sensitivities | None, float]:
        began = seconds()
        return self._vary(), seconds() - began

    statement = _concluded(lambda minimum: minimum._conclusion[0].statement)
    proved = _concluded(lambda minimum: minimum._conclusion[0].proved)
    word = _concluded(lambda minimum: minimum.proved)
    ray = _concluded(lambda minimum: minimum._conclusion[0].ray)
    certificate = _concluded(lambda minimum: minimum._conclusion[0].certificate)
    unique_multipliers = _concluded(lambda minimum: minimum._sensitivity("are_unique"))
    y_down = _concluded(lambda minimum: minimum._sensitivity("down"))
    y_up = _concluded(lambda minimum: minimum._sensitivity("up"))
    bound_multipliers_down = _concluded(
        lambda minimum: minimum._sensitivity("bounds_down")
    )
    bound_multipliers_up = _concluded(lambda minimum: minimum._sensitivity("bounds_up"))
    seconds = _concluded(lambda minimum: minimum._conclusion[1] + minimum._variation[1])

    def _sensitivity(self, name: str) -> Any:
        sensitivities = self._variation[0]
        return None if sensitivities is None else getattr(sensitivities, name)

    @property
    def headline(self) -> str:
        is_known = self._is_solved and self.objective is not None
        return self._objective() if is_known else ""

    def lines(self) -> list[str]:
        return self._lines(not self._is_solved)

    def compared_lines(self) -> list[str]:
        return self._lines(True)

    def _objective(self) -> str:
        return f"objective {wording.plain_number(cast(float, self.objective))}"

    def _lines(self, has_objective: bool) -> list[str]:
        texts = [
            ", ".join(self._point(has_objective)),
            self.statement,
            *reasons(self._program, self.certificate, self.ray),
        ]
        texts += [
            f"exact {key} = {wording.vector(part, brief)}"
            for key, part in (self.exact or {}).items()
            if part
        ]
        return [text for text in texts if text]

    def _point(self, has_objective: bool) -> list[str]:
        """Return x, y and, if `has_objective`, the objective in words, as far as they
        are known.
        """
        if self.x is None or self.y is None:
            return []
        best = "" if self._is_solved else "best "
        parts = [f"{best}x = {wording.named(self.x.tolist(), self._program.columns)}"]
        if self.y.size:
            y = f"y = {wording.named(self.y.tolist(), self._program.rows)}"
            are_several = self.unique_multipliers is False
            parts.append(f"{y}, one of several" if are_several else y)
        if has_objective:
            parts.append(self._objective())
        return parts

    def tables(self, *, whole: bool = True) -> list[Table]:
        """Return a table of the rows, with activities, slacks and multipliers, and of
        the variables, with the multipliers of their bounds, which are their reduced
        costs."""
        if self.x is None or self.y is None or not self.y.size:
            return []
        program = self._program
        x = self.x.tolist()
        y = self.y.tolist()
        largest = MAX_ROWS if whole else MAX_ON_SCREEN
        cell = wording.plain_number
        row_names = wording.short_names(program.rows or [""] * len(y), math.inf, "r")
        names = wording.short_names(program.columns or [""] * len(x), math.inf, "x")
        of_rows = [self.activities, self.slacks, *self._multipliers("y")]
        of_columns = [self.x, *self._multipliers("bound_multipliers")]
        rows = islice(zip(row_names, *of_rows, strict=True), largest)
        columns = islice(zip(names, *of_columns, strict=True), largest)
        groups = [
            [[name, *map(cell, numbers)] for name, *numbers in rows],
            [
                [name, cell(value), "", *map(cell, numbers)]
                for name, value, *numbers in columns
            ],
        ]
        notes = []
        if max(len(x), len(y)) > largest:
            notes.append(
                f"the first {largest} of {count(len(y), 'row')} and of "
                f"{count(len(x), 'variable')}; --format csv has all"
            )
        header = ["", "value", "slack", "multiplier"]
        if len(of_columns) > 2:
            header += ["falls", "rises"]
            extreme = "minimum" if program.sense == "min" else "maximum"
            notes.append(
                "multipliers are not unique: the last columns are the derivatives of "
                f"the {extreme} as a bound falls and as it rises"
            )
        elif self.unique_multipliers is False:
            notes.append("these are one choice of several multipliers")
        return [Table(header, groups, (0,), notes=notes)]

    def _multipliers(self, name: str) -> list[Any]:
        """Return the multipliers of rows or of bounds. Where they are not unique, also
        the derivatives as the bound decreases and as it increases, if they are known.
        """
        arrays = [getattr(self, name)]
        if self.unique_multipliers is False and self.y_down is not None:
            arrays += [getattr(self, f"{name}_down"), getattr(self, f"{name}_up")]
        return arrays

    def cells(self) -> Mapping[str, Sequence[Any]]:
        """Return columns with an entry for each component of z: whether it belongs to
        x, y or s; its value in the sense of the program; for a variable, the multiplier
        of its bounds; for a row, its activity and its slack.
        """
        if self.x is None or self.y is None:
            return dict.fromkeys(COLUMNS, ())
        x, y = self.x.tolist(), self.y.tolist()
        if self.exact:
            x, y = self.exact["x"], self.exact["y"]
        k = len(x)
        m = len(y)
        sides = list(self._sides)

        def only(part: Any, n_before: int, n_behind: int) -> list[Any]:
            """Return the column of values that only some of the components have."""
            return [*repeat("", n_before), *part.tolist(), *repeat("", n_behind)]

        columns = (
            [*repeat("x", k), *repeat("y", m), *repeat("s", len(sides))],
            [*x, *y, *sides],
            only(self.bound_multipliers, 0, m + len(sides)),
            only(self.activities, k, len(sides)),
            only(self.slacks, k, len(sides)),
        )
        return dict(zip(COLUMNS, columns, strict=True))

    def record(self) -> Mapping[str, Any]:
        return {key: getattr(self, key) for key in KEYS}


@dataclass(frozen=True)
class NoOptimum(Answer):
    """Why a program has no optimum; the fields are those of a `Minimum`."""

    program: Program
    statement: str
    proved: str | None = None
    ray: Vector | None = None
    certificate: Vector | None = None

    @classmethod
    def of(cls, program: Program, conclusion: Conclusion) -> NoOptimum:
        return cls(
            program,
            conclusion.statement,
            conclusion.proved,
            conclusion.ray,
            conclusion.certificate,
        )

    def lines(self) -> list[str]:
        return reasons(self.program, self.certificate, self.ray)


def reasons(
    program: Program, certificate: Vector | None, ray: Vector | None
) -> list[str]:
    """Return lines that say why a program has no optimum: the multipliers of
    contradictory rows, and the ray.
    """
    excluded = "excluded within the bounds by its rows times"
    unbounded = "improves without limit in the direction"
    proofs = (
        (excluded, certificate, program.rows),
        (unbounded, ray, program.columns),
    )
    vectors = ((what, v.tolist(), names) for what, v, names in proofs if v is not None)
    return [
        f"{what} {wording.named(v, names, wording.multiplier, sparing=True)}"
        for what, v, names in vectors
    ]


def answer(program: Program, result: Result) -> Minimum:
    """Return what a result says about a program: x, y and the objective, at the best
    iterate if the result is not solved; without a point if it is proved that there is
    no solution.
    """
    # Copies of the result: a reference to `result`, which refers to the answer, would
    # be a cycle that keeps large arrays in memory.
    later = (
        partial(conclusion, result.problem, copy(result), program),
        partial(variations, result.problem, copy(result), program),
    )
    if result.status.has_no_solution:
        nothing = None, None, None, None, None, None
        return Minimum(*nothing, program, False, (), *later)
    sign, data = program.sign, data_of(result.problem, program)
    x, y = program.parts(result.z)
    exact, s = None, result.z[x.size + y.size :].tolist()
    measures = _measured(program, data, x, y, program.parts(result.w)[0])
    if result.exact is not None and result.exact.z is not None:
        exact_x, exact_y = program.parts(result.exact.z)
        exact = {"x": list(exact_x), "y": [int(sign) * value for value in exact_y]}
        if result.exact.z and result.exact.w:
            s = result.exact.z[x.size + y.size :]
            # Beyond the range of doubles x is that of the last run.
            if np.isfinite(rounded(result.exact.z)).all():
                measures = _exact(program, data, result.exact.z, result.exact.w)
    bound_multipliers, activities, slacks, objective = measures
    return Minimum(
        x + 0.0,
        sign * y + 0.0,
        sign * bound_multipliers + 0.0,
        activities + 0.0,
        slacks + 0.0,
        objective + 0.0,
        program,
        result.solved,
        s,
        *later,
        exact,
    )


# The multipliers of the bounds, the activities and slacks of the rows, of a program to
# be minimized, and the objective in the sense of the program and with its constant.
Measures: TypeAlias = tuple[Vector, Vector, Vector, float]


def _measured(
    program: Program, data: Blocks, x: Vector, y: Vector, w: Vector
) -> Measures:
    """Return the measures of x, with slacks within the rounding of their rows as 0. w :
    Qx + c - A'y."""
    sizes = data.gradient_terms(np.abs(x), np.abs(y))
    # A bound is active if x, relative to its largest entry, is closer to it than w,
    # relative to its terms, is to 0; otherwise w is rounding of 0.
    shares = np.abs(w) / np.where(sizes > 0, sizes, 1.0)
    distances = np.where(w > 0, x - data.lower, data.upper - x)
    active = distances <= shares * (np.abs(x).max(initial=0.0) or 1.0)
    activities = product(data.A, x)
    slacks = np.minimum(activities - data.row_lower, data.row_upper - activities)
    terms = absolute_product(data.A, np.abs(x)) + np.abs(activities)
    slacks[np.abs(slacks) <= row_errors(data.A, x, terms)] = 0.0
    objective = program.objective(data, x)
    return np.where(active, w, 0.0), activities, slacks, objective


def _exact(
    program: Program, data: Blocks, z: list[Fraction], w: list[Fraction]
) -> Measures:
    """Return the measures of an exact solution z of the conditions, each rounded once.

    w : of the conditions. As Qx = w - c + A'y for the w of x, the objective is
    (x'w + c'x + y'Ax) / 2.
    """
    k, m = data.c.size, data.row_lower.size
    s = iter(z[k + m :])
    activities, slacks = list[Fraction](), list[Fraction | float]()
    sides = zip(data.row_lower.tolist(), data.row_upper.tolist(), strict=True)
    for (low, high), w_i in zip(sides, w[k : k + m], strict=True):
        if -math.inf < low < high < math.inf:
            activity = next(s) + w_i
        else:
            bound = next(filter(math.isfinite, (low, high)), 0.0)
            activity = shortest_decimal(bound) + w_i
        activities.append(activity)
        slacks.append(
            min(activity - _end(low, activity), _end(high, activity) - activity)
        )
    slopes = map(add, w[:k], map(shortest_decimal, data.c.tolist()))
    doubled = sum(map(mul, z, [*slopes, *activities]))
    constant = shortest_decimal(program.constant)
    exact_objective = int(program.sign) * Fraction(doubled) / 2 + constant
    of_bounds, of_rows, (objective,) = (
        rounded(each) for each in (w[:k], activities, [exact_objective])
    )
    return of_bounds, of_rows, np.array(slacks, float), float(objective)


def _end(side: float, activity: Fraction) -> Fraction | float:
    """Return a row side in the data of an exact solution with this activity, which are
    the decimals, or the doubles themselves."""
    if not math.isfinite(side):
        return side
    return activity if Fraction(side) == activity else shortest_decimal(side)
