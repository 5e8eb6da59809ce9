"""What people see: tables like the paper's, columns on request, a summary, no line too wide, colour on terminals."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lcpcli import Problem, Status
from lcpcli.cli import terminal as cli_terminal
from lcpcli.files import contents
from lcpcli.report import wording
from lcpcli.solving import driver

EXAMPLE = contents.shipped_path("paper-example-1.json")
ESCAPE = "\x1b["

Lcp = Callable[..., Any]
SUMMARY = ["method", "to", "1e-3", "UNIT", "to", "1e-6", "UNIT", "to", "1e-9", "UNIT", "end", "UNIT", "error", "status"]


def iterates(out: str) -> list[str]:
    """The lines of the table below a lone result."""
    return out.split("\n\n", 1)[1].splitlines()


def without_units(header: str) -> list[str]:
    return re.sub(r" (us|ms|s)\b", " UNIT", header).split()


def test_compare_prints_one_table_an_example_and_a_line_a_method(lcp: Lcp) -> None:
    outcome = lcp("compare")
    assert (outcome.code, outcome.err) == (0, "")
    tables = outcome.out.split("\n\n")
    assert [table.splitlines()[0].split(":")[0] for table in tables] == ["paper-example-1", "paper-example-2"]
    for table in tables:
        lines = table[: table.index("\nlcp ")].splitlines()
        *names, time = lines[1].split()
        assert names == ["method", "k", "z1", "z2", "z3", "z4", "step", "error"]
        assert time in ("time/us", "time/ms", "time/s")
        *summary, star = lines[-5:]
        assert without_units(summary[0]) == SUMMARY
        assert [line.split()[0] for line in summary[2:]] == ["fixed-point", "shi"]
        assert all(line.endswith(" solved") for line in summary[2:])
        assert star.endswith("; * the shortest time")


def test_rows_are_the_first_every_fifth_and_the_last_three_with_seven_decimals(lcp: Lcp) -> None:
    lines = iterates(lcp("solve", EXAMPLE, "--method", "fixed-point").out)
    assert lines[2].split()[:6] == ["fixed-point", "1", "0.0000000", "0.0000000", "0.0000000", "0.0000000"]
    assert lines[3].split()[:5] == ["5", "0.7883251", "0.0000000", "1.3448593", "0.0000000"]
    assert lines[3].startswith("  ")
    shown = [int(line.removeprefix("fixed-point").split()[0]) for line in lines[2:14]]
    assert (shown, len(lines)) == ([1, *range(5, 41, 5), 44, 45, 46], 15)


def test_columns_are_those_asked_for_in_that_order(lcp: Lcp) -> None:
    """Table 1 of the paper has k and z alone."""
    out = lcp("compare", EXAMPLE, "--columns", "k,z").out
    assert out.splitlines()[1].split() == ["method", "k", "z1", "z2", "z3", "z4"]
    assert "status" not in out
    rows = [line.split()[-5:] for line in out.splitlines()]
    assert ["15", "0.9985643", "0.0000000", "1.0012907", "0.0000000"] in rows
    header = next(line for line in lcp("solve", EXAMPLE, "--columns", "time,k").out.splitlines() if "method" in line)
    assert re.fullmatch(r"method +time/(us|ms|s) +k", header)
    for arguments in (("--columns", "k,tme"), ("--columns", "k", "--format", "json"), ("--columns", "k", "-q")):
        outcome = lcp("solve", EXAMPLE, *arguments)
        assert outcome.code == 2
        assert outcome.err.startswith("lcp: --columns: ")


def test_sweep_shows_its_summary_and_iterates_on_request(lcp: Lcp) -> None:
    sweep = ("compare", EXAMPLE, "--method", "shi", "--sweep", "p=1e3,1e4", "--sweep", "k-star=5,100")
    title, header, _, *rows, star = lcp(*sweep).out.splitlines()[:8]
    assert title.startswith("paper-example-1")
    assert without_units(header) == ["method", "p", "k-star", *SUMMARY[1:]]
    assert [row.split()[:3] for row in rows] == [["shi", p, k] for p in ("1e3", "1e4") for k in ("5", "100")]
    assert star.endswith("; * the shortest time")
    assert sum("*" in row for row in rows) >= 1
    asked = ("--every", "10"), ("--trace",), ("--columns", "k,error")
    assert min(len(lcp(*sweep, *each).out.splitlines()) for each in asked) > 20


def test_csv_of_a_sweep_has_a_row_a_run_with_options_and_costs(lcp: Lcp) -> None:
    sweep = ("compare", EXAMPLE, "--sweep", "p=1e3,1e4")
    lines = [line for line in lcp(*sweep, "--format", "csv").out.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert [(row["method"], row["p"], row["omega"]) for row in rows] == [
        ("fixed-point", "", "1"),
        ("shi:p=1e3", "1000", ""),
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


def test_long_runs_are_thinned_unless_every_is_given(lcp: Lcp) -> None:
    long = ("solve", "bimatrix", "--method", "shi", "--max-iterations", "200", "--k-star", "10")
    assert 30 < len(lcp(*long).out.splitlines()) < 75
    whole = lcp(*long, "--every", "1").out
    assert len(whole.splitlines()) > 150
    assert whole.startswith("bimatrix: n = 5, 3 known solutions")


def test_colour_is_for_terminals_only(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    plain = lcp("solve", EXAMPLE).out
    terminal(80, False)
    assert ESCAPE not in plain + lcp("solve", EXAMPLE).out
    terminal(80, True)
    assert ESCAPE in lcp("solve", EXAMPLE).out


@pytest.mark.parametrize(
    ("environment", "colored"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({"TERM": "dumb"}, False)],
)
def test_no_color_is_obeyed(environment: dict[str, str], colored: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert cli_terminal.terminal()[1] is colored


def test_without_a_known_solution_the_residual_is_shown(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "own.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}')
    out = lcp("solve", str(tmp_path / "own.json"), "--method", "fixed-point").out
    assert iterates(out)[0].split()[:-1] == ["method", "k", "z1", "z2", "residual"]
    assert "error" not in out


def test_unsolved_run_says_why_and_exits_with_one(lcp: Lcp) -> None:
    outcome = lcp("solve", EXAMPLE, "--method", "fixed-point", "--max-iterations", "2")
    assert outcome.code == 1
    assert outcome.out.splitlines()[1] == "fixed-point stopped at the iteration limit"
    assert outcome.out.splitlines()[6].startswith("try --method auto, or --scale ")


def test_quiet_prints_nothing_and_the_exit_code_gives_the_outcome(lcp: Lcp) -> None:
    for more, code in (([], 0), (["--max-iterations", "1"], 1)):
        outcome = lcp("solve", EXAMPLE, "-q", *more)
        assert (outcome.code, outcome.out, outcome.err) == (code, "", "")


def test_durations_have_a_unit_that_fits() -> None:
    shown = {0.0: "0 us", 1.5e-6: "1.5 us", 0.0123: "12.3 ms", 1.0: "1 s", 75.25: "75.2 s", 0.9997: "1 s"}
    assert {seconds: wording.duration(seconds) for seconds in shown} == shown
    assert wording.duration(1234.0) == "1234 s"


def test_components_beyond_seven_decimals_are_shown_with_their_exponent() -> None:
    assert wording.components([1.0, 2e6], largest=1.0) == ["1.0000000", "2.000000e+06"]
    assert wording.components([1e-9, 0.0], largest=1e-9) == ["1.000000e-09", "0.000000e+00"]
    assert wording.components([-1e-9, -2.0, -3e7], 2.0) == ["0.0000000", "-2.0000000", "-3.000000e+07"]


@pytest.mark.parametrize("begun", [["fixed-point"] * 2, ["shi"]], ids=["a-repeat", "a-first-run"])
def test_an_interrupted_comparison_shows_what_was_finished_and_begins_no_more(
    begun: list[str], lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, runs = driver.run, list[str]()

    def interrupted(problem: Problem, method: str, **options: Any) -> Any:
        runs.append(method)
        result = real(problem, method, **options)
        return replace(result, status=Status.INTERRUPTED, interrupted=True) if is_last() else result

    def is_last() -> bool:
        return runs[-len(begun) :] == begun

    monkeypatch.setattr(driver, "run", interrupted)
    outcome = lcp("compare", EXAMPLE)
    assert outcome.code == 130
    assert is_last()
    assert re.search(r"^fixed-point .* solved( |$)", outcome.out, re.MULTILINE)
    assert bool(re.search(r"^shi .* interrupted$", outcome.out, re.MULTILINE)) == (begun == ["shi"])


SECOND = contents.shipped_path("paper-example-2.json")
TRIDIAGONAL, BIMATRIX = map(contents.shipped_path, ("tridiagonal-100.json", "bimatrix.json"))
COMMANDS = {
    "solve": ("solve", EXAMPLE),
    "solve, stalled": ("solve", SECOND, "--method", "shi", "--p", "10"),
    "solve, proved": ("solve", BIMATRIX, "--exact", "--bound"),
    "solve, large": ("solve", TRIDIAGONAL, "--method", "fixed-point", "--max-iterations", "20"),
    "solve, long": ("solve", BIMATRIX, "--method", "shi", "--max-iterations", "50"),
    "compare": ("compare", SECOND),
    "compare, large": ("compare", TRIDIAGONAL),
    "compare, a sweep": ("compare", EXAMPLE, "--method", "shi", "--sweep", "p=10,1e5"),
    "check": ("check", EXAMPLE, "1,0,1,0.5"),
    "inspect": ("inspect", SECOND),
    "bench": ("bench", EXAMPLE, "--budget", "0", "--method", "newton", "--method", "shi"),
    "list": ("make", "--list"),
    **{f"help of {name}": (name, "--help") for name in ("solve", "compare", "bench", "check", "inspect", "make")},
}

Terminal = Callable[[int, bool], None]


@pytest.mark.parametrize("width", [50, 80])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_is_wider_than_the_screen(name: str, width: int, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    lines = lcp(*COMMANDS[name]).out.splitlines()
    assert lines
    examples = [line for line in lines if line.startswith("  lcp ")]  # they are copied, and so are not broken
    assert [line for line in lines if len(line) > width and line not in examples] == []


@pytest.mark.parametrize("size", ["9" * 4400, "9" * 20, "-5", "\u00b2", "x", "0"], ids=lambda size: size[:3])
@pytest.mark.parametrize("name", ["solve, large", "inspect"])
def test_sizes_of_the_environment_that_are_none_are_passed_over(
    name: str, size: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable in ("COLUMNS", "LINES"):
        monkeypatch.setenv(variable, size)
    ran = lcp(*COMMANDS[name])
    assert ran.out
    assert not ran.err


@pytest.mark.parametrize(("width", "levels"), [(100, 3), (74, 2), (55, 1)])
def test_a_narrow_screen_drops_levels_but_the_finest_and_splits_no_row_of_the_summary(
    width: int, levels: int, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    (header,) = (line.split() for line in lcp("compare", EXAMPLE).out.splitlines() if line.endswith("status"))
    shown = [word for word in header if word[-1] != "s"]
    kept = ("1e-3", "1e-6", "1e-9")[-levels:]
    assert shown == ["method", *(word for level in kept for word in ("to", level)), "end", "error"]


def heading_and_first(lcp: Lcp, file: str) -> tuple[list[str], str]:
    """The words of the heading of the iterates and the line of the first."""
    lines = lcp("solve", file, "--method", "fixed-point").out.split("\n\n", 1)[1].splitlines()
    return lines[0].split(), lines[2]


@pytest.mark.parametrize(("width", "method"), [(120, "fixed-point "), (80, "fixed-point "), (40, "fixed- ")])
def test_the_name_of_a_method_is_written_down_only_where_a_table_is_too_wide(
    width: int, method: str, lcp: Lcp, terminal: Terminal
) -> None:
    terminal(width, False)
    heading, first = heading_and_first(lcp, EXAMPLE)
    assert first.startswith(method)
    assert "..." not in heading or width < 80


@pytest.mark.parametrize(("width", "shown"), [(50, 2), (60, 3), (80, 4), (200, 15), (None, 12)])
def test_large_n_shows_the_first_and_the_last_components(
    width: int | None, shown: int, lcp: Lcp, terminal: Terminal
) -> None:
    if width is not None:
        terminal(width, False)
    heading, _ = heading_and_first(lcp, TRIDIAGONAL)
    names = heading[2 : heading.index("error")]
    assert names[-2:] == ["...", "z100"]
    assert names[0] == ("z1" if width != 50 else "...")
    assert len(names) == shown


def test_the_entries_of_a_long_proof_that_are_not_0_are_listed(lcp: Lcp, tmp_path: Path) -> None:
    M = [[0.0 if i == 12 else float(i == j) for j in range(20)] for i in range(20)]
    (tmp_path / "p.json").write_text(json.dumps({"M": M, "q": [-1] * 20}))
    outcome = lcp("solve", str(tmp_path / "p.json"), "--exact")
    assert outcome.code == 3
    assert "exact y = (y13 = 1; 0 elsewhere)" in outcome.out
