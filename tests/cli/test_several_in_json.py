"""Several results in one file: a list in a .json file, lines in a .jsonl file, and both
read again; and names of files that begin like numbers."""

import json

import pytest

from lcpcli.cli.problems import Runs
from lcpcli.files.formats import is_result

from .conftest import GOOD, interrupt

BOTH = "solve good.json none.json"


@pytest.mark.parametrize(
    "line",
    [
        BOTH,
        f"{BOTH} --jobs 2",
        "solve good.json absent.json",
        "solve M.csv Q.csv",
        "compare good.json --method newton --method lemke",
        "compare good.json none.json --method newton",
    ],
)
@pytest.mark.parametrize("suffix", ["json", "JSON"])
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
    # Processes add lines to a log as soon as they are known.
    lines.sort(key=lambda record: record.get("number", 0))
    assert [each["file"] for each in found] == [each["file"] for each in lines]
    assert is_result(content.encode())


def test_json_file_of_one_run_is_an_object_and_output_to_a_pipe_has_lines(lcp, folder):
    lcp("solve good.json -o out.json")
    assert isinstance(json.loads((folder / "out.json").read_text()), dict)
    assert len(lcp(f"{BOTH} --format json").records) == 2


def test_list_of_results_is_read_where_lines_are(lcp, folder):
    (folder / "other.json").write_text(GOOD.replace("5", "4"))
    line = "solve other.json good.json"
    lcp(f"{line} -o out.json")
    lcp(f"{line} -o out.jsonl")
    lcp("solve other.json --jobs 1 -o one.json")
    assert len(json.loads((folder / "one.json").read_text())) == 1
    assert lcp("check other.json one.json").code == 0
    assert lcp("solve other.json --z0 one.json -q").code == 0
    (folder / "one.json").unlink()
    for results in ("out.json", "out.jsonl"):
        assert lcp(f"check good.json {results}").code == 0
        assert lcp(f"check other.json {results}").code == 0
        assert lcp(f"solve other.json --z0 {results} -q").code == 0
        assert lcp(f"solve other.json --basis {results} -q").code == 0
    told = "file left out (results of lcp, not problems): out.json"
    assert told in lcp("solve .").err


def test_interrupted_run_leaves_a_whole_list(lcp, folder, monkeypatch):
    run, left = Runs.results, iter([1])

    def once(*given, **named):
        return run(*given, **named) if any(left) else interrupt()

    monkeypatch.setattr(Runs, "results", once)
    assert lcp(f"{BOTH} -o out.json").code == 130
    assert [
        each["status"] for each in json.loads((folder / "out.json").read_text())
    ] == ["solved"]


MINUS = {
    "solve -1.json -q": "",
    "solve -q -- -1.json": "",
    "solve -1.json -q -o -2.csv": "-2.csv",
    "solve -1.json -q --output=-.5.json": "-.5.json",
    "solve -1.json good.json -q -o -2.jsonl": "-2.jsonl",
    "solve -1.json -q --trace -o -3.csv": "-3.csv",
    "solve good.json -q --x0 -1.csv": "",
    "solve good.json -q --lower -1 --x0 -1,-2.5": "",
    "convert -1.json -o -4.csv": "-4.csv",
    "check good.json -q -- -5.csv": "",
}


@pytest.mark.parametrize("line", MINUS)
def test_file_may_have_a_name_that_begins_like_a_negative_number(line, lcp, folder):
    (folder / "-1.json").write_text(GOOD)
    (folder / "-1.csv").write_text("1\n-1\n")
    (folder / "-5.csv").write_text(f"{4 / 3}\n{7 / 3}\n")
    before = {path.name for path in folder.iterdir()}
    assert lcp(line).code == 0
    written = {path.name for path in folder.iterdir()} - before
    assert written == {MINUS[line]} - {""}
