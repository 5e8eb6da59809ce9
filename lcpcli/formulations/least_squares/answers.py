"""What a result says about a fit: the coefficients, residuals and multipliers, and
whether the minimizer is unique. Also the verification of proposed coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any

import numpy as np

from lcpcli.errors import count
from lcpcli.formulations.least_squares.active_set import Minimizer
from lcpcli.formulations.least_squares.determinacy import (
    ROUNDED,
    SEVERAL,
    UNIQUE,
    Determinacy,
    determinacy,
    states_of,
)
from lcpcli.formulations.least_squares.fit import Data, LeastSquares
from lcpcli.formulations.least_squares.optimality import (
    REASON,
    ROUNDING_OF_ROWS,
    holds,
)
from lcpcli.formulations.least_squares.residuals import residual
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import accurate_residual, dense, is_sparse
from lcpcli.linalg.programs import minimized
from lcpcli.model.box import BASIC, LOWER, UPPER, in_words
from lcpcli.model.formulation import Answer
from lcpcli.rational.numbers import brief, zeros
from lcpcli.report import wording
from lcpcli.report.document import Table
from lcpcli.report.plotting import Fitted, Picture
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Vector
from lcpcli.verify.verification import Proposed, Verification

MAX_COEFFICIENTS = 100  # rows of a table in a report, which are a few screens
MAX_ON_SCREEN = 24  # rows of a table on the screen
MAX_NAMED = 6  # coefficients named in a sentence
# Uniqueness is examined by the dense inverse of a system of this order, which is the
# number of measurements, free coefficients and equations.
MAX_EXAMINED = 3000
# Slopes below this, relative to their terms, are those of a linear program that are 0,
# with its tolerance of 1e-10; and the largest denominator of simple multipliers.
TIGHT = 1e-8
SIMPLE_DENOMINATOR = 10**6
UNSOLVED = "the fit is not known"
INFEASIBLE = "no x within the bounds satisfies the equations"
KEYS = (
    "x",
    "residual",
    "norm",
    "norm_error",
    "multipliers",
    "equation_multipliers",
    "states",
    "support",
    "proved",
    "other",
    "uncertain",
    "statement",
    "exact",
)
STATEMENTS = {
    UNIQUE: "x is the only minimizer, also for data that differ by rounding",
    SEVERAL: "x is one of several minimizers: {names} can change without changing A x",
    ROUNDED: "rounding of the data decides whether {names} {are} at {their}",
    None: "it was not examined whether there are other minimizers",
}
DEPENDENT = "up to rounding of the data, {names} can change without changing A x"


@dataclass(frozen=True, eq=False)
class Fit(Answer):
    """What a solution of the mixed problem says about a fit.

    names : the names of the coefficients.
    x : the coefficients that minimize |A x - b|, shape (n,); None if the problem is not
        solved, as are all the following.
    exact : x in fractions if z is proved, otherwise None.

    The following are computed when one of them is first read:

    residual : b - A x, shape (m,), correctly rounded or almost so.
    norm : its 2-norm.
    norm_error : a bound on the rounding error in `norm`.
    multipliers : the derivatives of the minimum of |A x - b|^2 / 2 with respect to the
        bounds, shape (n,): 0 for free coefficients, positive at lower and negative at
        upper bounds.
    equation_multipliers : the derivatives with respect to d, shape (k,).
    states : for each coefficient "lower", "upper" or "basic", which means free.
    support : the indices, from 0, of the coefficients that are not 0.
    proved : "unique" if there is no other minimizer, and data that differ by rounding
        have a minimizer with the same coefficients at bounds; "several" if there is
        another minimizer, which is `other`, of shape (n,); "up to rounding" if the
        values of the coefficients with the indices `uncertain` depend on rounding
        errors of the data. None if the problem is not solved, or too large to examine.
    statement : what is proved, in a sentence.
    """

    names: Sequence[str]
    x: Vector | None = None
    exact: list[Fraction] | None = None
    _status: str = ""
    _problem: tuple[Data, Minimizer] | None = field(default=None, repr=False)

    @cached_property
    @np.errstate(all="ignore")
    def _measured(self) -> tuple[Vector, float, float, Vector] | None:
        """Return the residual, its norm, a bound on the error of the norm, and the
        multipliers.
        """
        if self._problem is None:
            return None
        data, minimizer = self._problem
        residual_of_x = (accurate_residual if is_sparse(data.A) else residual)(
            data.A, minimizer.x, data.b
        )
        slopes = data.A.T @ minimizer.r + data.E.T @ minimizer.y
        multipliers = np.where(minimizer.statuses == BASIC, 0.0, 0.0 - slopes)
        norm, error = _norm(residual_of_x)
        terms = abs(data.A) @ np.abs(minimizer.x) + np.abs(data.b)
        error += (minimizer.x.size * EPS) ** 2 * _norm(terms)[0]
        return residual_of_x, norm, error, multipliers

    @property
    def residual(self) -> Vector | None:
        return None if self._measured is None else self._measured[0]

    @property
    def norm(self) -> float | None:
        return None if self._measured is None else self._measured[1]

    @property
    def norm_error(self) -> float | None:
        return None if self._measured is None else self._measured[2]

    @property
    def multipliers(self) -> Vector | None:
        return None if self._measured is None else self._measured[3]

    @property
    def equation_multipliers(self) -> Vector | None:
        return None if self._problem is None else self._problem[1].y

    @property
    def states(self) -> list[str] | None:
        return None if self._problem is None else in_words(self._problem[1].statuses)

    @property
    def support(self) -> Indices | None:
        return None if self.x is None else self.x.nonzero()[0]

    @cached_property
    def _determinacy(self) -> Determinacy | None:
        if self._problem is None:
            return None
        data, minimizer = self._problem
        if data.b.size + minimizer.free.size + data.d.size > MAX_EXAMINED:
            return None
        return determinacy(data._replace(A=dense(data.A), E=dense(data.E)), minimizer)

    @property
    def proved(self) -> str | None:
        return None if self._determinacy is None else self._determinacy.proved

    @property
    def other(self) -> Vector | None:
        return None if self._determinacy is None else self._determinacy.other

    @property
    def uncertain(self) -> list[int]:
        return [] if self._determinacy is None else self._determinacy.uncertain

    @property
    def statement(self) -> str:  # type: ignore[override]
        if self.x is None:
            return INFEASIBLE if self._status == "infeasible" else UNSOLVED
        determined = self._determinacy
        if determined is None:
            return STATEMENTS[None]
        template = STATEMENTS[determined.proved]
        if determined.proved == ROUNDED and determined.changing:
            template = DEPENDENT
        indices = determined.changing or determined.uncertain
        one = len(indices) == 1
        are, their = ("is", "its bound") if one else ("are", "their bounds")
        return template.format(names=self._named(indices), are=are, their=their)

    def _named(self, indices: Sequence[int]) -> str:
        named = [self.names[j] for j in indices[:MAX_NAMED]]
        if len(indices) > MAX_NAMED:
            named.append(count(len(indices) - MAX_NAMED, "other"))
        *first, last = named or [""]
        return f"{', '.join(first)} and {last}" if first else last

    def lines(self) -> list[str]:
        if self.norm is None or self.support is None or self.x is None:
            return [self.statement]
        fitted = f"|A x - b| = {wording.plain_number(self.norm)}"
        used = f"{self.support.size} of {count(self.x.size, 'coefficient')} not 0"
        return [f"{fitted}, {used}", self.statement]

    def tables(self, *, whole: bool = True) -> list[Table]:
        if self.x is None or self.multipliers is None or self.states is None:
            return []
        limit = MAX_COEFFICIENTS if whole else MAX_ON_SCREEN
        cell = wording.plain_number
        x, value = (self.exact, brief) if self.exact else (self.x.tolist(), cell)
        columns = self.names, x, self.multipliers.tolist(), self.states
        rows = [
            [name, value(x), cell(multiplier), "free" if state == "basic" else state]
            for name, x, multiplier, state in islice(zip(*columns, strict=True), limit)
        ]
        notes = list[str]()
        if self.x.size > limit:
            total = count(self.x.size, "coefficient")
            notes = [f"the first {limit} of {total}; --format csv has all"]
        header = ["coefficient", "value", "multiplier", "at"]
        return [Table(header, [rows], (0, 3), notes=notes)]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        headings = ("part", "value", "multiplier")
        parts = self.residual, self.x, self.equation_multipliers
        if self.residual is None or self.x is None or self.multipliers is None:
            return dict.fromkeys(headings, ())
        rows = [("residual", value, "") for value in self.residual.tolist()]
        x = self.exact or self.x.tolist()
        pairs = zip(x, self.multipliers.tolist(), strict=True)
        rows += [("coefficient", *pair) for pair in pairs]
        assert parts[2] is not None
        rows += [("equation", "", value) for value in parts[2].tolist()]
        columns = ([row[i] for row in rows] for i in range(3))
        return dict(zip(headings, columns, strict=True))

    def picture(self, title: str) -> Picture | None:
        if self._problem is None or self.x is None:
            return None
        data, x = self._problem[0], self.x
        used = x.nonzero()[0]
        weighted = dense(data.A[:, used]) * x[used]
        names = [self.names[j] for j in used.tolist()]
        parts = dict(zip(names, weighted.T, strict=True))
        drawn = Fitted(title, data.b, data.A @ x, parts)
        return Picture("fit", [drawn], [title], "a fit")

    def record(self) -> Mapping[str, Any]:
        return {key: getattr(self, key) for key in KEYS}


def answer(origin: LeastSquares, result: Result) -> Fit:
    if not result.solved:
        return Fit(origin.coefficient_names(), _status=result.status.word)
    exact = None
    if result.exact is not None and result.exact.z is not None:
        exact = origin.parts(result.exact.z)[1]
    return fit_at(origin, origin.data_in(result.problem), result.z, exact)


def fit_at(
    origin: LeastSquares, data: Data, z: Vector, exact: list[Fraction] | None = None
) -> Fit:
    """Return the answer for a solution z.

    exact : its coefficients in fractions.
    """
    r, x, y = origin.parts(z)
    minimizer = Minimizer(x, r, y, states_of(data, x))
    return Fit(origin.coefficient_names(), x, exact, "solved", (data, minimizer))


def _norm(values: Vector) -> tuple[float, float]:
    """Return the 2-norm of values that have relative errors of one rounding, and a
    bound on its error.
    """
    exponent = math.frexp(np.abs(values).max(initial=0.0))[1]
    scaled = np.ldexp(values, -exponent)
    norm = math.ldexp(math.sqrt(math.fsum((scaled * scaled).tolist())), exponent)
    return norm, 4 * EPS * norm


@np.errstate(all="ignore")  # overflow gives infinity
def verified(origin: LeastSquares, proposed: Proposed) -> Verification:
    """Verify z; or coefficients x alone, with the residuals b - A x and multipliers of
    the equations for which the conditions hold, if there are any.
    """
    data = origin.data_in(proposed.problem)
    if len(proposed.values) == proposed.problem.n:
        return _by_rows(origin, data, proposed, proposed.values)
    x = np.array(proposed.values, dtype=float)
    r = residual(dense(data.A), x, data.b)
    verification: Verification | None = None
    for y in _multipliers(data, x, r):
        if proposed.data is None:
            other = _by_rows(origin, data, proposed, np.concatenate((r, x, y)))
        else:
            exact = [Fraction(value) for value in proposed.values]
            residuals = [0 - value for value in _rows(proposed, origin, exact)]
            other = proposed.of_z([*residuals, *exact, *map(_simple, y.tolist())])
        if verification is None or other.accepted:
            verification = other
        if other.accepted:
            break
    assert verification is not None
    return verification


def _multipliers(data: Data, x: Vector, r: Vector) -> Iterator[Vector]:
    """Yield y, multipliers of the equations, for coefficients x with residuals r: those
    that satisfy w = 0 of the free coefficients best; then, if there are equations,
    those for which all w = -A'r - E'y have the required signs, up to the smallest sum
    of violations s, by a linear program, and more accurately by its active set."""
    E, slopes = dense(data.E), -dense(data.A).T @ r
    k = len(E)
    states = states_of(data, x)
    free = states == BASIC
    if not k:
        yield np.zeros(0)
        return
    yield np.linalg.lstsq(E[:, free].T, slopes[free], rcond=None)[0]
    signed = (data.lower < data.upper).nonzero()[0]
    n = signed.size
    rows = np.concatenate(
        (
            np.hstack((E[:, signed].T, -np.eye(n))),
            np.hstack((E[:, signed].T, np.eye(n))),
        )
    )
    is_low, is_high = (states[signed] == state for state in (LOWER, UPPER))
    high = np.append(np.where(is_high, np.inf, slopes[signed]), np.full(n, np.inf))
    low = np.append(np.full(n, -np.inf), np.where(is_low, -np.inf, slopes[signed]))
    bounds = np.append(np.full(k, -np.inf), np.zeros(n)), np.full(k + n, np.inf)
    optimum = minimized(np.repeat([0.0, 1.0], (k, n)), rows, (low, high), bounds)
    if optimum is None:
        return
    y = optimum.x[:k]
    yield y
    gaps = np.abs(slopes - E.T @ y)
    is_tight = gaps <= TIGHT * (np.abs(slopes) + np.abs(E).T @ np.abs(y))
    is_tight |= free
    yield (
        y
        + np.linalg.lstsq(
            E[:, is_tight].T, slopes[is_tight] - E[:, is_tight].T @ y, rcond=None
        )[0]
    )


def _simple(value: float) -> Fraction:
    """Return the simple fraction that a number may be rounded from, or the number."""
    simple = Fraction(value).limit_denominator(SIMPLE_DENOMINATOR)
    return simple if float(simple) == value else Fraction(value)


def _by_rows(
    origin: LeastSquares, data: Data, proposed: Proposed, z: Sequence[Any] | Vector
) -> Verification:
    """Verify z, and accept it also if each row holds to rounding of its terms, as a run
    does, and its r is b - A x to the tolerance: large terms of A x hide any other r.
    """
    verification = proposed.of_z(z)
    if verification.accepted or proposed.tol < ROUNDING_OF_ROWS:
        return verification
    r, x, y = origin.parts(np.array(z, dtype=float))
    is_inside = ((data.lower <= x) & (x <= data.upper)).all()
    residual_of_x = (accurate_residual if is_sparse(data.A) else residual)(
        data.A, x, data.b
    )
    # Comparisons with NaN are false.
    is_of_x = np.linalg.norm(r - residual_of_x) <= proposed.tol * np.linalg.norm(data.b)
    if not (is_inside and is_of_x and holds(data, r, x, y).all()):
        return verification
    message = f"z solves the problem: {REASON}"
    return replace(
        verification, accepted=True, message=message, violations=(), violated=0
    )


def _rows(
    proposed: Proposed, origin: LeastSquares, x: Sequence[Fraction]
) -> list[Fraction]:
    """Return A x - b in fractions."""
    assert proposed.data is not None
    m, k = origin.measurements, proposed.problem.n - origin.measurements - len(x)
    return list(proposed.data.w([*zeros(m), *x, *zeros(k)])[:m])
