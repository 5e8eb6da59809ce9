"""Runs that cannot be compared are refused in one line."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ..refusals import Files, Refusal, commands, contents

RUN = (
    '{"problem": "p", "file": "a/p.json", "item": null, "label": "shi", '
    '"method": "shi", "status": "solved", "solved": true, "iterations": 12, '
    '"seconds": 1.0, "spread": 1.05}\n'
)
OLD: Files = {"old.json": RUN}
REFUSALS: list[Refusal] = [
    *contents(
        "new.json",
        r"""
=> {EMPTY}; {A_BENCH}
1,2\n => {NO_RUNS}; {A_BENCH}
{}\n => {NO_RUNS}; {A_BENCH}
[1]\n => {NO_RUNS}; {A_BENCH}
""",
        command="compare-runs old.json {}",
        files=OLD,
    ),
    *commands(
        r"""
compare-runs old.json other.json
    => other.json: has no run in common with old.json; name files of the same runs
compare-runs old.json old.json --slower 1
    => --slower: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:ratio > 1}
""",
        {**OLD, "other.json": RUN.replace("a/p.json", "q")},
    ),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_runs_that_cannot_be_compared_are_refused(
    refusal: Refusal, refused: Callable[[str, Files], str]
) -> None:
    assert refused(refusal.command, refusal.files) == refusal.line
