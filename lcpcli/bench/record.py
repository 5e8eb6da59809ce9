"""The record of a bench, and its JSON: the request, the environment, and all
measurements; and its statistics.

The performance profile: E. D. Dolan and J. J. Moré, Benchmarking optimization software
with performance profiles, Math. Program. 91 (2002) 201-213. The interval for a median:
H. A. David and H. N. Nagaraja, Order Statistics (2003), 7.1.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from itertools import starmap
from types import UnionType
from typing import Any, NamedTuple, cast, get_args, get_origin, get_type_hints

from lcpcli.bench.suites import Case
from lcpcli.errors import OptionError
from lcpcli.files.contents import content_of, decode, source_name, within
from lcpcli.report import wording

EXCLUDED = "excluded"
EXPECTED = "name a .json file written by lcp bench -o"
OPENING = '{"problem":'  # of a measurement


@dataclass(frozen=True)
class Settings:
    tol: float
    time_limit: float
    accept: float
    budget: float


@dataclass(frozen=True)
class Machine:
    """Processor, cores, memory in bytes, system, and the threads of the BLAS; None for
    what is not known."""

    processor: str
    cores: int | None
    memory: int | None
    system: str
    threads: int | None


@dataclass(frozen=True)
class Measurement:
    """The measurement of one solver on one case.

    problem : the name of the case. family, seed : None for a problem in a file. n : the
        number of unknowns.
    solver, kind : the solver's name, and "method" or "peer".
    status, statement : how the run ended, in a word and a sentence; EXCLUDED if the
        peer does not accept the case.
    claimed : whether a z, or that there is none, is claimed. success, false_success :
        as in `timing.checked`.
    residual, scaled_residual, error : recomputed; None if there is no z, or if they are
        not finite.
    seconds : the time of each repeat, set-up included; empty if excluded. setup_seconds
        : for the run with the curve.
    curve : (k, seconds, error) of the iterates; curve_of is "error" or "residual",
        whichever the curve shows.
    """

    problem: str
    family: str | None
    n: int
    seed: int | None
    parameters: dict[str, bool | int | float | str]
    solver: str
    kind: str
    status: str
    statement: str
    claimed: bool
    success: bool
    false_success: bool
    residual: float | None = None
    scaled_residual: float | None = None
    error: float | None = None
    iterations: int | None = None
    evaluations: int | None = None
    seconds: list[float] = field(default_factory=list)
    setup_seconds: float | None = None
    curve_of: str | None = None
    curve: list[tuple[int, float, float | None]] | None = None

    @property
    def key(self) -> tuple[str, str]:
        return self.problem, self.solver

    @property
    def excluded(self) -> bool:
        return self.status == EXCLUDED


@dataclass
class BenchRecord:
    """The record of a bench; `measurements` grows in the order of cases and solvers.

    suite : the suites and files requested. missing : peers requested but not installed.
    unread : what is wrong with files that were left out. versions : of Python, of this
    program, of its numerical libraries, and of the peers.
    """

    suite: list[str]
    cases: list[Case]
    methods: list[str]
    peers: list[str]
    missing: list[str]
    options: Settings
    machine: Machine
    versions: dict[str, str | None]
    measurements: list[Measurement] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)

    @property
    def solvers(self) -> list[str]:
        return [*self.methods, *self.peers]

    def pending(self) -> list[tuple[Case, list[str]]]:
        done = {measurement.key for measurement in self.measurements}
        unmeasured = [
            (case, [s for s in self.solvers if (case.name, s) not in done])
            for case in self.cases
        ]
        return [(case, solvers) for case, solvers in unmeasured if solvers]


def read(path: str) -> BenchRecord:
    """Read the record in a file; raise an LCPError if the file holds none."""
    text = within(source_name(path), decode, content_of(path, EXPECTED))
    try:
        return parse(text)
    except (ValueError, RecursionError, OverflowError) as error:
        where = f" ({error})" if type(error) is ValueError else ""
        raise OptionError(
            source_name(path), f"is not a record of a bench{where}", EXPECTED
        ) from None


def parse(text: str) -> BenchRecord:
    """Return the record in JSON, with the measurements in the lines below it, which a
    bench that was killed has added; raise ValueError, RecursionError or OverflowError
    for any other text."""
    begin = len(text) - len(text.lstrip())
    data, end = json.JSONDecoder().raw_decode(text, begin)
    record: BenchRecord = _decode("it", data, BenchRecord)
    record.measurements += _added(text[end:], text.count("\n", 0, end) + 1)
    expected = {
        (case.name, solver) for case in record.cases for solver in record.solvers
    }
    for row in record.measurements:
        if row.key not in expected:
            raise ValueError(
                f"{row.problem}, {row.solver}: it was not requested, or occurs twice"
            )
        expected.remove(row.key)
        if (
            row.n < 1
            or any(seconds < 0 for seconds in row.seconds)
            or (not row.excluded and not row.seconds)
        ):
            raise ValueError(
                f"{row.problem}, {row.solver}: n or seconds are inconsistent"
            )
    return record


def _added(text: str, first: int) -> Iterator[Measurement]:
    """Yield the measurements in the lines of a text, whose numbers in the file begin
    with `first`; a last line that was cut off counts as not written."""
    lines = text.split("\n")
    last = first + len(lines) - 1
    for at, line in enumerate(lines, first):
        if line.strip():
            try:
                yield _decode("it", json.loads(line), Measurement)
            except ValueError as error:
                is_begun = at == last and line.startswith(OPENING[: len(line)])
                if is_begun and isinstance(error, json.JSONDecodeError):
                    return
                raise ValueError(f"line {at} is not a measurement") from None


def _decode(name: str, value: Any, kind: Any) -> Any:
    """Convert a value of JSON to the type `kind`; fields that an older record lacks get
    their defaults. Raise ValueError for a value of another type."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return _decode(name, value, type(value) if type(value) in parts else parts[0])
    if origin is list and isinstance(value, list):
        return [_decode(name, each, parts[0]) for each in value]
    if origin is tuple and isinstance(value, list) and len(value) == len(parts):
        return tuple(
            _decode(name, each, part) for each, part in zip(value, parts, strict=True)
        )
    if origin is dict and isinstance(value, dict):
        return {key: _decode(name, each, parts[1]) for key, each in value.items()}
    if is_dataclass(kind) and isinstance(value, dict):
        hints, make = get_type_hints(kind), cast(Any, kind)
        try:
            return make(
                **{key: _decode(key, each, hints[key]) for key, each in value.items()}
            )
        except (KeyError, TypeError):
            raise ValueError("its fields do not fit a record") from None
    fits = type(value) is kind or (kind is float and type(value) is int)
    if fits and (kind is not float or math.isfinite(value)):
        return value
    raise ValueError(f"{name} has the wrong type")


CONFIDENCE = 0.95  # the customary level of confidence intervals
SHIFT = 1e-3  # seconds, so that times of microseconds do not dominate a geometric mean
RESOLUTION = 1e-9  # seconds; a clock may show 0, which has no ratios


class Summary(NamedTuple):
    median: float
    lower: float
    upper: float
    repeats: int

    @property
    def spread(self) -> float | None:
        return (
            (self.upper - self.lower) / 2 / max(self.median, RESOLUTION)
            if self.repeats > 1
            else None
        )


def summary(times: Sequence[float]) -> Summary:
    """Return the median and the quartiles of at least one time, interpolating between
    the order statistics."""
    if len(times) == 1:
        return Summary(times[0], times[0], times[0], 1)
    lower, median, upper = statistics.quantiles(times, n=4, method="inclusive")
    return Summary(median, lower, upper, len(times))


def median_interval(times: Sequence[float]) -> tuple[float, float]:
    """Return the narrowest pair of symmetric order statistics that contains the median
    with CONFIDENCE, for any distribution; the smallest and the largest of fewer than
    six times, which never attain it."""
    ordered, n = sorted(times), len(times)
    rank, tail = 0, 2.0**-n
    while rank + 1 < n - 1 - rank:
        tail += math.comb(n, rank + 1) * 2.0**-n
        if 1 - 2 * tail < CONFIDENCE:
            break
        rank += 1
    return ordered[rank], ordered[n - 1 - rank]


def shifted_geometric_mean(times: Sequence[float]) -> float:
    """Return exp(mean(log(t + SHIFT))) - SHIFT for at least one time; no very long or
    short time dominates it."""
    return math.exp(math.fsum(math.log(t + SHIFT) for t in times) / len(times)) - SHIFT


def mean_cells(
    times: Mapping[Any, Sequence[float]], limit: float
) -> tuple[dict[Any, str], str]:
    """Return the shifted geometric means of times as cells, "" for no times, and their
    unit; a failure is counted as `limit`."""
    charged = {
        key: [min(seconds, limit) for seconds in seconds_of_key]
        for key, seconds_of_key in times.items()
    }
    means = {
        key: shifted_geometric_mean(seconds_of_key)
        for key, seconds_of_key in charged.items()
        if seconds_of_key
    }
    length, unit = wording.common_unit(means.values())
    return {
        key: wording.digits(means[key] / length) if key in means else ""
        for key in times
    }, unit


def performance_ratios(
    times: Mapping[str, Mapping[str, float]],
) -> dict[str, list[float]]:
    """Return, in order, each solver's times on the problems that it accepts, each
    divided by the fastest solver's time.

    times : by solver, then by problem; infinity if it failed, no entry if it does not
        accept the problem. The performance profile of a solver at tau is the fraction
        of its ratios that are at most tau.
    """
    problems = {
        problem for times_of_solver in times.values() for problem in times_of_solver
    }
    best = {
        problem: min(
            times_of_solver[problem]
            for times_of_solver in times.values()
            if problem in times_of_solver
        )
        for problem in problems
    }

    def ratio(problem: str, seconds: float) -> float:
        return (
            max(seconds, RESOLUTION) / max(best[problem], RESOLUTION)
            if seconds < math.inf
            else math.inf
        )

    return {
        solver: sorted(starmap(ratio, times_of_solver.items()))
        for solver, times_of_solver in times.items()
    }


def times(record: BenchRecord) -> dict[str, dict[str, float]]:
    """Return the median seconds of each solver on each problem that it accepts;
    infinity if it failed."""
    medians: dict[str, dict[str, float]] = {solver: {} for solver in record.solvers}
    for row in record.measurements:
        if not row.excluded:
            medians[row.solver][row.problem] = (
                summary(row.seconds).median if row.success else math.inf
            )
    return medians
