"""A bench as CSV: comments on how it was measured, a header, then one line per measurement with all digits."""

from __future__ import annotations

import csv
import json
from io import StringIO
from typing import Any

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report.sheets import conditions
from lcpcli.bench.statistics import summary

COPIED = (
    "problem",
    "family",
    "n",
    "seed",
    "parameters",
    "solver",
    "kind",
    "status",
    "statement",
    "claimed",
    "success",
    "false_success",
    "residual",
    "scaled_residual",
    "error",
    "condition",
    "forward_error",
    "optimality",
    "iterations",
    "evaluations",
    "setup_seconds",
)
COMPUTED = ("median_seconds", "lower_quartile", "upper_quartile", "repeats")


def render(record: Record) -> str:
    """Parameters are JSON, booleans as in JSON, missing values empty; only the record has the curves."""
    out = StringIO()
    out.writelines(f"# {line}\n" for line in conditions(record))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*COPIED, *COMPUTED])
    for row in record.measurements:
        writer.writerow([*(_cell(getattr(row, name)) for name in COPIED), *_times(row)])
    return out.getvalue()


def _times(row: Measurement) -> list[str]:
    if not row.seconds:
        return [""] * (len(COMPUTED) - 1) + ["0"]
    times = summary(row.seconds)
    return [repr(times.median), repr(times.lower), repr(times.upper), str(times.repeats)]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
