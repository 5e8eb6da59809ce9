"""Several q for one M: a table of n rows with one q in each column, in any format that holds tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.files import csv_format, json_format, mat_format, npy_format, npz_format, reading
from lcpcli.files.content import decode
from lcpcli.model.arrays import as_matrix
from lcpcli.typing import Matrix


def columns_of(path: str, content: bytes, n: int) -> tuple[Matrix, list[str]] | None:
    """Q of shape (n, k) with the names of its columns, q1, q2, ... unless a header has others; None if the file holds
    a single vector. Raises ProblemError, which names the file."""
    try:
        table, names = _table(path, content)
        shape = np.shape(table)
        if n == 1 and len(shape) == 1:
            table, shape = [table], (1, shape[0])
        if len(shape) != 2 or shape[1] == 1 or (shape[0] == 1 and n > 1):
            return None
        Q = as_matrix("q", table)
        if shape[0] != n:
            transposed = "transpose it: " * (shape[1] == n)
            hint = f"{transposed}give one column for each problem, of as many rows as M has"
            raise ProblemError("q", f"is {shape[0]} x {shape[1]} but M is {n} x {n}", hint)
    except ProblemError as error:
        raise error.inside(reading.place(path)) from None
    return Q, names or [f"q{j}" for j in range(1, shape[1] + 1)]


def _table(path: str, content: bytes) -> tuple[Any, list[str]]:
    """What a file holds, as an array or in lists, and the names of its columns if it has them."""
    form = reading.format_of(path, content)
    if form is csv_format:
        return csv_format.parse_columns(content)
    if form is json_format:
        held = json_format.load(decode(content))
        return (held if isinstance(held, list) else []), []
    if form is npy_format:
        return npy_format.held(content), []
    if form is npz_format or form is mat_format:
        return (npz_format if form is npz_format else mat_format).parse_bound("q", content), []
    return [], []
