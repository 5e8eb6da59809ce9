"""Fraction-free elimination on integers: minors, definiteness, and linear systems in
rational arithmetic; and limits on work, counted rather than timed, so that the same
input has the same output on every machine.

E. H. Bareiss, Sylvester's identity and multistep integer-preserving Gaussian
elimination, Mathematics of Computation 22 (1968) 565-578: after the pivots of an index
set P, entry (i, j) is the minor of the rows P + i and the columns P + j.

Larger systems are solved by FLINT (https://flintlib.org) if python-flint is installed:
a nonsingular one takes n^3 operations modulo primes and a p-adic lifting (J. D. Dixon,
Exact solution of linear equations using p-adic expansions, Numerische Mathematik 40
(1982) 137-141), a second for n = 400 and entries of 7 bits. Both ways have the same
results. FLINT holds the interpreter's lock, so that in a thread neither Ctrl-C nor a
time limit could interrupt it: calls that may take long are made in a separate process,
which can be killed at once and takes 0.2 seconds to start.
"""

from __future__ import annotations

import marshal
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

from lcpcli.clock import imports
from lcpcli.errors import ParameterError, missing
from lcpcli.interrupts import TimeIsUp, raise_if_timed_out, remaining
from lcpcli.rational.exact_problem import ExactProblem

MAX_PLAIN_ROWS = 16  # rows up to which FLINT is not faster
# FLINT takes n^3 times this for a nonsingular system, for each bit of its longest
# entry.
SECONDS_PER_BIT = 1e-9
# Time per multiplication for two eliminations modulo a prime.
SECONDS_PER_STEP = 5e-10
PRIME = 2**61 - 1  # fits in a machine word
# Estimated time from which a call is made in another process, which takes 0.2 s to
# start.
LONG_CALL_SECONDS = 0.5
CODE = (
    "import sys; sys.path[:] = sys.argv[1:]; from lcpcli.rational.elimination "
    "import serve; serve()"
)

Rows = Sequence[Sequence[int]]


def require() -> Any:
    """Return the module flint, or raise a ParameterError that says how to install
    it."""
    flint = library()
    if flint is None:
        raise ParameterError("exact", *missing("flint"))
    return flint


def library() -> Any:
    """Return the module flint, which is faster for large systems or long integers, or
    None if it is not installed.
    """
    with imports, suppress(ModuleNotFoundError):
        import flint

        return flint
    return None


def solve(
    A: Rows, b: Sequence[int]
) -> tuple[list[Fraction] | None, list[list[Fraction]]]:
    """Return a solution x of A x = b, for integers A of shape (m, n) and b of length m,
    with 0 for unknowns whose columns depend on earlier ones, or None if there is none;
    and a basis of the solutions of A x = 0.
    """
    m, n = len(A), len(A[0]) if A else 0
    if m == n > MAX_PLAIN_ROWS and library():
        ratios = call(solved, duration(A), A, list(b))
        if ratios is not None:
            return [Fraction(*value) for value in ratios], []
    rows, pivots, divisor = _reduced(
        [[*row, value] for row, value in zip(A, b, strict=True)], n
    )

    def of_column(j: int, sign: int) -> list[Fraction]:
        values = {
            k: Fraction(sign * row[j], divisor)
            for row, k in zip(rows, pivots, strict=False)
        }
        values[j] = Fraction(1)
        return [values.get(k, Fraction(0)) for k in range(n)]

    x = None if any(row[n] for row in rows[len(pivots) :]) else of_column(n, 1)
    return x, [of_column(j, -1) for j in range(n) if j not in pivots]


def bits(A: Rows) -> int:
    """Return the number of bits of the longest number of A."""
    return max((abs(value).bit_length() for row in A for value in row), default=0)


def duration(A: Rows) -> float:
    """Return roughly the seconds that `solve` takes for the largest nonsingular part of
    an A with many rows and columns.
    """
    rank = min(len(A), len(A[0])) if A else 0
    return SECONDS_PER_BIT * bits(A) * float(rank) ** 3


def particular(A: Rows, b: Sequence[int]) -> list[Fraction] | None:
    """Return a solution x of A x = b, or None if there is none.

    For a large system, FLINT solves a nonsingular part that has the same rank modulo a
    prime. The other equations are not checked: they hold if A x = b has a solution,
    unless the prime divides a minor, which is unlikely.
    """
    if not A or min(len(A), len(A[0])) <= MAX_PLAIN_ROWS or not library():
        return solve(A, b)[0]
    rows, columns = call(
        independent, SECONDS_PER_STEP * len(A) * len(A[0]) * min(len(A), len(A[0])), A
    )
    solution, _ = solve(
        [[A[i][j] for j in columns] for i in rows], [b[i] for i in rows]
    )
    if solution is None:
        return None
    values = dict(zip(columns, solution, strict=True))
    return [values.get(j, Fraction(0)) for j in range(len(A[0]))]


def _reduced(rows: list[list[int]], n: int) -> tuple[list[list[int]], list[int], int]:
    """Return the reduced row echelon form of the first n columns, multiplied by a
    divisor, the pivot columns, and the divisor.
    """
    if len(rows) > MAX_PLAIN_ROWS and library():
        whole, divisor, rank = call(reduced, duration(rows), rows)
        leading = [
            next(j for j, value in enumerate(row) if value) for row in whole[:rank]
        ]
        return whole, [j for j in leading if j < n], divisor
    pivots: list[int] = []
    previous = 1
    for column in range(n):
        raise_if_timed_out()
        top = len(pivots)
        row_index = next((i for i in range(top, len(rows)) if rows[i][column]), None)
        if row_index is None:
            continue
        rows[top], rows[row_index] = rows[row_index], rows[top]
        pivot = rows[top]
        rows = [
            row if row is pivot else clear(row, pivot, column, previous) for row in rows
        ]
        pivots.append(column)
        previous = pivot[column]
    return rows, pivots, previous


def _pivots(A: Any) -> list[int]:
    """Return the pivot columns of a FLINT matrix modulo a prime."""
    reduced, rank = A.rref()
    return [next(j for j in range(A.ncols()) if reduced[i, j]) for i in range(rank)]


class Definiteness(NamedTuple):
    """Index sets of a principal minor that is 0, and of one that is negative, which
    prove that a symmetric matrix is not positive definite, or not semidefinite; None if
    there is none.
    """

    zero: tuple[int, ...] | None
    negative: tuple[int, ...] | None


def clear(row: Sequence[int], top: Sequence[int], k: int, previous: int) -> list[int]:
    """Return a row after elimination with the pivot top[k]: its entry in column k is 0.
    previous : the preceding pivot, which divides all entries.
    """
    pivot, factor = top[k], row[k]
    return [(pivot * a - factor * b) // previous for a, b in zip(row, top, strict=True)]


def eliminated(A: Rows, previous: int) -> Rows:
    """Return the matrix after elimination with the pivot A[0][0], which is not 0,
    without its row and column.
    """
    return [clear(row, A[0], 0, previous)[1:] for row in A[1:]]


def symmetrized(A: Rows) -> Rows:
    """Return A + A'."""
    return [[value + A[j][i] for j, value in enumerate(row)] for i, row in enumerate(A)]


def definiteness(A: Rows, check: Callable[[], None]) -> Definiteness:
    """Decide whether the symmetric A is positive definite (both sets None) or
    semidefinite (negative None), pivot by pivot; `check` is called before each and may
    raise."""
    labels, previous = list(range(len(A))), 1
    chosen: list[int] = []
    zero: tuple[int, ...] | None = None
    while labels:
        check()
        label, pivot = labels.pop(0), A[0][0]
        if pivot < 0:
            return Definiteness(zero, (*chosen, label))
        if pivot == 0:
            zero = zero or (*chosen, label)
            other = next((j for j, value in enumerate(A[0]) if value), None)
            if other is not None:
                return Definiteness(zero, (*chosen, label, labels[other - 1]))
            A = [row[1:] for row in A[1:]]
            continue
        A, previous = eliminated(A, previous), pivot
        chosen.append(label)
    return Definiteness(zero, None)


def principal_minors(
    A: Rows, check: Callable[[], None]
) -> Iterator[tuple[tuple[int, ...], int]]:
    """Yield every principal minor with its index set, by Schur complements with shared
    elimination steps.

    M. J. Tsatsomeros and L. Li, A recursive test for P-matrices, BIT Numerical
    Mathematics 40 (2000) 410-414. There are 2^n - 1. `check` is called before each and
    may raise.
    """
    pending: list[tuple[Rows, tuple[int, ...], tuple[int, ...], int]] = [
        (A, tuple(range(len(A))), (), 1)
    ]
    while pending:
        block, labels, chosen, previous = pending.pop()
        check()
        indices = (*chosen, labels[0])
        rest = labels[1:]
        pivot = block[0][0]
        yield indices, pivot
        if not rest:
            continue
        pending.append(([row[1:] for row in block[1:]], rest, chosen, previous))
        if pivot:
            pending.append((eliminated(block, previous), rest, indices, pivot))
            continue
        for size in range(1, len(rest) + 1):
            for more in combinations(rest, size):
                check()
                yield (
                    (*indices, *more),
                    determinant(
                        [
                            [A[i][j] for j in (*indices, *more)]
                            for i in (*indices, *more)
                        ]
                    ),
                )


def determinant(A: Rows) -> int:
    """Return the determinant of a square matrix of integers."""
    sign, previous = 1, 1
    while len(A) > 1:
        k = next((i for i, row in enumerate(A) if row[0]), None)
        if k is None:
            return 0
        if k:
            A = [A[k], *A[:k], *A[k + 1 :]]
            sign = -sign if k % 2 else sign
        pivot = A[0][0]
        A, previous = eliminated(A, previous), pivot
    return sign * A[0][0]


def solved(A: Rows, b: Sequence[int]) -> list[tuple[int, int]] | None:
    """Return the numerators and denominators of the x with A x = b, for square A; None
    if A is singular."""
    flint = library()
    try:
        x = flint.fmpz_mat(A).solve(flint.fmpz_mat(len(b), 1, b))
    except ZeroDivisionError:
        return None
    return [(int(value.p), int(value.q)) for value in x.entries()]


def independent(A: Rows) -> tuple[list[int], list[int]]:
    """Return the rows and the columns of a nonsingular submatrix of A with the same
    rank modulo a prime.
    """
    flint = require()
    columns = _pivots(flint.nmod_mat(flint.fmpz_mat(A), PRIME))
    part = [[row[j] for j in columns] for row in A]
    return _pivots(flint.nmod_mat(flint.fmpz_mat(part), PRIME).transpose()), columns


def reduced(A: Rows) -> tuple[list[list[int]], int, int]:
    """Return the reduced row echelon form of A multiplied by a divisor, that divisor,
    and the rank.
    """
    rows, divisor, rank = library().fmpz_mat(A).rref()
    return [[int(value) for value in row] for row in rows.tolist()], int(divisor), rank


def call(function: Callable[..., Any], seconds: float, *arguments: Any) -> Any:
    """Return the result of a function of this module, in another process if it takes
    long by this estimate of its seconds; raise TimeIsUp when the time limit is reached.
    """
    if seconds > LONG_CALL_SECONDS and sys.executable:
        with imports:
            import subprocess
        command = [sys.executable, "-c", CODE, *sys.path]
        request = marshal.dumps((function.__name__, arguments))
        time_left = remaining() if remaining() < math.inf else None
        try:
            done = subprocess.run(
                command,
                input=request,
                capture_output=True,
                timeout=time_left,
                check=True,
            )
            return marshal.loads(done.stdout)
        except subprocess.TimeoutExpired:
            raise TimeIsUp from None
        except (OSError, subprocess.CalledProcessError):
            pass
    return function(*arguments)


def serve() -> None:
    """Make the call that standard input describes, and write its result to standard
    output.
    """
    name, arguments = marshal.load(sys.stdin.buffer)
    sys.stdout.buffer.write(marshal.dumps(globals()[name](*arguments)))


# The usual time of a pivot on n rows, in seconds for each of n^2 entries, and in
# addition for each of them times bits times rows.
OF_ENTRY, OF_BIT = 2e-7, 6e-10


class Effort:
    """A limit on work, in seconds that it usually takes, and the part of it that is
    `spent`; the time limit of the run holds too.
    """

    def __init__(self, seconds: float = math.inf) -> None:
        self._max_seconds, self.spent = seconds, 0.0

    def allows(self, seconds: float = 0.0) -> bool:
        """Return whether this much work remains, and time for it."""
        return self.spent + seconds <= self._max_seconds and seconds < remaining()

    def spend(self, seconds: float) -> None:
        """Count work; raise TimeIsUp if it exceeds the limit, or the time limit is
        reached.
        """
        self.spent += seconds
        if not self.allows():
            raise TimeIsUp

    def steps(self, data: ExactProblem) -> Callable[[], None]:
        """Return a function to be called before each pivot on a tableau of these data,
        which counts its work.
        """
        return partial(self.spend, data.n**2 * (OF_ENTRY + OF_BIT * data.n * data.bits))
