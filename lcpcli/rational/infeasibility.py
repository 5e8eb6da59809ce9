"""Whether some z within the bounds has w with the signs that they ask for, decided in exact arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from lcpcli.rational.choices import BASIC, STATES, UPPER, Unknowns
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.sums import whole_multiple


def farkas_vector(data: ExactProblem, check: Callable[[], None]) -> list[Fraction] | None:
    """The y of `data.refuted_by`, of integers without a common divisor; None if there is such a z, and so no y.

    If there is none, a sign that is asked for is violated wherever all earlier ones are kept, by a row of a dictionary:
    y consists of its coefficients. `check` is called before each pivot and may raise.
    """
    unknowns, n = Unknowns(data, check), data.n
    kept = [k for k in range(n) if unknowns.choices[k]]
    equations = [k for k in kept if unknowns.choices[k] == (BASIC,)]
    asked = {unknowns.w(k): unknowns.row(k, kept) for k in kept if k not in unknowns.boxes}
    for k in equations:
        row, factor = asked[unknowns.w(k)]
        asked[len(STATES) * n + k] = [-value for value in row], -factor
    widths = {unknowns.zero(k, UPPER): unknowns.width(k, kept) for k in unknowns.boxes}
    bounded = [k for k in kept if k not in equations]
    rows = {form: row for form, (row, _) in asked.items()} | widths
    here = Dictionary(rows, list(kept), [*bounded, *widths], check)
    violated = next((form for form in asked if not here.require(form)), None)
    if violated is None:
        return None
    multiples = dict(zip(here.cobasic, here.rows[violated][1:], strict=True)) | {violated: -here.divisor}
    y = [Fraction(0)] * n
    for form in asked.keys() & multiples.keys():
        y[form % n] -= int(multiples[form]) * asked[form][1]
    return [Fraction(value) for value in whole_multiple(y)]
