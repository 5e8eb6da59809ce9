"""What is given for an answer, and what is not one: numbers without a file, programs, proofs, what is not finite."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-2.json")
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'

Lcp = Callable[..., Any]


def test_numbers_may_stand_in_place_of_a_file(lcp: Lcp) -> None:
    assert lcp("check", EXAMPLE, "0,15/29,17/29,0", "--exact").code == 0
    assert lcp("check", EXAMPLE, "0 0.5 0.5 0").code == 1
    outcome = lcp("check", EXAMPLE, "0,1")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)


@pytest.mark.parametrize(("digits", "tol"), [(6, "1e-06"), (8, "1e-08"), (9, "1e-09")])
def test_least_power_of_ten_is_named_that_accepts_a_rounded_answer(digits: int, tol: str, lcp: Lcp) -> None:
    answer = f"0,{15 / 29:.{digits}f},{17 / 29:.{digits}f},0"
    assert f"; --tol {tol} accepts it" in lcp("check", EXAMPLE, answer).out


def test_programs_and_games_are_solved_as_they_are(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    for text, words in (('{"Q": [[1]], "c": [-1]}', "x = (1), objective"), ('{"A": [[1]], "B": [[1]]}', "row = (1)")):
        file.write_text(text)
        outcome = lcp("solve", str(file))
        assert outcome.code == 0
        assert words in outcome.out


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}', ["1,4/3,0", "2,7/3,0"]),
        ('{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}', ["1,1/8,0,x1,row,3/5,6/5", "3,1/12,0,y1,column,2/5,6/5"]),
        ('{"Q": [[3]], "c": [-1]}', ["1,1/3,0,x,1/3,0.0"]),
    ],
    ids=["problem", "game", "program"],
)
def test_csv_of_exact_answers_has_fractions_which_check_reads(
    text: str, cells: list[str], lcp: Lcp, tmp_path: Path
) -> None:
    file, solution = str(tmp_path / "p.json"), str(tmp_path / "z.csv")
    (tmp_path / "p.json").write_text(text)
    assert lcp("solve", file, "--method", "newton", "--exact", "-o", solution).code == 0
    lines = Path(solution).read_text().splitlines()
    assert [line for line in lines if line in cells] == cells, lines
    assert lcp("check", file, solution, "--exact").code == 0


@pytest.mark.parametrize("answer", ["nan\n1\n2\n0\n", "inf,0,0,0", "[NaN, 1, 2, 0]", '{"z": [Infinity, 0, 0, 0]}'])
def test_what_is_not_finite_is_no_answer(answer: str, lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "answer"
    file.write_text(answer)
    outcome = lcp("check", EXAMPLE, str(file))
    assert (outcome.code, outcome.out) == (2, "")
    assert "not finite" in outcome.err


def test_tolerance_has_no_effect_on_a_proof(lcp: Lcp, tmp_path: Path) -> None:
    problem, proof = tmp_path / "infeasible.json", tmp_path / "proof.json"
    problem.write_text(INFEASIBLE)
    proof.write_text(lcp("solve", str(problem), "--format", "json").out)
    assert json.loads(proof.read_text())["certificate"]["kind"] == "farkas"
    assert lcp("check", str(problem), str(proof)).code == 0
    assert lcp("check", str(problem), str(proof), "--tol", "1e-3").code == 2


def test_of_several_results_that_of_the_problem_is_checked_and_a_log_without_it_is_refused(
    lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = [f'{{"name": "s{i}", "M": [[2, 1], [1, 2]], "q": [-5, {-i}]}}' for i in range(3)]
    Path("many.jsonl").write_text("\n".join(lines))
    lcp("solve", "many.jsonl", "-o", "log.jsonl")
    for i, line in enumerate(lines):
        Path("one.json").write_text(line)
        outcome = lcp("check", "one.json", "log.jsonl")
        assert (outcome.code, outcome.err) == (0, ""), i
    Path("other.json").write_text(lines[0].replace("s0", "another"))
    refused = lcp("check", "other.json", "log.jsonl", "-q")
    told = "lcp: log.jsonl: has no results for another; give the line of one as a file of its own\n"
    assert (refused.code, refused.out, refused.err) == (2, "", told)
    Path("bare.jsonl").write_text('{"z": [1, 2]}\n{"z": [3, 4]}\n')
    assert "the first of 2 results is checked" in lcp("check", "other.json", "bare.jsonl").err
    assert lcp("check", "other.json", "bare.jsonl", "-q").err == ""


def test_log_that_another_program_has_written_again_without_blanks_is_read_alike(
    lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for i in range(3):
        Path(f"p{i}.json").write_text(f'{{"name": "same", "M": [[2, 1], [1, 2]], "q": [-5, {-i}]}}')
    lcp("solve", "p0.json", "p1.json", "p2.json", "-o", "log.jsonl")
    records = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    Path("bare.jsonl").write_text("".join(json.dumps(record, separators=(",", ":")) + "\n" for record in records))
    assert [lcp("check", f"p{i}.json", "bare.jsonl", "-q").code for i in range(3)] == [0, 0, 0]


NAMED = '{{"name": "trial", "M": [[2, 1], [1, 2]], "q": [-5, {}]}}\n'


def test_of_results_of_one_name_that_of_the_file_or_of_its_content_is_checked(
    lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    files = [f"p{i}.json" for i in range(6)]
    for i, name in enumerate(files):
        Path(name).write_text(NAMED.format(-i))
    Path("lines.jsonl").write_text("".join(NAMED.format(-i) for i in range(6)))
    lcp("solve", *files, "-o", "log.jsonl")
    lcp("solve", "lines.jsonl", "-o", "log-of-lines.jsonl")
    Path("elsewhere").mkdir()
    for name in files:
        content = Path(name).read_text()
        Path("elsewhere", name).write_text(content.replace("2, 1", "2,1"))  # with another digest
        Path("copy.json").write_text(content)
        for file in (name, f"./{name}", str(tmp_path / name), "copy.json", f"elsewhere/{name}"):
            assert (lcp("check", file, "log.jsonl").code, file) == (0, file)
        assert lcp("check", name, "log-of-lines.jsonl").code == 0
    refused = lcp("check", "elsewhere/p0.json", "log-of-lines.jsonl")
    told = "lcp: log-of-lines.jsonl: has 6 results for trial; give the line of one as a file of its own\n"
    assert (refused.code, refused.out, refused.err) == (2, "", told)


@pytest.mark.parametrize(("z", "told"), [("3,3", False), ("1e-6,3", True)])
def test_a_point_on_the_bounds_is_told_only_where_it_is_near(
    z: str, told: bool, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "p.json").write_text('{"M": [[2, 1], [1, 2]], "q": [5, -6]}')
    outcome = lcp("check", str(tmp_path / "p.json"), z)
    assert (outcome.code, "put on their bounds" in outcome.out) == (1, told)
