"""A solution to measure errors against, where the problem does not bring one: solved once, and then made exact.

That is exact where rational arithmetic can be had (the extra `exact`) and n is small. Else the complementary basis of
auto's solution is solved once more with iterative refinement, whose residuals are computed
as if in twice the precision (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002,
section 12.1): the solution of the basis is then right to its last digits as long as its condition number is below
about 1e15.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain, pairwise

import numpy as np

from lcpcli import driver, linalg, scaled
from lcpcli.accuracy import Accuracy
from lcpcli.errors import OptionError
from lcpcli.limits import Limits
from lcpcli.linalg import SingularMatrix
from lcpcli.modulus import x_of
from lcpcli.principal import PrincipalSolver
from lcpcli.problem import Problem, is_sparse
from lcpcli.typing import Matrix, Vector

SECONDS = 10.0  # that the search for a solution may take
REFINEMENTS = 10
PROVED_TO_HAVE_NONE = 3  # as an exit code
LARGEST_EXACT = 200  # n up to which a solution is made exact: in a second
SPLITTER = 2.0**27 + 1  # Dekker's, for a mantissa of 53 bits


def with_reference(problem: Problem, seconds: float = SECONDS) -> Problem:
    """The problem with a computed solution, or as it is where it brings one or none is found in that many seconds.

    The solution is verified like any other result, on the original data. Where the problem has several solutions it
    is one of them.

    Raises
    ------
    KeyboardInterrupt : the search was interrupted.
    """
    if problem.solutions:
        return problem
    result = driver.run(problem, "auto", limits=Limits(time_limit=seconds))
    if result.interrupted:
        raise KeyboardInterrupt
    if result.status.exit_code == PROVED_TO_HAVE_NONE:
        return problem
    exact = _exact(problem, result.z, seconds)
    if exact is not None:
        return replace(problem, solutions=(exact,), reference="exact")
    if not result.solved:
        return problem
    return replace(problem, solutions=(refined(problem, result.z),), reference="computed")


def _exact(problem: Problem, z: Vector, seconds: float) -> Vector | None:
    """An exact solution, rounded, where the problem is small and the extra `exact` is installed: near z, or Lemke's."""
    if problem.n > LARGEST_EXACT or find_spec("flint") is None:
        return None
    from lcpcli.exact import lemke, numbers
    from lcpcli.exact.problem import ExactProblem
    from lcpcli.exact.solution import from_point

    data, deadline = ExactProblem.of_floats(problem), time.perf_counter() + seconds
    solution = from_point(data, z, deadline) or lemke.solve(data, deadline)
    return None if solution is None else numbers.rounded(solution)


def near(problem: Problem, size: float) -> Vector:
    """A start x, shape (n,), off the problem's first solution by normal noise of `size` times its largest component.

    The same for the same problem. Raises OptionError where the problem has no solution.
    """
    if not problem.solutions:
        where = f"{problem.name}: " * bool(problem.name)
        raise OptionError("--warm", f"{where}no solution was found to start near", "leave it out")
    z = problem.solutions[0]
    noise = np.random.default_rng(0).standard_normal(problem.n)
    return x_of(z, problem.w(z)) + size * Accuracy(problem).size * noise


@np.errstate(over="ignore", invalid="ignore")
def refined(problem: Problem, z: Vector) -> Vector:
    """The solution of the complementary basis of z, right to its last digits; z where that is no better.

    problem, z : n unknowns, and an approximate solution of shape (n,).
    """
    units = scaled.scale(problem)
    within = units.problem
    z_scaled = z / units.C
    inside = np.flatnonzero(x_of(z_scaled, within.w(z_scaled)) > 0)
    if not inside.size:
        return np.zeros_like(z)
    solver, b = PrincipalSolver(within.M), -within.q[inside]
    block = solver.block(inside)
    try:
        solve = solver.factorized(block)
    except SingularMatrix:
        return z
    values = solve(b)
    for _ in range(REFINEMENTS):
        change = solve(accurate_residual(block, values, b))
        values += change
        if not np.abs(change).max() > np.finfo(np.float64).eps * np.abs(values).max():
            break
    better = np.zeros_like(z)
    better[inside] = np.maximum(values, 0) * units.C[inside]
    accuracy = Accuracy(problem)
    as_good = accuracy.relative_residual(better, problem.w(better)) <= 2 * accuracy.relative_residual(z, problem.w(z))
    return better if as_good or _at_rounding(problem, better) else z


def accurate_residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """b - A x for A of shape (m, n), dense or in compressed sparse rows, rounded once (barring under- and overflow).

    Every product is split into its rounded value and its error (Dekker 1971), and math.fsum adds them up exactly.
    """
    if is_sparse(A):
        terms, errors = _products(A.data, x[A.indices])
        rows = [slice(start, stop) for start, stop in pairwise(A.indptr.tolist())]
        sums = [
            math.fsum(chain((value,), terms[row], errors[row])) for value, row in zip(b.tolist(), rows, strict=True)
        ]
    else:
        sums = [math.fsum(chain((value,), *_products(row, x))) for value, row in zip(b.tolist(), A, strict=True)]
    return np.array(sums)


def _products(a: Vector, x: Vector) -> tuple[list[float], list[float]]:
    """Two lists that add up to -a_i x_i, entry by entry and without an error."""
    terms = a * x
    a_high, a_low = _split(a)
    x_high, x_low = _split(x)
    errors = a_low * x_low - (((terms - a_high * x_high) - a_low * x_high) - a_high * x_low)
    return (-terms).tolist(), (-errors).tolist()


def _split(v: Vector) -> tuple[Vector, Vector]:
    """v as the sum of two vectors of 26 bits each."""
    large = SPLITTER * v
    high = large - (large - v)
    return high, v - high


def _at_rounding(problem: Problem, z: Vector) -> bool:
    """Whether what is left of min(z, w) is what rounding z to double precision leaves."""
    size = linalg.absolute_product(problem.M, z) + np.abs(problem.q)
    return bool((np.abs(np.minimum(z, problem.w(z))) <= 4 * np.finfo(np.float64).eps * size).all())
