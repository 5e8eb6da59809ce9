"""Games in files: Gambit's .nfg and .efg forms, and two tables of payoffs by --game of
every command."""

import gzip
import json
from fractions import Fraction
from pathlib import Path

import pytest

import lcpcli
from lcpcli import errors, from_efg, read
from lcpcli.files import contents
from lcpcli.formulations.bimatrix_game.game import Game
from lcpcli.formulations.bimatrix_game.tables import input_of
from lcpcli.formulations.game_tree.game import ExtensiveGame

from ..conftest import read_exact, save_json
from ..wordings import NOT_UTF_8, OTHER_ORIGIN

HEAD = 'NFG 1 R "a game" { "Alice" "Bob" }\n'
PAYOFFS = (
    HEAD + '{ { "up" "down" } { "left" "mid" "right" } }\n"a comment"\n1 2 3 4\n1/3 '
    "-0.5, 1e1 .25\n0 0 -7/2 +1\n"
)
COUNTS = HEAD + "{ 2 3 }\n" + PAYOFFS.partition('"a comment"\n')[2]
OUTCOMES = HEAD + (
    '{ { "up" "down" } { "left" "mid" "right" } }\n'
    '{ { "one" 1 2 } { "" 3, 4 } { "with \\"quotes\\"" 1/3 -0.5 } { 10 .25 } { '
    '"" -7/2 1 } }\n1 2 3 4 0 5\n'
)
A = [[1, Fraction(1, 3), 0], [3, 10, Fraction(-7, 2)]]
B = [[2, Fraction(-1, 2), 0], [4, Fraction(1, 4), 1]]


def game_of(text, name="g.nfg"):
    Path(name).write_text(text)
    problem = read(name)
    assert problem.name == "a game"
    assert isinstance(problem.origin, ExtensiveGame if text.startswith("EFG") else Game)
    return problem.origin


def put(first, second):
    Path("A.csv").write_text(first)
    Path("B.csv").write_text(second)


@pytest.fixture(autouse=True)
def _tables(in_folder):  # noqa: ARG001
    """The battle of the sexes in two tables, the first with labels as pandas writes
    them."""
    put(",left,right\nopera,3,0\nbox,0,2\n", "2;0\n0;3\n")


@pytest.mark.parametrize(
    "text", [PAYOFFS, COUNTS, OUTCOMES], ids=["payoffs", "counts", "outcomes"]
)
def test_all_versions_have_the_payoffs_with_the_first_player_in_the_rows(text):
    """It is recognized by its first word."""
    game = game_of(text, "g.txt")
    assert game.payoffs() == (A, B)
    assert (game.rows, game.columns) == (
        ((), ()) if text == COUNTS else (("up", "down"), ("left", "mid", "right"))
    )


def test_numbers_are_no_names_of_strategies():
    game = game_of(HEAD + '{ { "1" "2" } { "b" } } 1 1 2 2')
    assert game.rows == ()
    assert game.columns == ("b",)


def test_fractions_are_not_rounded_for_proofs():
    game_of(HEAD + "{ 1 2 } 1/3 1 2/3 2")
    assert read_exact("g.nfg").is_solution([Fraction(1), Fraction(0), Fraction(3)])
    ends = 't "" 1 { 1/3 0 } t "" 2 { 0.33333333333333333333333333333334 0 }'
    game_of(f'{TREE} p "" 1 1 {{ "a" "b" }} 0 {ends}', "g.efg")
    w = read_exact("g.efg").w([Fraction(value) for value in (1, 0, 1, 1, 0, 0, 0)])
    assert w[1] > w[2] > 0


TREE = 'EFG 2 R "a game" { "Ann" "Bob" }\n'
TWO = TREE + 'p "" 1 1 "" { "a" "b" } 0\n'


def test_both_forms_are_only_read_and_complete_formats_keep_payoffs_and_tree(lcp):
    winkels = contents.shipped_path("games/winkels.nfg")
    kept = game_of(GAME, "g.efg").tree.terminal_nodes
    assert lcp(f"convert {winkels} -o w.json").code == 0
    assert read("w.json").origin.payoffs()[0][4][0] == Fraction(5, 2)
    for suffix in ("json", "npz", "mat"):
        assert lcp(f"convert g.efg -o g.{suffix}").err == f"lcp: wrote g.{suffix}\n"
        again = read(f"g.{suffix}")
        assert again.origin.tree.terminal_nodes == kept
        assert (again.M == read("g.efg").M).all()
    done = lcp("convert g.efg -o g.csv")
    assert (
        "written as the game's mixed problem, M, q and bounds; left out: name, "
        "game tree, names" in done.err
    )
    lcpcli.write(read("g.efg"), "m.json")
    data = json.loads(Path("m.json").read_text())
    data["M"][0][3] += 1
    save_json(Path("m.json"), data)
    assert f"origin: {OTHER_ORIGIN}" in lcp("solve m.json").err


GAME = TREE + (
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


@pytest.mark.parametrize(
    ("first", "second", "rows", "columns"),
    [
        ("left,right\n3,0\n0,2\n", "2,0\n0,3\n", (), ("left", "right")),
        ("3,0\n0,2\n", "left,right\n2,0\n0,3\n", (), ("left", "right")),
        (
            "event,left,right\nopera,3,0\nbox,0,2\n",
            "2,0\n0,3\n",
            ("opera", "box"),
            ("left", "right"),
        ),
    ],
    ids=["of-A", "of-B", "below-a-named-corner"],
)
def test_labels_of_strategies_are_kept(first, second, rows, columns):
    put(first, second)
    origin = input_of(["A.csv", "B.csv"]).read().origin
    assert isinstance(origin, Game)
    assert origin.rows == rows
    assert origin.columns == columns


@pytest.mark.parametrize("last", [1, 0])
def test_whole_numbers_as_text_are_payoffs_as_str_writes_them(last):
    payoffs = [[Fraction(1, 2), Fraction(0)], [Fraction(-3), Fraction(last)]]
    A = [[str(v) for v in row] for row in payoffs]
    save_json(Path("game.json"), {"A": A, "B": [["1", "0"], ["0", "1"]]})
    assert read("game.json").origin.payoffs()[0] == payoffs


def test_events_sets_and_outcomes_are_said_once_and_their_payoffs_add_up():
    tree = game_of(GAME, "g.efg").tree
    ann, bob = tree.players
    assert [own.number for own in ann.sets] == [7]
    assert ann.sets[0].actions == ("up", "down")
    assert bob.labels() == ["there"]
    assert tree.events[0].probabilities == (Fraction(1, 4), Fraction(3, 4))
    ends = [i for i, node in enumerate(tree.nodes) if node.owner == -2]
    first = (Fraction(1, 3) - 1, Fraction(1, 2))
    assert [tree.nodes[i].payoffs for i in ends] == [
        first,
        (1, 4),
        (-1, 1),
        first,
        (1, 4),
        (3, 5),
    ]
    assert [tree.nodes[i].sequences for i in ends] == [
        (1, 1),
        (1, 2),
        (2, 0),
        (1, 1),
        (1, 2),
        (2, 0),
    ]


def test_repeated_and_empty_labels_get_numbers_in_names():
    text = GAME.replace('"Bob"', '"Ann"').replace('"here"', '""')
    game_of(text, "g.efg")
    names = read("g.efg").names
    assert names[:3] == ["Ann 1", "Ann 1: 7: up", "Ann 1: 7: down"]
    assert names[3:6] == ["Ann 2", "Ann 2: there: yes 1", "Ann 2: there: yes 2"]


def test_it_is_recognized_by_its_first_word_also_compressed_and_from_text(lcp):
    Path("g.efg.gz").write_bytes(gzip.compress(GAME.encode()))
    assert game_of(GAME, "g.txt").sizes == (3, 3, 2, 2)
    found = [read("g.efg.gz"), from_efg(GAME), read("g.txt")]
    assert len({problem.M.tobytes() for problem in found}) == 1
    assert lcp("solve g.efg.gz -q").code == lcp("inspect g.efg.gz").code == 0
    Path("g.efg").write_text(GAME)
    assert "g.efg" in map(str, map(Path, contents.files_in(["."], print)))


def test_labels_in_latin_1_are_read_and_what_is_no_text_is_refused(lcp):
    Path("g.efg").write_bytes(GAME.replace("Ann", "J\xfcrgen").encode("latin-1"))
    assert read("g.efg").names[0] == "J\xfcrgen"
    assert lcp("convert g.efg -o g.json").code == 0
    Path("g.efg").write_bytes(b"EFG 2 R \0")
    with pytest.raises(errors.ProblemError, match=NOT_UTF_8):
        read("g.efg")


def test_players_are_refused_if_and_only_if_they_forget_their_moves():
    ends = 't "" 0 ' * 4
    forgetful = TWO + f'p "" 1 2 {{ "l" "r" }} 0 {ends[:14]} p "" 1 2 0 {ends[:14]}'
    with pytest.raises(errors.ProblemError, match="has no perfect recall"):
        from_efg(forgetful)
    assert from_efg(forgetful.replace('p "" 1 2 0', 'p "" 1 3 { "l" "r" } 0')).n == 13
    assert from_efg(forgetful.replace(" 1 2 ", " 2 2 ")).n == 10


def test_a_tree_may_be_one_end_and_a_player_may_have_no_move():
    answer = lcpcli.run(from_efg(TREE + 't "" 1 { 2 -3 }')).answer
    assert answer.payoffs == (2.0, -3.0)
    assert answer.information_sets == []
    answer = lcpcli.run(from_efg(TWO + 't "" 1 { 1 2 } t "" 2 { 5 6 }')).answer
    assert answer.payoffs == (5.0, 6.0)


def test_long_rows_of_chance_moves_are_refused_before_memory_runs_out():
    row = "".join(f'c "" {k} {{ "" 1/3 "" 2/3 }} 0 t "" 0\n' for k in range(1, 3000))
    with pytest.raises(
        errors.ProblemError,
        match="has chances whose fractions are longer than a thousand digits",
    ):
        from_efg(f'{TREE}{row}t "" 0')


def test_a_deep_tree_costs_no_recursion():
    row = "".join(
        f'p "" {1 + k % 2} {k} {{ "go" "stop" }} {k} {{ 1 {k % 7} }}\n'
        for k in range(1, 400)
    )
    tree = f'{TREE}{row}t "" 0 ' + 't "" 0 ' * 399
    problem = from_efg(tree)
    assert problem.n == 2 * 399 + 4 + 399
    assert lcpcli.run(problem).answer.gains == (0.0, 0.0)
