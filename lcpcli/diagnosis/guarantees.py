"""Which methods are guaranteed to find a solution, or a proof that there is none, for what class of M.

The statements are those of the methods' own modules, which name the sources, and hold in exact arithmetic. For
`fixed-point`, |T|_2 < 1 holds for every omega > 0 if v'Mv > 0 for all v != 0, since |(omega I + M)v|^2 exceeds
|(omega I - M)v|^2 by 4 omega v'Mv, and Bai (2010) has convergence for H+-matrices if omega is at least the largest
diagonal entry. For `shi`, level sets are bounded for P-matrices, whose F is a homeomorphism.

With bounds, z - x has for mid(l, u, 2x) the Lipschitz constant of |x|, so that what holds for fixed-point and shi still
holds, and newton returns to no state of its last index, as w_n rises with z_n, as for an LCP. The standard form for
lemke has a row sufficient matrix if M is and no variable is free, a copositive-plus one if M is and all variables have
a lower bound, and a positive semidefinite one if M is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict
from lcpcli.methods.registry import ANY, METHODS, OMEGA, Method
from lcpcli.model.problem import Problem

SETTLED = 12  # unknowns up to which the exhaustive search of milp always terminates, see enumeration.MAX_NODES

Classes = dict[str, Verdict]

SIGNED = ("p_matrix", "row_sufficient")  # what changes of the signs of variables keep

CALLED = {
    "p_matrix": "a P-matrix",
    "strictly_copositive": "strictly copositive",
    "copositive_plus": "copositive-plus",
    "row_sufficient": "row sufficient",
    "positive_definite": "positive definite",
    "positive_semidefinite": "positive semidefinite",
    "h_plus": "an H+-matrix",
}


@dataclass(frozen=True)
class Guarantee:
    """word : YES, NO or UNDECIDED, if the decisive classes are not decided. reason : why, as a clause."""

    word: str
    reason: str


def guarantees(classes: Classes, problem: Problem) -> dict[str, Guarantee]:
    """For each of `methods.registry.METHODS` whether it is guaranteed, given what is known of M."""
    return {name: _guarantee(method, classes, problem) for name, method in METHODS.items()}


def _guarantee(method: Method, classes: Classes, problem: Problem) -> Guarantee:
    n, largest = _unknowns(problem), float(problem.M.diagonal().max())
    if method.max_unknowns is not None and n > method.max_unknowns:
        form = f", and the standard form has {n}" * (n != problem.n)
        return Guarantee(NO, f"it is limited to {method.max_unknowns} unknowns{form}")
    if ANY in method.guaranteed:
        incomplete = f"; above {SETTLED} unknowns a proof that there is no solution may remain incomplete"
        return Guarantee(YES, method.guaranteed[ANY] + incomplete * (n > SETTLED))
    only_h_plus = classes["h_plus"].word == YES and classes["positive_definite"].word != YES
    if OMEGA in method.options and only_h_plus:
        if largest <= OMEGA.value:
            return Guarantee(YES, "M is an H+-matrix with no diagonal entry above 1")
        return Guarantee(NO, f"M is H+, guaranteed with --omega auto: {largest:.6g}, the largest diagonal entry")
    return _by_class(classes, _kept(method, problem))


def _unknowns(problem: Problem) -> int:
    """How many the problem has, with bounds its standard form."""
    kinds = problem.box.kinds
    return problem.n - kinds.get("fixed", 0) + kinds.get("boxed", 0) + ("free" in kinds)


def _kept(method: Method, problem: Problem) -> Mapping[str, str]:
    """What classes of M guarantee for these bounds."""
    if not problem.is_mixed or method.takes_bounds:
        return method.guaranteed
    if "free" in problem.box.kinds:
        return {"positive_semidefinite": method.guaranteed["row_sufficient"]}
    signed = "upper bound" in problem.box.kinds
    return {name: gain for name, gain in method.guaranteed.items() if name in SIGNED or not signed}


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
