"""The form of Stewart and Trinkle, which is solved if a method terminates on a ray of
the compact form: its matrix is copositive, so that Lemke's method yields a solution
under the conditions of their theorem.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lcpcli.clock import imports
from lcpcli.formulations.contact.answers import Motion, point_of
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.matrices import product
from lcpcli.model.problem import Problem
from lcpcli.solving.result import Result, Status
from lcpcli.verify.point import Criterion, Point

METHODS = "auto", "lemke"
ENDS = Status.RAY, Status.STALLED, Status.BREAKDOWN


@np.errstate(all="ignore")  # overflow gives infinity
def retried(contact: Contact, result: Result) -> Result:
    """Return a result of the same method for the other form, as a result of the problem
    itself; the original result if that is not solved either, or in space, where there
    is only one form.
    """
    time_left = result.limits.time_limit - result.seconds
    is_open = result.status in ENDS and result.method in METHODS and time_left > 0
    if not (is_open and contact.is_planar and contact.contacts):
        return result
    with imports:
        from lcpcli.solving.call import run
    other_form = contact.stewart_trinkle()
    M, q, lower, upper = other_form.conditions
    other = run(
        Problem(M, q, lower=lower, upper=upper),
        result.method,
        tol=result.tol,
        max_iterations=result.limits.max_iterations,
        time_limit=time_left,
    )
    if not other.solved:
        return result
    x = np.asarray(product(other_form.T, other.z))
    problem = result.problem
    z = point_of(contact, Motion.of_impulses(contact, x))
    point = Point(Criterion(problem, result.tol), z)
    if not point.solves():
        return result
    parts = {key: value + other.parts[key] for key, value in result.parts.items()}
    return replace(
        result,
        point=point,
        status=Status.SOLVED,
        message=Status.SOLVED.sentence("in the form of Stewart and Trinkle"),
        iterations=result.iterations + other.iterations,
        evaluations=result.evaluations + other.evaluations,
        parts=parts,
        certificate=None,
        end=None,
    )
