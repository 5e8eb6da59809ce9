"""README says what the program does: its commands run and print what it shows, its snippets work, its figures hold."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import rate, suites
from lcpcli.bench.answer import Method
from lcpcli.bench.report import stability
from lcpcli.cli.options import STARTS
from lcpcli.gallery import families as gallery
from lcpcli.methods.registry import OPTIONS
from lcpcli.options import flag
from lcpcli.solving import result

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
BLOCKS: list[tuple[str, str]] = re.findall(r"^```(\w+)\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
TIMES = re.compile(r"\d[\d.]*(e[-+]\d+)? ?(us|ms|s)\b|time/\w+")

Lcp = Callable[..., Any]


def blocks(language: str) -> list[str]:
    return [text for kind, text in BLOCKS if kind == language]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a reader works, with the shipped problems."""
    place = tmp_path_factory.mktemp("reader")
    (place / "problems").symlink_to(ROOT / "problems")
    return place


def shell(command: str, folder: Path, code: int | None = None) -> str:
    """What a command prints in a shell in which lcp is this program; `code` is how it must end, if that matters."""
    own = f'lcp() {{ {shlex.quote(sys.executable)} -m lcpcli "$@"; }}; '
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    done = subprocess.run(
        ["bash", "-c", own + command], capture_output=True, text=True, check=False, cwd=folder, env=environment
    )
    assert done.stderr == ""
    assert code in (None, done.returncode)
    return done.stdout


def sessions(block: str) -> list[tuple[str, str]]:
    """The commands of a block, each with what it prints; a line that begins with > continues a command."""
    found: list[tuple[str, str]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], ""))
        elif line.startswith("> ") and not found[-1][1]:
            found[-1] = (f"{found[-1][0]}\n{line[2:]}", "")
        else:
            found[-1] = (found[-1][0], f"{found[-1][1]}{line}\n")
    return found


def comparable(text: str) -> list[list[str]]:
    """Lines as cells, without times and without what `shi` computes, whose last digits depend on the machine."""
    lines, timed, method = [], False, ""
    for line in text.splitlines():
        timed = "time/" in line or (timed and bool(line.strip()))
        cells = TIMES.sub("TIME", line).split()
        if not cells or set(line) == {"-"}:
            continue
        if timed and re.fullmatch(r"\d+\.\d{3}", cells[-1]):
            cells[-1] = "TIME"
        method = cells[0] if not cells[0][0].isdigit() else method
        lines.append([cells[0]] if method == "shi" else cells)
    return [cells for cells in lines if not cells[0][0].isdigit() or len(cells) > 1]


def test_commands_and_snippets_print_what_is_shown(folder: Path) -> None:
    """In the order of the page: what one writes, another reads."""
    for language, text in BLOCKS:
        if language == "console":
            for command, shown in sessions(text):
                assert comparable(shell(command, folder)) == comparable(shown), command
        elif language == "python":
            subprocess.run(
                [sys.executable, "-c", text], check=True, cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)}
            )
    assert sum(len(sessions(text)) for text in blocks("console")) >= 10


def lines_of_shell() -> list[str]:
    """The commands of lcp in blocks that show no output, but for those that need a file of the reader's own."""
    lines = [line for text in blocks("sh") for line in text.splitlines() if line.startswith("lcp ")]
    return [line for line in lines if "model.json" not in line]


@pytest.mark.parametrize("line", [line for line in lines_of_shell() if not line.startswith("lcp bench")])
def test_command_runs(line: str, folder: Path) -> None:
    shell(f"set -o pipefail; {line} > /dev/null", folder, code=0)


@pytest.mark.parametrize("line", [line for line in lines_of_shell() if line.startswith("lcp bench")])
def test_benchmark_runs_on_one_small_problem_in_place_of_its_suite(
    line: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    small = (suites.case("diagonal", 3),)
    held = {name: replace(suite, cases=small, budget=0.0) for name, suite in suites.SUITES.items()}
    monkeypatch.setattr(suites, "SUITES", held)
    monkeypatch.chdir(folder)
    words = shlex.split(line)[1:]
    if "problems/*.json" in words:
        place = words.index("problems/*.json")
        words[place : place + 1] = ["problems/paper-example-1.json"]
    assert lcp(*words).code == 0


def test_there_are_two_commands_and_ci_runs_exactly_these() -> None:
    commands = [line for line in README.splitlines() if line.startswith("python -m pip install ")]
    assert commands == ["python -m pip install . && lcp compare", "python -m pip install '.[test]' && pytest"]
    assert "^python -m pip install " in (ROOT / ".ci" / "run").read_text()


@pytest.mark.parametrize("text", blocks("json"))
def test_json_examples_are_solved(text: str, lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "problem.json"
    file.write_text(text)
    assert lcp("solve", str(file), "-q").code == 0


def test_every_status_and_its_exit_code_is_documented() -> None:
    for status in result.Status:
        rows = [line for line in README.splitlines() if line.startswith("|") and f"`{status.word}`" in line]
        assert len(rows) == 1
        assert rows[0].split("|")[1].strip() == str(status.exit_code)


def test_every_option_of_the_methods_is_documented() -> None:
    for name in (*OPTIONS, *STARTS):
        assert f"`{flag(name)}" in README


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


LADDER = r"^\| ([a-z-]+) \| (\w+) = (\S+) \| (all|-|[\d.e-]+) \| .* \| ([\d.e+-]*) \| ([\d.e+-]*) \|$"


def test_table_of_stability_names_the_ladders_of_the_suites() -> None:
    """What auto does on them, test_stability holds; here it is that the table is about the same ladders."""
    shown = {row[0]: row[1:3] for row in re.findall(LADDER, README, re.MULTILINE)}
    cases = [*suites.STIFF, *suites.EXTREME]
    assert shown == {each.family: (each.axis, each.values[-1]) for each in stability.ladders(cases)}
