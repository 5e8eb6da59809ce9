"""Records of the iterates of a run: rows for tables and curves, milestones, and
progress reports."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from lcpcli.errors import ParameterError, likely, quoted
from lcpcli.methods.quantities import X
from lcpcli.methods.registry import ALL, METHODS, QUANTITIES
from lcpcli.model import views
from lcpcli.typing import Indices, Vector
from lcpcli.verify.point import Criterion

if TYPE_CHECKING:
    from lcpcli.methods.stages import Iterate

# Numbers in the iterates that are measured together, so that M is read once for all: 16
# megabytes.
MEASURED_NUMBERS = 1 << 21
MAX_TOGETHER = 64  # iterates that are measured together


class Quantities(Mapping[str, Any]):
    """The quantities of an iterate that its method declares, by name, each computed
    when it is read. values : has them as attributes, or returns what has them."""

    def __init__(self, method: str, values: object) -> None:
        self._names = [
            quantity.name
            for quantity in (METHODS[method].quantities if method in METHODS else ())
            if quantity is not X
        ]
        self._values = values

    @np.errstate(all="ignore")
    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError(name)
        if callable(self._values):
            self._values = self._values()
        return getattr(self._values, name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return repr(dict(self))


@dataclass(frozen=True, eq=False)
class TraceRow:
    """One iterate in a trace.

    k : its number; the start is 0.
    z : its z = |x| + x, shape (n,), or the components that the trace keeps.
    residual, error : as in Result; None if not requested, or if no solution is known.
    rounding : whether the residual is at the level of rounding errors (see
        `measure.Measure.is_rounding`).
    seconds : the time from the start of the run to this iterate, without recording and
        measuring for the trace.
    step : the step of the published algorithm that produced it; "" if the method has
        only one kind of step.
    method : the method that produced it.
    z0 : the value of the artificial variable of Lemke's method; None for other methods.
    x : its x = (z - w) / 2, shape (n,), which z does not determine where z_i = 0; None
        if the trace does not keep it.
    quantities : the quantities of the method's step, by name, that the trace has among
        its columns, numbers, texts or arrays of shape (n,); None for one that is not
        defined in this step. In a callback, all that the method has.

    >>> import lcpcli
    >>> rows: list[lcpcli.TraceRow] = []
    >>> result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6], callback=rows.append)
    >>> rows[-1].k, rows[-1].z.round(6).tolist(), rows[-1].method
    (1, [1.333333, 2.333333], 'newton')
    """

    k: int
    z: Vector
    residual: float | None
    error: float | None
    seconds: float
    step: str
    method: str
    rounding: bool = False
    x: Vector | None = None
    z0: float | None = None
    quantities: Mapping[str, Any] = field(default_factory=dict)


def row_of(
    iterate: Iterate, method: str, k: int, z: Vector, seconds: float, asks: bool
) -> TraceRow:
    """Return the row of an iterate, not yet measured. method : the method that runs;
    another one may have made the iterate. asks : whether its quantities may be read."""
    method = iterate.method or method
    return TraceRow(
        k,
        z,
        None,
        None,
        seconds,
        iterate.step,
        method,
        x=iterate.x,
        z0=iterate.z0,
        quantities=Quantities(method, iterate.quantities) if asks else {},
    )


class LateRow(TraceRow):
    """A row whose residual and quantities are computed when they are first read, as
    callbacks rarely need them."""

    _criterion_and_z: tuple[Criterion, Vector]

    @classmethod
    def of(cls, row: TraceRow, criterion: Criterion) -> LateRow:
        """Return a row with a copy of z, which the callback may change."""
        late = cls.__new__(cls)
        copied_values = {
            name: value
            for name, value in vars(row).items()
            if name not in ("residual", "rounding")
        }
        error = criterion.problem.error(row.z)
        late.__dict__.update(
            copied_values,
            z=row.z.copy(),
            error=error,
            x=None,
            _criterion_and_z=(criterion, row.z),
        )
        return late

    @cached_property
    def _measures(self) -> tuple[float, bool]:
        criterion, z = self._criterion_and_z
        (residual,), (rounding,) = criterion.residuals(z[np.newaxis])
        return residual, rounding

    residual = cast("float | None", property(lambda row: row._measures[0]))
    rounding = cast(bool, property(lambda row: row._measures[1]))

    def __reduce__(self) -> tuple[Any, ...]:
        return TraceRow, tuple(getattr(self, field.name) for field in fields(TraceRow))

    def __repr__(self) -> str:
        return repr(copy(self))


Callback: TypeAlias = Callable[[TraceRow], object]
"""What is called after each iteration; a true value, or StopIteration, stops the
run."""


@dataclass(frozen=True)
class Milestone:
    """The first iterate with an error of at most `level` times the largest component of
    the solution."""

    level: float
    k: int
    seconds: float


@dataclass(repr=False)
class Trace:
    """Which iterates to keep, and which of their data. The run fills it with rows, in
    order.

    every : keep the start, the first iterate, every `every`-th iterate and the last
        three.
    most : the largest number of rows, at least 5; `every` is doubled when there would
        be more. None sets no limit.
    components : indices of the components of z to keep; None keeps them all.
    residuals : whether to compute each row's residual; each costs one product with M.
    levels : errors in decreasing order, relative to the solution's largest component;
        the first iterate to reach each becomes a milestone.
    keeps_x : whether to keep the x of each row, with all of its components.
    columns : "x", and names of quantities of methods' steps, which `lcp help METHOD`
        lists, or "all": what each row has besides. It is computed for the rows that
        are recorded; x and other vectors have the components of z.
    rows, milestones : what has been recorded.

    >>> import lcpcli
    >>> problem, trace = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]), lcpcli.Trace()
    >>> result = lcpcli.run(problem, "fixed-point", trace=trace)
    >>> trace.rows[0].k, trace.rows[0].z.tolist(), trace.rows[-1].k == result.iterations
    (0, [0.0, 0.0], True)
    >>> trace = lcpcli.Trace(columns=("x", "F", "factor"))
    >>> result = lcpcli.run(problem, "fixed-point", trace=trace)
    >>> round(trace.rows[-1].quantities["factor"], 3), trace.rows[0].x.tolist()
    (0.5, [0.0, 0.0])
    """

    every: int = 1
    most: int | None = None
    components: Indices | None = None
    residuals: bool = True
    levels: tuple[float, ...] = ()
    keeps_x: bool = False
    columns: Sequence[str] = field(default=(), kw_only=True)
    rows: list[TraceRow] = field(default_factory=list)
    milestones: list[Milestone] = field(default_factory=list)
    _last: list[TraceRow] = field(default_factory=list)
    _unmeasured: list[TraceRow] = field(default_factory=list)

    def __post_init__(self) -> None:
        if isinstance(self.columns, str):
            self.columns = (self.columns,)
        valid_names = [*QUANTITIES, ALL]
        for name in self.columns:
            if name not in valid_names:
                raise ParameterError(
                    "columns",
                    f"{quoted(str(name))} is unknown",
                    likely(name, valid_names),
                )

    def __repr__(self) -> str:
        return str(views.outcome.trace_text(self))

    def complete_start(self, first: Iterate) -> None:
        """Add its quantities to the row of the start, which the method reports with its
        first iterate."""
        if first.quantities is None or not self._last or self._last[0].k:
            return
        values = getattr(first.quantities(), "of_start", None)
        start_quantities = Quantities(self._last[0].method, values)
        self._last[0] = replace(self._last[0], quantities=start_quantities)

    def add(self, row: TraceRow, criterion: Criterion) -> None:
        """Add an iterate with its whole z, not yet measured; the one that is no longer
        among the last three is dropped, or kept to be measured."""
        pending = self.levels[len(self.milestones) :]
        if pending and (error := criterion.problem.error(row.z)) is not None:
            reached = (
                level
                for level in pending
                if error <= level * criterion.problem.size_of_solutions
            )
            self.milestones += [
                Milestone(level, row.k, row.seconds) for level in reached
            ]
        self._last.append(row)
        if len(self._last) > 3:
            leaving = self._last.pop(0)
            if self._is_kept(leaving.k):
                self._unmeasured.append(leaving)
        if (
            self.most is not None
            and len(self.rows) + len(self._unmeasured) + 3 > self.most
        ):
            self.every *= 2
            self.rows = [
                measured for measured in self.rows if self._is_kept(measured.k)
            ]
            self._unmeasured = [
                pending_row
                for pending_row in self._unmeasured
                if self._is_kept(pending_row.k)
            ]
        if len(self._unmeasured) >= max(
            1, min(MAX_TOGETHER, MEASURED_NUMBERS // max(1, row.z.size))
        ):
            self._measure(criterion)

    def close(self, criterion: Criterion) -> None:
        """Keep the last three iterates, as the run has ended."""
        self._unmeasured += self._last
        self._last.clear()
        if self._unmeasured:
            self._measure(criterion)

    def selected(
        self, every: int, most: int | None, components: Indices | None
    ) -> Trace:
        """Return a trace with those rows and components that a trace with these
        settings would have recorded of the run."""
        rows, last = self.rows[:-3], self.rows[-3:]
        chosen = Trace(
            every,
            most,
            components,
            self.residuals,
            self.levels,
            self.keeps_x,
            columns=self.columns,
            milestones=self.milestones,
        )
        while (
            most is not None
            and sum(map(chosen._is_kept, (row.k for row in rows))) + len(last) > most
        ):
            chosen.every *= 2
        kept_rows = [*(row for row in rows if chosen._is_kept(row.k)), *last]
        chosen.rows = [
            replace(row, z=chosen._part(row.z), **chosen._asked_of(row))
            for row in kept_rows
        ]
        return chosen

    def timed(self, times: Mapping[int, float]) -> Trace:
        """Return the trace with these seconds of each recorded iterate, by its k."""
        rows = [replace(row, seconds=times[row.k]) for row in self.rows]
        milestones = [replace(each, seconds=times[each.k]) for each in self.milestones]
        return replace(self, rows=rows, milestones=milestones)

    def _part(self, vector: Vector) -> Vector:
        """Return the components of a vector that are recorded."""
        return vector if self.components is None else vector[self.components]

    def _asked_of(self, row: TraceRow) -> dict[str, Any]:
        """Return the x and the quantities that the trace keeps of a row."""
        if not self.columns:
            return {"x": row.x if self.keeps_x else None, "quantities": {}}
        x, method = row.x, METHODS.get(row.method)
        if not self.keeps_x:
            asks = X.name in self.columns or ALL in self.columns
            has_x = x is not None and (method is None or X in method.quantities)
            x = self._part(x) if x is not None and asks and has_x else None
        names = row.quantities if ALL in self.columns else self.columns
        values = {name: row.quantities.get(name) for name in names if name != X.name}
        for name, value in values.items():
            if QUANTITIES[name].is_vector and value is not None:
                values[name] = self._part(value)
        return {"x": x, "quantities": values}

    def _is_kept(self, k: int) -> bool:
        return k <= 1 or k % self.every == 0

    @np.errstate(all="ignore")
    def _measure(self, criterion: Criterion) -> None:
        """Measure the waiting rows as requested, and keep them."""
        unmeasured, self._unmeasured = self._unmeasured, []
        residuals: Sequence[float | None] = [None] * len(unmeasured)
        rounding = [False] * len(unmeasured)
        if self.residuals:
            residuals, rounding = criterion.residuals(
                np.array([row.z for row in unmeasured])
            )
        for row, residual, is_rounding in zip(
            unmeasured, residuals, rounding, strict=True
        ):
            self.rows.append(
                replace(
                    row,
                    z=self._part(row.z),
                    residual=residual,
                    error=criterion.problem.error(row.z),
                    rounding=is_rounding,
                    **self._asked_of(row),
                )
            )


def least_times(runs: Sequence[Sequence[Trace | None]]) -> dict[int, float]:
    """Return the seconds to each recorded iterate, by its k, where each step takes the
    least of its times in repetitions of a run.

    runs : the traces of each repetition. The result is empty if there are no rows, or
        if the repetitions recorded different iterates.
    """
    times: list[dict[int, float]] = []
    for traces in runs:
        seconds_to = dict[int, float]()
        for trace in filter(None, traces):
            seconds_to |= {row.k: row.seconds for row in trace.rows}
            seconds_to |= {each.k: each.seconds for each in trace.milestones}
        times.append(seconds_to)
    numbers = sorted(times[0])
    if not numbers or any(each.keys() != times[0].keys() for each in times):
        return {}
    seconds = np.array([[each[k] for k in numbers] for each in times])
    steps = np.diff(seconds, axis=1, prepend=0.0)
    least = np.maximum(steps.min(axis=0), 0.0).cumsum()
    return dict(zip(numbers, least.tolist(), strict=True))
