"""The record of a bench, and its JSON: the request, the environment, and every finished measurement."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, cast, get_args, get_origin, get_type_hints

from lcpcli.bench.suites import Case
from lcpcli.errors import OptionError

EXCLUDED = "excluded"
GONE = {"rate", "milestones", "condition", "forward_error"}  # fields of records of earlier versions


@dataclass(frozen=True)
class Settings:
    """The options of a bench, as on the command line."""

    tol: float
    time_limit: float
    accept: float
    budget: float


@dataclass(frozen=True)
class Machine:
    """Processor, number of cores, memory in bytes and system; None for a fact that the system does not report.

    threads : the number of threads for dense linear algebra; None if the BLAS decides.
    """

    processor: str
    cores: int | None
    memory: int | None
    system: str
    threads: int | None


@dataclass(frozen=True)
class Measurement:
    """The measurement of one solver on one case.

    problem : the name of the case. family, seed : None for a problem in a file. n : the number of unknowns.
    solver, kind : the solver's name, and "method" or "peer".
    status, statement : how the run ended, in a word and a sentence; EXCLUDED if the peer does not accept the case.
    claimed : whether a z, or that there is none, is claimed. success, false_success : as in `Checker.check`.
    residual, scaled_residual, error : recomputed; None if there is no z, or if they are not finite.
    seconds : the time of each repeat, set-up included; empty if excluded. setup_seconds : for the run with the curve.
    curve : (k, seconds, error) of the iterates; curve_of is "error" or "residual", whichever the curve shows.
    optimality : for a program, as in `timing.optimality`, empty without an answer; None for other problems.
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
    optimality: dict[str, float] | None = None
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

    suite : the suites and files requested. missing : peers requested but not installed. unread : what is wrong with
    files that were left out.
    versions : of Python, of this program, of its numerical libraries, and of the peers.
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
        """Return the unfinished cases, each with the solvers still to run."""
        done = {measurement.key for measurement in self.measurements}
        left = [(case, [s for s in self.solvers if (case.name, s) not in done]) for case in self.cases]
        return [(case, solvers) for case, solvers in left if solvers]


def read(path: str) -> BenchRecord:
    """Read the record in a file; raise OptionError if the file holds none."""
    try:
        return parse(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise OptionError(path, "no such file", "name a file written by lcp bench -o") from None
    except OSError as error:
        raise OptionError(path, f"cannot be read ({error.strerror})", "make it readable") from None
    except (ValueError, RecursionError, OverflowError) as fault:
        place = f" ({fault})" if type(fault) is ValueError else ""
        raise OptionError(
            path, f"is not a record of a bench{place}", "name a .json file written by lcp bench -o"
        ) from None


def parse(text: str) -> BenchRecord:
    """Return the record in JSON; raise ValueError, RecursionError or OverflowError for any other text."""
    record: BenchRecord = _decode("it", json.loads(text), BenchRecord)
    expected = {(case.name, solver) for case in record.cases for solver in record.solvers}
    for row in record.measurements:
        if row.key not in expected:
            raise ValueError(f"{row.problem}, {row.solver}: it was not requested, or occurs twice")
        expected.remove(row.key)
        if row.n < 1 or any(seconds < 0 for seconds in row.seconds) or (not row.excluded and not row.seconds):
            raise ValueError(f"{row.problem}, {row.solver}: n or seconds are inconsistent")
    return record


def _decode(name: str, value: Any, kind: Any) -> Any:
    """Convert a value of JSON to the type `kind`; fields that an older record lacks get their defaults. Raise
    ValueError for a value of another type."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return _decode(name, value, type(value) if type(value) in parts else parts[0])
    if origin is list and isinstance(value, list):
        return [_decode(name, each, parts[0]) for each in value]
    if origin is tuple and isinstance(value, list) and len(value) == len(parts):
        return tuple(_decode(name, each, part) for each, part in zip(value, parts, strict=True))
    if origin is dict and isinstance(value, dict):
        return {key: _decode(name, each, parts[1]) for key, each in value.items()}
    if is_dataclass(kind) and isinstance(value, dict):
        hints, make = get_type_hints(kind), cast(Any, kind)
        try:
            return make(**{key: _decode(key, each, hints[key]) for key, each in value.items() if key not in GONE})
        except (KeyError, TypeError):
            raise ValueError("its fields do not fit a record") from None
    fits = type(value) is kind or (kind is float and type(value) is int)
    if fits and (kind is not float or math.isfinite(value)):
        return value
    raise ValueError(f"{name} has the wrong type")
