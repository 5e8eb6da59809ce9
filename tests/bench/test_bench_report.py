"""What a bench looks like in each format, read back and compared with the record."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from typing import Any

import pytest

from lcpcli.bench import record as records
from lcpcli.bench import report as figure
from lcpcli.bench.record import EXCLUDED, BenchRecord, Measurement
from lcpcli.bench.report import render, sheets
from lcpcli.bench.statistics import growths, shifted_geometric_mean, summary
from lcpcli.bench.suites import case
from lcpcli.report import wording

from .bench_problems import MACHINE, SETTINGS, measurement

SECONDS = {
    ("auto", 100): [0.010, 0.011, 0.012, 0.013, 0.014],
    ("auto", 200): [0.020],
    ("auto", 400): [0.0401, 0.0402, 0.0403],
    ("lemke", 100): [0.5],
    ("lemke", 200): [2.0, 2.1, 1.9],
    ("lemke", 400): [8.0],
}


def row(solver: str, n: int, **changes: Any) -> Measurement:
    plain: dict[str, Any] = {"family": "harker-pang", "seed": 0, "parameters": {"symmetric": False}}
    plain |= {"residual": 1.25e-11, "scaled_residual": 2.5e-12, "iterations": n // 10, "evaluations": n}
    plain |= {"seconds": SECONDS.get((solver, n), [1.0]), "setup_seconds": 0.001}
    plain |= {"curve_of": "residual", "curve": [(0, 0.001, 1.0), (1, 0.01, 1e-11)]}
    return measurement(f"harker-pang {n}", solver, n, **plain | changes)


@pytest.fixture
def record() -> BenchRecord:
    """Three sizes of one family by two methods and two peers, of which one lies once, and one takes nothing."""
    failed = {"status": "time_limit", "statement": "stopped | at_the 5% limit", "claimed": False, "success": False}
    peer = {
        "kind": "peer",
        "status": "solved",
        "claimed": True,
        "iterations": None,
        "curve": None,
        "curve_of": None,
        "setup_seconds": None,
    }
    rows = []
    for n in (100, 200, 400):
        rows += [row("auto", n), row("lemke", n, **(failed if n == 400 else {}))]
        rows.append(row("liar", n, success=n != 200, false_success=n == 200, **peer))
        rows.append(row("picky", n, **peer | {**failed, "status": EXCLUDED, "statement": "no", "seconds": []}))
    cases = [case("harker-pang", n) for n in (100, 200, 400)]
    solvers = ["auto", "lemke"], ["liar", "picky"], ["absent"]
    return BenchRecord(["dense"], cases, *solvers, SETTINGS, MACHINE, {"numpy": "2.0"}, rows)


def markdown_tables(text: str) -> dict[str, list[dict[str, str]]]:
    """The tables of a Markdown text by the headings above them, one dict a row."""
    tables = {}
    for section in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        lines = [line for line in section.splitlines() if line.startswith("|")]
        cells = [[c.strip().replace("\\", "") for c in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
        assert len({len(line) for line in cells}) == 1
        tables[section.splitlines()[0]] = [dict(zip(cells[0], line, strict=True)) for line in cells[2:]]
    return tables


def test_scores_count_failures_as_the_time_limit_and_leave_out_what_is_excluded(record: BenchRecord) -> None:
    found = {line["solver"]: line for line in markdown_tables(render(record, "markdown", None, False))["Solvers"]}
    assert [(s["solved"], s["of"], s["false"], s["fastest"]) for s in found.values()] == [
        ("3", "3", "0", "3"),
        ("2", "3", "0", "0"),
        ("2", "3", "1", "0"),
        ("0", "0", "0", "0"),
    ]
    mean = 1e3 * shifted_geometric_mean([0.5, 2.0, 10.0])
    assert float(found["lemke"]["mean/ms"]) == pytest.approx(mean, rel=5e-3)
    assert found["picky"]["mean/ms"] == ""


def test_peers_are_compared_with_the_first_method_on_the_problems_that_they_take(record: BenchRecord) -> None:
    rows = [row("auto", 800, seconds=[2.0]), row("liar", 800), row("picky", 800, seconds=[4.0], kind="peer")]
    record.measurements += rows
    (sheet,) = [section.tables[0] for section in sheets(record) if section.title.startswith("Beside")]
    means = (shifted_geometric_mean(own) for own in ([1, 10, 1, 1], [0.012, 0.02, 0.0402, 2], [4.0], [2.0]))
    liar, auto, picky, alone = (wording.digits(1e3 * mean) for mean in means)
    assert sheet.header == ["solver", "of", "solved", "by auto", "mean/ms", "auto/ms", "faster"]
    assert sheet.groups == [
        [["liar", "4", "3", "4", liar, auto, "1"], ["picky", "1", "1", "1", picky, alone, "0"]],
    ]


def test_hard_suites_count_what_is_solved_or_proved_to_have_no_solution_within_each_time(record: BenchRecord) -> None:
    assert not [sheet for sheet in sheets(record) if "within" in sheet.title]
    hard = sheets(replace(record, suite=["hard", "dense"]))
    (sheet,) = [section.tables[0] for section in hard if "within" in section.title]
    assert sheet.header[3:] == ["1 ms", "10 ms", "100 ms", "1 s", "10 s"]
    assert sheet.groups == [
        [
            ["harker-pang", "auto", "3", "0", "0", "3", "3", "3"],
            ["", "lemke", "3", "0", "0", "0", "1", "2"],
            ["", "liar", "3", "0", "0", "0", "2", "2"],
        ]
    ]


def test_growth_is_fitted_where_four_sizes_are_solved(record: BenchRecord) -> None:
    (panel,) = growths(record)
    first = panel.growths[0]
    assert list(zip(first.n, first.seconds, strict=True)) == [(100, 0.012), (200, 0.020), (400, 0.0402)]
    assert {growth.fit for growth in panel.growths} == {None}
    rows = [row("auto", 800, seconds=[0.08, 0.081, 0.082]), *(row(name, 800) for name in ("lemke", "liar", "picky"))]
    cases = [*record.cases, case("harker-pang", 800)]
    held = replace(record, cases=cases, measurements=[*record.measurements, *rows])
    (fitted,) = [growth for growth in growths(held)[0].growths if growth.fit]
    assert fitted.label == "auto"
    assert fitted.fit
    assert fitted.fit.exponent == pytest.approx(0.93, abs=0.02)
    report = render(held, "markdown", None, False)
    low, high = fitted.fit.exponent - fitted.fit.margin, fitted.fit.exponent + fitted.fit.margin
    assert f"| auto | 100-800 | {fitted.fit.exponent:.2f} | {low:.2f} to {high:.2f} |" in report


def test_json_is_the_record(record: BenchRecord) -> None:
    text = render(record, "json", None, False)
    assert records.parse(text) == record
    assert json.loads(text)["measurements"][0]["curve"] == [[0, 0.001, 1.0], [1, 0.01, 1e-11]]


def test_csv_has_every_measurement_with_all_digits(record: BenchRecord) -> None:
    lines = render(record, "csv", None, False).splitlines()
    assert lines[0].startswith(f"# tolerance {record.options.tol:g}, accepted to ")
    rows = list(csv.DictReader(line for line in lines if not line.startswith("# ")))
    assert len(rows) == len(record.measurements)
    for read, held in zip(rows, record.measurements, strict=True):
        assert (read["problem"], read["solver"], int(read["n"])) == (held.problem, held.solver, held.n)
        assert json.loads(read["parameters"]) == held.parameters
        assert json.loads(read["success"]) is held.success
        assert read["statement"] == held.statement
        assert float(read["scaled_residual"]) == held.scaled_residual
        assert read["iterations"] == ("" if held.iterations is None else str(held.iterations))
        assert int(read["repeats"]) == len(held.seconds)
        if held.seconds:
            times = summary(held.seconds)
            shown = [float(read[name]) for name in ("median_seconds", "lower_quartile", "upper_quartile")]
            assert shown == [times.median, times.lower, times.upper]


def test_markdown_agrees_with_the_record_to_the_last_digit_shown(record: BenchRecord) -> None:
    tables = markdown_tables(render(record, "markdown", None, False))
    beside = "Beside auto, on the problems that the other takes"
    assert list(tables) == ["Solvers", beside, "Times in ms", "Not solved", "Excluded"]
    held = {r.key: r for r in record.measurements}
    for line in tables["Times in ms"]:
        for solver in ("auto", "lemke"):
            measured = held[line["problem"], solver]
            if measured.success:
                times = summary(measured.seconds)
                assert 1e-3 * float(line[solver].split("±")[0]) == pytest.approx(times.median, rel=5e-3)
                spread = f"±{100 * times.spread:.0f}%" if times.spread is not None else ""
                assert line[solver].endswith(spread)
                assert ("±" in line[solver]) == bool(spread)
    assert [line["lemke"] for line in tables["Times in ms"]][-1] == "failed"
    assert [line["liar"] for line in tables["Times in ms"]][1] == "wrong"
    assert {line["picky"] for line in tables["Times in ms"]} == {"-"}
    assert [(line["solver"], line["how it ended"]) for line in tables["Not solved"]] == [
        ("liar", "wrong: solved"),
        ("lemke", "stopped | at_the 5% limit"),
    ]
    assert tables["Excluded"] == [{"solver": "picky", "problems": "3", "why": "no"}]


def test_latex_has_the_same_cells_in_whole_tables(record: BenchRecord) -> None:
    text = render(record, "latex", None, False)
    built = [section.tables[0] for section in sheets(record)]
    tables = re.findall(r"\\begin\{table\}(.*?)\\end\{table\}", text, flags=re.DOTALL)
    assert len(tables) == len(built)
    for table, sheet in zip(tables, built, strict=True):
        rows = [line for line in table.splitlines() if line.endswith(r" \\")]
        assert len(rows) == 1 + sum(len(group) for group in sheet.groups)
        assert all(len(re.split(r"(?<!\\)&", line)) == len(sheet.header) for line in rows)
        assert [table.count(rule) for rule in (r"\toprule", r"\midrule", r"\bottomrule")] == [1, len(sheet.groups), 1]
    assert not re.search(r"(?<!\\)[%#]|(?<!\\)_", "".join(tables))
    assert r"stopped \textbar{} at\_the 5\% limit" in text
    assert all(line.startswith("%") for line in text.split(r"\begin{table}")[0].splitlines())


@pytest.mark.parametrize("width", [None, 80, 100])
def test_eighty_columns_are_enough(record: BenchRecord, width: int | None) -> None:
    text = render(record, "table", width, False)
    assert max(len(line) for line in text.splitlines()) <= (width or 80)
    assert "not installed: absent" in text
    assert ("\x1b[" in text, "\x1b[" in render(record, "table", width, True)) == (False, True)  # colours


def test_times_of_many_solvers_are_in_parts_that_repeat_the_problems(record: BenchRecord) -> None:
    wide, narrow = ([line.split() for line in render(record, "table", n, False).splitlines()] for n in (120, 40))
    assert next(cells for cells in wide if cells[:1] == ["problem"]) == ["problem", "auto", "lemke", "liar", "picky"]
    heads = [cells for cells in narrow if cells[:2] == ["problem", "auto"] or cells[:2] == ["problem", "picky"]]
    assert heads == [["problem", "auto", "lemke", "liar"], ["problem", "picky"]]
    assert ["harker-pang", "100", "12", "±8%", "500", "1000"] in narrow
    assert ["harker-pang", "100", "-"] in narrow


def test_unfinished_and_empty_records_can_be_shown(record: BenchRecord) -> None:
    record.measurements = record.measurements[:5]
    assert "5 of 12 measured" in render(record, "table", 80, False)
    record.measurements = []
    for form in ("table", "csv", "markdown", "latex", "json", "html"):
        assert render(record, form, None, False)


@pytest.mark.slow("draws a figure in every form")
@pytest.mark.parametrize(("form", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_picture_is_drawn(record: BenchRecord, form: str, begins: bytes) -> None:
    assert figure.draw_figure(record, form).startswith(begins)


def test_peer_is_a_point_in_the_picture_and_nothing_is_drawn_of_what_is_excluded(record: BenchRecord) -> None:
    (panel,) = figure._panels(record)
    assert panel.title == "harker-pang 400"
    curves = {curve.name: curve for curve in panel.curves}
    assert list(curves) == ["auto", "lemke", "liar"]
    assert list(curves["auto"].k) == [0, 1]
    assert (curves["liar"].k, curves["liar"].seconds, curves["liar"].errors) == ((None,), (1.0,), (1.25e-11,))
    assert [curve.solved for curve in panel.curves] == [True, False, True]
