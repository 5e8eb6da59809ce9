"""`lcp path`: from one problem to another one or in a direction, to every end, in every format."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.cli import path as command
from lcpcli.files import contents, writing

from .conftest import Lcp, assert_refused, record

M = [[2, 1], [1, 2]]


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two problems that have one M, and with others."""
    monkeypatch.chdir(tmp_path)
    problems = {
        "first": Problem(M, [1, 1]),
        "last": Problem(M, [-5, -6]),
        "other": Problem([[2, 1], [1, 3]], [-5, -6]),
        "larger": Problem(np.eye(3), [1, 1, 1]),
        "bounded": Problem(M, [-5, -6], upper=[1, np.inf]),
        "back": Problem([[-1]], [2]),
        "beyond": Problem([[-1]], [-2]),
    }
    for name, problem in problems.items():
        writing.write(problem, f"{name}.json")
    for name, text in {"M": "2,1\n1,2\n", "q0": "1,1\n", "q1": "-5,-6\n", "d": "-6\n-7\n"}.items():
        (tmp_path / f"{name}.csv").write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        "first.json last.json",
        "M.csv q0.csv q1.csv",
        "first.json --direction d.csv --to 1",
        "M.csv q0.csv --direction d.csv --to 1",
        "first.json --direction -6,-7 --to 1",
    ],
)
def test_problems_are_given_in_files_or_by_a_direction(words: str, lcp: Lcp) -> None:
    outcome = lcp("path", *words.split(), "--format", "json")
    assert (outcome.code, outcome.err) == (0, "")
    found = record(outcome)
    assert found["t"] == pytest.approx([0, 1 / 7, 1 / 5, 1])
    assert found["z"][-1] == pytest.approx([4 / 3, 7 / 3])
    assert (found["end"], found["verified"]) == ("reached", True)
    own = lcpcli.path(lcpcli.read("first.json"), lcpcli.read("last.json")).to_dict()
    assert own.keys() == found.keys()
    if words == "first.json last.json":
        assert (found["file"], found["to_file"]) == ("first.json", "last.json")
        assert {**found, "file": None, "to_file": None, "seconds": 0} == {**own, "seconds": 0}


def test_ends_points_and_bounds_are_those_given(lcp: Lcp) -> None:
    def found(*words: str) -> dict[str, Any]:
        return record(lcp("path", "first.json", *words, "--format", "json"))

    assert found("last.json", "--from", "-1", "--to", "6")["t"] == pytest.approx([-1, 0, 0.4, 6])
    directed = found("--direction", "d.csv", "--from", "0.1", "--to", "2")
    assert directed["t"] == pytest.approx([0.1, 1 / 7, 1 / 5, 2])
    bounded = found("last.json", "--upper", "1,none")
    assert (bounded["z"][-1], bounded["basis"][-1]) == (pytest.approx([1, 2.5]), ["upper", "basic"])
    at = found("last.json", "--at", "0.6,1/10")["at"]
    assert (at["t"], at["z"][0]) == ([0.6, 0.1], pytest.approx([2 / 3, 19 / 15]))
    Path("0.6,1").mkdir()  # the folder of a file of this name
    Path("0.6,1/10").write_text("not numbers")
    shown = lcp("path", "first.json", "last.json", "--at", "0.6,1/10").out
    assert shown.splitlines()[-3].split()[0] == "0.6"


def test_fractions_are_those_of_the_numbers_as_written(lcp: Lcp, files: Path) -> None:
    (files / "a.json").write_text('{"M": [[0.3]], "q": [0.1]}')
    (files / "b.json").write_text('{"M": [[0.3]], "q": [-0.1]}')
    found = record(lcp("path", "a.json", "b.json", "--exact", "--at", "0.9", "--format", "json"))
    points = {"t": ["0", "1/2", "1"], "z": [["0"], ["0"], ["1/3"]], "w": [["1/10"], ["0"], ["0"]]}
    assert found["exact"] == {**points, "answer": None}
    assert found["at"]["z"] == [["4/15"]]
    words = ["a.json", "--direction", "-1/30", "--from", "1/3", "--to", "4"]
    found = record(lcp("path", *words, "--exact", "--format", "json"))
    assert (found["verified"], found["exact"]["t"], found["exact"]["z"][-1]) == (True, ["1/3", "3", "4"], ["1/9"])
    (files / "d.csv").write_text("-0.1\n")
    found = record(lcp("path", "a.json", "--direction", "d.csv", "--to", "2", "--exact", "--format", "json"))
    assert found["message"] == "the path reaches t = 2"
    assert found["exact"]["t"] == ["0", "1", "2"]


def test_frontier_is_exact_with_its_objective(lcp: Lcp, files: Path) -> None:
    text = Path(contents.shipped_path("programs/portfolio.json")).read_text()
    for name, least in (("from", "0.05"), ("to", "0.12")):
        limits = f'"row_lower": [1, {least}], "row_upper": [1, null], "upper"'
        (files / f"{name}.json").write_text(re.sub(r'"row_lower".*"upper"', limits, text, flags=re.DOTALL))
    words = ["path", "from.json", "to.json", "--from", "0.05", "--to", "0.12", "--exact"]
    lines = [line.split() for line in lcp(*words).out.splitlines()]
    assert ["return", "change", "shares", "bonds", "cash", "y", "budget", "y", "return", "objective"] in lines
    assert ["13/200", "y", "return", "enters", "1/8", "3/8", "1/2", "1/40", "0", "33/3200"] in lines


@pytest.mark.parametrize(
    ("words", "code", "end"),
    [
        ("first.json last.json", 0, "reached"),
        ("back.json beyond.json", 0, "turn"),
        ("back.json beyond.json --turns", 0, "returned"),
        ("beyond.json back.json", 3, "infeasible"),
        ("first.json last.json --max-breakpoints 1", 1, "breakpoint_limit"),
    ],
)
def test_exit_code_tells_the_end(words: str, code: int, end: str, lcp: Lcp) -> None:
    outcome = lcp("path", *words.split(), "--format", "json")
    assert (outcome.code, record(outcome)["end"]) == (code, end)
    assert lcp("path", *words.split(), "-q") == type(outcome)(code, "", "")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("first.json", "lcp: FROM TO: stands for 2 or 3 files, not 1; give two problems, or a file with M"),
        (
            "first.json last.json back.json --direction 1,1 --to 1",
            "lcp: --direction: takes 1 or 2 files, not 3; give one",
        ),
        ("first.json --direction 1,1", "lcp: --direction: has no end; add --to, the last t"),
        ("first.json --direction 1,1,1 --to 1", "lcp: --direction: has 3 entries for 2 unknowns"),
        ("first.json --direction 1,x --to 1", "lcp: 1,x: "),
        ("first.json other.json", "lcp: other.json: M: differs between the two problems; give two problems with one M"),
        ("first.json larger.json", "lcp: larger.json: n: is 2 and 3; give two problems with the same unknowns"),
        ("first.json bounded.json", "lcp: bounded.json: upper[0]: is finite in one problem"),
        ("first.json last.json --from 1", "lcp: --to: is 1, and the path begins at t = 1; give a larger number"),
        ("first.json last.json --to nan", "lcp: --to: has 'nan', which is not finite; give a finite number"),
        ("first.json last.json --to 1e400", "lcp: --to: is too large; give a number in double precision"),
        ("first.json --direction 1,1e300 --to 1e300", "lcp: --direction: q[1]: is not a finite number"),
        ("first.json last.json --at 2", "lcp: --at: is 2, and the path goes from 0 to 1; give values between these"),
        ("first.json last.json --at a", "lcp: --at: 'a' is not a list of numbers; write 0,0.5,1"),
        ("first.json last.json --max-breakpoints 0", "lcp: --max-breakpoints: 0 is out of range"),
        ("first.json last.json --plot -", "lcp: --plot: '-' has no known suffix of a picture; use one of .png, .svg"),
        ("first.json last.json -o json", "lcp: --output: json is a format"),
        ("first.json last.json -o a.xyz", "lcp: a.xyz: the suffix .xyz is not a format"),
        ("first.json other.json -o q0.csv", "lcp: other.json: M: differs"),
        ("- -", "lcp: standard input: can be read only once"),
    ],
)
def test_error_is_one_line_that_says_where_and_leaves_the_files(words: str, message: str, lcp: Lcp) -> None:
    assert_refused(lcp("path", *words.split()), message)
    assert Path("q0.csv").read_text() == "1,1\n"


@pytest.mark.parametrize(("suffix", "form"), [("txt", "table"), ("json", "json"), ("csv", "csv"), ("html", "html")])
def test_suffix_of_the_output_gives_its_format(suffix: str, form: str, lcp: Lcp, files: Path) -> None:
    outcome = lcp("path", "first.json", "last.json", "-o", f"path.{suffix}")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (0, "", 1)
    shown = lcp("path", "first.json", "last.json", "--format", form).out.splitlines()
    written = (files / f"path.{suffix}").read_text().splitlines()
    assert (len(written), written[0][:60]) == (len(shown), shown[0][:60])
    late = lcp("path", "first.json", "last.json", "--exact", "--time-limit", "1e-9", "--format", form)
    assert (late.code, late.err, "stopped at the time limit" in late.out) == (1, "", True)


def test_picture_is_written_whole(lcp: Lcp, files: Path) -> None:
    pytest.importorskip("matplotlib")
    before = set(files.iterdir())
    assert lcp("path", "first.json", "last.json", "--plot", "path.png").code == 0
    assert set(files.iterdir()) - before == {files / "path.png"}
    assert (files / "path.png").read_bytes().startswith(b"\x89PNG")


def test_program_that_a_direction_leaves_keeps_its_names(lcp: Lcp) -> None:
    words = ["path", "portfolio", "--to", "0.1", "--format", "json"]
    moved = record(lcp(*words, "--direction", "1,0,0,0,0,0"))
    assert moved["answer"]["columns"] == ["shares", "bonds", "cash"]
    assert moved["moving"]["name"] == "shares"
    left = record(lcp(*words, "--direction", "0,0,0,0,1,0"))  # the row of a range has no constant
    assert left["answer"] is None
    assert left["names"][:5] == ["shares", "bonds", "cash", "budget", "return"]


def test_missing_matplotlib_is_told_before_the_path(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    from lcpcli.report import plotting

    monkeypatch.setattr(plotting, "find_spec", lambda _: None)
    monkeypatch.setattr(command, "_followed", None)
    outcome = lcp("path", "first.json", "last.json", "--plot", "a.png")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "lcp: --plot: needs matplotlib; pip install 'linear-complementarity[plot]'\n"
