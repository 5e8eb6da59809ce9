"""Rows and columns of CSV that are labelled by the names of the unknowns count by these, as data frames do."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from lcpcli import read
from lcpcli.errors import ProblemError

NAMES = ["a", "b", "c"]
M = {"M": [[4, -1, 0], [-1, 4, -1], [0, -1, 4]], "names": NAMES}
RIGHT = [0.25, 0.0, 0.75]  # for q = (-1, 2, -3)
WHOLE = ",a,b,c,q\nb,-1,4,-1,2\nc,0,-1,4,-3\na,4,-1,0,-1\n"  # a cycle, whose inverse is another one
MATRIX = ",a,b,c\nc,0,-1,4\na,4,-1,0\nb,-1,4,-1\n"
Q = ",q\nc,-3\na,-1\nb,2\n"
Lcp = Callable[..., Any]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.json").write_text(json.dumps(M))
    (tmp_path / "p.json").write_text(json.dumps(M | {"q": [-1, 2, -3]}))
    texts = {"whole": WHOLE, "matrix": MATRIX, "q": Q, "row": "c,b,a\n-3,2,-1\n", "blank": "name q\nc -3\na -1\nb 2\n"}
    for name, text in texts.items():
        (tmp_path / f"{name}.csv").write_text(text)
    return tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "files",
    [["whole.csv"], ["matrix.csv", "q.csv"], ["m.json", "q.csv"], ["m.json", "row.csv"], ["m.json", "blank.csv"]],
)
def test_numbers_belong_to_the_unknowns_that_their_labels_name(files: list[str], lcp: Lcp) -> None:
    record = json.loads(lcp("solve", *files, "--exact", "--format", "json").out)
    assert record["z"] == pytest.approx(RIGHT)
    assert record["exact"]["z"] == ["1/4", "0", "3/4"]


def test_several_q_with_labelled_rows_do_too(lcp: Lcp, folder: Path) -> None:
    (folder / "qs.csv").write_text(",base,tax\nc,-3,-3\na,-1,1\nb,2,2\n")
    lines = lcp("solve", "matrix.csv", "qs.csv", "--format", "json").out.splitlines()
    assert [json.loads(line)["z"] for line in lines] == [pytest.approx(RIGHT), pytest.approx([0, 0, 0.75])]


def test_bounds_starts_directions_and_answers_do_too(lcp: Lcp, folder: Path) -> None:
    (folder / "upper.csv").write_text(",upper\nc,0.5\na,none\nb,7\n")
    record = json.loads(lcp("solve", "p.json", "--upper", "upper.csv", "--format", "json").out)
    assert record["z"] == pytest.approx([0.25, 0, 0.5])
    (folder / "z.csv").write_text(",z\nc,0.75\na,0.25\nb,0\n")
    assert lcp("check", "p.json", "z.csv").code == 0
    start = ("--method", "fixed-point", "--max-iterations", "0", "--format", "json")
    assert json.loads(lcp("solve", "p.json", "--z0", "z.csv", *start).out)["z"] == pytest.approx(RIGHT)
    (folder / "d.csv").write_text(",d\nc,0\na,1\nb,0\n")
    path = json.loads(lcp("path", "p.json", "--direction", "d.csv", "--to", "2", "--format", "json").out)
    assert path["z"][-1] == pytest.approx([0, 0, 0.75])


@pytest.mark.parametrize(
    ("labels", "fault"),
    [("abd", "has the label 'd', which is not the name of an unknown"), ("abca", "has 4 labels for 3 unknowns")],
)
def test_labels_of_which_only_some_are_names_are_refused(labels: str, fault: str, lcp: Lcp, folder: Path) -> None:
    (folder / "other.csv").write_text(",q\n" + "".join(f"{label},1\n" for label in labels))
    outcome = lcp("solve", "m.json", "other.csv")
    assert outcome.code == 2
    assert outcome.err.startswith(f"lcp: other.csv: {fault}; ")


@pytest.mark.parametrize("labels", [["0", "1", "2"], ["x", "y", "u"]])
def test_labels_that_have_nothing_to_do_with_the_names_do_not_count(labels: list[str], lcp: Lcp, folder: Path) -> None:
    (folder / "other.csv").write_text(",q\n" + "{},-1\n{},2\n{},-3\n".format(*labels))
    assert json.loads(lcp("solve", "m.json", "other.csv", "--format", "json").out)["z"] == pytest.approx(RIGHT)


def test_a_sign_or_a_fraction_that_is_no_number_is_said_as_what_it_is(lcp: Lcp, folder: Path) -> None:
    for number, hint in (("\u22121", "write the minus sign as -"), ("1/3", "write the fraction as a decimal")):
        (folder / "p.csv").write_text(f"2,1,{number}\n1,2,-6\n", encoding="utf-8")
        assert lcp("solve", "p.csv").err.endswith(f"not a number; {hint}\n")


@pytest.mark.parametrize("ending", ["json", "npz", "mat"])
def test_several_q_belong_to_a_file_of_M_with_bounds_and_names(ending: str, lcp: Lcp, folder: Path) -> None:
    (folder / "m.json").write_text(json.dumps(M | {"lower": [None, 0, 0], "upper": [9, 9, 0.5], "q": [0, 0, 0]}))
    assert lcp("convert", "m.json", "-o", f"whole.{ending}").code == 0
    whole = read(f"whole.{ending}")
    given: Any = {"M": whole.M, "names": list(whole.names), "lower": whole.lower, "upper": whole.upper}
    if ending == "json":
        (folder / "alone.json").write_text(json.dumps(M | {"lower": [None, 0, 0], "upper": [9, 9, 0.5]}))
    elif ending == "npz":
        np.savez(folder / "alone.npz", **given)
    else:
        savemat(folder / "alone.mat", given | {"names": np.array(given["names"], dtype=object)})
    (folder / "qs.csv").write_text(",base,tax\nc,-3,-3\na,-1,1\nb,2,2\n")
    lines = lcp("solve", f"alone.{ending}", "qs.csv", "--format", "json").out.splitlines()
    records = [json.loads(line) for line in lines]
    assert [record["z"] for record in records] == [pytest.approx([0.25, 0, 0.5]), pytest.approx([-0.25, 0, 0.5])]
    assert [(record["problem"], record["names"]) for record in records] == [("base", NAMES), ("tax", NAMES)]
    alone = lcp("solve", f"alone.{ending}", "qs.csv", "--exact", "--format", "json").out.splitlines()
    assert [json.loads(line)["exact"]["z"] for line in alone] == [["1/4", "0", "1/2"], ["-1/4", "0", "1/2"]]


def test_a_header_may_be_a_cell_short(lcp: Lcp, folder: Path) -> None:
    (folder / "r.csv").write_text('"a" "b" "c" "q"\n"b" -1 4 -1 2\n"a" 4 -1 0 -1\n"c" 0 -1 4 -3\n')
    assert json.loads(lcp("solve", "r.csv", "--format", "json").out)["z"] == pytest.approx(RIGHT)


def test_a_first_column_that_may_be_an_index_is_remarked(lcp: Lcp, folder: Path) -> None:
    (folder / "p.csv").write_text("1,4,-1,0\n2,-1,4,-1\n3,0,-1,4\n")
    assert lcp("solve", "p.csv", "--quiet").err == ""
    line = "lcp: p.csv: the first column of M is 1, 2, 3, ...; if it numbers the rows, add a header with an empty first"
    assert lcp("solve", "p.csv").err.startswith(line)
    for text in ("1,4,-1\n2,1,0\n", "a,b,c,q\n1,4,-1,0\n2,-1,4,-1\n3,0,-1,4\n", "1,4,-1,0\n2,-1,4,-1\n4,0,-1,4\n"):
        (folder / "p.csv").write_text(text)
        assert lcp("solve", "p.csv").err == ""


def test_a_link_to_nothing_is_a_file_that_is_missing(lcp: Lcp, folder: Path) -> None:
    (folder / "nightly").mkdir()
    (folder / "nightly" / "a.json").symlink_to(folder / "gone.json")
    (folder / "nightly" / "p.json").write_text((folder / "p.json").read_text())
    outcome = lcp("solve", "nightly")
    assert outcome.code == 2
    assert "nightly/a.json: no such file; " in outcome.err


def test_bounds_beside_an_index_may_be_absent(lcp: Lcp, folder: Path) -> None:
    (folder / "p.csv").write_text(",a,b,q,lower,upper\na,2,1,-5,,1\nb,1,2,-6,0,\n")
    problem = read("p.csv")
    assert problem.lower.tolist() == [-np.inf, 0]
    assert problem.upper.tolist() == [1, np.inf]
    (folder / "p.csv").write_text(",a,b,q,lower,upper\na,2,1,,0,1\nb,1,2,-6,0,1\n")
    assert "line 2, column 4: is empty" in lcp("solve", "p.csv").err


def test_columns_of_one_name_leave_the_rows_where_they_are(folder: Path) -> None:
    (folder / "p.csv").write_text(",a,b,a,q\na,2,0,1,-1\na,0,3,0,-2\nb,1,0,4,-3\n")
    assert read("p.csv").M.tolist() == [[2, 0, 1], [0, 3, 0], [1, 0, 4]]


def test_q_and_bounds_may_stand_anywhere_beside_labelled_rows(folder: Path) -> None:
    (folder / "p.csv").write_text(",q,a,upper,b,c\nc,-3,0,9,-1,4\na,-1,4,7,-1,0\nb,2,-1,8,4,-1\n")
    problem = read("p.csv")
    assert (problem.q.tolist(), problem.upper.tolist(), problem.M.tolist()) == ([-1, 2, -3], [7, 8, 9], M["M"])


def test_a_title_above_a_table_names_nothing(folder: Path) -> None:
    (folder / "p.csv").write_text("prices,of,a market,in,May\n2,1,-5\n1,2,-6\n")
    assert list(read("p.csv").names) == ["", ""]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("A title\n2,1,-5\n1,2,-6\n", ["", ""]),
        ("A title;;\na;b;q\n2;1;-5\n1;2;-6\n", ["a", "b"]),
        ("a;b;q\n2;1;-5\n1;2;-6\n;;\n", ["a", "b"]),
        ("a;b;q;;\n2;1;-5;;\n1;2;-6;;\n", ["a", "b"]),
        ("2;1;-5;\n1;2;-6;\n", ["", ""]),
        ("2020,2021,q\n2,1,-5\n1,2,-6\n", ["2020", "2021"]),
        ("1,2,q\n2,1,-5\n1,2,-6\n", ["", ""]),
    ],
)
def test_titles_empty_ends_and_years_as_names(text: str, names: list[str], folder: Path) -> None:
    (folder / "p.csv").write_text(text)
    problem = read("p.csv")
    assert (list(problem.names), problem.M.tolist(), problem.q.tolist()) == (names, [[2, 1], [1, 2]], [-5, -6])


def test_a_header_with_a_name_too_many_is_refused(folder: Path) -> None:
    (folder / "p.csv").write_text("a,b,c,q\n2,1,-5\n1,2,-6\n")
    with pytest.raises(ProblemError, match="line 1: has 4 names above 3 columns"):
        read("p.csv")
