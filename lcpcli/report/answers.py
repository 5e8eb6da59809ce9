"""Results in terms of the quadratic program or the game behind the problem, as lines and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
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
    told = [text for text in (", ".join(_parts(result)), answer.statement) if text]
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
    return {"kind": result.problem.origin.data()["kind"], **held}


def _parts(result: Result) -> list[str]:
    from lcpcli.solving.answer import Minimum

    answer, origin = result.answer, result.problem.origin
    if isinstance(answer, Minimum):
        if answer.x is None or answer.y is None:
            return []
        multipliers = [f"y = {numbers.vector(answer.y.tolist())}"] if answer.y.size else []
        return [f"x = {numbers.vector(answer.x.tolist())}", *multipliers, f"objective {answer.objective:.7g}"]
    if answer is None or answer.row is None or answer.column is None or answer.payoffs is None:
        return []
    strategies = [
        _strategy(player, probabilities.tolist(), getattr(origin, f"{player}s"))
        for player, probabilities in (("row", answer.row), ("column", answer.column))
    ]
    return [*strategies, f"payoffs {answer.payoffs[0]:.7g} and {answer.payoffs[1]:.7g}"]


def _strategy(player: str, probabilities: list[float], names: Sequence[str]) -> str:
    """A mixed strategy: a vector or, if the strategies have names, the names of those that are played."""
    if not names:
        return f"{player} = {numbers.vector(probabilities)}"
    played = [(name, p) for name, p in zip(names, probabilities, strict=True) if p > 0]
    return f"{player} = {numbers.vector(played, lambda each: f'{each[0]} {each[1]:.7g}')}"


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
