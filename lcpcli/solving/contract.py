"""The contract of methods, on which the loop relies and which all methods of this
package keep; a test of it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy.sparse import diags_array

from lcpcli import options
from lcpcli.errors import OptionError, count
from lcpcli.methods import registry, stages
from lcpcli.methods.stages import FAULTS, Breakdown, Ending, Iterate, PackageFault
from lcpcli.model.problem import Problem
from lcpcli.options import TOL
from lcpcli.solving.driver import variables_of
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

MAX_ITERATES = 50  # of a run: enough to see that it repeats itself and changes nothing


def check_method(name: str) -> None:
    """Check that a method, of this package or of another one, keeps the contract of
    methods; raise AssertionError with what it breaks. It need not solve anything, as
    the loop measures what it yields.

    Its function takes the parameters that it declares, and its defaults are in their
    ranges. On problems in one, two and a hundred unknowns, dense, sparse, with bounds
    and without a solution, it yields arrays of numbers that it never changes again, and
    never fewer `evaluations` than before; it leaves M and q as they are; run again, it
    yields the same; the start does not matter unless it declares `uses_start`; and if
    it terminates, it returns how.
    """
    _check_declaration(name)
    declared = registry.declared(name)
    for problem in _problems():
        first, second, other = (
            _iterates(name, problem, start) for start in (0.0, 0.0, 1.0)
        )
        _require(
            _are_same(first, second),
            name,
            problem,
            "yields other iterates when it is run again",
        )
        is_true = declared.uses_start or _are_same(first, other)
        _require(
            is_true,
            name,
            problem,
            "depends on the start, but does not declare uses_start",
        )


def _problems() -> Iterator[Problem]:
    n = 100
    tridiagonal = diags_array(
        [-np.ones(n - 1), np.full(n, 3.0), -np.ones(n - 1)], offsets=(-1, 0, 1)
    ).tocsr()
    yield Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0], name="two unknowns")
    yield Problem([[2.0]], [-1.0], name="one unknown")
    yield Problem([[2.0, 1.0], [1.0, 2.0]], [5.0, 6.0], name="the solution 0")
    yield Problem(tridiagonal, np.cos(np.arange(n)), name="a sparse M")
    yield Problem(
        [[2.0, 1.0], [-1.0, 1.0]],
        [-5.0, 6.0],
        lower=[0.0, -np.inf],
        upper=[3.0, np.inf],
        name="bounds",
    )
    yield Problem([[0.0, 1.0], [0.0, -1.0]], [-2.0, 1.0], name="no solution")


def _check_declaration(name: str) -> None:
    function, declared = registry.load(name), registry.declared(name)
    parameters = list(inspect.signature(function).parameters.values())
    arguments = count(len(parameters), "argument")
    _require(
        len(parameters) >= 2,
        name,
        None,
        f"takes {arguments}, but gets a problem and a start",
    )
    argument_names = [each.name for each in parameters[2:]]
    option_names = registry.parameters_of(name)
    needed = {each.name for each in parameters[2:] if each.default is each.empty}
    is_alike = needed <= set(option_names) <= set(argument_names)
    _require(
        is_alike,
        name,
        None,
        f"takes the options {argument_names}, but declares {option_names}",
    )
    try:
        options.check(
            declared.options, {each.name: each.default for each in declared.options}
        )
    except OptionError as error:
        _require(False, name, None, f"has a default out of range: {error}")


def _iterates(name: str, problem: Problem, start: float) -> list[Iterate]:
    """Return the iterates of a method from a start of equal numbers up to a solution,
    checked as they come."""
    changed_problem = variables_of(name, problem, False).problem
    M, q = changed_problem.M.copy(), changed_problem.q.copy()
    criterion = Criterion(changed_problem, TOL.value)
    iterates = list[Iterate]()
    copies = list[Vector]()
    ending: object = None
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        try:
            stage = stages.begin(
                name,
                changed_problem,
                np.full(changed_problem.n, start),
                **registry.options_in_force(name, changed_problem, {}),
            )
            while len(iterates) < MAX_ITERATES and isinstance(
                ending := stages.advance(stage), Iterate
            ):
                iterates.append(ending)
                copies.append(np.array(ending.x))
                if Point(criterion, changed_problem.box.z_of(ending.x)).solves():
                    break
        except FAULTS as error:
            _require(
                not isinstance(error, PackageFault), name, problem, f"fails: {error}"
            )
            ending = Breakdown()
    _require(isinstance(ending, Iterate | Ending), name, problem, f"returns {ending!r}")
    is_unchanged = all(
        (step.x == copy).all() for step, copy in zip(iterates, copies, strict=True)
    )
    _require(is_unchanged, name, problem, "changes an array that it has yielded")
    _require(
        bool((changed_problem.M != M).sum() == 0 and (changed_problem.q == q).all()),
        name,
        problem,
        "changes M or q",
    )
    grows = all(a.evaluations <= b.evaluations for a, b in pairwise(iterates))
    _require(grows, name, problem, "counts fewer evaluations than before")
    return iterates


def _are_same(first: list[Iterate], second: list[Iterate]) -> bool:
    return len(first) == len(second) and all(
        bool((a.x == b.x).all()) for a, b in zip(first, second, strict=True)
    )


def _require(holds: bool, name: str, problem: Problem | None, reason: str) -> None:
    if not holds:
        problem_text = "" if problem is None else f" on the problem with {problem.name}"
        raise AssertionError(f"{name}{problem_text}: {reason}")
