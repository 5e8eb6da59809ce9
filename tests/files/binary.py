"""Contents of binary files: archives of arrays, MAT files and single arrays."""

import io
import zipfile

import numpy as np
from scipy.io import savemat


def archive(*unnamed, **named):
    file = io.BytesIO()
    np.savez(file, *unnamed, **named)
    return file.getvalue()


def mat(**variables):
    file = io.BytesIO()
    savemat(file, variables)
    return file.getvalue()


def npy(array, shape=None):
    """An array as numpy.save writes it, but with that shape in its header."""
    file = io.BytesIO()
    header = {
        "descr": "<f8",
        "fortran_order": False,
        "shape": array.shape if shape is None else shape,
    }
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + array.tobytes()


def zip_of(files, method=zipfile.ZIP_STORED):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as writing:
        for name, content in files.items():
            writing.writestr(name, content)
    return file.getvalue()
