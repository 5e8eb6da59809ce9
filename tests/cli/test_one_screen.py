"""What newcomers write, and what they see: M and q in two files, one line for a
mistake, tables within the terminal."""

import json
import re

import pytest

from .conftest import GOOD


def test_a_file_beside_the_report_is_announced_unless_it_is_to_be_quiet(lcp, folder):
    pytest.importorskip("matplotlib")
    path = "path good.json --direction 1,1 --to 2"
    for line in (
        "compare good.json",
        "solve --all good.json",
        "solve good.json --paths paths.svg",
        path,
        "bench good.json --method newton --budget 0",
    ):
        told = lcp(f"{line} --plot plot.svg")
        files = {
            line.removeprefix("lcp: wrote ")
            for line in told.err.splitlines()
            if line != "lcp: wrote "
        }
        assert files == {"plot.svg", *re.findall("paths.svg", line)}
        assert all((folder / file).stat().st_size for file in files)
    assert lcp(f"{path} --plot plot.svg --quiet").err == ""


@pytest.mark.parametrize("width", [60, 80, 120])
def test_the_table_of_many_keeps_to_the_width(width, lcp, folder, terminal):
    terminal(width, False)
    long = folder / "a-folder-with-a-long-name"
    long.mkdir()
    for i in range(3):
        (long / f"a-problem-with-a-long-name-{i}.json").write_text(GOOD)
    (long / "unreadable.json").write_text("{")
    shown = lcp(f"solve {long.name} none.json").out.splitlines()
    assert max(map(len, shown)) <= width
    assert not [
        word
        for word in ("name-0.json", "solved", "bad input", "infeasible")
        if word not in "\n".join(shown)
    ]
    assert [("  k" in shown[0]), ("  by" in shown[0])] == [width > 60, width == 120]


def test_a_program_fits_on_a_screen_and_its_objective_is_in_the_verdict(lcp, folder):
    n = 60
    program = {
        "c": list(range(1, n + 1)),
        "A": [[1] * n, [1, 2] * (n // 2)],
        "row_lower": [3, 4],
    }
    (folder / "program.json").write_text(json.dumps(program))
    shown = lcp("solve program.json").out.splitlines()
    assert len(shown) < 60
    assert shown[1].startswith("solved by ")
    assert "; objective 4" in shown[1]
    assert "--format csv" in "\n".join(shown)
    lcp("solve program.json -o whole.txt -q")
    assert "\nx60 " in (folder / "whole.txt").read_text()


def test_pages_that_explain_a_word_come_before_those_that_only_have_it(lcp):
    pages = [
        line.split()[0]
        for line in lcp("help tables").out.splitlines()[1:]
        if line[2] != " "
    ]
    assert pages[0] == "formats"
    assert set(pages) & {"paper", "programs"}
    assert pages.index("changes") > pages.index("speed")
