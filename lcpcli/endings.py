"""The endings of problem files. They stand apart from `lcpcli.files` so that completing a word loads no numpy."""

from __future__ import annotations

FORMATS = {".json": "json", ".csv": "csv", ".mtx": "matrix_market", ".npz": "npz"}  # the module that reads it
COMPRESSED = ".mtx.gz"  # read as .mtx
