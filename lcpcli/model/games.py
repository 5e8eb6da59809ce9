"""Games of two players, in strategic and in extensive form, as complementarity problems.

Equations, and the free variables to which they belong in a mixed complementarity problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError, quoted
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.labels import payoffs_by_label, texts
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector


def from_game(
    A: Any,
    B: Any = None,
    *,
    rows: Sequence[str] = (),
    columns: Sequence[str] = (),
    players: Sequence[str] = (),
    sense: str = "max",
    name: str = "",
    source: str = "",
    note: str = "",
) -> Problem:
    """Return the LCP whose solutions are the equilibria of a game in which both players maximize, or minimize.

    A, B : payoffs of the row and column player, both of shape (m, k); lists may also contain fractions like "1/3".
    rows, columns : optional names of the strategies; by default the labels of A, if these are texts.
    players : optional names of the row and the column player.
    sense : "min" if A and B are costs, whose negatives are then the payoffs.

    The unknowns are z = (x, y); x and y, each divided by its sum, are the strategies, to which `Result.answer` maps z
    back. A cost is the largest payoff plus the range of the payoffs, minus the payoff, so that all costs lie within a
    factor of two. Payoffs are taken as their shortest decimals, fractions as they are. Raises ProblemError, which names
    the field at fault.

    >>> import lcpcli
    >>> answer = lcpcli.run(lcpcli.from_game([[3, 0], [0, 2]], [[0, 2], [3, 0]]), "auto").answer
    >>> answer.row.round(6).tolist(), answer.column.round(6).tolist()
    ([0.6, 0.4], [0.4, 0.6])
    """
    if B is None:
        raise ProblemError("B", "is missing", "give the payoffs of the column player; in a zero-sum game B = -A")
    if hasattr(A, "columns"):
        B = payoffs_by_label(A, B)
        rows, columns = rows or texts(A.index), columns or texts(A.columns)
    game = Game.of(A, B, rows, columns, players)
    if sense == "min":
        game = game.negated()
    elif sense != "max":
        raise ProblemError("sense", f"is {quoted(str(sense))}", 'give "max" for payoffs or "min" for costs')
    return Problem(*game.conditions(), name=name, source=source, note=note, origin=game)


def from_efg(text: str, *, name: str = "", source: str = "", note: str = "") -> Problem:
    """Return the mixed problem whose solutions are the equilibria of a game tree of two players with perfect recall.

    text : the game in the format of Gambit's .efg files; `lcpcli.read` takes such a file.
    name : by default the title of the game. source, note : further texts of the problem.

    The unknowns are the realization plans of both players and their costs, as in `ExtensiveGame`; `Result.answer` maps
    them back to probabilities of actions at information sets. Raises ProblemError, which names the line at fault.

    >>> import lcpcli
    >>> entry = '''EFG 2 R "entry" { "entrant" "incumbent" }
    ... p "" 1 1 "" { "in" "out" } 0
    ... p "" 2 1 "" { "fight" "share" } 0
    ... t "" 1 "" { -1 -1 }
    ... t "" 2 "" { 1 1 }
    ... t "" 3 "" { 0 2 }'''
    >>> answer = lcpcli.run(lcpcli.from_efg(entry)).answer
    >>> answer.payoffs
    (1.0, 1.0)
    """
    game = ExtensiveGame.of(text)
    M, q, lower, upper = game.conditions()
    problem = Problem(M, q, name=name or game.tree.title, source=source, note=note, lower=lower, upper=upper)
    return problem.knowing(origin=game)  # `Problem` would check whether it fits, but it has just made them


LEAST = 2.0**-500  # stands for entries that happen to be 0, or are undefined


def paired(n: int, rows: Indices, columns: Indices, values: Vector) -> Indices:
    """Return for each of n free variables its equation: as many pairs as possible at entries of the Jacobian, of which
    the product is as large as possible, relative to the largest entries of the rows; what is left is paired in order.

    rows, columns, values : the entries. Every pairing has the same solutions, as an equation has to hold whatever its
    variable is; entries on the diagonal help the methods. (I. S. Duff and J. Koster, On algorithms for permuting large
    entries to the diagonal of a sparse matrix, 2001.)
    """
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    # Integers, as with rounding errors in the costs the matching may not end.
    sizes = np.rint(np.log2(np.clip(np.nan_to_num(np.abs(values), nan=LEAST), LEAST, 1 / LEAST)))
    largest = np.full(n, np.log2(LEAST))
    np.maximum.at(largest, rows, sizes)
    costs = 1.0 + largest[rows] - sizes
    own = np.arange(n)
    unpaired = n * (1.0 + costs.max(initial=0.0))  # of a row, and of a column, without a partner
    i = np.concatenate([rows, own, n + own, n + columns])
    j = np.concatenate([columns, n + own, own, n + rows])
    weights = np.concatenate([costs, np.full(2 * n, unpaired), np.ones(len(rows))])
    _, found = min_weight_full_bipartite_matching(csr_array((weights, (i, j)), shape=(2 * n, 2 * n)))
    equations = np.full(n, -1)
    is_paired = found[:n] < n
    equations[found[:n][is_paired]] = own[is_paired]
    equations[equations < 0] = own[~is_paired]
    return equations
