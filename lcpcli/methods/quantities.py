"""The numbers and vectors of a method's step, each declared once, from which a user may
choose columns of the iterates; tables have them in this order.

A method names its quantities in its declaration, and its iterates carry an object that
has them as attributes, each computed when it is read. Nothing heavy is imported, as
help names them.
"""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """A quantity of the step that has produced an iterate.

    name : the name of the column, and of the attribute.
    meaning : a clause for help.
    is_vector : whether it is of shape (n,), else a number or a text.
    """

    name: str
    meaning: str
    is_vector: bool = False


X = Quantity("x", "the iterate x = (z - w) / 2 itself", is_vector=True)
MERIT = Quantity("f", "f(x) = |F~(p, x)|^2 / 2, which the line search reduces")
SIZE = Quantity("F", "|F~(p, x)| of shi, |F(x)| of fixed-point (Euclidean norms)")
DESCENT = Quantity("d", "d = -grad f where the step starts", is_vector=True)
XI1 = Quantity("xi1", "xi_1 of step 2.3")
XI2 = Quantity("xi2", "xi_2 of step 2.3")
U = Quantity("u", "u of step 2.3", is_vector=True)
V = Quantity("v", "v of step 2.3", is_vector=True)
ALPHA = Quantity("alpha", "alpha of step 2.4; empty where none is best")
DIRECTION = Quantity("s", "the direction s of the step", is_vector=True)
SLOPE = Quantity("slope", "<grad f, s> where the step starts")
LENGTH = Quantity("length", "the length of the step: gamma of step 2.7 of shi")
TRIALS = Quantity("trials", "the trial lengths of the line search")
FACTOR = Quantity("factor", "|F(x)| relative to that of the previous iterate")
OMEGA = Quantity("omega", "omega in use")
INFEASIBILITIES = Quantity("infeasibilities", "the number of violated signs")
ENTERING = Quantity("entering", "the variable that enters the basis")
LEAVING = Quantity("leaving", "the variable that leaves the basis")
Z0 = Quantity("z0", "the artificial variable")
MU = Quantity("mu", "the mean product of slacks and multipliers")
RHO = Quantity("rho", "what is added to the diagonal of the factors")
