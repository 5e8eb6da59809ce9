"""The state of a variable: at its lower bound, basic, or at its upper bound, as a number and as a word."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lcpcli.errors import ProblemError, kind
from lcpcli.model.arrays import FROM_0
from lcpcli.typing import Mask, States

LOWER, BASIC, UPPER = -1, 0, 1  # z_i = l_i and w_i >= 0, w_i = 0, z_i = u_i and w_i <= 0
WORDS = {LOWER: "lower", BASIC: "basic", UPPER: "upper"}
_STATES = {word: state for state, word in WORDS.items()}


def of_masks(basic: Mask, upper: Mask | None = None) -> States:
    """Return states of any shape: BASIC where basic, elsewhere UPPER where upper, and LOWER."""
    states: States = basic.view(np.int8) + np.int8(LOWER)
    return states if upper is None else np.where(upper & ~basic, np.int8(UPPER), states)


def of_words(words: Sequence[str]) -> States:
    """Return the states of shape (n,) that are given in words; raise ProblemError for another word."""
    states = [_STATES.get(word) if isinstance(word, str) else None for word in words]
    if None in states:
        i = states.index(None)
        raise ProblemError(f"basis[{i}]", f"is {kind(words[i])}", f"write lower, basic or upper {FROM_0}")
    return np.array(states, np.int8)


def in_words(states: States) -> list[str]:
    """Return states of shape (n,) in words."""
    return [WORDS[state] for state in states.tolist()]
