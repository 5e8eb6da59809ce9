"""Random programs with and without a feasible point and a minimum."""

from typing import NamedTuple

import numpy as np
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import from_qp
from lcpcli.typing import Vector


class Rows(NamedTuple):
    """min x'Qx / 2 + c'x subject to low <= Ax <= high, lower <= x <= upper."""

    Q: Vector
    c: Vector
    A: Vector
    low: Vector
    high: Vector
    lower: Vector
    upper: Vector
    has_minimum: bool

    def problem(self):
        bounds = {"lower": self.lower, "upper": self.upper}
        sides = {"row_lower": self.low, "row_upper": self.high}
        return from_qp(self.Q, self.c, self.A, **sides, **bounds)


def sparse(rows):
    return rows._replace(Q=csr_array(rows.Q), A=csr_array(rows.A)).problem()


def spread(rows, decades, seed):
    """The same program in units of rows and variables that are far apart, powers of
    two."""
    random = default_rng(seed)
    R, C = (
        2.0 ** random.integers(-(most := int(3.3 * decades)), most, size)
        for size in rows.A.shape
    )
    return rows._replace(
        A=rows.A * R[:, np.newaxis] * C,
        Q=rows.Q * C[:, np.newaxis] * C,
        c=rows.c * C,
        low=rows.low * R,
        high=rows.high * R,
        lower=rows.lower / C,
        upper=rows.upper / C,
    )


def random_program(seed, most=160, kind=""):
    """Return a program of integers: "infeasible" for every even seed, else with a
    minimum, "unbounded" or "both"; dense or sparse, linear or quadratic, with
    equations, inequalities, ranges, free and bounded variables."""
    random = default_rng(seed)
    kind = kind or (
        "infeasible"
        if seed % 2 == 0
        else str(random.choice(["minimum", "minimum", "unbounded", "both"]))
    )
    k = int(np.exp(random.uniform(np.log(14), np.log(most))))
    m = max(2, int(k * random.uniform(0.2, 1.1)))
    size = int(random.choice([1, 5, 100, 1000]))
    density = float(random.choice([1.0, 0.3, 0.1, 3 / k]))
    rank = int(random.integers(1, k + 1))
    A, B = (
        random.integers(-size, size + 1, (rows, k))
        * (random.random((rows, k)) < density)
        for rows in (m, rank)
    )
    A, B = A.astype(float), np.clip(B, -10, 10) * float(random.integers(2))
    x = (random.integers(0, 6, k) * (random.random(k) < 0.5)).astype(float)
    lower, upper = np.zeros(k), np.full(k, np.inf)
    if random.integers(2):
        lower[random.random(k) < 0.3] = -np.inf
        boxed = random.random(k) < 0.2
        upper[boxed] = x[boxed] + random.integers(0, 4, boxed.sum())
    forms = random.choice(4, m, p=(0.25, 0.25, 0.3, 0.2))
    gap = random.integers(0, 4, m).astype(float)
    direction = np.zeros(k)
    if kind in ("unbounded", "both"):
        upper[0] = np.inf
        direction = np.where(np.isfinite(upper), 0.0, random.integers(0, 3, k))
        direction[0] = 1.0
        rise = np.where(forms == 1, 1, np.where(forms == 2, -1, 0)) * random.integers(
            0, 3, m
        )
        A[:, 0], B[:, 0] = A[:, 0] + rise - A @ direction, B[:, 0] - B @ direction
    Q, Ax = B.T @ B, A @ x
    low = np.where(forms == 2, -np.inf, Ax - gap * (forms > 0))
    high = np.where(forms == 1, np.inf, Ax + gap * (forms > 1))
    y = np.where((gap == 0) | (forms == 0), random.integers(1, 5, m), 0) * np.where(
        high == Ax, -1.0, 1.0
    )
    c = A.T @ y + np.where(x == lower, random.integers(0, 4, k), 0) - Q @ x
    c[0] -= max(c @ direction + 1, 0) * direction.any()
    if kind in ("infeasible", "both"):
        A, low, high = _with_contradiction(A, low, high, random)
    return Rows(Q, c, A, low, high, lower, upper, kind == "minimum")


def _with_contradiction(A, low, high, random):
    """Return the rows with one more: a combination of some of them, above the bound
    that follows from these."""
    chosen = random.choice(
        low.size, int(random.integers(1, min(low.size, 12) + 1)), replace=False
    )
    above = np.isfinite(high[chosen])
    factors = random.integers(1, 4, chosen.size) * np.where(above, 1.0, -1.0)
    bound = factors @ np.where(above, high[chosen], low[chosen])
    end = bound + float(random.integers(1, 4))
    return (
        np.vstack((A, factors @ A[chosen])),
        np.append(low, end),
        np.append(high, end if random.integers(2) else np.inf),
    )


def with_rounded_combination(seed, k=40, m=20):
    """Return a linear program with a Gaussian matrix, whose last row is a combination
    of others, rounded to doubles, with another right-hand side."""
    random = default_rng(seed)
    A = random.standard_normal((m, k)) * (random.random((m, k)) < 0.3)
    x = random.random(k)
    factors = random.integers(0, 3, m).astype(float)
    A = np.vstack((A, factors @ A))
    end = A @ x + np.append(np.zeros(m), -1.0)
    return Rows(
        np.zeros((k, k)),
        A.T @ np.ones(m + 1) + random.random(k),
        A,
        end,
        end,
        np.zeros(k),
        np.full(k, np.inf),
        False,
    )


def bounded_program(seed):
    """A definite program with an equation, a range, a row from below and one from
    above, and bounds of every kind."""
    random = default_rng(seed)
    k = 6
    F = random.integers(-3, 4, (k, k)) / 4
    inside = random.integers(-2, 3, k).astype(float)
    A = random.integers(-3, 4, (4, k)).astype(float)
    inside[3] = -0.5
    at = A @ inside
    slack = random.integers(1, 4, (2, 4)) / 2
    return {
        "Q": F @ F.T + np.eye(k) / 2,
        "c": random.integers(-9, 10, k) / 2,
        "A": A,
        "row_lower": np.array(
            [at[0], at[1] - slack[0, 1], at[2] - slack[0, 2], -np.inf]
        ),
        "row_upper": np.array(
            [at[0], at[1] + slack[1, 1], np.inf, at[3] + slack[1, 3]]
        ),
        "lower": np.array([-np.inf, -3.0, -2.5, -0.5, -np.inf, -2.0]),
        "upper": np.array([np.inf, 3.0, np.inf, -0.5, 2.5, np.inf]),
    }
