"""What has numbers without being an array or a list: data frames, tensors, buffers, sequences."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, kind
from lcpcli.linalg.matrices import is_sparse

TEXTS = (str, bytes, bytearray)


def plain(field: str, values: Any, expected: str) -> Any:
    """The array or the list of what numpy calls array-like, and of pandas, whose labels are not used; arrays of objects
    as lists; anything else unchanged. ProblemError for what stands for a matrix without having its entries."""
    if isinstance(values, np.ndarray):
        as_list = values.dtype == object and values.ndim and not isinstance(values, np.ma.MaskedArray)
        return values.tolist() if as_list else values
    if isinstance(values, (list, tuple, *TEXTS)) or is_sparse(values):
        return values
    if hasattr(values, "matvec"):
        hint = "give its matrix, dense or sparse, since entries are needed; M @ numpy.eye(n) has those of M"
        raise ProblemError(field, f"is {kind(values)}, a linear operator", hint)
    try:
        if hasattr(values, "to_numpy"):
            return plain(field, np.asarray(values.to_numpy()), expected)
        if hasattr(values, "__array__") or isinstance(values, (memoryview, array)):
            return plain(field, np.asarray(values), expected)
        return list(values) if isinstance(values, Sequence) else values
    except Exception:
        raise ProblemError(field, f"is {kind(values)}, and gives no array", f"give {expected}") from None
