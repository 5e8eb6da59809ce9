"""Several results in one file: a list in a .json file, lines in a .jsonl file, and both
read again; and names of files that begin like numbers."""

import json

from lcpcli.cli.problems import Runs

from .conftest import interrupt

BOTH = "solve good.json none.json"


def test_interrupted_run_leaves_a_whole_list(lcp, folder, monkeypatch):
    run, left = Runs.results, iter([1])

    def once(*given, **named):
        return run(*given, **named) if any(left) else interrupt()

    monkeypatch.setattr(Runs, "results", once)
    assert lcp(f"{BOTH} -o out.json").code == 130
    assert [
        each["status"] for each in json.loads((folder / "out.json").read_text())
    ] == ["solved"]


def test_a_list_in_a_file_has_a_record_in_each_line(lcp, folder):
    """Also where the suffix is in capitals."""
    lcp(f"{BOTH} -o out.JSON")
    begin, *lines, end = (folder / "out.JSON").read_text().splitlines()
    assert (begin, end) == ("[", "]")
    files = [json.loads(line.removesuffix(","))["file"] for line in lines]
    assert files == BOTH.split()[1:]
