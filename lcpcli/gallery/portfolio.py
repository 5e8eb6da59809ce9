"""Portfolios of least variance: H. Markowitz, Portfolio selection, J. Finance 7 (1952) 77-91; with a factor model of
the covariance as in B. Stellato et al., OSQP, Math. Program. Comput. 12 (2020) 637-672, appendix A.4. The numbers are
random.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_qp

CLASS = "positive semidefinite"
SOURCE = "Markowitz 1952, random factor model"
DENSITY = 0.5  # of the loadings


def portfolio(n: int, seed: int, *, most: float = 0.2) -> Problem:
    """The portfolio of k assets and k // 10 + 1 factors, about n unknowns with the multipliers of the rows.

    Minimize x'Dx + y'y subject to y = F'x, shares x that add up to 1, 0 <= x <= most, and an expected return from 3 %
    on and up to 12 %.

    most : the largest share, 0 < most <= 1; at least 2 / k of it are needed.
    """
    require("most", most, 0 < most <= 1, "0 < most <= 1")
    from scipy.sparse import csr_array, diags_array, random_array, vstack

    k = max(3, round((n - 5) / 1.2))
    factors = k // 10 + 1
    random = np.random.default_rng([seed, k])
    F = random_array((k, factors), density=DENSITY, rng=random, data_sampler=random.standard_normal)
    risk = random.uniform(0.0, np.sqrt(factors), k)
    returns = random.integers(0, 16, k) / 100
    returns[:2] = 0.03, 0.12  # so that there is a portfolio with any return between
    k_and_factors = np.concatenate((np.ones(k), np.zeros(factors)))
    A = vstack(
        [
            csr_array(np.stack([k_and_factors, np.concatenate((returns, np.zeros(factors)))])),
            csr_array(np.block([[F.T.toarray(), -np.eye(factors)]])),
        ]
    )
    share = max(most, 2.0 / k)
    return from_qp(
        2.0 * diags_array(np.concatenate((risk, np.ones(factors)))),
        np.zeros(k + factors),
        A,
        row_lower=np.concatenate(([1.0, 0.03], np.zeros(factors))),
        row_upper=np.concatenate(([1.0, 0.12], np.zeros(factors))),
        lower=np.concatenate((np.zeros(k), np.full(factors, -np.inf))),
        upper=np.concatenate((np.full(k, share), np.full(factors, np.inf))),
        name=f"portfolio-{k + 2 * factors + 3}",
        source=SOURCE,
        note=f"{k} assets, {factors} factors, at most {share:g} in one asset.",
    )
