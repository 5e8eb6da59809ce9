"""Games in extensive form, by lcpcli and by Gambit's lcp_solve: game_trees.py [rounds]

For each game the number of unknowns, and the least of as many rounds, 3 by default, of
the seconds that each takes in doubles and, once, in fractions, from the game in memory
to one equilibrium. lcpcli's time includes the verification, and in fractions all of the
run before. Gambit is pygambit; in fractions it is asked up to MAX_EXACT unknowns, as
the time beyond is that of minutes.
"""

from __future__ import annotations

import io
import sys
from functools import partial
from typing import Any

import pygambit
from measuring import in_turns, show

import lcpcli
from lcpcli.gallery.families import make
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.proof import prove

RANKS, MAX_EXACT = (6, 13, 20, 40), 80
BARGAINING = (50, 142, 312)


def exact(problem: lcpcli.Problem) -> Any:
    return prove(
        lambda: ExactProblem.of_decimals(problem), lcpcli.run(problem)
    ).answer.exact


def gambit(game: Any, rational: bool) -> Any:
    return pygambit.nash.lcp_solve(game, rational=rational).equilibria[0]


if __name__ == "__main__":
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    widths = (18, 6, *4 * (12,), 26, 26)
    show(
        (
            "game",
            "n",
            "lcpcli",
            "Gambit",
            "in fractions",
            "Gambit",
            "payoffs",
            "of Gambit",
        ),
        widths,
    )
    for family, n in (
        *(("poker", 12 * ranks + 4) for ranks in RANKS),
        *(("bargaining", n) for n in BARGAINING),
    ):
        problem: Any = make(family, n)
        game = pygambit.read_efg(io.StringIO(problem.origin.tree.text))
        doubles = in_turns(
            partial(lcpcli.run, problem), partial(gambit, game, False), most=rounds
        )
        calls = [
            partial(exact, problem),
            *[partial(gambit, game, True)] * (n <= MAX_EXACT),
        ]
        fractions = in_turns(*calls, most=1, warm_up=0)
        found, other = exact(problem), gambit(game, False)
        payoffs = [f"{float(value):.6g}" for value in found.payoffs]
        theirs = [f"{float(other.payoff(player)):.6g}" for player in game.players]
        least = [min(seconds) for seconds in (*doubles, *fractions)]
        show(
            (
                problem.name,
                n,
                *least,
                *["-"] * (4 - len(least)),
                ", ".join(payoffs),
                ", ".join(theirs),
            ),
            widths,
        )
