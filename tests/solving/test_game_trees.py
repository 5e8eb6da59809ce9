"""Games in extensive form, and games with payoffs far larger than all that are reached:
equilibria against all pure strategies, and strategies that are given to be checked.
"""

from fractions import Fraction
from functools import cache
from itertools import product
from math import prod
from random import Random

import numpy as np
import pytest

import lcpcli
from lcpcli import from_efg, run
from lcpcli.formulations.game_tree import tree
from lcpcli.formulations.game_tree.behavior import (
    Behavior,
    plan_of,
    point_of,
    strategy_of,
)
from lcpcli.formulations.game_tree.game import ExtensiveGame
from lcpcli.formulations.game_tree.tree import CHANCE
from lcpcli.gallery.families import make
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.proof import prove


class Maker:
    """A random tree. Nodes of a player behind the same own move, with as many actions,
    may share an information set."""

    def __init__(self, seed, depth, payoff):
        self.random, self.outcomes, self.events, self.payoff = (
            Random(seed),
            0,
            0,
            payoff,
        )
        self.sets: dict[tuple[int, tuple[int, int], int], list[int]] = {}
        self.numbers = {1: 0, 2: 0}
        self.lines = [
            f'EFG 2 R "tree {seed}" {{ "one" "two" }} "a comment, with {{ braces }}"'
        ]
        self.node(depth, {1: (0, 0), 2: (0, 0)})

    def node(self, depth, last):
        kind = self.random.choice("cpppp") if depth else "t"
        moves = self.random.randint(1 if depth < 4 else 2, 3)
        if kind == "t" or (depth < 3 and self.random.random() < 0.3):
            self.lines.append(f't "" {self.outcome()}')
            return
        if kind == "c":
            self.events += 1
            weights = [self.random.randint(0, 4) for _ in range(moves)]
            weights[0] += 1
            listed = " ".join(
                f'"" {Fraction(weight, sum(weights))}' for weight in weights
            )
            self.lines.append(f'c "" {self.events} "" {{ {listed} }} 0')
            for _ in range(moves):
                self.node(depth - 1, last)
            return
        player = self.random.choice((1, 2))
        known = self.sets.setdefault((player, last[player], moves), [])
        number = self.random.choice([*known, 0])
        described = ""
        if not number:
            self.numbers[player] += 1
            number = self.numbers[player]
            known.append(number)
            described = '"" { ' + " ".join(f'"{k}"' for k in range(moves)) + " } "
        extra = self.outcome() if self.random.random() < 0.2 else "0"
        self.lines.append(f'p "" {player} {number} {described}{extra}')
        for move in range(1, moves + 1):
            self.node(depth - 1, {**last, player: (number, move)})

    def outcome(self):
        self.outcomes += 1
        return (
            f'{self.outcomes} "" {{ {self.payoff(self.random)}, '
            f"{self.payoff(self.random)} }}"
        )


def small_fraction(random):
    return Fraction(random.randint(-6, 6), random.choice((1, 1, 2, 3)))


def tree_of(seed, depth=4, payoff=small_fraction):
    return from_efg("\n".join(Maker(seed, depth, payoff).lines))


def chances(tree, strategies):
    """The probabilities of all nodes, one by one from the root, without plans or
    sequences."""
    reach = [Fraction(1)]
    for node in tree.nodes[1:]:
        above = tree.nodes[node.parent]
        odds = (
            tree.events[above.where].probabilities
            if above.owner == CHANCE
            else strategies[above.owner][above.where]
        )
        reach.append(reach[node.parent] * odds[node.move])
    return reach


def payoffs(tree, strategies):
    ends = [
        (chance, node)
        for chance, node in zip(chances(tree, strategies), tree.nodes, strict=True)
        if node.owner < -1
    ]
    return [
        sum((chance * node.payoffs[i] for chance, node in ends), Fraction(0))
        for i in (0, 1)
    ]


def pure_strategies(tree, player):
    sizes = [len(own.actions) for own in tree.players[player].sets]
    for moves in product(*map(range, sizes)):
        yield [
            [Fraction(k == move) for k in range(size)]
            for size, move in zip(sizes, moves, strict=True)
        ]


def gains(tree, strategies):
    """What each player would gain by the best of all its pure strategies."""
    now = payoffs(tree, strategies)
    one = max(
        payoffs(tree, (pure, strategies[1]))[0] for pure in pure_strategies(tree, 0)
    )
    two = max(
        payoffs(tree, (strategies[0], pure))[1] for pure in pure_strategies(tree, 1)
    )
    return [one - now[0], two - now[1]]


MAX_PURE = 200  # strategies of a player that are tried one after another

ENTRY = """EFG 2 R "entry" { "entrant" "incumbent" }
p "" 1 1 "" { "in" "out" } 0
p "" 2 1 "" { "fight" "share" } 0
t "" 1 "" { -1 -1 }
t "" 2 "" { 1 1 }
t "" 3 "" { 0 2 }
"""
# Kuhn's poker has the value -1/18: H. W. Kuhn, A simplified two-person poker (1950)
KUHN = Fraction(-1, 18)


def game_of(problem):
    assert isinstance(problem.origin, ExtensiveGame)
    return problem.origin


def exactly(problem):
    return prove(lambda: ExactProblem.of_decimals(problem), run(problem))


@cache
def small_games():
    """Random trees whose pure strategies can all be tried."""
    numbers = (
        (
            each,
            [
                prod(len(own.actions) for own in player.sets)
                for player in game_of(each).tree.players
            ],
        )
        for each in map(tree_of, range(20))
    )
    return [problem for problem, pure in numbers if max(pure) <= MAX_PURE]


def test_no_pure_strategy_gains_in_an_equilibrium_in_fractions():
    problems = small_games()
    assert len(problems) > 10
    for problem in problems:
        found, tree = exactly(problem).answer.exact, game_of(problem).tree
        strategies = [
            strategy_of(player, plan)
            for player, plan in zip(tree.players, found.plans, strict=True)
        ]
        assert gains(tree, strategies) == list(found.gains) == [0, 0]
        assert list(found.payoffs) == payoffs(tree, strategies)
        z = point_of(game_of(problem), *found.plans)
        assert ExactProblem.of_decimals(problem).is_solution(z), (
            "also for those who propose strategies alone"
        )
        assert run(problem, "lemke").solved, "as its theorem says"


def test_best_responses_on_the_tree_are_the_best_of_all_pure_strategies():
    random, gainers = Random(0), 0
    for problem in small_games():
        tree = game_of(problem).tree
        strategies = [
            [_mixture(random, len(own.actions)) for own in each.sets]
            for each in tree.players
        ]
        own = Behavior.of(game_of(problem), strategies)
        assert list(own.gains) == gains(tree, strategies)
        assert list(own.payoffs) == payoffs(tree, strategies)
        reached = [[Fraction(0)] * len(player.sets) for player in tree.players]
        for chance, node in zip(chances(tree, strategies), tree.nodes, strict=True):
            if node.owner in (0, 1):
                reached[node.owner][node.where] += chance
        assert [each.reached for each in own.information_sets] == [
            *reached[0],
            *reached[1],
        ]
        gainers += any(own.gains)
        plans = zip(tree.players, own.plans, strict=True)
        assert all(
            plan_of(player, strategy_of(player, plan)) == plan for player, plan in plans
        )
    assert gainers > 6


def _mixture(random, size):
    weights = [random.randint(0, 3) for _ in range(size)]
    weights[random.randrange(size)] += 1
    return [Fraction(weight, sum(weights)) for weight in weights]


TREES = [
    ("poker", 40, 0),
    ("poker", 76, 0),
    ("poker", 244, 3),
    ("bargaining", 142, 0),
]


@pytest.mark.parametrize(("family", "n", "seed"), TREES)
def test_games_of_the_gallery_are_solved_in_fractions_and_kuhns_poker_has_its_value(
    family, n, seed
):
    """Without perturbations, two of them have degenerate equilibria."""
    problem = make(family, n, seed, **({"perturbation": 0} if n < 100 else {}))
    assert (problem.M + problem.M.T).min() >= 0  # so that M is copositive
    answer = exactly(problem).answer
    one, two = answer.exact.payoffs
    assert problem.n == n
    assert tuple(answer.exact.gains) == (0, 0)
    assert one == KUHN or n != 40
    assert one == -two or n > 100
    assert answer.statement.startswith("an equilibrium")
    assert np.allclose(answer.payoffs, [float(one), float(two)])


def test_an_unsolved_game_has_no_strategies():
    result = run(from_efg(ENTRY), "shi", max_iterations=1)
    assert not result.solved
    assert result.answer.information_sets is None
    assert result.answer.payoffs is None


def test_strategies_at_sets_that_their_player_excludes_are_probabilities():
    """A player who stays out has a strategy for later, each action with the same
    probability."""
    game = """EFG 2 R "out" { "A" "B" }
p "" 1 1 "" { "out" "in" } 0
t "" 1 "" { 2, 2 }
p "" 1 2 "later" { "l" "r" } 0
t "" 2 "" { 0, 0 }
p "" 2 1 "" { "a" "b" } 0
t "" 3 "" { 1, 0 }
t "" 4 "" { 0, 3 }
"""
    sets = run(from_efg(game)).answer.information_sets
    found = [(each.label, each.probabilities, each.reached) for each in sets[:2]]
    assert found == [("1", [1.0, 0.0], 1.0), ("later", [0.5, 0.5], 0.0)]


FORBIDDEN = """EFG 2 R "forbidden move" { "Ann" "Bob" }
p "" 1 1 "first" { "go" "forbidden" } 0
p "" 2 1 "second" { "x" "y" } 0
t "" 1 "" { 1 -3 }
t "" 2 "" { -3 -1 }
t "" 3 "" { -1e15 -1e15 }"""


def with_penalties(random):
    """A small integer, or a penalty."""
    return Fraction(
        -(10 ** random.randint(8, 17))
        if random.random() < 0.2
        else random.randint(-3, 4)
    )


def shares(probabilities):
    exact = list(map(Fraction, map(float, probabilities)))
    return [value / sum(exact) for value in exact]


def gains_little(gains, reached):
    return all(
        gain <= (1 + size) / 10**6 for gain, size in zip(gains, reached, strict=True)
    )


def test_solved_trees_are_equilibria_by_fractions_and_check_agrees():
    for seed in range(12):
        problem = tree_of(seed, 3, with_penalties)
        result = run(problem)
        assert result.solved == lcpcli.check(problem, result.z).accepted
        assert result.solved or problem.n > 20
        if result.solved:
            tree = problem.origin.tree
            own = [[], []]
            for each in result.answer.information_sets:
                own[tree.names().index(each.player)].append(shares(each.probabilities))
            assert gains_little(gains(tree, own), list(map(abs, payoffs(tree, own))))


def test_a_method_by_name_is_stalled_there_and_check_refuses_its_z():
    result = run(from_efg(FORBIDDEN), "lemke")
    assert result.status.word == "stalled"
    assert result.message.endswith("by a best response Ann would gain 0, Bob 2")
    checked = lcpcli.check(result.problem, result.z)
    assert not checked.accepted
    assert "but as strategies, not an equilibrium" in checked.message


@pytest.mark.parametrize("constant", [0, 10**9])
def test_what_a_gain_is_compared_with_is_the_same_if_all_payoffs_rise(constant):
    lines = [
        'EFG 2 R "choice" { "Ann" "Bob" }',
        'p "" 1 1 "" { "worse" "better" } 0',
        *(f't "" {gain + 1} "" {{ {constant + gain}, 0 }}' for gain in (0, 1)),
    ]
    game = game_of(from_efg("\n".join(lines)))
    for share, are_best in ((0.0, True), (1e-3, False)):
        behavior = Behavior.of(game, [[[share, 1.0 - share]], []])
        assert behavior.are_best(game, 1e-10) == are_best


@pytest.mark.parametrize("payoffs", ["1, 2", "-3, 1/3"])
def test_strategies_are_checked_in_a_game_without_moves(payoffs):
    game = [
        'EFG 2 R "chance" { "A" "B" }',
        'c "" 1 "" { "x" 1/3 "y" 2/3 } 0',
        't "" 1 "" { 1, 2 }',
    ]
    checked = lcpcli.check(
        from_efg("\n".join([*game, f't "" 2 "" {{ {payoffs} }}'])), []
    )
    assert checked.accepted
    assert checked.message.startswith("the strategies are an equilibrium")


def test_a_payoff_that_all_plays_have_is_that_of_the_game_whatever_the_chances():
    """Also where the chances have no common denominator of a moderate length."""
    lines = [
        'EFG 2 R "one payoff" { "A" "B" }',
        'p "" 1 1 "" { "left" "right" } 0',
    ]
    for number, base in enumerate((3**2000, 5**1400), 1):
        lines += [
            f'c "" {number} "" {{ "x" 1/{base} "y" {base - 1}/{base} }} 0',
            f't "" {number} "" {{ 1, 2 }}',
            f't "" {number} "" {{ 1, 2 }}',
        ]
    assert run(from_efg("\n".join(lines))).answer.payoffs == pytest.approx((1, 2))


@pytest.mark.parametrize(
    "number",
    ["+12.", "-.5", "003.250", "-1963/1000", "-1.5e-3"],
)
def test_payoffs_are_the_numbers_as_written(number):
    lines = 'EFG 2 R "" { "one" "two" }', f't "" 1 "" {{ {number}, 1 }}'
    nodes = tree.tree_in("\n".join(lines)).nodes
    assert nodes[0].payoffs == (Fraction(number), 1)


def test_words_of_a_game_tree_that_come_again_are_read_once(monkeypatch):
    read = []
    fraction = tree._fraction

    def counted(number):
        read.append(number)
        return fraction(number)

    monkeypatch.setattr(tree, "_fraction", counted)
    lines = ['EFG 2 R "repeated" { "one" "two" }', 'p "" 1 1 "" { "a" "b" "c" } 0']
    for k in range(3):
        lines.append('p "" 2 1 "" { "left \\"{" "right}" } 0')
        lines += [f't "" {2 * k + j + 1} "" {{ 1/3, {j}.5 }}' for j in range(2)]
    problem = from_efg("\n".join(lines))
    assert sorted(read) == ["0.5", "1.5", "1/3"]
    assert problem.n == 4 + 3 + 2 + 2
    assert run(problem).solved
