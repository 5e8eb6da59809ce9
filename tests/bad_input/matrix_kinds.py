"""What can be wrong with a matrix in Matrix Market or NPZ, and malformed files on which the libraries that read them
have words of their own, which users do not see."""

from __future__ import annotations

import gzip
import io
import pickle
import zipfile
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from .kinds import GOOD, Kind, of_file

EYE, ONES = np.eye(2), np.ones(2)
HUGE = "1000000000000"
MTX = "%%MatrixMarket matrix"
ARRAY = f"{MTX} array real general\n2 2\n2\n0\n0\n2\n"


def of_mtx(name: str, content: str, *words: str) -> Any:
    """A matrix in a Matrix Market file beside q.csv."""
    kind = Kind(("solve", "bad.mtx", "q.csv"), ("bad.mtx: ", *words), {"bad.mtx": content})
    return pytest.param(kind, id=f"mtx-{name}")


def of_npz(name: str, content: bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.npz"), ("bad.npz:", *words), {"bad.npz": content}), id=f"npz-{name}")


def of_csr(name: str, parts: dict[str, Any], *words: str) -> Any:
    """A sparse matrix in an NPZ file with parts replaced, or left out where they are None."""
    whole = {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2], "shape": [2, 2], "q": ONES} | parts
    return of_npz(f"csr-{name}", archive(**{key: part for key, part in whole.items() if part is not None}), *words)


def of_sparse(form: str, **parts: Any) -> Any:
    """A sparse matrix in another format, with index arrays that do not fit, which scipy must not get."""
    of_form = {"coo": {"row": [0, 1], "col": [0, 1]}, "dia": {}}
    bounds = of_form.get(form, {"indices": [0, 1], "indptr": [0, 1, 2]})
    data = {"bsr": [[[1.0]], [[1.0]]], "dia": [[1.0, 1.0]]}.get(form, [1.0, 1.0])
    whole = {"shape": [2, 2], "q": ONES, "format": form.encode(), "data": data, **bounds, **parts}
    return of_npz(f"{form}-{'-'.join(parts)}", archive(**whole), "inconsistent parts")


def archive(*unnamed: Any, **named: Any) -> bytes:
    file = io.BytesIO()
    np.savez(file, *unnamed, **named)
    return file.getvalue()


def mat(**variables: Any) -> bytes:
    file = io.BytesIO()
    savemat(file, variables)
    return file.getvalue()


def npy(array: Any, shape: tuple[int, ...] | None = None) -> bytes:
    """An array as numpy.save writes it, but with that shape in its header."""
    file = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": array.shape if shape is None else shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + array.tobytes()


def zip_of(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as writing:
        for name, content in files.items():
            writing.writestr(name, content)
    return file.getvalue()


MATRIX_MARKET = [
    of_mtx("json", GOOD, "line 1:", "not a Matrix Market header", "begin with %%MatrixMarket"),
    of_mtx("pattern", f"{MTX} coordinate pattern general\n2 2 1\n1 1\n", "line 1:", "'pattern'", "real"),
    of_mtx("complex", f"{MTX} array complex general\n1 1\n1 0\n", "line 1:", "complex matrix", "real problems"),
    of_mtx("no-size", f"{MTX} array real general\n% comment\n", "ends before its size", "rows and columns"),
    of_mtx("negative-size", f"{MTX} coordinate real general\n% c\n-2 2 1\n", "line 3:", "'-2 2 1'", "entries"),
    of_mtx("cut-off-by-one", f"{MTX} array real general\n2 2\n10\n20\n30\n", "M:", "4 entries but has 3", "agree"),
    of_mtx("decimal-comma", f"{MTX} array real general\n1 1\n1,5\n", "line 3:", "'1,5'", "one number"),
    of_mtx("fraction", f"{MTX} array integer general\n1 1\n1.5\n", "line 3:", "'1.5'", "whole number"),
    of_mtx("long-integer", f"{MTX} array integer general\n2 2\n1\n1\n{'9' * 999}\n1\n", "M[0][1]:", "finite"),
    of_mtx("out-of-range", f"{MTX} coordinate real general\n2 2 1\n3 1 1\n", "M:", "(3, 1)", "2 x 2", "from 1"),
    of_mtx("twice", f"{MTX} coordinate real general\n2 2 2\n1 2 1\n1 2 3\n", "M:", "(1, 2) again", "once"),
    of_mtx("mirrored", f"{MTX} coordinate real symmetric\n2 2 2\n1 2 1\n2 1 3\n", "M:", "again", "once"),
    of_mtx("skew-diagonal", f"{MTX} coordinate real skew-symmetric\n2 2 1\n1 1 1\n", "M:", "diagonal", "leave"),
    of_mtx("symmetric-oblong", f"{MTX} array real symmetric\n2 1\n1\n2\n", "M:", "symmetric but 2 x 1", "square"),
    of_mtx("huge", f"{MTX} coordinate real general\n{HUGE} {HUGE} 1\n1 1 1\n", HUGE, "q has 2 entries", "agree"),
    of_mtx("huge-array", f"{MTX} array real general\n{HUGE} {HUGE}\n1\n", "M:", "memory", "sparse"),
    of_mtx("many-entries", f"{MTX} coordinate real general\n2 2 {HUGE}\n1 1 1\n", "M:", HUGE, "cut off?"),
    of_file("alone.mtx", ARRAY, "solve alone.mtx", "alone.mtx:", "M, 2 x 2", "no q", "name the file of q after it"),
    of_file(
        "q.mtx", f"{MTX} coordinate real general\n5{'0' * 8} 1 1\n1 1 1\n", "solve M.csv q.mtx", "q.mtx: q:", "1000"
    ),
    of_file("q.mtx", ARRAY, "solve M.csv q.mtx", "q.mtx: q:", "2 rows and 2 columns", "one row or one column"),
    of_file("q.mtx", f"{MTX} coordinate real general\n{HUGE} 1 0\n", "solve M.csv q.mtx", "q.mtx: q:", "memory"),
    of_file("x.mtx", f"{MTX} array real general\n1 1\n1\n", "solve good.json --x0 x.mtx", "x.mtx: --x0:", "1 entry"),
]
NPZ = [
    of_npz("text", b"hello", "not NPZ", "cut off?", "numpy.savez"),
    of_npz("damaged", archive(M=EYE, q=ONES).replace(EYE.tobytes(), b"x" * 32), " M:", "damaged", "again"),
    of_npz("single-array", npy(EYE), "M, 2 x 2", "no q", "name the file of q after it"),
    of_npz("other-files", zip_of({"readme.txt": b"hello"}), "readme.txt:", "is not an array"),
    of_npz("twice", zip_of({"M.npy": npy(EYE), "M": npy(EYE)}), " M:", "twice", "keep one"),
    of_npz("no-M", archive(q=ONES), " M:", "missing", "add"),
    of_npz("unnamed", archive(EYE, ONES), " arr_0:", "not a key", "the keys are"),
    of_npz("complex", archive(M=EYE * 1j, q=ONES), " M:", "complex128", "real problems"),
    of_npz("bool", archive(M=EYE > 0, q=ONES), " M:", "bool", "real numbers"),
    of_npz("nan", archive(M=EYE, q=[1, np.nan]), " q[1]:", "finite"),
    of_npz("one-dimension", archive(M=ONES, q=ONES), " M:", "1 dimension", "rows"),
    of_npz("name-number", archive(M=EYE, q=ONES, name=3), " name:", "int64", "text"),
    of_npz("huge", zip_of({"M.npy": npy(EYE, (10**9, 10**9))}), " M:", "1000000000 x 1000000000", "32 bytes", "again"),
    of_csr("no-data", {"data": None}, " M:", "inconsistent parts", "data"),
    of_csr("beside-M", {"M": EYE}, " data:", "next to a dense M", "keep one"),
    of_csr("index-negative", {"indices": [0, -1]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("index-a-fraction", {"indices": [0.0, 1.0]}, " M:", "inconsistent parts", "whole numbers"),
    of_csr("pointers-falling", {"indptr": [0, 5, 2]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("one-side", {"shape": [2]}, " M:", "inconsistent parts", "two numbers"),
    of_csr("huge", {"shape": [10**12, 10**12]}, " M:", "1000000000000 x 1000000000000", "2 entries"),
    of_csr("shape-infinite", {"shape": [np.inf, 2.0]}, " M:", "inconsistent parts"),
    of_csr("pointers-from-1", {"indptr": [1, 1, 2]}, " M:", "inconsistent parts"),
    of_sparse("csc", indptr=[0, 1, -1]),
    of_sparse("bsr", indptr=[0, 1, 2**40]),
    of_sparse("coo", row=[0, 2**33]),
    of_sparse("coo", col=[0]),
    of_sparse("dia", offsets=[-5]),
    of_csr("unknown-format", {"format": "lil"}, " format:", "'lil'", "csr, csc"),
    of_csr("complex", {"data": [1j, 1]}, " M:", "complex128", "real problems"),
    of_csr("nan", {"data": [1, np.nan]}, " M[1][1]:", "finite"),
    of_file("q.npz", archive(a=ONES, b=ONES), "solve M.csv q.npz", "q.npz: q:", "missing", "add the key q"),
    of_file("q.npz", archive(q=np.ones((2, 2, 2))), "solve M.csv q.npz", "q.npz: q:", "3 dimensions", "flat"),
    of_file("p.npz", archive(M=EYE, q=ONES), "solve p.npz q.csv", "q.csv:", "not needed", "p.npz contains", "leave"),
]
FOREIGN_WORDS = [
    "numpy",
    "scipy",
    "Traceback",
    "dtype",
    "ufunc",
    "broadcast",
    "Expecting",
    "invalid literal",
    "could not convert",
]
OURS = ("numpy.savez", "numpy.save", "scipy.sparse.save_npz")  # functions that a hint may name
TWICE, MINUS = 2 * np.eye(2), -np.ones(2)


def pickled_array() -> bytes:
    file = io.BytesIO()
    np.save(file, np.array([{"a": 1}, None], dtype=object), allow_pickle=True)
    return file.getvalue()


WHOLE_NPZ, WHOLE_MAT, WHOLE_NPY = archive(M=TWICE, q=MINUS), mat(M=TWICE, q=MINUS[:, None]), npy(TWICE)
ZIPPED = gzip.compress(ARRAY.encode())
CONTENTS: dict[str, list[bytes]] = {
    "p.npz": [
        zip_of({"M.npy": pickled_array(), "q.npy": npy(MINUS)}),
        zip_of({"M.npy": pickle.dumps(TWICE), "q.npy": npy(MINUS)}),
        *(WHOLE_NPZ[:size] for size in (1, 40, 200, -1)),
        *(WHOLE_NPZ.replace(b"'descr': '<f8'", b"'descr': '<z8'"), WHOLE_NPZ.replace(b"(2, 2)", b"(2, x)")),
        archive(M=TWICE, q=np.array(["2021-01-01", "2021-01-02"], dtype="datetime64[D]")),
        archive(data=MINUS, indices=np.array([0, 5]), indptr=np.array([0, 1, 2]), shape=np.array([2, 2]), q=MINUS),
        archive(M=np.ones((2, 2, 2)), q=MINUS),
        archive(M=TWICE, q=np.float64(1)),
    ],
    "p.npy": [
        pickled_array(),
        *(WHOLE_NPY[:size] for size in (6, 9, 40, -1)),
        *(WHOLE_NPY + b"more", WHOLE_NPY.replace(b"False", b"Felse"), WHOLE_NPY.replace(b"<f8", b"<q9")),
        *(npy(np.array(["a", "b"])), npy(np.array([[1j, 2]])), npy(np.zeros((0, 0))), npy(np.array(1.0))),
        npy(np.zeros(2, dtype=[("M", float), ("q", float)])),
    ],
    "p.mat": [
        *(WHOLE_MAT[:size] for size in (1, 100, 128, 140, 200, -1)),
        WHOLE_MAT[:128] + b"\0" * 64,
        *(b"\0" * 200, b"random bytes of no format at all"),
        *(
            mat(M=TWICE, q="text"),
            mat(M=TWICE * 1j, q=MINUS),
            mat(M={"a": 1}, q=MINUS),
            mat(M=TWICE, q=np.ones((2, 2))),
        ),
        *(mat(M=np.array(["a", 1.0], dtype=object), q=MINUS), mat(M=np.zeros((0, 0)), q=MINUS)),
    ],
    "M.mtx.gz": [
        b"\x1f\x8b",
        b"\x1f\x8bnonsense",
        *(ZIPPED[:size] for size in (5, 10, 20, -8, -1)),
        *(ZIPPED[:-8] + b"\0" * 8, ZIPPED.replace(b"\x08", b"\x07", 1)),
        *(gzip.compress(b"hello"), gzip.compress(b""), gzip.compress(ARRAY.encode()[:-3])),
    ],
    "p.csv": [
        f"2,0,-1\n0,{last}".encode("latin-1") for last in ("2,-1,7\n", "1e,-1\n", '"2"3,-1\n', "\xbd,-1\n", "True,-1\n")
    ],
    "p.json": [
        *(GOOD.replace("-1]", last).encode() for last in ("nan]", "-1,]", '"1+2j"]', "{}]", "0x2]", "-1 -1]")),
        *(GOOD.replace('"q"', key).encode() for key in ("q", '"q', '"\\q"', '"q\t"')),
        GOOD.replace('"q":', '"q"').encode(),
        b"'M'",
    ],
}
FOREIGN_FILES = [
    of_file(name, content, f"solve {name}" + " q.csv" * name.startswith("M"), name)
    for name, contents in CONTENTS.items()
    for content in contents
]
