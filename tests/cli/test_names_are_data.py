"""Names of problems and of unknowns reach no terminal, table or figure as anything but text."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any
from xml.dom import minidom

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli.errors import readable

Lcp = Callable[..., Any]
HOSTILE = "a\x1b]52;c;ZXZpbA==\x07b\nc\r\x9b31m\u202ed\u2028e\ufffe[bold]|$%<b>"
PLAIN = "abcde"
OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ufffe\ud800-\udfff]")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for kind, name in (("hostile", HOSTILE), ("plain", PLAIN)):
        names = [name, name + "2"]
        problem = {"name": name, "M": [[2, 1], [1, 2]], "q": [-5, -6], "names": names, "solution": [1, 1]}
        program = {"name": name, "Q": [[2, 0], [0, 2]], "c": [-1, -1], "columns": names}
        game = {"name": name, "A": [[1, 0], [0, 1]], "B": [[0, 1], [1, 0]], "rows": names, "columns": names}
        for what, data in (("p", problem), ("qp", program), ("game", game)):
            (tmp_path / f"{kind}-{what}.json").write_text(json.dumps(data))
        to = {**problem, "q": [5, 6]}
        del to["solution"]
        (tmp_path / f"{kind}-to.json").write_text(json.dumps(to))
        (tmp_path / f"{kind}-x.json").write_text(json.dumps({"z": [1, 1]}))
    return tmp_path


COMMANDS = [
    "solve {0}-p.json",
    "solve {0}-p.json --exact",
    "solve {0}-p.json --trace",
    "solve {0}-p.json --all",
    "solve {0}-qp.json",
    "solve {0}-game.json --all",
    "solve {0}-p.json {0}-qp.json",
    "compare {0}-p.json",
    "path {0}-to.json {0}-p.json",
    "path {0}-qp.json --direction 1,1 --to 2",
]


@pytest.mark.parametrize("form", ["table", "markdown", "latex", "html"])
@pytest.mark.parametrize("words", COMMANDS)
def test_nothing_that_a_terminal_obeys_is_shown(words: str, form: str, lcp: Lcp) -> None:
    if form != "table" and "{0}-qp.json" in words.split()[1:3] and "{0}-p.json" in words:
        pytest.skip("several problems have tables only")
    outcomes = {}
    for kind in ("hostile", "plain"):
        outcomes[kind] = outcome = lcp(*words.format(kind).split(), "--format", form)
        assert not OBEYED.search(outcome.out + outcome.err)
    assert outcomes["hostile"].code == outcomes["plain"].code
    if form in ("markdown", "latex"):
        assert outcomes["hostile"].out.count("\n") == outcomes["plain"].out.count("\n")


@pytest.mark.parametrize("words", ["check {0}-p.json 1,1", "inspect {0}-p.json", "check {0}-game.json 1,0,1,0"])
def test_checks_and_inspections_show_text(words: str, lcp: Lcp) -> None:
    outcome = lcp(*words.format("hostile").split())
    assert not OBEYED.search(outcome.out + outcome.err)


def test_a_key_forges_no_line_of_a_message(lcp: Lcp, folder: Path) -> None:
    (folder / "key.json").write_text(json.dumps({"M": [[1]], "q": [1], "a\nlcp: solved": 1}))
    (folder / "p.json").write_text('{"M": [[1]], "q": [1]}')
    for files in (["key.json"], ["key.json", "p.json"]):
        outcome = lcp("solve", *files)
        assert "a\\nlcp: solved" in outcome.err
        assert not re.search("^lcp: solved", outcome.err, re.MULTILINE)


def test_json_and_csv_have_the_exact_names(lcp: Lcp) -> None:
    found = lcp("solve", "hostile-p.json", "--format", "json").out
    assert not OBEYED.search(found.rstrip("\n").replace("\ufffe", ""))
    assert json.loads(found)["names"] == [HOSTILE, HOSTILE + "2"]
    text = lcp("solve", "hostile-p.json", "--format", "csv").out
    rows = list(csv.reader(StringIO("".join(text.split("\n", 2)[2]), newline="")))
    names = [cell for row in csv.reader(StringIO(text, newline="")) for cell in row if cell.startswith("a\x1b")]
    assert rows
    assert names == [HOSTILE, HOSTILE + "2"]


def test_figures_are_valid_with_any_name(lcp: Lcp, folder: Path) -> None:
    pytest.importorskip("matplotlib")
    assert lcp("solve", "hostile-p.json", "--plot", "run.svg", "-q").code == 0
    assert lcp("path", "hostile-to.json", "hostile-p.json", "--plot", "path.svg", "-q").code == 0
    for name in ("run.svg", "path.svg"):
        minidom.parse(str(folder / name))


@given(st.text())
def test_readable_texts_have_no_character_that_is_obeyed(text: str) -> None:
    found = readable(text)
    assert not OBEYED.search(found)
    assert "\n" not in found


@pytest.mark.parametrize(
    "text", ["x1", "Müller & Söhne", "価格", "приход", "a\\b", "50 % <b>", "naïve café \U0001f600"]
)
def test_ordinary_texts_stay_as_they_are(text: str) -> None:
    assert readable(text) == text
