"""lcp convert writes the same problem in another format."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from lcpcli import from_game, read, write
from lcpcli.files.formats import COMPLETE, GENERAL_SUFFIXES, WRITTEN
from lcpcli.gallery import families as gallery
from lcpcli.model.problem import Problem

from ..small_problem import numbers
from .conftest import Lcp, assert_refused

SPARSE, GAME = gallery.make("tridiagonal", 5), from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]], name="Übung")
RICH = Problem([[1, 1], [1, 1]], [-1, -1], "rich", [1, 2], [3, 4], [[1, 0], [0.25, 0.75]], "", "a book", "a note")


def files_of(path: Path) -> list[str]:
    """The file of a problem, with that of q beside it."""
    q = path.with_suffix(f".q{path.suffix}")
    return [str(path), *([str(q)] if q.exists() else [])]


@pytest.mark.parametrize(("first", "second"), [*pairwise([*GENERAL_SUFFIXES, GENERAL_SUFFIXES[0]])])
def test_numbers_are_the_same_in_all_formats(tmp_path: Path, lcp: Lcp, first: str, second: str) -> None:
    write(Problem([[0.1, 1e-300], [-1 / 3, 5e20]], [0.7, -2]), tmp_path / f"a{first}")
    outcome = lcp("convert", *files_of(tmp_path / f"a{first}"), "-o", str(tmp_path / f"b{second}"))
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    assert numbers(read(*files_of(tmp_path / f"b{second}"))) == ([[0.1, 1e-300], [-1 / 3, 5e20]], [0.7, -2])


@pytest.mark.parametrize("ending", COMPLETE)
@pytest.mark.parametrize("problem", [SPARSE, GAME, RICH], ids=lambda problem: problem.name)
def test_complete_formats_keep_everything(tmp_path: Path, lcp: Lcp, ending: str, problem: Problem) -> None:
    write(problem, tmp_path / "a.json", as_program=True)
    assert lcp("convert", str(tmp_path / "a.json"), "-o", str(tmp_path / f"b{ending}")).code == 0
    outcome = lcp("convert", str(tmp_path / f"b{ending}"))
    assert outcome.out.encode() == (tmp_path / "a.json").read_bytes()


def test_what_a_format_cannot_keep_is_named(tmp_path: Path, lcp: Lcp) -> None:
    write(RICH, tmp_path / "a.json")
    out = str(tmp_path / "a.csv")
    outcome = lcp("convert", str(tmp_path / "a.json"), "-o", out)
    lost = "name, source, note, x0, x1, solution"
    assert outcome.err == f"lcp: {out}: the format keeps only M, q and bounds; left out: {lost}\n"


def test_an_output_of_no_known_format_or_without_its_option_is_refused_and_leaves_nothing(
    tmp_path: Path, lcp: Lcp
) -> None:
    write(RICH, tmp_path / "a.json")
    made = str(tmp_path / "b.xyz")
    assert_refused(lcp("convert", str(tmp_path / "a.json"), "-o", made), f"has the unknown suffix .xyz; use {WRITTEN}")
    assert_refused(lcp("convert", str(tmp_path / "a.json"), str(tmp_path / "b.mat")), "give -o")
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]
