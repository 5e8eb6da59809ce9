"""What can be wrong with a matrix in Matrix Market or NPZ."""

from __future__ import annotations

import io
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
    of_mtx("table", f"{MTX} table real general\n2 2\n", "line 1:", "'table'", "array or coordinate"),
    of_mtx("pattern", f"{MTX} coordinate pattern general\n2 2 1\n1 1\n", "line 1:", "'pattern'", "real"),
    of_mtx("complex", f"{MTX} array complex general\n1 1\n1 0\n", "line 1:", "complex matrix", "real problems"),
    of_mtx("hermitian", f"{MTX} array real hermitian\n1 1\n1\n", "line 1:", "'hermitian'", "general"),
    of_mtx("no-size", f"{MTX} array real general\n% comment\n", "ends before its size", "rows and columns"),
    of_mtx("one-size", f"{MTX} array real general\n2\n1\n", "line 2:", "'2'", "rows, columns"),
    of_mtx("negative-size", f"{MTX} coordinate real general\n% c\n-2 2 1\n", "line 3:", "'-2 2 1'", "entries"),
    of_mtx("no-rows", f"{MTX} array real general\n0 0\n", "M:", "0 x 0", "2 entries", "agree"),
    of_mtx("cut-off-by-one", f"{MTX} array real general\n2 2\n10\n20\n30\n", "M:", "4 entries but has 3", "agree"),
    of_mtx("decimal-comma", f"{MTX} array real general\n1 1\n1,5\n", "line 3:", "'1,5'", "one number"),
    of_mtx("nan", f"{MTX} array real general\n1 1\nnan\n", "line 3:", "'nan'", "one number"),
    of_mtx("fraction", f"{MTX} array integer general\n1 1\n1.5\n", "line 3:", "'1.5'", "whole number"),
    of_mtx("long-integer", f"{MTX} array integer general\n2 2\n1\n1\n{'9' * 999}\n1\n", "M[0][1]:", "finite"),
    of_mtx("no-value", f"{MTX} coordinate real general\n2 2 1\n1 1   \n", "line 3:", "'1 1'", "a row, a column"),
    of_mtx("out-of-range", f"{MTX} coordinate real general\n2 2 1\n3 1 1\n", "M:", "(3, 1)", "2 x 2", "from 1"),
    of_mtx("twice", f"{MTX} coordinate real general\n2 2 2\n1 2 1\n1 2 3\n", "M:", "(1, 2) twice", "once"),
    of_mtx("mirrored", f"{MTX} coordinate real symmetric\n2 2 2\n1 2 1\n2 1 3\n", "M:", "twice", "once"),
    of_mtx("skew-diagonal", f"{MTX} coordinate real skew-symmetric\n2 2 1\n1 1 1\n", "M:", "diagonal", "leave"),
    of_mtx("symmetric-oblong", f"{MTX} array real symmetric\n2 1\n1\n2\n", "M:", "symmetric but 2 x 1", "square"),
    of_mtx("oblong", f"{MTX} array real general\n2 3\n" + "1\n" * 6, "M:", "2 x 3", "square"),
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
    of_npz("texts", archive(M=EYE, q=["a", "b"]), " q:", "str", "real numbers"),
    of_npz("nan", archive(M=EYE, q=[1, np.nan]), " q[1]:", "finite"),
    of_npz("one-dimension", archive(M=ONES, q=ONES), " M:", "1 dimension", "rows"),
    of_npz("name-number", archive(M=EYE, q=ONES, name=3), " name:", "int64", "text"),
    of_npz("huge", zip_of({"M.npy": npy(EYE, (10**9, 10**9))}), " M:", "1000000000 x 1000000000", "32 bytes", "again"),
    of_npz("negative", zip_of({"M.npy": npy(EYE, (-2, -2))}), " M:", "damaged"),
    of_csr("no-data", {"data": None}, " M:", "inconsistent parts", "data"),
    of_csr("beside-M", {"M": EYE}, " data:", "next to a dense M", "keep one"),
    of_csr("index-too-large", {"indices": [0, 7]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("index-negative", {"indices": [0, -1]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("index-a-fraction", {"indices": [0.0, 1.0]}, " M:", "inconsistent parts", "whole numbers"),
    of_csr("pointers-falling", {"indptr": [0, 5, 2]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("pointers-too-few", {"indptr": [0, 2]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("one-side", {"shape": [2]}, " M:", "inconsistent parts", "two numbers"),
    of_csr("huge", {"shape": [10**12, 10**12]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("negative", {"shape": [-2, -2]}, " M:", "inconsistent parts", "save_npz"),
    of_csr("unknown-format", {"format": "lil"}, " format:", "'lil'", "csr, csc"),
    of_csr("complex", {"data": [1j, 1]}, " M:", "complex128", "real problems"),
    of_csr("nan", {"data": [1, np.nan]}, " M[1][1]:", "finite"),
    of_file("q.npz", archive(a=ONES, b=ONES), "solve M.csv q.npz", "q.npz: q:", "missing", "add the key q"),
    of_file("q.npz", archive(q=np.ones((2, 2, 2))), "solve M.csv q.npz", "q.npz: q:", "3 dimensions", "flat"),
    of_file("p.npz", archive(M=EYE, q=ONES), "solve p.npz q.csv", "q.csv:", "not needed", "p.npz contains", "leave"),
]
