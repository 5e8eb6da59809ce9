"""The size that a file declares is checked before memory is allocated for it."""

from __future__ import annotations

import math
import os

from lcpcli.errors import ProblemError


def refuse_beyond_memory(field: str, shape: tuple[int, ...], itemsize: int = 8) -> None:
    """Raise ProblemError if an array of that shape is larger than the memory of this machine."""
    size = math.prod(shape) * itemsize
    if size > _memory():
        declared = " x ".join(map(str, shape))
        raise ProblemError(
            field, f"is {declared}, {size / 1e9:.3g} GB, more than this machine's memory", "give it in sparse form"
        )


def _memory() -> float:
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # systems that do not provide it
        return math.inf
