"""The parts of Gambit's files, https://www.gambit-project.org: their tokens, and the
payoffs of more than two players, which may be sums over pairs of players.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from itertools import product

from lcpcli.errors import ProblemError

Payoffs = tuple[Fraction, ...]  # the payoffs of all players
Profile = tuple[int, ...]  # a strategy of each player, from 0

# A text, a brace, a word, or an open quote.
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"', re.DOTALL)


def pair_payoffs(
    sizes: Sequence[int], payoffs: Sequence[Payoffs], players: Sequence[str]
) -> dict[tuple[int, int], list[list[Fraction]]]:
    """Return for each pair of players (i, j) the matrix of the payoffs of i against j;
    raise ProblemError, which names a profile, if the payoffs are no sums of these.

    sizes : the numbers of strategies. payoffs : for each profile, of which the first
        player's strategy changes fastest. players : their names.

    The matrices are not unique: a function of a player's strategy alone may be moved
    from one pair to another. All of it is put into the pair with the first other
    player.
    """
    n = len(sizes)
    profiles = [each[::-1] for each in product(*map(range, reversed(sizes)))]
    payoffs_by_profile = dict(zip(profiles, payoffs, strict=True))

    def value(i: int, deviations: dict[int, int]) -> Fraction:
        return payoffs_by_profile[tuple(deviations.get(k, 0) for k in range(n))][i]

    tables = dict[tuple[int, int], list[list[Fraction]]]()
    for i in range(n):
        for j in range(n):
            if i == j:
                continue
            is_first = j == (0 if i else 1)
            tables[i, j] = [
                [
                    value(i, {i: a, j: b}) - (0 if is_first else value(i, {i: a}))
                    for b in range(sizes[j])
                ]
                for a in range(sizes[i])
            ]
    for profile, payoffs_of_profile in payoffs_by_profile.items():
        for i in range(n):
            others = (j for j in range(n) if j != i)
            terms = (tables[i, j][profile[i]][profile[j]] for j in others)
            _require_sum(
                profile, payoffs_of_profile[i], sum(terms, Fraction(0)), players[i]
            )
    return tables


def _require_sum(profile: Profile, payoff: Fraction, total: Fraction, who: str) -> None:
    if payoff == total:
        return
    strategies = ", ".join(str(a + 1) for a in profile)
    raise ProblemError(
        "",
        f"has payoffs that are no sums over pairs of players: for the strategies "
        f"{strategies} {who} gets {payoff}, not {total}",
        "the equilibria of such a game of more than two players are not the solutions "
        "of an LCP",
    )
