"""The form of Stewart and Trinkle, which is solved if a method terminates on a ray of
the compact form: its matrix is copositive, so that Lemke's method yields a solution
under the conditions of their theorem.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lcpcli.clock import imports
from lcpcli.formulations.contact.answers import Motion, point_of
from lcpcli.formulations.contact.cones import Form
from lcpcli.formulations.contact.friction import Contact
from lcpcli.linalg.matrices import product
from lcpcli.methods import stages
from lcpcli.methods.stages import Stage
from lcpcli.model.problem import Problem
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

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
    point = _point(contact, other_form, criterion, other.z)
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


def iterates(
    contact: Contact, problem: Problem, stage_of: Callable[[Problem], Stage]
) -> Stage:
    """Yield the iterates of a stage of the other form as points of the problem
    itself."""
    form = contact.stewart_trinkle()
    M, q, lower, upper = form.conditions
    other = Problem(M, q, lower=lower, upper=upper)
    stage, criterion = stage_of(other), Criterion(problem)
    while isinstance(step := stages.advance(stage), stages.Iterate):
        point = _point(contact, form, criterion, other.box.z_of(step.x))
        basis = problem.box.basis_at(point.z)
        x = problem.box.x_within(point.z, problem.w(point.z), basis)
        yield step._replace(x=x, F=None, basis=None)
    return step


@np.errstate(all="ignore")
def _point(contact: Contact, form: Form, criterion: Criterion, z: Vector) -> Point:
    """Return the point of the problem for a z of its other form."""
    x = np.asarray(product(form.T, z))
    return Point(criterion, point_of(contact, Motion.of_impulses(contact, x)))
