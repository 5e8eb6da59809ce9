"""The American put: P. Wilmott, J. Dewynne, S. Howison, Option Pricing: Mathematical Models and Computation, Oxford
Financial Press (1993), chapters on the American option as a linear complementarity problem.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "Wilmott, Dewynne and Howison 1993"
WIDEST = 2.0  # the grid reaches from exp(-2) to exp(2) times the exercise price


def american_put(n: int, _seed: int, *, volatility: float = 0.4, rate: float = 0.1, years: float = 0.5) -> Problem:
    """One fully implicit time step backwards from expiry by `years`, in the variables of the heat equation.

    With x = log(S / E), t = volatility^2 years / 2, k = 2 rate / volatility^2 and the payoff
    g(x, t) = exp((k + 1)^2 t / 4) max(exp((k - 1) x / 2) - exp((k + 1) x / 2), 0), the unknown is z = u - g at n
    interior points of -2 < x < 2, where u solves u_t >= u_xx, u >= g and complementarity. M is tridiagonal and sparse.

    volatility, rate : per year, as fractions; years : the length of the step; all from 0.001 to 10.
    """
    for name, value in (("volatility", volatility), ("rate", rate), ("years", years)):
        require(name, value, 0.001 <= value <= 10, f"0.001 <= {name} <= 10")
    from lcpcli.gallery.tridiagonal import second_difference

    k, t = 2 * rate / volatility**2, volatility**2 * years / 2
    x = np.linspace(-WIDEST, WIDEST, n + 2)
    growth = (k + 1) ** 2 * t / 4
    require("rate", rate, k <= 100 and growth <= 500, "small compared with the square of the volatility")
    expiry = np.maximum(np.exp((k - 1) * x / 2) - np.exp((k + 1) * x / 2), 0)
    payoff = math.exp(growth) * expiry
    alpha = t / (x[1] - x[0]) ** 2
    q = payoff[1:-1] - alpha * np.diff(payoff, 2) - expiry[1:-1]
    return Problem(
        alpha * second_difference(n, 2 + 1 / alpha),
        q,
        name=f"american-put-{n}",
        source=SOURCE,
        note="The option is held where z > 0 and exercised where z = 0.",
    )
