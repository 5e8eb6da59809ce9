"""Gambit's .efg files: all that the format allows is read, and anything else is refused in a line."""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import lcpcli
from lcpcli import errors
from lcpcli.files import contents
from lcpcli.model.extensive import ExtensiveGame

from ..conftest import read_exact

Lcp = Callable[..., Any]
HEAD = 'EFG 2 R "a game" { "Ann" "Bob" }\n'
GAME = HEAD + (
    '"a comment with { braces }, and \\"quotes\\""\n'
    'c "root" 1 "weather" { "sun" 1/4 "rain" .75 } 0\n'
    'p "a" 1 7 "here" { "up", "down" } 5 "fee" { -1 1e0 }\n'
    'p "b" 2 1 "there" { "yes" "yes" } 0\n'
    't "" 1 "one" { 1/3, -0.5 }\n'
    't "" 2 { +2 3. }\n'
    't "" 0\n'
    'p "a" 1 7 5\n'
    'p "" 2 1 "there" { "yes" "yes" } 0 t "" 1 "one" { 1/3, -0.5 } t "" 2\n'
    't "" 3 "three" { 4 4 }\n'
)


def game_of(path: Path, text: str) -> ExtensiveGame:
    path.write_text(text)
    problem = lcpcli.read(path)
    assert problem.name == "a game"
    assert isinstance(problem.origin, ExtensiveGame)
    return problem.origin


def test_events_sets_and_outcomes_are_said_once_and_their_payoffs_add_up(tmp_path: Path) -> None:
    tree = game_of(tmp_path / "g.efg", GAME).tree
    ann, bob = tree.players
    assert ([own.number for own in ann.sets], ann.sets[0].actions, bob.labels()) == ([7], ("up", "down"), ["there"])
    assert tree.events[0].probabilities == (Fraction(1, 4), Fraction(3, 4))
    ends = [i for i, node in enumerate(tree.nodes) if node.owner == -2]
    first = (Fraction(1, 3) - 1, Fraction(1, 2))
    assert [tree.totals()[i] for i in ends] == [first, (1, 4), (-1, 1), first, (1, 4), (3, 5)]
    assert [tree.sequences[i] for i in ends] == [(1, 1), (1, 2), (2, 0), (1, 1), (1, 2), (2, 0)]


def test_repeated_and_empty_labels_get_numbers_in_names(tmp_path: Path) -> None:
    text = GAME.replace('"Bob"', '"Ann"').replace('"here"', '""')
    names = lcpcli.read(game_of(tmp_path / "g.efg", text) and tmp_path / "g.efg").names
    assert names[:3] == ["Ann 1", "Ann 1: 7: up", "Ann 1: 7: down"]
    assert names[3:6] == ["Ann 2", "Ann 2: there: yes 1", "Ann 2: there: yes 2"]


def test_it_is_recognized_by_its_first_word_also_compressed_and_from_text(lcp: Lcp, tmp_path: Path) -> None:
    import gzip

    (tmp_path / "g.efg.gz").write_bytes(gzip.compress(GAME.encode()))
    found = [lcpcli.read(tmp_path / "g.efg.gz"), lcpcli.from_efg(GAME)]
    assert game_of(tmp_path / "g.txt", GAME).sizes == game_of(tmp_path / "g.efg", GAME).sizes == (3, 3, 2, 2)
    assert {problem.M.tobytes() for problem in found} == {lcpcli.read(tmp_path / "g.txt").M.tobytes()}
    assert lcp("solve", str(tmp_path / "g.efg.gz"), "-q").code == 0


def test_labels_in_latin_1_are_read_and_what_is_no_text_is_refused(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "g.efg").write_bytes(GAME.replace("Ann", "J\xfcrgen").encode("latin-1"))
    assert lcpcli.read(tmp_path / "g.efg").names[0] == "J\xfcrgen"
    made = lcp("make", "--from-game", str(tmp_path / "g.efg"), "-o", str(tmp_path / "g.json"))
    assert made.code == 0
    (tmp_path / "g.efg").write_bytes(b"EFG 2 R \0")
    with pytest.raises(errors.ProblemError, match="is not UTF-8 text"):
        lcpcli.read(tmp_path / "g.efg")


def test_fractions_are_not_rounded_for_proofs(tmp_path: Path) -> None:
    game = HEAD + 'p "" 1 1 { "a" "b" } 0 t "" 1 { 1/3 0 } t "" 2 { 0.33333333333333333333333333333334 0 }'
    (tmp_path / "g.efg").write_text(game)
    data = read_exact(str(tmp_path / "g.efg"))
    w = data.w([Fraction(value) for value in (1, 0, 1, 1, 0, 0, 0)])
    assert w[1] > w[2] > 0


def test_other_formats_keep_the_tree_or_say_that_they_do_not(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "g.efg").write_text(GAME)
    before = lcpcli.read(tmp_path / "g.efg")
    for suffix in ("json", "npz", "mat"):
        done = lcp("convert", str(tmp_path / "g.efg"), "-o", str(tmp_path / f"g.{suffix}"))
        assert (done.code, done.err) == (0, "")
        again = lcpcli.read(tmp_path / f"g.{suffix}")
        assert isinstance(again.origin, ExtensiveGame)
        assert (again.M == before.M).all()
    done = lcp("convert", str(tmp_path / "g.efg"), "-o", str(tmp_path / "g.csv"))
    assert "written as the game's mixed problem, M, q and bounds; left out: name, game tree, names" in done.err
    assert "is of a format that is only read" in lcp("convert", str(tmp_path / "g.json"), "-o", "h.efg").err
    lcpcli.write(before, tmp_path / "m.json")
    data = json.loads((tmp_path / "m.json").read_text())
    assert lcpcli.read(tmp_path / "m.json").origin is not None
    data["M"][0][3] += 1
    (tmp_path / "m.json").write_text(json.dumps(data))
    assert "origin: does not yield this M and q" in lcp("solve", str(tmp_path / "m.json")).err


TWO = HEAD + 'p "" 1 1 "" { "a" "b" } 0\n'
CASES = [
    (HEAD.replace('"Bob"', '"Bob" "Cy"'), "is a game of 3 players; give one of two: only its"),
    (HEAD.replace('"Bob"', ""), "is a game of 1 player; give one of two"),
    ("EFG 1 R", "line 1: is not the beginning of a game tree; begin the file with EFG 2 R"),
    ('EFG 2 R "title"', "line 1: has no players after the title; write EFG 2 R"),
    ('EFG 2 R "title" p', "line 1: has no players after the title; write EFG 2 R"),
    ("EFG 2 R title", "line 1: has 'title' in place of a name; put names in quotes"),
    (HEAD, "ends too early; is it cut off?"),
    (TWO + 't "" 1 { 1 2 }', "ends too early; is it cut off?"),
    (TWO + 't "" 1 { 1 2', "ends too early; is it cut off?"),
    (TWO + 'x "" 0', "line 3: has 'x' in place of a node; begin each node with c for chance, p for a player, t for"),
    (HEAD + 't "" 0\nt "" 0', "line 3: has 't' after the last node of the tree; remove it"),
    (TWO + 't "" 1', "line 3: names outcome 1 before its payoffs; give them where it is first named"),
    (TWO + 't "" 1 { 1 2 3 }', "line 3: has 3 payoffs for 2 players; give one for each"),
    (TWO + 't "" 1 { 1 x }', "line 3: has 'x' in place of a number; give an integer, a decimal or a fraction"),
    (TWO + 't "" 1 { 1 1/0 }', "line 3: has '1/0' in place of a number"),
    (TWO + 't "" 1 { 1 1e9999 }', "line 3: has '1e9999' in place of a number"),
    (TWO + 't "" 1 { 1 -1e301 }', "line 3: has '-1e301', too large for doubles; scale the payoffs"),
    (TWO + 't "" -1', "line 3: has '-1' in place of the number of an outcome; give a whole number"),
    (TWO + 't "" 1 { 1 2 } t "" 1 { 1 3 }', "line 3: gives outcome 1 other payoffs than it has; correct one"),
    (TWO + 't "" 0 { 1 2 }', "line 3: gives outcome 0 other payoffs than it has"),
    (HEAD + 'p "" 3 1 { "a" } 0', "line 2: names player 3 of 2; give 1 or 2"),
    (HEAD + 'p "" 1 1 0', "line 2: names information set 1 of player 1 before its actions; list its actions"),
    (HEAD + 'p "" 1 1 { } 0', "line 2: lists no action for information set 1 of player 1; list at least one"),
    (TWO + 'p "" 1 1 { "b" "a" } 0', "line 3: lists other actions for information set 1 of player 1 than before"),
    (
        HEAD + 'c "" 1 "" { "h" 1/2 "t" 1/2 } 0 t "" 1 "" { 1 0 } c "" 1 "" { "h" 1/4 "t" 3/4 } 0',
        "line 2: lists other probabilities for chance event 1 than before",
    ),
    (HEAD + 'c "" 1 { "a" 1/3 "b" 1/3 } 0', "line 2: the probabilities of chance event 1 are not at least 0"),
    (HEAD + 'c "" 1 { "a" 2 "b" -1 } 0', "line 2: the probabilities of chance event 1 are not at least 0"),
    (HEAD + 'c "" 1 { "a" } 0', "line 2: has '}' in place of a number"),
    (TWO + 'p "" 1 1 0 t "" 0 t "" 0 t "" 0', "line 3: has no perfect recall: other own moves lead to information set"),
]


@pytest.mark.parametrize(("text", "message"), CASES, ids=range(len(CASES)))
def test_what_is_wrong_is_said_in_one_line_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "g.efg").write_text(text)
    with pytest.raises(errors.ProblemError) as caught:
        lcpcli.read(tmp_path / "g.efg")
    assert str(caught.value).startswith(f"{tmp_path / 'g.efg'}: {message}")


def test_players_who_forget_their_moves_are_refused_and_those_who_forget_nothing_are_not() -> None:
    ends = 't "" 0 ' * 4
    forgetful = TWO + f'p "" 1 2 {{ "l" "r" }} 0 {ends[:14]} p "" 1 2 0 {ends[:14]}'
    with pytest.raises(errors.ProblemError, match="has no perfect recall"):
        lcpcli.from_efg(forgetful)
    assert lcpcli.from_efg(forgetful.replace('p "" 1 2 0', 'p "" 1 3 { "l" "r" } 0')).n == 13
    assert lcpcli.from_efg(forgetful.replace(" 1 2 ", " 2 2 ")).n == 10


def test_a_tree_may_be_one_end_and_a_player_may_have_no_move() -> None:
    answer = lcpcli.run(lcpcli.from_efg(HEAD + 't "" 1 { 2 -3 }')).answer
    assert (answer.payoffs, answer.information_sets) == ((2.0, -3.0), [])
    answer = lcpcli.run(lcpcli.from_efg(TWO + 't "" 1 { 1 2 } t "" 2 { 5 6 }')).answer
    assert answer.payoffs == (5.0, 6.0)


def test_chance_moves_in_a_long_row_are_refused_before_their_product_takes_all_memory() -> None:
    row = "".join(f'c "" {k} {{ "" 1/3 "" 2/3 }} 0 t "" 0\n' for k in range(1, 20_000))
    with pytest.raises(errors.ProblemError, match="has chances whose fractions are longer than a thousand digits"):
        lcpcli.from_efg(f'{HEAD}{row}t "" 0')


def test_a_deep_tree_costs_no_recursion() -> None:
    row = "".join(f'p "" {1 + k % 2} {k} {{ "go" "stop" }} {k} {{ 1 {k % 7} }}\n' for k in range(1, 400))
    tree = f'{HEAD}{row}t "" 0 ' + 't "" 0 ' * 399
    problem = lcpcli.from_efg(tree)
    assert (problem.n, lcpcli.run(problem).answer.gains) == (2 * 399 + 4 + 399, (0.0, 0.0))


def test_texts_other_than_of_a_game_are_refused_in_words() -> None:
    with pytest.raises(errors.ProblemError, match=r"efg: is a number; give the text of an .efg file"):
        lcpcli.from_efg(1)  # type: ignore[arg-type]


def test_folders_and_other_commands_take_efg_files(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "g.efg").write_text(GAME)
    assert contents.files_in([str(tmp_path)], print) == [str(tmp_path / "g.efg")]
    assert lcp("inspect", str(tmp_path / "g.efg"), "--format", "json").code == 0


def test_all_equilibria_and_the_best_one_are_strategies_and_payoffs(tmp_path: Path, lcp: Any) -> None:
    (tmp_path / "threat.efg").write_text(THREAT)
    source = str(tmp_path / "threat.efg")
    lines = [line.split() for line in lcp("solve", source, "--all").out.splitlines() if "-" * 9 not in line]
    assert lines[4] == ["piece", "L", "R", "l", "r", "Ann", "gets", "Bob", "gets"]
    assert [line[-2:] for line in lines[5:8]] == [["2", "1"], ["1", "2"], ["1", "2"]]
    for options in ((), ("--exact",)):
        every = json.loads(lcp("solve", source, "--all", "--format", "json", *options).out)
        best = json.loads(lcp("solve", source, "--maximize", "z2", "--format", "json", *options).out)
        kind = str if options else float
        assert best["equilibrium"]["payoffs"] == [kind(2), kind(1)]
        for own in (*(each["equilibrium"] for each in every["solutions"]), best["equilibrium"]):
            assert own["players"] == ["Ann", "Bob"]
            assert {type(value) for plan in own["plans"] for value in plan} == {kind}
    answer = json.loads(lcp("solve", source, "--exact", "--format", "json").out)["answer"]
    assert {type(value) for plan in answer["exact"]["plans"] for value in plan} == {str}
    assert "payoffs Ann 2, Bob 1" in lcp("solve", source, "--maximize", "z2").out
    table = lcp("solve", source).out
    assert "method k       Ann         L         R       Bob         l         r cost of Ann" in table


THREAT = """EFG 2 R "threat" { "Ann" "Bob" }
p "" 1 1 "a" { "L" "R" } 0
p "" 2 1 "b" { "l" "r" } 0
t "" 1 "" { 2 1 }
t "" 2 "" { 0 0 }
t "" 3 "" { 1 2 }
"""
