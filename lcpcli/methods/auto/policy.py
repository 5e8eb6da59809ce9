"""The policy: which method comes first, and which one next when that breaks down, stalls or has used up its budget."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from lcpcli.linalg import factors
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods import registry as methods
from lcpcli.methods.iterate import Breakdown, Ending, Iterate, NoSolution, OutOfTime, Stalled
from lcpcli.methods.newton import LEAST_INDEX
from lcpcli.methods.scaled import in_original_units
from lcpcli.model import scaled
from lcpcli.model.modulus import z_of
from lcpcli.model.problem import Problem
from lcpcli.model.scaled import Scaled
from lcpcli.typing import Vector
from lcpcli.verify.certificate import proof_in_units
from lcpcli.verify.refinement import is_near, is_rounded_solution, refined

LEAST_INDEX_STEPS = 60  # of newton where M is dense: its block steps advance, these may need 2^n
REFINED = "refined"
LEMKE_PIVOTS = 20  # an unknown


def auto(problem: Problem, x0: Vector, *, time_limit: float = math.inf) -> Iterator[Iterate]:
    """Solve any LCP, or prove that it has no solution, by what gets there first.

    Dense M: newton solves almost every problem with a P-matrix in a handful of factorizations. Sparse M: first
    `sparse_route`, which needs products with M alone where they do, then newton, then `linear`, which proves most
    infeasible problems to be so. Where these break down, stall or use up their budget, lemke takes over, which solves
    what has a copositive-plus or otherwise well-behaved M, then `restarts` of it, which solve games, and then milp,
    which settles what is left: by a solution, by a proof that there is none, or not at all within the time limit. What
    its tolerances leave open of a small problem is settled by `exhaustion`.

    Parameters
    ----------
    problem : the LCP, n unknowns.
    x0 : start, shape (n,), in the units of z; pivoting methods heed its signs only.
    time_limit : seconds after which milp gives up; the driver ends the others.

    Yields
    ------
    Iterate : those of the methods, each with its method's name.

    Raises
    ------
    NoSolution : with a Farkas proof or by exhaustion, as lemke and milp do.
    Stalled, Breakdown : as the last method does.
    """
    return _iterates(problem, x0, time_limit)


def _iterates(problem: Problem, x0: Vector, time_limit: float) -> Iterator[Iterate]:
    deadline = time.perf_counter() + time_limit
    last = Iterate(x0, None, "", 0)
    for place, (name, iterates) in enumerate(_in_order(problem, x0, deadline)):
        done = last.evaluations
        try:
            for iterate in islice(iterates, min(place, 1), None):  # each method hands out the start first; once will do
                evaluations = done + iterate.evaluations
                last = replace(iterate, method=iterate.method or name, evaluations=evaluations)
                yield last
        except (Breakdown, Stalled, FloatingPointError):
            pass
        except NoSolution as ending:
            if ending.certificate.kind != "ray":
                ending.method = name
                raise
        if is_near(problem, z_of(last.x)):
            last = _refined(problem, last)
            yield last
            if is_rounded_solution(problem, z_of(last.x)):
                return
    seconds = max(deadline - time.perf_counter(), 1e-3)
    try:
        yield from _taking_part("milp", methods.load("milp")(problem, x0, time_limit=seconds), last.evaluations)
    except Stalled as ending:
        from lcpcli.methods.auto import exhaustion

        if problem.n > exhaustion.LARGEST or isinstance(ending, OutOfTime):
            raise
        yield from _taking_part("exhaustion", exhaustion.exhaustion(problem, x0), last.evaluations)


def _taking_part(method: str, iterates: Iterator[Iterate], done: int) -> Iterator[Iterate]:
    """The iterates but the first, the start, and the ending of a method, with its name."""
    try:
        for iterate in islice(iterates, 1, None):
            yield replace(iterate, method=method, evaluations=done + iterate.evaluations)
    except Ending as ending:
        ending.method = method
        raise


@np.errstate(over="ignore", invalid="ignore")
def _refined(problem: Problem, last: Iterate) -> Iterate:
    """The iterate with z made right to its last digits."""
    inside = last.x > 0
    z = refined(problem, z_of(last.x), inside)
    x = np.where(inside, z, -np.maximum(problem.w(z), 0)) / 2
    return replace(last, x=x, F=None, step=REFINED, settled=True)


def _in_order(problem: Problem, x0: Vector, deadline: float) -> Iterator[tuple[str, Iterator[Iterate]]]:
    """The methods before milp, by name, each made when it is its turn."""
    if is_sparse(problem.M) and problem.n > factors.SMALL:
        from lcpcli.methods.auto.sparse_route import sparse_route

        yield "sparse", sparse_route(problem, x0)
    patience = problem.n if is_sparse(problem.M) else LEAST_INDEX_STEPS
    yield "newton", _while_blocks_advance(methods.load("newton")(problem, x0), patience)
    if scaled.is_far_from_one(problem):
        yield from _in_scaled_units(problem, x0)
    if is_sparse(problem.M) and problem.n > factors.SMALL:
        from lcpcli.methods.auto.linear import linear

        yield "linear", linear(problem, x0, max(deadline - time.perf_counter(), 1e-3))
    yield "lemke", islice(methods.load("lemke")(problem, x0), LEMKE_PIVOTS * problem.n)
    from lcpcli.methods.auto.restarts import restarts

    yield "lemke", restarts(problem, x0)


def _in_scaled_units(problem: Problem, x0: Vector) -> Iterator[tuple[str, Iterator[Iterate]]]:
    """newton and lemke in units in which products of a few numbers neither over- nor underflow."""
    units = scaled.scale(problem)
    start, pivots = np.sign(x0), LEMKE_PIVOTS * problem.n
    newton = _while_blocks_advance(methods.load("newton")(units.problem, start), LEAST_INDEX_STEPS)
    yield "newton", in_original_units(units, newton)
    yield "lemke", _proving(problem, units, islice(methods.load("lemke")(units.problem, start), pivots))


def _proving(problem: Problem, units: Scaled, iterates: Iterator[Iterate]) -> Iterator[Iterate]:
    """The iterates in the problem's own units, and so a proof with which they end."""
    try:
        yield from in_original_units(units, iterates)
    except NoSolution as ending:
        proof = ending.certificate
        y = None if proof.kind == "ray" or proof.vector is None else proof_in_units(problem, units.R, proof.vector)
        if y is None:
            raise Breakdown(proof.statement) from None
        raise NoSolution(replace(proof, vector=y)) from None


def _while_blocks_advance(iterates: Iterator[Iterate], patience: int) -> Iterator[Iterate]:
    """The iterates of newton, until it has taken more than so many steps one index at a time."""
    alone = 0
    for iterate in iterates:
        alone += iterate.step == LEAST_INDEX
        if alone > patience:
            return
        yield iterate
