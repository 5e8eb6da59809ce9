"""What a result means for a variational inequality: x with its multipliers, and what is
proved about it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from lcpcli.enumeration.search import Solutions
from lcpcli.formulations.variational_inequality.hull import Directions, form_on, hull
from lcpcli.formulations.variational_inequality.inequality import Inequality
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import YES
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import size
from lcpcli.model.formulation import Answer
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import brief, rounded
from lcpcli.report import wording
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.exact_solution import from_point

# Work in exact arithmetic for each question, in the seconds that it usually takes.
EFFORT = 0.5
# x may differ by this, relative to the largest |x_i|, from an exact solution.
AGREEMENT = 1e-7
MAX_UNKNOWNS = 200  # up to here exact arithmetic is used
AGREES = "it agrees to seven digits with a solution in rational arithmetic"
EMPTY = "C is empty"
UNDECIDED, POSITIVE = "not decided", "H + H' is positive definite"


@dataclass(frozen=True)
class Claim:
    """Whether something holds, which is None if that is not decided, and the proof in
    words.
    """

    holds: bool | None
    proof: str = UNDECIDED


@dataclass(frozen=True)
class Proved:
    """What is proved, in exact arithmetic or by bounds on rounding errors, for the
    shortest decimals of all numbers.

    solves : whether an exact solution agrees with x to seven digits; False if there is
        no solution.
    monotone : whether d'Hd >= 0 for all directions d of the affine hull of C.
    only : whether x is the only solution, whatever its multipliers are.
    """

    solves: Claim
    monotone: Claim
    only: Claim


def answer(origin: Inequality, result: Result) -> Solution:
    return Solution(origin, result)


class Solution(Answer):
    """What a result says about a variational inequality. Exact arithmetic is used only
    when a field that depends on it is read.

    x : shape (k,); if the conditions are not solved, the best iterate, or None if it is
        proved that there is no solution.
    y : multipliers of the m rows, positive for lower and negative for upper bounds.
    proved : what is proved about x, H and other solutions.
    origin : the variational inequality.
    statement : whether x solves it.
    exact : x and y as fractions if z is proved, otherwise None.
    """

    def __init__(self, origin: Inequality, result: Result) -> None:
        self.origin, self._result = origin, result

    @cached_property
    @np.errstate(all="ignore")
    def proved(self) -> Proved:
        return _Examination(self.origin, self._result).proved()

    @cached_property
    def _parts(self) -> tuple[Vector | None, Vector | None]:
        result = self._result
        if not result.solved and self.proved.solves.holds is False:
            return None, None
        x, y = self.origin.parts(result.z + 0.0)
        return x, y

    @property
    def x(self) -> Vector | None:
        return self._parts[0]

    @property
    def y(self) -> Vector | None:
        return self._parts[1]

    @cached_property
    def exact(self) -> Mapping[str, list[Fraction]] | None:
        exact = self._result.exact
        if exact is None or exact.z is None:
            return None
        return dict(zip("xy", map(list, self.origin.parts(exact.z)), strict=True))

    @property
    def statement(self) -> str:  # type: ignore[override]
        return _statement(self._result, self.proved.solves)

    def record(self) -> Mapping[str, Any]:
        names = ("x", "y", "statement", "proved", "exact")
        return {name: getattr(self, name) for name in names}

    def lines(self) -> list[str]:
        names = {"x": self.origin.columns, "y": self.origin.rows}
        lines = [
            f"{key} = {wording.named(values.tolist(), names[key])}"
            for key in names
            if (values := getattr(self, key)) is not None and values.size
        ]
        lines += [self.statement, *_sentences(self.proved)]
        exact = (self.exact or {}).items()
        return lines + [
            f"exact {key} = {wording.named(list(values), names[key], brief)}"
            for key, values in exact
            if values
        ]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        if self.x is None or self.y is None:
            return {"part": (), "value": ()}
        shown = self.exact or {"x": self.x.tolist(), "y": self.y.tolist()}
        parts = ["x"] * len(shown["x"]) + ["y"] * len(shown["y"])
        return {"part": parts, "value": list(chain(shown["x"], shown["y"]))}


def _sentences(proved: Proved) -> Iterator[str]:
    monotone, only = proved.monotone, proved.only
    monotonicity = {True: "H is monotone", False: "H is not monotone"}
    where = " on the affine hull of C"
    if monotone.proof == EMPTY:
        return
    if monotone.holds is None:
        yield f"whether H is monotone{where} is not decided"
    else:
        yield f"{monotonicity[monotone.holds]}{where}: {monotone.proof}"
    if proved.solves.holds is False:
        return
    if only.holds is None:
        yield "whether there are other solutions is not decided"
    else:
        uniqueness = (
            "x is the only solution" if only.holds else "x is not the only solution"
        )
        yield f"{uniqueness}: {only.proof}"


def _statement(result: Result, solves: Claim) -> str:
    if solves.holds is False:
        return f"no x solves the variational inequality: {solves.proof}"
    if not result.solved:
        return "x does not solve the variational inequality: it is the best iterate"
    if solves.holds:
        return f"x solves the variational inequality: {solves.proof}"
    return "x solves the variational inequality to the tolerance"


class _Examination:
    """What can be proved about a result with limited work.

    data : the conditions in exact numbers, if there are few of them.
    is_known : whether the affine hull of C has been computed. Its directions are None
        if C is empty.
    """

    def __init__(self, origin: Inequality, result: Result) -> None:
        self.origin = origin
        self.result = result
        self.k = origin.variables
        self.data = ExactProblem(result.problem, [{}], [Fraction(0)])
        self.is_known, self.directions = False, None
        if result.problem.n <= MAX_UNKNOWNS:
            self.data = ExactProblem.of_decimals(result.problem)
            with suppress(TimeIsUp):
                self.directions = hull(self.data, self.k, origin.ranges, self.steps())
                self.is_known = True

    def steps(self) -> Callable[[], None]:
        return Effort(EFFORT).steps(self.data)

    def proved(self) -> Proved:
        solves = self.solves()
        monotone, strict = self.monotone()
        only = Claim(None)
        if solves.holds:
            only = Claim(True, strict) if strict else self.only()
        return Proved(solves, monotone, only)

    def solves(self) -> Claim:
        result = self.result
        if self.is_known and self.directions is None:
            return Claim(False, EMPTY)
        if result.status.has_no_solution:
            certificate = result.certificate
            return Claim(
                False, certificate.statement if certificate else result.message
            )
        if not result.solved:
            return Claim(None)
        if result.exact is not None and result.exact.status is Status.SOLVED:
            return Claim(True, "its conditions hold in rational arithmetic")
        z = None
        if result.problem.n <= MAX_UNKNOWNS:
            with suppress(TimeIsUp):
                z = from_point(self.data, result.z, Effort(EFFORT))
        if z is not None:
            exact, x = rounded(z[: self.k]), result.z[: self.k]
            if size(exact - x) <= AGREEMENT * max(size(exact), size(x)):
                return Claim(True, AGREES)
        return Claim(None)

    def monotone(self) -> tuple[Claim, str]:
        """Return whether H is monotone on the affine hull of C, and the reason why it
        is strictly monotone there, "" if it is not.
        """
        if self.is_known and not self.directions:
            if self.directions is None:
                return Claim(True, EMPTY), ""
            return Claim(True, "C is a single point"), "C has no other point"
        H = self.result.problem.M[: self.k, : self.k]
        of_H = definiteness(H + H.T)
        if of_H.definite == YES:
            return Claim(True, POSITIVE), POSITIVE
        if of_H.within is not None:
            reason = f"H + H' is semidefinite but for {of_H.within:.1e} of its diagonal"
            return Claim(None, f"{UNDECIDED}: {reason}"), ""
        with suppress(TimeIsUp):
            if self.directions is not None:
                return self.on_hull(self.directions)
        if of_H.semidefinite == YES:
            return Claim(True, "H + H' is positive semidefinite"), ""
        return Claim(None), ""

    def on_hull(self, directions: Directions) -> tuple[Claim, str]:
        definiteness_on_hull = form_on(self.data, self.k, directions, self.steps())
        if definiteness_on_hull.negative is not None:
            return Claim(False, "d'Hd < 0 for a direction d in it"), ""
        proof = "exact elimination of H + H' on it gives no negative pivot"
        is_strict = definiteness_on_hull.zero is None
        return Claim(True, proof), "H is strictly monotone there" if is_strict else ""

    def only(self) -> Claim:
        """Return whether all solutions, which are enumerated in exact arithmetic, have
        the same x.
        """
        if self.result.problem.n > MAX_UNKNOWNS:
            return Claim(None)
        search = Solutions(self.data, np.inf, None, Effort(EFFORT))
        first: Sequence[Fraction] | None = None
        for piece in search:
            if any(any(each[: self.k]) for each in (*piece.rays, *piece.lines)):
                return Claim(False, "there are infinitely many")
            for vertex in piece.vertices:
                first = first or vertex[: self.k]
                if vertex[: self.k] != first:
                    return Claim(False, self.other((first, vertex[: self.k])))
        if not search.complete or first is None:
            return Claim(None)
        return Claim(True, "all other complementary bases are excluded")

    def other(self, both: Sequence[Sequence[Fraction]]) -> str:
        """Return in words that solution of two that is farther from x."""
        x = self.result.z[: self.k]
        other = max(both, key=lambda each: size(rounded(each) - x))
        return (
            f"another one is {wording.named(list(other), self.origin.columns, brief)}"
        )
