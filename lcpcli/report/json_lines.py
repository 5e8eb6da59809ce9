"""Results as JSON, one object per line. All keys are always present: null for missing and infinite values."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

from lcpcli.errors import visible_json
from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.methods.registry import declared
from lcpcli.options import DEFAULTS
from lcpcli.report import wording
from lcpcli.version import VERSION

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace
    from lcpcli.verify.certificate import Certificate

# The keys of a result in their order; `lcp help json` has their meanings.
KEYS = (
    "version file item problem n names method package label route status message advice solved verified z w basis "
    "iterations evaluations residual relative_residual negligible_q error digits error_bound error_bound_source "
    "reference milestones setup_seconds solve_seconds verify_seconds seconds conclusion_seconds spread "
    "certificate exact "
    f"answer others exactly_solvable {' '.join(vars(DEFAULTS))} options trace"
)
# Of a program's answer
MINIMUM = "x y bound_multipliers activities slacks objective statement proved exact ray certificate"


def line(record: Mapping[str, Any]) -> str:
    """Return an object of plain values in a line."""
    return text(record) + "\n"


def text(value: Any) -> str:
    """Return a plain value in JSON."""
    return visible_json(json.dumps(value, allow_nan=False, ensure_ascii=False))


def without_result(source: Source, status: str, message: str) -> dict[str, Any]:
    """Return the object for a problem that could not be read, or whose result was lost, with its mark in a log."""
    own = {"status": status, "message": message, "solved": False}
    return dict.fromkeys(KEYS.split()) | place(source) | own | dict(source.mark or {})


def data(result: Result, source: Source = NO_SOURCE) -> dict[str, Any]:
    """Return a result as the object of its line, with the mark of its problem in a log."""
    problem, bound, exact, curve, trace = result.problem, result.bound, result.exact, result.curve, result.trace
    vectors = {name: getattr(exact, name, None) for name in ("z", "w", "y")}
    how_read = problem.note if (source.file or "").casefold().endswith(".nl") else ""  # others' notes are of authors
    own = {
        **place(source, problem),
        "package": declared(result.method).package,
        "label": wording.name(result),
        "status": result.status.word,
        "message": "; ".join(filter(None, [result.message, how_read])),
        "advice": wording.advice(result) or None,
        "basis": result.basis if result.solved or problem.bounds else None,
        "error_bound": bound.value if bound else None,
        "error_bound_source": bound.source if bound and bound.proved else None,
        "reference": problem.reference if problem.solutions else None,
        "milestones": curve.milestones if curve and curve.levels else None,
        "certificate": _certificate(result.certificate),
        "exact": exact and {"status": exact.status and exact.status.word, **vectors, "proof": exact.proof},
        "answer": _answer(result),
        "conclusion_seconds": getattr(result.answer, "seconds", None),
        **vars(result.limits),
        "options": {name: value for name, value in result.options.items() if name not in wording.VECTORS},
        "trace": _rows(trace) if trace else None,
    }
    return record(KEYS, result, own) | dict(source.mark or {})


def record(keys: str, thing: object, own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the keys, in their order: those in `own`, and the attributes of the object for other
    keys."""
    values = {key: own[key] if key in own else getattr(thing, key) for key in keys.split()}
    return {key: plain(value) for key, value in values.items()}


def place(source: Source, problem: Problem | None = None) -> dict[str, Any]:
    """Return the version, the place of a problem, and, if it could be read, its name, its size and its unknowns'
    names."""
    own = {"version": VERSION, "file": source.file, "item": source.item}
    if problem is None:
        return own
    return own | {"problem": problem.name, "n": problem.n, "names": list(problem.names) if any(problem.names) else None}


def plain(value: Any, exact: bool = True) -> Any:
    """Return a value for JSON: an object for a dataclass, None for a number that is not finite, and for a fraction a
    text, or unless `exact` a double."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, (list, tuple)):
        return list(value) if {*map(type, value)} <= {str, int} else [plain(entry, exact) for entry in value]
    if isinstance(value, dict):
        return {key: plain(entry, exact) for key, entry in value.items()}
    if hasattr(value, "tolist"):
        is_finite = value.dtype == float and bool(abs(value).max(initial=0.0) < math.inf)
        return value.tolist() if is_finite or value.dtype.kind in "bi" else plain(value.tolist(), exact)
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name), exact) for field in fields(value)}
    from lcpcli.rational.numbers import rounded, text

    return text(value) if exact else plain(rounded([value]).tolist()[0])


def numbers(values: Any, exact: bool) -> Any:
    """Return fractions for JSON and CSV, as texts or as doubles, None for a number beyond double precision."""
    from lcpcli.rational.numbers import rounded

    return None if values is None else plain(values if exact else rounded(values))


def _certificate(certificate: Certificate | None) -> dict[str, Any] | None:
    """Return a certificate, with its vector in fractions if doubles are only near the proof."""
    if certificate is None:
        return None
    found: dict[str, Any] = plain(certificate)
    exact = found.pop("exact")
    return found | {"vector": exact or found["vector"]}


def _rows(trace: Trace) -> list[dict[str, Any]]:
    from lcpcli.report import columns

    return [{"k": row.k, "z": row.z, **columns.values(row), "method": row.method} for row in trace.rows]


def _answer(result: Result) -> dict[str, Any] | None:
    """Return the answer for the program or game of a result, with its kind and names; None without an origin."""
    if result.answer is None or result.problem.origin is None:
        return None
    origin, answer = result.problem.origin.data(), result.answer
    return {
        "kind": origin["kind"],
        **(record(MINIMUM, answer, {}) if hasattr(answer, "x") else plain(answer)),
        "rows": origin.get("rows"),
        "columns": origin.get("columns"),
    }
