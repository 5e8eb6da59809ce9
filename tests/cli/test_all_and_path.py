"""lcp solve --all and lcp path: every solution or breakpoint in every format, every
end, and the exit codes."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import lcpcli
from lcpcli.enumeration.search import SolutionSet
from lcpcli.files import contents
from lcpcli.files.inputs import Input
from lcpcli.interrupts import TimeIsUp
from lcpcli.report import plotting, solutions
from lcpcli.report.figures import plane_figures

from .conftest import Lcp, record

PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "faces": '{"M": [[0, 1], [0, 0]], "q": [-1, 0]}',
    "none": '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}',
    "one": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "line": '{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}',
    "game": '{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}',
    "both": '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]]}',
    "first": '{"M": [[2, 1], [1, 2]], "q": [1, 1]}',  # from here on the ends of paths
    "last": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
    "other": '{"M": [[2, 1], [1, 3]], "q": [-5, -6]}',
    "larger": '{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [1, 1, 1]}',
    "bounded": '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": [1, null]}',
    "back": '{"M": [[-1]], "q": [2]}',
    "beyond": '{"M": [[-1]], "q": [-2]}',
}


@pytest.fixture(autouse=True)
def _files(in_folder: Path) -> None:
    for name, text in PROBLEMS.items():
        (in_folder / f"{name}.json").write_text(text)
    for name, text in {
        "M": "2,1\n1,2\n",
        "q0": "1,1\n",
        "q1": "-5,-6\n",
        "d": "-6\n-7\n",
    }.items():
        (in_folder / f"{name}.csv").write_text(text)


def test_list_that_is_as_long_as_was_asked_for_says_whether_there_are_others(
    session: Callable[..., None],
) -> None:
    Path("connected.json").write_text(
        '{"A": [[1, 0], [0, 0], [1, 0]], "B": [[1, 0], [1, 1], [1, 1]]}'
    )
    session("as-many-as-asked-for")


def test_list_that_is_stopped_while_numbers_are_read_is_none(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    def reading_until_the_limit(_: Input) -> None:
        raise TimeIsUp

    monkeypatch.setattr(Input, "exact_parts", reading_until_the_limit)
    late = lcp("solve", "murty.json", "--all", "--time-limit", "9", "--format", "json")
    assert (late.code, record(late)["status"], record(late)["complete"]) == (
        1,
        "time_limit",
        False,
    )


@pytest.mark.parametrize(
    ("name", "holding"), [("murty", "0111"), ("faces", "0011"), ("none", "0000")]
)
def test_picture_marks_cones_that_hold_q(
    name: str, holding: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    drawn: list[SolutionSet] = []
    usual = plotting.cones

    def kept(found: SolutionSet) -> plotting.Picture:
        drawn.append(found)
        return usual(found)

    monkeypatch.setattr(plotting, "cones", kept)
    lcp("solve", f"{name}.json", "--all", "--plot", "cones.svg")
    found = drawn[0]
    assert Path("cones.svg").read_text().startswith("<?xml")
    assert plane_figures.holding(found) == [mark == "1" for mark in holding]
    assert (
        "1" not in holding or found.count in lcp("solve", f"{name}.json", "--all").out
    )


@pytest.mark.parametrize("name", ["murty", "both"])
def test_long_table_is_cut_and_says_so(
    name: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = lcp("solve", f"{name}.json", "--all").out.split("\n\n")
    monkeypatch.setattr(solutions, "MOST_LINES", 2)
    monkeypatch.setattr(solutions.wording, "LINE_ENTRIES", 1)
    head, rows = lcp("solve", f"{name}.json", "--all").out.split("\n\n")
    assert re.search(
        r"the first 2 of [34] rows; --format json and csv have all of them", head
    )
    shown, expected = (
        [line.split() for line in text.splitlines()[:-1] if "--" not in line]
        for text in (rows, whole[1])
    )
    assert shown[1:] == expected[1:3]
    assert ("subsets {1, 2}, ...: any" in " ".join(head.split())) == (name == "both")


def test_a_path_of_the_command_is_that_of_python(lcp: Lcp) -> None:
    found = record(lcp("path", "first.json", "last.json", "--format", "json"))
    own = lcpcli.path(lcpcli.read("first.json"), lcpcli.read("last.json")).to_dict()
    assert own.keys() == found.keys()
    assert {**found, "file": None, "to_file": None, "seconds": 0} == {
        **own,
        "seconds": 0,
    }


def test_paths_to_every_end_are_the_same_as_before(
    session: Callable[..., None],
) -> None:
    pytest.importorskip("flint")
    Path("0.6,1").mkdir()  # the folder of a file of this name
    for name, text in {"0.6,1/10": "not numbers", "e.csv": "-0.1\n"}.items():
        Path(name).write_text(text)
    for name, q in (("a", "0.1"), ("b", "-0.1")):
        Path(f"{name}.json").write_text(f'{{"M": [[0.3]], "q": [{q}]}}')
    program = Path(contents.shipped_path("programs/portfolio.json")).read_text()
    for name, least in (("from", "0.05"), ("to", "0.12")):
        limits = f'"row_lower": [1, {least}], "row_upper": [1, null], "upper"'
        Path(f"{name}.json").write_text(
            re.sub(r'"row_lower".*"upper"', limits, program, flags=re.DOTALL)
        )
    session("paths")
