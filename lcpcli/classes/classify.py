"""Matrix classes of M, with evidence. One module per property or group of properties.

The entries of M are taken as exact numbers, and no "yes" or "no" depends on rounding: what is found in double precision
is either guaranteed by an error bound or decided in exact arithmetic, or else it is "not decided".
"""

from __future__ import annotations

from lcpcli import clock
from lcpcli.classes.context import Context
from lcpcli.classes.copositive import copositive, copositive_plus, strictly_copositive
from lcpcli.classes.definite import positive_definite, positive_semidefinite
from lcpcli.classes.dominance import h_plus, m_matrix
from lcpcli.classes.entries import skew_symmetric, strictly_diagonally_dominant, symmetric, z_matrix
from lcpcli.classes.minors import p0_matrix, p_matrix
from lcpcli.classes.sufficient import column_sufficient, row_sufficient
from lcpcli.classes.verdict import UNDECIDED, Late, Verdict
from lcpcli.options import INSPECTION_SECONDS
from lcpcli.typing import Matrix

# each test relies on those before it
CLASSES = {
    "symmetric": symmetric,
    "skew_symmetric": skew_symmetric,
    "z_matrix": z_matrix,
    "strictly_diagonally_dominant": strictly_diagonally_dominant,
    "h_plus": h_plus,
    "m_matrix": m_matrix,
    "positive_definite": positive_definite,
    "positive_semidefinite": positive_semidefinite,
    "p_matrix": p_matrix,
    "p0_matrix": p0_matrix,
    "column_sufficient": column_sufficient,
    "row_sufficient": row_sufficient,
    "copositive": copositive,
    "strictly_copositive": strictly_copositive,
    "copositive_plus": copositive_plus,
}


def classify(M: Matrix, seconds: float = INSPECTION_SECONDS, last: str = "") -> dict[str, Verdict]:
    """For each of CLASSES whether M, dense or sparse of shape (n, n) with finite entries, belongs to it.

    seconds : after which no further expensive test is started; implications are still reported. A factorization in
        progress is not interrupted.
    last : the class after which to stop; "" for none.
    """
    context = Context(M, clock.seconds() + seconds)
    for name, test in CLASSES.items():
        try:
            context.verdicts[name] = test(context)
        except Late:
            context.verdicts[name] = Verdict(UNDECIDED, f"the time of {seconds:g} s was used up")
        if name == last:
            break
    return context.verdicts
