"""The modulus fixed point iteration for the LCP.

U. Schäfer, On the modulus algorithm for the linear complementarity problem, Operations
Research Letters 32 (2004) 350-354, after W. M. G. van Bokhoven, Piecewise-linear
modelling and analysis, Kluwer (1981); with a parameter omega, Z.-Z. Bai, Modulus-based
matrix splitting iteration methods for linear complementarity problems, Numerical Linear
Algebra with Applications 17 (2010) 917-933. `anderson` accelerates it (H. F. Walker and
P. Ni 2011).
"""

from __future__ import annotations

import math
from collections import deque
from functools import cached_property, partial

import numpy as np

from lcpcli.linalg import factors, matrices
from lcpcli.linalg.krylov import extreme_eigenvalues, norm, safe_norm
from lcpcli.methods.registry import ANDERSON, OMEGA
from lcpcli.methods.stages import Breakdown, Iterate, Stage, Stalled, ended
from lcpcli.model.problem import Problem
from lcpcli.options import AUTO
from lcpcli.typing import Matrix, Vector


def fixed_point(
    problem: Problem,
    x0: Vector,
    *,
    omega: float | str = OMEGA.value,
    anderson: int = int(ANDERSON.value),
) -> Stage:
    """Iterate (omega I + M) x_(k+1) = (omega I - M) |x_k| - q, with z = |x| + x and w =
    omega (|x| - x).

    With bounds, z - x for z = mid(l, u, 2x) replaces |x|, an extension with the same
    rate: z - x is nonexpansive in x, as |x| is.

    For symmetric positive definite M it converges linearly for every omega > 0, with
    contraction factor max |omega - lambda| / |omega + lambda| over the eigenvalues
    lambda of M (van Bokhoven 1981; Schäfer 2004, who treats classes of H-matrices too);
    elsewhere it may diverge. It costs one factorization, then one product with M and
    one solve per iteration, and a second product if accelerated.

    If accelerated, x_(k+1) is computed as above, but from a combination of the last
    iterates instead of x_k. For omega, "auto" means `best_omega`, at the cost of
    one more factorization.

    Yields x1, x2, ... with F(x) = M z - w + q, at no cost: F(x_k) is the change of
    (omega I - M) |x| from x_(k-1) to x_k. Stalled : the iterates have stopped changing.
    Breakdown : omega I + M is singular, which is detected at once.
    """
    omega = best_omega(problem.M) if omega == AUTO else float(omega)
    try:
        solve = factors.checked_solver(problem.M, omega)
    except factors.SingularMatrix:
        name = "I + M" if omega == 1 else f"{omega:g} I + M"
        reason = (
            f"{name} is singular to working precision, so the iteration is not "
            "defined; try another omega"
        )
        return ended(Breakdown(reason))
    return _iterates(
        problem,
        x0,
        omega,
        Anderson(int(anderson), problem.n) if anderson else None,
        solve,
    )


def _iterates(
    problem: Problem,
    x: Vector,
    omega: float,
    accelerator: Anderson | None,
    solve: factors.Solve,
) -> Stage:
    M = problem.M
    q = problem.q
    box = problem.box
    evaluations = 1
    image = _image(M, omega, box.reflected(x))
    before: Vector | Start = Start(problem, x, omega, image)
    while True:
        base, base_image = x, image
        x = solve(base_image - q)
        image = _image(M, omega, box.reflected(x))
        evaluations += 1
        F = base_image - image
        step = partial(Residual, F, before, omega)
        yield Iterate(x, F, "", evaluations, quantities=step)
        before = F
        if np.array_equal(x, base):
            return Stalled("the iterates have stopped changing in double precision")
        if accelerator is not None:
            combined = accelerator.next(base, x)
            if combined is not x:
                x, image = combined, _image(M, omega, box.reflected(combined))


class Start:
    """The quantities of the start, whose F costs a product with M that the iteration
    itself does not need."""

    def __init__(
        self, problem: Problem, x: Vector, omega: float, image: Vector
    ) -> None:
        self._problem = problem
        self._x = x
        self.omega = omega
        self._image = image

    @cached_property
    def F(self) -> float:
        x, of_x = self._x, matrices.product(self._problem.M, self._x)
        return safe_norm(self.omega * x + of_x - self._image + self._problem.q)


class Residual:
    """The quantities of an iterate. F, before : F(x) there and at the previous iterate,
    or the start."""

    def __init__(self, F: Vector, before: Vector | Start, omega: float) -> None:
        self._F = F
        self._before = before
        self.omega = omega

    @property
    def of_start(self) -> Start | None:
        return self._before if isinstance(self._before, Start) else None

    @cached_property
    def F(self) -> float:
        return safe_norm(self._F)

    @property
    def factor(self) -> float | None:
        before = self._before
        size = before.F if isinstance(before, Start) else safe_norm(before)
        return self.F / size if size else None


def _image(M: Matrix, omega: float, distance: Vector) -> Vector:
    """Return (omega I - M) |x| for |x|, which is overwritten, with one product with
    M."""
    image = matrices.product(M, distance)
    distance *= omega
    return np.subtract(distance, image, out=image)


def best_omega(M: Matrix) -> float:
    """Return an almost optimal omega > 0 for the modulus iteration (omega I + M) x' =
    (omega I - M) |x| - q.

    M symmetric positive definite: sqrt(lambda_min lambda_max) minimizes the contraction
    factor max |omega - lambda| / |omega + lambda|; both are estimated by a few steps of
    power and inverse iteration, for which M is factorized. Rough estimates suffice: the
    factor is flat around its minimum. Any other M: the largest diagonal entry, the
    smallest scalar omega for which Bai (2010) proves convergence for H-matrices with
    positive diagonal; if no diagonal entry is positive, the largest row sum of |M|.
    """
    eigenvalues = extreme_eigenvalues(M)
    if eigenvalues is not None:
        omega = float(np.sqrt(eigenvalues[0]) * np.sqrt(eigenvalues[1]))
        if 0 < omega < np.inf:
            return omega
    diagonal = float(M.diagonal().max())
    return diagonal if diagonal > 0 else matrices.norm_inf(M) or 1.0


# Growth of |g - x| over its minimum at which the memory is cleared.
RESTART_GROWTH = 2.0
# Added to the Gram matrix, relative to its trace, against almost dependent differences.
GRAM_RIDGE = 1e-14


class Anderson:
    """The accelerated sequence of x -> g(x): call next(x, g(x)) for the next x.

    It takes g - sum gamma_i (g_(i+1) - g_i) over the last `memory` pairs, where gamma
    minimizes |f - sum gamma_i (f_(i+1) - f_i)|_2 for f = g - x. When |f|_2 exceeds
    RESTART_GROWTH times its minimum since the last restart, the iteration restarts from
    the minimum, with a plain step and an empty memory; so a contraction is never made
    to diverge. It keeps 2 memory + 4 vectors, and costs a few products with memory x n
    arrays per step.
    """

    def __init__(self, memory: int, n: int) -> None:
        self._memory = min(memory, n)
        self._restart()

    def _restart(self) -> None:
        # The changes of f and of g.
        self._changes = deque[tuple[Vector, Vector]](maxlen=self._memory)
        self._last: tuple[Vector, Vector] | None = None
        self._smallest, self._best = math.inf, np.empty(0)

    def next(self, x: Vector, g: Vector) -> Vector:
        f = g - x
        size = norm(f)
        if size > RESTART_GROWTH * self._smallest:
            best = self._best
            self._restart()
            return best
        if not size < np.inf:
            return g
        if size < self._smallest:
            self._smallest, self._best = size, g
        if self._last is not None:
            self._changes.append((f - self._last[0], g - self._last[1]))
        self._last = f, g
        if not self._changes or size == 0:
            return g
        df, dg = (np.array(changes) for changes in zip(*self._changes, strict=True))
        gram = np.einsum("ij,kj->ik", df, df)
        ridge = GRAM_RIDGE * float(np.trace(gram)) * np.eye(len(gram))
        gamma = np.linalg.lstsq(
            factors.finite(gram + ridge), np.einsum("ij,j->i", df, f), rcond=None
        )[0]
        return np.asarray(g - np.einsum("i,ij->j", gamma, dg))
