"""The unknowns of a problem may have names, which files keep and tables show; a model may have its q elsewhere."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from lcpcli import Problem, from_qp, read, write
from lcpcli.errors import ProblemError
from lcpcli.files.formats import COMPLETE

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
NAMED: dict[str, Any] = {"name": "market", "M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["north sea", "süd"]}
MODEL: dict[str, Any] = {"M": [[2, 1], [1, 2]], "names": ["wheat", "price n0"], "lower": [0, -1], "upper": 1}
COORDINATES = {"format": "coo", "shape": [2, 2], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1], "values": [2, 1, 1, 2]}
FILE = "market.json"


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path(FILE).write_text(json.dumps(NAMED))
    Path("model.json").write_text(json.dumps(MODEL))
    Path("sparse.json").write_text(json.dumps(MODEL | {"M": COORDINATES}))
    Path("whole.json").write_text(json.dumps(MODEL | {"q": [-5, 3.3]}))
    np.savez("model.npz", M=MODEL["M"], lower=MODEL["lower"], upper=[1, 1], names=MODEL["names"])
    Path("q.csv").write_text("-5\n3.3\n")


@pytest.mark.parametrize("ending", COMPLETE)
def test_files_keep_names(ending: str, lcp: Lcp) -> None:
    assert lcp("convert", FILE, "-o", f"other{ending}") == Outcome(0, "", "")
    again = read(f"other{ending}")
    assert list(again.names) == NAMED["names"]
    assert list(replace(again, name="else").names) == NAMED["names"]
    assert json.loads(lcp("convert", f"other{ending}").out)["names"] == NAMED["names"]


def test_tables_and_checks_show_names(lcp: Lcp) -> None:
    lines = lcp("solve", FILE).out.splitlines()
    assert any("north sea" in line and "süd" in line for line in lines if line.startswith("method"))
    assert "1 north sea" in lcp("check", FILE, "1,2").out
    assert "north sea" in lcp("solve", FILE, "--all").out


@pytest.mark.parametrize("ending", [".md", ".tex", ".txt"])
def test_tables_have_all_names_and_are_not_read_back(ending: str, lcp: Lcp) -> None:
    Path(FILE).write_text(json.dumps(NAMED | {"names": ["a name longer than a column", "süd"]}))
    for more in ([], ["--all"]):
        assert lcp("solve", FILE, *more, "-o", f"z{ending}").code == 0
        text = Path(f"z{ending}").read_text(encoding="utf-8")
        assert "süd" in text
        assert "a name longer than a column" in text or (more and ending == ".txt")
        for command in (["check", FILE], ["solve"]):
            outcome = lcp(*command, f"z{ending}")
            assert (outcome.code, outcome.err.count("\n")) == (2, 1)
            assert "is a result of lcp as a table, which it does not read" in outcome.err


def test_what_drops_names_says_so(lcp: Lcp) -> None:
    assert "names\n" in lcp("convert", FILE, "-o", "market.mtx").err
    assert lcp("convert", FILE, "-o", "market.csv").err == ""


def test_wrong_names_are_reported_in_one_line(lcp: Lcp) -> None:
    for names, words in (
        (["a"], "names: has 1 name for 2 unknowns; make them agree"),
        (["a", 2], "names[1]: is a number; give a text (indices count from 0)"),
        ("ab", "names: is the text 'ab'; give a list of names"),
    ):
        Path(FILE).write_text(json.dumps(NAMED | {"names": names}))
        assert lcp("solve", FILE) == Outcome(2, "", f"lcp: {FILE}: {words}\n")


def test_a_workspace_may_have_other_names_and_a_program_has_its_own() -> None:
    savemat("w.mat", {"M": NAMED["M"], "q": NAMED["q"], "names": [1.0, 2.0, 3.0]})
    assert list(read("w.mat").names) == ["", ""]
    program = from_qp(None, [1], columns=["x"])
    with pytest.raises(ProblemError, match="names: is given beside origin"):
        Problem(program.M, program.q, origin=program.origin, names=["z"])


@pytest.mark.parametrize("model", ["model.json", "sparse.json", "model.npz"])
def test_a_model_takes_q_from_another_file_and_keeps_its_bounds_and_names(model: str, lcp: Lcp) -> None:
    whole, parts = read("whole.json"), read(model, "q.csv")
    assert (parts.q.tolist(), list(parts.names)) == (whole.q.tolist(), ["wheat", "price n0"])
    assert [parts.box.lower.tolist(), parts.box.upper.tolist()] == [[0, -1], [1, 1]]
    exact = ("--exact", "--format", "json")
    shown, expected = (json.loads(lcp("solve", *files, *exact).out) for files in ([model, "q.csv"], ["whole.json"]))
    assert shown["exact"]["z"] == expected["exact"]["z"]
    assert shown["names"] == ["wheat", "price n0"]
    assert lcp("check", model, "q.csv", "1,-1", "-q").code == 0
    assert lcp("inspect", model, "q.csv").code == 0


def test_the_digits_of_q_in_its_own_file_count_in_exact_arithmetic(lcp: Lcp) -> None:
    Path("model.json").write_text('{"M": [[1]], "names": ["x"]}')
    Path("q.csv").write_text("-0.1000000000000000000000000000001\n")
    exact = json.loads(lcp("solve", "model.json", "q.csv", "--exact", "--format", "json").out)["exact"]["z"]
    assert list(map(Fraction, exact)) == [Fraction("0.1000000000000000000000000000001")]


def test_a_model_without_q_says_what_may_follow_it(lcp: Lcp) -> None:
    hint = "lcp: model.json: q: is missing; add q, or name the file of q after this one\n"
    assert lcp("solve", "model.json").err == hint
    err = lcp("solve", "whole.json", "q.csv").err
    assert err.startswith("lcp: q.csv: is not needed: whole.json contains M and q; leave it out; ")


def test_q_may_be_the_only_key_of_an_object_or_one_of_several_columns(lcp: Lcp) -> None:
    Path("q.json").write_text('{"q": [-5, 3.3]}')
    assert read("model.json", "q.json").q.tolist() == [-5, 3.3]
    assert lcp("solve", "model.json", "q.json", "-q").code == 0
    Path("M.json").write_text('{"M": [[2, 1], [1, 2]]}')
    Path("three.csv").write_text("low,mid,high\n-5,1,-1\n3.3,2,-2\n")
    lines = lcp("solve", "M.json", "three.csv", "--format", "json").out.splitlines()
    assert [json.loads(line)["problem"] for line in lines] == ["low", "mid", "high"]


HEADINGS = [["wheat", "price n0"], ["wheat", "q"], ["wheat", "Lower"], ["wheat", "1st"], ["a,b", "c"], ["wheat", ""]]


@pytest.mark.parametrize("names", HEADINGS)
def test_a_table_is_headed_by_names_that_a_header_can_hold(names: list[str], lcp: Lcp) -> None:
    header = "wheat,price n0,q" if names == HEADINGS[0] else None
    Path("p.json").write_text(json.dumps({"M": [[2, 1], [1, 2]], "q": [-5, 3], "names": names}))
    converted = lcp("convert", "p.json", "-o", "p.csv")
    assert ("left out: names" in converted.err) == (header is None)
    first = Path("p.csv").read_text().splitlines()[0]
    assert first == (header or "2.0,1.0,-5.0")
    assert read("p.csv").q.tolist() == [-5, 3]
    assert list(read("p.csv").names) == (names if header else ["", ""])
    write(Problem([[2, 1], [1, 2]], [-5, 3], lower=[0, -1], names=names), "b.csv")
    first = Path("b.csv").read_text().splitlines()[0]
    assert first == (f"{header},lower,upper" if header else "M1,M2,q,lower,upper")
    assert read("b.csv").box.lower.tolist() == [0, -1]


HEADED = {
    "wheat,price n0,q\n2,1,-5\n1,2,3\n": ["wheat", "price n0"],
    ",wheat,corn,q\na,2,1,-5\nb,1,2,3\n": ["wheat", "corn"],
    "no,wheat,corn,q\n1,2,1,-5\n2,1,2,3\n": ["wheat", "corn"],
    "wheat,corn,q,lower\n2,1,-5,0\n1,2,3,\n": ["wheat", "corn"],
    "M1,M2,q\n2,1,-5\n1,2,3\n": ["", ""],
    "a,a,q\n2,1,-5\n1,2,3\n": ["", ""],
    "2,1,-5\n1,2,3\n": ["", ""],
}


@pytest.mark.parametrize("table", HEADED)
def test_a_header_names_the_unknowns_unless_it_only_numbers_them(table: str) -> None:
    Path("t.csv").write_text(table)
    assert (list(read("t.csv").names), read("t.csv").q.tolist()) == (HEADED[table], [-5, 3])
