"""Many problems on the command line: one record each, in order, whatever is wrong with some of them."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.files import contents
from lcpcli.gallery import families

Lcp = Callable[..., Any]
GOOD = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}'
INFEASIBLE = '{"M": [[0, -1], [1, 0]], "q": [-1, -1]}'
MALFORMED = '{"M": [[2, 1], [1, 2]], "q": [-5, -6]'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.json").write_text(GOOD)
    (tmp_path / "none.json").write_text(INFEASIBLE)
    (tmp_path / "bad.json").write_text(MALFORMED)
    (tmp_path / "M.csv").write_text("2,1\n1,2\n")
    (tmp_path / "q.csv").write_text("-5\n-6\n")
    return tmp_path


def random_problem(seed: int, n: int = 5) -> lcpcli.Problem:
    rng = np.random.default_rng(seed)
    M = rng.standard_normal((n, n))
    return lcpcli.Problem(M + np.diag(np.abs(M).sum(1)), rng.standard_normal(n))


def line_of(problem: lcpcli.Problem) -> str:
    return json.dumps({"M": problem.M.tolist(), "q": problem.q.tolist()})


def records_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


def mixture() -> list[str]:
    """97 problems with a solution, one without, one that takes longer than one waits, and one that is malformed."""
    lines = [line_of(random_problem(seed)) for seed in range(97)]
    slow = families.make("ray", 80, 0)
    for at, line in ((10, MALFORMED), (40, INFEASIBLE), (70, line_of(slow))):
        lines.insert(at, line)
    return lines


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_mixture_has_a_record_for_each_a_summary_and_the_exit_code_of_the_worst(
    jobs: str, lcp: Lcp, folder: Path
) -> None:
    (folder / "all.jsonl").write_text("".join(f"{line}\n" for line in mixture()))
    outcome = lcp("solve", "all.jsonl", "--format", "json", "--time-limit", "0.5", "--jobs", jobs)
    records = records_of(outcome.out)
    assert outcome.code == 2
    assert [(record["file"], record["item"]) for record in records] == [("all.jsonl", k) for k in range(1, 101)]
    others = {k: record["status"] for k, record in enumerate(records) if record["status"] != "solved"}
    assert others == {10: "bad_input", 40: "infeasible", 70: "time_limit"}
    complaint, summary = outcome.err.splitlines()
    assert complaint.startswith("lcp: all.jsonl: line 11: column 38: ends too early; is the file cut off?")
    assert records[10]["message"] == complaint.removeprefix("lcp: ")
    assert summary == "lcp: 100 problems: 97 solved, 1 bad input, 1 infeasible, 1 time limit"
    for record in (record for record in records if record["solved"]):
        problem = random_problem(record["item"] - 1 - sum(k < record["item"] - 1 for k in others))
        assert np.allclose(record["z"], lcpcli.run(problem).z)


@pytest.mark.parametrize(
    ("files", "code"),
    [
        (["good.json", "good.json"], 0),
        (["good.json", "none.json"], 3),
        (["good.json", "none.json", "bad.json"], 2),
        (["none.json", "bad.json"], 2),
        (["nowhere.json", "good.json"], 2),
    ],
)
def test_exit_code_of_solve_and_of_compare(files: list[str], code: int, lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    assert lcp("solve", *files).code == code
    assert lcp("compare", *files, "--method", "auto").code == code


def test_unsolved_comes_before_without_solution(lcp: Lcp, folder: Path) -> None:
    (folder / "slow.json").write_text(line_of(families.make("ray", 80, 0)))
    files = ("none.json", "slow.json", "--time-limit", "0.3")
    assert lcp("solve", *files).code == lcp("compare", *files, "--method", "auto").code == 1


def test_a_bad_file_costs_a_comparison_only_its_own_result(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    outcome = lcp("compare", "good.json", "bad.json", "good.json", "--method", "auto", "--format", "json")
    assert [record["status"] for record in records_of(outcome.out)] == ["solved", "solved", "bad_input"]
    assert outcome.err.startswith("lcp: bad.json: line 1, column 38: ends too early")


def test_files_of_M_and_q_and_whole_problems_come_in_any_order(lcp: Lcp, folder: Path) -> None:
    np.save(folder / "whole.npy", np.array([[2.0, 1, -5], [1, 2, -6]]))
    files = ("M.csv", "q.csv", "good.json", "M.csv", "q.csv", "whole.npy")
    records = records_of(lcp("solve", *files, "--format", "json").out)
    assert [record["file"] for record in records] == ["M.csv", "good.json", "M.csv", "whole.npy"]
    assert all(np.allclose(record["z"], [4 / 3, 7 / 3]) for record in records)


@pytest.mark.parametrize("files", [["good.json", "q.csv"], ["bad.csv", "q.csv"], ["nowhere.csv", "q.csv"]])
def test_a_vector_is_no_problem_of_its_own(files: list[str], lcp: Lcp, folder: Path) -> None:
    (folder / "bad.csv").write_text("2,x\n1,2\n")
    outcome = lcp("solve", *files)
    assert (outcome.code, outcome.out, len(outcome.err.splitlines())) == (2, "", 1)


def test_lines_come_from_standard_input(lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "\n".join(["", GOOD, "", INFEASIBLE, GOOD])
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    outcome = lcp("solve", "-", "good.json", "--format", "json")
    records = records_of(outcome.out)
    assert folder.is_dir()
    assert [(record["file"], record["item"]) for record in records] == [
        ("standard input", 2),
        ("standard input", 4),
        ("standard input", 5),
        ("good.json", None),
    ]
    assert [record["problem"] for record in records[:1]] == ["standard input:2"]
    assert outcome.code == 3
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    heading, *rows = lcp("solve", "-").out.splitlines()
    assert {row[heading.index("status") :].split()[0] for row in rows} == {"solved", "infeasible"}


def test_a_problem_in_json_over_several_lines_is_one_problem(lcp: Lcp, folder: Path) -> None:
    (folder / "wide.json").write_text(json.dumps(json.loads(GOOD), indent=1))
    assert lcp("solve", "wide.json").out.startswith("wide: n = 2")
    (folder / "one.jsonl").write_text(GOOD + "\n")
    assert lcp("solve", "one.jsonl").out.startswith("one:1: n = 2")


def columns(folder: Path, k: int) -> tuple[lcpcli.Problem, Any]:
    problem, Q = random_problem(1), np.random.default_rng(2).standard_normal((5, k))
    np.savetxt(folder / "A.csv", problem.M, delimiter=",")
    header = ",".join(f"day {j}" for j in range(k))
    np.savetxt(folder / "Q.csv", Q, delimiter=",", header=header, comments="")
    np.save(folder / "Q.npy", Q)
    np.savez(folder / "Q.npz", q=Q)
    (folder / "Q.json").write_text(json.dumps(Q.tolist()))
    return problem, Q


@pytest.mark.parametrize("name", ["Q.csv", "Q.npy", "Q.npz", "Q.json"])
@pytest.mark.parametrize("options", [[], ["--jobs", "2"], ["--exact"], ["--method", "lemke"], ["--trace"]])
def test_several_q_for_one_M_are_the_columns_of_a_file(name: str, options: list[str], lcp: Lcp, folder: Path) -> None:
    problem, Q = columns(folder, 7)
    records = records_of(lcp("solve", "A.csv", name, "--format", "json", *options).out)
    assert [(record["file"], record["item"]) for record in records] == [(name, j) for j in range(1, 8)]
    for record, q in zip(records, Q.T, strict=True):
        assert np.allclose(record["z"], lcpcli.solve(problem.M, q).z)
    names = [f"day {j}" if name == "Q.csv" else f"q{j + 1}" for j in range(7)]
    assert [record["problem"] for record in records] == names


def test_bounds_are_those_of_every_problem(lcp: Lcp, folder: Path) -> None:
    problem, Q = columns(folder, 3)
    for files in (["A.csv", "Q.csv"], ["good.json", "good.json"]):
        records = records_of(lcp("solve", *files, "--upper", "0.5", "--format", "json").out)
        assert all(max(record["z"]) <= 0.5 for record in records)
    assert np.allclose(
        records_of(lcp("solve", "A.csv", "Q.csv", "--upper", "0.1", "--format", "json").out)[1]["z"],
        lcpcli.solve(problem.M, Q[:, 1], upper=0.1).z,
    )


def test_table_and_csv_have_a_part_for_each_problem(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    table = lcp("solve", "good.json", "bad.json", "none.json").out.splitlines()
    assert [row.split()[0] for row in table] == ["problem", "good.json", "bad.json", "none.json"]
    assert [row[len("good.json") :].split("  ")[-1] for row in table[1:2]] == ["newton"]
    text = lcp("solve", "good.json", "bad.json", "good.json", "--format", "csv").out
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    assert rows[0] == ["problem", "component", "z", "w", "state", "name"]
    assert [(row[0], row[1]) for row in rows[1:]] == [("good.json", "1"), ("good.json", "2")] * 2


@pytest.mark.parametrize("name", ["all.jsonl", "all.csv", "all.txt", "all.json"])
def test_output_file_holds_what_would_be_printed(name: str, lcp: Lcp, folder: Path) -> None:
    form = {"jsonl": "json", "txt": "table"}.get(name[4:], name[4:])
    outcome = lcp("solve", "good.json", "none.json", "-o", name)
    assert (outcome.code, outcome.out) == (3, "")
    printed = lcp("solve", "good.json", "none.json", "--format", form).out
    assert len((folder / name).read_text().splitlines()) == len(printed.splitlines())


def test_quiet_leaves_the_exit_code(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    outcome = lcp("solve", "good.json", "none.json", "-q")
    assert (outcome.code, outcome.out, outcome.err) == (3, "", "")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--plot", "a.svg"], ["--plot", "one problem", "lcp compare"]),
        (["--trace", "a.csv"], ["--trace", "one problem"]),
        (["--trace"], ["--trace", "no effect", "--format json"]),
        (["--format", "latex"], ["--format", "one problem", "lcp compare"]),
        (["--every", "3"], ["--every", "no effect"]),
        (["--jobs", "0"], ["--jobs", "out of range", ">= 1"]),
        (["--jobs", "2", "--cluster", "tcp://nowhere:1"], ["--jobs", "--cluster"]),
        (["--resume", "nowhere/log.jsonl"], ["nowhere/log.jsonl", "no folder", "create it"]),
        (["--resume", "good.json"], ["good.json", "holds the problem"]),
        (["--resume", "q.csv"], ["q.csv", "is not a log", "line 1", "-o FILE.jsonl"]),
        (["--resume", "bad.json"], ["bad.json", "is not a log", "line 1"]),
        (["--resume", "log.jsonl", "-o", "b.jsonl"], ["--output", "--resume"]),
    ],
)
def test_what_many_problems_do_not_have_is_refused_in_a_line(
    options: Sequence[str], words: Sequence[str], lcp: Lcp, folder: Path
) -> None:
    outcome = lcp("solve", "good.json", "none.json", *options)
    assert (outcome.code, outcome.out, len(outcome.err.splitlines())) == (2, "", 1), outcome.err
    assert all(word in outcome.err for word in words), outcome.err
    assert (folder / "good.json").read_text() == GOOD
    assert (folder / "bad.json").read_text() == MALFORMED


def test_a_log_goes_on_where_it_was_cut_off(lcp: Lcp, folder: Path) -> None:
    lines = [line_of(random_problem(seed)) for seed in range(6)]
    (folder / "six.jsonl").write_text("\n".join(lines))
    files = ("good.json", "six.jsonl", "M.csv", "q.csv")
    assert lcp("solve", *files, "-o", "log.jsonl").code == 0
    log = folder / "log.jsonl"
    whole = log.read_text().splitlines(keepends=True)
    unfinished = whole[4].replace('"solved"', '"interrupted"')
    for cut in (
        "",
        "".join(whole[:1]),
        "".join(whole[:4]) + whole[4][:50],
        "".join(whole[:4]) + unfinished,
        "".join(whole),
    ):
        log.write_text(cut)
        outcome = lcp("solve", *files, "--resume", "log.jsonl")
        assert (outcome.code, outcome.out, outcome.err) == (0, "", "lcp: 8 problems: 8 solved\n")
        places = [(record["file"], record["item"], record["z"]) for record in records_of(log.read_text())]
        assert places == [(record["file"], record["item"], record["z"]) for record in records_of("".join(whole))]


def test_a_log_of_columns_goes_on_within_them(lcp: Lcp, folder: Path) -> None:
    columns(folder, 9)
    assert lcp("solve", "A.csv", "Q.csv", "-o", "log.jsonl").code == 0
    log = folder / "log.jsonl"
    log.write_text("".join(log.read_text().splitlines(keepends=True)[:4]))
    assert lcp("solve", "A.csv", "Q.csv", "--resume", "log.jsonl").code == 0
    records = records_of(log.read_text())
    assert [record["item"] for record in records] == list(range(1, 10))
    assert [record["problem"] for record in records] == [f"day {j}" for j in range(9)]


def test_a_log_counts_what_it_had(lcp: Lcp, folder: Path) -> None:
    lcp("solve", "bad.json", "good.json", "-o", "log.jsonl")
    outcome = lcp("solve", "bad.json", "good.json", "none.json", "--resume", "log.jsonl")
    assert (outcome.code, outcome.err) == (2, "lcp: 3 problems: 1 bad input, 1 solved, 1 infeasible\n")
    assert len((folder / "log.jsonl").read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.json", "good.json"], ["--resume", "a problem other than none.json as number 1", "same files"]),
        (["good.json"], ["--resume", "a result of problem 2, but the last problem is number 1", "same files"]),
        (["good.json", "none.json", "--tol", "1e-8"], ["--resume", "tol 1e-10", "1e-08", "same options"]),
        (["good.json", "none.json", "--method", "lemke"], ["--resume", "method auto", "lemke"]),
        (["good.json", "none.json", "--exact"], ["--resume", "exact False", "True"]),
    ],
)
def test_a_log_of_something_else_is_refused_and_kept(
    arguments: Sequence[str], words: Sequence[str], lcp: Lcp, folder: Path
) -> None:
    lcp("solve", "good.json", "none.json", "-o", "log.jsonl")
    before = (folder / "log.jsonl").read_text()
    outcome = lcp("solve", *arguments, "--resume", "log.jsonl")
    assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
    assert all(word in outcome.err for word in words), outcome.err
    assert (folder / "log.jsonl").read_text() == before


def test_shipped_problems_are_solved_in_one_run(lcp: Lcp) -> None:
    files = map(contents.shipped_path, (*contents.PAPER_EXAMPLES, "bimatrix.json", "tridiagonal-100.json"))
    records = records_of(lcp("solve", *files, "--format", "json").out)
    assert [record["solved"] for record in records] == [True] * 4
