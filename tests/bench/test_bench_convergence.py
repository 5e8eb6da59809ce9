"""What a bench says of convergence: who reaches which error first, and at what rate fixed-point converges."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import accuracy_tables
from lcpcli.bench import record as records
from lcpcli.bench.record import BenchRecord
from lcpcli.bench.report import render
from lcpcli.files import contents
from lcpcli.report.wording import LEVELS

FILES = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]

Lcp = Callable[..., Any]


@pytest.fixture
def record(lcp: Lcp, tmp_path: Path) -> BenchRecord:
    file = str(tmp_path / "r.json")
    assert (
        lcp("bench", *FILES, "--budget", "0", "--method", "fixed-point", "--method", "shi", "-q", "-o", file).code == 0
    )
    return records.read(file)


def test_milestones_are_the_first_of_the_curve_and_times_to_an_error_those_of_the_milestones(
    record: BenchRecord,
) -> None:
    section = accuracy_tables.reached(record)
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
        assert {level: (k, seconds) for level, k, seconds in row.milestones or []} == firsts
        _, seconds = firsts[accuracy_tables.LISTED_LEVEL]
        assert float(cells[row.key]) * unit == pytest.approx(seconds, rel=6e-3)


def test_victories_are_counted_at_each_level(record: BenchRecord) -> None:
    def held(shi: int) -> BenchRecord:
        """With so many milestones of shi, the faster, and two of fixed-point."""
        most = {"shi": (shi, 1.0), "fixed-point": (2, 2.0)}
        rows = [
            replace(row, milestones=[(level, k, own) for level, k, _ in (row.milestones or [])[:number]])
            for row in record.measurements
            for number, own in [most[row.solver]]
        ]
        return replace(record, measurements=rows)

    (sheet,) = accuracy_tables.firsts(held(shi=3)).tables
    assert sheet.header == ["solver", "to 1e-3", "to 1e-6", "to 1e-9"]
    assert sheet.groups == [[["fixed-point", "0", "0", "0"], ["shi", "2", "2", "2"]]]
    (sheet,) = accuracy_tables.firsts(held(shi=0)).tables
    assert sheet.groups == [[["fixed-point", "2", "2", "0"], ["shi", "0", "0", "0"]]]


def test_rate_of_fixed_point_is_shown_beside_its_theory_and_read_back(record: BenchRecord) -> None:
    (rows,) = accuracy_tables.rates(record).tables[0].groups
    assert [row[0] for row in rows] == ["paper-example-1.json", "paper-example-2.json"]
    for row in rows:
        measured, local, bound = map(float, row[2:])
        assert measured == pytest.approx(local, abs=0.002)
        assert measured <= bound
    again = records.parse(records.to_json(record))
    assert again == record
    assert [row.rate is not None for row in again.measurements] == [True, False, True, False]
    for form in ("markdown", "latex", "table"):
        out = render(record, form, None, False)
        assert re.search(r"Time in (ms|us) to an error of (1e-6|\$10\^\{-6\}\$)", out)
        assert "How often first to reach an error, on 2 problems" in out
        assert "Linear convergence of fixed-point" in out
