"""What to try next after a result: options for another run, as written in Python or on the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias

Options: TypeAlias = Mapping[str, Any]  # names as in Python

EXPONENT_FROM = 1e6  # from here on a number is written with an exponent, as its digits are hard to count
NOTHING: Options = {}
EXACT: Options = {"exact": True}  # a proof in rational arithmetic


class Suggestions(NamedTuple):
    """Options to be added to those of a run, or to replace them.

    ways : what to try, the surest first; empty if nothing is known to help, or nothing is needed.
    more : options that each of the ways needs in addition. others : what else to try, in words.
    """

    ways: tuple[Options, ...] = ()
    more: Options = NOTHING
    others: tuple[str, ...] = ()

    def line(self, written: Callable[[Options], str]) -> str:
        """Return one line of advice, with options as `written` writes them; "" if there is nothing to suggest."""
        if not self.ways and not self.others:
            return ""
        found = ", or ".join([*map(written, self.ways), *self.others])
        return f"try {found}{f', with {written(self.more)}' if self.more else ''}"


NO_SUGGESTIONS = Suggestions()


def in_python(options: Options) -> str:
    """Return options as keywords, or the function that proves a result."""
    if options == EXACT:
        return "lcpcli.exact(problem)"
    return ", ".join(f"{name}={value_text(value, quotes=True)}" for name, value in options.items())


def value_text(value: Any, quotes: bool) -> str:
    """Return a value as it is written in Python, or on the command line, where words have no quotes."""
    if isinstance(value, str):
        return f'"{value}"' if quotes else value
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if 1 <= value < EXPONENT_FROM else f"{value:.0e}"
