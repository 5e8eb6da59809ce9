"""lcp make writes problems that lcp solve reads, lists what there is, and refuses the rest in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import read
from lcpcli.cli import terminal
from lcpcli.gallery import families as gallery
from lcpcli.linalg.matrices import is_sparse

from .conftest import Lcp, assert_refused

EXIT_CODES = {"infeasible": 3, "unsolvable": 3, "solved": 0}


@pytest.mark.parametrize("family", gallery.FAMILIES)
def test_what_is_made_can_be_solved_from_its_file(family: str, lcp: Lcp, tmp_path: Path) -> None:
    made = lcp("make", family)
    assert (made.code, made.err) == (0, "")
    file = tmp_path / "made.json"
    file.write_text(made.out)
    problem, expected = read(file), gallery.make(family)
    assert (problem.name, problem.source, problem.note) == (expected.name, expected.source, expected.note)
    assert np.array_equal(problem.q, expected.q)
    outcome = lcp("solve", str(file), "--format", "json")
    status = json.loads(outcome.out)["status"]
    assert outcome.code == EXIT_CODES[status]
    assert status == (problem.verdict or "solved") or family == "gaussian"  # of which it is not known


def test_a_pipe_from_make_to_solve_and_to_a_reader_that_has_enough() -> None:
    def shell(command: str) -> subprocess.CompletedProcess[str]:
        script = command.replace("lcp", f"{sys.executable} -m lcpcli")
        return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)

    result = json.loads(shell("lcp make obstacle -n 100 | lcp solve - --format json").stdout)
    assert (result["problem"], result["status"], result["n"]) == ("obstacle-100", "solved", 100)
    done = shell("lcp make harker-pang -n 200 | head -1; echo ${PIPESTATUS[0]}")
    assert (done.stdout in (f"{{\n{terminal.CLOSED_PIPE}\n", "{\n0\n"), done.stderr) == (True, "")


@pytest.mark.parametrize("suffix", [".json", ".csv", ".npz", ".mtx"])
@pytest.mark.parametrize("family", ["degenerate", "diagonal"])
def test_files_keep_the_numbers_and_some_everything(suffix: str, family: str, lcp: Lcp, tmp_path: Path) -> None:
    file, q_file = tmp_path / f"own{suffix}", tmp_path / "own.q.mtx"
    assert lcp("make", family, "-n", "7", "-o", str(file)).code == 0
    problem, expected = read(file, q_file if suffix == ".mtx" else None), gallery.make(family, 7)
    assert abs(problem.M - expected.M).max() == 0
    assert np.array_equal(problem.q, expected.q)
    if suffix in (".json", ".npz"):
        assert is_sparse(problem.M) is is_sparse(expected.M)
        assert np.array_equal(problem.solutions, expected.solutions)


@pytest.mark.parametrize(
    ("line", "family", "arguments"),
    [
        ("harker-pang -n 4 --seed 3 --set symmetric=true", "harker-pang", {"n": 4, "seed": 3, "symmetric": True}),
        ("harker-pang --set symmetric=No", "harker-pang", {"symmetric": False}),
        ("diagonal --set decades=2", "diagonal", {"decades": 2}),
        ("contact --set friction=1e-1 --set compliance=2", "contact", {"friction": 0.1, "compliance": 2.0}),
        ("murty -o -", "murty", {}),
    ],
)
def test_options_reach_the_family(line: str, family: str, arguments: dict[str, Any], lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "made.json"
    file.write_text(lcp("make", *line.split()).out)
    problem, expected = read(file), gallery.make(family, **arguments)
    assert abs(problem.M - expected.M).max() == 0
    assert np.array_equal(problem.q, expected.q)


def test_the_list_shows_every_family_in_eighty_columns_and_on_a_wide_screen_in_one_line(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = lcp("make", "--list").out.splitlines()
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines[3:] if not line.startswith(" ")] == list(gallery.FAMILIES)
    words = " ".join(lines).split()
    assert {"eccentricity=0.8", "symmetric=false", "epsilon=1e-08"} <= set(words)
    for family, description in gallery.FAMILIES.items():
        assert set(description.split()) <= set(words)
        assert set(gallery.class_of(family).split()) <= set(words)
    monkeypatch.setenv("COLUMNS", "200")
    lines = lcp("make", "--list").out.splitlines()
    assert [line.split()[0] for line in lines if "no z >= 0 with Mz + q >= 0" in line] == ["infeasible"]
    assert len(lines) == 3 + len(gallery.FAMILIES)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "FAMILY: is missing; name a family"),
        ("x" * 100_000, "is unknown; lcp make --list shows the families"),
        ("murty -n 0", "-n: is out of range; give a whole number from 1"),
        (f"murty -n {10**100}", "-n: is out of range; give a whole number from 1"),
        ("curtis-han-robinson -n 10", "-n: is 10, and curtis-han-robinson has 3 unknowns; leave it out"),
        ("murty --seed 1", "--seed: has no effect on murty, which has no random entries; leave it out"),
        ("lp --seed -1", "--seed: is negative; give a whole number >= 0"),
        ("contact --set seed=1", "'seed' is not a parameter of contact; choose one of friction, compliance"),
        ("contact --set frictoin=3", "'frictoin' is not a parameter of contact; did you mean friction?"),
        ("diagonal --set decades", "--set: 'decades' has no value; write NAME=VALUE"),
        ("diagonal --set decades=", "--set: '' is not a value of decades; give a whole number"),
        ("diagonal --set decades=1_0", "--set: '1_0' is not a value of decades; give a whole number"),
        (f"diagonal --set decades={10**400}", "decades: 1000000000"),
        ("diagonal --set decades=3 --set decades=4", "--set: decades is set twice; leave one out"),
        ("harker-pang --set symmetric=maybe", "'maybe' is not a value of symmetric; give true or false"),
        ("contact --set friction=much", "'much' is not a value of friction; give a number"),
        ("contact --set friction=nan", "friction: nan is out of range; it must be: 0 <= friction <= 10"),
        ("--list murty", "FAMILY: has no effect with --list"),
        ("murty -o own.xyz", "own.xyz: has the unknown suffix .xyz; use .json"),
        ("murty -o nowhere/own.json", "nowhere/own.json: there is no folder"),
    ],
)
def test_one_line_says_where_what_and_how_to_fix_it(
    line: str, words: str, lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if "-o" in line:
        monkeypatch.setattr(gallery, "make", lambda *_, **__: pytest.fail("made in vain"))
    outcome = lcp("make", *line.split())
    assert_refused(outcome, words)
    assert len(outcome.err) < 1000
    assert list(tmp_path.iterdir()) == []
