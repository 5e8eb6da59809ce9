"""Linear expressions in the unknowns of a problem, as texts."""

from __future__ import annotations

import re
from fractions import Fraction

from lcpcli.errors import ProblemError, quoted

TERM = re.compile(
    r"\s*(?P<sign>[-+]?)\s*(?P<number>(?:[0-9]{1,300}(?:\.[0-9]{0,300}|/0*[1-9][0-9]{0,300})?|\.[0-9]{1,300})"
    r"(?:[eE][-+]?[0-9]{1,3})?(?![\w.]))?\s*\*?\s*(?P<name>\"[^\"]+\"|[^\W\d][^\s+*\"-]*)\s*"
)
HINT = 'write numbers and names with + and - between them, such as 2 z1 - 1/3 z2 + "a name with blanks"'


def coefficients(text: str) -> dict[str, Fraction]:
    """Return the coefficients of the names in a linear expression, which are added up, or raise ProblemError.

    >>> coefficients('z1 - 2.5 z3 + 1/3*"cost of Ann" + z1')
    {'z1': Fraction(2, 1), 'z3': Fraction(-5, 2), 'cost of Ann': Fraction(1, 3)}
    """
    found: dict[str, Fraction] = {}
    place = 0
    while place < len(text) or not found:
        term = TERM.match(text, place)
        if term is None or (found and not term["sign"]):
            raise ProblemError("objective", f"has {quoted(text[place:].strip())} in place of a term", HINT)
        name, place = term["name"].strip('"'), term.end()
        number = term["number"] or "1"
        whole, _, exponent = number.lower().partition("e")
        value = Fraction(whole) * Fraction(10) ** int(exponent or 0) * (-1 if term["sign"] == "-" else 1)
        found[name] = found.get(name, Fraction(0)) + value
    return found
