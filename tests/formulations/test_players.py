"""Games of any number of players: their conditions, answers, files and faults."""

import json
from dataclasses import replace
from fractions import Fraction
from itertools import chain, product

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import from_players, from_polymatrix, solutions
from lcpcli.solving import driver

from ..refusals import contents
from ..seeds import few_of

# Three producers with costs 1, 2, 3 and 4, 3, 2 a unit, at a price of 20 less all that
# they sell: the gradient of the loss of each.
MARKET = {
    "sizes": [1, 1, 1],
    "H": [[2, 1, 1], [1, 2, 1], [1, 1, 2]],
    "c": [-10, -9, -8],
    "players": ["Ann", "Bob", "Cid"],
}


def losses(x):
    H, c = np.array(MARKET["H"], dtype=float), np.array(MARKET["c"], dtype=float)
    return [float(x[i] * (H[i] @ x - H[i, i] * x[i] / 2 + c[i])) for i in range(3)]


def test_no_player_gains_by_another_output():
    result = lcpcli.run(from_players(**MARKET, upper=4))
    answer = result.answer
    assert result.solved
    assert answer.costs == pytest.approx(losses(answer.x))
    for player in range(3):
        for output in np.linspace(0, 4, 9):
            other = answer.x.copy()
            other[player] = output
            assert losses(other)[player] >= answer.costs[player] - 1e-9
    assert answer.gains == (0, 0, 0)


def test_gains_are_those_of_best_responses():
    problem = from_players(**MARKET, upper=4)
    found = lcpcli.check(problem, [2, 2, 2])
    best = min(losses(np.array([t, 2, 2]))[0] for t in np.linspace(0, 4, 401))
    now = losses(np.full(3, 2.0))[0]
    assert not found.accepted
    assert found.strategies.gains[0] == pytest.approx(now - best)


def follower(slope):
    """A game in which 1 / slope is the best output of the first player, and any output
    is one of the second player, whose cost is then 0."""
    return from_players([1, 1], [[slope, 0], [slope, 0]], [-1, -1])


@pytest.mark.parametrize("slope", [3, 49, 49e8, 49e-8])
def test_a_cost_without_slope_but_for_rounding_refutes_no_equilibrium(slope):
    problem = follower(slope)
    for words in (
        lcpcli.run(problem).answer.statement,
        lcpcli.check(problem, [1 / slope, 0]).message,
    ):
        assert "not an equilibrium" not in words
    exact = lcpcli.exact(problem).answer
    nobody_gains = (
        "an equilibrium: by a best response player 1 would gain 0, player 2 0"
    )
    assert exact.statement == nobody_gains
    assert exact.gains == (0, 0)
    x = exact.exact["strategies"]
    check = lcpcli.check(problem, [x[0][0], x[1][0]])
    assert check.message.endswith(f"; as strategies, {nobody_gains}")


def test_a_slope_of_the_size_of_its_rounding_is_not_decided():
    problem = follower(49)  # 49 * (1 / 49) - 1 is -1.1e-16
    answer = lcpcli.run(problem).answer
    words = (
        "whether this is an equilibrium is not decided: by a best response player 1 "
        "would gain 0, player 2 an unknown amount"
    )
    assert answer.statement == words
    assert answer.gains == pytest.approx((0, np.nan), nan_ok=True)
    assert json.loads(lcpcli.run(problem).to_json())["answer"]["gains"] == [0, None]
    assert lcpcli.check(problem, answer.x).message.endswith(f"; as strategies, {words}")
    for x in ([1 / 49 + 1e-3, 0], [1 / 49 - 1e-3, 0]):
        found = lcpcli.check(problem, x)
        grows = x[0] > 1 / 49
        assert found.strategies.gains[1] == (0 if grows else np.inf)
        assert "not an equilibrium" in found.message


def test_a_gain_that_rounding_of_a_row_makes_is_none():
    """The first player is at 0, where its row is active: the terms of its cost are 0,
    and those of the row are not."""
    H = [[18, -6, 1.5, -1], [-6, 10, -0.5, -0.5], [1.5, -0.5, 4, 6], [-1, -0.5, 6, 9]]
    sides = {"row_lower": [-1, -np.inf], "row_upper": [-1, np.inf]}
    bounds = {"lower": [0, -1, -np.inf, -3], "upper": [np.inf, 3, np.inf, 2]}
    rows, own = [[1, -3, -1, 3], [0, 0, 0, 0]], {"owner": [0, None], "shared": "each"}
    problem = from_players([2, 2], H, [3, 3, 0, 0], rows, **own, **sides, **bounds)
    answer = lcpcli.run(problem).answer
    assert answer.gains == (0, 0)
    assert answer.statement.startswith("an equilibrium: ")
    moved = lcpcli.check(problem, np.add(answer.x, [0, 1e-3, 0, 0]))
    assert moved.strategies.gains[0] > 1e-4


def test_without_a_best_response_nothing_is_decided(monkeypatch):
    result = lcpcli.run(from_players(**MARKET, upper=4))
    run = driver.run

    def stalled(*arguments):
        return replace(run(*arguments), status=lcpcli.Status.STALLED)

    monkeypatch.setattr(driver, "run", stalled)
    assert np.isnan(result.answer.gains).all()
    assert "is not decided: " in result.answer.statement


def test_a_shared_row_has_one_price_for_all_or_one_for_each():
    data = {**MARKET, "A": [[1, 1, 1]], "row_upper": 4}
    common = from_players(**data)
    each = from_players(**data, shared="each")
    assert (common.n, each.n) == (4, 6)
    (variational,) = solutions(common)
    assert variational.is_point
    assert not all(piece.is_point for piece in solutions(each))
    x = variational.vertices[0][:3]
    assert lcpcli.check(each, list(x)).accepted


def test_a_row_of_one_player_limits_no_other():
    # Bob's output counts in Ann's limit, which is no reason for him to sell less.
    limited = from_players(
        [1, 1], [[2, 0], [0, 2]], [-8, -8], [[1, 1]], row_upper=5, owner=[0]
    )
    assert lcpcli.run(limited).answer.x.tolist() == [1, 4]
    shared = from_players([1, 1], [[2, 0], [0, 2]], [-8, -8], [[1, 1]], row_upper=5)
    assert lcpcli.run(shared).answer.x.tolist() == [2.5, 2.5]


def test_sparse_and_dense_matrices_give_the_same():
    sparse = pytest.importorskip("scipy.sparse")
    data = {**MARKET, "row_upper": [4, 3], "owner": [None, "Ann"], "shared": "each"}
    A = [[1, 1, 1], [1, 1, 0]]
    one = from_players(**data, A=A)
    other = from_players(**data, A=sparse.csr_array(A))
    assert np.array_equal(one.M, other.M.toarray())
    assert one.names == other.names


@pytest.mark.parametrize("shared", ["common", "each"])
def test_published_games_have_one_equilibrium(shared):
    """Two of the examples of A. Bemporad's NashOpt: costs |x_1 - (1, -1/2)|^2,
    (x_2 + 3/10)^2 and (x_3 - (x_11 + x_2) / 2)^2 with a shared row, and ten producers
    who sell at 600 less all that they sell, at costs of 10 + 5i a unit."""
    H = [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [-1, 0, -1, 2]]
    row = {"A": [[1, 0, 1, 1]], "row_upper": 2, "shared": shared}
    sides = {"lower": 0, "upper": 1}
    few = from_players([2, 1, 1], H, [-2, 1, 0.6, 0], **row, **sides)
    costs = 10 + 5 * np.arange(10)
    ones = np.ones((10, 10))
    many = from_players([1] * 10, ones + np.eye(10), costs - 600, lower=7, upper=100)
    total = Fraction(int((600 - costs).sum()), 11)
    expected = [600 - int(cost) - total for cost in costs]
    cases = (few, [1, 0, 0, Fraction(1, 2)]), (many, expected)
    for problem, x in cases:
        found = solutions(problem)
        (piece,) = list(found)
        assert found.complete
        assert piece.is_point
        assert list(piece.vertices[0][: len(x)]) == x
        answer = lcpcli.exact(problem).answer
        assert [*chain(*answer.exact["strategies"])] == x
        assert answer.gains == pytest.approx([0.0] * len(answer.gains), abs=1e-10)


WRONG = contents(
    "game.json",
    r"""
"sizes": [1, 1] => sizes: have the sum 2 and c has 3 entries; {AGREE}
"sizes": [] => sizes: {EMPTY}; give a number of unknowns for each player
"sizes": 3 => sizes: {IS:a number}; give a number of unknowns for each player
"sizes": [1, 1, 0] => sizes[2]: {IS:0}; {FROM_ONE}{FROM_0}
"sizes": [1.5, 1, 1] => sizes[0]: {IS:1.5}; {FROM_ONE}{FROM_0}
"sizes": ["a", 1, 1] => sizes[0]: {IS:the text 'a'}; {FROM_ONE}{FROM_0}
"sizes": null => sizes: {IS:null}; give its numbers
"c": [] => c: {EMPTY}; {ONE_VARIABLE}
"H": [[1, 2, 3]] => H: {SHAPE:1|3}; {SQUARE}
"sizes": [2, 1], "players": [], "H": [[2, 1, 1], [3, 2, 1], [1, 1, 2]]
    => H[0][1]: {TWO_VALUES:1|H[1][0] is 3, so that the part of player 1 is not
    symmetric}; give the gradient of its cost, with a symmetric part{FROM_0}
"H": [[-1, 1, 1], [1, 2, 1], [1, 1, 2]]
    => H: makes the cost of Ann not convex in the variables of this player; its part of
    H has to be positive semidefinite
"owner": [0] => owner: {ENTRIES:1 entry|0 rows}; {AGREE}
"owner": 3 => owner: {IS:a number}; give a player for each row
"A": [[1, 1, 1]], "b": [1], "owner": ["Dan"]
    => owner[0]: {IS:the text 'Dan'}; give a player by its name, by its number from 0 to
    2, or null
"A": [[1, 1, 1]], "b": [1], "owner": [3]
    => owner[0]: {IS:3}; give a player by its name, by its number from 0 to 2, or null
"A": [[1, 1, 1]], "b": [1], "owner": [0.5]
    => owner[0]: {IS:0.5}; give a player by its name, by its number from 0 to 2, or null
"A": [[1, 1, 1]], "b": [1], "owner": [true]
    => owner[0]: {IS:true}; give a player by its name, by its number from 0 to 2, or
    null
"shared": "some" => shared: {IS:the text 'some'}; give common or each
"shared": 3 => shared: {IS:a number}; give common or each
"players": ["Ann"] => players: {ENTRIES:1 name|3 players}; {AGREE}
"free": [0]
    => free: {NO_KEY:a game of players}; the keys are sizes, H, c, A, b, row_lower,
    row_upper, lower, upper, owner, shared, players, columns, rows, name, source, note
""",
    made=lambda keys: json.dumps(MARKET | json.loads(f"{{{keys}}}")),
)


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_what_is_wrong_is_named(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


OTHER = [[-1, 1], [1, -1]]
# Each player wants to differ from the next one.
RING = {
    "payoffs": {
        "Ann": {"Bob": OTHER},
        "Bob": {"Cid": OTHER},
        "Cid": {"Ann": [["-1/3", 1], [1, -1]]},
    },
    "players": ["Ann", "Bob", "Cid"],
    "actions": [["a", "b"], ["c", "d"], ["e", "f"]],
}


def test_a_game_of_two_players_has_the_same_equilibria_as_by_from_game():
    random = default_rng(0)
    for _ in range(4):
        A, B = random.integers(-4, 5, (2, 3, 3))
        own = solutions(from_polymatrix({(0, 1): A, (1, 0): B.T}))
        found = {vertex[:6] for piece in own for vertex in piece.vertices}
        game = solutions(lcpcli.from_game(A, B))
        assert list(game)
        extreme = game.equilibria
        assert found == {(*each.row, *each.column) for each in extreme.extreme}


def test_an_equilibrium_of_a_ring_in_fractions():
    problem = from_polymatrix(**RING)
    answer = lcpcli.exact(problem).answer.exact
    half, third = [Fraction(1, 2)] * 2, [Fraction(3, 5), Fraction(2, 5)]
    assert answer.strategies == [third, half, half]
    assert answer.gains == (0, 0, 0)
    assert answer.payoffs == (0, 0, Fraction(1, 5))
    assert lcpcli.run(problem).answer.payoffs == pytest.approx((0, 0, 0.2))
    found = lcpcli.check(problem, [p for part in answer.strategies for p in part])
    assert found.exact
    assert found.accepted


def test_the_best_equilibrium_of_a_player():
    # A battle of the sexes, while Cid watches.
    payoffs = {(0, 1): [[2, 0], [0, 1]], (1, 0): [[1, 0], [0, 2]]}
    payoffs[2, 0] = [[0, 0]]
    problem = from_polymatrix(payoffs, ["Ann", "Bob", "Cid"])
    for player, best in (("Ann", 2), ("Bob", 2), ("Cid", 0)):
        found = lcpcli.optimum(problem, f'"payoff of {player}"', sense="max")
        assert found.status == "optimal"
        assert found.value == best
    assert len(list(solutions(problem))) == 3


@pytest.mark.parametrize("seed", few_of(range(6), 3))
def test_games_in_strategic_form_that_are_sums_over_pairs_are_read(seed, tmp_path):
    """Of three or four players, with fractions: any split of the payoffs has the same
    expected ones."""
    random = default_rng(seed)
    n = int(random.integers(3, 5))
    sizes = random.integers(1, 4, n).tolist()

    def table(i, j):
        return [
            [Fraction(int(random.integers(-9, 10)), 3) for _ in range(sizes[j])]
            for _ in range(sizes[i])
        ]

    pairs = [(i, j) for i in range(n) for j in range(n) if i != j]
    payoffs = {pair: table(*pair) for pair in pairs}
    profiles = [each[::-1] for each in product(*map(range, sizes[::-1]))]
    cells = [
        str(sum(payoffs[i, j][p[i]][p[j]] for j in range(n) if j != i))
        for p in profiles
        for i in range(n)
    ]
    names = " ".join(f'"P{i}"' for i in range(n))
    head = f'NFG 1 R "a game" {{ {names} }} {{ {" ".join(map(str, sizes))} }}'
    file = tmp_path / "game.nfg"
    file.write_text(f"{head}\n{' '.join(cells)}\n")
    found = lcpcli.exact(lcpcli.read(file)).answer.exact
    given = from_polymatrix(payoffs)
    verified = lcpcli.check(given, [*chain(*found.strategies)])
    assert verified.exact
    assert verified.accepted
    assert verified.strategies.payoffs == found.payoffs


WRONG_PAYOFFS = contents(
    "game.json",
    r"""
"payoffs": null => payoffs: {IS:null}; give matrices by pairs
"payoffs": []
    => payoffs: {IS:a list}; give an object of matrices by players, and by those they
    play against
"payoffs": {} => payoffs: {EMPTY}; give a matrix for a pair of players
"payoffs": {"Ann": [[1]]}
    => payoffs[Ann]: {IS:no pair}; give two players, by name or by index
"payoffs": {"Ann": {"Dan": [[1]]}}
    => payoffs[Ann][Dan]: has no player 'Dan'; give two players, by name or by index
"payoffs": {"Ann": {"Ann": [[1]]}}
    => payoffs[Ann][Ann]: has a player against itself; give two players, by name or by
    index
"payoffs": {"Ann": {"Bob": 3}}
    => payoffs[Ann][Bob]: {IS:no matrix}; give its rows, each a list of payoffs
"payoffs": {"Ann": {"Bob": []}}
    => payoffs[Ann][Bob]: {EMPTY}; give its rows, each a list of payoffs
"payoffs": {"Ann": {"Bob": [[]]}}
    => payoffs[Ann][Bob]: {IS:no matrix}; give its rows, each a list of payoffs
"payoffs": {"Ann": {"Bob": [[1], [1, 2]]}}
    => payoffs[Ann][Bob][1]: has 2 entries and row 0 has 1; {AGREE}{FROM_0}
"payoffs": {"Ann": {"Bob": [["x"]]}}
    => payoffs[Ann][Bob][0][0]: {IS:the text 'x'}; {A_NUMBER}
"payoffs": {"Ann": {"Bob": [["inf"]]}}
    => payoffs[Ann][Bob][0][0]: {IS:the text 'inf'}; {A_NUMBER}
"payoffs": {"Ann": {"Bob": [[1e+301]]}}
    => payoffs[Ann][Bob][0][0]: {IS:too large for doubles}; {SCALE_PAYOFFS}
"payoffs": {"Ann": {"Bob": [[1]]}, "Bob": {"Ann": [[1, 2]]}}
    => payoffs[Bob][Ann]: has 2 actions of player 0, not 1; {AGREE}{FROM_0}
"payoffs": {"Ann": {"Bob": [[1]]}} => payoffs: has no pair of player 'Cid'; add one
"actions": 3 => actions: {IS:a number}; give a list of names for each player
"actions": [["a", "b"]] => actions: {ENTRIES:1 list|3 players}; {AGREE}
"actions": [["a"], ["b"], ["c"]] => actions[0]: {ENTRIES:1 name|2 actions}; {AGREE}
"players": "Ann" => players: {IS:the text 'Ann'}; {A_LIST_OF_NAMES}
"sense": "min"
    => sense: {NO_KEY:a polymatrix game}; the keys are payoffs, players, actions, name,
    source, note
""",
    made=lambda keys: json.dumps(RING | json.loads(f"{{{keys}}}")),
)


@pytest.mark.parametrize("refusal", WRONG_PAYOFFS, ids=str)
def test_what_is_wrong_with_payoffs_is_named(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


@pytest.mark.parametrize("common", [0, 10**6, 10**8, 10**12])
def test_a_common_part_of_payoffs_does_not_hide_an_equilibrium(common):
    of_ann = [[common + 1, common], [common, common + 2]]
    of_bob = [[common + 1, common], [common, common + 3]]
    game = from_polymatrix({(0, 1): of_ann, (1, 0): of_bob})
    check = lcpcli.check(game, [0.75, 0.25, 2 / 3, 1 / 3])
    assert check.accepted
    assert not any(check.strategies.gains)
    assert not lcpcli.check(game, [0.75, 0.25, 0.66, 0.34]).accepted
