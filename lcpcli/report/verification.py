"""A verification as human-readable lines or as JSON. Pure functions; imported for help, so nothing heavy is loaded."""

from __future__ import annotations

import json
from dataclasses import fields
from fractions import Fraction
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from lcpcli.report.numbers import above, finite, short, size, title

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.verify.equilibrium import Strategies
    from lcpcli.verify.verification import Verification, Violation

FORMATS = {"table": "human-readable", "json": "one object, for scripts"}


def render(verification: Verification, form: str, width: int | None = None) -> str:
    """The verification in one of FORMATS, wrapped to a width if there is one."""
    return _json(verification) if form == "json" else _lines(verification, width)


def _lines(verification: Verification, width: int | None) -> str:
    name = title(verification.problem)
    lines = [": ".join(filter(None, (name, size(verification.problem)))), verification.message]
    if own := verification.strategies:
        from lcpcli.report import answers

        told = own.row.tolist(), own.column.tolist(), own.payoffs
        lines.append(", ".join(answers.strategies(verification.problem.origin, *told, _size)))
    lines += _of_program(verification)
    measures = {
        "residual": verification.residual,
        "relative residual": verification.relative_residual,
        "componentwise backward error": verification.backward_error,
        "error": verification.error,
    }
    lines += [f"{measure:<30}{short(value)}" for measure, value in measures.items() if value is not None]
    if bound := verification.bound:
        lines.append(f"{'proved bound on the error':<30}{above(bound.value)} ({bound.source})")
    if verification.violations:
        rows = [
            ["component", "violated", "z", "w"],
            *(_cells(v, verification.problem) for v in verification.violations),
        ]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines += ["  ".join(c.ljust(k) for c, k in zip(row, widths, strict=True)).rstrip() for row in rows]
    if verification.violated > len(verification.violations):
        lines.append(f"... the worst {len(verification.violations)} of {verification.violated}")
    return "".join(part + "\n" for line in lines for part in _folded(line, width))


def _of_program(verification: Verification) -> list[str]:
    """What x is, and the multipliers that were found for it; or what proves that there is none."""
    told = [verification.statement] * bool(verification.statement)
    if verification.multipliers is None and verification.answer is None:
        return told
    from lcpcli.report.answers import named, no_optimum

    if verification.multipliers is None:
        return [*told, *no_optimum(verification.answer, verification.problem.origin)]
    rows = getattr(verification.problem.origin, "rows", ())
    return [*told, f"found y = {named(verification.multipliers.tolist(), rows)}"]


def _folded(line: str, width: int | None) -> list[str]:
    return [line] if width is None or len(line) <= width else wrap(line, width, subsequent_indent="  ")


def _cells(violation: Violation[float] | Violation[Fraction], problem: Problem) -> list[str]:
    name = problem.names[violation.index]
    return [f"{violation.index + 1}{f' {name}' * bool(name)}", violation.kind, _size(violation.z), _size(violation.w)]


def _size(value: float | Fraction) -> str:
    if isinstance(value, float):
        return f"{value:.7g}"
    from lcpcli.rational.numbers import brief

    return brief(value)


def _json(verification: Verification) -> str:
    """All keys are always present: null for missing and infinite values. Exact numbers are strings."""
    record = {
        "problem": verification.problem.name,
        "n": verification.problem.n,
        "kind": verification.kind,
        "exact": verification.exact,
        "accepted": verification.accepted,
        "message": verification.message,
        "residual": _number(verification.residual),
        "relative_residual": _number(verification.relative_residual),
        "backward_error": _number(verification.backward_error),
        "error": _number(verification.error),
        "error_bound": _number(verification.bound.value) if verification.bound else None,
        "error_bound_source": verification.bound.source if verification.bound else None,
        "strategies": _strategies(verification.strategies),
        "violated": verification.violated,
        "violations": [
            {"index": v.index, "kind": v.kind, "z": _number(v.z), "w": _number(v.w)} for v in verification.violations
        ],
        "statement": verification.statement or getattr(verification.answer, "statement", None),
        "multipliers": None if verification.multipliers is None else verification.multipliers.tolist(),
    }
    return json.dumps(record, allow_nan=False, ensure_ascii=False) + "\n"


def _strategies(own: Strategies | None) -> dict[str, list[Any]] | None:
    """The strategies that were verified of a game, by the names of their parts."""
    parts = None if own is None else {field.name: getattr(own, field.name) for field in fields(own)}
    return parts and {name: [_number(value) for value in values] for name, values in parts.items()}


def _number(value: float | Fraction | None) -> Any:
    if isinstance(value, Fraction):
        from lcpcli.rational.numbers import text

        return text(value)
    return finite(value)
