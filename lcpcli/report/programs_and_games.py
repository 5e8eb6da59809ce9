"""Results in terms of the program or game from which the problem was made: a minimum,
or strategies and payoffs."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice
from typing import Any

from lcpcli.errors import count
from lcpcli.model.formulation import Answer
from lcpcli.rational.numbers import brief
from lcpcli.report import wording
from lcpcli.report.document import Table
from lcpcli.solving.minimum import Equilibrium, Minimum
from lcpcli.solving.no_minimum import Conclusion
from lcpcli.solving.result import Result

MOST_SETS = 100  # information sets in a table, or rows and variables, a few screens
MOST_ON_SCREEN = 12  # rows, and variables


def lines(result: Result, compared: bool) -> list[str]:
    """Return lines with the point, the multipliers and the objective of a program, or
    with the strategies of a game, as far as they are known, with their meaning and
    their exact parts. compared : whether they name the result."""
    answer: Any = result.answer
    if answer is None:
        return []
    if isinstance(answer, Answer):
        return [
            f"{wording.name(result)}: " * compared + text for text in answer.lines()
        ]
    origin: Any = result.problem.origin
    parts: list[str] = []
    if isinstance(answer, Equilibrium):
        if answer.row is not None:
            parts = strategies(origin, answer)
    elif answer.x is not None and answer.y is not None and answer.objective is not None:
        multipliers = (
            [f"y = {wording.named(answer.y.tolist(), origin.rows)}"]
            if answer.y.size
            else []
        )
        if answer.unique_multipliers is False:
            multipliers = [f"{own}, one of several" for own in multipliers]
        point = (
            f"{'' if result.solved else 'best '}x = "
            f"{wording.named(answer.x.tolist(), origin.columns)}"
        )
        shown = result.solved and not compared  # in the verdict
        parts = [
            point,
            *multipliers,
            *[f"objective {wording.plain_number(answer.objective)}"] * (not shown),
        ]
    texts = [", ".join(parts), answer.statement, *no_optimum(answer, origin)]
    if answer.exact:
        texts += [
            f"exact {key} = {wording.vector(part, brief)}"
            for key, part in answer.exact.items()
            if part
        ]
    return [f"{wording.name(result)}: " * compared + text for text in texts if text]


def strategies(
    game: Any, own: Any, cell: Callable[[Any], str] = wording.plain_number
) -> list[str]:
    """Return lines with the mixed strategies row and column, as vectors or by the names
    of the strategies played, and with the payoffs."""
    one, other = game.players or ("row", "column")
    row = wording.named(list(own.row), game.rows, cell, sparing=True)
    column = wording.named(list(own.column), game.columns, cell, sparing=True)
    return [
        f"{one} = {row}",
        f"{other} = {column}",
        f"payoffs {cell(own.payoffs[0])} and {cell(own.payoffs[1])}",
    ]


def tables(answer: Any, origin: Any, whole: bool = True) -> list[Table]:
    """Return a table of the rows of a program, with activities, slacks and multipliers,
    and of its variables, with the multipliers of their bounds, which are their reduced
    costs. whole : whether a program has more of them than fit on a screen."""
    if isinstance(answer, Answer):
        return answer.tables(whole=whole)
    if (
        not isinstance(answer, Minimum)
        or answer.x is None
        or answer.y is None
        or not answer.y.size
    ):
        return []
    own: Any = answer
    most, x, y = (
        MOST_SETS if whole else MOST_ON_SCREEN,
        answer.x.tolist(),
        answer.y.tolist(),
    )
    rows = wording.short_names(origin.rows or [""] * len(y), math.inf, "r")
    columns = wording.short_names(origin.columns or [""] * len(x), math.inf, "x")
    of_rows = [own.activities, own.slacks, *_multipliers(own)]
    of_columns = [answer.x, *_multipliers(own, "bound_multipliers")]
    cell = wording.plain_number
    groups = [
        [
            [name, *map(cell, numbers)]
            for name, *numbers in islice(zip(rows, *of_rows, strict=True), most)
        ],
        [
            [name, cell(value), "", *map(cell, numbers)]
            for name, value, *numbers in islice(
                zip(columns, *of_columns, strict=True), most
            )
        ],
    ]
    left_out = (
        f"the first {most} of {count(len(y), 'row')} and of "
        f"{count(len(x), 'variable')}; --format csv has all"
    )
    notes = [left_out] * (max(len(x), len(y)) > most)
    header = ["", "value", "slack", "multiplier"]
    if len(of_columns) > 2:
        header += ["falls", "rises"]
        extreme = "minimum" if origin.sense == "min" else "maximum"
        notes.append(
            "multipliers are not unique: the last columns are the derivatives of the "
            f"{extreme} as a bound falls and as it rises"
        )
    elif own.unique_multipliers is False:
        notes.append("these are one choice of several multipliers")
    return [Table(header, groups, (0,), notes=notes)]


def _multipliers(own: Minimum, name: str = "y") -> list[Any]:
    """Return the multipliers of rows, or of bounds, and where they are not unique, the
    derivatives to both sides, if they are known."""
    known = [getattr(own, name)]
    if own.unique_multipliers is False and own.y_down is not None:
        known += [getattr(own, f"{name}_down"), getattr(own, f"{name}_up")]
    return known


def no_optimum(answer: Any, origin: Any) -> list[str]:
    """Return lines on why a program has no optimum: the multipliers of the
    contradictory rows, and the ray."""
    if not isinstance(answer, (Minimum, Conclusion)):
        return []
    proofs = (
        (
            "excluded within the bounds by its rows times",
            answer.certificate,
            origin.rows,
        ),
        ("improves without limit in the direction", answer.ray, origin.columns),
    )
    known = ((what, v.tolist(), names) for what, v, names in proofs if v is not None)
    return [
        f"{what} {wording.named(v, names, wording.multiplier, sparing=True)}"
        for what, v, names in known
    ]
