"""Bounds in files, far ones as none in a bench, and origins in files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lcpcli import from_game, from_qp
from lcpcli.errors import ProblemError

from ..conftest import Outcome, save_json
from ..far_bounds import FAR
from ..files.binary import archive, mat, npy
from ..wordings import OTHER_ORIGIN

REMARK = (
    "lcp: far.json: 6 bounds of 1e20 or more; --infinity 1e20 makes them infinite\n"
)


@pytest.fixture(autouse=True)
def files(in_folder):
    """A folder, entered, with far.json, a program with far bounds, and lcp.json."""
    save_json(Path("far.json"), FAR)
    Path("lcp.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, 1e25]}')
    return in_folder


def test_a_bench_keeps_which_bounds_are_none(lcp):
    infinity = "--infinity 1e20"
    lcp(f"bench far.json {infinity} --method newton --budget 0 -o bench.json -q")
    assert json.loads(Path("bench.json").read_text())["measurements"][0]["n"] == 6
    assert lcp("bench --resume bench.json -q").code == 0
    lcp("bench lcp.json --method newton --budget 0 -o older.json -q")
    text = Path("older.json").read_text()
    assert ', "infinity": null' in text
    Path("older.json").write_text(text.replace(', "infinity": null', ""))
    assert lcp("bench --resume older.json -q") == Outcome(0, "", "")


def test_bench_tells_of_far_bounds_too(lcp):
    assert lcp("bench far.json --method newton --budget 0").err == REMARK


LOWER = [-np.inf, -0.5]
FILES = {
    "v.json": b"[null, -0.5]",
    "v.csv": b"none\n-0.5\n",
    "headed.csv": b"lower\n-inf\n-0.5\n",
    "decimal-commas.csv": b";lower\n0;-inf\n1;-0,5\n",
    "column.npy": npy(np.array([LOWER]).T),
    "both.npz": archive(upper=[1, 1], lower=LOWER),
    "v.mat": mat(anything=LOWER),
}


@pytest.fixture
def bounds(lcp, in_folder):
    """The lower and upper bounds of a problem of two unknowns with these options."""
    (in_folder / "given.json").write_text(
        '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "lower": -9, "upper": [8, 9]}'
    )

    def given(*options):
        held = lcp("convert", "given.json", *options).record
        return held.get("lower", 0), held.get("upper")

    return given


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_bounds(name, bounds):
    Path(name).write_bytes(FILES[name])
    assert bounds("--lower", name) == ([None, -0.5], [8, 9])


def test_one_number_in_mat_is_for_all(bounds):
    Path("one.mat").write_bytes(mat(lower=-1))
    assert bounds("--lower", "one.mat") == (-1, [8, 9])


PROGRAM = from_qp([[2, 0], [0, 2]], [1, 2], [[1, 1]], [1], row_upper=[2])


@pytest.mark.parametrize("place", [(0, 1), (0, 2), (2, 2), (3, 3)])
@pytest.mark.parametrize(
    "problem", [PROGRAM, from_game([[3, 0], [0, 2]], [[0, 2], [3, 0]])]
)
def test_a_changed_matrix_no_longer_fits_its_origin(problem, place):
    M = problem.M.copy()
    M[place] += 1
    unit = np.eye(problem.n)[2]
    for changes in (
        {"M": M},
        {"q": problem.q + unit},
        {"lower": unit, "upper": np.inf},
    ):
        with pytest.raises(ProblemError, match=f"origin: {OTHER_ORIGIN}"):
            replace(problem, **changes)
