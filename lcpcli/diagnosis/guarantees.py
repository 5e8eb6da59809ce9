"""Which methods are guaranteed to find a solution, or a proof that there is none, for what class of M.

The statements are those of the methods' own modules, which name the sources, and hold in exact arithmetic. For
`fixed-point`, |T|_2 < 1 holds for every omega > 0 if v'Mv > 0 for all v != 0, since |(omega I + M)v|^2 exceeds
|(omega I - M)v|^2 by 4 omega v'Mv, and Bai (2010) has convergence for H+-matrices if omega is at least the largest
diagonal entry. For `shi`, level sets are bounded for P-matrices, whose F is a homeomorphism.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict
from lcpcli.methods.registry import ANY, METHODS, OMEGA, Method

SETTLED = 12  # unknowns up to which the exhaustive search of milp always terminates, see enumeration.MAX_NODES

Classes = dict[str, Verdict]

CALLED = {
    "p_matrix": "a P-matrix",
    "strictly_copositive": "strictly copositive",
    "copositive_plus": "copositive-plus",
    "row_sufficient": "row sufficient",
    "positive_definite": "positive definite",
    "h_plus": "an H+-matrix",
}


@dataclass(frozen=True)
class Guarantee:
    """word : YES, NO or UNDECIDED, if the decisive classes are not decided. reason : why, as a clause."""

    word: str
    reason: str


def guarantees(classes: Classes, n: int, largest: float) -> dict[str, Guarantee]:
    """For each of `methods.registry.METHODS` whether it is guaranteed, given what is known of M.

    largest : the largest diagonal entry of M, of shape (n, n).
    """
    return {name: _guarantee(method, classes, n, largest) for name, method in METHODS.items()}


def _guarantee(method: Method, classes: Classes, n: int, largest: float) -> Guarantee:
    if method.max_unknowns is not None and n > method.max_unknowns:
        return Guarantee(NO, f"it is limited to {method.max_unknowns} unknowns")
    if ANY in method.guaranteed:
        incomplete = f"; above {SETTLED} unknowns a proof that there is no solution may remain incomplete"
        return Guarantee(YES, method.guaranteed[ANY] + incomplete * (n > SETTLED))
    only_h_plus = classes["h_plus"].word == YES and classes["positive_definite"].word != YES
    if OMEGA in method.options and only_h_plus:
        if largest <= OMEGA.value:
            return Guarantee(YES, "M is an H+-matrix with no diagonal entry above 1")
        return Guarantee(NO, f"M is H+, guaranteed with --omega auto: {largest:.6g}, the largest diagonal entry")
    return _by_class(classes, method.guaranteed)


def _by_class(classes: Classes, gains: Mapping[str, str]) -> Guarantee:
    """The first class that M belongs to decides; `gains` states what each class guarantees."""
    if not gains:
        return Guarantee(UNDECIDED, "no theorem about it is known here")
    for name, gain in gains.items():
        if classes[name].word == YES:
            return Guarantee(YES, f"M is {CALLED[name]}: {gain}")
    undecided = [CALLED[name] for name in gains if classes[name].word == UNDECIDED]
    if undecided:
        return Guarantee(UNDECIDED, f"whether M is {' or '.join(undecided)} is not decided")
    named = [CALLED[name] for name in gains]
    return Guarantee(NO, f"M is {'not' if len(named) == 1 else 'neither'} {' nor '.join(named)}")
