"""The iterates of a method on a transformed problem, in the variables of the given one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import is_finite, largest
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.methods import registry as methods
from lcpcli.methods.iterate import Breakdown, Ending, Iterate, NoSolution, Stage, Stalled, advance, ended
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.basic_solution import BasicSolutions
from lcpcli.verify.certificate import UNVERIFIED, farkas_statement, proves_infeasible

if TYPE_CHECKING:
    from lcpcli.model.standard_form import StandardForm

SOLVED = 1e-6  # of the largest |q|: the size of F up to which an iterate may stand for a solution
INEXACT = "no solution was found, and changing the variables has rounded, so that there is no proof either"


class Transformation(Protocol):
    """A scaled, shifted or presolved problem, with the way there and back."""

    @property
    def problem(self) -> Problem:
        """The transformed problem."""

    @property
    def given(self) -> Problem:
        """The given one."""

    @property
    def is_exact(self) -> bool:
        """Whether it has not rounded, so that the two problems have the same solutions."""

    def start(self, x: Vector) -> Vector:
        """x of the transformed problem."""

    def back(self, x: Vector) -> Vector:
        """x of the given problem."""

    def residual(self, F: Vector) -> Vector:
        """F of the given problem."""

    def multipliers(self, y: Vector) -> Vector:
        """Farkas' y for the given problem."""


def begin(method: str, problem: Problem, x0: Vector, **options: Any) -> Stage:
    """A method on a problem, through its standard form if the method knows only z >= 0."""
    function = methods.load(method)
    if not problem.is_mixed or methods.declared(method).takes_bounds:
        return function(problem, x0, **options)
    return as_lcp(function, problem, x0, **options)


def as_lcp(function: Callable[..., Stage], problem: Problem, x0: Vector, **options: Any) -> Stage:
    """The stage of an LCP, for a mixed problem that of its standard form."""
    if not problem.is_mixed:
        return function(problem, x0, **options)
    from lcpcli.model.standard_form import standard_form

    try:
        form = standard_form(problem)
    except ProblemError:
        return ended(Breakdown("numbers overflow in the standard form"))
    return _polished(form, function(form.problem, form.start(x0), **options))


def _polished(form: StandardForm, stage: Stage) -> Stage:
    """The stage in the variables of the mixed problem, with solutions replaced by its own basic solutions: the standard
    form has more numbers to round."""
    solutions, small = BasicSolutions(form.given), SOLVED * largest(form.problem.q)
    while isinstance(step := advance(stage), Iterate):
        with np.errstate(over="ignore", invalid="ignore"):
            x = form.back(step.x)
            if step.F is None or largest(step.F) <= small:
                with suppress(SingularMatrix):
                    found = solutions.at(form.given.box.basis_of(x))
                    if is_finite(found.w) and not solutions.violated(found).any():
                        x = form.given.box.x_within(found.z, found.w, found.basis)
        yield step._replace(x=x, F=None)
    return _concluded(form, step) if isinstance(step, NoSolution) else step


def in_given_variables(transformation: Transformation, stage: Stage) -> Stage:
    """The stage with x, F and the final proof, if any, of the given problem."""
    while True:
        step = advance(stage)
        if isinstance(step, NoSolution):
            return _concluded(transformation, step)
        if not isinstance(step, Iterate):
            return step
        with np.errstate(over="ignore", invalid="ignore"):
            F = None if step.F is None else transformation.residual(step.F)
            x = transformation.back(step.x)
        yield step._replace(x=x, F=F)


def _concluded(transformation: Transformation | StandardForm, ending: NoSolution) -> Ending:
    """The proof for the given problem, or that it is none."""
    proof = ending.certificate
    if proof.kind == "exhaustion":
        return ending if transformation.is_exact else Stalled(INEXACT)
    y = None if proof.vector is None or proof.kind == "ray" else transformation.multipliers(proof.vector)
    if y is not None and not proves_infeasible(transformation.given, y):
        return Stalled(UNVERIFIED[proof.kind])
    mixed = y is not None and transformation.given.is_mixed
    statement = farkas_statement(transformation.given) if mixed else proof.statement
    return replace(ending, certificate=replace(proof, statement=statement, vector=y))
