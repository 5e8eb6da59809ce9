"""Exact proofs that a problem is infeasible: from a Farkas vector in doubles (see `farkas`), or without one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import islice

import numpy as np

from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import BASIC, UPPER, WORDS
from lcpcli.model.problem import Problem
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import LARGEST_INTEGER, rounded, rounded_direction, shortest_decimal, whole_multiple
from lcpcli.rational.tree import Unknowns
from lcpcli.typing import Indices, Vector
from lcpcli.verify.farkas import ACTIVE_COLUMN, SNAP, corrected, is_clear_proof, is_short

MOST_ENTRIES = 2_000  # of M in the rows of a proof, and unknowns, up to which integers are sought
MOST_TERMS = 20_000  # the same up to which it is found out whether y is a proof: a tenth of a second
SIMPLE_DENOMINATORS = (100, 10**6)  # largest ones of simple fractions
SMALL = np.arange(1.0, 65.0)  # steps per largest entry of y in roundings to small integers
GRIDS = (2**6, 2**12, 2**20, 2**30)  # steps per largest entry of y, to which those are rounded that others follow from


def exact_proof(data: ExactProblem, y: Vector) -> list[Fraction] | None:
    """Return a vector near a multiple of y, doubles of shape (n,), that proves the problem infeasible, in integers
    without a common divisor; None if none is found among small integers, simple fractions, y itself, and both changed
    so that M'y = 0 where it is nearly 0."""
    if not (np.isfinite(y).all() and y.any()):
        return None
    found = next((candidate for candidate in _candidates(data, y) if data.refuted_by(candidate)), None)
    return None if found is None else [Fraction(value) for value in whole_multiple(found)]


def simplified(data: ExactProblem, y: list[Fraction]) -> list[Fraction]:
    """Return small integers near a multiple of a proof y that are a proof, too; y, if none are found."""
    return next(filter(data.refuted_by, map(fractions_of, _small(data.problem, rounded_direction(y)))), y)


def whole_proofs(problem: Problem, y: Vector, small: bool) -> Iterator[Vector]:
    """Yield vectors of integers near a multiple of y that are proofs for the doubles of a problem, or for their
    shortest decimals: up to 64, or else up to 2^53."""
    support = np.flatnonzero(y)
    roundings = _small(problem, y) if small and _entries(problem, support) <= MOST_ENTRIES else []
    if _entries(problem, support) > MOST_ENTRIES or (small and not roundings):
        return
    for number in (Fraction, shortest_decimal):
        data = ExactProblem.of_rows(problem, support, number)
        for candidate in map(fractions_of, roundings) if small else _simple(data, y, quickly=True):
            whole = whole_multiple(candidate)
            if max(map(abs, whole)) <= LARGEST_INTEGER and data.refuted_by(candidate):
                yield rounded(map(Fraction, whole))
        if all(scale == 1 for scale in data.scales):
            return


def is_exact(problem: Problem, y: Vector) -> bool:
    """Return whether y is a proof as it is, for the doubles of a problem or their shortest decimals; False, too, if it
    has so many terms that to find out would take long."""
    support = np.flatnonzero(y)
    if is_clear_proof(problem.M, problem.q, y, problem.box):
        return True
    return _entries(problem, support) <= MOST_TERMS and any(
        ExactProblem.of_rows(problem, support, number).refuted_by(fractions_of(y))
        for number in (Fraction, shortest_decimal)
    )


def _entries(problem: Problem, support: Indices) -> int:
    """Return the number of entries of M in some rows, and of unknowns."""
    rows = problem.M[support]
    return int(rows.nnz if is_sparse(rows) else rows.size) + problem.n


def _candidates(data: ExactProblem, y: Vector) -> Iterator[list[Fraction]]:
    exact = fractions_of(y)
    yield from map(fractions_of, _small(data.problem, y))
    yield from _simple(data, y, quickly=False)
    yield exact
    yield _corrected(data, exact, _active(data, y), quickly=False) or exact


@np.errstate(all="ignore")
def _small(problem: Problem, y: Vector) -> list[Vector]:
    """Return multiples of y rounded to small integers, the smallest first, that are proofs as far as doubles show."""
    support = np.flatnonzero(y)
    own = np.rint(np.multiply.outer(SMALL, y[support] / np.abs(y).max()))
    rows, (lower, upper) = problem.M[support], problem.box.vectors(problem.n)
    products, sizes = own @ rows, np.abs(own) @ abs(rows)
    ends = np.where(products > 0, upper, lower)
    suprema = np.where(np.abs(products) > EPS * problem.n * sizes, products * ends, 0.0)  # infinite for a wrong sign
    found = np.flatnonzero(own @ problem.q[support] + suprema.sum(axis=1) < 0)
    vectors = np.zeros((found.size, problem.n))
    vectors[:, support] = own[found]
    return list(vectors)


def _simple(data: ExactProblem, y: Vector, quickly: bool) -> Iterator[list[Fraction]]:
    """Yield vectors of simple fractions near y, and some with M'y = 0 exactly where it may be 0, the simplest first;
    quickly : only by linear systems that are `farkas.is_short`, and only while numbers stay short."""
    snapped = fractions_of(np.where(np.abs(y) < SNAP * np.abs(y).max(), 0.0, y))
    sizes, active = [abs(value) for value in snapped if value], _active(data, y)
    largest, least = max(sizes), min(sizes)
    simple = (
        [(value / unit).limit_denominator(most) for value in snapped]
        for most in SIMPLE_DENOMINATORS
        for unit in (largest, least)
    )
    yield from islice(simple, 2)
    for grid in GRIDS:
        steps = [Fraction(round(grid * value / largest)) for value in snapped]
        near = _corrected(data, steps, active, quickly) or steps
        yield near
        if quickly and max(map(abs, whole_multiple(near))) > LARGEST_INTEGER:
            break
    yield from simple


def _active(data: ExactProblem, y: Vector) -> list[int]:
    """Return the columns where M'y is small relative to its terms and has to vanish, unless its sign fits a single
    bound."""
    columns, _ = data.with_transpose(fractions_of(y))
    with np.errstate(all="ignore"):
        size = abs(data.problem.M).T @ np.abs(y)
        small = np.abs(rounded(columns)) <= ACTIVE_COLUMN * size
    small &= [low is None or high is None for low, high in zip(data.lower, data.upper, strict=True)]
    used = {j for i in np.flatnonzero(y).tolist() for j in data.rows[i]}
    return [j for j in np.flatnonzero(small).tolist() if j in used]


def _corrected(data: ExactProblem, y: list[Fraction], active: list[int], quickly: bool) -> list[Fraction] | None:
    """Return y, `corrected` on its support so that M'y vanishes in the active columns."""
    columns, _ = data.with_transpose(y)
    if not any(columns[j] for j in active):
        return y
    support = [i for i in range(data.n) if y[i]]
    common = math.lcm(*(data.scales[i] for i in support))
    A = [[data.rows[i].get(j, 0) * (common // data.scales[i]) for i in support] for j in active]
    if quickly and not is_short(A):
        return None
    found = corrected(A, [y[i] for i in support])
    if found is None:
        return None
    own = dict(zip(support, found, strict=True))
    return [own.get(i, value) for i, value in enumerate(y)]


def farkas_vector(data: ExactProblem, check: Callable[[], None]) -> list[Fraction] | None:
    """Return a y that passes `data.refuted_by`, in integers without a common divisor; None if some z within its bounds
    has w with the signs that the bounds ask for, so that there is no y.

    If there is no such z, a row of a dictionary shows that one of these signs is violated wherever all earlier ones
    hold: y consists of its coefficients. `check` is called before each pivot and may raise.
    """
    unknowns, n = Unknowns(data, check), data.n
    rows, factors, kept = unknowns.forms()
    for k in unknowns.boxes:
        del rows[unknowns.w(k)], factors[unknowns.w(k)]
    equations = [k for k in kept if unknowns.choices[k] == (BASIC,)]
    for k in equations:
        w, opposite = unknowns.w(k), len(WORDS) * n + k
        rows[opposite], factors[opposite] = [-value for value in rows[w]], -factors[w]
    widths = [unknowns.zero(k, UPPER) for k in unknowns.boxes]
    here = Dictionary(rows, list(kept), {*kept, *widths}.difference(equations), check)
    violated = next((form for form in factors if not here.require(form)), None)
    if violated is None:
        return None
    multiples = dict(zip(here.cobasic, here.rows[violated][1:], strict=True)) | {violated: -here.divisor}
    y = [Fraction(0)] * n
    for form in factors.keys() & multiples.keys():
        y[form % n] -= int(multiples[form]) * factors[form]
    return [Fraction(value) for value in whole_multiple(y)]
