"""Numbers typed on the command line in place of the name of a file: 1,0,15/29 or "1 0 2.5" or "[1, 0]"."""

from __future__ import annotations

import os
import re

from lcpcli.errors import ProblemError, quoted
from lcpcli.model.arrays import as_vector
from lcpcli.rational.numbers import ratio, rounded
from lcpcli.typing import Vector

NUMBER = r"(?:[-+.eE/]*\d[-+\d.eE/]*|[-+]?inf|nan)"
PARTING = r"(?:\s*[,;]\s*|\s+)"
LIST = re.compile(rf"\s*\[?\s*{NUMBER}(?:{PARTING}{NUMBER})*\s*\]?\s*")


def numbers(text: str) -> list[str] | None:
    """The numbers in a text, each as typed; None if it is not a list of numbers, or a file has that name."""
    return None if not LIST.fullmatch(text) or os.path.lexists(text) else re.findall(NUMBER, text)


def vector(field: str, typed: list[str], n: int) -> Vector:
    """Typed numbers, fractions allowed, as a vector of length n, or a ProblemError for the field."""
    return as_vector(field, [_value(field, number) for number in typed], n)


def _value(field: str, number: str) -> float:
    try:
        return float(rounded([ratio(number)])[0]) if "/" in number else float(number)
    except ProblemError as error:
        raise error.inside(field) from None
    except ValueError:
        raise ProblemError(field, f"has {quoted(number)}, not a number", "write 1,-2,0.5") from None
