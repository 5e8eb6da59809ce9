"""Names are data: whatever they hold, people see it as text, a terminal obeys none of
it, and programs get it back."""

import csv
import json
import re
import unicodedata
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli import read, run
from lcpcli.cli.terminal import Line
from lcpcli.errors import LCPError, visible, visible_json
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.report.wording import short_names

from ..conftest import Outcome

HOSTILE = {
    "clipboard": "\x1b]52;c;aGk=\x07",
    "break": "a\nlcp: forged",
    "return": "b\rforged\x0b\x0c\x1c\x85",
    "c1": "\x9b31m\x7f\0\t",
    "override": "\u202ertl\u2066\u2069",
    "separators": "x\u2028y\u2029",
    "half": "\ud800",
    "no character": "\ufffe\ufdd0\U0010ffff",
    "markup": "[bold]b[/bold] :smile:",
    "signs": r"a|b\c $x$ %d 100% & ~~s~~ `t` *u* _v_ #{} --",
    "tag": "<script>x</script>&amp;",
    "quotes": "\"q\", 'r'; #s",
    "formula": "=1+1",
    "ordinary": "Süd 中文 \U0001f600 👩\u200d👧 עברית",
}
WHOLE = "".join(HOSTILE.values())
TURNS = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
PROGRAM = {"Q": [[2, 0], [0, 2]], "c": [-1, -2], "A": [[1, 1]], "row_lower": [1]}
ABOVE_AND_BELOW = {
    "A": [[1, 1], [1, 1]],
    "row_lower": [3, None],
    "row_upper": [None, 1],
}


def two(name, first="1"):
    return [f"{first}{name}", name]


KINDS = {
    "lcp": lambda name: {"M": [[2, 1], [1, 2]], "q": [-5, -6], "names": two(name)},
    "game": lambda name: {
        "A": [[3, 0], [0, 2]],
        "B": [[2, 0], [0, 3]],
        "rows": two(name),
        "columns": two(name, "2"),
    },
    "program": lambda name: {**PROGRAM, "rows": [name], "columns": two(name)},
    "without minimum": lambda name: {
        "c": [-1, -2],
        **ABOVE_AND_BELOW,
        "rows": two(name),
        "columns": two(name),
    },
}


def is_unseen(mark):
    """Whether a character is one of those that people must not get, by the tables of
    Unicode."""
    is_none = ord(mark) & 0xFFFE == 0xFFFE or 0xFDD0 <= ord(mark) <= 0xFDEF
    return (
        unicodedata.category(mark) in ("Cc", "Cs", "Zl", "Zp")
        or unicodedata.bidirectional(mark) in TURNS
        or is_none
    )


def unseen(text):
    return {mark for mark in text if is_unseen(mark) and mark != "\n"}


def put(kind, name, file="p.json", **changed):
    Path(file).write_text(json.dumps({"name": name, **KINDS[kind](name), **changed}))


PEOPLE = ("table", "markdown", "latex", "html")
COMMANDS = (
    "solve p.json",
    "solve p.json --every 1",
    "solve p.json --all",
    "compare p.json --method auto --method lemke",
)
SHOWN = [
    *(
        (kind, f"{line} --format {PEOPLE[(i + j) % 4]}")
        for i, line in enumerate(COMMANDS)
        for j, kind in enumerate(KINDS)
    ),
    ("lcp", "path p.json to.json"),
    ("lcp", "path p.json to.json --format latex"),
    ("program", "path p.json to.json --format markdown"),
    ("program", "path p.json to.json --format html"),
    ("lcp", "check p.json 1,3"),
    ("game", "check p.json 1,0,0,1"),
    ("program", "check p.json 1,1"),
    ("without minimum", "check p.json result.json"),
    ("lcp", "inspect p.json"),
]
TO = {"lcp": {"q": [-1, -6]}, "program": {"row_lower": [3]}}


def without_times(text):
    """The lines of a text without numbers, units and runs of blanks and dashes, in
    which two runs may differ."""
    text = re.sub(
        r"\$\\mu\$s|\b[mu]?s\b", "s", re.sub(r"-?\d[\d.]*(e[+-]?\d+)?", "0", text)
    )
    return [re.sub(r"[ -]+", " ", line) for line in text.split("\n")]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # No figures in pages, which take seconds.
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)
    # Which of two methods is faster may differ.
    monkeypatch.setattr("lcpcli.report.tables.STAR", "")


@given(st.text(st.characters()))
def test_what_people_see_has_no_control_characters_and_ordinary_text_stays(text):
    shown = visible(text)
    assert not unseen(shown)
    assert "\n" not in shown
    assert shown == "".join(map(visible, text)) == visible(shown)
    for mark in text:
        assert visible(mark) == (repr(mark)[1:-1] if is_unseen(mark) else mark)


@pytest.mark.parametrize(("kind", "line"), SHOWN)
def test_a_name_is_shown_as_its_escapes_are(kind, line, lcp):
    outcomes = []
    for name in (visible(WHOLE), WHOLE):
        put(kind, name)
        put(kind, name, "to.json", **TO.get(kind, {}))
        if line.endswith("result.json"):
            lcp("solve p.json --format json -o result.json")
        outcomes.append(lcp(line))
    escaped, own = outcomes
    assert own.code == escaped.code != 2
    assert not unseen(own.out + own.err)
    assert r"\x1b" in own.out.replace(r"\\", "\\").replace(r"\textbackslash{}", "\\")
    assert [without_times(own.out), without_times(own.err)] == [
        without_times(escaped.out),
        without_times(escaped.err),
    ]


def test_a_narrow_table_of_a_path_counts_escapes(lcp, monkeypatch):
    for width in (20, 29, 38):
        monkeypatch.setenv("COLUMNS", str(width))
        texts = []
        for names in (["\x1b\n", "\x9b\n"], [r"\x1b\n", r"\x9b\n"]):
            put("lcp", "", M=[[1, 0], [0, 1]], names=names)
            texts.append(lcp("path p.json --direction 1,1 --to 3").out)
        assert without_times(texts[0]) == without_times(texts[1])


def test_a_bench_shows_a_file_as_it_shows_its_escapes(lcp):
    for name in ("\x1b]52;\x9b\n|[bold]", r"\x1b]52;\x9b\n|[bold]"):
        put("lcp", WHOLE, f"{name}.json")
        record = "escaped.json" if "x1b" in name else "plain.json"
        assert (
            lcp(f"bench --budget 0 --method lemke -o {record}", f"{name}.json").code
            == 0
        )
    for form in PEOPLE:
        plain, escaped = (
            lcp(f"bench --resume {name}.json --format {form}").out
            for name in ("plain", "escaped")
        )
        assert not unseen(plain)
        assert without_times(plain) == without_times(escaped)


def test_cells_of_markdown_and_latex_stay_in_their_columns(lcp):
    put("lcp", WHOLE)
    rows = [
        line
        for line in lcp("solve p.json --format markdown").out.split("\n")
        if line[:1] == "|"
    ]
    assert {len(re.sub(r"\\.", "", row).split("|")) for row in rows} == {9}
    assert len(rows) == 3
    rows = [
        line
        for line in lcp("solve p.json --format latex").out.split("\n")
        if line.endswith(r" \\")
    ]
    assert {len(re.sub(r"\\.", "", row).split("&")) for row in rows} == {7}
    assert len(rows) == 2


def test_brackets_are_no_styles(lcp, terminal):
    terminal(900, True)
    own = [f"{text[0]}[b{i}]" for i, text in enumerate(HOSTILE.values())]
    put("lcp", "", M=np.eye(len(own)).tolist(), q=[-1] * len(own), names=own)
    out = re.sub(r"\x1b\[[\d;]*m", "", lcp("solve p.json").out)
    for name in map(visible, own):  # of z and of the heading of the iterates
        assert len([line for line in out.split("\n") if name in line]) == 2, name
    assert not unseen(out)


MESSAGES = [
    "solve 'no\x1b\nfile.json'",
    "solve p.json bad.json",
    "solve p.json --method 'a\x1b\n\u202e'",
    "solve p.json '--a\x1b\n\u202e'",
    "'a\x1b\n\u202e'",
    "solve p.json --tol '1\x9b\n'",
    "solve p.json --format '\x9b\n'",
    "solve p.json --lower '\x1b\n'",
    "solve p.json --resume 'no\x1b\n'",
    "solve p.json -o 'no\x9b\n/p.json'",
    "solve p.json --plot 'p\x9b\n'",
    "compare p.json --sweep 'p=\x1b\n'",
    "check p.json '1\x1b\n,2'",
    "check p.json results.jsonl",
    "make obstacle --set '\x1b\n=1'",
    "help '\x1b\n'",
    "make '\x1b\n'",
    "bench '\x1b\n'",
    "bench --resume '\x1b\n'",
    "convert program.json -o 'o\x1b\n.mps'",
    "solve a.mps",
    "solve a.lp",
    "solve a.mtx p.json",
]


@pytest.mark.parametrize("line", MESSAGES, ids=visible)
def test_messages_are_lines_of_this_program(line, lcp):
    put("lcp", WHOLE)
    put("lcp", WHOLE, "bad.json", **{"a\nlcp: forged\x1b": 1})
    put("program", WHOLE, "program.json")
    record = {
        "version": "0.1.0",
        "file": "\x1b\n",
        "item": None,
        "problem": "x\x1b\nlcp: forged",
        "z": [1, 2],
    }
    Path("results.jsonl").write_text(2 * (json.dumps(record) + "\n"))
    Path("a.mps").write_text("NAME \x1b\nROWS\n N obj\n \x1b\x9b r\nENDATA\n")
    Path("a.lp").write_text("Minimize\n obj: 3 \x1b 4 x\nfoo\x9b\n")
    Path("a.mtx").write_text(
        "%%MatrixMarket matrix \x1b[31m real general\n%\x9b\n1 1 1\n"
    )
    outcome = lcp(line)
    assert outcome.err
    assert not unseen(outcome.out + outcome.err)
    assert all(
        line.startswith("lcp") and not line.startswith("lcp: forged")
        for line in outcome.err.splitlines()
    )


def test_progress_shows_escapes(capsys, monkeypatch):
    monkeypatch.setattr("lcpcli.cli.terminal.PATIENCE", 0.0)
    with Line() as line:
        line.show("a\x1b\n\u202e.json", 0)
    assert r"a\x1b\n\u202e.json" in capsys.readouterr().err


def test_errors_and_objects_in_python_show_escapes():
    put("lcp", WHOLE)
    problem = read("p.json")
    result = run(problem, "lemke")
    with pytest.raises(LCPError) as caught:
        read("no\x1b\nfile.json")
    texts = [str(caught.value), repr(problem), repr(result), result._repr_html_()]
    assert not any(
        unseen(text) or r"\x1b" not in visible(text)
        for text in [*texts[:2], *texts[3:]]
    )
    assert not any(map(unseen, texts))


def test_a_name_whose_escapes_are_too_long_for_a_column_is_replaced_by_its_place():
    assert short_names(["\x1b\n", "\x1b\x1b\x1b"], 11) == ["\x1b\n", "z2"]


@given(
    st.text(st.characters()).map(
        lambda text: text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
    )
)
def test_json_gives_every_text_back_and_has_no_control_characters(text):
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
def test_json_has_the_exact_names_in_plain_characters(line, lcp):
    put("lcp", WHOLE)
    put("lcp", WHOLE, "to.json", q=[-1, -6])
    out = lcp(f"{line} --format json").out
    records = [json.loads(record) for record in out.splitlines()]
    assert records
    assert all(
        record["problem"] == WHOLE and record["names"] == [f"1{WHOLE}", WHOLE]
        for record in records
    )
    assert not unseen(out)
    if line.startswith("path"):
        assert records[0]["moving"]["name"] == f"q 1{WHOLE}"


def rows_of(text):
    """The rows of a text in CSV, by the rules of CSV, without comments."""
    rows = list(csv.reader(StringIO(text, newline="")))
    comments = [row for row in rows if row[0].startswith("#")]
    assert comments
    assert not unseen("".join(cell for row in comments for cell in row))
    return [row for row in rows if row not in comments]


WRITTEN = WHOLE.replace("\ud800", r"\ud800")  # UTF-8 has no half characters


def test_csv_has_the_exact_names(lcp):
    put("lcp", WHOLE)
    put("lcp", WHOLE, "to.json", q=[-1, -6])

    def table(*arguments):
        assert lcp(*arguments, "--format", "csv", "-o", "out.csv").code == 0
        return rows_of(Path("out.csv").read_bytes().decode())

    names = [f"1{WRITTEN}", WRITTEN]
    rows = table("solve", "p.json", "p.json")
    assert [row[-1] for row in rows] == ["name", *names, *names]
    rows = table("compare", "p.json", "--method", "shi", "--sweep", "p=100,200")
    assert {row[0] for row in rows[1:]} == {WRITTEN}
    assert {*names} < {*table("path", "p.json", "to.json")[0]}
    put("game", WHOLE, rows=[WHOLE, "b"], columns=["c", "d"])
    rows = table("solve", "p.json")
    assert [row[3] for row in rows] == ["name", WRITTEN, "b", "c", "d"]


@pytest.mark.parametrize("name", ["#", "a\n# b\n1,2", 'a"b', "-1", " a ", "a\rb", ""])
def test_csv_of_any_name_is_read_back(name, lcp):
    put("lcp", "p", names=[name, "b"])
    for more in ([], ["--all"]):
        out = lcp("solve", "p.json", *more, "--format", "csv", "-q", "-o", "z.csv")
        assert out == Outcome(0, "", "")
        assert [row[-1] for row in rows_of(Path("z.csv").read_bytes().decode())][
            1:
        ] == [name, "b"]
        assert lcp("check p.json z.csv").code == 0
    put("lcp", name)
    runs = lcp("compare p.json --method lemke --format csv -q -o z.csv")
    assert runs.code == 0  # its first column has the name
    assert lcp("solve p.json --z0 z.csv --method newton").code == 0


def test_a_terminal_gets_no_control_sequences_from_csv(lcp, monkeypatch):
    put("lcp", "", names=["\x1b[31m", "b"])
    assert "\x1b[31m" in lcp("solve p.json --format csv").out
    put("lcp", WHOLE)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    for command in ("solve", "compare"):
        out = lcp(f"{command} p.json --format csv --method lemke").out
        assert not unseen(out)
        assert r"\x1b]52;" in out


@pytest.mark.parametrize("ending", [".mps", ".mat", ".npz", ".json"])
def test_files_of_problems_keep_names_or_say_what_they_change(ending, lcp):
    put("program", "p", columns=["\x1b[31m\x9b\ud800", "b"], rows=["r"])
    outcome = lcp(f"convert p.json -o other{ending}")
    assert not unseen(outcome.err)
    if ending == ".mat":
        fault = (
            "cannot hold half a character, which a text of the problem has; write .json"
        )
        assert outcome == Outcome(2, "", f"lcp: other.mat: {fault}\n")
    else:
        assert outcome.code == 0
        own = {".mps": r"\x1b[31m\x9b\ud800"}.get(ending, "\x1b[31m\x9b\ud800")
        origin = read(f"other{ending}").origin
        assert isinstance(origin, Program)
        assert origin.columns[0] == own
    assert ("1 name had to be changed" in outcome.err) == (ending == ".mps")
