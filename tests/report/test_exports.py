"""Results as JSON, CSV, Markdown and LaTeX parse back and lose no digit; what every renderer owes to a document."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Trace, read, run
from lcpcli.files import contents
from lcpcli.report import latex
from lcpcli.report.document import TABLES, Document, Section, Table, typeset
from lcpcli.report.latex import escape_latex
from lcpcli.report.markdown import escape_markdown
from lcpcli.report.terminal import _folds

EXAMPLE = contents.shipped_path("paper-example-1.json")

Lcp = Callable[..., Any]


def test_json_is_one_object_a_run_with_all_keys(lcp: Lcp) -> None:
    lines = [json.loads(line) for line in lcp("compare", "--format", "json").out.splitlines()]
    assert [(line["problem"], line["method"]) for line in lines] == [
        (f"paper-example-{number}", method) for number in (1, 2) for method in ("fixed-point", "shi")
    ]
    keys = """version file item problem n names method package label route status message advice solved verified z w
        basis iterations evaluations residual relative_residual negligible_q error digits error_bound
        error_bound_source reference milestones setup_seconds solve_seconds verify_seconds seconds
        conclusion_seconds spread certificate exact answer others exactly_solvable tol max_iterations time_limit
        options trace"""
    for line in lines:
        assert list(line) == keys.split()
        assert line["trace"] is None
        assert line["seconds"] == line["setup_seconds"] + line["solve_seconds"] + line["verify_seconds"]
        problem = read(contents.shipped_path(f"{line['problem']}.json"))
        z = np.array(line["z"])
        assert np.array_equal(line["w"], problem.w(z))
        assert line["residual"] == np.abs(np.minimum(z, problem.w(z))).max()


def test_json_has_null_where_a_number_is_not_finite(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    file.write_text('{"M": [[1e300]], "q": [-1e300], "x0": [1e300]}')
    outcome = lcp("solve", str(file), "--format", "json", "--trace", "--max-iterations", "0")
    record = json.loads(outcome.out, parse_constant=lambda name: pytest.fail(name))
    assert record["residual"] == 2e300
    assert record["w"] == [None]


def table(text: str) -> list[dict[str, str]]:
    """The rows of a CSV text, without the comments before its header."""
    return list(csv.DictReader(line for line in StringIO(text) if not line.startswith("#")))


def test_csv_parses_back_to_every_digit(lcp: Lcp) -> None:
    rows = table(lcp("compare", EXAMPLE, "--format", "csv", "--trace", "--k-star", "10").out)
    trace = Trace()
    run(read(EXAMPLE), "fixed-point", trace=trace)
    kept = [row for row in rows if row["method"] == "fixed-point"]
    assert len(kept) == len(trace.rows)
    for text, row in zip(kept, trace.rows, strict=True):
        assert int(text["k"]) == row.k
        assert [float(text[f"z{i + 1}"]) for i in range(4)] == row.z.tolist()
        assert float(text["residual"]) == row.residual
        assert float(text["error"]) == row.error
    assert {row["step"] for row in rows if row["method"] == "shi"} >= {"1", "2.2", "2.4"}


def test_csv_of_problems_of_different_sizes_is_one_table(lcp: Lcp) -> None:
    arguments = ("--format", "csv", "--trace", "--max-iterations", "3")
    rows = table(lcp("compare", EXAMPLE, contents.shipped_path("bimatrix.json"), *arguments).out)
    assert all(None not in row and None not in row.values() for row in rows)
    assert rows[0]["z5"] == ""


def test_markdown_parses_back_to_the_same_cells(lcp: Lcp) -> None:
    plain = lcp("compare", EXAMPLE, "--method", "fixed-point").out.splitlines()
    marked = lcp("compare", EXAMPLE, "--method", "fixed-point", "--format", "markdown").out.splitlines()
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in marked if line.startswith("|")]
    end = next(i for i, line in enumerate(plain) if line.endswith(" status"))  # of the iterates, below three lines
    assert len({len(row) for row in table[: end - 1]}) == 1
    assert table[0][:-1] == plain[1].split()[:-1]
    assert table[2][:6] == ["fixed-point", *plain[3].split()[1:6]]
    assert table[1][0] == ":--"


def test_latex_and_markdown_escape_what_they_must() -> None:
    assert escape_latex("a_b & 50% | <x> --y 1e-3") == (
        r"a\_b \& 50\% \textbar{} \textless{}x\textgreater{} -{}-y 1e-3"
    )
    assert escape_markdown("a|b\\ &lt;&#60; & $x$ ~s~ `t` *u* _v_ <w> [x] %") == (
        r"a\|b\\ \&lt;\&#60; & \$x\$ \~s\~ \`t\` \*u\* \_v\_ \<w> \[x] %"
    )


def text_of(form: str, *tables: Table, verdict: str = "") -> str:
    return typeset(Document("t", [Section("t", verdict, True, tables=tables)]), form)


def test_names_are_no_numbers_and_no_units_in_LaTeX(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    file.write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["us", "1e5"]}')
    for options in ((), ("--all",), ("--minimize", "us")):
        text = lcp("solve", str(file), *options, "--format", "latex").out
        assert re.search(r"\bus (&|\d)", text)
        assert re.search(r"\b1e5 (&|\d)", text)
        assert "10^{5}" not in text


def test_no_control_character_of_any_part_comes_through() -> None:
    section = Section("t", "solved", True, provenance="lcp solve \x1b[2J\u202e.json")
    assert not {"\x1b", "\u202e"} & set("".join(typeset(Document("t", [section]), form) for form in TABLES))


def test_columns_of_numbers_stay_aligned_beside_a_star() -> None:
    table = Table(("method", "time", "k"), [[["lemke", "1.0", "3"], ["shi", "2.0", "5"]]], best=[(0, 1)], why="fastest")
    best, other = text_of("table", table).splitlines()[3:5]
    assert best.index("1.0") == other.index("2.0")
    assert best.index("3") == other.index("5")


def test_a_table_that_just_fits_is_not_folded() -> None:
    assert _folds([3, 3, 3], 1, 2, 13) == [[0, 1, 2]]  # 3 + 2 + 3 + 2 + 3
    assert _folds([3, 3, 3], 1, 2, 12) == [[0, 1], [0, 2]]


def test_digits_under_the_pointer_cannot_break_out_of_a_page() -> None:
    table = Table(("k",), [[["1"]]], digits=[['"><script>alert(1)</script>']])
    assert "<script>alert" not in text_of("html", table)


def test_tables_that_a_page_folds_come_last() -> None:
    text = text_of("html", Table(("a",), [[["long"]]], name="Iterates"), Table(("a",), [[["short"]]]))
    assert text.index("short") < text.index("long")


def test_a_cell_in_brackets_is_no_argument_of_the_end_of_a_row_in_LaTeX() -> None:
    text = text_of("latex", Table(("name", "k"), [[["one", "1"], ["[2]", "2"]]]))
    assert "\\\\\n[" not in text
    assert "{[}2]" in text


def test_a_long_table_and_its_notes_have_one_caption_and_one_label() -> None:
    table = Table(("k", "z1"), [[[str(k), "0.5"] for k in range(60)]])
    text = text_of("latex", table, verdict="solved")
    assert text.count(r"\label{") == text.count(r"\caption{") == 1
    assert text.count(r"\begin{longtable}") == text.count(r"\end{longtable}") == text.count(r"\endhead") == 1


def test_the_best_cells_are_those_of_the_last_group() -> None:
    table = Table(("k", "time"), [[["1", "4"]], [["2", "5"], ["3", "6"]]], best=[(1, 1)])
    text = text_of("markdown", table)
    assert "| 3 | **6** |" in text
    assert "| 1 | 4 |" in text


SECOND = contents.shipped_path("paper-example-2.json")
LARGE = contents.shipped_path("tridiagonal-100.json")
PROBLEMS = {
    "none.json": '{"name": "no_solution", "M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "names.json": '{"name": "50% of #1 & ~^{x}\\\\ <y>", "M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "program.json": '{"Q": [[4, 1], [1, 2]], "c": [1, 1], "A": [[1, 1]], "b": [1]}',
    "game.json": '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["up_1", "down"], "columns": ["a", "b"]}',
}
COMMANDS = {
    "solved": ("solve", EXAMPLE),
    "no solution": ("solve", "none.json"),
    "special characters": ("solve", "names.json"),
    "exact": ("solve", SECOND, "--exact"),
    "program": ("solve", "program-lcp.json"),
    "game": ("solve", "game-lcp.json"),
    "not solved": ("solve", EXAMPLE, "--method", "shi", "--p", "10"),
    "several problems": ("compare", EXAMPLE, LARGE),
    "sweep": ("compare", EXAMPLE, "--method", "shi", "--sweep", "p=1e4,1e8", "--sweep", "k-star=5,20"),
    "bench": ("bench", EXAMPLE, SECOND, "none.json", "--budget", "0"),
}


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
    "arguments", [("solve", EXAMPLE, "--all"), ("path", EXAMPLE, "--direction", "1,1,1,1", "--to", "2")]
)
def test_a_caption_has_no_run_time(arguments: tuple[str, ...], lcp: Lcp) -> None:
    (caption,) = re.findall(r"\\caption\{(.*)\}", lcp(*arguments, "--format", "latex").out)
    assert caption.startswith("paper-example-1: n = 4")
    assert not re.search(r"\d (s|ms|us|\$\\mu\$s)", caption)
