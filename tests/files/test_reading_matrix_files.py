"""Matrix Market, NPZ and MAT are read in every kind that they come in; MAT files with
any byte changed, or refused."""

import gzip
import io
import random
import struct
import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.io import savemat

from lcpcli import read
from lcpcli.errors import ProblemError
from lcpcli.files import mat_format
from lcpcli.files.beside import read_start
from lcpcli.linalg.matrices import is_sparse

from ..conftest import M, Q, numbers, read_exact
from .binary import mat

BANNER = "%%MatrixMarket matrix"
MATRICES = {
    "array-of-doubles": f"{BANNER} array double general\n2 2\n2\n-0.5\n-1\n2\n",
    "array-in-capitals-with-comments": (
        "%%MATRIXMARKET Matrix ARRAY Real General\n% Sch\u00e4fer\n%\n\n"
        "2 2\n2\n-0.5\n-1\n2\n"
    ),
    "array-with-blanks": (
        f"{BANNER}  array\treal general\n 2\t2 \n\n  2\n-0.5 \n\n-1\n\t2\n\n"
    ),
    "array-crlf-without-newline-at-the-end": (
        f"{BANNER} array real general\r\n2 2\r\n2\r\n-0.5\r\n-1\r\n2"
    ),
    "array-of-many-spellings": (
        f"{BANNER} array real general\n2 2\n+2.\n-.5E0\n-10e-1\n+.2e+01\n"
    ),
    "coordinate": (
        f"{BANNER} coordinate real general\n2 2 4\n2 2 2\n1 2 -1\n1 1 +2\n2 1 -5e-1\n"
    ),
}


@pytest.mark.parametrize("text", MATRICES.values(), ids=MATRICES)
def test_matrix_market_is_read(tmp_path, text):
    (tmp_path / "problem.mtx").write_bytes(text.encode("latin-1"))
    (tmp_path / "q.csv").write_bytes(b"-1,0.25")
    problem = read(tmp_path / "problem.mtx", tmp_path / "q.csv")
    assert numbers(problem) == (M, Q)
    assert is_sparse(problem.M) == ("coordinate" in text)
    assert problem.name == "problem"


@pytest.mark.parametrize(
    ("header", "entries", "expected"),
    [
        ("array real symmetric", "2 2|1|0.1|4", [[1, 0.1], [0.1, 4]]),
        ("array real skew-symmetric", "2 2|5", [[0, -5], [5, 0]]),
        ("coordinate integer symmetric", "2 2 2|1 1 2|2 1 -1", [[2, -1], [-1, 0]]),
        ("coordinate real skew-symmetric", "2 2 1|2 1 0.1", [[0, -0.1], [0.1, 0]]),
    ],
)
def test_kinds_of_matrix_market_are_read(tmp_path, header, entries, expected):
    (tmp_path / "M.mtx").write_text(
        "\n".join([f"{BANNER} {header}", *entries.split("|")])
    )
    (tmp_path / "q.csv").write_text("1,1")
    files = [str(tmp_path / name) for name in ("M.mtx", "q.csv")]
    assert numbers(read(*files))[0] == expected
    rows, scales = read_exact(*files).rows, read_exact(*files).scales
    assert [
        [row.get(j, 0) / scale for j in (0, 1)]
        for row, scale in zip(rows, scales, strict=True)
    ] == expected


@pytest.mark.parametrize(
    "text",
    [
        "array real general\n1 2\n-1\n0.25\n",
        "coordinate real general\n2 1 2\n2 1 0.25\n1 1 -1\n",
        "coordinate real general\n1 2 2\n1 2 0.25\n1 1 -1\n",
    ],
)
def test_q_is_read_from_matrix_market_beside_any_format(tmp_path, text):
    (tmp_path / "M.csv").write_text("2,-1\n-0.5,2\n")
    (tmp_path / "M.mtx.gz").write_bytes(gzip.compress(MATRICES["coordinate"].encode()))
    np.savez(tmp_path / "M.npz", M=M)
    (tmp_path / "q.mtx").write_text(f"{BANNER} {text}")
    for first in ("M.csv", "M.mtx.gz", "M.npz"):
        problem = read(tmp_path / first, tmp_path / "q.mtx")
        assert numbers(problem) == (M, Q)
        assert problem.name == "M"


MATRIX, VECTOR = np.array(M), np.array(Q)
NAMES = np.array(["first", "é"], dtype=object)
SPARSE = sparse.csr_array(M)
COLUMNS = sparse.csc_array(M)


def parts_of(matrix):
    return {
        part: getattr(matrix, part) for part in ("data", "indices", "indptr", "shape")
    }


def saved(save, *array, **arrays):
    file = io.BytesIO()
    save(file, *array, **arrays)
    return file.getvalue()


def small(**options):
    """A MAT file with all kinds of variables."""
    held = {
        "M": COLUMNS if options.pop("sparse", False) else MATRIX,
        "q": VECTOR,
        "name": "small",
        "names": NAMES,
        "other": {"a": 1.0},
        "cell": np.array([[MATRIX, "t"]], object),
    }
    return saved(savemat, held, **options)


KINDS = [
    {},
    {"sparse": True},
    {"do_compression": True},
]
BESIDE = np.column_stack((MATRIX, VECTOR))
BINARY = {
    "compressed.npz": saved(np.savez_compressed, M=M, q=Q),
    "row.npz": saved(np.savez, M=M, q=[Q]),
    "of-the-other-end.npz": saved(
        np.savez, M=np.array(M, dtype=">f4"), q=np.array(Q, dtype=">f8")
    ),
    "fortran-order.npz": saved(np.savez, M=np.asfortranarray(M), q=Q),
    "sparse.npz": saved(np.savez, **parts_of(SPARSE), q=Q),
    "sparse-with-its-name.npz": saved(
        np.savez, **{f"M.{part}": own for part, own in parts_of(SPARSE).items()}, q=Q
    ),
    "sparse-by-columns.npz": saved(np.savez, **parts_of(COLUMNS), format="csc", q=Q),
    "sparse.mat": mat(M=COLUMNS, q=sparse.csc_array(VECTOR[:, np.newaxis])),
    "workspace.mat": mat(
        M=M, q=Q, ans=3.0, options={"tol": 1.0}, cells=np.array([1, "a"], dtype=object)
    ),
    "by-columns.npy": saved(np.save, np.asfortranarray(BESIDE)),
    **{
        f"{'sparse-' * ('sparse' in own)}{i}.mat": small(**own)
        for i, own in enumerate(KINDS)
    },
}


@pytest.mark.parametrize("name", BINARY)
def test_arrays_are_read_to_the_right_numbers_from_a_file_and_from_standard_input(
    name, tmp_path, monkeypatch
):
    (tmp_path / name).write_bytes(BINARY[name])
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(BINARY[name])))
    for problem in map(read, (tmp_path / name, "-")):
        assert numbers(problem) == (M, Q)
        assert is_sparse(problem.M) == ("sparse" in name)
    assert list(problem.names) == (
        ["first", "é"] if name in ("0.mat", "sparse-1.mat", "2.mat") else ["", ""]
    )


@pytest.mark.parametrize(
    "kind",
    [f"{form}_array" for form in ("csr", "csc", "bsr", "coo", "dia")] + ["csr_matrix"],
)
def test_what_scipy_saves_is_read_beside_q(tmp_path, kind):
    sparse.save_npz(tmp_path / "M.npz", getattr(sparse, kind)(np.array(M)))
    np.savez(tmp_path / "q.npz", Q)
    problem = read(tmp_path / "M.npz", tmp_path / "q.npz")
    assert numbers(problem) == (M, Q)
    assert is_sparse(problem.M)


def test_all_that_a_problem_may_hold_is_read(tmp_path):
    """By other programs than this one, which gives solutions as columns of a MAT
    file."""
    texts = {"name": "n\u00e4me", "source": "s", "note": "", "verdict": "ray"}
    held = {"M": M, "q": Q, "x0": [1, 2], "x1": [[3], [4]], **texts}
    solutions = [[0.5, 0.0], [0.25, 0.125]]
    in_rows = held | {"source": np.bytes_("s"), "solution": solutions}
    np.savez(tmp_path / "p.npz", **in_rows)
    savemat(tmp_path / "p.mat", held | {"solution": np.transpose(solutions)})
    for suffix in ("npz", "mat"):
        problem = read(tmp_path / f"p.{suffix}")
        assert [x is not None and x.tolist() for x in (problem.x0, problem.x1)] == [
            [1, 2],
            [3, 4],
        ]
        assert [z.tolist() for z in problem.solutions] == solutions
        assert {key: getattr(problem, key) for key in texts} == texts


def test_a_vector_is_read_from_npz_by_its_name_or_as_the_only_one(tmp_path):
    for arrays in ({"x0": Q, "q": [1, 1]}, {"anything": [Q]}):
        np.savez(tmp_path / "vectors.npz", **arrays)
        assert read_start("--x0", str(tmp_path / "vectors.npz"), 2).tolist() == Q


def outcome(content):
    try:
        mat_format.fields(mat_format.parse(content))
    except ProblemError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "most",
    [1, pytest.param(3, marks=pytest.mark.slow("changes each byte three times"))],
)
@pytest.mark.parametrize("options", KINDS)
def test_any_changed_byte_leaves_a_file_that_is_read_or_refused(options, most):
    content, source = small(**options), random.Random(5)
    refused = 0
    for at in range(len(content)):
        for value in source.sample((0, 255, source.randrange(256)), most):
            refused += bool(outcome(content[:at] + bytes([value]) + content[at + 1 :]))
    assert refused > len(content) * most / 12


def test_a_file_of_version_4_is_refused_with_what_to_do():
    content = saved(savemat, {"M": MATRIX, "q": VECTOR}, format="4")
    assert "is a MAT file of version 4" in outcome(content)
    assert "-v7" in outcome(content)


@pytest.mark.parametrize("size", [2**31 - 1, 2**32 - 1, 2**30])
def test_dimensions_that_are_not_those_of_the_values_are_refused(size):
    content = small()
    # The dimensions of the first array.
    at = content.index(struct.pack("<II", 5, 8)) + 8
    for place in (at, at + 4):
        damaged = content[:place] + struct.pack("<I", size) + content[place + 4 :]
        assert "is not a MAT file, or is damaged" in outcome(damaged)


@pytest.mark.parametrize(
    ("place", "byte"),
    [(136, 118), (145, 75)],
    ids=["element-of-unknown-type", "complex-flag"],
)
def test_a_damaged_mat_file_on_which_scipy_crashes_is_refused(place, byte):
    content = bytearray(mat(M=np.eye(3), q=-np.ones(3)))
    content[place] = byte
    assert "is not a MAT file, or is damaged" in outcome(bytes(content))
