"""Variants of methods and sweeps: what is compared is what was asked for, under a name that says in what it differs."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import record as records
from lcpcli.files import contents
from lcpcli.methods.variants import Variant, labels, parse, sweep

EXAMPLE = contents.shipped_path("paper-example-1.json")

Lcp = Callable[..., Any]


def compared(lcp: Lcp, *arguments: str) -> list[dict[str, Any]]:
    outcome = lcp("compare", EXAMPLE, *arguments, "--format", "json")
    assert outcome.err == ""
    return [json.loads(line) for line in outcome.out.splitlines()]


def test_variant_is_written_as_it_is_read_and_its_options_are_numbers_of_their_kind() -> None:
    for text in ("shi", "shi:p=10", "shi:p=1e4,k-star=5,rho=0.1,sigma=0.5", "fixed-point:omega=auto,scale"):
        assert str(parse(text)) == text
    assert parse("shi: p = 1e4, k_star = 5").options == {"p": 1e4, "k_star": 5}
    assert isinstance(parse("shi:k-star=5").options["k_star"], int)
    own = {"omega": "auto", "scale": True, "finish": False}
    assert parse("fixed-point:omega=auto,scale,finish=false").options == own


def test_several_sweeps_make_a_grid_and_leave_methods_without_the_option_alone() -> None:
    grid = sweep([parse("fixed-point"), parse("shi")], ["p=1,10", "k-star=5,100"])
    ours = [f"shi:p={p},k-star={k_star}" for p in (1, 10) for k_star in (5, 100)]
    assert [str(each) for each in grid] == ["fixed-point", *ours]
    assert sweep([Variant("shi")], ["p=1,1"]) == [parse("shi:p=1")]  # once


def test_names_say_in_what_the_runs_of_a_method_differ() -> None:
    asked = [parse(text) for text in ("shi:p=1,k-star=5", "shi:p=10,k-star=5", "newton", "fixed-point:scale")]
    assert labels(asked) == ["shi:p=1", "shi:p=10", "newton", "fixed-point:scale"]
    assert labels([Variant("shi"), parse("shi:p=10")]) == ["shi", "shi:p=10"]


def test_every_value_that_is_asked_for_runs(lcp: Lcp) -> None:
    runs = compared(lcp, "--method", "shi:p=10", "--method", "shi:p=100,k-star=5", "--method", "fixed-point")
    asked = {"shi:p=10": (10, 100), "shi:p=100,k-star=5": (100, 5), "fixed-point": (None, None)}
    assert {run["label"]: (run["options"].get("p"), run["options"].get("k_star")) for run in runs} == asked
    assert [run["options"]["p"] for run in compared(lcp, "--method", "shi", "--sweep", "p=10,1e4")] == [10, 1e4]
    runs = compared(lcp, "--method", "shi:p=10", "--method", "shi:k-star=7", "--p", "50")
    assert [run["options"]["p"] for run in runs] == [10, 50]
    result = json.loads(lcp("solve", EXAMPLE, "--method", "shi:k-star=5", "--format", "json").out)
    assert result["options"]["k_star"] == 5


@pytest.mark.slow("draws figures of many runs")
def test_tables_and_figures_name_the_runs_by_the_swept_value(lcp: Lcp, tmp_path: Path) -> None:
    figure = tmp_path / "sweep.svg"
    out = lcp("compare", EXAMPLE, "--method", "shi", "--sweep", "p=10,100", "--plot", str(figure)).out
    assert [line.split()[:2] for line in out.splitlines() if line.startswith("shi ")] == [["shi", "10"], ["shi", "100"]]
    assert figure.stat().st_size > 0


def test_bench_measures_variants_and_resumes_them(lcp: Lcp, tmp_path: Path) -> None:
    output = str(tmp_path / "bench.json")
    given = ("--method", "shi", "--method", "newton", "--sweep", "p=100,1e4", "--budget", "0")
    outcome = lcp("bench", EXAMPLE, *given, "-o", output)
    assert (outcome.code, outcome.err) == (0, "lcp: 3 of 3 measurements succeeded\n")
    record = records.read(output)
    assert record.methods == ["shi:p=100", "shi:p=1e4", "newton"]
    assert [row.solver for row in record.measurements] == record.methods
    resumed = lcp("bench", "--resume", output, "--format", "csv")
    lines = list(csv.DictReader(line for line in resumed.out.splitlines() if not line.startswith("#")))
    assert resumed.code == 0
    assert [line["solver"] for line in lines] == record.methods
    refused = lcp("bench", "--resume", output, "--sweep", "p=1,2")
    assert (refused.code, refused.err.count("\n")) == (2, 1)


MISTAKES = {
    "--method shi --p 10 --p 100": "--p: is given 2 times; give it once",
    "--tol 1e-6 --tol 1e-8": "--tol: is given 2 times; give it once",
    "--scale --no-scale": "--scale: is given 2 times",
    "--sweep p": "'p' lacks a value",
    "--sweep p=1,,2": "lacks a value",
    "--sweep q=1,2": "'q' is not an option of any method",
    "--sweep p=1,10 --p 5": "--p is given beside it",
    "--method shi:p=3 --sweep p=1,10": "p is also set by shi:p=3",
    "--method newton --sweep p=1,10": "p has no effect with newton; add --method shi",
    "--method newton:p=1": "newton has no option p",
    "--method shi:kstar=1": "did you mean k-star?",
    "--method shi:p": "'p' has no value",
    "--method shi:p=x": "'x' is not a number",
    "--method shi:p=-1": "it must be: 0 < p < infinity",
    "--method shi:p=1,p=2": "p is set twice",
    "--method sho:p=1": "did you mean shi?",
    "--method shi:p=1 --p 5": "--p: has no effect with shi:p=1",
    "--sweep k-star=2.5": "whole number",
    "--sweep rho=0.1,0.95": "out of range",
    "--method fixed-point:scale=perhaps": "write true or false",
}


@pytest.mark.parametrize("arguments", MISTAKES)
def test_mistake_is_refused_in_one_line_before_anything_runs(arguments: str, lcp: Lcp) -> None:
    outcome = lcp("compare", EXAMPLE, *arguments.split())
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert MISTAKES[arguments] in outcome.err


def test_flag_may_be_repeated(lcp: Lcp) -> None:
    assert lcp("solve", EXAMPLE, "-q", "-q").code == 0
