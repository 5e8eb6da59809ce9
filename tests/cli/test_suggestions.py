"""An unknown word is answered with the likely one, for every kind of word and any version of click."""

from __future__ import annotations

from collections.abc import Iterable

import click
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli.bench.suites import SUITES
from lcpcli.cli import command as group
from lcpcli.cli.help import SHELLS, TOPICS
from lcpcli.errors import OptionError, likely
from lcpcli.gallery.families import FAMILIES
from lcpcli.methods.registry import METHODS
from lcpcli.peers.registry import PEERS
from lcpcli.report.formats import FORMATS

from .conftest import Lcp, assert_refused

KINDS = {
    "command": list(group.lcp.commands),
    "method": list(METHODS),
    "family": list(FAMILIES),
    "suite": list(SUITES),
    "peer": list(PEERS),
    "format": list(FORMATS),
    "shell": list(SHELLS),
    "topic": list(TOPICS),
    "option": [param.opts[-1] for param in group.lcp.commands["solve"].params if isinstance(param, click.Option)],
}


def misspelt(word: str) -> Iterable[str]:
    """The word with two neighbours exchanged, or with a letter too many."""
    for k in range(1, len(word)):
        yield word[: k - 1] + word[k] + word[k - 1] + word[k + 1 :]
        yield word[:k] + word[k - 1] + word[k:]


@pytest.mark.parametrize("kind", KINDS)
def test_a_slip_of_the_finger_is_corrected(kind: str) -> None:
    known = KINDS[kind]
    for word in known:
        if len(set(word)) >= 4:  # --x0 is as near to --z0
            wrong = {slip for slip in misspelt(word) if slip not in known}
            assert {slip: likely(slip, known) for slip in wrong} == dict.fromkeys(wrong, f"did you mean {word}?")


@settings(max_examples=25)
@given(st.text(max_size=20), st.sampled_from(sorted(KINDS)))
def test_what_is_suggested_can_be_given(text: str, kind: str) -> None:
    hint = likely(text, KINDS[kind])
    alternatives = [f"did you mean {word}?" for word in KINDS[kind]]
    assert hint in (*alternatives, f"choose one of {', '.join(KINDS[kind])}")


def test_capitals_and_beginnings_are_understood() -> None:
    assert likely("SHI", METHODS) == "did you mean shi?"
    assert likely("har", FAMILIES) == "did you mean harker-pang?"
    assert likely("", METHODS).startswith("choose one of auto")
    assert likely("zzz", METHODS, "look") == "look"


def test_every_command_suggests_the_likely_option(lcp: Lcp) -> None:
    for name in group.lcp.commands:
        assert_refused(lcp(name, "--hepl"), "no option '--hepl'; did you mean --help?")


def test_a_longer_word_for_an_option_is_understood() -> None:
    with pytest.raises(OptionError, match="did you mean tol"):
        lcpcli.solve([[2]], [-1], tolerance=1e-3)
