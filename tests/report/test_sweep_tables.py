"""Tables on request: chosen columns, the summary of a sweep, and what a narrow terminal keeps of it."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-1.json")
SUMMARY = ["method", "to", "1e-3", "UNIT", "to", "1e-6", "UNIT", "to", "1e-9", "UNIT", "end", "UNIT", "error", "status"]

Lcp = Callable[..., Any]


def test_columns_are_those_asked_for_in_that_order(lcp: Lcp) -> None:
    """Table 1 of the paper has k and z alone."""
    out = lcp("compare", EXAMPLE, "--columns", "k,z").out
    assert out.splitlines()[1].split() == ["method", "k", "z1", "z2", "z3", "z4"]
    assert "status" not in out
    rows = [line.split()[-5:] for line in out.splitlines()]
    assert ["15", "0.9985643", "0.0000000", "1.0012907", "0.0000000"] in rows
    assert lcp("compare", EXAMPLE, "--columns", "error,k").out.splitlines()[1].split() == ["method", "error", "k"]
    header = next(line for line in lcp("solve", EXAMPLE, "--columns", "time").out.splitlines() if "method" in line)
    assert re.fullmatch(r"method +time/(us|ms|s)", header)


@pytest.mark.slow("several runs or pictures")
def test_sweep_shows_its_summary_and_iterates_on_request(lcp: Lcp) -> None:
    sweep = ("compare", EXAMPLE, "--method", "shi", "--sweep", "p=10,1e4", "--sweep", "k-star=5,100")
    title, header, _, *rows, star, _, _ = lcp(*sweep).out.split("\nthe median")[0].splitlines()[:10]
    assert title.startswith("paper-example-1")
    assert re.sub(r" (us|ms|s)\b", " UNIT", header).split() == ["method", "p", "k-star", *SUMMARY[1:]]
    assert [row.split()[:3] for row in rows] == [["shi", p, k] for p in ("10", "1e4") for k in ("5", "100")]
    assert star.endswith("; * the shortest time")
    assert sum("*" in row for row in rows) >= 1
    for asked in (("--every", "10"), ("--trace",), ("--columns", "k,error")):
        assert len(lcp(*sweep, *asked).out.splitlines()) > 20


def test_narrow_terminal_drops_levels_and_splits_no_row_of_the_summary(
    lcp: Lcp, terminal: Callable[[int, bool], None]
) -> None:
    for width, levels in ((100, 3), (74, 2), (60, 1)):
        terminal(width, False)
        lines = lcp("compare", EXAMPLE).out.splitlines()
        header = next(line for line in lines if line.endswith("status"))
        assert header.startswith("method")
        assert header.count(" to ") == levels


def test_csv_of_a_sweep_has_a_row_a_run_with_options_and_costs(lcp: Lcp) -> None:
    sweep = ("compare", EXAMPLE, "--sweep", "p=1,1e4")
    lines = [line for line in lcp(*sweep, "--format", "csv").out.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert [(row["method"], row["p"], row["omega"]) for row in rows] == [
        ("fixed-point", "", "1"),
        ("shi:p=1", "1", ""),
        ("shi:p=1e4", "10000", ""),
    ]
    records = [json.loads(line) for line in lcp(*sweep, "--format", "json").out.splitlines()]
    for row, record in zip(rows, records, strict=True):
        assert row["status"] == record["status"]
        assert int(row["iterations"]) == record["iterations"]
        assert float(row["error"]) == record["error"]
        reached = {each["level"]: each["k"] for each in record["milestones"]}
        assert row["iterations_to_1e-6"] == str(reached.get(1e-6, ""))


def test_every_makes_json_and_csv_of_the_iterates(lcp: Lcp) -> None:
    run = ("solve", EXAMPLE, "--method", "fixed-point", "--every", "10")
    shown = [row["k"] for row in json.loads(lcp(*run, "--format", "json").out)["trace"]]
    assert shown == [0, 1, 10, 20, 30, 40, 44, 45, 46]
    lines = [line for line in lcp(*run, "--format", "csv").out.splitlines() if not line.startswith("#")]
    assert [int(row["k"]) for row in csv.DictReader(lines)] == shown


def test_columns_that_nobody_shows_are_refused(lcp: Lcp) -> None:
    for arguments in (("--columns", "k,tme"), ("--columns", "k", "--format", "json"), ("--columns", "k", "-q")):
        outcome = lcp("solve", EXAMPLE, *arguments)
        assert outcome.code == 2
        assert outcome.err.startswith("lcp: --columns: ")
