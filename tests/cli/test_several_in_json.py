"""Several results in one file: a list in a .json file, lines in a .jsonl file, and both
read again; and names of files that begin like numbers."""

import json

import pytest

from lcpcli.cli.problems import Runs
from lcpcli.files.formats import is_result

from .conftest import interrupt

BOTH = "solve good.json none.json"


@pytest.mark.parametrize(
    ("suffix", "line"),
    [
        ("json", BOTH),
        ("JSON", BOTH),
        ("json", "solve good.json absent.json"),
        ("json", "solve M.csv Q.csv"),
        ("json", "compare good.json --method newton --method lemke"),
        ("json", "compare good.json none.json --method newton"),
    ],
)
def test_json_file_of_several_runs_is_one_list_with_the_records_of_the_lines(
    suffix, line, lcp, folder
):
    (folder / "Q.csv").write_text("-5,1\n-6,2\n")
    lcp(f"{line} -o out.{suffix}")
    lcp(f"{line} -o out.jsonl")
    content = (folder / f"out.{suffix}").read_text()
    found = json.loads(content)
    lines = [*map(json.loads, (folder / "out.jsonl").read_text().splitlines())]
    assert len(found) == len(lines) == 2
    assert content.count("\n") == 4
    assert [each["file"] for each in found] == [each["file"] for each in lines]
    assert is_result(content.encode())


def test_interrupted_run_leaves_a_whole_list(lcp, folder, monkeypatch):
    run, left = Runs.results, iter([1])

    def once(*given, **named):
        return run(*given, **named) if any(left) else interrupt()

    monkeypatch.setattr(Runs, "results", once)
    assert lcp(f"{BOTH} -o out.json").code == 130
    assert [
        each["status"] for each in json.loads((folder / "out.json").read_text())
    ] == ["solved"]
