"""A verification as human-readable lines or as JSON; imported for help, so nothing heavy is loaded."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from lcpcli.errors import visible
from lcpcli.report.wording import above, folded, short, size, title

if TYPE_CHECKING:
    from lcpcli.verify.verification import Verification


FORMATS = {"table": "human-readable", "json": "one object, for scripts"}
KEYS = (
    "problem n kind exact accepted message residual relative_residual backward_error error error_bound "
    "error_bound_source strategies violated violations statement multipliers"
)


def render(verification: Verification, form: str, width: int | None = None) -> str:
    """Return the verification in one of FORMATS, wrapped to a width if there is one."""
    if form == "json":
        return _json(verification)
    return "".join(part + "\n" for line in _lines(verification) for part in folded(visible(line), width))


def _lines(verification: Verification) -> list[str]:
    name = title(verification.problem)
    lines = [": ".join(filter(None, (name, size(verification.problem)))), verification.message]
    lines += _of_origin(verification)
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
        rows = [("component", "violated", "z", "w")]
        for v in verification.violations:
            component = f"{v.index + 1} {visible(verification.problem.names[v.index])}".rstrip()
            rows.append((component, v.kind, _size(v.z), _size(v.w)))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines += ["  ".join(c.ljust(k) for c, k in zip(row, widths, strict=True)).rstrip() for row in rows]
    if verification.violated > len(verification.violations):
        lines.append(f"... the worst {len(verification.violations)} of {verification.violated}")
    return lines


def _of_origin(verification: Verification) -> list[str]:
    """Return lines with the strategies of a game, or with the x of a program and its multipliers, or with the proof
    that there is no optimum."""
    own, multipliers, origin = verification.strategies, verification.multipliers, verification.problem.origin
    lines = [verification.statement] * bool(verification.statement)
    if own is None and multipliers is None and verification.answer is None:
        return lines
    from lcpcli.report import programs_and_games

    if own is not None:
        return [
            ", ".join(programs_and_games.strategies(origin, own.row.tolist(), own.column.tolist(), own.payoffs, _size)),
            *lines,
        ]
    if multipliers is None:
        return [*lines, *programs_and_games.no_optimum(verification.answer, origin)]
    return [*lines, f"found y = {programs_and_games.named(multipliers.tolist(), getattr(origin, 'rows', ()))}"]


def _size(value: float | Fraction) -> str:
    if isinstance(value, float):
        return f"{value:.7g}"
    from lcpcli.rational.numbers import brief

    return brief(value)


def _json(verification: Verification) -> str:
    from lcpcli.report import json_lines

    own = {
        "problem": verification.problem.name,
        "n": verification.problem.n,
        "error_bound": verification.bound.value if verification.bound else None,
        "error_bound_source": verification.bound.source if verification.bound else None,
        "statement": verification.statement or getattr(verification.answer, "statement", None),
    }
    return json_lines.line(json_lines.record(KEYS, verification, own))
