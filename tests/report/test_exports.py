"""Results as JSON, CSV, Markdown and LaTeX, and in files: they parse back, and lose no digit that they had."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Trace, read, run
from lcpcli.files import contents
from lcpcli.report.latex import escape_latex
from lcpcli.report.markdown import escape_markdown

EXAMPLE = contents.shipped_path("paper-example-1.json")
TRIDIAGONAL = contents.shipped_path("tridiagonal-100.json")

Lcp = Callable[..., Any]


def test_json_is_one_object_a_run_with_all_keys(lcp: Lcp) -> None:
    lines = [json.loads(line) for line in lcp("compare", "--format", "json").out.splitlines()]
    assert [(line["problem"], line["method"]) for line in lines] == [
        (f"paper-example-{number}", method) for number in (1, 2) for method in ("fixed-point", "shi")
    ]
    keys = """version file item problem n names method package label route status message advice solved verified z w
        basis iterations evaluations residual relative_residual negligible_q error digits error_bound
        error_bound_source reference milestones warm setup_seconds solve_seconds verify_seconds seconds
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


def test_latex_is_a_booktabs_table_with_as_many_cells_a_row(lcp: Lcp) -> None:
    out = lcp("compare", TRIDIAGONAL, "--format", "latex").out
    tables = re.findall(r"\\begin\{tabular\}\{(l\w+)\}(.*?)\\end\{tabular\}", out, flags=re.DOTALL)
    assert len(tables) == 2  # the iterates and the summary
    for columns, body in tables:
        rows = [line for line in body.splitlines() if line.endswith(r"\\")]
        assert {line.count("&") + 1 for line in rows} == {len(columns)}
    assert out.count(r"\toprule") == out.count(r"\bottomrule") == 2
    assert out.count(r"\midrule") == 3
    assert out.count(r"\label{tab:tridiagonal-100}") == 1
    assert r"$z_{100}$" in out
    assert out.count("{") == out.count("}")


def test_latex_and_markdown_escape_what_they_must() -> None:
    assert escape_latex("a_b & 50% | <x> --y 1e-3") == (
        r"a\_b \& 50\% \textbar{} \textless{}x\textgreater{} -{}-y 1e-3"
    )
    assert escape_markdown("a|b\\ &lt;&#60; & $x$ ~s~ `t` *u* _v_ <w> [x] %") == (
        r"a\|b\\ \&lt;\&#60; & \$x\$ \~s\~ \`t\` \*u\* \_v\_ \<w> \[x] %"
    )
