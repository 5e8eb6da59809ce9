"""Games of two players in extensive form, as Gambit's .efg files have them; see `lcpcli.model.efg`."""

from __future__ import annotations

from typing import Any

from lcpcli.files.contents import decode, unpacked
from lcpcli.files.formats import Number


def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001 (as in every format)
    """Return the game in an .efg file, which is read when the problem is made."""
    return {"efg": decode(unpacked(content))}
