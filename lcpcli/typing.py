"""Type aliases for objects that modules pass to each other, for annotations only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Sequence
    from fractions import Fraction

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

Vector: TypeAlias = "NDArray[np.float64]"
Indices: TypeAlias = "NDArray[np.intp]"
BasisStatus: TypeAlias = "NDArray[np.int8]"  # LOWER, BASIC or UPPER of model/box.py
Mask: TypeAlias = "NDArray[np.bool_]"
Support: TypeAlias = "NDArray[np.float32]"  # 1 where a number is positive, otherwise 0
# A dense float64 array or a scipy.sparse.csr_array; scipy ships no annotations.
Matrix: TypeAlias = Any
VectorLike: TypeAlias = "ArrayLike | Sequence[float | Fraction]"
BoundLike: TypeAlias = "ArrayLike | Fraction | Sequence[float | Fraction | None] | None"
Interrupts: TypeAlias = Literal["raise", "return"]
