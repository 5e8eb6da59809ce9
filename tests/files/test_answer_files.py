"""Answers in files, z and w or all solutions, in CSV or JSON, which lcp reads back; iterates have their own file."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from fractions import Fraction
from io import StringIO
from pathlib import Path

import pytest

from lcpcli import Trace, read, run
from lcpcli.files import beside, contents
from lcpcli.report import plotting
from lcpcli.report.plotting import Panel
from lcpcli.report.result_csv import PROGRAM_COLUMNS

from ..cli.conftest import Lcp, assert_refused

EXAMPLE = contents.shipped_path("paper-example-2.json")

PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "faces": '{"M": [[0, 1], [0, 0]], "q": [-1, 0]}',
    "none": '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "line": '{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}',
    "both": '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]], "rows": ["go", "stay"], "columns": ["left, or", "right"]}',
}


def table(file: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in StringIO(file.read_text()) if not line.startswith("#")))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lcpcli.solving.driver.MOST_REPETITIONS", 1)  # whose times are not looked at here
    for name, text in PROBLEMS.items():
        (tmp_path / f"{name}.json").write_text(text)
    return tmp_path


def test_check_and_a_start_read_the_csv_of_one_run_or_several_back(lcp: Lcp, folder: Path) -> None:
    for command in (("solve",), ("compare", "--method", "newton", "--method", "shi:k-star=5")):
        lcp(*command, EXAMPLE, "-o", "z.csv")
        assert lcp("check", EXAMPLE, "z.csv").code == 0
        for start in ("--z0", "--x0"):
            outcome = lcp("solve", EXAMPLE, "--method", "fixed-point", start, "z.csv", "--format", "json")
            assert json.loads(outcome.out)["iterations"] == 0
    assert [(row["method"], row["component"]) for row in table(folder / "z.csv")] == [
        (run, str(i)) for run in ("newton", "shi:k-star=5") for i in (1, 2, 3, 4)
    ]


READ = {
    "one column": "0\n15/29\n17/29\n0\n",
    "one row": "0, 15/29, 17/29, 0\n",
    "headed": "z\n0\n15/29\n17/29\n0\n",
    "nodes": "node,z\nA,0\nB,15/29\nC,17/29\nD,0\n",
    "nodes without a header": "A,0\nB,15/29\nC,17/29\nD,0\n",
    "index of pandas": ",z\n0,0\n1,15/29\n2,17/29\n3,0\n",
    "index without a header": "1;0\n2;15/29\n3;17/29\n4;0\n",
    "index from 0 without a header": "0;0\n1;15/29\n2;17/29\n3;0\n",
    "decimal commas": "z;w\n0,0;1\n15/29;0\n17/29;0\n0;1,0\n",
    "w before z": "w,z\n1,0\n0,15/29\n0,17/29\n1,0\n",
    "sorted by size": "component,z\n3,17/29\n2,15/29\n1,0\n4,0\n",
}


@pytest.mark.parametrize("kind", READ)
def test_check_reads_the_tables_that_people_have(kind: str, lcp: Lcp, folder: Path) -> None:
    (folder / "z.csv").write_text(READ[kind])
    assert beside.of_table(READ[kind].encode())[0].values == [0, Fraction(15, 29), Fraction(17, 29), 0]
    assert lcp("check", EXAMPLE, "z.csv", "--exact").code == 0


@pytest.mark.usefixtures("folder")
def test_table_that_leaves_z_in_doubt_is_refused(session: Callable[[str], None]) -> None:
    session("refused-tables")


def test_trace_file_has_every_iterate_whatever_is_shown(lcp: Lcp, folder: Path) -> None:
    arguments = ("solve", EXAMPLE, "--method", "fixed-point")
    alone = lcp(*arguments).out.splitlines()
    beside = lcp(*arguments, "--trace", "t.csv").out.splitlines()
    assert [line.split()[:-1] for line in beside[6:]] == [line.split()[:-1] for line in alone[6:]]
    rows = table(folder / "t.csv")
    assert [int(row["k"]) for row in rows] == list(range(len(rows)))
    assert [row["status"] for row in rows] == [""] * (len(rows) - 1) + ["solved"]
    assert json.loads(lcp(*arguments, "--trace", "t.csv", "--format", "json").out)["trace"] is None
    assert lcp(*arguments, "-q", "--trace", "t.csv", "--every", "10").out == ""
    assert len(table(folder / "t.csv")) < len(rows) / 5


def test_a_trace_from_which_a_table_is_taken_is_thinned_as_one_that_is_kept_for_it() -> None:
    whole = Trace()
    run(read(EXAMPLE), "fixed-point", trace=whole)
    for most in (None, *range(5, 40)):
        alone = Trace(5, most)
        run(read(EXAMPLE), "fixed-point", trace=alone)
        assert [row.k for row in whole.selected(5, most, None).rows] == [row.k for row in alone.rows]


def test_no_file_is_overwritten_that_holds_no_iterates(lcp: Lcp, folder: Path) -> None:
    (folder / "own.csv").write_text("2,1,-5\n1,2,-6\n")
    for arguments in (("compare", "--trace", "own.csv"), ("solve", "--trace", "own.csv")):
        assert_refused(lcp(*arguments), "own.csv")
    assert (folder / "own.csv").read_text() == "2,1,-5\n1,2,-6\n"
    for _ in range(2):
        assert lcp("compare", EXAMPLE, "--method", "newton", "--trace", "t.csv").code == 0


def test_figure_can_be_redrawn_from_the_trace(lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the same clock from the same beginning: its points are rows of the file."""
    drawn: list[Panel] = []
    usual = plotting.convergence
    monkeypatch.setattr(plotting, "convergence", lambda panels: drawn.extend(panels) or usual(panels))
    lcp("compare", EXAMPLE, "--method", "shi", "--sweep", "k-star=5,20", "--plot", "figure.svg", "--trace", "t.csv")
    assert [curve.label for curve in drawn[0].curves] == ["shi:k-star=5", "shi:k-star=20"]
    rows = table(folder / "t.csv")
    for curve in drawn[0].curves:
        own = {int(row["k"]): row for row in rows if row["method"] == curve.label}
        for k, seconds, error in zip(curve.k, curve.seconds, curve.errors, strict=True):
            assert k is not None
            assert (seconds, error) == (float(own[k]["seconds"]), float(own[k]["error"]))
        assert curve.solved == (list(own.values())[-1]["status"] == "solved")


def test_csv_of_a_program_names_variables_and_rows_with_their_multipliers(lcp: Lcp, folder: Path) -> None:
    program = {"c": [3, 2], "A": [[1, 1], [1, 3]], "row_lower": [None, 0], "row_upper": [4, 6], "sense": "max"}
    names = {"columns": ["wheat; winter", "rye, summer"], "rows": ["New York", "land"]}
    (folder / "farm.json").write_text(json.dumps(program | names))
    assert lcp("solve", "farm.json", "-o", "farm.csv").code == 0
    rows = table(folder / "farm.csv")
    assert list(rows[0]) == ["component", "z", "w", "state", "name", *PROGRAM_COLUMNS]
    assert [row["name"] for row in rows] == ["wheat; winter", "rye, summer", "New York", "land", ""]
    assert [row["part"] for row in rows] == ["x", "x", "y", "y", "s"]
    assert [float(row["value"]) for row in rows] == [4, 0, 3, 0, 4]
    assert [float(row["bound_multiplier"]) for row in rows[:2]] == [0, -1]
    assert [(row["activity"], row["slack"]) for row in rows[1:4]] == [("", ""), ("4.0", "0.0"), ("4.0", "2.0")]
    assert lcp("check", "farm.json", "farm.csv").code == 0
    assert lcp("compare", "farm.json", "--method", "lemke", "-o", "all.csv").code == 0
    assert lcp("check", "farm.json", "all.csv").code == 0
    (folder / "unfeasible.json").write_text('{"c": [1], "A": [[1]], "row_upper": [-1], "columns": ["a b"]}')
    assert lcp("solve", "unfeasible.json", "-o", "none.csv").code == 3
    assert [(row["name"], row["part"]) for row in table(folder / "none.csv")] == [("a b", ""), ("", "")]


@pytest.mark.parametrize("exact", [[], ["--exact"]], ids=["rounded", "exact"])
@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize("name", ["murty", "faces", "line", "both", "transport"])
def test_each_solution_of_a_list_is_checked(name: str, form: str, exact: list[str], lcp: Lcp, folder: Path) -> None:
    """The lists are of an LCP, a mixed problem, a game and a program."""
    problem = f"{name}.json" if (folder / f"{name}.json").exists() else name
    assert lcp("solve", problem, "--all", *exact, "--format", form, "-o", f"all.{form}").code == 0
    outcome = lcp("check", problem, f"all.{form}", *exact, "--format", "json")
    vertices = {"murty": 3, "faces": 1 + (form == "csv"), "line": 1, "both": 3, "transport": 2}[name]
    assert (outcome.code, outcome.err, len(outcome.out.splitlines())) == (0, "", vertices)


@pytest.mark.parametrize(
    ("name", "swapped", "cell", "other"),
    [("murty", (2, 3), 4, "5"), ("both", (12, 13), 3, "")],
    ids=["z1-and-z2", "probabilities-of-two-columns"],
)
def test_wrong_solution_among_others_in_csv_is_told_apart(
    name: str, swapped: tuple[int, int], cell: int, other: str, lcp: Lcp, folder: Path
) -> None:
    assert lcp("solve", f"{name}.json", "--all", "--format", "csv", "-o", "all.csv").code == 0
    lines = (folder / "all.csv").read_text().splitlines()
    first, second = (next(csv.reader([lines[k]])) for k in swapped)
    first[cell], second[cell] = second[cell], other or first[cell]
    for k, row in zip(swapped, (first, second), strict=True):
        lines[k] = ",".join(f'"{text}"' for text in row)
    (folder / "all.csv").write_text("\n".join(lines))
    outcome = lcp("check", f"{name}.json", "all.csv", "--format", "json")
    correct = [json.loads(line)["accepted"] for line in outcome.out.splitlines()]
    assert (outcome.code, correct.count(False)) == (1, 1)


def test_file_without_solutions_or_of_strategies_is_refused_where_a_z_is_asked_for(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    lcp("solve", "none.json", "--all", "--format", "csv", "-o", "none.csv")
    assert "none.csv: contains a header and no numbers" in lcp("check", "none.json", "none.csv").err
    lcp("solve", "both.json", "--all", "--format", "csv", "-o", "game.csv")
    assert "no column headed z" in lcp("solve", "both.json", "--z0", "game.csv").err
