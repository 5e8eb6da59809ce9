"""What a bench says of convergence: who reaches which error first, and at what rate fixed-point converges."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import accuracy_tables
from lcpcli.bench import record as records
from lcpcli.bench.record import BenchRecord
from lcpcli.files import contents
from lcpcli.report.wording import LEVELS

FILES = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]
FAST = ("--budget", "0")

Lcp = Callable[..., Any]


@pytest.fixture
def record(lcp: Lcp, tmp_path: Path) -> BenchRecord:
    file = str(tmp_path / "r.json")
    assert lcp("bench", *FILES, *FAST, "--method", "fixed-point", "--method", "shi", "-q", "-o", file).code == 0
    return records.read(file)


def test_milestones_are_the_first_of_the_curve(record: BenchRecord) -> None:
    for row in record.measurements:
        assert row.milestones is not None
        assert row.curve is not None
        assert [level for level, _, _ in row.milestones] == list(LEVELS)
        for level, k, seconds in row.milestones:
            first = next(point for point in row.curve if point[2] is not None and point[2] <= level * size(row.problem))
            assert (k, seconds) == first[:2]


def size(problem: str) -> float:
    return max(json.loads(Path(contents.shipped_path(problem)).read_text())["solution"])


def test_times_to_an_error_are_those_of_the_milestones(record: BenchRecord) -> None:
    section = accuracy_tables.reached(record)
    (sheet,) = section.tables
    assert sheet.header == ["problem", "fixed-point", "shi"]
    unit = {"s": 1.0, "ms": 1e-3, "us": 1e-6}[section.title.split()[2]]
    for problem, *cells in sheet.groups[0]:
        for solver, cell in zip(("fixed-point", "shi"), cells, strict=True):
            row = next(row for row in record.measurements if row.key == (problem, solver))
            seconds = next(at for level, _, at in row.milestones or [] if level == accuracy_tables.LISTED_LEVEL)
            assert float(cell) * unit == pytest.approx(seconds, rel=6e-3)


def test_victories_are_counted_at_each_level(record: BenchRecord) -> None:
    for i, row in enumerate(record.measurements):
        own = 1.0 if row.solver == "shi" else 2.0
        held = [(level, k, own) for level, k, _ in row.milestones or []]
        object.__setattr__(record.measurements[i], "milestones", held[: 3 if row.solver == "shi" else 2])
    (sheet,) = accuracy_tables.firsts(record).tables
    assert sheet.header == ["solver", "to 1e-3", "to 1e-6", "to 1e-9"]
    assert sheet.groups == [[["fixed-point", "0", "0", "0"], ["shi", "2", "2", "2"]]]
    for i, row in enumerate(record.measurements):
        if row.solver == "shi":
            object.__setattr__(record.measurements[i], "milestones", [])
    assert accuracy_tables.firsts(record).tables[0].groups == [[["fixed-point", "2", "2", "0"], ["shi", "0", "0", "0"]]]


def test_rate_of_fixed_point_is_shown_beside_its_theory(record: BenchRecord) -> None:
    (rows,) = accuracy_tables.rates(record).tables[0].groups
    assert [row[0] for row in rows] == ["paper-example-1.json", "paper-example-2.json"]
    for row in rows:
        measured, local, bound = map(float, row[2:])
        assert measured == pytest.approx(local, abs=0.002)
        assert measured <= bound


def test_record_of_rates_and_milestones_reads_back(record: BenchRecord) -> None:
    again = records.parse(records.to_json(record))
    assert again == record
    assert [row.rate is not None for row in again.measurements] == [True, False, True, False]


@pytest.mark.parametrize("form", ["markdown", "latex", "table"])
def test_every_format_shows_them(form: str, lcp: Lcp) -> None:
    out = lcp("bench", *FILES, *FAST, "--method", "fixed-point", "--method", "shi", "--format", form).out
    assert re.search(r"Time in ms to an error of (1e-6|\$10\^\{-6\}\$)", out)
    assert "How often first to reach an error, on 2 problems" in out
    assert "Linear convergence of fixed-point" in out
