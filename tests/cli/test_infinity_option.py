"""--lower, --upper and --infinity: typed or in a file of any format, in every command that reads problems."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import from_qp, read
from lcpcli.files import contents

from ..bad_input.matrix_kinds import archive, mat, npy
from ..conftest import Outcome
from ..far_bounds import FAR
from .conftest import EXAMPLE, Lcp, assert_refused, record, records

MIXED = '{"M": [[2, 1], [1, 2]], "q": [-5.1, -6], "lower": [-1e20, 0.1], "upper": [1e20, 1e400]}'
REMARK = "lcp: far.json: 6 bounds of 1e20 or more; --infinity 1e20 makes them infinite\n"


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder, entered, with far.json, a program with far bounds, mixed.json and lcp.json."""
    monkeypatch.chdir(tmp_path)
    Path("far.json").write_text(json.dumps(FAR))
    Path("mixed.json").write_text(MIXED)
    Path("lcp.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, 1e25]}')


def test_it_makes_a_program_smaller_and_leaves_its_answer(lcp: Lcp) -> None:
    before, after = (lcp("solve", "far.json", *given, "--format", "json") for given in ((), ("--infinity", "1e20")))
    assert (before.code, before.err, after.code, after.err) == (0, REMARK, 0, "")
    with_bounds, without = (record(outcome) for outcome in (before, after))
    assert (len(with_bounds["z"]), len(without["z"])) == (9, 6)
    assert with_bounds["answer"]["x"] == without["answer"]["x"] == [1.5, 0]


def test_check_inspect_convert_compare_and_bench_read_the_same_problem_as_solve(lcp: Lcp) -> None:
    infinity = ("--infinity", "1e20")
    assert lcp("solve", "far.json", *infinity, "-o", "z.csv").code == 0
    assert lcp("check", "far.json", "z.csv", *infinity).code == 0
    assert lcp("check", "far.json", "z.csv", *infinity, "--exact").code == 0
    assert lcp("inspect", "far.json", *infinity).out.startswith("far: n = 6 ")
    assert lcp("convert", "far.json", *infinity, "-o", "near.json") == Outcome(0, "", "")
    near = read("near.json")
    assert near.n == read("far.json", infinity=1e20).n == 6
    assert not (near.q != from_qp(**FAR, infinity=1e20).q).any()
    assert record(lcp("compare", "far.json", *infinity, "--method", "newton", "--format", "json"))["n"] == 6
    lcp("bench", "far.json", *infinity, "--method", "newton", "--budget", "0", "-o", "bench.json", "-q")
    assert json.loads(Path("bench.json").read_text())["measurements"][0]["n"] == 6
    assert lcp("bench", "--resume", "bench.json", "-q").code == 0
    lcp("bench", "lcp.json", "--method", "newton", "--budget", "0", "-o", "older.json", "-q")
    text = Path("older.json").read_text()
    assert ', "infinity": null' in text
    Path("older.json").write_text(text.replace(', "infinity": null', ""))
    assert lcp("bench", "--resume", "older.json", "-q") == Outcome(0, "", "")


def test_several_files_and_all_solutions_take_it(lcp: Lcp) -> None:
    outcome = lcp("solve", "far.json", "mixed.json", "lcp.json", "--infinity", "1e20", "--format", "json")
    assert [len(each["z"]) for each in records(outcome)] == [6, 2, 2]
    assert outcome.err == "lcp: 3 problems: 3 solved\n"
    both = [lcp("solve", "mixed.json", "--all", "--format", "json", *given) for given in ((), ("--infinity", "1e20"))]
    before, after = (record(outcome) for outcome in both)
    assert before["pieces"] == after["pieces"]


def test_exact_bounds_are_the_decimals_but_for_those_that_are_none(lcp: Lcp) -> None:
    pytest.importorskip("flint")
    result = record(lcp("solve", "mixed.json", "--infinity", "1e20", "--exact", "--format", "json"))
    assert result["exact"]["z"] == ["7/5", "23/10"]
    both = ("--lower", "1/3", "--upper", "1e20,0.7")
    result = record(lcp("solve", "mixed.json", *both, "--infinity", "1e19", "--exact", "--format", "json"))
    assert result["exact"]["z"] == ["11/5", "7/10"]
    for name in ("far.json", "far.npz"):
        lcp("convert", "far.json", "-o", "far.npz")
        result = record(lcp("solve", name, "--infinity", "1e20", "--exact", "--format", "json"))
        assert result["answer"]["exact"]["x"] == ["3/2", "0"]


@pytest.mark.parametrize(
    ("path", "size"), [("lcp.json", "1e20"), (contents.shipped_path("diode-bridge.json"), "1e20"), (EXAMPLE, "inf")]
)
def test_problems_without_such_bounds_are_solved_with_it_as_without_it(path: str, size: str, lcp: Lcp) -> None:
    before, after = (lcp("solve", path, *given, "--format", "csv") for given in ((), ("--infinity", size)))
    assert after == before
    assert before.err == ""


def test_the_remark_comes_once_wherever_a_problem_is_solved(lcp: Lcp) -> None:
    for line in (
        "solve far.json",
        "solve far.json --exact",
        "solve far.json --all",
        "compare far.json --method newton",
    ):
        assert lcp(*line.split()).err == REMARK
    assert lcp("bench", "far.json", "--method", "newton", "--budget", "0").err == REMARK
    assert lcp("solve", "far.json", "mixed.json").err == (
        f"{REMARK}lcp: mixed.json: 2 bounds of 1e20 or more; --infinity 1e20 makes them infinite\n"
        "lcp: 2 problems: 2 solved\n"
    )
    for line in ("solve far.json -q", "solve far.json far.json -q", "solve far.json --infinity 1e25", "solve lcp.json"):
        assert lcp(*line.split()).err == ""


def test_inspect_remarks_on_it_among_its_hints(lcp: Lcp) -> None:
    hint = "6 bounds of 1e20 or more; --infinity 1e20 makes them infinite"
    shown = lcp("inspect", "far.json")
    assert (shown.out.splitlines()[1], shown.err) == (hint, "")
    assert record(lcp("inspect", "far.json", "--format", "json"))["hints"] == [hint]
    assert hint in lcpcli.inspect(read("far.json")).hints
    assert "1e20" not in lcp("inspect", "far.json", "--infinity", "1e20").out
    assert "1e20" not in lcp("inspect", contents.shipped_path("diode-bridge.json")).out


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
