"""Behavior strategies of a game tree with chance moves."""

from __future__ import annotations

import pytest

import lcpcli

DRAW = """EFG 2 R "draw" { "A" "B" }
c "" 1 "" { "low" 1/3 "high" 2/3 } 0
p "" 1 1 "low" { "fold" "bet" } 0
t "" 1 "" { 0, 0 }
t "" 2 "" { -1, 1 }
p "" 1 2 "high" { "fold" "bet" } 0
t "" 3 "" { 0, 0 }
p "" 2 1 "" { "fold" "call" } 0
t "" 4 "" { 1, -1 }
t "" 5 "" { 2, -2 }
"""


def test_information_sets_are_reached_as_often_as_chance_leads_there() -> None:
    answer = lcpcli.run(lcpcli.from_efg(DRAW)).answer
    assert [each.reached for each in answer.information_sets] == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert answer.payoffs == pytest.approx([2 / 3, -2 / 3])
