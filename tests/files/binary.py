"""Contents of binary files: archives of arrays, MAT files and single arrays."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np
from scipy.io import savemat


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


def zip_of(files: dict[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as writing:
        for name, content in files.items():
            writing.writestr(name, content)
    return file.getvalue()
