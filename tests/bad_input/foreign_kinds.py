"""Malformed files on which the libraries that read them have words of their own, which users do not see."""

from __future__ import annotations

import gzip
import io
import pickle
from typing import Any

import numpy as np
from scipy.io import savemat

from .kinds import GOOD, of_file
from .matrix_kinds import ARRAY, archive, npy, zip_of

FOREIGN = (
    "numpy",
    "scipy",
    "Traceback",
    "invalid literal",
    "could not convert",
    "ufunc",
    "dtype",
    "broadcast",
    "Expecting",
)
OURS = ("numpy.savez", "numpy.save", "scipy.sparse.save_npz")  # functions that a hint may name

EYE, ONES = 2 * np.eye(2), -np.ones(2)
OBJECTS = np.array([{"a": 1}, None], dtype=object)


def mat(**variables: Any) -> bytes:
    file = io.BytesIO()
    savemat(file, variables)
    return file.getvalue()


def pickled_array() -> bytes:
    file = io.BytesIO()
    np.save(file, OBJECTS, allow_pickle=True)
    return file.getvalue()


WHOLE_NPZ, WHOLE_MAT, WHOLE_NPY = archive(M=EYE, q=ONES), mat(M=EYE, q=ONES[:, None]), npy(EYE)
CONTENTS: dict[str, list[bytes]] = {
    "p.npz": [
        zip_of({"M.npy": pickled_array(), "q.npy": npy(ONES)}),
        zip_of({"M.npy": pickle.dumps(EYE), "q.npy": npy(ONES)}),
        *(WHOLE_NPZ[:size] for size in (1, 40, 100, 200, len(WHOLE_NPZ) - 1)),
        WHOLE_NPZ.replace(b"NUMPY", b"XUMPY"),
        WHOLE_NPZ.replace(b"'descr': '<f8'", b"'descr': '<z8'"),
        WHOLE_NPZ.replace(b"'shape': (2, 2)", b"'shape': (2, x)"),
        archive(M=EYE * 1j, q=ONES),
        archive(M=EYE, q=np.array(["one", "two"])),
        archive(M=EYE, q=np.array(["2021-01-01", "2021-01-02"], dtype="datetime64[D]")),
        archive(M=EYE, q=ONES, lower=np.array(["none", "0"])),
        archive(data=ONES, indices=np.array([0, 5]), indptr=np.array([0, 1, 2]), shape=np.array([2, 2]), q=ONES),
        archive(M=np.ones((2, 2, 2)), q=ONES),
        archive(M=EYE, q=np.float64(1)),
        archive(M=EYE, q=ONES, solution=np.array("z")),
    ],
    "p.npy": [
        pickled_array(),
        *(WHOLE_NPY[:size] for size in (6, 9, 40, len(WHOLE_NPY) - 1)),
        WHOLE_NPY + b"more",
        WHOLE_NPY.replace(b"False", b"Felse"),
        WHOLE_NPY.replace(b"<f8", b"<q9"),
        npy(np.array(["a", "b"])),
        npy(np.array([[1j, 2]])),
        npy(np.zeros((0, 0))),
        npy(np.array(1.0)),
        npy(np.zeros(2, dtype=[("M", float), ("q", float)])),
    ],
    "p.mat": [
        *(WHOLE_MAT[:size] for size in (1, 100, 128, 140, 200, len(WHOLE_MAT) - 1)),
        WHOLE_MAT[:128] + b"\0" * 64,
        b"\0" * 200,
        b"random bytes of no format at all",
        mat(M=EYE, q="text"),
        mat(M=EYE * 1j, q=ONES),
        mat(M={"a": 1}, q=ONES),
        mat(M=np.array(["a", 1.0], dtype=object), q=ONES),
        mat(M=np.zeros((0, 0)), q=ONES),
        mat(M=EYE, q=np.ones((2, 2))),
    ],
    "M.mtx.gz": [
        b"\x1f\x8b",
        b"\x1f\x8bnonsense",
        *(gzip.compress(ARRAY.encode())[:size] for size in (5, 10, 20, -8, -1)),
        gzip.compress(ARRAY.encode())[:-8] + b"\0" * 8,
        gzip.compress(b"hello"),
        gzip.compress(b""),
        gzip.compress(ARRAY.encode()).replace(b"\x08", b"\x07", 1),
        gzip.compress(ARRAY.encode()[:-3]),
    ],
    "p.csv": [
        text.encode("latin-1")
        for text in (
            "2,0,-1\n0,2\n",
            "2,0,-1\n0,2,-1,7\n",
            "2,0,-1\n0,two,-1\n",
            "2,0,-1\n0,2+1j,-1\n",
            "2,0,-1\n0,1e,-1\n",
            "2,0,-1\n0,,-1\n",
            '2,0,-1\n0,"2"3,-1\n',
            '2,0,-1\n0,"2,-1\n',
            "2,0,-1\n0,NaN,-1\n",
            "2;0;-1\n0;1.000,5;-1\n",
            "2,0,-1\n0,\xbd,-1\n",
            "\0\0\0",
            "2,0,-1\n0,True,-1\n",
        )
    ],
    "p.json": [
        text.encode()
        for text in (
            GOOD[:-1],
            GOOD.replace("-1]", "-1"),
            GOOD.replace("-1]", "NaN]"),
            GOOD.replace("-1]", "nan]"),
            GOOD.replace("-1]", "-1,]"),
            GOOD.replace("-1]", "-Infinity]"),
            GOOD.replace("-1]", '"-1"]'),
            GOOD.replace("-1]", '"1+2j"]'),
            GOOD.replace("-1]", "[1]]"),
            GOOD.replace("-1]", "{}]"),
            GOOD.replace("-1]", "1e999]"),
            GOOD.replace("-1]", "0x2]"),
            GOOD.replace("-1]", "-1 -1]"),
            GOOD.replace('"q"', "q"),
            GOOD.replace('"q":', '"q"'),
            GOOD.replace('"q"', '"q'),
            GOOD.replace('"q"', '"\\q"'),
            GOOD.replace('"q"', '"q\t"'),
            GOOD.replace("[2, 0]", "[2]"),
            GOOD.replace("[2, 0]", "2"),
            GOOD.replace("[[2, 0], [0, 2]]", "null"),
            GOOD.replace(
                "[[2, 0], [0, 2]]", '{"format": "coo", "shape": [2, "x"], "rows": [0], "cols": [0], "values": [1]}'
            ),
            GOOD + "]",
            "'M'",
        )
    ],
}
FOREIGN_FILES = [
    of_file(name, content, f"solve {name}" + " q.csv" * name.startswith("M"), name)
    for name, contents in CONTENTS.items()
    for content in contents
]
