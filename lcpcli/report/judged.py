"""A judgement as a few lines for people, or as JSON. Pure functions; help loads this, so nothing heavy is imported."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from lcpcli.report.numbers import above, finite, short, title

if TYPE_CHECKING:
    from lcpcli.verify.verification import Judgement, Violation

FORMATS = {"table": "for people", "json": "one object, for scripts"}


def render(judgement: Judgement, form: str) -> str:
    """The judgement in one of FORMATS."""
    return _json(judgement) if form == "json" else _lines(judgement)


def _lines(judgement: Judgement) -> str:
    name = title(judgement.problem)
    lines = [f"{name}: n = {judgement.problem.n}", judgement.message]
    measures = {
        "residual": judgement.residual,
        "relative residual": judgement.relative_residual,
        "componentwise backward error": judgement.backward_error,
        "error": judgement.error,
    }
    lines += [f"{measure:<30}{short(value)}" for measure, value in measures.items() if value is not None]
    if judgement.bound:
        lines.append(f"{'proved bound of the error':<30}{above(judgement.bound.value)} ({judgement.bound.source})")
    if judgement.violations:
        rows = [["component", "violated", "z", "w"], *map(_cells, judgement.violations)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines += ["  ".join(c.ljust(k) for c, k in zip(row, widths, strict=True)).rstrip() for row in rows]
    if judgement.violated > len(judgement.violations):
        lines.append(f"... the worst {len(judgement.violations)} of {judgement.violated}")
    return "".join(line + "\n" for line in lines)


def _cells(violation: Violation[float] | Violation[Fraction]) -> list[str]:
    return [f"{violation.index + 1}", violation.kind, _size(violation.z), _size(violation.w)]


def _size(value: float | Fraction) -> str:
    if isinstance(value, float):
        return f"{value:.7g}"
    from lcpcli.rational.numbers import brief

    return brief(value)


def _json(judgement: Judgement) -> str:
    """Keys never vanish: null where there is nothing, and in place of infinities. Exact numbers are texts."""
    record = {
        "problem": judgement.problem.name,
        "n": judgement.problem.n,
        "kind": judgement.kind,
        "exact": judgement.exact,
        "accepted": judgement.accepted,
        "message": judgement.message,
        "residual": _number(judgement.residual),
        "relative_residual": _number(judgement.relative_residual),
        "backward_error": _number(judgement.backward_error),
        "error": _number(judgement.error),
        "error_bound": _number(judgement.bound.value) if judgement.bound else None,
        "error_bound_source": judgement.bound.source if judgement.bound else None,
        "violated": judgement.violated,
        "violations": [
            {"index": v.index, "kind": v.kind, "z": _number(v.z), "w": _number(v.w)} for v in judgement.violations
        ],
    }
    return json.dumps(record, allow_nan=False, ensure_ascii=False) + "\n"


def _number(value: float | Fraction | None) -> Any:
    if isinstance(value, Fraction):
        from lcpcli.rational.numbers import text

        return text(value)
    return finite(value)
