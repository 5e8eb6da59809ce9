"""A model, with bounds and names, and q in a file of its own; names in what is written."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import read, write

MODEL: dict[str, Any] = {"M": [[2, 1], [1, 2]], "names": ["wheat", "price n0"], "lower": [0, -1], "upper": 1}
SPARSE = {"format": "coo", "shape": [2, 2], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1], "values": [2, 1, 1, 2]}

Lcp = Callable[..., Any]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("model.json").write_text(json.dumps(MODEL))
    Path("sparse.json").write_text(json.dumps(MODEL | {"M": SPARSE}))
    Path("whole.json").write_text(json.dumps(MODEL | {"q": [-5, 3.3]}))
    np.savez("model.npz", M=MODEL["M"], lower=MODEL["lower"], upper=[1, 1], names=MODEL["names"])
    Path("q.csv").write_text("-5\n3.3\n")


@pytest.mark.parametrize("model", ["model.json", "sparse.json", "model.npz"])
def test_a_model_takes_q_from_another_file_and_keeps_its_bounds_and_names(model: str, lcp: Lcp) -> None:
    whole, parts = read("whole.json"), read(model, "q.csv")
    assert (parts.q.tolist(), list(parts.names)) == (whole.q.tolist(), ["wheat", "price n0"])
    assert [parts.box.lower.tolist(), parts.box.upper.tolist()] == [[0, -1], [1, 1]]
    exact = ("--exact", "--format", "json")
    shown, expected = (json.loads(lcp("solve", *files, *exact).out) for files in ([model, "q.csv"], ["whole.json"]))
    assert shown["exact"]["z"] == expected["exact"]["z"]
    assert shown["names"] == ["wheat", "price n0"]
    assert lcp("check", model, "q.csv", "1,-1", "-q").code == 0
    assert lcp("inspect", model, "q.csv").code == 0


def test_the_digits_of_q_in_its_own_file_count_in_exact_arithmetic(lcp: Lcp) -> None:
    Path("model.json").write_text('{"M": [[1]], "names": ["x"]}')
    Path("q.csv").write_text("-0.1000000000000000000000000000001\n")
    exact = json.loads(lcp("solve", "model.json", "q.csv", "--exact", "--format", "json").out)["exact"]["z"]
    assert list(map(Fraction, exact)) == [Fraction("0.1000000000000000000000000000001")]


def test_a_model_without_q_says_what_may_follow_it(lcp: Lcp) -> None:
    hint = "lcp: model.json: q: is missing; add q, or name the file of q after this one\n"
    assert lcp("solve", "model.json").err == hint
    err = lcp("solve", "whole.json", "q.csv").err
    assert err == (
        "lcp: q.csv: is not needed: whole.json contains M and q; leave it out; has the table an index or a second "
        "problem? see lcp help formats\n"
    )


@pytest.mark.parametrize(
    ("names", "header"),
    [
        (["wheat", "price n0"], "wheat,price n0,q"),
        (["wheat", "q"], None),
        (["wheat", "Lower"], None),
        (["wheat", "1st"], None),
        (["a,b", "c"], None),
        (["wheat", ""], None),
    ],
)
def test_a_table_is_headed_by_names_that_a_header_can_hold(names: list[str], header: str | None, lcp: Lcp) -> None:
    Path("p.json").write_text(json.dumps({"M": [[2, 1], [1, 2]], "q": [-5, 3], "names": names}))
    converted = lcp("convert", "p.json", "-o", "p.csv")
    assert ("left out: names" in converted.err) == (header is None)
    first = Path("p.csv").read_text().splitlines()[0]
    assert first == (header or "2.0,1.0,-5.0")
    assert read("p.csv").q.tolist() == [-5, 3]
    assert list(read("p.csv").names) == (names if header else ["", ""])
    bounded = read("p.json")
    write(type(bounded)(bounded.M, bounded.q, lower=[0, -1], names=names), "b.csv")
    first = Path("b.csv").read_text().splitlines()[0]
    assert first == (f"{header},lower,upper" if header else "M1,M2,q,lower,upper")
    assert read("b.csv").box.lower.tolist() == [0, -1]


def test_columns_of_a_path_have_the_names_of_z_and_of_w(lcp: Lcp) -> None:
    rows = lcp("path", "whole.json", "--direction", "1,1", "--to", "2", "--format", "csv").out.splitlines()
    assert rows[2] == "breakpoint,t,change,wheat,price n0,w wheat,w price n0"


def test_q_may_be_the_only_key_of_an_object(lcp: Lcp) -> None:
    Path("q.json").write_text('{"q": [-5, 3.3]}')
    assert read("model.json", "q.json").q.tolist() == [-5, 3.3]
    assert lcp("solve", "model.json", "q.json", "-q").code == 0


def test_M_alone_in_JSON_takes_several_q_in_columns(lcp: Lcp) -> None:
    Path("M.json").write_text('{"M": [[2, 1], [1, 2]]}')
    Path("three.csv").write_text("low,mid,high\n-5,1,-1\n3.3,2,-2\n")
    lines = lcp("solve", "M.json", "three.csv", "--format", "json").out.splitlines()
    assert [json.loads(line)["problem"] for line in lines] == ["low", "mid", "high"]


@pytest.mark.parametrize(
    ("table", "names"),
    [
        ("wheat,price n0,q\n2,1,-5\n1,2,3\n", ["wheat", "price n0"]),
        (",wheat,corn,q\na,2,1,-5\nb,1,2,3\n", ["wheat", "corn"]),
        ("no,wheat,corn,q\n1,2,1,-5\n2,1,2,3\n", ["wheat", "corn"]),
        ("wheat,corn,q,lower\n2,1,-5,0\n1,2,3,\n", ["wheat", "corn"]),
        ("M1,M2,q\n2,1,-5\n1,2,3\n", ["", ""]),
        ("a,a,q\n2,1,-5\n1,2,3\n", ["", ""]),
        ("2,1,-5\n1,2,3\n", ["", ""]),
    ],
)
def test_a_header_names_the_unknowns_unless_it_only_numbers_them(table: str, names: list[str]) -> None:
    Path("t.csv").write_text(table)
    assert list(read("t.csv").names) == names
    assert read("t.csv").q.tolist() == [-5, 3]
