"""Input that cannot be used costs one line on standard error, which names the file, the
field and what to do, and the exit code 2."""

import json
from fractions import Fraction

import pytest

from ..conftest import save_json
from .conftest import assert_refused

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


@pytest.mark.parametrize("bound", ["1e-400,0", "none,-1e-400", "[0,1/1" + 400 * "0"])
def test_a_bound_that_is_0_only_in_double_precision_is_refused(bound, lcp, in_folder):
    save_json(in_folder / "p.json", {"M": [[1, 0], [0, 1]], "q": [1, 1]})
    (in_folder / "bound.txt").write_text(bound.strip("[").replace("none", "-inf"))
    for lower in bound, "bound.txt":
        asked = lcp("solve", "p.json", "--lower", lower)
        assert_refused(asked, "0 in double precision", "--exact keeps all digits")
        assert lcp("solve", "p.json", "--exact", "--lower", lower).code == 0


# Of each the solutions would be those of 0 in the place of a number.
LOST_IN_FORMULATIONS = [
    {"Q": [["-1e-400"]], "c": [1]},
    {"Q": [[1]], "c": [-1], "A": [["1e-400"]], "row_lower": ["2e-400"]},
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
