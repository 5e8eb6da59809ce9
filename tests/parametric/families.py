"""Pairs of problems with one M, from seeds; random mixed problems, directions for their
data, and the differences of exact solutions in them."""

from fractions import Fraction

import numpy as np
from numpy.random import default_rng
from scipy import sparse

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.matrices import dense

from .. import mixed_problems


def positive(seed, least=5, most=50):
    """Return two problems whose M is positive definite, so a P-matrix, and not
    symmetric; one in three with bounds, one in three with bounds that move."""
    random = default_rng(seed)
    n = int(random.integers(least, most + 1))
    A, K = random.standard_normal((2, n, n))
    M = A @ A.T / n + 0.1 * np.eye(n) + K - K.T
    first, last = random.standard_normal((2, n))
    lower, upper = -random.random(n), random.random(n)
    given = [{}, {}]
    if seed % 3:
        given = [{"lower": lower, "upper": upper}] * 2
    if seed % 3 == 2:
        given[1] = {
            "lower": lower - random.random(n),
            "upper": upper + random.random(n),
        }
    return Problem(M, first, **given[0]), Problem(M, last, **given[1])


def integers(seed, most=12):
    """Return two problems of small integers, with many ties: M positive definite,
    semidefinite, triangular with a unit diagonal, or that of linear programs."""
    random, kind = default_rng(seed), seed % 4
    n = int(random.integers(2, most + 1))
    first, last = random.integers(-1, 2, (2, n))
    if kind == 0:
        A = random.integers(-1, 2, (n, n))
        M = A @ A.T + 2 * np.eye(n)
    elif kind == 1:
        A = random.integers(-1, 2, (n, max(1, n // 2)))
        M = A @ A.T
    elif kind == 2:
        M = np.tril(random.integers(0, 3, (n, n)), -1) + np.eye(n)
    else:
        k = n // 2
        A, M = random.integers(-1, 2, (n - k, k)), np.zeros((n, n))
        M[k:, :k], M[:k, k:] = A, -A.T
    return Problem(M, np.abs(first) if kind % 2 else first), Problem(M, last)


def boxed(seed):
    """Return two problems of small integers with bounds, some of them equal, and for
    every third seed moving."""
    random = default_rng(seed)
    n = int(random.integers(2, 9))
    A = random.integers(-3, 4, (n, n))
    M = A @ A.T + np.eye(n) + np.triu(A) - np.triu(A).T
    lower = random.integers(-2, 1, n).astype(float)
    upper = lower + random.integers(0, 3, n)
    moved = random.integers(-1, 2, (2, n)) * (seed % 3 == 0)
    last_lower = lower + moved[0]
    last_upper = np.maximum(last_lower, upper + moved[1])
    free = random.integers(0, n)
    upper[free] = last_upper[free] = np.inf
    first, last = random.integers(-2, 3, (2, n))
    return Problem(M, first, lower=lower, upper=upper), Problem(
        M, last, lower=last_lower, upper=last_upper
    )


def general(seed):
    """Return two problems whose M has no class, or is copositive, n <= 5, of which the
    first is solved by 0."""
    random = default_rng(seed)
    n = int(random.integers(2, 6))
    M = random.integers(-9, 10, (n, n))
    if seed % 2:
        M = np.abs(M) * random.integers(0, 2, (n, n))
    return Problem(M, random.integers(1, 20, n)), Problem(
        M, random.integers(-19, 20, n)
    )


def sparsely(pair):
    """Return the same problems with a sparse M."""
    M = sparse.csr_array(pair[0].M)
    first, last = (
        Problem(M, each.q, lower=each.lower, upper=each.upper) for each in pair
    )
    return first, last


DATA = ("M", "q", "lower", "upper")
# Data and changes are multiples of 1 / SCALE: with a STEP that is a power of 2, nothing
# is rounded.
SCALE = 64
STEP = 2.0**-24


def rounded(values):
    return np.rint(SCALE * values) / SCALE


def random_problem(n, random, mixed):
    """M is positive definite, not symmetric; if mixed with bounds of all kinds, fixed
    and free variables too."""
    M, q = mixed_problems.monotone(n, random)
    if not mixed:
        return Problem(rounded(M) + np.eye(n), rounded(q))
    lower, upper = map(rounded, mixed_problems.with_all_bounds(n, random))
    return Problem(rounded(M) + np.eye(n), rounded(q), lower=lower, upper=upper)


def random_change(problem, random):
    """A direction for all data; bounds that do not exist stay, and those of fixed
    variables move together."""
    n, (low, high) = problem.n, problem.box.vectors(problem.n)
    moves = rounded(random.normal(size=(2, n)))
    moves[1, low == high] = moves[0, low == high]
    moves[np.isinf((low, high))] = 0.0
    dM, dq = rounded(random.normal(size=(n, n))), rounded(random.normal(size=n))
    return {"dM": dM, "dq": dq, "dlower": moves[0], "dupper": moves[1]}


def exact_z(problem, change, h):
    """The solution in fractions of the problem with its data plus h times the change,
    which doubles represent."""
    data = dense(problem.M), problem.q, *problem.box.vectors(problem.n)
    moved = {
        name: own + h * change.get(f"d{name}", 0.0)
        for name, own in zip(DATA, data, strict=True)
    }
    return lcpcli.exact(Problem(**moved)).exact.z


def exact_derivative(problem, change, h=STEP):
    """The central difference of exact solutions: exact for changes of q and of bounds,
    else with an error of h^2."""
    ends = zip(exact_z(problem, change, h), exact_z(problem, change, -h), strict=True)
    return np.array([float((a - b) / Fraction(2 * h)) for a, b in ends])
