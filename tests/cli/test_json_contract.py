"""With --format json every input has exactly one record, which its schema allows: a
solved one, one that cannot be read, and a command line that is refused."""

import io
import json
import shlex
import sys
from pathlib import Path

import pytest

import lcpcli
from lcpcli.files import json_format

from ..conftest import as_bytes
from ..seeds import few_of
from . import models
from .test_refusals import REFUSALS

jsonschema = pytest.importorskip("jsonschema")

SCHEMAS = Path(lcpcli.__file__).parent / "schemas"
FILES = {
    "good.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["a", "b"]}',
    "other.json": '{"M": [[2, 1], [1, 2]], "q": [5, -6]}',
    "mixed.json": (
        '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": [0, null], "upper": [1, null]}'
    ),
    "none.json": '{"M": [[0, 0], [0, 0]], "q": [-1, 1]}',
    "qp.json": (
        '{"Q": [[4, 1], [1, 2]], "c": [1, 1], "A": [[1, 1]], "row_lower": [1], '
        '"row_upper": [1]}'
    ),
    "qp2.json": (
        '{"Q": [[4, 1], [1, 2]], "c": [2, 1], "A": [[1, 1]], "row_lower": [1], '
        '"row_upper": [1]}'
    ),
    "unbounded.json": '{"c": [-1], "lower": [0]}',
    "game.json": '{"A": [[3, 0], [5, 1]], "B": [[3, 5], [0, 1]]}',
    "lines.jsonl": '{"M": [[2]], "q": [-1]}\n{"M": [[0]]}\n{"M": [[1]], "q": [2]}\n',
    "wrong.json": "[1, 1]",
    "broken.json": '{"M": [[1]',
    **models.FILES,
}
# Command lines, each with the schemas of its records.
COMMANDS = {
    "solve good.json --bound": "result",
    "solve mixed.json --exact": "result",
    "solve none.json --exact": "result",
    "solve paper-example-2 --method shi --trace --columns x,k": "result",
    "solve paper-example-1 --method lemke --trace": "result",
    "solve paper-example-1 --method shi --max-iterations 1": "result",
    "solve qp.json --exact": "result",
    "solve unbounded.json": "result",
    "solve game.json": "result",
    "solve market.nl": "result",
    "solve good.json none.json broken.json": "result result refused",
    "solve broken.json": "refused",
    "solve missing.json": "refused",
    "compare broken.json missing.json": "refused refused",
    "compare good.json other.json --lower zero": "refused refused",
    "compare good.json broken.json": "result result refused",
    "compare --method newton --method shi:p=3": "result result result result",
    "solve none.json --all": "solutions",
    "solve game.json --all": "solutions",
    "solve qp.json --all --exact": "solutions",
    "solve good.json --minimize a": "optimum",
    "solve none.json --maximize z1": "optimum",
    "solve qp.json --minimize z1": "optimum",
    "solve game.json --maximize '\"payoff of row\"'": "optimum",
    "check good.json wrong.json": "check",
    "check good.json 4/3,7/3 --exact": "check",
    "check qp.json 0.25,0.75": "check",
    "check game.json 0,1,0,1": "check",
    "check market.nl 2,3": "check",
    "inspect mixed.json": "inspect",
    "inspect bimatrix": "inspect",
    "inspect qp.json": "inspect",
    "inspect market.nl": "inspect-nonlinear",
    "path good.json other.json --at 0.5 --exact": "path",
    "path good.json --direction 1,1 --to 9": "path",
    "path qp.json qp2.json": "path",
    "why none.json": "why",
    "why good.json": "why",
    "bench good.json --method newton --budget 0": "bench",
    "bench broken.json --method newton --budget 0": "refused",
}
TYPED_FORMATS = ("solve", "compare", "path", "check", "inspect", "why", "bench")


def schema(name):
    return json.loads((SCHEMAS / f"{name}.json").read_text(encoding="utf-8"))


def assert_valid(record, name):
    jsonschema.Draft202012Validator(schema(name)).validate(record)


def asks_for_json(refusal):
    """The command line with --format json; None for a command without formats, or for
    a line that has one."""
    words = shlex.split(refusal.command)
    has_format = {"-f", "--format", "-o", "-q", "--", "-AMPL"} & {*words}
    is_allowed = "give --format json" in refusal.line
    of_two = refusal.command.startswith("compare good.json good.json")
    if is_allowed or of_two:
        return None
    if words[:1] and words[0] in TYPED_FORMATS and not has_format:
        return f"{refusal.command} --format json"
    return None


@pytest.mark.parametrize("command", COMMANDS)
def test_each_record_is_one_that_its_schema_allows(command, lcp, in_folder):
    for name, content in FILES.items():
        (in_folder / name).write_bytes(as_bytes(content))
    outcome = lcp(f"{command} --format json")
    records = list(map(json.loads, outcome.out.splitlines()))
    names = COMMANDS[command].split()
    assert len(records) == len(names), outcome.err
    for record, name in zip(records, names, strict=True):
        assert_valid(record, name)
        assert list(record) == list(schema(name)["properties"])
    assert ("refused" in names) == (outcome.code == 2)


IN_JSON = {
    command: refusal
    for refusal in REFUSALS
    if (command := asks_for_json(refusal)) is not None
}


def test_enough_command_lines_are_tried():
    assert len(IN_JSON) >= 75


# A few of each table, whose lines without --format json test_refusals has.
FEW = {*[*IN_JSON][::5]}


@pytest.mark.parametrize(
    "command", few_of(sorted(IN_JSON, key=lambda line: line not in FEW), len(FEW))
)
def test_a_command_line_that_is_refused_has_one_line_and_one_record(command, refused):
    refused(command, IN_JSON[command].files, records=assert_one_record)


def assert_one_record(records):
    (record,) = records
    assert_valid(record, "refused")
    where = [each for each in (record["file"], record["field"]) if each is not None]
    assert all(each in record["message"] for each in where)


@pytest.mark.parametrize(
    ("command", "file", "field"),
    [
        ("solve broken.json", "broken.json", "line 1, column 11"),
        ("solve good.json --tol 2", None, "--tol"),
        ("solve folder", "folder/lacks.json", "q[0]"),
        ("solve --lower=lacks.json good.json", "lacks.json", "--lower: lower"),
        ("solve 'good.json: a.json'", "good.json: a.json", "q[0]"),
        ("solve good.json -o no/folder.json", "no/folder.json", None),
    ],
)
def test_a_record_says_which_file_and_what_in_it(command, file, field, lcp, in_folder):
    (in_folder / "folder").mkdir()
    for name, content in FILES.items():
        (in_folder / name).write_bytes(as_bytes(content))
    lacks = '{"M": [[1]], "q": ["a"]}'
    (in_folder / "lacks.json").write_text(lacks)
    (in_folder / "good.json: a.json").write_text(lacks)
    (in_folder / "folder" / "lacks.json").write_text(lacks)
    outcome = lcp(f"{command} -f json")
    record = json.loads(outcome.out.splitlines()[-1])
    assert outcome.code == 2
    assert record["file"] == file
    assert record["field"] == field
    assert outcome.err.splitlines()[0] == f"lcp: {record['message']}"


@pytest.mark.parametrize(
    ("words", "are_asked_for"),
    [
        ("-fjson", True),
        ("--format=json", True),
        ("-onew.jsonl", True),
        ("-o new.json -f csv", False),
        ("-o new.csv", False),
        ("-qf json", False),
        ("", False),
        ("-- -f json", False),
    ],
)
def test_the_words_of_the_command_line_ask_for_the_record(
    words, are_asked_for, lcp, in_folder
):
    earlier = in_folder / "new.json"
    earlier.write_text("an earlier result")
    outcome = lcp(f"solve --tol 2 missing.json {words}")
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert bool(outcome.out) == are_asked_for
    assert earlier.read_text() == "an earlier result"


OF_LINES, OF_FOLDER = ["result", "refused", "result"], ["refused", "result"]
# Many inputs, some bad, however they come and wherever the records go.
SEVERAL = {
    "solve lines.jsonl --format json": OF_LINES,
    "solve lines.jsonl -o new.jsonl": OF_LINES,
    "solve lines.jsonl --jobs 2 -o new.json": OF_LINES,
    "solve - --format json": OF_LINES,
    "solve - -o new.json": OF_LINES,
    "solve folder --format json": OF_FOLDER,
    "solve folder -o new.json": OF_FOLDER,
    "compare folder --method newton -o new.jsonl": ["result", "refused"],
}


@pytest.mark.parametrize("command", SEVERAL)
def test_each_of_many_inputs_has_one_record_and_each_bad_one_a_line(
    command, lcp, in_folder, monkeypatch
):
    (in_folder / "folder").mkdir()
    for name in ("lines.jsonl", "folder/broken.json", "folder/good.json"):
        (in_folder / name).write_text(FILES[name.removeprefix("folder/")])
    lines = io.BytesIO(FILES["lines.jsonl"].encode())
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(lines))
    outcome = lcp(command)
    written = "".join(file.read_text() for file in in_folder.glob("new.*"))
    records = list(map(json.loads, json_format.objects_in(outcome.out + written)))
    names = SEVERAL[command]
    for record, name in zip(records, names, strict=True):
        assert_valid(record, name)
    refusals = [record["message"] for record in records if "z" not in record]
    told = outcome.err.splitlines()
    assert [line for line in told if line.removeprefix("lcp: ") in refusals] == [
        f"lcp: {refusal}" for refusal in refusals
    ]
    assert outcome.code == 2
    assert bool(refusals)


def test_a_problem_that_is_written_has_no_record_of_a_refusal(lcp):
    assert lcp("make murtty -o new.json").out == ""
