"""What people see: tables laid out like the paper's, that fit an 80-column terminal, and plain text in pipes."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lcpcli import Problem, Status
from lcpcli.cli import terminal
from lcpcli.files import contents
from lcpcli.report import latex, wording
from lcpcli.report import tables as iterations

EXAMPLE = contents.shipped_path("paper-example-1.json")
TRIDIAGONAL = contents.shipped_path("tridiagonal-100.json")
ESCAPE = "\x1b["

Lcp = Callable[..., Any]
SUMMARY = ["method", "to", "1e-3", "UNIT", "to", "1e-6", "UNIT", "to", "1e-9", "UNIT", "end", "UNIT", "error", "status"]


def iterates(out: str) -> list[str]:
    """The lines of the table below a lone result."""
    return out.split("\n\n", 1)[1].splitlines()


def test_compare_prints_one_table_an_example_and_a_line_a_method(lcp: Lcp) -> None:
    outcome = lcp("compare")
    assert outcome.code == 0
    assert outcome.err == ""
    tables = outcome.out.split("\n\n")
    assert [table.splitlines()[0].split(":")[0] for table in tables] == ["paper-example-1", "paper-example-2"]
    for table in tables:
        lines = table[: table.index("\nlcp ")].splitlines()
        *names, time = lines[1].split()
        assert names == ["method", "k", "z1", "z2", "z3", "z4", "step", "error"]
        assert time in ("time/us", "time/ms", "time/s")
        *summary, star = lines[-5:]
        assert re.sub(r" (us|ms|s)\b", " UNIT", summary[0]).split() == SUMMARY
        assert [line.split()[0] for line in summary[2:]] == ["fixed-point", "shi"]
        assert all(line.endswith(" solved") for line in summary[2:])
        assert star.endswith("; * the shortest time")


def test_rows_are_the_first_every_fifth_and_the_last_three(lcp: Lcp) -> None:
    lines = lcp("compare", EXAMPLE, "--method", "fixed-point").out.splitlines()
    rows = lines[3 : next(i for i, line in enumerate(lines) if "status" in line)]
    shown = [int(next(cell for cell in line.split() if cell.isdigit())) for line in rows]
    last = shown[-1]
    assert shown == sorted({1, *range(5, last + 1, 5), last - 2, last - 1, last})


def test_components_have_seven_decimals_and_the_method_stands_at_the_left(lcp: Lcp) -> None:
    lines = iterates(lcp("solve", EXAMPLE, "--method", "fixed-point").out)
    assert lines[2].split()[:6] == ["fixed-point", "1", "0.0000000", "0.0000000", "0.0000000", "0.0000000"]
    assert lines[3].split()[:5] == ["5", "0.7883251", "0.0000000", "1.3448593", "0.0000000"]
    assert lines[4].startswith("  ")


def test_name_of_a_method_is_written_down_only_where_a_table_is_too_wide(
    lcp: Lcp, terminal: Callable[[int, bool], None]
) -> None:
    for width, whole in ((120, True), (80, True), (40, False)):
        terminal(width, False)
        lines = iterates(lcp("solve", EXAMPLE, "--method", "fixed-point").out)
        assert lines[2].startswith("fixed-point " if whole else "fixed- ")


@pytest.mark.parametrize("file", [EXAMPLE, contents.shipped_path("paper-example-2.json"), TRIDIAGONAL])
def test_eighty_columns_are_enough(file: str, lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    terminal(80, False)
    outcome = lcp("compare", file)
    assert max(len(line) for line in outcome.out.splitlines()) <= 80


@pytest.mark.parametrize(("width", "shown"), [(80, 4), (120, 7), (200, 15), (60, 3)])
def test_large_n_shows_the_first_and_the_last_components(
    width: int, shown: int, lcp: Lcp, terminal: Callable[[int, bool], None]
) -> None:
    terminal(width, False)
    header = iterates(lcp("solve", TRIDIAGONAL, "--method", "fixed-point").out)[0].split()
    names = header[2 : header.index("error")]
    assert names[0] == "z1"
    assert names[-2:] == ["...", "z100"]
    assert len(names) == shown


def test_narrow_screen_shows_the_last_component(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    terminal(50, False)
    header = iterates(lcp("solve", TRIDIAGONAL, "--method", "fixed-point").out)[0].split()
    assert header[:4] == ["method", "k", "...", "z100"]


def test_all_components_are_shown_where_they_fit(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    terminal(80, False)
    assert "..." not in lcp("solve", EXAMPLE).out


def test_colour_is_for_terminals_only(lcp: Lcp, terminal: Callable[[int, bool], None]) -> None:
    assert ESCAPE not in lcp("compare").out
    terminal(80, False)
    assert ESCAPE not in lcp("compare").out
    terminal(80, True)
    assert ESCAPE in lcp("compare").out


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
    assert terminal.terminal()[1] is colored


def test_pipe_shows_numbers_uncut(lcp: Lcp) -> None:
    out = lcp("solve", TRIDIAGONAL).out
    assert "…" not in out
    assert len(iterates(out)[0]) > 100


def test_without_a_known_solution_the_residual_is_shown(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    file.write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}')
    out = lcp("solve", str(file), "--method", "fixed-point").out
    assert iterates(out)[0].split()[:-1] == ["method", "k", "z1", "z2", "residual"]
    assert "error" not in out


def test_unsolved_run_says_why_and_exits_with_one(lcp: Lcp) -> None:
    outcome = lcp("solve", EXAMPLE, "--method", "fixed-point", "--max-iterations", "2")
    assert outcome.code == 1
    assert outcome.out.splitlines()[1] == "fixed-point stopped at the iteration limit"
    assert outcome.out.splitlines()[6].startswith("try --method auto, or --scale ")


def test_quiet_prints_nothing_and_the_exit_code_gives_the_outcome(lcp: Lcp) -> None:
    assert (lcp("solve", EXAMPLE, "-q").code, lcp("solve", EXAMPLE, "-q").out) == (0, "")
    failed = lcp("solve", EXAMPLE, "-q", "--max-iterations", "1")
    assert (failed.code, failed.out, failed.err) == (1, "", "")


def test_long_runs_are_thinned_unless_every_is_given(lcp: Lcp) -> None:
    long = (
        "solve",
        contents.shipped_path("bimatrix.json"),
        "--method",
        "shi",
        "--max-iterations",
        "400",
        "--k-star",
        "10",
    )
    assert 30 < len(lcp(*long).out.splitlines()) < 75
    assert len(lcp(*long, "--every", "1").out.splitlines()) > 300


def test_several_known_solutions_are_announced(lcp: Lcp) -> None:
    assert lcp("compare", contents.shipped_path("bimatrix.json"), "--max-iterations", "5").out.startswith(
        "bimatrix: n = 5, 3 known solutions"
    )


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 us"),
        (1.5e-6, "1.5 us"),
        (0.0123, "12.3 ms"),
        (1.0, "1 s"),
        (75.25, "75.2 s"),
        (0.9997, "1 s"),
        (1234.0, "1234 s"),
    ],
)
def test_durations_have_a_unit_that_fits(seconds: float, text: str) -> None:
    assert wording.duration(seconds) == text


def test_components_beyond_seven_decimals_are_shown_with_their_exponent() -> None:
    assert wording.components([1.0, 2e6], largest=1.0) == ["1.0000000", "2.000000e+06"]
    assert wording.components([1e-9, 0.0], largest=1e-9) == ["1.000000e-09", "0.000000e+00"]


def test_interrupted_comparison_shows_what_there_is(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    from lcpcli.solving import driver as driver

    begun: list[str] = []
    real = driver.run

    def interrupted(problem: Problem, method: str, **options: Any) -> Any:
        begun.append(method)
        if method == "shi":

            def clock() -> float:
                ticks.append(0)
                if len(ticks) == 20:
                    raise KeyboardInterrupt
                return 0.0

            ticks: list[int] = []
            return real(problem, method, clock=clock, **options)
        return real(problem, method, **options)

    monkeypatch.setattr(driver, "run", interrupted)
    outcome = lcp("compare")
    assert outcome.code == 130
    assert begun == [*["fixed-point"] * (len(begun) - 1), "shi"]
    assert "shi interrupted" in outcome.out


def test_interrupt_of_a_repeat_keeps_what_was_finished(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    from lcpcli.solving import driver as driver

    runs, real = iter([True, False]), driver.run

    def second_interrupted(problem: Problem, method: str, **options: Any) -> Any:
        result = real(problem, method, **options)
        return result if next(runs) else replace(result, status=Status.INTERRUPTED, interrupted=True)

    monkeypatch.setattr(driver, "run", second_interrupted)
    outcome = lcp("compare", EXAMPLE)
    assert outcome.code == 130
    last = outcome.out[: outcome.out.index("\nlcp ")].splitlines()[-2]
    assert re.match(r"fixed-point .* solved$", last)


def test_shown_components_always_include_the_last() -> None:
    for n in (50, 10**6):
        for width in (20, 60, 80, 200, None):
            shown = iterations.shown_components(n, width)
            assert shown is not None
            assert shown[0] == (n - 1 if width == 20 else 0)
            assert shown[-1] == n - 1


def test_labels_in_latex_are_safe_and_unique() -> None:
    assert latex.labels(["a_b & 50%", "a b 50", "é"]) == ["tab:a-b-50", "tab:a-b-50-2", "tab:lcp"]


def test_latex_keeps_the_verdict_and_the_solution(lcp: Lcp) -> None:
    out = lcp("solve", EXAMPLE, "--format", "latex").out
    assert "solved by" in out
    assert "z = (1, 0, 1, 0)" in out


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not installed")
def test_latex_compiles_and_fits_the_page(lcp: Lcp, tmp_path: Path) -> None:
    runs = [("solve", EXAMPLE), ("compare",), ("compare", TRIDIAGONAL, "--method", "shi:p=10", "--method", "shi:p=100")]
    for run in runs:
        head = r"\documentclass[11pt,a4paper]{article}\usepackage{booktabs,graphicx,longtable}\begin{document}"
        body = lcp(*run, "--format", "latex").out
        (tmp_path / "page.tex").write_text(head + "\n" + body + r"\end{document}", encoding="utf-8")
        command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "page.tex"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
        log = done.stdout.decode(errors="replace")
        assert done.returncode == 0, log
        assert "Overfull" not in log
