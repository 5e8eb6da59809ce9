"""Gambit's .efg files, in which games in extensive form are texts."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from lcpcli.errors import ProblemError
from lcpcli.files.contents import decode
from lcpcli.files.formats import Number


# As in every format.
def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001
    """Return the text of a file: old ones have labels in Latin-1."""
    with suppress(ProblemError):
        return {"efg": decode(content)}
    return {"efg": decode(content.decode("latin-1").encode())}
