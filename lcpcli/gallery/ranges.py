"""The ranges of the families' parameters."""

from __future__ import annotations

from lcpcli.errors import SHOWN, OptionError


def require(parameter: str, value: float, fits: bool, admissible: str) -> None:
    """Raise OptionError for the parameter unless its value fits; `admissible` is the range as shown to the user."""
    if not fits:
        raise OptionError(parameter, f"{str(value)[:SHOWN]} is out of range", f"it must be: {admissible}")
