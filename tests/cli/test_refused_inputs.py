"""Input that cannot be used costs one line on standard error, which names the file, the
field and what to do, and the exit code 2."""

import io
import json
from fractions import Fraction

import numpy as np
import pytest
from scipy import sparse

from ..conftest import save_json
from .conftest import assert_refused


def archive(**arrays):
    np.savez(file := io.BytesIO(), **arrays)
    return file.getvalue()


def objects(value):
    found = np.empty((), dtype=object)
    found[()] = value
    return found


PAIR = {"P": np.eye(2), "q": np.ones(2)}
# Arrays in an NPZ file.
NPZ = [
    (PAIR | {"G": objects([None])}, "G: is not an array"),
    (PAIR | {"G": objects({})}, "G: is not an array"),
    (PAIR | {"G": objects(sparse.eye_array(2))}, "G: is a sparse matrix as a pickle"),
    (PAIR | {"h": np.array([None, None])}, "h: is not an array"),
    (PAIR | {"unknown": objects(None)}, "unknown: is not a key of a program"),
    ({"P": objects(None), "q": objects(None), "G": np.eye(2)}, "q: is missing"),
    ({"M": objects(None), "q": np.ones(2)}, "M: is missing"),
    ({"M": np.eye(2), "q": np.ones(2), "bound": objects(None)}, "bound: is not a key"),
]


@pytest.mark.parametrize(("arrays", "words"), NPZ, ids=[words for _, words in NPZ])
def test_arrays(arrays, words, lcp, in_folder):
    (in_folder / "bad.npz").write_bytes(archive(**arrays))
    assert_refused(lcp("solve bad.npz"), f"lcp: bad.npz: {words}")


TINY = "1/1" + 400 * "0"
# Files whose M is 1e-400, the first of them.
LOST = [
    {"t.json": '{"M": [[1e-400]], "q": [-1]}'},
    {"t.json": json.dumps({"M": [[TINY]], "q": [-1]})},
    {"t.json": json.dumps({"M": [["0." + 399 * "0" + "1"]], "q": [-1]})},
    {"t.csv": "1e-400,-1\n"},
    {"t.csv": f"{TINY},-1\n"},
    {"t.mtx": "%%MatrixMarket matrix array real general\n1 1\n1e-400\n", "q": "-1\n"},
]


@pytest.mark.parametrize("files", LOST)
@pytest.mark.parametrize("command", ["solve", "inspect", "compare"])
def test_a_number_that_is_0_only_in_double_precision_is_refused(
    command, files, lcp, in_folder
):
    """So that nothing is proved of a problem with 0 in its place."""
    for name, text in files.items():
        (in_folder / name).write_text(text)
    asked = lcp(command, *files)
    assert_refused(asked, "0 in double precision", "lcp solve --exact keeps all digits")


# Of each the solutions would be those of 0 in the place of a number.
LOST_IN_FORMULATIONS = [
    {"Q": [["1e-400"]], "c": ["-1e-400"]},
    {"Q": [["-1e-400"]], "c": [1]},
    {"Q": [[1]], "c": [-1], "A": [["1e-400"]], "row_lower": ["2e-400"]},
    {"Q": [[1]], "c": [-1], "A": [[1]], "row_lower": ["2e-400"]},
    {"P": [["1e-400"]], "q": [-1]},
    {"H": [["1e-400"]], "h": ["-1e-400"]},
    {"sizes": [1, 1], "H": [["1e-400", 0], [0, 1]], "c": ["-1e-400", -1]},
    {"W": [["1e-400", 0], [0, 1]], "q": [-1, 0], "mu": 0.5},
    {"M": [["1e-400"]], "q": [-1], "origin": {"kind": "qp", "variables": 1}},
]


@pytest.mark.parametrize("data", LOST_IN_FORMULATIONS, ids=lambda data: " ".join(data))
@pytest.mark.parametrize("options", [(), ("--exact",), ("--all",)])
def test_a_formulation_is_refused_in_exact_arithmetic_too(
    options, data, lcp, in_folder
):
    """As its answers are computed in double precision, in which a number is 0."""
    save_json(in_folder / "p.json", data)
    refused = lcp("solve", "p.json", *options)
    assert_refused(refused, "0 in double precision; scale the data")
    assert "--exact" not in refused.err
    scaled = json.dumps(data).replace("e-400", "e-3")
    (in_folder / "scaled.json").write_text(scaled)
    assert "double precision" not in lcp("solve", "scaled.json", *options).err


@pytest.mark.parametrize(
    ("value", "shown", "refusing", "others"),
    [
        ("1e-400", "~1e-400", ("npz", "mat", "npy"), ".json, .csv or .mtx"),
        (TINY, "~1e-400", ("npz",), ".json, .csv or .mtx"),
        ("1/3" + 400 * "0", "~3.333333e-401", ("npz", "mtx"), ".json or .csv"),
    ],
)
def test_a_file_of_doubles_has_no_0_for_another_number(
    value, shown, refusing, others, lcp, in_folder
):
    data = {"M": [[value, 0], [0, 1]], "q": ["-1", -1]}
    save_json(in_folder / "p.json", data)
    for ending in refusing:
        refused = lcp(f"convert p.json -o o.{ending}")
        words = f"cannot hold {shown}, which is 0 in double precision; use {others}"
        assert_refused(refused, f"lcp: o.{ending}: {words}")
        assert not [*in_folder.glob("o.*")]
    for ending in others.replace(" or ", ", ").split(", "):
        assert lcp(f"convert p.json -o o{ending}").code == 0
        files = ["o.mtx", "o.q.mtx"] if ending == ".mtx" else [f"o{ending}"]
        solved = lcp("solve", "--exact", *files, "-f", "json").record
        assert solved["exact"]["z"] == [str(1 / Fraction(value)), "1"]


def test_a_number_of_too_large_an_exponent_is_refused_in_its_field_without_a_wrong_hint(
    lcp, in_folder
):
    (in_folder / "t.json").write_text('{"M": [[1]], "q": [-1e-6000]}')
    where, hint = "lcp: t.json: q: has ", "keep exponents between -5000 and 5000"
    lost = "'-1e-6000', which is 0 in double precision; scale the data"
    assert lcp("solve t.json").err == f"{where}{lost}\n"
    exactly = lcp("solve t.json --exact").err
    assert exactly == f"{where}the number '-1e-6000'; {hint}\n"


@pytest.mark.parametrize("options", [[], ["--exact"]])
def test_a_start_and_a_known_solution_may_round_to_0(options, lcp, in_folder):
    text = '{"M": [[1]], "q": [1], "x0": [1e-400], "solution": [1e-400]}'
    (in_folder / "t.json").write_text(text)
    outcome = lcp("solve", "t.json", "-f", "json", *options)
    assert outcome.err == ""
    assert outcome.record["z"] == [0.0]
    assert lcp("convert t.json -o copy.json").code == 0
    assert '"x0": [1E-400]' in (in_folder / "copy.json").read_text()


def test_a_q_that_is_0_only_in_double_precision_is_refused(lcp, in_folder):
    (in_folder / "M.csv").write_text("1\n")
    for q in ("-1e-400\n", "-1,-1e-400\n"):  # one, and one in each column
        (in_folder / "q.csv").write_text(q)
        assert_refused(lcp("solve M.csv q.csv"), "lcp: q.csv: has '-1e-400'")


@pytest.mark.parametrize("files", LOST)
def test_exact_arithmetic_has_numbers_that_doubles_have_not(files, lcp, in_folder):
    for name, text in files.items():
        (in_folder / name).write_text(text)
    solved = lcp("solve", "--exact", *files, "-f", "json").record
    assert solved["status"] == "solved"
    assert solved["exact"]["z"] == [str(10**400)]


def test_a_subnormal_number_is_no_0(lcp, in_folder):
    (in_folder / "t.json").write_text('{"M": [[1e-320]], "q": [-1e-320]}')
    solved = lcp("solve t.json -f json").record
    assert solved["status"] == "solved"
    assert solved["z"] == [1.0]


@pytest.mark.parametrize("table", ["-5,-1e-200\n-6,-3\n", "a1e-400,b\n-5,-6\n-3,-2\n"])
def test_several_q_with_small_numbers_are_solved(table, lcp, in_folder):
    (in_folder / "M.csv").write_text("2,1\n1,2\n")
    (in_folder / "Q.csv").write_text(table)
    told = lcp("solve M.csv Q.csv -f json")
    assert told.code == 0
    assert told.out.count('"status": "solved"') == 2
    (in_folder / "Q.csv").write_text("-5,-1e-400\n-6,-3\n")
    assert "is 0 in double precision" in lcp("solve M.csv Q.csv").err
