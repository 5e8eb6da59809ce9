"""What to try next, as options of the command."""

from __future__ import annotations

from lcpcli.options import flag
from lcpcli.solving.answer import EXACT, Options, value_text
from lcpcli.solving.result import Result


def line(result: Result) -> str:
    """The advice of a result; "" if there is none."""
    return result.suggestions.line(_flags)


def _flags(options: Options) -> str:
    if options == EXACT:
        return "lcp solve --exact"
    return " ".join(
        flag(name) if value is True else f"{flag(name)} {value_text(value, quotes=False)}"
        for name, value in options.items()
    )
