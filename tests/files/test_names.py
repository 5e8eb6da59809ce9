"""The unknowns of a problem may have names, which files keep and tables show."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from scipy.io import savemat

from lcpcli import Problem, from_qp, read, write
from lcpcli.errors import ProblemError
from lcpcli.files.formats import COMPLETE

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
NAMED = {"name": "market", "M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["north sea", "süd"]}


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "market.json").write_text(json.dumps(NAMED))
    return "market.json"


@pytest.mark.parametrize("ending", COMPLETE)
def test_files_keep_names(file: str, ending: str, lcp: Lcp) -> None:
    assert lcp("convert", file, "-o", f"other{ending}") == Outcome(0, "", "")
    again = read(f"other{ending}")
    assert list(again.names) == NAMED["names"]
    assert list(replace(again, name="else").names) == NAMED["names"]
    assert json.loads(lcp("convert", f"other{ending}").out)["names"] == NAMED["names"]


def test_tables_csv_and_checks_show_names(file: str, lcp: Lcp) -> None:
    lines = lcp("solve", file).out.splitlines()
    assert any("north sea" in line and "süd" in line for line in lines if line.startswith("method"))
    assert lcp("solve", file, "-o", "z.csv").code == 0
    rows = [line.split(",") for line in Path("z.csv").read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    assert [row[-1] for row in rows] == ["name", "north sea", "süd"]
    assert lcp("check", file, "z.csv").code == 0
    assert "1 north sea" in lcp("check", file, "1,2").out
    assert "north sea" in lcp("solve", file, "--all").out


@pytest.mark.parametrize("ending", [".csv", ".json"])
def test_an_answer_with_names_is_read_back(file: str, ending: str, lcp: Lcp) -> None:
    Path(file).write_text(json.dumps(NAMED | {"names": ["a name, longer than a column", "süd"]}))
    assert lcp("solve", file, "-o", f"z{ending}").code == 0
    assert "a name, longer than a column" in Path(f"z{ending}").read_text(encoding="utf-8")
    assert lcp("check", file, f"z{ending}").code == 0
    assert lcp("solve", file, "--z0", f"z{ending}", "--method", "newton").code == 0


@pytest.mark.parametrize("ending", [".md", ".tex", ".txt"])
def test_tables_have_all_names_and_are_not_read_back(file: str, ending: str, lcp: Lcp) -> None:
    Path(file).write_text(json.dumps(NAMED | {"names": ["a name longer than a column", "süd"]}))
    for more in ([], ["--all"]):
        assert lcp("solve", file, *more, "-o", f"z{ending}").code == 0
        text = Path(f"z{ending}").read_text(encoding="utf-8")
        assert "süd" in text
        assert "a name longer than a column" in text or (more and ending == ".txt")
        for command in (["check", file], ["solve"]):
            outcome = lcp(*command, f"z{ending}")
            assert (outcome.code, outcome.err.count("\n")) == (2, 1)
            assert "is a result of lcp as a table, which it does not read" in outcome.err


def test_names_are_in_all_records(file: str, lcp: Lcp) -> None:
    assert json.loads(lcp("solve", file, "--format", "json").out)["names"] == NAMED["names"]
    assert json.loads(lcp("solve", file, "--all", "--format", "json").out)["names"] == NAMED["names"]
    for arguments in (["--all"], [file]):
        lines = lcp("solve", file, *arguments, "--format", "csv").out.splitlines()
        rows = [line.split(",") for line in lines if not line.startswith("#")]
        assert [row[-1] for row in rows][:3] == ["name", "north sea", "süd"]


def test_what_drops_names_says_so(file: str, lcp: Lcp) -> None:
    assert "names\n" in lcp("convert", file, "-o", "market.mtx").err
    assert lcp("convert", file, "-o", "market.csv").err == ""


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["a"], "names: has 1 name for 2 unknowns; make them agree"),
        (["a", 2], "names[1]: is a number; give a text"),
        ("ab", "names: is the text 'ab'; give a list of names"),
    ],
)
def test_wrong_names_are_reported_in_one_line(file: str, names: object, words: str, lcp: Lcp) -> None:
    Path(file).write_text(json.dumps(NAMED | {"names": names}))
    outcome = lcp("solve", file)
    assert (outcome.code, outcome.err) == (2, f"lcp: {file}: {words}\n")


def test_a_workspace_may_have_other_names(tmp_path: Path) -> None:
    savemat(tmp_path / "w.mat", {"M": NAMED["M"], "q": NAMED["q"], "names": [1.0, 2.0, 3.0]})
    assert list(read(tmp_path / "w.mat").names) == ["", ""]


def test_programs_have_names_of_their_own(tmp_path: Path) -> None:
    program = from_qp(None, [1], columns=["x"])
    with pytest.raises(ProblemError, match="names: is given beside origin"):
        Problem(program.M, program.q, origin=program.origin, names=["z"])
    write(Problem([[1]], [-1], names=["z"]), tmp_path / "z.npz")
    assert list(read(tmp_path / "z.npz").names) == ["z"]
