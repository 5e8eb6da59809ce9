"""Results in terms of the program or the game behind the problem, as lines and as JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from lcpcli.report import numbers, summary
from lcpcli.solving.result import Result

if TYPE_CHECKING:
    from fractions import Fraction


def lines(result: Result, compared: bool) -> list[str]:
    """The answer, its meaning, and its exact parts; nothing without an origin.

    compared : whether it is shown with other results, so that it must be named.
    """
    answer = result.answer
    if answer is None:
        return []
    proofs = no_optimum(answer, result.problem.origin)
    told = [text for text in (", ".join(_parts(result)), answer.statement, *proofs) if text]
    if answer.exact:
        from lcpcli.rational.numbers import brief

        told += [f"exact {key} = {numbers.vector(part, brief)}" for key, part in answer.exact.items() if part]
    return [f"{summary.name(result)}: " * compared + text for text in told]


def data(result: Result) -> dict[str, Any] | None:
    """The answer as a JSON object, with the kind of the origin; None without an origin."""
    answer = result.answer
    if answer is None or result.problem.origin is None:
        return None
    held = {field.name: _json(getattr(answer, field.name)) for field in fields(answer)}
    told = result.problem.origin.data()
    return {"kind": told["kind"], **held, "rows": told.get("rows"), "columns": told.get("columns")}


def _parts(result: Result) -> list[str]:
    from lcpcli.model.program import Program
    from lcpcli.solving.answer import Equilibrium, Minimum

    answer, origin = result.answer, result.problem.origin
    if isinstance(answer, Minimum) and isinstance(origin, Program):
        if answer.x is None or answer.y is None:
            return []
        multipliers = [f"y = {named(answer.y.tolist(), origin.rows)}"] if answer.y.size else []
        best = "best " * (not result.solved)
        return [
            f"{best}x = {named(answer.x.tolist(), origin.columns)}",
            *multipliers,
            f"objective {answer.objective:.7g}",
        ]
    if not isinstance(answer, Equilibrium) or answer.row is None or answer.column is None or answer.payoffs is None:
        return []
    return strategies(origin, answer.row.tolist(), answer.column.tolist(), answer.payoffs)


def strategies(
    game: Any, row: list[Any], column: list[Any], payoffs: Sequence[Any], cell: Callable[[Any], str] = "{:.7g}".format
) -> list[str]:
    """A mixed strategy of each player of a game, a vector or the names of those that are played, and their payoffs."""
    return [
        f"row = {named(row, game.rows, cell, sparing=True)}",
        f"column = {named(column, game.columns, cell, sparing=True)}",
        f"payoffs {cell(payoffs[0])} and {cell(payoffs[1])}",
    ]


def no_optimum(answer: Any, origin: Any) -> list[str]:
    """Why a program has no optimum: the multipliers of the rows that exclude each other, and the ray."""
    from lcpcli.model.program import Program
    from lcpcli.solving.answer import Minimum

    if not isinstance(answer, Minimum) or not isinstance(origin, Program):
        return []
    rows, direction = "excluded within the bounds by its rows times", "improves for ever in the direction"
    told = ((rows, answer.certificate, origin.rows), (direction, answer.ray, origin.columns))
    return [
        f"{what} {named(v.tolist(), names, numbers.multiplier, sparing=True)}"
        for what, v, names in told
        if v is not None
    ]


def named(
    values: list[Any], names: Sequence[str], cell: Callable[[Any], str] = "{:.7g}".format, sparing: bool = False
) -> str:
    """A vector, or its entries with their names, if they have any; of a sparing one only those that are not 0."""
    if not names:
        return numbers.vector(values, cell)
    named = [(name, value) for name, value in zip(names, values, strict=True) if value or not sparing]
    return numbers.vector(named, lambda each: f"{each[0]} {cell(each[1])}")


def _json(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _fractions(part) for key, part in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_json(entry) for entry in value]
    return numbers.finite(value) if isinstance(value, float) else value


def _fractions(values: Sequence[Fraction]) -> list[str]:
    from lcpcli.rational.numbers import text

    return [text(value) for value in values]
