"""The form of Stewart and Trinkle, which is solved if a method terminates on a ray of
the compact form: its matrix is copositive, so that Lemke's method yields a solution
under the conditions of their theorem.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lcpcli.clock import imports
from lcpcli.formulations.contact.answers import Motion, point_of
from lcpcli.formulations.contact.cones import Form
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.matrices import product
from lcpcli.methods import stages
from lcpcli.methods.lemke import MAX_PIVOTS
from lcpcli.methods.stages import Stage
from lcpcli.model.problem import Problem
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

MAX_UNKNOWNS = 400  # up to which a whole path takes no longer than a wait for Ctrl-C
ENDS = Status.RAY, Status.STALLED, Status.BREAKDOWN


@np.errstate(all="ignore")  # overflow gives infinity
def retried(contact: Contact, result: Result) -> Result:
    """Return a result of Lemke's method for the other form, as a result of the problem
    itself; the original result if that is not solved either, if another method was
    asked for, or in space, where there is only one form.
    """
    time_left = result.limits.time_limit - result.seconds
    is_open = result.status in ENDS and result.method == "lemke" and time_left > 0
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
    criterion = Criterion(result.problem, result.tol)
    point = _solution(contact, other_form, criterion, other.z)
    if point is None:
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


def by_lemke(contact: Contact, problem: Problem) -> Stage:
    """Follow Lemke's path of the other form, and yield its solution as one of the
    problem itself.
    """
    form = contact.stewart_trinkle()
    M, q, lower, upper = form.conditions
    other = Problem(M, q, lower=lower, upper=upper)
    if other.n > MAX_UNKNOWNS:
        return stages.Stalled("its other form has many unknowns")
    path = stages.begin("lemke", other, np.zeros(other.n))
    path = stages.limited(path, MAX_PIVOTS * other.n)
    evaluations, z = 0, np.zeros(other.n)
    while isinstance(step := stages.advance(path), stages.Iterate):
        evaluations, z = step.evaluations, other.box.z_of(step.x)
    point = _solution(contact, form, Criterion(problem), z)
    if point is None or not isinstance(step, stages.Finished):
        return stages.Stalled("its other form is not solved")
    x = problem.box.x_within(point.z, problem.w(point.z), problem.box.basis_at(point.z))
    yield stages.Iterate(x, None, "", evaluations)
    return step


@np.errstate(all="ignore")
def _solution(
    contact: Contact, form: Form, criterion: Criterion, z: Vector
) -> Point | None:
    """Return the point of the problem for a z of its other form; None if it is no
    solution."""
    x = np.asarray(product(form.T, z))
    point = Point(criterion, point_of(contact, Motion.of_impulses(contact, x)))
    return point if point.solves() else None
