"""What is given for an answer, and what is not one: numbers without a file, programs, proofs, what is not finite."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lcpcli.files import contents

from .conftest import Lcp, assert_refused

EXAMPLE = contents.shipped_path("paper-example-2.json")
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.mark.parametrize(("digits", "tol"), [(6, "1e-06"), (9, "1e-09")])
def test_least_power_of_ten_is_named_that_accepts_a_rounded_answer(digits: int, tol: str, lcp: Lcp) -> None:
    assert_refused(lcp("check", EXAMPLE, "0,1"))
    answer = f"0,{15 / 29:.{digits}f},{17 / 29:.{digits}f},0"
    assert f"; --tol {tol} accepts it" in lcp("check", EXAMPLE, answer).out


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


def test_tolerance_has_no_effect_on_a_proof(lcp: Lcp, tmp_path: Path) -> None:
    problem, proof = tmp_path / "infeasible.json", tmp_path / "proof.json"
    problem.write_text(INFEASIBLE)
    proof.write_text(lcp("solve", str(problem), "--format", "json").out)
    assert json.loads(proof.read_text())["certificate"]["kind"] == "farkas"
    assert lcp("check", str(problem), str(proof)).code == 0
    assert lcp("check", str(problem), str(proof), "--tol", "1e-3").code == 2


NAMED = '{{"name": "{}", "M": [[2, 1], [1, 2]], "q": [-5, {}]}}\n'


def test_of_several_results_that_of_the_problem_is_checked_and_a_log_without_it_is_refused(
    lcp: Lcp, folder: Path
) -> None:
    lines = [NAMED.format(f"s{i}", -i) for i in range(3)]
    Path("many.jsonl").write_text("".join(lines))
    lcp("solve", "many.jsonl", "-o", "log.jsonl")
    for line in lines:
        Path("one.json").write_text(line)
        outcome = lcp("check", "one.json", "log.jsonl")
        assert (outcome.code, outcome.err) == (0, ""), line
    Path("other.json").write_text(lines[0].replace("s0", "another"))
    told = "lcp: log.jsonl: has no results for another; give the line of one as a file of its own\n"
    assert_refused(lcp("check", "other.json", "log.jsonl", "-q"), told)
    (folder / "bare.jsonl").write_text('{"z": [1, 2]}\n{"z": [3, 4]}\n')
    assert "the first of 2 results is checked" in lcp("check", "other.json", "bare.jsonl").err
    assert lcp("check", "other.json", "bare.jsonl", "-q").err == ""


def test_of_results_of_one_name_that_of_the_file_or_of_its_content_is_checked(lcp: Lcp, folder: Path) -> None:
    """Also in a log that another program has written again, without blanks."""
    files = [f"p{i}.json" for i in range(3)]
    for i, name in enumerate(files):
        Path(name).write_text(NAMED.format("trial", -i))
    Path("lines.jsonl").write_text("".join(NAMED.format("trial", -i) for i in range(3)))
    lcp("solve", *files, "-o", "log.jsonl")
    lcp("solve", "lines.jsonl", "-o", "log-of-lines.jsonl")
    found = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    Path("bare.jsonl").write_text("".join(json.dumps(record, separators=(",", ":")) + "\n" for record in found))
    Path("elsewhere").mkdir()
    for name in files:
        content = Path(name).read_text()
        Path("elsewhere", name).write_text(content.replace("2, 1", "2,1"))  # with another digest
        Path("copy.json").write_text(content)
        for file in (name, f"./{name}", str(folder / name), "copy.json", f"elsewhere/{name}"):
            assert (lcp("check", file, "log.jsonl").code, file) == (0, file)
        assert lcp("check", name, "log-of-lines.jsonl").code == 0
        assert lcp("check", name, "bare.jsonl", "-q").code == 0
    told = "lcp: log-of-lines.jsonl: has 3 results for trial; give the line of one as a file of its own\n"
    assert_refused(lcp("check", "elsewhere/p0.json", "log-of-lines.jsonl"), told)


@pytest.mark.parametrize(("z", "told"), [("3,3", False), ("1e-6,3", True)])
def test_a_point_on_the_bounds_is_told_only_where_it_is_near(z: str, told: bool, lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"M": [[2, 1], [1, 2]], "q": [5, -6]}')
    outcome = lcp("check", str(tmp_path / "p.json"), z)
    assert (outcome.code, "put on their bounds" in outcome.out) == (1, told)


@pytest.mark.parametrize("n", [8, 30])
def test_of_an_ill_posed_problem_the_proof_stands_and_the_solution_does_not(n: int, lcp: Lcp, tmp_path: Path) -> None:
    """Weights in a row whose rounding leaves a solution: they are chosen so that the exact pivots are positive."""
    M = 2.2 * np.eye(n) - np.diag(np.full(n - 1, 1.1), 1) - np.diag(np.full(n - 1, 1.1), -1)
    M[0, 0], M[-1, -1] = 1.1, np.nextafter(1.1, 2)
    (tmp_path / "p.json").write_text(json.dumps({"M": M.tolist(), "q": [-1.0] + [0.0] * (n - 1)}))
    solved = lcp("solve", str(tmp_path / "p.json"), "-o", str(tmp_path / "result.json"))
    result = json.loads((tmp_path / "result.json").read_text())
    assert (solved.code, result["status"], result["solved"]) == (1, "ill_posed", False)
    assert result["certificate"]["kind"] == "farkas"
    assert lcp("check", str(tmp_path / "p.json"), str(tmp_path / "result.json")).code == 0
    (tmp_path / "z.json").write_text(json.dumps(result["z"]))
    assert lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.json")).code == 1
