"""Bounds given by --lower and --upper: typed, or in a file of any format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ..bad_input.matrix_kinds import archive, mat, npy
from .conftest import Lcp, assert_refused, record

LOWER = [-np.inf, -0.5]
FILES = {
    "v.json": b"[null, -0.5]",
    "v.csv": b"none\n-0.5\n",
    "row.csv": b",-0.5\n",
    "headed.csv": b"lower\n-inf\n-0.5\n",
    "decimal-commas.csv": b";lower\n0;-inf\n1;-0,5\n",
    "v.npy": npy(np.array(LOWER)),
    "column.npy": npy(np.array([LOWER]).T),
    "both.npz": archive(upper=[1, 1], lower=LOWER),
    "v.mat": mat(anything=LOWER),
}


@pytest.fixture
def bounds(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lcp:
    """The lower and upper bounds of a problem of two unknowns with these options."""
    monkeypatch.chdir(tmp_path)
    Path("given.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": -9, "upper": [8, 9]}')

    def given(*options: str) -> Any:
        held = record(lcp("convert", "given.json", *options))
        return held.get("lower", 0), held.get("upper")

    return given


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_bounds(name: str, bounds: Lcp) -> None:
    Path(name).write_bytes(FILES[name])
    assert bounds("--lower", name) == ([None, -0.5], [8, 9])


@pytest.mark.parametrize("typed", ["none,-0.5", "NONE -1/2", "[null, -0.5]", "-Infinity;-5e-1", "-inf, -.5"])
def test_typed_bounds_are_those_meant(typed: str, bounds: Lcp) -> None:
    assert bounds("--lower", typed) == ([None, -0.5], [8, 9])


def test_one_number_is_for_all_in_mat_too_and_none_takes_bounds_away(bounds: Lcp) -> None:
    assert bounds("--lower", "-1/2", "--upper", "none") == (-0.5, None)
    assert bounds("--lower", "0", "--upper", "inf") == (0, None)
    Path("one.mat").write_bytes(mat(lower=-1))
    assert bounds("--lower", "one.mat") == (-1, [8, 9])


def test_as_many_bounds_may_be_typed_as_a_problem_has(lcp: Lcp, tmp_path: Path) -> None:
    made = str(tmp_path / "p.json")
    lcp("make", "tridiagonal", "-n", "1200", "-o", made)
    written = lcp("convert", made, "--upper", ",".join(map(str, range(1200))))
    assert record(written)["upper"] == [*range(1200)]


def test_bounds_of_a_program_or_a_game_are_refused_and_those_of_named_unknowns_are_not(
    lcp: Lcp, tmp_path: Path
) -> None:
    file = tmp_path / "p.json"
    for text, hint in (
        ('{"Q": [[1]], "c": [-1]}', "this is a program; give the bounds of its variables in the file"),
        ('{"A": [[1]], "B": [[1]]}', "this is a game; leave it out"),
    ):
        file.write_text(text)
        told = f"lcp: --lower: is for problems given by M and q, but {hint}\n"
        assert_refused(lcp("solve", str(file), "--lower", "1"), told)
    file.write_text('{"M": [[1]], "q": [-3], "names": ["a"]}')
    assert "n = 1 (1 boxed)" in lcp("solve", str(file), "--upper", "1").out
