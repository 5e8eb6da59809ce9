"""All solutions of an LCP with two unknowns as the data of a picture of its complementary cones."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import product

from lcpcli.enumeration.search import SolutionSet
from lcpcli.errors import ParameterError
from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.report import numbers, provenance
from lcpcli.report.figures.data import Cones


def require(problem: Problem) -> None:
    """Raise ParameterError for a problem that has no such picture."""
    if problem.is_mixed or problem.n != 2:
        fault = f"draws the complementary cones of an LCP with two unknowns, not of one with {numbers.size(problem)}"
        raise ParameterError("plot", fault, "leave it out")


def cones(found: SolutionSet) -> Cones:
    """The cones, and which of them hold q: those whose set has a solution with w = 0 in it and z = 0 outside."""
    problem = found.data.problem
    solutions = [(z, found.data.w(z)) for z in found.points]
    sets = [(first, second) for second, first in product((False, True), repeat=2)]
    return Cones(
        title=numbers.title(problem),
        M=matrices.dense(problem.M).tolist(),
        q=problem.q.tolist(),
        holding=[any(_is_of(basic, z, w) for z, w in solutions) for basic in sets],
        count=found.count,
        names=tuple(problem.names),
        provenance=[f"{provenance.PROGRAM}: {found.message}"],
    )


def _is_of(basic: tuple[bool, bool], z: Sequence[Fraction], w: Sequence[Fraction]) -> bool:
    """Whether a solution has w = 0 where basic, and z = 0 elsewhere."""
    return not any(w_i if is_basic else z_i for is_basic, z_i, w_i in zip(basic, z, w, strict=True))
