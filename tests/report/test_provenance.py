"""Every output says what made it: the program's version, the problem, the limits and the options in force."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli import __version__
from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-1.json")
MADE_BY = f"lcp {__version__}, tol 1e-08, at most 500 iterations, time limit 9 s"
GIVEN = (EXAMPLE, "--method", "shi", "--k-star", "7", "--tol", "1e-8", "--max-iterations", "500", "--time-limit", "9")

Lcp = Callable[..., Any]


@pytest.mark.parametrize(
    ("command", "form"), [*(("solve", form) for form in ("table", "csv", "markdown", "latex")), ("compare", "table")]
)
def test_text_says_what_made_it(command: str, form: str, lcp: Lcp) -> None:
    text = " ".join(lcp(command, *GIVEN, "--format", form).out.replace("\\", "").split())
    assert (MADE_BY if form != "latex" else MADE_BY.replace("1e-08", "$10^{-8}$")) in text
    assert "paper-example-1" in text
    assert re.search(r"shi[:,] p=.+, k-star=7, rho=0.0001, sigma=0.9", text)


def test_files_name_the_methods_that_took_part_and_options_with_all_digits(lcp: Lcp, tmp_path: Path) -> None:
    assert "auto by newton: solved" in lcp("solve", EXAMPLE, "--format", "csv").out
    given = ("--tol", "1.2345678e-9", "--time-limit", "100.25", "--p", "1234567.5")
    arguments = ("solve", EXAMPLE, "--method", "shi", *given, "--trace", str(tmp_path / "t.csv"))
    out = lcp(*arguments, "--format", "csv").out
    trace = (tmp_path / "t.csv").read_text()
    for text in (out, trace):
        assert "tol 1.2345678e-09, at most 10000 iterations, time limit 100.25 s\n" in text
        assert "shi, p=1234567.5, k-star=100, " in text


def test_options_of_six_digits_are_not_rounded_in_a_table(lcp: Lcp) -> None:
    assert "shi: p=123456, k-star=100" in lcp("solve", EXAMPLE, "--method", "shi", "--p", "123456").out


def test_json_says_what_made_it(lcp: Lcp) -> None:
    record = json.loads(lcp("solve", *GIVEN, "--format", "json").out)
    assert (record["version"], record["tol"], record["max_iterations"]) == (__version__, 1e-8, 500)
    assert record["time_limit"] == 9
    assert record["options"]["k_star"] == 7
    assert json.loads(lcp("solve", EXAMPLE, "--format", "json").out)["time_limit"] is None


def test_runs_of_one_method_share_the_options_in_which_they_do_not_differ(lcp: Lcp) -> None:
    out = lcp("compare", EXAMPLE, "--method", "shi", "--sweep", "k-star=5,100", "--p", "1e6").out
    last = " ".join(out[out.index("\nlcp ") :].split())
    assert last.endswith("shi: p=1e+06, rho=0.0001, sigma=0.9")


def test_bench_says_what_made_it(lcp: Lcp, tmp_path: Path) -> None:
    record, figure = str(tmp_path / "r.json"), tmp_path / "bench.svg"
    assert lcp("bench", EXAMPLE, "--method", "newton", "--budget", "0", "-o", record).code == 0
    for form in ("table", "csv", "latex"):
        text = lcp("bench", "--resume", record, "--format", form).out.replace("\\", "")
        assert "tolerance 1e-10, accepted to 1e-06, time limit 10 s" in text
        assert f"lcpcli {__version__}" in text
        assert "newton" in text
    lcp("bench", "--resume", record, "--plot", str(figure), "-q")
    assert f"lcpcli {__version__}" in figure.read_text()


def test_times_of_the_last_row_and_of_the_summary_are_by_one_clock(lcp: Lcp) -> None:
    """The verified answer comes after the last iterate."""
    lines = lcp("compare", EXAMPLE, "--method", "fixed-point").out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("method") and line.endswith("status"))
    units = re.search(r"time/(\w+)", lines[1]), lines[start].split()[3]
    assert units[0]
    scale = {"us": 1e-6, "ms": 1e-3, "s": 1.0}
    last, cells = float(lines[start - 1].split()[-1]) * scale[units[0][1]], lines[start + 2].split()
    assert last * 0.99 <= float(cells[8]) * scale[units[1]] <= 2 * last + 1e-3


def test_default_beside_a_run_with_an_option_and_every_value_in_a_figure_are_told(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "figure.svg"
    methods = ("--method", "shi", "--method", "shi:k-star=5", "--method", "shi:k-star=17")
    out = lcp("compare", EXAMPLE, *methods, "--plot", str(file)).out
    assert " ".join(out[out.index("\nlcp ") :].split()).endswith("default shi: k-star=100")
    assert re.search(r"k-star=5, .*k-star=17, ", file.read_text())
