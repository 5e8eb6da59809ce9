"""What to try after a run that did not solve its problem, as options of `solve` and of the command."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

Options: TypeAlias = Mapping[str, Any]  # names as in Python

LARGE = 1e6  # from here on a number is written with an exponent
EXACT: Options = {"exact": True}  # a proof in rational arithmetic


@dataclass(frozen=True)
class Suggestions:
    """Options to add to those of a run, or to replace those it has.

    ways : what to try, the surest first; none if nothing is known to help, or nothing is needed.
    more : what each of them needs in addition.
    """

    ways: tuple[Options, ...] = ()
    more: Options = field(default_factory=dict)

    def line(self, written: Callable[[Options], str]) -> str:
        """One line of advice in which options are written that way; "" if there is nothing to suggest."""
        if not self.ways:
            return ""
        return f"try {', or '.join(map(written, self.ways))}{f', with {written(self.more)}' if self.more else ''}"


NONE = Suggestions()


def in_python(options: Options) -> str:
    """Options as keywords, or the function for a proof."""
    if options == EXACT:
        return "lcpcli.exact(problem)"
    return ", ".join(f"{name}={value_text(value, quotes=True)}" for name, value in options.items())


def value_text(value: Any, quotes: bool) -> str:
    """A value as it is written in Python, or on the command line, where words have no quotes."""
    if isinstance(value, str):
        return f'"{value}"' if quotes else value
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if 1 <= value < LARGE else f"{value:.0e}"
