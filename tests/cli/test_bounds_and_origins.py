"""Bounds typed or in files, far ones as none, and programs and games in files, in every
command that reads problems."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import lcpcli
from lcpcli import from_game, from_qp, read
from lcpcli.errors import ProblemError

from ..conftest import Outcome, save_json
from ..far_bounds import FAR
from ..files.binary import archive, mat, npy
from ..wordings import ENDS_TOO_EARLY, OTHER_ORIGIN
from .conftest import assert_refused

MIXED = (
    '{"M": [[2, 1], [1, 2]], "q": [-5.1, -6], "lower": [-1e20, 0.1], "upper": '
    "[1e20, 1e400]}"
)
REMARK = (
    "lcp: far.json: 6 bounds of 1e20 or more; --infinity 1e20 makes them infinite\n"
)


@pytest.fixture(autouse=True)
def files(in_folder):
    """A folder, entered, with far.json, a program with far bounds, mixed.json,
    lcp.json, program.json and game.json."""
    save_json(Path("far.json"), FAR)
    Path("mixed.json").write_text(MIXED)
    Path("lcp.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, 1e25]}')
    save_json(Path("program.json"), PROGRAM)
    save_json(Path("game.json"), GAME)
    return in_folder


def test_check_inspect_convert_compare_and_bench_read_the_same_problem_as_solve(lcp):
    infinity = "--infinity 1e20"
    assert lcp(f"solve far.json {infinity} -o z.csv").code == 0
    assert lcp(f"check far.json z.csv {infinity}").code == 0
    assert lcp(f"check far.json z.csv {infinity} --exact").code == 0
    assert lcp(f"inspect far.json {infinity}").out.startswith("far: n = 6 ")
    assert lcp(f"convert far.json {infinity} -o near.json") == Outcome(
        0, "", "lcp: wrote near.json\n"
    )
    near = read("near.json")
    assert near.n == read("far.json", infinity=1e20).n == 6
    assert not (near.q != from_qp(**FAR, infinity=1e20).q).any()
    assert (
        lcp(f"compare far.json {infinity} --method newton --format json").record["n"]
        == 6
    )
    lcp(f"bench far.json {infinity} --method newton --budget 0 -o bench.json -q")
    assert json.loads(Path("bench.json").read_text())["measurements"][0]["n"] == 6
    assert lcp("bench --resume bench.json -q").code == 0
    lcp("bench lcp.json --method newton --budget 0 -o older.json -q")
    text = Path("older.json").read_text()
    assert ', "infinity": null' in text
    Path("older.json").write_text(text.replace(', "infinity": null', ""))
    assert lcp("bench --resume older.json -q") == Outcome(0, "", "")


def test_bench_and_inspect_tell_of_far_bounds_too(lcp):
    assert lcp("bench far.json --method newton --budget 0").err == REMARK
    assert REMARK.split(": ")[2].strip() in lcpcli.inspect(read("far.json")).hints


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


@pytest.mark.parametrize(
    "typed", ["none,-0.5", "NONE -1/2", "[null, -0.5]", "-Infinity;-5e-1", "-inf, -.5"]
)
def test_typed_bounds_are_those_meant(typed, bounds):
    assert bounds("--lower", typed) == ([None, -0.5], [8, 9])


def test_one_number_is_for_all_in_mat_too_and_none_takes_bounds_away(bounds):
    assert bounds("--lower", "-1/2", "--upper", "none") == (-0.5, None)
    assert bounds("--lower", "0", "--upper", "inf") == (0, None)
    Path("one.mat").write_bytes(mat(lower=-1))
    assert bounds("--lower", "one.mat") == (-1, [8, 9])


PROGRAM = {"Q": [[2, 0], [0, 2]], "c": [-3, 1], "A": [[1, 1]], "b": [1]}
GAME = {
    "A": [[3, 0], [0, 2]],
    "B": [[0, 2], [3, 0]],
    "rows": ["opera", "football"],
    "columns": ["left", "right"],
}


def test_bad_origins_and_options_without_effect_are_reported_in_one_line(lcp, files):
    told = {
        "3": "is a number; give an object with the key kind",
        "{": f"line 1, column 2: {ENDS_TOO_EARLY}",
    }
    for origin, words in (
        told | {'{"kind": "qp", "variables": 9}': OTHER_ORIGIN}
    ).items():
        np.savez(
            files / "bad.npz", M=[[2.0, 1.0], [1.0, 2.0]], q=[-1.0, -1.0], origin=origin
        )
        assert_refused(lcp("solve bad.npz"), f"lcp: bad.npz: origin: {words}")


@pytest.mark.parametrize("place", [(0, 1), (0, 2), (2, 2), (3, 3)])
@pytest.mark.parametrize("kind", ["qp", "game"])
def test_a_changed_matrix_no_longer_fits_its_origin(kind, place):
    program = from_qp(PROGRAM["Q"], [1, 2], [[1, 1]], [1], row_upper=[2])
    problem = program if kind == "qp" else from_game(GAME["A"], GAME["B"])
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


def test_a_note_says_once_that_b_alone_is_a_lower_bound(in_folder, lcp):
    program = {"Q": [[2]], "c": [-3], "A": [[1]], "b": [1]}
    note = "b is read as Ax >= b; name it row_upper for Ax <= b, and give it as "
    note += "row_lower and as row_upper for Ax = b"
    save_json(in_folder / "b.json", program)
    assert lcp("solve b.json").err == f"lcp: b.json: {note}\n"
    assert lcp("check b.json 1.5").err == f"lcp: b.json: {note}\n"
    assert lcp("solve b.json -q").err == ""
    others = {
        "range": program | {"row_upper": [2]},
        "qpsolvers": {"P": [[2]], "q": [-3], "A": [[1]], "b": [1]},
        "lower": {"c": [1], "A": [[1]], "row_lower": [1]},
    }
    for name, data in others.items():
        save_json(in_folder / f"{name}.json", data)
        assert lcp(f"solve {name}.json").err == ""
    lines = f"{json.dumps(program)}\n" * 2
    (in_folder / "b.jsonl").write_text(lines)
    assert note not in lcp("solve b.jsonl").err


def test_a_comparison_in_csv_says_that_the_file_has_no_iterates(
    in_folder,  # noqa: ARG001
    lcp,
):
    said = "lcp: 2 of 2 runs solved"
    hint = "; the file has their solutions, with --trace the iterates"
    command = "compare paper-example-1 -o"
    assert lcp(f"{command} it.csv").err == f"{said}{hint}\n"
    assert lcp(f"{command} it.csv --trace").err == f"{said}\n"
    assert lcp(f"{command} it.txt").err == f"{said}\n"


def test_a_bound_that_is_0_in_double_precision_alone_is_exact(in_folder, lcp):
    (in_folder / "p.json").write_text('{"M": [[1]], "q": [1]}')
    asked = "solve p.json --lower 1e-400 --exact -f json"
    (z,) = lcp(asked).record["exact"]["z"]
    assert Fraction(z) == Fraction(1, 10**400)
