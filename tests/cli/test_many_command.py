"""Many problems on the command line: one record each, in order, whatever is wrong with some; streams of them."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.files import contents
from lcpcli.files.inputs import Input, inputs
from lcpcli.gallery import families

from .conftest import GOOD, INFEASIBLE, Lcp, assert_refused, records

MALFORMED = GOOD[:-1]


@pytest.fixture(autouse=True)
def files(folder: Path) -> Path:
    """The folder, with a malformed problem too."""
    (folder / "bad.json").write_text(MALFORMED)
    return folder


def random_problem(seed: int, n: int = 5) -> lcpcli.Problem:
    rng = np.random.default_rng(seed)
    M = rng.standard_normal((n, n))
    return lcpcli.Problem(M + np.diag(np.abs(M).sum(1)), rng.standard_normal(n))


def line_of(problem: lcpcli.Problem) -> str:
    return json.dumps({"M": problem.M.tolist(), "q": problem.q.tolist()})


SLOW = line_of(families.make("ray", 80, 0))  # takes more iterations than one waits for


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_mixture_has_a_record_for_each_a_summary_and_the_exit_code_of_the_worst(
    jobs: str, lcp: Lcp, files: Path
) -> None:
    lines = [line_of(random_problem(seed)) for seed in range(37)]
    for at, line in ((10, MALFORMED), (20, INFEASIBLE), (30, SLOW)):
        lines.insert(at, line)
    (files / "all.jsonl").write_text("".join(f"{line}\n" for line in lines))
    outcome = lcp("solve", "all.jsonl", "--format", "json", "--max-iterations", "100", "--jobs", jobs)
    found = records(outcome)
    assert outcome.code == 2
    assert [(record["file"], record["item"]) for record in found] == [("all.jsonl", k) for k in range(1, 41)]
    others = {k: record["status"] for k, record in enumerate(found) if record["status"] != "solved"}
    assert others == {10: "bad_input", 20: "infeasible", 30: "iteration_limit"}
    complaint, summary = outcome.err.splitlines()
    assert complaint.startswith("lcp: all.jsonl: line 11: column 38: ends too early; is the file cut off?")
    assert found[10]["message"] == complaint.removeprefix("lcp: ")
    assert summary == "lcp: 40 problems: 37 solved, 1 bad input, 1 infeasible, 1 iteration limit"
    for record in (record for record in found if record["solved"]):
        problem = random_problem(record["item"] - 1 - sum(k < record["item"] - 1 for k in others))
        assert np.allclose(record["z"], lcpcli.run(problem).z)


@pytest.mark.parametrize(
    ("files_given", "code"),
    [
        ("good.json good.json", 0),
        ("good.json none.json", 3),
        ("good.json none.json bad.json", 2),
        ("nowhere.json good.json", 2),
        ("none.json slow.json --max-iterations 100 --time-limit 1", 1),
    ],
)
def test_exit_code_of_solve_and_of_compare(files_given: str, code: int, lcp: Lcp) -> None:
    """What is unsolved comes before what is without a solution."""
    Path("slow.json").write_text(SLOW)
    assert lcp("solve", *files_given.split()).code == code
    assert lcp("compare", *files_given.split(), "--method", "auto").code == code


def test_a_bad_file_costs_a_comparison_only_its_own_result(lcp: Lcp) -> None:
    outcome = lcp("compare", "good.json", "bad.json", "good.json", "--method", "auto", "--format", "json")
    assert [record["status"] for record in records(outcome)] == ["solved", "solved", "bad_input"]
    assert outcome.err.startswith("lcp: bad.json: line 1, column 38: ends too early")


def test_files_of_M_and_q_and_whole_problems_come_in_any_order(lcp: Lcp) -> None:
    np.save("whole.npy", np.array([[2.0, 1, -5], [1, 2, -6]]))
    given = ("M.csv", "q.csv", "good.json", "M.csv", "q.csv", "whole.npy")
    found = records(lcp("solve", *given, "--format", "json"))
    assert [record["file"] for record in found] == ["M.csv", "good.json", "M.csv", "whole.npy"]
    assert all(np.allclose(record["z"], [4 / 3, 7 / 3]) for record in found)
    Path("bad.csv").write_text("2,x\n1,2\n")
    for whole in ("good.json", "bad.csv", "nowhere.csv"):
        assert_refused(lcp("solve", whole, "q.csv"))  # a vector is no problem of its own


def test_lines_come_from_standard_input(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def piped(*words: str) -> Any:
        text = "\n".join(["", GOOD, "", INFEASIBLE, GOOD])
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        return lcp("solve", "-", *words)

    outcome = piped("good.json", "--format", "json")
    found = records(outcome)
    assert [(record["file"], record["item"]) for record in found] == [
        *(("standard input", item) for item in (2, 4, 5)),
        ("good.json", None),
    ]
    assert (outcome.code, found[0]["problem"]) == (3, "standard input:2")
    heading, *rows = piped().out.splitlines()
    assert {row[heading.index("status") :].split()[0] for row in rows} == {"solved", "infeasible"}


def test_a_problem_in_json_over_several_lines_is_one_problem(lcp: Lcp) -> None:
    Path("wide.json").write_text(json.dumps(json.loads(GOOD), indent=1))
    assert lcp("solve", "wide.json").out.startswith("wide: n = 2")
    Path("one.jsonl").write_text(GOOD + "\n")
    assert lcp("solve", "one.jsonl").out.startswith("one:1: n = 2")


def columns(k: int) -> tuple[lcpcli.Problem, Any]:
    """A problem in A.csv, and k other q for it in the columns of Q, in each format."""
    problem, Q = random_problem(1), np.random.default_rng(2).standard_normal((5, k))
    np.savetxt("A.csv", problem.M, delimiter=",")
    np.savetxt("Q.csv", Q, delimiter=",", header=",".join(f"day {j}" for j in range(k)), comments="")
    np.save("Q.npy", Q)
    np.savez("Q.npz", q=Q)
    Path("Q.json").write_text(json.dumps(Q.tolist()))
    return problem, Q


@pytest.mark.parametrize(
    ("name", "options"),
    [("Q.csv", ""), ("Q.npy", "--jobs 2"), ("Q.npz", "--exact"), ("Q.json", "--method lemke"), ("Q.csv", "--trace")],
)
def test_several_q_for_one_M_are_the_columns_of_a_file(name: str, options: str, lcp: Lcp) -> None:
    problem, Q = columns(4)
    found = records(lcp("solve", "A.csv", name, "--format", "json", *options.split()))
    assert [(record["file"], record["item"]) for record in found] == [(name, j) for j in range(1, 5)]
    for record, q in zip(found, Q.T, strict=True):
        assert np.allclose(record["z"], lcpcli.solve(problem.M, q).z)
    names = [f"day {j}" if name == "Q.csv" else f"q{j + 1}" for j in range(4)]
    assert [record["problem"] for record in found] == names


def test_bounds_are_those_of_every_problem(lcp: Lcp) -> None:
    problem, Q = columns(3)
    for given in (["A.csv", "Q.csv"], ["good.json", "good.json"]):
        found = records(lcp("solve", *given, "--upper", "0.1", "--format", "json"))
        assert all(max(record["z"]) <= 0.1 for record in found)
        assert given[0] == "good.json" or np.allclose(found[1]["z"], lcpcli.solve(problem.M, Q[:, 1], upper=0.1).z)


def test_table_and_csv_have_a_part_for_each_problem(lcp: Lcp) -> None:
    table = lcp("solve", "good.json", "bad.json", "none.json").out.splitlines()
    assert [row.split()[0] for row in table] == ["problem", "good.json", "bad.json", "none.json"]
    assert table[1].split("  ")[-1] == "newton"
    text = lcp("solve", "good.json", "bad.json", "good.json", "--format", "csv").out
    heading, *rows = (line.split(",") for line in text.splitlines() if not line.startswith("#"))
    assert heading == ["problem", "component", "z", "w", "state", "name"]
    assert [(row[0], row[1]) for row in rows] == [("good.json", "1"), ("good.json", "2")] * 2


@pytest.mark.parametrize(("name", "form"), [("all.jsonl", "json"), ("all.csv", "csv"), ("all.txt", "table")])
def test_output_file_holds_what_would_be_printed(name: str, form: str, lcp: Lcp, files: Path) -> None:
    outcome = lcp("solve", "good.json", "none.json", "-o", name)
    assert (outcome.code, outcome.out) == (3, "")
    printed = lcp("solve", "good.json", "none.json", "--format", form).out
    assert len((files / name).read_text().splitlines()) == len(printed.splitlines())
    quiet = lcp("solve", "good.json", "none.json", "-q")
    assert (quiet.code, quiet.out, quiet.err) == (3, "", "")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--plot a.svg", "--plot: draws one problem"),
        ("--trace a.csv", "--trace: "),
        ("--trace", "--format json"),
        ("--format latex", "lcp compare"),
        ("--every 3", "--every: has no effect"),
        ("--jobs 2 --cluster tcp://nowhere:1", "--cluster"),
        ("--resume nowhere/log.jsonl", "create it"),
        ("--resume q.csv", "q.csv: is not a log of results (line 1)"),
        ("--resume bad.json", "bad.json: is not a log of results (line 1)"),
        ("--resume log.jsonl -o b.jsonl", "--output: has no effect with --resume"),
    ],
)
def test_what_many_problems_do_not_have_is_refused_in_a_line(options: str, words: str, lcp: Lcp) -> None:
    assert_refused(lcp("solve", "good.json", "none.json", *options.split()), words)
    assert [Path(name).read_text() for name in ("good.json", "bad.json")] == [GOOD, MALFORMED]


def test_shipped_problems_are_solved_in_one_run(lcp: Lcp) -> None:
    given = map(contents.shipped_path, (*contents.PAPER_EXAMPLES, "bimatrix.json", "tridiagonal-100.json"))
    assert [record["solved"] for record in records(lcp("solve", *given, "--format", "json"))] == [True] * 4


LINE = f"{GOOD}\n".encode()


def test_the_first_problem_of_a_stream_does_not_wait_for_the_second_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def given() -> Iterator[bytes]:
        yield from (b"\n", LINE)
        pytest.fail("the next line is waited for")

    class Stream:
        buffer = given()

    monkeypatch.setattr(sys, "stdin", Stream)
    work = next(inputs(["-"], streams=True))
    assert isinstance(work, Input)
    assert (work.line, work.read().n) == (2, 2)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("option", ["--jobs 1", "-o log.jsonl", "--resume log.jsonl"])
def test_a_problem_alone_is_a_stream_of_one(option: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    class Stream:
        buffer = iter([LINE])

    monkeypatch.setattr(sys, "stdin", Stream)
    outcome = lcp("solve", "-", *option.split())
    assert (outcome.code, outcome.err) == (0, "lcp: 1 problem: 1 solved\n")


@pytest.mark.parametrize("command", ["solve - --resume own.jsonl < own.jsonl", "solve own.jsonl >> own.jsonl"])
def test_output_to_a_file_that_is_read_is_refused(command: str, tmp_path: Path) -> None:
    own = tmp_path / "own.jsonl"
    own.write_bytes(LINE * 2)
    script = f"{sys.executable} -m lcpcli {command}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, cwd=tmp_path, timeout=60, check=False)
    assert (done.returncode, len(done.stderr.splitlines()), own.read_bytes()) == (2, 1, LINE * 2)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full disk of Linux")
def test_a_full_folder_of_temporary_files_is_named(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = tempfile.TemporaryFile

    def full(**options: Any) -> Any:
        return usual(**options) if options else Path("/dev/full").open("w+b")

    (tmp_path / "two.jsonl").write_bytes(LINE * 2)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    told = f"cannot be collected in {tempfile.gettempdir()} (No space left on device); set TMPDIR to a folder with room"
    assert_refused(lcp("solve", "two.jsonl", "-o", "out.csv"), f"lcp: out.csv: {told}\n")
    assert not (tmp_path / "out.csv").exists()
