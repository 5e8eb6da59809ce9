"""Where a problem was read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Source(NamedTuple):
    """A file, and in a file with several problems which of them.

    file : the name of the file, or of that of q; None if it is from none. item : the number of its line, or of its
    column of q, from 1; None in a file with one problem. mark : what its record in a log says besides (`files/log.py`);
    None elsewhere.
    """

    file: str | None = None
    item: int | None = None
    mark: Mapping[str, Any] | None = None

    def __str__(self) -> str:
        return f"{self.file}{'' if self.item is None else f':{self.item}'}"


NOWHERE = Source()
