"""What came out of a run stands first, rounded to what is known; what matters in a comparison stands out."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, Trace, error_bound, read, write
from lcpcli.files import contents
from lcpcli.report import costs, outcome, wording
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
    assert "all 100 components of z" in head
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
    assert head.splitlines()[-1].startswith("certificate: farkas (")


def test_first_to_each_level_stands_out_in_colour_alone(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    results = [run(read(EXAMPLE), method, curve=Trace(levels=wording.LEVELS)) for method in ("newton", "shi")]
    assert {column for _, column in costs.summary(results, None).best} == {2, 4, 6, 8}
    assert costs.summary(results[:1], None).best == set()
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
    assert warning.startswith("times varied: the median run of 4.0 and 2.5 took over 2.5 times the shortest")


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
