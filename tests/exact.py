"""What is true of small LCPs and mixed problems, in rational arithmetic, and random
LCPs of every kind to ask about.

Nothing here is shared with the package: it decides by enumeration of the complementary
sets and a tableau simplex.
"""

from fractions import Fraction
from itertools import chain, product

import numpy as np

from lcpcli import Problem

Row = list[Fraction]
SLACKS = {"lower": -1, "basic": 0, "upper": 1}  # signs in the rows


def solution(problem, first=(), number=Fraction):
    """A solution z of the problem whose data are the floats of the problem, each taken
    as a rational number, or None if it has none.

    The states of the unknowns ("lower", "basic", "upper" or "fixed") are enumerated,
    beginning with `first`."""
    M, q = rational(problem, number)
    bounds = _exact_bounds(problem, number)
    candidates = product(*map(_possible_states, *bounds))
    for states in chain([tuple(first)] if first else [], candidates):
        z = of_states(M, q, *bounds, states)
        if z is not None:
            assert solves(problem, z, number)
            return z
    return None


def states_of(problem, z):
    """The state of each unknown at z, in the words of `solution`."""
    bounds = (bound.tolist() for bound in _bounds(problem))
    return [
        "fixed"
        if low == high
        else "lower"
        if value <= low
        else "upper"
        if value >= high
        else "basic"
        for value, low, high in zip(z, *bounds, strict=True)
    ]


def solves(problem, z, number=Fraction):
    M, q = rational(problem, number)
    w = [dot(row, z) + value for row, value in zip(M, q, strict=True)]
    lower, upper = _exact_bounds(problem, number)
    return all(
        low <= a <= high and (b >= 0 or a == high) and (b <= 0 or a == low)
        for a, b, low, high in zip(z, w, lower, upper, strict=True)
    )


def feasible(problem):
    """Whether some z >= 0 has M z + q >= 0."""
    M, q = rational(problem)
    return (
        nonnegative(
            [[*row, *unit(i, len(q), -1)] for i, row in enumerate(M)],
            [-value for value in q],
        )
        is not None
    )


def refutes(problem, y, as_written=False):
    """Whether Farkas' y proves that no z within the bounds has w with the signs that
    they ask for: 0 <= y'w for all such z, while the largest y'(M z + q) of all z within
    the bounds is negative.

    as_written : whether the data are the shortest decimals of the floats rather than
        the floats themselves."""
    number = written if as_written else Fraction
    M, q = rational(problem, number)
    bounds = [
        [number(v) if abs(v) < np.inf else v for v in b.tolist()]
        for b in _bounds(problem)
    ]
    if any(
        (v < 0 and low > -np.inf) or (v > 0 and high < np.inf)
        for v, low, high in zip(y, *bounds, strict=True)
    ):
        return False
    columns = [dot([row[j] for row in M], y) for j in range(problem.n)]
    largest = supremum(columns, *bounds)
    return largest is not None and dot(q, y) + largest < 0


def supremum(a, lower, upper):
    """The supremum of a'z for z within bounds; None if it is infinite."""
    ends = [
        high if value > 0 else low
        for value, low, high in zip(a, lower, upper, strict=True)
    ]
    used = [(value, end) for value, end in zip(a, ends, strict=True) if value]
    if any(abs(end) == np.inf for _, end in used):
        return None
    return sum((value * Fraction(end) for value, end in used), Fraction(0))


def nonnegative(A, b):
    """x >= 0 with A x = b, or None: the first phase of the simplex method with Bland's
    rule."""
    m, n = len(A), len(A[0])
    rows = []
    for i, side in enumerate(b):
        sign = -1 if side < 0 else 1
        rows.append([*(sign * v for v in A[i]), *unit(i, m), sign * side])
    basis = [n + i for i in range(m)]
    cost = [-sum(column, Fraction(0)) for column in zip(*rows, strict=True)]
    cost[n:-1] = [Fraction(0)] * m
    while True:
        entering = next((j for j in range(n) if cost[j] < 0), None)
        if entering is None:
            break
        ratios = [
            (row[-1] / row[entering], basis[i], i)
            for i, row in enumerate(rows)
            if row[entering] > 0
        ]
        _, _, leaving = min(ratios)
        rows[leaving] = [v / rows[leaving][entering] for v in rows[leaving]]
        for row in [row for i, row in enumerate(rows) if i != leaving] + [cost]:
            factor = row[entering]
            if factor:
                row[:] = [
                    v - factor * p for v, p in zip(row, rows[leaving], strict=True)
                ]
        basis[leaving] = entering
    if cost[-1]:
        return None
    x = [Fraction(0)] * n
    for j, row in zip(basis, rows, strict=True):
        if j < n:
            x[j] = row[-1]
    return x


def of_states(M, q, lower, upper, states):
    """A solution with these states, or None: z_N at bounds, z_B between them with w_B =
    0, and signs of w_N."""
    n = len(q)
    basic = [j for j in range(n) if states[j] == "basic"]
    rest = [i for i in range(n) if states[i] in ("lower", "upper")]
    z = [
        Fraction(0 if s == "basic" else u if s == "upper" else v)
        for s, v, u in zip(states, lower, upper, strict=True)
    ]
    w = [dot(row, z) + value for row, value in zip(M, q, strict=True)]
    found = regular([[M[i][j] for j in basic] for i in basic], [-w[i] for i in basic])
    if found is None:
        found = _of_singular_states(M, w, lower, upper, states)
        if found is None:
            return None
    for j, value in zip(basic, found, strict=True):
        if not lower[j] <= value <= upper[j]:
            return None
        z[j] = value
    for i in rest:
        value = w[i] + dot([M[i][j] for j in basic], found)
        if (value < 0) if states[i] == "lower" else (value > 0):
            return None
    return z


def _of_singular_states(M, w, lower, upper, states):
    """z_B for a singular M_BB, as the difference of two nonnegative vectors, by a
    linear program with slacks."""
    basic = [j for j in range(len(w)) if states[j] == "basic"]
    rows = [
        ([M[i][j] for j in basic], -w[i], SLACKS[states[i]])
        for i in range(len(w))
        if states[i] != "fixed"
    ]
    for ends, slack in ((lower, SLACKS["lower"]), (upper, SLACKS["upper"])):
        rows += [
            (unit(k, len(basic)), Fraction(ends[j]), slack)
            for k, j in enumerate(basic)
            if abs(ends[j]) < np.inf
        ]
    A = [
        [*row, *(-v for v in row), *unit(k, len(rows), slack)]
        for k, (row, _, slack) in enumerate(rows)
    ]
    x = nonnegative(A, [value for _, value, _ in rows])
    return None if x is None else [x[k] - x[len(basic) + k] for k in range(len(basic))]


def _possible_states(lower, upper):
    """The states of an unknown with these bounds."""
    if lower == upper:
        return ["fixed"]
    return [*["lower"] * (lower > -np.inf), "basic", *["upper"] * (upper < np.inf)]


def regular(A, b):
    """The solution of A x = b for a regular A, None for a singular one."""
    return solved([(*row, -value) for row, value in zip(A, b, strict=True)], len(b))


def solved(rows, n):
    """The one z with a'z + b = 0 for all rows, if there is exactly one."""
    found = reduced(rows, n)
    if len(found) != n or not all(any(row[:-1]) for row in found):
        return None
    return tuple(-row[-1] for row in sorted(found, key=leading))


def reduced(rows, n):
    """The rows other than 0 of the reduced row echelon form, by the first n
    columns."""
    left, done = [list(row) for row in rows], []
    for column in range(n):
        pivot = next((row for row in left if row[column]), None)
        if pivot is None:
            continue
        left.remove(pivot)
        pivot = [value / pivot[column] for value in pivot]
        for row in left + done:
            factor = row[column]
            if factor:
                row[:] = [a - factor * b for a, b in zip(row, pivot, strict=True)]
        done.append(pivot)
    return [tuple(row) for row in done + left if any(row)]


def leading(row):
    """The place of the first number but 0."""
    return next(j for j, value in enumerate(row) if value)


def determinant(rows):
    """By expansion along the first row."""
    if not rows:
        return Fraction(1)
    first, rest = rows[0], rows[1:]
    minors = (
        (-1) ** j * a * determinant([row[:j] + row[j + 1 :] for row in rest])
        for j, a in enumerate(first)
        if a
    )
    return sum(minors, Fraction(0))


def rational(problem, number=Fraction):
    M = problem.M if isinstance(problem.M, np.ndarray) else problem.M.toarray()
    return [list(map(number, row)) for row in M.tolist()], list(
        map(number, problem.q.tolist())
    )


def _bounds(problem):
    return [
        np.broadcast_to(bound, problem.n) for bound in (problem.lower, problem.upper)
    ]


def _exact_bounds(problem, number):
    """The bounds, finite ones as rational numbers."""
    return [
        [number(value) if abs(value) < np.inf else value for value in bound.tolist()]
        for bound in _bounds(problem)
    ]


def written(value):
    """The shortest decimal of a float, as a fraction."""
    return Fraction(repr(value))


def unit(i, n, value=1):
    return [Fraction(value if j == i else 0) for j in range(n)]


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def positive_definite(random, n):
    A = random.normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


def p_matrix(random, n):
    """Positive definite, not symmetric, with rows and columns scaled, which leaves
    principal minors positive."""
    A, S = random.normal(size=(n, n)), random.normal(size=(n, n))
    return (
        np.exp(random.normal(size=(n, 1)))
        * (A @ A.T + S - S.T + 0.1 * np.eye(n))
        * np.exp(random.normal(size=n))
    )


def semidefinite(random, n):
    A = random.integers(-2, 3, size=(n, max(1, n // 2))).astype(float)
    return A @ A.T


def skew_plus_semidefinite(random, n):
    S = random.integers(-3, 4, size=(n, n)).astype(float)
    return semidefinite(random, n) * random.integers(0, 2) + S - S.T


def z_matrix(random, n):
    A = -random.integers(0, 4, size=(n, n)).astype(float)
    np.fill_diagonal(A, random.integers(-1, 3 * n, size=n))
    return A


def copositive(random, n):
    return semidefinite(random, n) + random.integers(0, 3, size=(n, n))


def indefinite(random, n):
    return random.normal(size=(n, n))


def singular(random, n):
    A = random.normal(size=(n, n))
    A[:, random.integers(n)] = 0
    A[random.integers(n)] *= random.integers(0, 2)
    return A


def small_integers(random, n):
    return random.integers(-2, 3, size=(n, n)).astype(float)


def hollow(random, n):
    """Off-diagonal blocks alone, as of a bimatrix game."""
    k, A = n // 2, np.zeros((n, n))
    A[:k, k:], A[k:, :k] = (
        random.integers(-1, 4, size=(k, n - k)),
        random.integers(-1, 4, size=(n - k, k)),
    )
    return A


CLASSES = {
    function.__name__: function
    for function in (
        positive_definite,
        p_matrix,
        semidefinite,
        skew_plus_semidefinite,
        z_matrix,
        copositive,
        indefinite,
        singular,
        small_integers,
        hollow,
    )
}


def random_problem(seed, largest=6, kind=None):
    """An LCP of at most `largest` unknowns, of one of the CLASSES; q of small integers,
    floats, or degenerate.

    One in four is scaled, row by row and column by column, by powers of two between
    about 1e-8 and 1e8.
    """
    random = np.random.default_rng(seed)
    n = int(random.integers(1, largest + 1))
    name = kind or list(CLASSES)[seed % len(CLASSES)]
    # So that no product M z with integers z is rounded.
    M = np.rint(4096 * CLASSES[name](random, n)) / 4096
    q = [
        lambda: random.integers(-3, 3, size=n).astype(float),
        lambda: random.normal(size=n) - 0.3,
        lambda: (
            np.maximum(random.normal(size=n), 0)
            - M @ (random.integers(0, 2, size=n) * random.integers(0, 3, n))
        ),
    ][random.integers(3)]()
    if random.integers(4) == 0:
        return rescaled(Problem(M, q, name=f"{name}, scaled, seed {seed}"), random)
    return Problem(M, q, name=f"{name}, seed {seed}")


def rescaled(problem, random, powers=26):
    """The problem with rows and columns scaled by powers of two from 2^-powers to
    2^powers: exactly as solvable."""
    R, C = (
        np.exp2(random.integers(-powers, powers + 1, size=problem.n)) for _ in range(2)
    )
    return Problem(R[:, None] * problem.M * C, R * problem.q, name=problem.name)
