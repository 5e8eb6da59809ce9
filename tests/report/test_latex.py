"""LaTeX tables: with labels and summaries, no special character left over, and compiled where there is a TeX."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents
from lcpcli.report import latex

FIRST, SECOND = contents.shipped_path("paper-example-1.json"), contents.shipped_path("paper-example-2.json")
LARGE = contents.shipped_path("tridiagonal-100.json")
PROBLEMS = {
    "none.json": '{"name": "no_solution", "M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "names.json": '{"name": "50% of #1 & ~^{x}\\\\ <y>", "M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "program.json": '{"Q": [[4, 1], [1, 2]], "c": [1, 1], "A": [[1, 1]], "b": [1]}',
    "game.json": '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["up_1", "down"], "columns": ["a", "b"]}',
}
COMMANDS = {
    "solved": ("solve", FIRST),
    "no solution": ("solve", "none.json"),
    "special characters": ("solve", "names.json"),
    "exact": ("solve", SECOND, "--exact"),
    "program": ("solve", "program-lcp.json"),
    "game": ("solve", "game-lcp.json"),
    "not solved": ("solve", FIRST, "--method", "shi", "--p", "10"),
    "several problems": ("compare", FIRST, LARGE),
    "warm": ("compare", LARGE, "--warm", "0.01", "--bound"),
    "sweep": ("compare", FIRST, "--method", "shi", "--sweep", "p=1e4,1e8", "--sweep", "k-star=5,20"),
    "bench": ("bench", FIRST, SECOND, "none.json", "--budget", "0"),
}

Lcp = Callable[..., Any]


@pytest.fixture
def rendered(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], str]:
    monkeypatch.chdir(tmp_path)
    for name, text in PROBLEMS.items():
        Path(name).write_text(text)
    lcp("make", "--from-qp", "program.json", "-o", "program-lcp.json")
    lcp("make", "--from-game", "game.json", "-o", "game-lcp.json")
    return lambda name: lcp(*COMMANDS[name], "--format", "latex").out


def check_tables(text: str) -> None:
    """Every table has a label of its own and rows of one length between its rules."""
    assert text.startswith("% needs \\usepackage{booktabs}")
    labels = re.findall(r"\\label\{(tab:[A-Za-z0-9-]+)\}", text)
    assert len(labels) == len(set(labels)) == text.count(r"\begin{table}") == text.count(r"\end{table}") > 0
    tables = re.findall(r"\\begin\{tabular\}\{([lr]+)\}(.*?)\\end\{tabular\}", text, re.DOTALL)
    assert text.count(r"\toprule") == text.count(r"\bottomrule") == text.count(r"\begin{tabular}")
    for columns, body in tables:
        rows = [line for line in body.splitlines() if line.endswith(r"\\")]
        assert rows
        assert {len(re.findall(r"(?<!\\)&", row)) + 1 for row in rows} == {len(columns)}


@pytest.mark.slow("every command with every table")
@pytest.mark.parametrize("name", COMMANDS)
def test_every_table_has_a_label_of_its_own_and_rows_of_one_length(name: str, rendered: Callable[[str], str]) -> None:
    check_tables(rendered(name))


def test_numbers_are_powers_of_ten_and_nothing_is_advice_to_whoever_ran_it(rendered: Callable[[str], str]) -> None:
    texts = {name: rendered(name) for name in ("not solved", "several problems", "solved")}
    assert [text.count(r"\begin{tabular}") for text in texts.values()] == [1, 4, 1]  # a summary has its own
    assert "z = (1, 0, 1, 0)" in texts["solved"]
    assert r"\label{tab:tridiagonal-100}" in texts["several problems"]
    assert r"$z_{100}$" in texts["several problems"]
    for text in texts.values():
        check_tables(text)
        assert not re.search(r"(?<!\w)\d(\.\d+)?e[+-]?\d", text)
        assert "10^{-" in text
        assert not re.search(r"\btry -|other programs|-o FILE|\bus\b", text)


def test_labels_of_like_names_differ() -> None:
    names = ["a b", "a_b", "", "é", "a_b & 50%"]
    assert latex.labels(names) == ["tab:a-b", "tab:a-b-2", "tab:lcp", "tab:lcp-2", "tab:a-b-50"]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="there is no pdflatex")
def test_every_table_compiles_and_fits_the_width_of_the_text(rendered: Callable[[str], str], tmp_path: Path) -> None:
    pages = "\\clearpage\n".join(rendered(name) for name in COMMANDS)
    head = r"\documentclass[11pt,a4paper]{article}\usepackage{booktabs}\usepackage{graphicx}\begin{document}"
    (tmp_path / "all.tex").write_text(f"{head}\n{pages}\n\\end{{document}}\n")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, errors="replace")
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull" not in done.stdout


@pytest.mark.parametrize(
    "arguments", [("solve", FIRST, "--all"), ("path", FIRST, "--direction", "1,1,1,1", "--to", "2")]
)
def test_a_caption_has_no_run_time(arguments: tuple[str, ...], lcp: Lcp) -> None:
    (caption,) = re.findall(r"\\caption\{(.*)\}", lcp(*arguments, "--format", "latex").out)
    assert caption.startswith("paper-example-1: n = 4")
    assert not re.search(r"\d (s|ms|us|\$\\mu\$s)", caption)
