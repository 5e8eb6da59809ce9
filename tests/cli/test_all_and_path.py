"""lcp solve --all and lcp path: a list that is stopped or cut, and the path that
Python finds."""

import re

import pytest

from lcpcli.files.inputs import Input
from lcpcli.interrupts import TimeIsUp
from lcpcli.report import solutions

PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "both": '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]]}',
}


@pytest.fixture(autouse=True)
def _files(in_folder):
    for name, text in PROBLEMS.items():
        (in_folder / f"{name}.json").write_text(text)


@pytest.mark.parametrize("most", ["", "--max-solutions 3"])
def test_list_that_is_stopped_while_numbers_are_read_is_none(most, lcp, monkeypatch):
    def reading_until_the_limit(*_):
        raise TimeIsUp

    monkeypatch.setattr(Input, "exactly", reading_until_the_limit)
    options = f"--all --time-limit 9 {most} --format json".split()
    late = lcp("solve", "murty.json", *options)
    assert (late.code, late.record["status"], late.record["complete"]) == (
        1,
        "time_limit",
        False,
    )


@pytest.mark.parametrize("name", ["murty", "both"])
def test_long_table_is_cut_and_says_so(name, lcp, monkeypatch):
    whole = lcp(f"solve {name}.json --all").out.split("\n\n")
    monkeypatch.setattr(solutions, "MAX_LINES", 2)
    monkeypatch.setattr(solutions.wording, "LINE_ENTRIES", 1)
    head, rows = lcp(f"solve {name}.json --all").out.split("\n\n")
    assert re.search(
        r"the first 2 of [34] rows; --format json and csv have all of them", head
    )
    shown, expected = (
        [line.split() for line in text.splitlines()[:-1] if "--" not in line]
        for text in (rows, whole[1])
    )
    assert shown[1:] == expected[1:3]
    assert ("subsets {1, 2}, ...: any" in " ".join(head.split())) == (name == "both")
