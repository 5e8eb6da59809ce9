"""F. E. Curtis, Z. Han, D. P. Robinson, A globally convergent primal-dual active-set framework for large-scale convex
quadratic optimization, Comput. Optim. Appl. 60 (2015) 311-341.
"""

from __future__ import annotations

from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "Curtis, Han and Robinson 2015"
SIZE = 3


def curtis_han_robinson(_n: int, _seed: int) -> Problem:
    """Three unknowns, the solution (0, 4/19, 11/19), and an x0 from which plain active-set exchanges cycle."""
    return Problem(
        [[4, 5, -5], [5, 9, -5], [-5, -5, 7]],
        [2, 1, -3],
        name="curtis-han-robinson",
        x0=[-1, 1, -1],
        solutions=[[0, 4 / 19, 11 / 19]],
        source=SOURCE,
        note="The Newton iteration without safeguards cycles from x0, although M is symmetric positive definite.",
    )
