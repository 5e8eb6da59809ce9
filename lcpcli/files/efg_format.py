"""Games of two players in extensive form, as Gambit's .efg files have them; see `lcpcli.model.game_tree`."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from lcpcli.errors import ProblemError
from lcpcli.files.contents import decode, unpacked
from lcpcli.files.formats import Number


def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001 (as in every format)
    """Return the text of an .efg file, which is read when the problem is made. Old files, whose labels have bytes that
    are not UTF-8, are in Latin-1."""
    text = unpacked(content)
    with suppress(ProblemError):
        return {"efg": decode(text)}
    return {"efg": decode(text.decode("latin-1").encode())}
