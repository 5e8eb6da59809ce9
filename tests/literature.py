"""Nonlinear complementarity problems of the literature, with the starts from which they
are usually solved.

Most are in S. P. Dirkse and M. C. Ferris, MCPLIB, Optimization Methods and Software 5
(1995) 319-345.
"""

import numpy as np

from lcpcli.gallery.systems import grid, laplacian_of
from lcpcli.model.nonlinear import NonlinearProblem


def kojima_shindo():
    """Four polynomials, with a degenerate and a nondegenerate solution.

    M. Kojima, S. Shindo, Journal of the Operations Research Society of Japan 29 (1986)
    352-374.
    """
    return _polynomials(
        "kojima-shindo",
        (10.0, 9.0, 9.0),
        [[1.5**0.5, 0.0, 0.0, 0.5], [1.0, 0.0, 3.0, 0.0]],
    )


def josephy():
    """Four polynomials that differ from those of `kojima_shindo` in three numbers, with
    one solution.

    N. H. Josephy, Newton's method for generalized equations, MRC Technical Report 1965,
    University of Wisconsin (1979).
    """
    return _polynomials("josephy", (3.0, 3.0, 1.0), [[1.5**0.5, 0.0, 0.0, 0.5]])


def _polynomials(name, numbers, solutions):
    a, b, c = numbers
    # The coefficients of z_1^2, z_1 z_2 and z_2^2.
    squares = _rows("3 2 2; 2 0 1; 3 1 2; 1 0 3")
    linear = _rows(f"0 0 1 3; 1 0 {a} 2; 0 0 2 {b}; 0 0 2 3")

    def F(z):
        return np.asarray(
            squares @ [z[0] ** 2, z[0] * z[1], z[1] ** 2] + linear @ z - [6, 2, c, 3]
        )

    def J(z):
        return np.asarray(
            squares @ [[2 * z[0], 0, 0, 0], [z[1], z[0], 0, 0], [0, 2 * z[1], 0, 0]]
            + linear
        )

    return NonlinearProblem(F, J, x0=np.zeros(4), name=name, solutions=solutions)


def billups():
    """(z - 1)^2 - 1.01 from 0, where merit functions have a local minimum; the solution
    is 1 + 1.01^(1/2).

    S. C. Billups, Algorithms for complementarity problems, thesis, University of
    Wisconsin (1995).
    """
    functions = (lambda z: (z - 1) ** 2 - 1.01), (lambda z: [2 * (z - 1)])
    return NonlinearProblem(
        *functions, x0=[0.0], name="billups", solutions=[[1 + 1.01**0.5]]
    )


def mathiesen():
    """A Walrasian equilibrium; the solutions are (t, 0, 0, 0) for t from 0 to 3.

    L. Mathiesen, Mathematical Programming 37 (1987) 1-18; in the form of J.-S. Pang, S.
    A. Gabriel, ibid. 60 (1993) 295-337.
    """

    def F(z):
        return [
            -z[1] + z[2] + z[3],
            z[0] - (4.5 * z[2] + 2.7 * z[3]) / (z[1] + 1),
            5 - z[0] - (0.5 * z[2] + 0.3 * z[3]) / (z[2] + 1),
            3 - z[0],
        ]

    return NonlinearProblem(F, x0=np.ones(4), name="mathiesen")


def nash_cournot(firms=10):
    """The outputs of 5 or 10 firms in a Nash-Cournot equilibrium: no firm gains by
    changing its output alone.

    F. H. Murphy, H. D. Sherali, A. L. Soyster, Mathematical Programming 24 (1982)
    92-106; P. T. Harker, ibid. 41 (1988) 29-59.
    """
    if firms == 5:
        costs = np.arange(10.0, 0, -2)
        capacities = 0.2
        elasticity = 1.1
        powers = 1 / np.array([1.2, 1.1, 1.0, 0.9, 0.8])
    else:
        costs = np.array([5.0, 3, 8, 5, 1, 3, 7, 4, 6, 3])
        capacities = 10.0
        elasticity = 1.2
        powers = 1 / np.array([1.2, 1.0, 0.9, 0.6, 1.5, 1.0, 0.7, 1.1, 0.95, 0.75])

    def F(z):
        price = (5000 / z.sum()) ** (1 / elasticity)
        return np.asarray(
            costs
            + (capacities * z) ** powers
            - price * (1 - z / (elasticity * z.sum()))
        )

    return NonlinearProblem(
        F, x0=np.ones(costs.size), name=f"nash-cournot-{costs.size}"
    )


def scarf():
    """Prices of six goods, activities of eight sectors and incomes of five agents; the
    income of the first agent is the numeraire.

    H. Scarf with T. Hansen, The Computation of Economic Equilibria, Yale University
    Press (1973).
    """
    endowments = _rows(
        "0 0 0 0 0; 0 0 0 0 0; 1 2 1.5 1 2; 3 .1 2 1 6; 5 .1 6 .1 .1; .1 7 .1 8 .5"
    )
    demands = _rows(
        "4 .4 2 5 3; 2 4 2 5 4; 3.2 1 1.5 4.5 2; 0 0 0 0 0; .2 0 .5 0 0; 0 .6 0 .2 .2"
    )
    elasticities = np.array([1.2, 1.6, 0.8, 0.5, 0.6])
    activities = _rows(
        "4 4 1.6 1.6 1.6 .9 7 8; 0 0 6 8 7 0 0 0; 4 3.5 0 0 0 0 0 0;"
        "-5.3 -5 -2 -2 -2 -1 -4 -5; -2 -1 -2 -4 -1 0 -3 -2; -1 -6 -3 -1 -8 0 -1 -8"
    )
    shares = demands / demands.sum(axis=0)

    def F(z):
        p = z[:6]
        y = z[6:14]
        income = z[14:]
        prices = p[:, np.newaxis]
        index = (shares * prices ** (1 - elasticities)).sum(axis=0)
        bought = (income / index * shares * prices**-elasticities).sum(axis=1)
        supplied = activities @ y + endowments.sum(axis=1)
        return np.concatenate(
            [supplied - bought, -activities.T @ p, income - endowments.T @ p]
        )

    start = np.concatenate([np.ones(14), endowments.sum(axis=0)])
    lower, upper = np.zeros(19), np.full(19, np.inf)
    lower[np.flatnonzero(shares.max(axis=1) > 0)] = 1e-5
    lower[14] = upper[14] = start[14]
    return NonlinearProblem(F, lower=lower, upper=upper, x0=start, name="scarf")


def _rows(text):
    return np.array([row.split() for row in text.split(";")], dtype=float)


def bratu(m=75, load=6.0):
    """-u_xx - u_yy = load e^u on (0, 1)^2 with an obstacle below and above, with sparse
    J on an m x m grid.

    J. J. Moré, G. Toraldo, SIAM Journal on Optimization 1 (1991) 93-113; E. D. Dolan,
    J. J. Moré and T. S. Munson, Benchmarking optimization software with COPS 3.0
    (2004).
    """
    from scipy.sparse import diags_array

    (_, h, x, y), laplacian = grid(m * m), laplacian_of(m)
    lower = np.maximum(0.0, 0.6 - 8 * ((x - 0.3) ** 2 + (y - 0.3) ** 2)).ravel()
    functions = (
        lambda u: laplacian @ u - h**2 * load * np.exp(u),
        lambda u: (laplacian - diags_array(h**2 * load * np.exp(u))).tocsr(),
    )
    return NonlinearProblem(
        *functions, lower=lower, upper=np.full(m * m, 1.2), name=f"bratu-{m}x{m}"
    )


def elastohydrodynamic(n=100):
    """The pressure in an oil film between two elastic cylinders, on n grid points, and
    the constant of the gap.

    M. M. Kostreva, International Journal for Numerical Methods in Fluids 4 (1984)
    377-397.
    """
    begin = -3.0
    end = 2.0
    viscosity = 2.832
    speed = 6.057
    dx, grid = (end - begin) / n, np.arange(n + 1)
    weights = np.where((grid == 0) | (grid == n), 0.5, 1.0)
    apart = grid - grid[:, np.newaxis] - 0.5
    kernel = weights * apart * dx * np.log(np.abs(apart) * dx) / np.pi
    parabola = (begin + (grid + 0.5) * dx) ** 2 + 1

    def F(z):
        k, p = z[0], np.concatenate([[0.0], z[1:], [0.0]])
        gap = parabola + k + kernel @ (p[1:] - np.concatenate([[0.0], p[:-2]]))
        means, slopes = (p[1:] + p[:-1]) / 2, np.diff(p)
        flow = speed * gap / dx - gap**3 * slopes * np.exp(-viscosity * means) / dx**2
        return np.concatenate(
            [[1 - 2 * dx / np.pi * (weights[1:] @ z[1:])], np.diff(flow)]
        )

    start = np.maximum(0.0, 1 - np.abs(begin + 1 + grid[1:] * dx) / 2)
    lower = np.zeros(n + 1)
    lower[0] = -np.inf
    return NonlinearProblem(
        F,
        lower=lower,
        x0=np.concatenate([[1.6], start]),
        name=f"elastohydrodynamic-{n}",
    )


FAMILIES = {
    family.__name__.replace("_", "-"): family
    for family in (
        kojima_shindo,
        josephy,
        billups,
        mathiesen,
        nash_cournot,
        scarf,
        bratu,
        elastohydrodynamic,
    )
}
