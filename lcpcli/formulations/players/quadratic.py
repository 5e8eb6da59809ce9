"""Games of N players with convex quadratic costs, linear constraints and bounds.

Without rows, or with rows that constrain one player each, their solutions are the
equilibria of J. F. Nash, Annals of Mathematics 54 (1951) 286-295; with rows that
players share, generalized equilibria: F. Facchinei, C. Kanzow, Annals of Operations
Research 175 (2010) 177-211. An equilibrium in which each shared row has one multiplier,
common to all players, is a variational equilibrium: it solves the variational
inequality of the game.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import (
    IS_EMPTY,
    MAKE_AGREE,
    ONE_VARIABLE,
    ProblemError,
    count,
    kind,
    numbers_for,
    refuse_unknown,
)
from lcpcli.files import fields as files
from lcpcli.files.formats import refuse
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import compressed, dense, is_sparse, largest_asymmetry
from lcpcli.model.arrays import FROM_0, as_square, as_vector, by_label
from lcpcli.model.block_form import BlockForm, Blocks, rows_between, size_of
from lcpcli.model.box import as_intervals
from lcpcli.model.formulation import Conditions, names_of
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import BoundLike, Matrix, VectorLike

SIDES = ("row_lower", "row_upper", "lower", "upper")
NAMES = ("players", "columns", "rows")
KEYS = ("sizes", "H", "c", "A", "b", *SIDES, "owner", "shared", *NAMES, *TEXTS)
COMMON, EACH = "common", "each"


def from_players(
    sizes: Sequence[int],
    H: Any,
    c: VectorLike,
    A: Any = None,
    b: VectorLike | None = None,
    *,
    row_lower: BoundLike = None,
    row_upper: BoundLike = None,
    lower: BoundLike = 0.0,
    upper: BoundLike = None,
    owner: Sequence[int | str | None] | None = None,
    shared: str = COMMON,
    players: Sequence[str] = (),
    columns: Sequence[str] = (),
    rows: Sequence[str] = (),
    infinity: float = math.inf,
    **texts: Any,
) -> Problem:
    """Return the conditions of an equilibrium of players each of whom minimizes its
    cost, for fixed decisions of the others.

    sizes : how many unknowns each player has; they follow each other in x.
    H, c : shapes (k, k) and (k,). The rows of a player are the gradient of its cost:
        that of player i is x_i'H_ii x_i / 2 + (c_i + sum of H_ij x_j over the others
        j)'x_i, where H_ii has to be symmetric and positive semidefinite.
    A, b, row_lower, row_upper, lower, upper, infinity : constraints row_lower <= Ax <=
        row_upper and lower <= x <= upper, as in `from_qp`.
    owner : for each row its player, by index or name, whose constraint alone it is; or
        None, as by default, for a constraint that all players share.
    shared : "common" for equilibria in which a shared row has the same multiplier for
        all players (variational equilibria), "each" for those with a multiplier for
        each player.
    players, columns, rows : optional names of the players, the unknowns and the rows.
    texts : name, source and note of the problem.

    The unknowns are z = (x, y, s), as in `from_qp`. `Result.answer` has what each
    player does, its cost, and what it would gain by a best response, which is computed
    by itself. Raises ProblemError, which names the field at fault.

    >>> import lcpcli
    >>> cournot = lcpcli.from_players([1, 1], [[2, 1], [1, 2]], [-9, -9])
    >>> answer = lcpcli.run(cournot).answer
    >>> answer.x.tolist(), answer.costs, answer.gains
    ([3.0, 3.0], (-9.0, -9.0), (0.0, 0.0))
    """
    b, row_lower, row_upper = by_label(
        A, "the rows of A", b=b, row_lower=row_lower, row_upper=row_upper
    )
    of = "the columns of H"
    (A,) = by_label(H, of, "columns", A=A)
    H, c, lower, upper = by_label(H, of, H=H, c=c, lower=lower, upper=upper)
    vector, numbers = as_vector("c", c), _sizes(sizes)
    if not (k := vector.size):
        raise ProblemError("c", IS_EMPTY, ONE_VARIABLE)
    if sum(numbers) != k:
        reason = f"have the sum {sum(numbers)} and c has {count(k, 'entry')}"
        raise ProblemError("sizes", reason, MAKE_AGREE)
    matrix, _ = as_square("H", H, k, "c")
    bounds = as_intervals(("lower", "upper"), lower, upper, k, "variable", infinity)
    A, sides = rows_between(A, k, b, row_lower, row_upper, infinity)
    m = A.shape[0]
    if shared not in (COMMON, EACH):
        raise ProblemError("shared", f"is {kind(shared)}", f"give {COMMON} or {EACH}")
    called = names_of("players", players, len(numbers), "player")
    game = Players(
        k,
        rows=names_of("rows", rows, m, "row"),
        columns=names_of("columns", columns, k, "variable"),
        sizes=numbers,
        owner=_owners(owner, m, called, len(numbers)),
        shared=shared,
        players=called,
    )
    game.require_convex(matrix)
    if is_sparse(A) or is_sparse(matrix):
        matrix, A = compressed(matrix), compressed(A)
    once = Blocks(matrix, vector, A, *sides, *bounds)
    blocks = once.with_rows([i for i, _ in game.copies])
    game = replace(game, ranges=int(blocks.ranges.sum()))
    M, q, low, high = game.conditions(blocks)
    # `Problem` would check that the game fits the conditions, which were made from it.
    return Problem(M, q, lower=low, upper=high, **texts).having(origin=game)


def _sizes(raw_sizes: Any) -> tuple[int, ...]:
    if not isinstance(raw_sizes, (list, tuple, np.ndarray)) or not len(raw_sizes):
        reason = IS_EMPTY if hasattr(raw_sizes, "__len__") else f"is {kind(raw_sizes)}"
        raise ProblemError("sizes", reason, "give a number of unknowns for each player")
    for i, size in enumerate(raw_sizes):
        if isinstance(size, bool) or not isinstance(size, (int, float, np.integer)):
            raise ProblemError(f"sizes[{i}]", f"is {kind(size)}", WHOLE)
        if not (size >= 1 and size % 1 == 0):
            raise ProblemError(f"sizes[{i}]", f"is {size:g}", WHOLE)
    return tuple(map(int, raw_sizes))


WHOLE = f"give an integer from 1 {FROM_0}"


def _owners(
    raw_owners: Any, m: int, players: Sequence[str], n: int
) -> tuple[int | None, ...]:
    """Return for each row the index of its player, counted from 0, or None if it is
    shared.
    """
    if raw_owners is None:
        return (None,) * m
    if not isinstance(raw_owners, (list, tuple)):
        raise ProblemError(
            "owner", f"is {kind(raw_owners)}", "give a player for each row"
        )
    if len(raw_owners) != m:
        raise ProblemError(
            "owner", numbers_for(len(raw_owners), "entry", m, "row"), MAKE_AGREE
        )
    owners = list[int | None]()
    for i, name in enumerate(raw_owners):
        index = players.index(name) if name in players else name
        is_number = isinstance(index, (int, float)) and not isinstance(index, bool)
        if index is not None and not (is_number and index % 1 == 0 and 0 <= index < n):
            shown = f"{name:g}" if is_number else kind(name)
            hint = (
                f"give a player by its name, by its number from 0 to {n - 1}, or null"
            )
            raise ProblemError(f"owner[{i}]", f"is {shown}", hint)
        owners.append(None if index is None else int(index))
    return tuple(owners)


@dataclass(frozen=True)
class Players(BlockForm):
    """The game, in the form of `Blocks` with H and c. A row that has several
    multipliers occurs once for each of them. The multiplier of a row that belongs to
    one player appears only in the conditions of that player.

    rows : the names of the rows before they are repeated.
    sizes, owner, shared, players : as in `from_players`.
    """

    variables: int
    ranges: int = 0
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    sizes: tuple[int, ...] = ()
    owner: tuple[int | None, ...] = ()
    shared: str = COMMON
    players: tuple[str, ...] = ()

    kind = "players"
    form = "written as the conditions of the game,"
    left_out = ("players",)
    inverse = "answers"

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        files.refuse_unknown("", fields, KEYS, "a game of players")
        for key in ("sizes", "H", "c"):
            refuse(fields[key] is None, key, "is null", "give its numbers")
        return from_players(**files.without_nulls(fields))

    def fields(self, problem: Problem, *, in_text: bool) -> dict[str, Any] | None:
        blocks = self.blocks(conditions_of(problem))
        if blocks is None or not in_text:
            return None
        numbers = [i for i, _ in self.copies]
        first = [numbers.index(i) for i in range(len(self.owner))]
        once = blocks.with_rows(first)
        data = {key: value for key, value in self.data().items() if key in KEYS}
        return self.fields_of(once, "H", "c") | data

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Players:
        valid_keys = ("kind", "ranges", "sizes", "owner", "shared", *NAMES)
        refuse_unknown("", data, valid_keys)
        sizes = _sizes(data.get("sizes"))
        players, columns, rows = (names_of(key, data.get(key, ())) for key in NAMES)
        raw_owners = data.get("owner", ())
        owner = _owners(raw_owners, len(raw_owners), players, len(sizes))
        shared = str(data.get("shared", COMMON))
        k, ranges = sum(sizes), size_of(data, "ranges", 0)
        return cls(k, ranges, rows, columns, sizes, owner, shared, players)

    def data(self) -> dict[str, Any]:
        fields = {
            "kind": self.kind,
            "sizes": list(self.sizes),
            "ranges": self.ranges,
            "owner": list(self.owner),
            "shared": self.shared if self.shared != COMMON else "",
        }
        names = {key: list(getattr(self, key)) for key in NAMES}
        return {key: value for key, value in (fields | names).items() if value}

    @cached_property
    def copies(self) -> list[tuple[int, int | None]]:
        """Return for each multiplier the index of its row and the player in whose
        conditions it appears, or None for all players.
        """
        copies = list[tuple[int, int | None]]()
        for i, player in enumerate(self.owner):
            is_for_each = player is None and self.shared == EACH
            whose = range(len(self.sizes)) if is_for_each else [player]
            copies += [(i, each) for each in whose]
        return copies

    @property
    def names_of_rows(self) -> Sequence[str]:
        if len(self.copies) == len(self.owner):
            return self.rows
        each = self.names_of_players()
        copies = self.copies if self.rows else []
        return [
            self.rows[i] if player is None else f"{self.rows[i]} for {each[player]}"
            for i, player in copies
        ]

    def names_of_players(self) -> list[str]:
        numbers = range(1, len(self.sizes) + 1)
        return list(self.players) or [f"player {number}" for number in numbers]

    def parts_of_players(self) -> list[slice]:
        """Return the slice of x that belongs to each player."""
        stops = np.cumsum(self.sizes).tolist()
        pairs = zip(stops, self.sizes, strict=True)
        return [slice(stop - size, stop) for stop, size in pairs]

    def conditions(self, blocks: Blocks) -> Conditions:
        """Return the conditions of all players: those of the blocks, in which the
        multipliers of a player's rows are removed from the conditions of other players.
        """
        made = blocks.conditions()
        k, players = self.variables, np.repeat(np.arange(len(self.sizes)), self.sizes)
        owners = np.array(
            [-1 if owner is None else owner for _, owner in self.copies], int
        )
        if (owners < 0).all():
            return made
        is_foreign = (owners >= 0) & (players[:, np.newaxis] != owners)
        if not is_sparse(made.M):
            made.M[:k, k : k + owners.size][is_foreign] = 0.0
            return made
        with imports:
            from lcpcli.linalg.compressed_rows import of_entries
        coo = made.M.tocoo()
        above = (coo.row < k) & (coo.col >= k) & (coo.col < k + owners.size)
        is_kept = np.ones(coo.data.size, dtype=bool)
        is_kept[above] = ~is_foreign[coo.row[above], coo.col[above] - k]
        entries = (coo.row[is_kept], coo.col[is_kept], coo.data[is_kept])
        return made._replace(M=of_entries(made.M.shape, *([each] for each in entries)))

    def require_convex(self, H: Matrix) -> None:
        """Raise ProblemError for the first player whose cost is not a convex function
        of that player's unknowns."""
        with imports:
            from lcpcli.inspection.classes import definiteness
            from lcpcli.inspection.verdict import NO
        for name, part in zip(
            self.names_of_players(), self.parts_of_players(), strict=True
        ):
            block = dense(H[part, part])
            size, i, j = largest_asymmetry(block)
            if size > part.stop * EPS * float(np.abs(block).max()):
                one, other = i + part.start, j + part.start
                reason = (
                    f"is {block[i, j]:.15g} and H[{other}][{one}] is "
                    f"{block[j, i]:.15g}, so that the part of {name} is not symmetric"
                )
                hint = "give the gradient of its cost, with a symmetric part"
                raise ProblemError(f"H[{one}][{other}]", reason, f"{hint} {FROM_0}")
            if definiteness(block).semidefinite == NO:
                reason = (
                    f"makes the cost of {name} not convex in the variables of this "
                    "player"
                )
                hint = "its part of H has to be positive semidefinite"
                raise ProblemError("H", reason, hint)

    def meaning(self, data: Any) -> Any:
        return self.sibling("answers").Costs(data, self, self.names_of_players())
