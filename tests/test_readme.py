"""README says what the program does: its output is the program's, its commands run, its snippets work."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli import gallery, options, result
from lcpcli.bench import rate, suites
from lcpcli.bench.answer import Method
from lcpcli.cli.options import OF_METHODS
from lcpcli.report.bench import stability

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


def without_times(text: str) -> list[list[str]]:
    """Lines as cells, without times and without the lines of `shi`, whose last digits depend on the machine."""
    lines = []
    method = ""
    for line in text.splitlines():
        if set(line) == {"-"}:
            continue
        cells = re.sub(r"/\d\S*s\b", " TIME", re.sub(r"time/\w+|\s\d+\.\d{3}$", " TIME", line)).split()
        method = cells[0] if cells and not cells[0][0].isdigit() else method
        lines.append(cells if method != "shi" else [])
    return [cells for cells in lines if cells]


def test_output_of_compare_is_the_programs(lcp: Callable[..., Any]) -> None:
    shown = blocks("console")[0].removeprefix("$ lcp compare\n")
    assert without_times(shown) == without_times(lcp("compare").out)
    assert len(without_times(shown)) > 40


def test_exact_answer_is_the_programs(lcp: Callable[..., Any]) -> None:
    command, _, shown = blocks("console")[1].partition("\n")
    arguments = command.removeprefix("$ lcp ").split()
    printed = lcp(arguments[0], str(ROOT / arguments[1]), *arguments[2:]).out
    time = r"(?<=, )[\d.]+ [mu]?s$|time/\w+|\d+\.\d{3}$"
    heads, tables = zip(
        *(re.sub(time, "TIME", text, flags=re.M).split("\n\n") for text in (shown, printed)), strict=True
    )
    assert heads[0] == heads[1]
    assert [line.split() for line in tables[0].splitlines()[2:]] == [
        line.split() for line in tables[1].splitlines()[2:]
    ]
    assert "exact z = (0, 15/29, 17/29, 0)" in heads[0]


LADDER = r"^\| ([a-z-]+) \| (\w+) = (\S+) \| (all|-|[\d.e-]+) \| .* \| ([\d.e+-]*) \| ([\d.e+-]*) \|$"


def test_table_of_stability_names_the_ladders_of_the_suites() -> None:
    """What auto does on them, test_stability holds; here it is that the table is about the same ladders."""
    shown = {row[0]: row[1:3] for row in re.findall(LADDER, README, re.MULTILINE)}
    cases = [*suites.STIFF, *suites.EXTREME]
    assert shown == {each.family: (each.axis, each.values[-1]) for each in stability.ladders(cases)}


def test_there_are_two_commands_and_ci_runs_exactly_these() -> None:
    commands = [line for line in README.splitlines() if line.startswith("python -m pip install ")]
    assert commands == ["python -m pip install . && lcp compare", "python -m pip install '.[test]' && pytest"]
    assert "^python -m pip install " in (ROOT / ".ci" / "run").read_text()


@pytest.mark.parametrize("text", blocks("json"))
def test_json_examples_are_solved(text: str, lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "problem.json"
    file.write_text(text)
    assert lcp("solve", str(file), "-q").code == 0


def test_python_snippet_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (snippet,) = blocks("python")
    exec(compile(snippet, "README.md", "exec"), {})
    assert capsys.readouterr().out.startswith("solved [1.33")


def test_every_status_and_its_exit_code_is_documented() -> None:
    for status in result.Status:
        rows = [line for line in README.splitlines() if line.startswith("|") and f"`{status.word}`" in line]
        assert len(rows) == 1
        assert rows[0].split("|")[1].strip() == str(status.exit_code)


def test_every_option_of_the_methods_is_documented() -> None:
    for name in OF_METHODS:
        assert f"`{options.flag(name)}" in README


RATE = r"^\| ([a-z][\w-]+) (\d+)(?: (\w+)=(\S+))? \| (\d+) \| (0\.\d+) \| (0\.\d+) \| (\S+) \|$"
RATES = re.findall(RATE, README, re.MULTILINE)


@pytest.mark.parametrize("row", [row for row in RATES if int(row[4]) < 2000], ids=lambda row: row[0])
def test_rates_of_fixed_point_are_what_the_bench_measures(row: tuple[str, ...]) -> None:
    family, n, parameter, value, iterations, *factors = row
    known = gallery.parameters_of(family)
    parameters = {parameter: type(known[parameter])(value)} if parameter else {}
    problem = suites.prepare(suites.case(family, int(n), **parameters))
    answer = Method("fixed-point").solve(problem, 1e-10, 60.0, with_curve=True)
    assert answer.iterations == pytest.approx(int(iterations), abs=2)
    found = rate.of(problem, answer.curve or [])
    assert found is not None
    shown = [found["measured"], found["local"], found["bound"]]
    assert shown == pytest.approx([float(factor) for factor in factors], abs=2e-4)


def test_rates_are_shown_for_several_families() -> None:
    assert len({row[0] for row in RATES}) >= 8
