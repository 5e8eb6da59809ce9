"""Matrix Market, NPZ and MAT are read in every kind that they come in; MAT files with any byte changed, or refused."""

from __future__ import annotations

import gzip
import io
import json
import random
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.io import loadmat, savemat

from lcpcli import read
from lcpcli.errors import ProblemError
from lcpcli.files import mat_format
from lcpcli.files.beside import read_start
from lcpcli.files.mat_format import checked
from lcpcli.linalg.matrices import dense, is_sparse

from ..small_problem import M, Q, numbers

BANNER = "%%MatrixMarket matrix"
MATRICES = {
    "array": f"{BANNER} array real general\n2 2\n2\n-0.5\n-1\n2\n",
    "array-of-doubles": f"{BANNER} array double general\n2 2\n2\n-0.5\n-1\n2\n",
    "array-in-capitals": "%%MATRIXMARKET Matrix ARRAY Real General\n2 2\n2\n-0.5\n-1\n2\n",
    "array-with-comments": f"{BANNER} array real general\n% Sch\u00e4fer\n%\n\n2 2\n2\n-0.5\n-1\n2\n",
    "array-with-blanks": f"{BANNER}  array\treal general\n 2\t2 \n\n  2\n-0.5 \n\n-1\n\t2\n\n",
    "array-crlf": f"{BANNER} array real general\r\n2 2\r\n2\r\n-0.5\r\n-1\r\n2\r\n",
    "array-without-newline-at-the-end": f"{BANNER} array real general\n2 2\n2\n-0.5\n-1\n2",
    "array-of-many-spellings": f"{BANNER} array real general\n2 2\n+2.\n-.5E0\n-10e-1\n+.2e+01\n",
    "coordinate": f"{BANNER} coordinate real general\n2 2 4\n1 1 2\n2 1 -0.5\n1 2 -1\n2 2 2\n",
    "coordinate-in-another-order": f"{BANNER} coordinate real general\n2 2 4\n2 2 2\n1 2 -1\n1 1 +2\n2 1 -5e-1\n",
}


@pytest.mark.parametrize("text", MATRICES.values(), ids=MATRICES)
def test_matrix_market_is_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "problem.mtx").write_bytes(text.encode("latin-1"))
    (tmp_path / "q.csv").write_bytes(b"-1,0.25")
    problem = read(str(tmp_path / "problem.mtx"), str(tmp_path / "q.csv"))
    assert numbers(problem) == (M, Q)
    assert is_sparse(problem.M) == ("coordinate" in text)
    assert problem.name == "problem"


@pytest.mark.parametrize(
    ("header", "entries", "expected"),
    [
        ("array integer general", "2 2|1|2|3|4", [[1, 3], [2, 4]]),
        ("array real symmetric", "2 2|1|2|4", [[1, 2], [2, 4]]),
        ("array real skew-symmetric", "2 2|5", [[0, -5], [5, 0]]),
        ("coordinate real general", "2 2 0", [[0, 0], [0, 0]]),
        ("coordinate integer symmetric", "2 2 2|1 1 2|2 1 -1", [[2, -1], [-1, 0]]),
        ("coordinate real skew-symmetric", "2 2 1|2 1 5", [[0, -5], [5, 0]]),
    ],
)
def test_every_kind_of_matrix_market_is_read(
    tmp_path: Path, header: str, entries: str, expected: list[list[float]]
) -> None:
    (tmp_path / "M.mtx").write_text("\n".join([f"{BANNER} {header}", *entries.split("|")]))
    (tmp_path / "q.csv").write_text("1,1")
    assert numbers(read(str(tmp_path / "M.mtx"), str(tmp_path / "q.csv")))[0] == expected


@pytest.mark.parametrize(
    "text",
    [
        "array real general\n2 1\n-1\n0.25\n",
        "array real general\n1 2\n-1\n0.25\n",
        "coordinate real general\n2 1 2\n2 1 0.25\n1 1 -1\n",
        "coordinate real general\n1 2 2\n1 2 0.25\n1 1 -1\n",
    ],
)
def test_q_is_read_from_matrix_market_beside_any_format(tmp_path: Path, text: str) -> None:
    (tmp_path / "M.csv").write_text("2,-1\n-0.5,2\n")
    (tmp_path / "M.mtx.gz").write_bytes(gzip.compress(MATRICES["coordinate"].encode()))
    np.savez(tmp_path / "M.npz", M=M)
    (tmp_path / "q.mtx").write_text(f"{BANNER} {text}")
    for first in ("M.csv", "M.mtx.gz", "M.npz"):
        problem = read(str(tmp_path / first), str(tmp_path / "q.mtx"))
        assert (numbers(problem), problem.name) == ((M, Q), "M")


SPARSE = sparse.csr_array(M)
ARCHIVES: dict[str, dict[str, object]] = {
    "dense": {"M": M, "q": Q},
    "column": {"M": M, "q": np.array(Q)[:, np.newaxis]},
    "row": {"M": M, "q": [Q]},
    "single-precision-of-the-other-end": {"M": np.array(M, dtype=">f4"), "q": np.array(Q, dtype=">f8")},
    "fortran-order": {"M": np.asfortranarray(M), "q": Q},
    "parts": {"data": SPARSE.data, "indices": SPARSE.indices, "indptr": SPARSE.indptr, "shape": (2, 2), "q": Q},
    "parts-by-columns": {
        "data": [2.0, -0.5, -1.0, 2.0],
        "indices": [0, 1, 0, 1],
        "indptr": [0, 2, 4],
        "shape": (2, 2),
        "format": "csc",
        "q": Q,
    },
}


@pytest.mark.parametrize("arrays", ARCHIVES.values(), ids=ARCHIVES)
def test_npz_is_read(tmp_path: Path, arrays: dict[str, object]) -> None:
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "problem.npz", **arrays)
        problem = read(tmp_path / "problem.npz")
        assert (numbers(problem), problem.name) == ((M, Q), "problem")
        assert is_sparse(problem.M) == ("data" in arrays)


@pytest.mark.parametrize("kind", [f"{form}_array" for form in ("csr", "csc", "bsr", "coo", "dia")] + ["csr_matrix"])
def test_what_scipy_saves_is_read_beside_q(tmp_path: Path, kind: str) -> None:
    sparse.save_npz(tmp_path / "M.npz", getattr(sparse, kind)(np.array(M)))
    np.savez(tmp_path / "q.npz", Q)
    problem = read(str(tmp_path / "M.npz"), str(tmp_path / "q.npz"))
    assert numbers(problem) == (M, Q)
    assert is_sparse(problem.M)


def test_all_that_a_problem_may_hold_is_read(tmp_path: Path) -> None:
    texts = {"name": "n\u00e4me", "source": "s", "note": "", "verdict": "ray"}
    held = {"M": M, "q": Q, "x0": [1, 2], "x1": [[3], [4]], **texts}
    solutions = [[0.5, 0.0], [0.25, 0.125]]
    np.savez(tmp_path / "p.npz", **{**held, "source": np.bytes_("s"), "solution": solutions})  # type: ignore[arg-type]
    in_columns = {**held, "solution": np.transpose(solutions)}
    savemat(tmp_path / "p.mat", in_columns)
    (tmp_path / "p.json").write_text(json.dumps({**held, "x1": [3, 4.0], "solution": solutions}))
    for suffix in ("npz", "mat", "json"):
        problem = read(tmp_path / f"p.{suffix}")
        assert [x is not None and x.tolist() for x in (problem.x0, problem.x1)] == [[1, 2], [3, 4]]
        assert [z.tolist() for z in problem.solutions] == solutions
        assert {key: getattr(problem, key) for key in texts} == texts


def test_a_vector_is_read_from_npz_by_its_name_or_as_the_only_one(tmp_path: Path) -> None:
    for arrays in ({"x0": Q, "q": [1, 1]}, {"anything": [Q]}):
        np.savez(tmp_path / "vectors.npz", **arrays)
        assert read_start("--x0", str(tmp_path / "vectors.npz"), 2).tolist() == Q


def test_scipy_is_loaded_for_a_sparse_or_matrix_market_file_alone(tmp_path: Path) -> None:
    np.savez(tmp_path / "p.npz", M=M, q=Q)
    code = f"import sys, lcpcli; lcpcli.read({str(tmp_path / 'p.npz')!r}); print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_text_of_characters_that_do_not_exist_is_refused(tmp_path: Path) -> None:
    name = np.frombuffer(np.array([2**30], dtype="<u4").tobytes(), dtype="<U1").reshape(())
    np.savez(tmp_path / "p.npz", M=np.eye(2), q=-np.ones(2), name=name)
    with pytest.raises(ProblemError, match="characters that do not exist"):
        read(tmp_path / "p.npz")


MATRIX, VECTOR = np.array(M), np.array(Q)
NAMES = np.array(["first", "é"], dtype=object)


def mat(**options: Any) -> bytes:
    file = io.BytesIO()
    is_coordinate = options.pop("sparse", False)
    held = {"M": sparse.csc_array(MATRIX) if is_coordinate else MATRIX, "q": VECTOR, "name": "small"}
    if options.get("format") != "4":
        held |= {"names": NAMES, "other": {"a": 1.0}, "cell": np.array([[MATRIX, "t"]], object)}
    savemat(file, held, **options)
    return file.getvalue()


KINDS = [{}, {"sparse": True}, {"do_compression": True}, {"format": "4"}, {"format": "4", "sparse": True}]


def outcome(content: bytes) -> str:
    try:
        mat_format.fields(content)
    except ProblemError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("options", KINDS)
def test_whole_files_are_read(options: dict[str, Any]) -> None:
    fields = mat_format.fields(mat(**options))
    assert np.array_equal(fields["M"].toarray() if options.get("sparse") else fields["M"], MATRIX)
    assert np.array_equal(fields["q"], VECTOR)
    if "format" not in options:
        assert list(fields["names"]) == ["first", "é"]


@pytest.mark.parametrize("most", [2, pytest.param(3, marks=pytest.mark.slow("changes each byte three times"))])
@pytest.mark.parametrize("options", KINDS)
def test_any_changed_byte_leaves_a_file_that_is_read_or_refused(options: dict[str, Any], most: int) -> None:
    content, source = mat(**options), random.Random(5)
    refused = 0
    for at in range(len(content)):
        for value in source.sample((0, 255, source.randrange(256)), most):
            refused += bool(outcome(content[:at] + bytes([value]) + content[at + 1 :]))
    assert refused > len(content) * most / 12


@pytest.mark.parametrize("size", [2**31 - 1, 2**32 - 1, 2**30])
def test_dimensions_that_are_not_those_of_the_values_are_refused(size: int) -> None:
    content = mat()
    at = content.index(struct.pack("<II", 5, 8)) + 8  # the dimensions of the first array
    for place in (at, at + 4):
        damaged = content[:place] + struct.pack("<I", size) + content[place + 4 :]
        assert "other values than it declares" in outcome(damaged) or "dimensions" in outcome(damaged)


def test_what_cannot_be_read_is_left_out() -> None:
    assert {name for name in loadmat(io.BytesIO(checked(mat()))) if name[0] != "_"} == {
        "M", "q", "name", "names", "cell",
    }  # fmt: skip


def test_parts_of_a_sparse_matrix_may_have_its_name_in_front(tmp_path: Path) -> None:
    M = sparse.csr_array([[2.0, 1.0], [1.0, 2.0]])
    parts = {part: getattr(M, part) for part in ("data", "indices", "indptr", "shape")}
    np.savez(tmp_path / "p.npz", q=[-5, -6], **{f"M.{part}": array for part, array in parts.items()})
    assert np.array_equal(dense(read(tmp_path / "p.npz").M), M.toarray())
    np.savez(tmp_path / "program.npz", c=[-5, -6], row_upper=[1, 1], **parts)
    with pytest.raises(ProblemError, match="data: is part of a sparse matrix that has no name"):
        read(tmp_path / "program.npz")


def test_bounds_called_a_and_b_in_a_mat_file_are_not_ignored(tmp_path: Path) -> None:
    own = {"M": np.eye(2), "q": [1.0, 2.0], "a": [0.0, 0.0], "b": [1.0, 1.0]}
    savemat(tmp_path / "p.mat", own)
    with pytest.raises(ProblemError, match="a: may hold bounds of z, which are called lower and upper"):
        read(tmp_path / "p.mat")
