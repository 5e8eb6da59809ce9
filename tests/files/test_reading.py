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
    "blank-and-tab-after-semicolon": b"2; -1;\t-1\n-0.5;2;0.25\n",
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
    "comments": b"# M; q\n2,-1,-1\n  # the second row\n-0.5,2,0.25\n#\n",
    "comment-not-in-english": "# Schäfer 2004\n2,-1,-1\n-0.5,2,0.25\n".encode(),
    "quoted-numbers": b'"2","-1","-1"\n"-0.5","2","0.25"\n',
    "quoted-numbers-after-blanks": b'"2", "-1", "-1"\n"-0.5", "2", "0.25"\n',
    "quoted-numbers-parted-by-blanks": b'"2" "-1"  "-1"\n"-0.5" "2" "0.25"\n',
    "signs-and-exponents": b"+2,-1E0,-10e-1\n-.5,2.,+2.5e-01\n",
    "json": JSON.encode(),
    "json-byte-order-mark": MARK + JSON.encode(),
    "json-crlf": JSON.replace(" ", "\r\n").encode(),
    "json-blank-lines": f"\n\n {JSON}\n\n".encode(),
    "json-exponents": b'{"M": [[2e0, -1E+0], [-5e-1, 20e-1]], "q": [-1.0, 25e-2]}',
    "json-other-order": b'{"q": [-1, 0.25], "M": [[2, -1], [-0.5, 2]]}',
    "json-coordinates": b"""{"M": {"format": "coo", "shape": [2, 2], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1],
                            "values": [2, -1, -0.5, 2]}, "q": [-1, 0.25]}""",
    "json-coordinates-unordered": b"""{"q": [-1, 0.25], "M": {"values": [2, -0.5, -1, 2], "cols": [1, 0, 1.0, 0e0],
                                      "rows": [1, 1, 0, 0], "shape": [2.0, 2e0], "format": "coo"}}""",
}


@pytest.mark.parametrize("content", SPELLINGS.values(), ids=SPELLINGS)
@pytest.mark.parametrize("name", ["problem.csv", "problem.txt"])
def test_every_safe_spelling_is_read(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    problem = read(str(path))
    assert numbers(problem) == (M, Q)
    assert problem.name == "problem"


@pytest.mark.parametrize("content", SPELLINGS.values(), ids=SPELLINGS)
def test_every_safe_spelling_is_read_from_standard_input(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    feed(monkeypatch, content)
    problem = read("-")
    assert numbers(problem) == (M, Q)
    assert problem.name == "standard input"


@pytest.mark.parametrize("spelling", [name for name in SPELLINGS if name.startswith("json")])
def test_json_files_are_read(tmp_path: Path, spelling: str) -> None:
    path = tmp_path / "problem.json"
    path.write_bytes(SPELLINGS[spelling])
    assert numbers(read(str(path))) == (M, Q)


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
def test_q_is_read_from_a_file_of_its_own(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    (tmp_path / "q.csv").write_bytes(content)
    problem = read(str(tmp_path / "M.csv"), str(tmp_path / "q.csv"))
    assert numbers(problem) == (M, Q)
    assert problem.name == "M"


def test_q_is_read_from_standard_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    feed(monkeypatch, b"-1\n0.25\n")
    assert numbers(read(str(tmp_path / "M.csv"), "-")) == (M, Q)


@pytest.mark.parametrize("content", VECTORS.values(), ids=VECTORS)
@pytest.mark.parametrize("option", ["--x0", "--x1"])
def test_a_start_is_read_from_a_file(lcp: Callable[..., Outcome], tmp_path: Path, option: str, content: bytes) -> None:
    (tmp_path / "problem.json").write_text(JSON)
    (tmp_path / "start").write_bytes(content)
    options = [option, str(tmp_path / "start"), "--format", "json", "--trace", "--max-iterations", "1"]
    outcome = lcp("solve", str(tmp_path / "problem.json"), "--method", "shi", *options)
    trace = json.loads(outcome.out)["trace"]
    assert trace[int(option[-1])]["z"] == [0, 0.5]


def test_a_start_of_hundreds_of_numbers_can_be_given_on_the_command_line(
    lcp: Callable[..., Outcome], tmp_path: Path
) -> None:
    n = 300
    write(Problem(2 * sparse.eye_array(n, format="csr"), np.full(n, -1.0)), str(tmp_path / "problem.json"))
    outcome = lcp("solve", str(tmp_path / "problem.json"), "--x0", ",".join(["0.25"] * n), "-q")
    assert (outcome.code, outcome.err) == (0, "")


@pytest.mark.parametrize(
    ("solution", "expected"),
    [("[1, 0]", [[1, 0]]), ("[[1, 0]]", [[1, 0]]), ("[[1, 0], [0, 2.5]]", [[1, 0], [0, 2.5]])],
)
def test_solution_is_one_list_or_a_list_of_lists(tmp_path: Path, solution: str, expected: list[list[float]]) -> None:
    path = tmp_path / "problem.json"
    path.write_text(f'{JSON[:-1]}, "solution": {solution}}}')
    assert [z.tolist() for z in read(str(path)).solutions] == expected


def test_texts_and_starts_are_read_from_json(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    path.write_text(
        f'{JSON[:-1]}, "x0": [1, 2], "x1": [3, 4e0], "name": "n\\u00e4me", "source": "s", "note": "", '
        '"verdict": "ray"}'
    )
    problem = read(str(path))
    assert problem.x0 is not None
    assert problem.x1 is not None
    assert (problem.x0.tolist(), problem.x1.tolist()) == ([1, 2], [3, 4])
    assert (problem.name, problem.source, problem.note, problem.verdict) == ("näme", "s", "", "ray")


def test_zero_entries_in_coordinates_are_zeros(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    coordinates = {"format": "coo", "shape": [2, 2], "rows": [1, 0], "cols": [0, 0], "values": [0, 3]}
    path.write_text(json.dumps({"M": coordinates, "q": [1, 1]}))
    assert numbers(read(str(path)))[0] == [[3, 0], [0, 0]]


def test_coordinates_without_entries_are_the_zero_matrix(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    coordinates = {"format": "coo", "shape": [2, 2], "rows": [], "cols": [], "values": []}
    path.write_text(json.dumps({"M": coordinates, "q": [1, 1]}))
    assert numbers(read(str(path)))[0] == [[0, 0], [0, 0]]


def test_a_vector_is_read_by_the_name_that_it_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "start.csv").write_text("1\n2\n")
    assert read_start("x0", str(tmp_path / "start.csv"), 2).tolist() == [1, 2]
    (tmp_path / "start.csv").write_text("1,2\n3,4\n")
    with pytest.raises(ProblemError, match=r"start\.csv: x0: "):
        read_start("x0", str(tmp_path / "start.csv"), 2)
