"""The unknowns that a report shows, chosen by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from lcpcli.errors import ParameterError, likely, quoted

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem


def places(names: Sequence[str], patterns: Sequence[str]) -> list[int]:
    """Return the indices of the unknowns that `--show` chooses, in the order of the patterns; all without patterns.

    names : of the unknowns, "" for none. patterns : each is a name, in which * stands for any text and ? for a
    character, or z1, z2, ... for a place. Raises ParameterError for a pattern that no unknown matches.
    """
    if not patterns:
        return list(range(len(names)))
    found: dict[int, None] = {}
    for pattern in patterns:
        own = [i for i, name in enumerate(names) if name and _has_name(name, pattern)]
        own = own or [i for i in range(len(names)) if _fits(f"z{i + 1}", pattern)]
        if not own:
            last = f"z{len(names)}"
            numbers = f"write z1 to {last}" if len(names) > 1 else f"write {last}"
            named = "; a file has names in its header, or under the key names" if not any(names) else ""
            hint = likely(pattern, list(filter(None, names)), f"{numbers}, or a name{named}")
            raise ParameterError("show", f"{quoted(pattern)} is not the name of an unknown", hint)
        found |= dict.fromkeys(own)
    return list(found)


def _has_name(name: str, pattern: str) -> bool:
    """Return whether a pattern fits a name; a column strategy is also called as in the heading of a narrow table, and a
    multiplier as its row."""
    short = name.replace("column ", "col ", 1).removeprefix("y ")
    return pattern == name or _fits(name, pattern) or _fits(short, pattern)


def _fits(name: str, pattern: str) -> bool:
    """Return whether a pattern fits a name; brackets stand for themselves, as in x[1]."""
    return re.fullmatch(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."), name, re.DOTALL) is not None


def require(problem: Problem | NonlinearProblem, patterns: Sequence[str]) -> None:
    """Raise ParameterError, before any work, for a pattern that no unknown of the problem matches."""
    places(labels_of(problem), patterns)


def labels_of(problem: Problem | NonlinearProblem) -> Sequence[str]:
    """Return the names by which the unknowns of a problem are chosen: of a game, those of the strategies, which differ,
    and the headings of the payoffs; the names of a program's multipliers begin with y."""
    from lcpcli.model.origins import Game
    from lcpcli.model.program import Program
    from lcpcli.report import programs_and_games

    if isinstance(origin := problem.origin, Game):
        return programs_and_games.headings(origin)
    k = origin.variables if isinstance(origin, Program) else problem.n
    return [*problem.names[:k], *(f"y {name}" if name else "" for name in problem.names[k:])]
