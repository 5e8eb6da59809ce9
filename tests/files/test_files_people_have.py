"""Files as other programs write them are read to the right numbers; what is not read is refused by its name."""

from __future__ import annotations

import io
import json
import pickle
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.io import savemat

from lcpcli import read
from lcpcli.errors import ProblemError
from lcpcli.files import beside

from .. import small_problem
from ..conftest import Outcome

Lcp = Callable[..., Outcome]
M, Q = np.array(small_problem.M), np.array(small_problem.Q)


def mat(**variables: Any) -> bytes:
    file = io.BytesIO()
    savemat(file, variables)
    return file.getvalue()


def npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def archive(*names: str) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as writing:
        for name in names:
            writing.writestr(name, "content")
    return file.getvalue()


BINARY = {
    "column.mat": mat(M=M, q=Q[:, np.newaxis]),
    "row.mat": mat(M=M, q=Q),
    "sparse.mat": mat(M=sparse.csc_array(M), q=sparse.csc_array(Q[:, np.newaxis])),
    "workspace.mat": mat(M=M, q=Q, ans=3.0, options={"tol": 1.0}, cells=np.array([1, "a"], dtype=object)),
    "integers.npy": npy(np.column_stack((4 * M, 4 * Q)).astype(int)),
    "by-columns.npy": npy(np.asfortranarray(np.column_stack((M, Q)))),
}


def test_other_numbers_below_a_named_corner_get_a_hint(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("id,z1,z2,q\n11,2,-1,-1\n12,-0.5,2,0.25\n")
    with pytest.raises(ProblemError, match="leave the first cell of the header empty"):
        read(tmp_path / "p.csv")


@pytest.mark.parametrize("name", BINARY)
def test_arrays_are_read_to_the_right_numbers(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_bytes(BINARY[name])
    problem, factor = read(file), 4 if name == "integers.npy" else 1
    whole = problem.M.toarray() if sparse.issparse(problem.M) else problem.M
    assert (whole / factor).tolist() == M.tolist()
    assert (problem.q / factor).tolist() == Q.tolist()
    assert sparse.issparse(problem.M) == (name == "sparse.mat")


@pytest.mark.parametrize("ending", ["npy", "mat", "npz"])
def test_binary_content_is_recognized_on_standard_input(ending: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    npz = io.BytesIO()
    np.savez(npz, M=M, q=Q)
    contents = {"npy": npy(np.column_stack((M, Q))), "mat": mat(M=M, q=Q), "npz": npz.getvalue()}
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(contents[ending])))
    outcome = lcp("solve", "-", "--format", "json")
    assert (outcome.code, json.loads(outcome.out)["z"]) == (0, [0.5, 0])


FILES = {
    "M.npy": npy(M),
    "q.npy": npy(Q[:, np.newaxis]),
    "M.mat": mat(M=M),
    "b.mat": mat(b=Q),
    "p.csv": b"2,-1,-1\n-0.5,2,0.25\n",
    "M.csv": b"2;-1\n-0,5;2\n",
    "q.csv": b";0\n0;-1\n1;0,25\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lcpcli.solving.driver.MOST_REPETITIONS", 1)  # whose times are not looked at here
    return tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("files", ["M.npy q.npy", "M.mat b.mat", "M.csv q.csv", "M.npy q.csv"])
def test_two_files_are_one_problem_in_every_command(lcp: Lcp, files: str) -> None:
    for line in ("solve {} --exact --quiet", "compare {} --method lemke -q", "check {} 0.5,0"):
        outcome = lcp(*line.format(files).split())
        assert (outcome.code, outcome.err) == (0, "")


def test_a_file_that_holds_M_alone_takes_exactly_the_next_one(folder: Path, lcp: Lcp) -> None:
    files = ["p.csv", "M.npy", "q.npy", "M.mat", "b.mat", "p.csv"]
    found = lcp("compare", *files, "--method", "newton", "--format", "json")
    assert [json.loads(line)["problem"] for line in found.out.splitlines()] == ["p", "M", "M", "p"]
    assert lcp("compare", "p.csv", "M.npy").err.strip() == (
        "lcp: M.npy: contains M, 2 x 2, but no q; add q, or name the file of q after it"
    )
    lcp("bench", *files, "--method", "newton", "--budget", "0", "-q", "-o", "b.json")
    record = json.loads((folder / "b.json").read_text())
    assert [case["name"] for case in record["cases"]] == ["p.csv", "M.npy q.npy", "M.mat b.mat"]
    record["measurements"].clear()
    (folder / "b.json").write_text(json.dumps(record))
    assert lcp("bench", "--resume", "b.json", "-q").code == 0
    assert all(row["success"] for row in json.loads((folder / "b.json").read_text())["measurements"])


def test_numbers_are_typed_in_any_usual_way_unless_a_file_has_their_name(
    lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text("1,0,0,-1\n0,1,0,2.5\n0,0,1,-1\n")
    for text in ("1,-2.5,1/3", "1 -2.5 1/3", "[1, -2.5, 1/3]", " 1; -2.5;1/3", "[1,-2.5 1/3]"):
        assert beside.typed_numbers(text) == ["1", "-2.5", "1/3"]
        assert lcp("solve", "p.csv", "--x0", text, "-q").code == 0
        assert lcp("check", "p.csv", text.replace("-2.5", "0").replace("1/3", "3/3")).code == 0
    assert beside.typed_vector("--x0", ["1", "-2.5", "1/3"], 3).tolist() == [1, -2.5, 1 / 3]
    Path("1").write_text("5")
    assert (beside.typed_numbers("1"), beside.typed_numbers("2"), beside.typed_numbers("p.csv")) == (None, ["2"], None)


THREE_PLAYERS = "is a game of more than two players; its equilibria are not the solutions of an LCP"
ROWS = (
    "n rows of n + 1 columns (M and q) or of n columns (M alone), or name q, lower and upper in a header, if the last"
)
ROWS += " columns are these"
AN_INDEX = "is the first column an index? leave the first cell of the header empty"
FOREIGN = [
    ("p.xlsx", archive("[Content_Types].xml", "xl/workbook.xml"), "is a spreadsheet; save it as CSV"),
    ("p.csv", archive("[Content_Types].xml", "xl/workbook.xml"), "is a spreadsheet; save it as CSV"),
    ("p.csv", b"z1,z2,q\n2,-1,-1\na,2,0.25\n", "line 3, column 1: is 'a', not a number"),
    ("p.ods", b"no matter what", "is a spreadsheet; save it as CSV"),
    ("p.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "is a spreadsheet; save it as CSV"),
    ("p.gbt", b"gambit", "is a document of Gambit's graphical interface; save the game there as .efg or .nfg"),
    ("p.mat", b"MATLAB 7.3 MAT-file", "is a MATLAB file of version 7.3; save it with -v7"),
    ("p.h5", b"\x89HDF\r\n\x1a\n", "is HDF5; save M and q with numpy.savez"),
    ("p.pkl", pickle.dumps([1]), "is a pickle, which may run any code when it is read"),
    ("p.txt", pickle.dumps([1]), "is a pickle, which may run any code when it is read"),
    ("p.json.gz", b"\x1f\x8b\x08", "cannot be uncompressed, as it is cut off; compress it again"),
    ("p.zip", archive("p.json"), "is compressed; uncompress it first"),
    ("p.parquet", b"PAR1", "is a binary table; save it as CSV"),
    ("p.pdf", b"%PDF-1.7", "is a document; copy M and q into a CSV file"),
    ("p.m", b"M = [2 1; 1 2];", "is a script or a model, which lcp does not run"),
    ("p.json", b"<!DOCTYPE html>", "is HTML or XML; was a web page saved in place of the file?"),
    ("p.mat", b"MATLAB 5.0 MAT-file", "is not a MAT file"),
    ("p.mat", mat(A=M, b=Q), "M: is missing; call the matrix M and the vector q; the file holds A, b"),
    ("p.mat", mat(M=M * 1j, q=Q), "M: is complex (complex128); give real numbers"),
    ("p.npy", npy(np.column_stack((M, Q)) * 1j), "q: is complex (complex128); give real numbers"),
    ("p.npy", npy(np.array([1, "a"], dtype=object)), "is an array of objects"),
    ("p.npy", npy(M)[:-8], "is declared as 2 x 2 of float64 but has 24 bytes; save it again with numpy.save"),
    ("p.json", b'{"M": [[2, 0], [0, "1+2j"]], "q": [1, 1]}', "M[1][1]: is the text '1+2j'; give real numbers"),
    ("p.json", b'{"M": [[2, "z1*z2"]], "q": [1]}', "M[0][1]: is the text 'z1*z2'; give real numbers; lcp solves"),
    ("p.json", b'{"F": ["z1^2 - 1"]}', "is a nonlinear problem; give M and q of a linear one, or a .nl model"),
    ("p.json", b'{"A": [[1]], "B": [[1]], "C": [[1]]}', THREE_PLAYERS),
    ("p.json", b'{"A": [[[1, 2]]], "B": [[1]]}', THREE_PLAYERS),
]


@pytest.mark.parametrize(("name", "content", "words"), FOREIGN)
def test_what_is_not_read_is_refused_by_name(tmp_path: Path, lcp: Lcp, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    outcome = lcp("solve", str(tmp_path / name))
    assert outcome.err.startswith(f"lcp: {tmp_path / name}: {words}"), outcome.err
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)


@pytest.mark.parametrize(("place", "byte"), [(136, 118), (145, 75)], ids=["element-of-unknown-type", "complex-flag"])
def test_a_damaged_mat_file_on_which_scipy_crashes_is_refused(tmp_path: Path, lcp: Lcp, place: int, byte: int) -> None:
    content = bytearray(mat(M=np.eye(3), q=-np.ones(3)))
    content[place] = byte
    (tmp_path / "p.mat").write_bytes(content)
    outcome = lcp("solve", str(tmp_path / "p.mat"))
    assert "is not a MAT file (it has an" in outcome.err
    assert outcome.code == 2


@pytest.mark.parametrize(
    ("of_M", "of_q", "is_refused"),
    [
        ("2,5;1\n1;2\n", "-5,5\n-6,5\n", True),
        ("x\ty\n2,5\t1\n1\t2\n", "-5,5\n-6,5E0\n", True),
        ("2.5;1\n1;2\n", "-5,5\n-6,5\n", False),
        ("2,5;1\n1;2\n", "-5.5,5\n-6,5\n", False),
        ("2,5;1\n1;2\n", "mon,tue\n-5,5\n-6,5\n", False),
        ("2,5;1\n1;2\n", "q\n-5,5\n-6,5\n", False),
    ],
)
def test_lines_of_q_that_are_two_numbers_or_one_with_a_decimal_comma_are_refused(
    of_M: str, of_q: str, is_refused: bool, lcp: Lcp, tmp_path: Path
) -> None:
    (tmp_path / "M.csv").write_text(of_M)
    (tmp_path / "q.csv").write_text(of_q)
    outcome = lcp("solve", str(tmp_path / "M.csv"), str(tmp_path / "q.csv"))
    assert outcome.code == 2 * is_refused
    hint = "add a header: q if the comma is a decimal mark, else two names"
    refusal = f"lcp: {tmp_path / 'q.csv'}: q: has two columns, and M has decimal commas; {hint}\n"
    assert (outcome.err == refusal) is is_refused
