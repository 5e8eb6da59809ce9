"""Kinds of bad input that no text shows: files of numbers that are not as they should
be, malformed ones on which the libraries that read them have words of their own, which
users do not see, and texts of any length."""

from __future__ import annotations

import gzip
import io
import pickle
import zipfile
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

GOOD = '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}'
EYE, ONES = np.eye(2), np.ones(2)
ARRAY = "%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n"


@dataclass(frozen=True)
class Kind:
    """A bad command line, the files and the standard input that it meets, and what the
    line about it must contain."""

    arguments: tuple[str, ...]
    words: tuple[str, ...]
    files: dict[str, str | bytes] = field(default_factory=dict)
    stdin: bytes = b""


def of_file(name: str, content: str | bytes, line: str, *words: str) -> Any:
    """A command line in a folder that holds one more file."""
    return pytest.param(
        Kind(tuple(line.split(" ")), words, {name: content}),
        id=f"{line}-{'-'.join(words)}"[:60],
    )


def of_npz(name: str, content: bytes, *words: str) -> Any:
    return pytest.param(
        Kind(("solve", "bad.npz"), ("bad.npz:", *words), {"bad.npz": content}),
        id=f"npz-{name}",
    )


def of_csr(name: str, parts: dict[str, Any], *words: str) -> Any:
    """A sparse matrix in an NPZ file with parts replaced, or left out where they are
    None."""
    whole = {
        "data": [1.0, 1.0],
        "indices": [0, 1],
        "indptr": [0, 1, 2],
        "shape": [2, 2],
        "q": ONES,
    } | parts
    return of_npz(
        f"csr-{name}",
        archive(**{key: part for key, part in whole.items() if part is not None}),
        *words,
    )


def of_sparse(form: str, **parts: Any) -> Any:
    """A sparse matrix in another format, with index arrays that do not fit, which scipy
    must not get."""
    of_form = {"coo": {"row": [0, 1], "col": [0, 1]}, "dia": {}}
    bounds = of_form.get(form, {"indices": [0, 1], "indptr": [0, 1, 2]})
    data = {"bsr": [[[1.0]], [[1.0]]], "dia": [[1.0, 1.0]]}.get(form, [1.0, 1.0])
    whole = {
        "shape": [2, 2],
        "q": ONES,
        "format": form.encode(),
        "data": data,
        **bounds,
        **parts,
    }
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
    header = {
        "descr": "<f8",
        "fortran_order": False,
        "shape": array.shape if shape is None else shape,
    }
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + array.tobytes()


def zip_of(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as writing:
        for name, content in files.items():
            writing.writestr(name, content)
    return file.getvalue()


LONG = [
    of_file("a\nb.csv", "", "solve a\nb.json", "a\\nb.json", "no such file"),
    of_file("", "", "solve \udcff.json", "\\udcff.json", "no such file"),
    of_file(
        "b.json",
        f'{{"M": {"[" * 10**5}{"]" * 10**5}, "q": [1]}}',
        "solve b.json",
        "nested",
        "two levels",
    ),
    of_file(
        "b.json",
        f'{GOOD[:-1]}, "{"a" * 10**5}": 1}}',
        "solve b.json",
        "aaa",
        "not a key",
    ),
    of_file(
        "",
        "",
        f"solve good.json --every {'9' * 400}",
        "--every: is too large; it must be: whole number >= 1\n",
    ),
]
NPZ = [
    of_npz("text", b"hello", "not NPZ", "cut off?", "numpy.savez"),
    of_npz(
        "damaged",
        archive(M=EYE, q=ONES).replace(EYE.tobytes(), b"x" * 32),
        " M:",
        "damaged",
        "again",
    ),
    of_npz("single-array", npy(EYE), "M, 2 x 2", "no q", "name the file of q after it"),
    of_npz(
        "other-files",
        zip_of({"readme.txt": b"hello"}),
        "readme.txt:",
        "is not an array",
    ),
    of_npz(
        "twice", zip_of({"M.npy": npy(EYE), "M": npy(EYE)}), " M:", "twice", "keep one"
    ),
    of_npz("no-M", archive(q=ONES), " M:", "missing", "add"),
    of_npz("unnamed", archive(EYE, ONES), " arr_0:", "not a key", "the keys are"),
    of_npz(
        "complex", archive(M=EYE * 1j, q=ONES), " M:", "complex128", "real problems"
    ),
    of_npz("bool", archive(M=EYE > 0, q=ONES), " M:", "bool", "real numbers"),
    of_npz("nan", archive(M=EYE, q=[1, np.nan]), " q[1]:", "finite"),
    of_npz("one-dimension", archive(M=ONES, q=ONES), " M:", "1 dimension", "rows"),
    of_npz("name-number", archive(M=EYE, q=ONES, name=3), " name:", "int64", "text"),
    of_npz(
        "huge", zip_of({"M.npy": npy(EYE, (10**9, 10**9))}), "more memory than there is"
    ),
    of_npz("short", zip_of({"M.npy": npy(EYE, (10**9,))}), " M:", "damaged", "again"),
    of_npz("long", zip_of({"M.npy": npy(EYE, (3,))}), " M:", "damaged", "again"),
    of_npz(
        "no-size",
        zip_of({"M.npy": npy(EYE[:0], (10**9,)).replace(b"'<f8'", b"'<U0'")}),
        " M:",
        "damaged",
        "again",
    ),
    of_csr("no-data", {"data": None}, " M:", "inconsistent parts", "data"),
    of_csr("beside-M", {"M": EYE}, " data:", "next to a dense M", "keep one"),
    of_csr(
        "index-negative", {"indices": [0, -1]}, " M:", "inconsistent parts", "save_npz"
    ),
    of_csr(
        "index-a-fraction",
        {"indices": [0.0, 1.0]},
        " M:",
        "inconsistent parts",
        "whole numbers",
    ),
    of_csr(
        "pointers-falling",
        {"indptr": [0, 5, 2]},
        " M:",
        "inconsistent parts",
        "save_npz",
    ),
    of_csr("one-side", {"shape": [2]}, " M:", "inconsistent parts", "two numbers"),
    of_csr(
        "huge",
        {"shape": [10**12, 10**12]},
        " M:",
        "1000000000000 x 1000000000000",
        "2 entries",
    ),
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
    of_file(
        "q.npz",
        archive(a=ONES, b=ONES),
        "solve M.csv q.npz",
        "q.npz: q:",
        "missing",
        "add the key q",
    ),
    of_file(
        "q.npz",
        archive(q=np.ones((2, 2, 2))),
        "solve M.csv q.npz",
        "q.npz: q:",
        "3 dimensions",
        "flat",
    ),
    of_file(
        "p.npz",
        archive(M=EYE, q=ONES),
        "solve p.npz q.csv",
        "q.csv:",
        "not needed",
        "p.npz contains",
        "leave",
    ),
    of_npz(
        "lower-square", archive(M=EYE, q=ONES, lower=EYE), " lower:", "2 dimensions"
    ),
    of_npz(
        "of-two-ways",
        archive(P=EYE, c=ONES),
        "P:",
        "two ways to write a program",
        "Gx <= h, Ax = b",
    ),
    of_file(
        "b.npz",
        archive(lower=[0, np.nan]),
        "solve good.json --lower b.npz",
        "--lower: b.npz: lower[1]:",
        "not a",
    ),
    of_file(
        "b.npz",
        archive(x=ONES, y=ONES),
        "solve good.json --lower b.npz",
        "b.npz: lower:",
        "is missing",
    ),
    *(
        of_file(
            "p.mat",
            mat(M=EYE, q=ONES, **{name: held}),
            "solve p.mat",
            f"p.mat: {name}:",
            "lower and upper",
        )
        for name, held in (("lb", ONES), ("L", -1), ("bnds", EYE))
    ),
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
# Functions that a hint may name.
OURS = ("numpy.savez", "numpy.save", "scipy.sparse.save_npz")
TWICE, MINUS = 2 * np.eye(2), -np.ones(2)


def pickled_array() -> bytes:
    file = io.BytesIO()
    np.save(file, np.array([{"a": 1}, None], dtype=object), allow_pickle=True)
    return file.getvalue()


WHOLE_NPZ, WHOLE_MAT, WHOLE_NPY = (
    archive(M=TWICE, q=MINUS),
    mat(M=TWICE, q=MINUS[:, None]),
    npy(TWICE),
)
ZIPPED = gzip.compress(ARRAY.encode())
CONTENTS: dict[str, list[bytes]] = {
    "p.npz": [
        zip_of({"M.npy": pickled_array(), "q.npy": npy(MINUS)}),
        zip_of({"M.npy": pickle.dumps(TWICE), "q.npy": npy(MINUS)}),
        *(WHOLE_NPZ[:size] for size in (1, 40, 200, -1)),
        *(
            WHOLE_NPZ.replace(b"'descr': '<f8'", b"'descr': '<z8'"),
            WHOLE_NPZ.replace(b"(2, 2)", b"(2, x)"),
        ),
        archive(
            M=TWICE, q=np.array(["2021-01-01", "2021-01-02"], dtype="datetime64[D]")
        ),
        archive(
            data=MINUS,
            indices=np.array([0, 5]),
            indptr=np.array([0, 1, 2]),
            shape=np.array([2, 2]),
            q=MINUS,
        ),
        archive(M=np.ones((2, 2, 2)), q=MINUS),
        archive(M=TWICE, q=np.float64(1)),
    ],
    "p.npy": [
        pickled_array(),
        *(WHOLE_NPY[:size] for size in (6, 9, 40, -1)),
        *(
            WHOLE_NPY + b"more",
            WHOLE_NPY.replace(b"False", b"Felse"),
            WHOLE_NPY.replace(b"<f8", b"<q9"),
        ),
        *(
            npy(np.array(["a", "b"])),
            npy(np.array([[1j, 2]])),
            npy(np.zeros((0, 0))),
            npy(np.array(1.0)),
        ),
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
        *(
            mat(M=np.array(["a", 1.0], dtype=object), q=MINUS),
            mat(M=np.zeros((0, 0)), q=MINUS),
        ),
    ],
    "M.mtx.gz": [
        b"\x1f\x8b",
        b"\x1f\x8bnonsense",
        *(ZIPPED[:size] for size in (5, 10, 20, -8, -1)),
        *(ZIPPED[:-8] + b"\0" * 8, ZIPPED.replace(b"\x08", b"\x07", 1)),
        *(
            gzip.compress(b"hello"),
            gzip.compress(b""),
            gzip.compress(ARRAY.encode()[:-3]),
        ),
    ],
}
FOREIGN_FILES = [
    of_file(name, content, f"solve {name}" + " q.csv" * name.startswith("M"), name)
    for name, contents in CONTENTS.items()
    for content in contents
]
