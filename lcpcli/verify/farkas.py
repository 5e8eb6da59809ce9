"""Systems A z + b >= 0, z >= 0: a point, or a proof that there is none.

J. Farkas, Theorie der einfachen Ungleichungen, Journal für die reine und angewandte Mathematik 124 (1902) 1-27: either
there is such a z, or there is y >= 0 with A'y <= 0 and b'y < 0, and never both, as 0 <= y'(A z + b) = (A'y)'z + b'y.
A proof found in floats is accepted only after a check without rounding, as in D. Applegate, W. Cook,
S. Dash and D. Espinoza, Exact solutions to linear programming problems, Operations Research Letters 35 (2007) 693-699.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.linear_program import linprog, minimized
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.typing import Indices, Mask, Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

ACTIVE = 1e-8  # a column with |A'y| below this times |A|'y counts as one with A'y = 0
SNAP = 1e-9  # entries of y below this times the largest one count as 0
GRID = 2.0**20  # steps per largest entry of y, to which one candidate is rounded
LARGEST_EXACT = 48  # largest linear system solved exactly: about a second at worst
LARGEST_BY_FLINT = 400  # the same with FLINT
MOST_BITS = 10_000_000  # the number of entries times the bits of the largest: a second or two


class Alternative(NamedTuple):
    """One of Farkas' alternatives; both None if neither was established.

    point : z with A z + b >= 0, z >= 0 to the tolerance of the LP solver, which proves nothing.
    proof : y for which `refutes` holds.
    """

    point: Vector | None
    proof: Vector | None


def refutes(A: Matrix, b: Vector, y: Vector) -> bool:
    """Whether y proves that no z >= 0 has A z + b >= 0; A of shape (m, n), b and y of shape (m,), all finite.

    True only for a proof that holds without rounding, so never for a system that has a solution:

    - y >= 0, and the exact b'y is negative;
    - each column's exact A'y is not positive. Floats alone show this where the computed value is below minus several
      times a bound on its rounding error, (m + 2) EPS |A|'y and underflow; the other columns are summed in integers.
      A margin would not do instead: with A'y = delta > 0 there may be a solution of size |b'y| / delta.
    - If only that last test fails, by rounding of y (columns with A'y = 0, which possibly no y in floats satisfies),
      the proof is y corrected in rational arithmetic: an exact solution of A'y = 0 in those columns, on the support of
      y, has to pass all the tests. y itself is then that proof rounded. For at most LARGEST_EXACT of each, or
      LARGEST_BY_FLINT.

    False proves nothing.
    """
    if not (np.isfinite(y).all() and (y >= 0).all() and y.any()):
        return False
    with np.errstate(all="ignore"):
        product, size = A.T @ y, abs(A).T @ y
        error = 4 * (y.size + 2) * (EPS * size + SMALLEST_NORMAL)
        doubtful = np.flatnonzero(~(product < -error))
        active = np.flatnonzero(~(product < -error - ACTIVE * size))
        if (product > error + ACTIVE * size).any():
            return False
    from lcpcli.rational import sums

    signs = (sums.sign_of_product(_column(A, j), y) for j in doubtful.tolist())
    if sums.sign_of_product(b, y) < 0 and all(sign <= 0 for sign in signs):
        return True
    return _refutes_corrected(A, b, y, active)


def _refutes_corrected(A: Matrix, b: Vector, y: Vector, active: Indices) -> bool:
    """Whether y changed so that A'y = 0 in the active columns, exactly, refutes the system."""
    from fractions import Fraction

    support = np.flatnonzero(y)
    found = corrected(A, support, [Fraction(value) for value in y[support].tolist()], active)
    return found is not None and _holds(A, b, *found)


def corrected(A: Matrix, support: Indices, y: list[Fraction], active: Indices) -> tuple[Indices, list[Fraction]] | None:
    """y on its support, changed so that A'y = 0 in the active columns, exactly, where it is the likeliest to be."""
    from lcpcli.rational import linear, sums

    order = sorted(range(support.size), key=lambda k: -abs(y[k]))  # large entries best absorb a correction
    support, y = support[order], [y[k] for k in order]
    part = matrices.dense(A[support][:, active])
    part = part[:, part.any(axis=0)]
    if not part.size or max(part.shape) > _largest() or not np.isfinite(part).all():
        return None
    if remaining() <= 0:
        raise TimeIsUp
    rows, (multiple, divisor) = sums.row_integers(part.T), sums.over_one_denominator(y)
    if not is_short(rows):
        return None
    excess = [sum(a * value for a, value in zip(row, multiple, strict=True) if a) for row in rows]
    changes = linear.particular(rows, [-value for value in excess])
    if changes is None:
        return None
    return support, [value + change / divisor for value, change in zip(y, changes, strict=True)]


def is_short(A: Sequence[Sequence[int]]) -> bool:
    """Whether A, of at least one row, is small enough to be solved exactly."""
    bits = max((abs(value).bit_length() for row in A for value in row), default=0)
    return max(len(A), len(A[0])) <= _largest() and len(A) * len(A[0]) * bits <= MOST_BITS


def _largest() -> int:
    from lcpcli.rational import linear

    return LARGEST_BY_FLINT if linear.is_fast() else LARGEST_EXACT


def _holds(A: Matrix, b: Vector, support: Indices, y: list[Fraction]) -> bool:
    """Whether the rational y on a support is a proof, in exact arithmetic."""
    from lcpcli.rational import sums

    rows, (multiple, _) = A[support], sums.over_one_denominator(y)
    if min(multiple) < 0 or sums.product(b[support], multiple) >= 0:
        return False
    return all(sums.product(_column(rows, j), multiple) <= 0 for j in range(A.shape[1]))


def alternative(A: Matrix, b: Vector, seconds: float = math.inf) -> Alternative:
    """A point of A z + b >= 0, z >= 0, or a proof that there is none, by one to three LPs; A should be equilibrated.

    A of shape (m, n), dense or sparse, b of shape (m,); if they are not finite, nothing is established. The LP
    minimises b'y subject to A'y <= 0, y >= 0 and b'y >= -1: its minimum is -1 or 0, and if it is 0, its multipliers are
    a point. If it fails or yields no proof, as for systems that almost have a solution, whose y are large, the next is
    `least_violation`. The last LP seeks y with as many components of A'y as possible negative by a margin, as a vertex
    y has many that are 0 up to rounding. Each LP may take half of the seconds.
    """
    power, n = math.frexp(np.abs(b).max())[1], A.shape[1]
    b = np.ldexp(b, -power)
    if not (np.isfinite(b).all() and np.isfinite(A.sum())):
        return Alternative(None, None)
    seconds /= 2
    found = linprog(b, stack([[A.T], [-b[np.newaxis]]]), np.append(np.zeros(n), 1.0), seconds)
    if found is not None and found.fun > -0.5:
        return Alternative(np.ldexp(np.maximum(-found.ineqlin.marginals[:n], 0.0), power), None)
    first = None if found is None else found.x
    return Alternative(None, next((y for y in _candidates(A, b, first, seconds) if refutes(A, b, y)), None))


def _candidates(A: Matrix, b: Vector, y: Vector | None, seconds: float) -> Iterator[Vector]:
    """Vectors that may be proofs, from a solution of the first LP, if it has one, the cheapest first."""
    if y is not None:
        yield from _snapped(y)
    m, n = A.shape
    every = np.ones(m, dtype=bool)
    yield from _snapped(least_violation(A, b, (every, ~every), (np.zeros(n), np.full(n, np.inf)), seconds))
    if y is None:
        return
    system = stack([[A.T, np.eye(n)], [b[np.newaxis], np.zeros((1, n))]])
    bounds = np.append(np.full(m, np.inf), np.ones(n))
    objective = np.append(np.zeros(m), -np.ones(n))
    strict = linprog(objective, system, np.append(np.zeros(n), -1.0), seconds, bounds)
    if strict is not None:
        yield from _snapped(strict.x[:m])


def least_violation(
    A: Matrix, b: Vector, signs: tuple[Mask, Mask], bounds: tuple[Vector, Vector], seconds: float
) -> Vector:
    """The multipliers, of shape (m,) and at most 1, for the least sum of violations of the signs of A z + b; 0 if none.

    J. W. Chinneck and E. W. Dravnieks, Locating minimal infeasible constraint sets in linear programs, ORSA Journal on
    Computing 3 (1991) 157-168: the elastic program.

    signs : masks low and high: A z + b >= 0 is asked for where only low holds, <= 0 where only high does, = 0 where
        neither does, and nothing where both do. bounds : lower and upper, of z.
    """
    (low, high), (lower, upper) = signs, bounds
    one = identity(A)
    elastic = stack([[A, one[:, ~high], -one[:, ~low]]])
    zero = np.zeros(elastic.shape[1] - A.shape[1])
    ends = np.where(high, -np.inf, -b), np.where(low, np.inf, -b)
    bounds = np.append(lower, zero), np.append(upper, zero + np.inf)
    found = minimized(np.append(np.zeros(A.shape[1]), zero + 1), elastic, ends, bounds, seconds)
    return np.zeros(b.size) if found is None else found.y


def identity(A: Matrix) -> Matrix:
    """The identity of as many rows as A, sparse if A is."""
    if not is_sparse(A):
        return np.eye(A.shape[0])
    from scipy.sparse import eye_array

    return eye_array(A.shape[0]).tocsc()


def _snapped(y: Vector) -> Iterator[Vector]:
    y = np.maximum(y, 0.0)
    snapped = np.where(y < SNAP * y.max(), 0.0, y)
    yield snapped
    if snapped.any():  # entries are often small integer multiples of one number, by the structure of M: then exact
        yield np.rint(GRID * (snapped / y.max())) / GRID
        yield np.rint(snapped / snapped[snapped > 0].min())
    if not np.array_equal(snapped, y):
        yield y


def _column(A: Matrix, j: int) -> Vector:
    column: Vector = matrices.dense(A[:, [j]])[:, 0]
    return column
