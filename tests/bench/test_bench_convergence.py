"""What a bench says of convergence: the times to an error."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import record as records
from lcpcli.bench.record import BenchRecord
from lcpcli.bench.report import render
from lcpcli.files import contents
from lcpcli.report.wording import LEVELS

from ..benchmarks import accuracy

FILES = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]

Lcp = Callable[..., Any]


@pytest.fixture
def record(lcp: Lcp, tmp_path: Path) -> BenchRecord:
    file = str(tmp_path / "r.json")
    assert (
        lcp("bench", *FILES, "--budget", "0", "--method", "fixed-point", "--method", "shi", "-q", "-o", file).code == 0
    )
    return records.read(file)


def test_times_to_an_error_are_those_of_the_first_iterates_with_it(
    record: BenchRecord,
) -> None:
    section = accuracy.reached(record)
    (sheet,) = section.tables
    assert sheet.header == ["problem", "fixed-point", "shi"]
    unit = {"s": 1.0, "ms": 1e-3, "us": 1e-6}[section.title.split()[2]]
    cells = {(row[0], solver): row[1 + j] for row in sheet.groups[0] for j, solver in enumerate(sheet.header[1:])}
    for row in record.measurements:
        size = max(json.loads(Path(contents.shipped_path(row.problem)).read_text())["solution"])
        firsts = {
            level: next(point[:2] for point in row.curve or [] if point[2] is not None and point[2] <= level * size)
            for level in LEVELS
        }
        assert dict(accuracy.firsts_of(row.curve or [], size)) == {level: at for level, (_, at) in firsts.items()}
        _, seconds = firsts[accuracy.LISTED_LEVEL]
        assert float(cells[row.key]) * unit == pytest.approx(seconds, rel=6e-3)


def test_records_with_fields_of_earlier_versions_are_read(record: BenchRecord) -> None:
    text = json.loads(render(record, "json", None, False))
    for row in text["measurements"]:
        row["rate"] = {"measured": 0.5, "bound": 0.6}
    assert records.parse(json.dumps(text)) == record
