"""Malformed files on which the libraries that read them have words of their own, which users do not see."""

from __future__ import annotations

import gzip
import io
import pickle

import numpy as np

from .kinds import GOOD, of_file
from .matrix_kinds import ARRAY, archive, mat, npy, zip_of

FOREIGN = [
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

EYE, ONES = 2 * np.eye(2), -np.ones(2)


def pickled_array() -> bytes:
    file = io.BytesIO()
    np.save(file, np.array([{"a": 1}, None], dtype=object), allow_pickle=True)
    return file.getvalue()


WHOLE_NPZ, WHOLE_MAT, WHOLE_NPY = archive(M=EYE, q=ONES), mat(M=EYE, q=ONES[:, None]), npy(EYE)
ZIPPED = gzip.compress(ARRAY.encode())
CONTENTS: dict[str, list[bytes]] = {
    "p.npz": [
        zip_of({"M.npy": pickled_array(), "q.npy": npy(ONES)}),
        zip_of({"M.npy": pickle.dumps(EYE), "q.npy": npy(ONES)}),
        *(WHOLE_NPZ[:size] for size in (1, 40, 200, -1)),
        *(WHOLE_NPZ.replace(b"'descr': '<f8'", b"'descr': '<z8'"), WHOLE_NPZ.replace(b"(2, 2)", b"(2, x)")),
        archive(M=EYE, q=np.array(["2021-01-01", "2021-01-02"], dtype="datetime64[D]")),
        archive(data=ONES, indices=np.array([0, 5]), indptr=np.array([0, 1, 2]), shape=np.array([2, 2]), q=ONES),
        archive(M=np.ones((2, 2, 2)), q=ONES),
        archive(M=EYE, q=np.float64(1)),
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
        *(mat(M=EYE, q="text"), mat(M=EYE * 1j, q=ONES), mat(M={"a": 1}, q=ONES), mat(M=EYE, q=np.ones((2, 2)))),
        *(mat(M=np.array(["a", 1.0], dtype=object), q=ONES), mat(M=np.zeros((0, 0)), q=ONES)),
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
