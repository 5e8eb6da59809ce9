"""Verifications in each of the formats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.result_formats import Report, keys_of, record, source_record
from lcpcli.report.wording import above, number, short, size, title
from lcpcli.verify.verification import Verification


def verification_report(
    verifications: Sequence[Verification], source: Source = NO_SOURCE
) -> Report:
    """Return the report on the verifications of one problem from a source."""
    name = title(verifications[0].problem) or "verification"
    return Report(
        lambda *_: Document(name, list(map(_section, verifications))),
        lambda: (_record(verification, source) for verification in verifications),
    )


def _section(verification: Verification) -> Section:
    problem, strategies = verification.problem, verification.strategies
    measures = {
        "residual": verification.residual,
        "relative residual": verification.relative_residual,
        "componentwise backward error": verification.backward_error,
        "error": verification.error,
    }
    rows = [
        [measure, short(value), ""]
        for measure, value in measures.items()
        if value is not None and value < math.inf  # beyond a bound, as the message says
    ]
    if bound := verification.bound:
        rows.append(["proved bound on the error", above(bound.value), bound.source])
    violations = [
        [
            f"{v.index + 1} {problem.names[v.index]}".rstrip(),
            v.kind,
            number(v.z),
            number(v.w),
        ]
        for v in verification.violations
    ]
    left_out = list[str]()
    if verification.violated > len(violations):
        left_out = [f"the worst {len(violations)} of {verification.violated}"]
    return Section(
        ": ".join(filter(None, (title(problem), size(problem)))),
        verification.message,
        verification.accepted,
        _of_origin(verification),
        [
            *([] if strategies is None else strategies.tables()),
            Table(["", "", ""], [rows], words=(0, 2), texts=(2,)),
            Table(
                ["component", "violated", "z", "w"],
                [violations],
                words=(0, 1),
                notes=left_out,
            ),
        ],
    )


def _of_origin(verification: Verification) -> list[str]:
    """Return lines with strategies, or with another answer of the formulation."""
    strategies, answer = verification.strategies, verification.answer
    lines = [verification.statement] * bool(verification.statement)
    if strategies is not None:
        return [*strategies.lines(), *lines]
    return [*lines, *([] if answer is None else answer.lines())]


def _record(verification: Verification, source: Source) -> dict[str, Any]:
    overrides = {
        **source_record(source, verification.problem),
        "error_bound": verification.bound.value if verification.bound else None,
        "error_bound_source": verification.bound.source if verification.bound else None,
        "statement": _statement(verification),
    }
    return record(keys_of("check"), verification, overrides)


def _statement(verification: Verification) -> str | None:
    if verification.statement or verification.answer is None:
        return verification.statement or None
    return verification.answer.statement or None
