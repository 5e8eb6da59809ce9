"""Models in AMPL's format, with the names of their variables and rows."""

from ..files.nl_writing import model

# Supply p + p^2 / 4 = s exceeds the demand 9 / (1 + p) except at the equilibrium price
# 2; v2 is fixed.
MARKET = model(
    3,
    [
        ((5, 1, 1), {0: 0, 1: 1}, ("neg", ("/", "v2", ("+", 1, "v0")))),
        ((4, 0), {0: 1, 1: -1}, ("/", ("^", "v0", 2), 4)),
    ],
    [(2, 0), (3,), (4, 9)],
    start={0: 1, 1: 1},
)
LINEAR = model(1, [((5, 1, 1), {0: 2}, -3)], [(2, 0)])
UNDEFINED = model(1, [((5, 1, 1), {0: 0}, ("log", ("-", -1, "v0")))], [(2, 0)])
INFEASIBLE = model(1, [((5, 1, 1), {0: -1}, -1)], [(2, 0)])
PLANT = model(1, [((5, 1, 1), {0: 2}, -10)], [(0, 0, 3)])
# Three solutions, (2, 0), (0, 2) and (2/3, 2/3).
CHOICE = model(
    2,
    [((5, 1, 1), {0: 1, 1: 2}, -2), ((5, 1, 2), {0: 2, 1: 1}, -2)],
    [(2, 0), (2, 0)],
    objective=("+", ("neg", ("-", "v0", "v1")), -3),
)
# The solutions are all (t, 0) with t >= 0.
UNBOUNDED = model(
    2,
    [((5, 1, 1), {1: 1}, 0), ((5, 1, 2), {1: 1}, 0)],
    [(2, 0), (2, 0)],
    objective=("neg", "v0"),
)
HOPELESS = model(
    1, [((4, 0), {0: 0}, ("+", 1, ("square", "v0")))], [(3,)], start={0: 0.5}
)
# Two equations for x, and none for y.
SINGULAR = model(
    2,
    [((4, 0), {0: 1}, ("exp", "v0")), ((4, 0), {0: 2}, ("square", "v0"))],
    [(3,), (3,)],
)
CURVED = model(1, [((5, 1, 1), {0: 0}, ("-", ("exp", "v0"), 40))], [(0, 0, 3)])
TWICE = model(1, 2 * [((5, 1, 1), {0: 1}, 0)], [(2, 0)])

FILES = {
    "market.nl": MARKET,
    "market.col": b"price\nsupply\nincome\n",
    "linear.nl": LINEAR,
    "undefined.nl": UNDEFINED,
    "hopeless.nl": HOPELESS,
    "infeasible.nl": INFEASIBLE,
    "choice.nl": CHOICE,
    "unbounded.nl": UNBOUNDED,
    "plant.nl": PLANT,
    "plant.col": b"plant\n",
    "singular.nl": SINGULAR,
    "empty.nl": b"",
    "curved.nl": CURVED,
    "curved.col": b"plant\n",
    "twice.nl": TWICE,
    "twice.col": b"price\n",
    "twice.row": b"market\nclearing\n",
}
