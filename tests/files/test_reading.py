"""What can be read safely is read, and to the right numbers."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, read, write
from lcpcli.errors import ProblemError
from lcpcli.files.beside import read_start

from ..conftest import Outcome
from ..small_problem import JSON, M, Q, numbers

MARK = b"\xef\xbb\xbf"


def feed(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    """Put content on standard input."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


SPELLINGS = {
    "commas": b"2,-1,-1\n-0.5,2,0.25\n",
    "semicolons": b"2;-1;-1\n-0.5;2;0.25\n",
    "tabs": b"2\t-1\t-1\n-0.5\t2\t0.25\n",
    "blanks": b"  2 -1   -1\n-0.5  2 0.25  \n",
    "blanks-around-commas": b"2 , -1 , -1\n -0.5,\t2, 0.25\n",
    "byte-order-mark": MARK + b"2,-1,-1\n-0.5,2,0.25\n",
    "byte-order-mark-and-header": MARK + b"a,b,q\n2,-1,-1\n-0.5,2,0.25\n",
    "crlf": b"2,-1,-1\r\n-0.5,2,0.25\r\n",
    "cr": b"2,-1,-1\r-0.5,2,0.25\r",
    "no-newline-at-the-end": b"2,-1,-1\n-0.5,2,0.25",
    "blank-lines": b"\n \n2,-1,-1\n\t\n\n-0.5,2,0.25\n\n",
    "header": b"z1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "quoted-header": b'"z,1";"z,2";"q"\n2;-1;-1\n-0.5;2;0.25\n',
    "header-of-blanks": b"z1 z2 q\n2 -1 -1\n-0.5 2 0.25\n",
    "header-below-a-comment": b"# a, b\nz1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "comments": b"# M; q Sch\xc3\xa4fer\n2,-1,-1\n  # the second row\n-0.5,2,0.25\n#\n",
    "quoted-numbers-after-blanks": b'"2", "-1", "-1"\n"-0.5", "2", "0.25"\n',
    "quoted-numbers-parted-by-blanks": b'"2" "-1"  "-1"\n"-0.5" "2" "0.25"\n',
    "signs-and-exponents": b"+2,-1E0,-10e-1\n-.5,2.,+2.5e-01\n",
    "decimal-commas": b"2;-1;-1\n-0,5;2;0,25\n",
    "decimal-commas-and-exponents": b"2,0;-1,0E0;-1\n-5,0e-1;2;0,25\n",
    "decimal-commas-between-tabs": b"2\t-1\t-1\n-0,5\t2\t0,25\n",
    "index-of-pandas": b",0,1,2\n0,2,-1,-1\n1,-0.5,2,0.25\n",
    "named-index-of-pandas": b",z1,z2,q\na,2,-1,-1\nb,-0.5,2,0.25\n",
    "names-below-a-named-corner": b"asset,z1,z2,q\na,2,-1,-1\nb,-0.5,2,0.25\n",
    "names-as-R-writes-them": b'"","z1","z2","q"\n"a",2,-1,-1\n"b",-0.5,2,0.25\n',
    "numbers-below-a-named-corner": b"id,z1,z2,q\n1,2,-1,-1\n2,-0.5,2,0.25\n",
    "numbers-from-0-beside-bounds": b"id,z1,z2,q,lower\n0,2,-1,-1,0\n1,-0.5,2,0.25,0\n",
    "index-and-decimal-commas": b";0;1;q\n0;2;-1;-1\n1;-0,5;2;0,25\n",
    "utf-16-of-excel": "z1\tz2\tq\r\n2\t-1\t-1\r\n-0,5\t2\t0,25\r\n".encode("utf-16"),
    "utf-16-big-endian": b"\xfe\xff" + "2,-1,-1\n-0.5,2,0.25\n".encode("utf-16-be"),
    "json": JSON.encode(),
    "json-byte-order-mark": MARK + JSON.encode(),
    "json-crlf-and-blank-lines": f"\n\n {JSON}\n\n".replace(" ", "\r\n").encode(),
    "json-exponents": b'{"M": [[2e0, -1E+0], [-5e-1, 20e-1]], "q": [-1.0, 25e-2]}',
    "json-other-order": b'{"q": [-1, 0.25], "M": [[2, -1], [-0.5, 2]]}',
    "json-coordinates": b"""{"M": {"format": "coo", "shape": [2, 2], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1],
                            "values": [2, -1, -0.5, 2]}, "q": [-1, 0.25]}""",
    "json-coordinates-unordered": b"""{"q": [-1, 0.25], "M": {"values": [2, -0.5, -1, 2], "cols": [1, 0, 1.0, 0e0],
                                      "rows": [1, 1, 0, 0], "shape": [2.0, 2e0], "format": "coo"}}""",
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_every_safe_spelling_is_read_from_a_file_and_from_standard_input(
    spelling: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for suffix in ("csv", "txt", *(["json"] if spelling.startswith("json") else [])):
        (tmp_path / f"problem.{suffix}").write_bytes(SPELLINGS[spelling])
        problem = read(tmp_path / f"problem.{suffix}")
        assert (numbers(problem), problem.name) == ((M, Q), "problem")
    feed(monkeypatch, SPELLINGS[spelling])
    problem = read("-")
    assert (numbers(problem), problem.name) == ((M, Q), "standard input")


VECTORS = {
    "row": b"-1,0.25\n",
    "column": b"-1\n0.25\n",
    "row-of-semicolons": b"-1;0.25",
    "row-of-blanks": b"-1 0.25",
    "row-below-a-header": b"a,b\n-1,0.25\n",
    "column-below-a-header": b"q\r\n-1\r\n0.25\r\n",
    "column-with-blank-lines": b"\n-1\n\n0.25",
    "column-with-comments": b"# q\n-1\n# and\n0.25",
    "column-in-quotes": b'"-1"\n"0.25"\n',
    "column-with-one-in-quotes": b'"-1"\n0.25\n',
    "byte-order-mark": MARK + b"-1\n0.25\n",
    "json-list": b"[-1, 0.25]",
    "json-list-in-lines": b"\n[\r\n-1,\r\n25e-2\r\n]\r\n",
    "json-list-with-mark": MARK + b"[-1, 0.25]",
}


@pytest.mark.parametrize("content", VECTORS.values(), ids=VECTORS)
def test_q_and_a_start_are_read_from_a_file_of_their_own(
    tmp_path: Path, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    (tmp_path / "q.csv").write_bytes(content)
    feed(monkeypatch, content)
    for q in (str(tmp_path / "q.csv"), "-"):
        problem = read(str(tmp_path / "M.csv"), q)
        assert (numbers(problem), problem.name) == ((M, Q), "M")
    assert read_start("--x0", str(tmp_path / "q.csv"), 2).tolist() == Q


def test_a_start_is_taken_from_a_file_and_one_of_hundreds_of_numbers_from_the_command_line(
    lcp: Callable[..., Outcome], tmp_path: Path
) -> None:
    file, start = str(tmp_path / "problem.json"), str(tmp_path / "start")
    Path(file).write_text(JSON)
    Path(start).write_text("-1\n0.25\n")
    for number, option in enumerate(("--x0", "--x1")):
        options = (option, start, "--format", "json", "--trace", "--max-iterations", "1")
        trace = json.loads(lcp("solve", file, "--method", "shi", *options).out)["trace"]
        assert trace[number]["z"] == [0, 0.5]
    write(Problem(2 * sparse.eye_array(300, format="csr"), np.full(300, -1.0)), file)
    outcome = lcp("solve", file, "--x0", ",".join(["0.25"] * 300), "-q")
    assert (outcome.code, outcome.err) == (0, "")


def test_one_solution_or_several_are_read_from_json(tmp_path: Path) -> None:
    for solution, expected in (([1, 0], [[1, 0]]), ([[1, 0]], [[1, 0]]), ([[1, 0], [0, 2.5]], [[1, 0], [0, 2.5]])):
        (tmp_path / "problem.json").write_text(json.dumps({**json.loads(JSON), "solution": solution}))
        assert [z.tolist() for z in read(tmp_path / "problem.json").solutions] == expected


def test_zeros_in_coordinates_or_none_at_all_are_zeros(tmp_path: Path) -> None:
    for entries, corner in (([1, 0], 3), ([], 0)):
        coordinates = {"format": "coo", "shape": [2, 2], "rows": entries, "cols": [0] * len(entries)}
        coordinates["values"] = [0, 3][: len(entries)]
        (tmp_path / "problem.json").write_text(json.dumps({"M": coordinates, "q": [1, 1]}))
        assert numbers(read(tmp_path / "problem.json"))[0] == [[corner, 0], [0, 0]]


def test_a_vector_is_refused_by_the_name_that_it_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "start.csv").write_text("1,2\n3,4\n")
    with pytest.raises(ProblemError, match=r"start\.csv: x0: "):
        read_start("x0", str(tmp_path / "start.csv"), 2)
