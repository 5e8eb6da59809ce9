"""Names are data: whatever they hold, JSON, CSV and files of problems give it back."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from io import StringIO
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli import read
from lcpcli.errors import visible_json
from lcpcli.model.program import Program

from ..conftest import Outcome
from .hostile_names import WHOLE, is_unseen, put, unseen

Lcp = Callable[..., Outcome]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@given(st.text(st.characters()).map(lambda text: text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")))
def test_json_gives_every_text_back_and_has_no_control_characters(text: str) -> None:
    line = visible_json(json.dumps(text, ensure_ascii=False))
    assert json.loads(line) == text
    assert not any(map(is_unseen, line))


@pytest.mark.parametrize(
    "line",
    [
        "solve p.json",
        "solve p.json --all",
        "solve p.json p.json",
        "compare p.json --method lemke",
        "path p.json to.json",
    ],
)
def test_json_has_the_exact_names_in_plain_characters(line: str, lcp: Lcp) -> None:
    put("lcp", WHOLE)
    put("lcp", WHOLE, "to.json", q=[-1, -6])
    out = lcp(*line.split(), "--format", "json").out
    records = [json.loads(record) for record in out.splitlines()]
    assert records
    assert all(record["problem"] == WHOLE and record["names"] == [f"1{WHOLE}", WHOLE] for record in records)
    assert not unseen(out)
    if line.startswith("path"):
        assert records[0]["moving"]["name"] == f"q 1{WHOLE}"


def rows_of(text: str) -> list[list[str]]:
    """The rows of a text in CSV, by the rules of CSV, without comments."""
    rows = list(csv.reader(StringIO(text, newline="")))
    comments = [row for row in rows if row[0].startswith("#")]
    assert comments
    assert not unseen("".join(cell for row in comments for cell in row))
    return [row for row in rows if row not in comments]


WRITTEN = WHOLE.replace("\ud800", r"\ud800")  # UTF-8 has no half characters


def test_csv_has_the_exact_names(lcp: Lcp) -> None:
    put("lcp", WHOLE)
    put("lcp", WHOLE, "to.json", q=[-1, -6])

    def table(*arguments: str) -> list[list[str]]:
        assert lcp(*arguments, "--format", "csv", "-o", "out.csv").code == 0
        return rows_of(Path("out.csv").read_bytes().decode())

    names = ["name", f"1{WRITTEN}", WRITTEN]
    assert [row[-1] for row in table("solve", "p.json")] == names
    assert [row[-1] for row in table("solve", "p.json", "--all")] == names
    assert [row[-1] for row in table("solve", "p.json", "p.json")] == [*names, *names[1:]]
    for methods in (("lemke",), ("shi", "--sweep", "p=100,200")):
        assert {row[0] for row in table("compare", "p.json", "--method", *methods)[1:]} == {WRITTEN}
    assert set(names[1:]) < set(table("path", "p.json", "to.json")[0])
    put("game", WHOLE, rows=[WHOLE, "b"], columns=["c", "d"])
    assert [row[3] for row in table("solve", "p.json")] == ["name", WRITTEN, "b", "c", "d"]
    assert lcp("solve", "p.json", "--trace", "t.csv").code == 0
    assert WRITTEN in rows_of(Path("t.csv").read_bytes().decode())[0]


@pytest.mark.parametrize("name", ["# a", "#", "a\n# b\n1,2", 'a"b', "=1+1", "-1", " a ", "a\rb", ""])
def test_csv_of_any_name_is_read_back(name: str, lcp: Lcp) -> None:
    put("lcp", "p", names=[name, "b"])
    for more in ([], ["--all"]):
        out = lcp("solve", "p.json", *more, "--format", "csv", "-q", "-o", "z.csv")
        assert out == Outcome(0, "", "")
        assert [row[-1] for row in rows_of(Path("z.csv").read_bytes().decode())][1:] == [name, "b"]
        assert lcp("check", "p.json", "z.csv").code == 0
    put("lcp", name)
    runs = lcp("compare", "p.json", "--method", "lemke", "--format", "csv", "-q", "-o", "z.csv")
    assert runs.code == 0  # its first column has the name
    assert lcp("solve", "p.json", "--z0", "z.csv", "--method", "newton").code == 0


def test_a_terminal_gets_no_control_sequences_from_csv(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    put("lcp", "", names=["\x1b[31m", "b"])
    assert "\x1b[31m" in lcp("solve", "p.json", "--format", "csv").out
    put("lcp", WHOLE)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    for command in ("solve", "compare"):
        out = lcp(command, "p.json", "--format", "csv", "--method", "lemke").out
        assert not unseen(out)
        assert r"\x1b]52;" in out


@pytest.mark.parametrize("ending", [".mps", ".mat", ".npz", ".json"])
def test_files_of_problems_keep_names_or_say_what_they_change(ending: str, lcp: Lcp) -> None:
    put("program", "p", columns=["\x1b[31m\x9b\ud800", "b"], rows=["r"])
    outcome = lcp("convert", "p.json", "-o", f"other{ending}")
    assert not unseen(outcome.err)
    if ending == ".mat":
        fault = "cannot hold half a character, which a text of the problem has; write .json"
        assert outcome == Outcome(2, "", f"lcp: other.mat: {fault}\n")
    else:
        assert outcome.code == 0
        own = {".mps": r"\x1b[31m\x9b\ud800"}.get(ending, "\x1b[31m\x9b\ud800")
        origin = read(f"other{ending}").origin
        assert isinstance(origin, Program)
        assert origin.columns[0] == own
    assert ("1 name had to be changed" in outcome.err) == (ending == ".mps")
