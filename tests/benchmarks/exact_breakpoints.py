"""Breakpoints of a path to a hundred digits: each is the root of one w_i or z_i, in the
basis of a piece beside it.

The linear system of a basis is solved in doubles, and its solution refined with
residuals in exact integers: J. H. Wilkinson, Rounding Errors in Algebraic Processes
(1963), chapter 3.
"""

import math
import warnings
from fractions import Fraction

import numpy as np

from lcpcli.linalg.matrices import dense
from lcpcli.model.box import BASIC, UPPER
from lcpcli.rational.numbers import in_integers

BITS = 400  # after the binary point
# A change this small, relative to the solution, ends the refinement.
SETTLED = 2.0**-333
MAX_STEPS = 60  # of refinement; a basis that takes more is too ill-conditioned


class ExactBreakpoints:
    """The shares s of breakpoints of a family, from the states beside them."""

    def __init__(self, family):
        self.M = dense(family.problem.M)
        flat, self.exponent = in_integers(self.M.ravel())
        self.rows = np.array(flat, dtype=object).reshape(self.M.shape)
        ends = [family.bounds(share) for share in (0.0, 1.0)]
        self.q = _fixed([family.q(share) for share in (0.0, 1.0)])
        self.lower, self.upper = (
            _fixed([end[side] for end in ends]) for side in (0, 1)
        )

    def share(self, states, i, after):
        """Return the s at which component i reaches its end in the basis of these
        states: a basic z_i the bound of its state after that, else w_i 0. None if s is
        not found."""
        basic = np.flatnonzero(states == BASIC)
        z = np.where((states == UPPER)[:, None], self.upper, self.lower)
        z[basic] = 0
        found = self._solve(basic, -self._w(basic, z)) if basic.size else z[basic]
        if found is None:
            return None
        z[basic] = found
        bound = (self.upper if after == UPPER else self.lower)[i]
        first, last = (
            z[i] - bound if states[i] == BASIC else self._w(np.array([i]), z)[0]
        )
        return Fraction(int(first), int(first - last)) if first != last else None

    def _w(self, rows, z):
        """Return M z + q in these rows, rounded."""
        used = np.flatnonzero((z != 0).any(axis=1))
        return (
            _scaled(self.rows[np.ix_(rows, used)] @ z[used], self.exponent)
            + self.q[rows]
        )

    def _solve(self, basic, b):
        from scipy.linalg import lu_factor, lu_solve

        block = np.ix_(basic, basic)
        with warnings.catch_warnings():
            # Of a singular basis, which ends without a result.
            warnings.simplefilter("ignore")
            factors, rows = lu_factor(self.M[block]), self.rows[block]
        x = np.full(b.shape, 0, dtype=object)
        for _ in range(MAX_STEPS):
            change = lu_solve(factors, _floats(b - _scaled(rows @ x, self.exponent)))
            if not np.isfinite(change).all():
                return None
            change = _fixed(change.T)
            x = x + change
            if abs(change).max() <= math.ceil(abs(x).max() * SETTLED):
                return x
        return None


def _scaled(values, exponent):
    return values << exponent if exponent >= 0 else values >> -exponent


def _fixed(columns):
    """Return vectors as the columns of a matrix of integers, in units of 2^-BITS, with
    0 for infinite entries."""
    values = [
        [int(math.ldexp(v, BITS)) if math.isfinite(v) else 0 for v in column.tolist()]
        for column in columns
    ]
    return np.array(values, dtype=object).T


def _floats(values):
    return np.array(
        [[math.ldexp(float(v), -BITS) for v in row] for row in values.tolist()]
    )


def exact_shares(path, most):
    """Return the numbers of at most so many breakpoints, evenly spread, and their s to
    a hundred digits.

    Of the two pieces at a breakpoint the one with fewer basic components is used. A
    piece on which t stands still, or whose basis is too ill-conditioned, gives none.
    """
    inner = [
        k
        for k, changes in enumerate(path.changes, 1)
        if changes and path.t[k - 1] < path.t[k] < path.t[k + 1]
    ]
    chosen = [
        inner[k]
        for k in np.unique(
            np.linspace(0, len(inner) - 1, min(most, len(inner))).astype(int)
        )
    ]
    exact, found = ExactBreakpoints(path.family), []
    for k in chosen:
        i = path.changes[k - 1][0].index
        pieces = sorted(
            (path.states[k - 1], path.states[k]),
            key=lambda states: int((states == BASIC).sum()),
        )
        share = exact.share(pieces[0], i, int(pieces[1][i]))
        if share is not None:
            found.append((k, share))
    return found
