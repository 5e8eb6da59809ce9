"""Sessions in an empty folder: all that commands print, one after the other, is the
same as before."""

from __future__ import annotations

from collections.abc import Callable

import pytest

SESSIONS = """answers-in-every-form answers-among-several proofs-checked
equilibria-checked game-trees games-in-files objectives others-said wrong-solutions
without-unknowns verdicts-on-decimals comparisons basis-of-the-last-step
names-and-numbers-in-formats long-tables decimal-commas names-of-what-is-shipped
remarks-of-convert a-stream-of-steps q-by-its-option many-problems answers-in-tables"""


@pytest.mark.parametrize("name", SESSIONS.split())
@pytest.mark.usefixtures("in_folder")
def test_a_session_is_the_same_as_before(
    name: str, session: Callable[[str], None]
) -> None:
    pytest.importorskip("flint")
    session(f"session-{name}")
