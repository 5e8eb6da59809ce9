"""A priori theory: the convergence rate of `fixed-point`, and the smoothing error of `shi`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lcpcli.diagnosis import contraction
from lcpcli.diagnosis.matrix import Spectrum
from lcpcli.linalg import matrices
from lcpcli.linalg.patterns import affordable
from lcpcli.methods.fixed_point import best_omega
from lcpcli.methods.registry import OMEGA
from lcpcli.methods.shi import default_p
from lcpcli.methods.smoothing import error as smoothing_error
from lcpcli.model.problem import Problem
from lcpcli.model.shifted import shifted
from lcpcli.options import TOL
from lcpcli.typing import Matrix

FORMED = 500  # n up to which the iteration matrix is formed


@dataclass(frozen=True)
class Rate:
    """One omega of the modulus iteration: the factor |T|_2, which bounds the reduction of the error per iteration.

    iterations : upper bound for reducing the error by the default tolerance; None if the factor is not below 1.
    Both are None if unknown.
    """

    omega: float
    factor: float | None
    iterations: int | None


@dataclass(frozen=True)
class Smoothing:
    """The default p of `shi`, in 1 / (units of z), and the bound (ln 3 / p) |M - I|_inf of |F~ - F|, in units of q."""

    p: float
    error: float


def rate(M: Matrix, omega: float, ends: Spectrum | None) -> Rate:
    """The rate for one omega: by the ends of a positive definite spectrum if known, else for small M."""
    if ends is not None and ends.smallest > 0:
        factor = max(abs(omega - end) / (omega + end) for end in (ends.smallest, ends.largest))
        return Rate(omega, factor, _iterations(factor))
    norm = None
    if M.shape[0] <= FORMED:
        with np.errstate(over="ignore", invalid="ignore"):
            norm = contraction.bound(M, omega)
    if norm is None:
        return Rate(omega, None, None)
    return Rate(omega, norm, _iterations(norm))


def rates(M: Matrix, ends: Spectrum | None) -> tuple[Rate, Rate | None]:
    """As published, with omega = 1, and with `fixed_point.best_omega`, for which a symmetric M must be affordable."""
    published = rate(M, OMEGA.value, ends)
    omega = best_omega(M) if affordable(M) or not matrices.is_symmetric(M) else math.inf
    return published, rate(M, omega, ends) if omega < math.inf else None


def smoothing(problem: Problem) -> Smoothing:
    """The difference between F~ and F with the default p of `shi`, which runs with mid(l, u, 0) moved to 0."""
    problem = problem if problem.reference_z is None else shifted(problem).problem
    p = default_p(problem)
    return Smoothing(p, smoothing_error(problem, p))


def _iterations(factor: float) -> int | None:
    tol = TOL.value
    if not factor < 1:
        return None
    return 1 if factor <= tol else math.ceil(math.log(tol) / math.log(factor))
