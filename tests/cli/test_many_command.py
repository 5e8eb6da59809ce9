"""Many problems: a record each, in order, whatever is wrong with some; streams; logs
that go on where they were cut."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from lcpcli.cli.problems import Runs
from lcpcli.files import atomic_write
from lcpcli.files.inputs import Input, inputs
from lcpcli.gallery import families
from lcpcli.solving import proof
from lcpcli.solving.many import solve_many

from ..conftest import FACE, Outcome
from ..seeds import few_of
from ..wordings import CANNOT_BE_WRITTEN, EMPTY, ENDS_TOO_EARLY, NO_LOG
from .conftest import GOOD, INFEASIBLE, MAIN, assert_refused, interrupt

MALFORMED = GOOD[:-1]


@pytest.fixture(autouse=True)
def files(folder):
    """The folder, with a malformed problem too."""
    (folder / "bad.json").write_text(MALFORMED)
    return folder


# Takes more iterations than one waits for.
SLOW = families.make("ray", 80, 0)
OTHERS = {
    11: (MALFORMED, "bad_input"),
    21: (INFEASIBLE, "infeasible"),
    31: (
        json.dumps({"M": SLOW.M.tolist(), "q": SLOW.q.tolist()}),
        "iteration_limit",
    ),
}


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_mixture_has_records_a_summary_and_the_exit_code_of_the_worst(
    jobs, lcp, files
):
    lines = [f'{{"M": [[2]], "q": [{-2 * k}]}}' for k in range(1, 41)]
    for k, (line, _) in OTHERS.items():
        lines[k - 1] = line
    (files / "all.jsonl").write_text("\n".join(lines))
    outcome = lcp(f"solve all.jsonl --format json --max-iterations 100 --jobs {jobs}")
    found = outcome.records
    assert outcome.code == 2
    assert [(record["file"], record["item"]) for record in found] == [
        ("all.jsonl", k) for k in range(1, 41)
    ]
    for k, record in enumerate(found, 1):
        if k in OTHERS:
            assert record["status"] == OTHERS[k][1]
        else:
            assert record["z"] == [k]
    complaint, summary = outcome.err.splitlines()
    assert complaint.startswith(
        f"lcp: all.jsonl: line 11: column 38: {ENDS_TOO_EARLY}; "
    )
    assert found[10]["message"] == complaint.removeprefix("lcp: ")
    assert (
        summary
        == "lcp: 40 problems: 37 solved, 1 bad input, 1 infeasible, 1 iteration limit"
    )


def test_a_file_of_a_byte_order_mark_and_blanks_is_an_input_error(lcp, files):
    (files / "blank.jsonl").write_text("\ufeff \n")
    error = f"lcp: blank.jsonl: {EMPTY}; give M and q, as JSON or CSV\n"
    beside = lcp("solve blank.jsonl good.json")
    assert beside.code == 2
    assert beside.err == f"{error}lcp: 2 problems: 1 bad input, 1 solved\n"


def test_memory_that_ends_costs_the_columns_that_are_left(lcp, monkeypatch):
    Path("Q.csv").write_text("1,2,3\n3,2,1\n")

    def one_of(*arguments, **options):
        yield next(solve_many(*arguments, **options))
        raise MemoryError

    monkeypatch.setattr("lcpcli.solving.many.solve_many", one_of)
    found = lcp("solve M.csv Q.csv --format json").records
    assert [record["item"] for record in found] == [1, 2, 3]
    assert ["z" in record for record in found] == [True, False, False]


LINE = f"{GOOD}\n".encode()


def test_the_first_problem_of_a_stream_does_not_wait_for_the_second_line(monkeypatch):
    def given():
        yield from (b"\n", LINE)
        pytest.fail("the next line is waited for")

    class Stream:
        buffer = given()

    monkeypatch.setattr(sys, "stdin", Stream)
    work = next(inputs(["-"], streams=True))
    assert isinstance(work, Input)
    assert work.line == 2
    assert work.read().n == 2


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("option", ["--jobs 1", "-o log.jsonl", "--resume log.jsonl"])
def test_a_problem_alone_is_a_stream_of_one(option, lcp, monkeypatch):
    class Stream:
        buffer = iter([LINE])

    monkeypatch.setattr(sys, "stdin", Stream)
    outcome = lcp(f"solve - {option}")
    assert (outcome.code, outcome.err) == (0, "lcp: 1 problem: 1 solved\n")


def test_output_to_a_file_that_is_read_is_refused(lcp, folder, monkeypatch):
    own = folder / "own.jsonl"
    own.write_bytes(LINE * 2)
    with own.open() as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        assert_refused(lcp("solve - --resume own.jsonl"))
    assert own.read_bytes() == LINE * 2
    with own.open("ab") as stdout:
        command = [sys.executable, "-c", MAIN, "solve", str(own)]
        done = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
    assert own.read_bytes() == LINE * 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_folder_of_temporary_files_is_named(lcp, in_folder, monkeypatch):
    usual = tempfile.TemporaryFile

    def full(**options):
        return usual(**options) if options else Path("/dev/full").open("w+b")

    (in_folder / "two.jsonl").write_bytes(LINE * 2)
    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    told = (
        f"cannot be collected in {tempfile.gettempdir()} (No space left on device); "
        "set TMPDIR to a folder with enough space"
    )
    assert_refused(lcp("solve two.jsonl -o out.csv"), f"lcp: out.csv: {told}\n")
    assert not (in_folder / "out.csv").exists()


BOTH = "solve good.json none.json"


def records_of(text):
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture
def written(lcp, folder):
    """A log of good.json and none.json."""
    lcp(f"{BOTH} -o log.jsonl")
    return folder / "log.jsonl"


def test_a_log_goes_on_where_it_was_cut_off_and_counts_what_it_had(lcp, folder):
    (folder / "two.jsonl").write_text(f"{GOOD}\n{GOOD.replace('5', '4')}\n")
    (folder / "Q.csv").write_text("a,b,c,d\n-3,-2,-1,0\n1,2,3,4\n")
    files = "good.json two.jsonl M.csv Q.csv"
    assert lcp(f"solve {files} -o log.jsonl").code == 0
    path = folder / "log.jsonl"
    whole = path.read_text().splitlines(keepends=True)
    unfinished = whole[4].replace('"solved"', '"interrupted"')
    cuts = [
        "",
        "".join(whole[:1]),
        "".join(whole[:4]) + whole[4][:50],
        "".join(whole[:4]) + unfinished,
        "".join(whole),
    ]
    for cut in cuts:
        path.write_text(cut)
        outcome = lcp(f"solve {files} --resume log.jsonl")
        assert outcome == Outcome(0, "", "lcp: 7 problems: 7 solved\n")
        places, expected = (
            [
                tuple(each[key] for key in ("file", "item", "problem", "z"))
                for each in records_of(text)
            ]
            for text in (path.read_text(), "".join(whole))
        )
        assert places == expected
    (folder / "bad.json").write_text(GOOD[:-1])
    path.unlink()
    lcp("solve bad.json good.json -o log.jsonl")
    outcome = lcp("solve bad.json good.json none.json --resume log.jsonl")
    assert outcome.code == 2
    assert outcome.err == "lcp: 3 problems: 1 bad input, 1 solved, 1 infeasible\n"
    assert len(path.read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("solve other.json", "a problem other than other.json as number 1"),
        (f"{BOTH} --tol 1e-8", "tol 1e-10"),
        (f"{BOTH} --method lemke", "method auto"),
        (f"{BOTH} --exact", "exact none, but here it is True"),
    ],
)
def test_a_log_of_something_else_is_refused_and_kept(line, words, lcp, written):
    text = written.read_text()
    Path("other.json").write_text(GOOD.replace("5", "4"))
    assert_refused(lcp(f"{line} --resume log.jsonl"), words)
    assert written.read_text() == text


DAMAGED = "good.json that is damaged"


@pytest.mark.parametrize(
    ("was", "becomes", "words"),
    [
        ('"given": {', '"given": {"exact": "True", ', "exact True, but here it is"),
        ('"given": {', '"given": ["a", {', NO_LOG),
        ('"status": "solved"', '"status": "fine"', DAMAGED),
        ('"status": "solved"', '"status": null', DAMAGED),
        ('"exact": null', '"exact": {}', DAMAGED),
        ('"number": 1,', '"number": 0,', DAMAGED),
        ('"number": 1,', '"number": [1],', DAMAGED),
        ('"item": null', '"item": [2]', "[2] that is damaged"),
        ('"file": "good', '"file": {"a": 1}, "is": "good', "is damaged"),
        ('"digest": "', '"digest": [1], "is": "', DAMAGED),
        (', "number": 1', "", f"log.jsonl: {NO_LOG}"),
    ],
)
def test_a_log_that_was_edited_is_refused_and_kept(was, becomes, words, lcp, written):
    text = written.read_text()
    assert was in text
    written.write_text(text := text.replace(was, becomes, 1))
    assert_refused(lcp(f"{BOTH} --resume log.jsonl"), words)
    assert written.read_text() == text


def test_a_log_has_files_of_any_name_and_goes_on_after_them(lcp, folder):
    name = os.fsdecode(b"odd\xff.json")
    try:
        (folder / name).write_text(GOOD)
    except OSError:
        pytest.skip("no such names on this system")
    assert lcp(f"solve {name} good.json -o log.jsonl").code == 0
    assert lcp(f"solve {name} good.json none.json --resume log.jsonl").code == 3
    files = [each["file"] for each in records_of((folder / "log.jsonl").read_text())]
    assert files == [name, "good.json", "none.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_disk_is_told_of_the_log(lcp, folder):
    (folder / "log.jsonl").symlink_to("/dev/full")
    told = f"lcp: log.jsonl: {CANNOT_BE_WRITTEN}".format("No space left on device")
    assert_refused(lcp(f"{BOTH} -o log.jsonl"), told)


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
@pytest.mark.parametrize("option", ["--output", "--resume"])
def test_a_log_that_another_run_writes_is_left_to_it(option, lcp, written):
    before = written.read_text()
    with atomic_write.open_log("log.jsonl", anew=False):
        assert_refused(
            lcp(f"{BOTH} {option} log.jsonl"),
            "log.jsonl: is being written by another run",
        )
    assert written.read_text() == before


def test_a_resumed_run_without_a_proof_has_its_exit_code(lcp, folder, monkeypatch):
    monkeypatch.setattr(proof, "EXACT_SEARCH_EFFORT", 0.0)
    (folder / "face.json").write_text(FACE)
    assert lcp("solve good.json face.json --exact -o log.jsonl").code == 1
    assert records_of((folder / "log.jsonl").read_text())[1]["exact"]["status"] is None
    assert lcp("solve good.json face.json --exact --resume log.jsonl").code == 1


def test_a_problem_that_has_changed_is_solved_again_once_its_line_is_gone(lcp, written):
    lines = written.read_text().splitlines(keepends=True)
    Path("good.json").write_text(GOOD.replace("5", "4"))
    told = (
        "has a result of good.json as it was before it changed; give the same "
        "files, delete its line to solve it again"
    )
    assert_refused(lcp(f"{BOTH} --resume log.jsonl"), told)
    assert written.read_text() == "".join(lines)
    written.write_text(lines[1])
    assert (
        lcp(f"{BOTH} --resume log.jsonl").err
        == "lcp: 2 problems: 1 infeasible, 1 solved\n"
    )
    assert [each["number"] for each in records_of(written.read_text())] == [2, 1]


def place_of(record):
    item = record["item"]
    return record["file"] + ("" if item is None else f":{item}")


# By what is given to the first run and then to the second one: what this solves, and
# what it names as gone or changed.
A, B, C, D = (f"{GOOD.replace('5', digit)}\n" for digit in "1234")
RESUMED = {
    "added at the end": ({"b": A, "c": B}, {"b": A, "c": B, "d": C}, ["d"], []),
    "added twice": ({"b": A}, {"a": C, "b": A, "c": A}, ["a", "c"], []),
    "added and removed": ({"a": A, "b": B}, {"b": B, "c": C}, ["c"], ["a"]),
    "line added": ({"l": A + B}, {"l": A + C + B}, ["l:2"], []),
    "line repeated": ({"l": A + B}, {"l": A + B + A}, ["l:3"], []),
    "line removed": ({"l": A + B + C}, {"l": A + C}, [], ["l:2"]),
    "line changed": ({"l": A + B + C}, {"l": A + D + C}, ["l:2"], ["l:2"]),
}


@pytest.mark.parametrize(
    ("case", "jobs"),
    [*((case, "1") for case in RESUMED), *few_of(((case, "2") for case in RESUMED), 0)],
)
def test_run_that_is_resumed_solves_what_was_added_and_names_what_is_gone(
    case, jobs, lcp, folder
):
    before, after, new, gone = RESUMED[case]
    (folder / "in").mkdir()
    codes = []
    for files, option in ((before, "-o"), (after, "--resume")):
        for file in (folder / "in").iterdir():
            file.unlink()
        for name, text in files.items():
            ending = "jsonl" if name == "l" else "json"
            (folder / "in" / f"{name}.{ending}").write_text(text)
        given = "in/l.jsonl" if "l" in files else "in"
        outcome = lcp(f"solve {given} --jobs {jobs} {option} log.jsonl")
        codes.append(outcome.code)
    assert codes == [0, 0]
    log = records_of((folder / "log.jsonl").read_text())
    places = [place_of(record) for record in log]
    count = sum(text.count("\n") for text in before.values())
    full = [f"in/{name.replace('l', 'l.jsonl')}" for name in new]
    full = [name if ".jsonl" in name else f"{name}.json" for name in full]
    assert sorted(places[count:]) == full
    numbers = [record["number"] for record in log]
    assert len(set(numbers)) == len(numbers)
    named = outcome.err.count("\n") - 1
    assert named == bool(gone)
    for name in gone:
        file, _, item = name.partition(":")
        assert f"in/{file}.json" + ("l:" + item if item else "") in outcome.err
    again = lcp(f"solve {given} --resume log.jsonl")
    assert records_of((folder / "log.jsonl").read_text()) == log
    assert again.err == outcome.err


@pytest.mark.parametrize("gone", [[0], [1, 2], [0, 1, 2, 3]])
def test_equal_lines_have_a_record_each_in_whichever_order_they_were_written(
    gone, lcp, folder
):
    """As several processes write them, whose run is ended before all are there."""
    (folder / "equal.jsonl").write_text(5 * A)
    log = folder / "log.jsonl"
    assert lcp("solve equal.jsonl -o log.jsonl").code == 0
    lines = log.read_text().splitlines(keepends=True)
    left = [line for at, line in enumerate(lines) if at not in gone]
    for order in (left, left[::-1]):
        log.write_text("".join(order))
        assert lcp("solve equal.jsonl --resume log.jsonl").code == 0
        records = records_of(log.read_text())
        for key in ("item", "number"):
            assert sorted(record[key] for record in records) == [1, 2, 3, 4, 5]


def test_log_goes_on_after_all_files_have_moved_if_none_has_been_added(
    lcp, written, folder
):
    (folder / "moved").mkdir()
    for name in ("good.json", "none.json"):
        (folder / name).rename(folder / "moved" / name)
    moved = [f"moved/{name}" for name in ("good.json", "none.json")]
    outcome = lcp("solve", *moved, "--resume", "log.jsonl")
    assert outcome.err == "lcp: 2 problems: 1 solved, 1 infeasible\n"
    assert len(written.read_text().splitlines()) == 2


def test_summary_of_an_interrupted_run_says_how_many_have_a_result(
    lcp, monkeypatch, folder
):
    (folder / "Q.csv").write_text("a,b,c\n-1,-2,-3\n-1,1,2\n")
    run, left = Runs.results, iter([1])
    monkeypatch.setattr(
        Runs,
        "results",
        lambda *given, **named: run(*given, **named) if any(left) else interrupt(),
    )
    outcome = lcp("solve good.json good.json - M.csv Q.csv")
    told = (
        "lcp: 1 problem: 1 solved; interrupted; with -o FILE.jsonl it could be "
        "resumed\n"
    )
    assert outcome.code == 130
    assert outcome.err == told
