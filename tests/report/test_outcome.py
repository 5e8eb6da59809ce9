"""What came out of a run stands first, rounded to what is known, and what made it, with all options, stands last."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, Trace, __version__, error_bound, read, write
from lcpcli.files import contents
from lcpcli.report import outcome, tables, wording
from lcpcli.solving.driver import run

EXAMPLE = contents.shipped_path("paper-example-1.json")
TRIDIAGONAL = contents.shipped_path("tridiagonal-100.json")
ESCAPE = "\x1b["

Lcp = Callable[..., Any]


def test_result_stands_above_its_iterates(lcp: Lcp) -> None:
    head, table = lcp("solve", EXAMPLE, "--method", "fixed-point").out.split("\n\n")
    lines = head.splitlines()
    assert lines[0] == "paper-example-1: n = 4, solution (1, 0, 1, 0)"
    work = r"46 iterations, \d+ evaluations, [\d.]+ [mu]?s"
    assert re.fullmatch(rf"solved by fixed-point: {work}; the only solution", lines[1])
    parts = [rf"{part} ([\d.]+ [mu]?s)" for part in ("set-up", "iterations", "verification")]
    assert re.fullmatch(", ".join(parts), lines[2])
    assert re.fullmatch(r"residual \d\.\de-\d+, relative \d\.\de-\d+, error 1\.2e-10", lines[3])
    assert lines[4:] == ["z = (1, 0, 1, 0)"]
    assert table.startswith("method")


def test_long_z_fits_the_terminal_and_is_whole_in_a_file(
    lcp: Lcp, terminal: Callable[[int, bool], None], tmp_path: Path
) -> None:
    terminal(60, False)
    head, _ = lcp("solve", TRIDIAGONAL).out.split("\n\n")
    (line,) = (line for line in head.splitlines() if line.startswith("z = "))
    assert line.endswith(", ..., 0)")
    assert 50 < len(line) <= 60
    assert "see all 100 components of z with --format csv" in head
    assert "all 5 components of z" not in lcp("solve", contents.shipped_path("bimatrix.json")).out
    file = tmp_path / "result.txt"
    lcp("solve", TRIDIAGONAL, "-o", str(file))
    rows = re.findall(r"^z(\d+) +(.*)$", file.read_text(), flags=re.MULTILINE)
    assert [float(cell) for _, row in rows for cell in row.split()] == [1.0, 0.0] * 50
    assert rows[1][0] == str(1 + len(rows[0][1].split()))


@pytest.mark.parametrize(
    ("error", "shown"), [(None, "0.3333333"), (2e-3, "0.333"), (0.4, "0.3"), (2.0, "0"), (1e-12, "0.3333333")]
)
def test_z_is_rounded_to_what_is_known(error: float | None, shown: str) -> None:
    solutions = () if error is None else ([1 / 3 + error],)
    result = run(Problem([[3.0]], [-1.0], solutions=solutions), "newton")
    assert outcome.facts(result, 80, False)[-1] == f"z = ({shown})"


def test_no_z_is_shown_where_there_is_no_solution(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    file.write_text('{"M": [[0, -1], [1, 0]], "q": [-1, -1]}')
    head, _ = lcp("solve", str(file)).out.split("\n\n")
    assert "z = (" not in head
    assert head.splitlines()[1].startswith("has no solution: no z >= 0 has Mz + q >= 0, ")
    assert head.splitlines()[2].startswith("by lemke: ")
    assert head.splitlines()[-1].startswith("Farkas certificate y = (")


def test_first_to_each_level_stands_out_in_colour_alone(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    results = [run(read(EXAMPLE), method, curve=Trace(levels=wording.LEVELS)) for method in ("newton", "shi")]
    assert {column for _, column in tables.summary_of_costs(results, None).best} == {2, 4, 6, 8}
    assert tables.summary_of_costs(results[:1], None).best == set()
    plain = lcp("compare", EXAMPLE).out
    terminal(80, True)
    colored = lcp("compare", EXAMPLE).out
    last = [line for line in colored.splitlines() if line.startswith(("fixed-point", "shi"))][-2:]
    assert f"{ESCAPE}1m" in "".join(last)
    assert ESCAPE not in plain


def test_no_colour_is_lost_on_a_light_or_a_dark_ground(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    """Only red, green and magenta, which stand out on both; yellow, white, black and the bright ones do not."""
    terminal(80, True)
    runs = [lcp("solve", EXAMPLE), lcp("solve", EXAMPLE, "--max-iterations", "1"), lcp("compare", EXAMPLE)]
    used = {code for run in runs for codes in re.findall(r"\x1b\[([\d;]*)m", run.out) for code in codes.split(";")}
    assert used <= {"0", "1", "31", "32", "35"}
    assert {"1", "31", "32", "35"} <= used


def test_disturbed_times_are_said_to_be_over_the_least_of_their_ratios() -> None:
    result = run(Problem([[3.0]], [-1.0]), "newton")
    runs = [replace(result, spread=ratio, label=str(ratio)) for ratio in (1.5, 4.0, 2.5)]
    warning = outcome.spread(runs)
    assert warning.startswith("times of 4.0 and 2.5 vary by more than 2.5x between repeats")


def test_a_printed_bound_is_rounded_upwards() -> None:
    assert [wording.above(v) for v in (0.0, 9.91e-10, 1.25, 3.0)] == ["0", "1.0e-09", "1.3e+00", "3.0e+00"]


def test_a_bound_is_shown_where_it_is_asked_for(lcp: Lcp, tmp_path: Path) -> None:
    file = str(tmp_path / "problem.json")
    write(Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]), file)
    plain, bounded = (json.loads(lcp("solve", file, "--format", "json", *o).out) for o in ([], ["--bound"]))
    assert (plain["error_bound"], plain["error_bound_source"]) == (None, None)
    expected = error_bound(read(file), np.array(bounded["z"]))
    assert expected is not None
    assert (bounded["error_bound"], bounded["error_bound_source"]) == (expected.value, expected.source)
    lines = lcp("compare", contents.shipped_path("paper-example-2.json"), "--bound").out.splitlines()
    told = [re.match(r"(fixed-point|shi): \|z - z\*\| <= (\S+)", line) for line in lines if "|z - z*|" in line]
    assert [found and (found[1], 0 < float(found[2]) < 1e-8) for found in told] == [
        ("fixed-point", True),
        ("shi", True),
    ]
    none = lcp("solve", contents.shipped_path("bimatrix.json"), "--bound").out
    assert "\nno bound: M is not known to be H+ or positive definite\n" in none


@pytest.mark.parametrize("option", [["--quiet"], ["--format", "csv"]])
def test_a_bound_that_nobody_would_see_is_refused(option: list[str], lcp: Lcp) -> None:
    outcome = lcp("solve", EXAMPLE, "--bound", *option)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)


MADE_BY = f"lcp {__version__}, tol 1e-08, at most 500 iterations, time limit 9 s"
GIVEN = (EXAMPLE, "--method", "shi", "--k-star", "7", "--tol", "1e-8", "--max-iterations", "500", "--time-limit", "9")


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


def test_times_of_the_last_row_and_of_the_summary_are_by_one_clock(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    """The verified answer comes after the last iterate; the clock goes on by 1 ms each time it is read."""
    seconds = count(0.0, 1e-3)
    monkeypatch.setattr("time.perf_counter", lambda: next(seconds))
    lines = lcp("compare", EXAMPLE, "--method", "fixed-point").out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("method") and line.endswith("status"))
    units = re.search(r"time/(\w+)", lines[1]), lines[start].split()[3]
    assert units[0]
    scale = {"us": 1e-6, "ms": 1e-3, "s": 1.0}
    last, cells = float(lines[start - 1].split()[-1]) * scale[units[0][1]], lines[start + 2].split()
    assert last * 0.99 <= float(cells[8]) * scale[units[1]] <= last + 10.0


def test_default_beside_a_run_with_an_option_and_every_value_in_a_figure_are_told(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "figure.svg"
    methods = ("--method", "shi", "--method", "shi:k-star=5", "--method", "shi:k-star=17")
    out = lcp("compare", EXAMPLE, *methods, "--plot", str(file)).out
    assert " ".join(out[out.index("\nlcp ") :].split()).endswith("default shi: k-star=100")
    assert re.search(r"k-star=5, .*k-star=17, ", file.read_text())
