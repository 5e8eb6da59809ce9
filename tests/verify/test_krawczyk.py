"""Krawczyk's operator proves solutions that are there, and nothing else."""

import random
from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli.linalg.doubles import EPS
from lcpcli.model.nonlinear import Enclosure, NonlinearProblem
from lcpcli.solving.solve_mcp import run_nonlinear
from lcpcli.verify.nonlinear_point import proved_bound

from .. import literature
from ..conftest import problem_of
from ..files.nl_writing import model


class Interval:
    """An interval of fractions, so that nothing is rounded."""

    def __init__(self, low, high=None):
        self.low, self.high = Fraction(low), Fraction(low if high is None else high)

    def __add__(self, other):
        other = as_interval(other)
        return Interval(self.low + other.low, self.high + other.high)

    def __mul__(self, other):
        other = as_interval(other)
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return Interval(min(ends), max(ends))

    def __pow__(self, power):
        assert power == 2
        ends = [self.low**2, self.high**2]
        return Interval(0 if self.low < 0 < self.high else min(ends), max(ends))

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self):
        return Interval(-self.high, -self.low)

    def __sub__(self, other):
        return self + -as_interval(other)

    def __rsub__(self, other):
        return -self + other

    @property
    def ends(self):
        return float(np.nextafter(float(self.low), -np.inf)), float(
            np.nextafter(float(self.high), np.inf)
        )


def as_interval(value):
    return value if isinstance(value, Interval) else Interval(value)


def enclosed(problem):
    """The problem with F and J in intervals, by its own functions."""

    def interval(low, high):
        z = [Interval(*ends) for ends in zip(low.tolist(), high.tolist(), strict=True)]
        F = np.array([as_interval(value).ends for value in problem.F(z)])
        J = np.array(
            [[as_interval(value).ends for value in row] for row in problem.J(z)]
        )
        return Enclosure(F[:, 0], F[:, 1], J[:, :, 0], J[:, :, 1])

    bounds = {"lower": problem.lower, "upper": problem.upper}
    return NonlinearProblem(
        problem.F, problem.J, **bounds, x0=problem.x0, interval=interval
    )


def test_the_bound_covers_the_distance_of_a_rough_point():
    problem = enclosed(literature.josephy())
    rough = np.array([1.5**0.5 + 1e-7, 0.0, 0.0, 0.5 - 1e-7])
    bound = proved_bound(problem, rough)
    assert 1e-7 <= bound.value <= 1e-6
    assert "Krawczyk" in bound.source


@pytest.mark.parametrize("power", range(3, 60, 14))
def test_roots_are_bounded_as_fractions_say(power):
    number = 1 + Fraction(1, 2**power)
    problem = enclosed(
        NonlinearProblem(
            lambda z: [z[0] ** 2 - number], lambda z: [[2 * z[0]]], lower=None, x0=[3.0]
        )
    )
    z = float(number) ** 0.5
    bound = proved_bound(problem, np.array([z]))
    low, high = Fraction(z) - Fraction(bound.value), Fraction(z) + Fraction(bound.value)
    assert low**2 <= number <= high**2
    assert bound.value <= 8 * EPS


def test_degenerate_solutions_and_points_that_are_none_are_not_proved():
    degenerate = proved_bound(
        enclosed(literature.kojima_shindo()), np.array([1.5**0.5, 0.0, 0.0, 0.5])
    )
    assert not degenerate.proved  # z_3 = w_3 = 0
    assert "at a bound with w = 0" in degenerate.source
    assert not proved_bound(
        enclosed(literature.josephy()), np.array([1.0, 1.0, 0.0, 0.5])
    ).proved
    double = NonlinearProblem(
        lambda z: [(z[0] - 1) ** 2], lambda z: [[2 * (z[0] - 1)]], lower=None, x0=[3.0]
    )
    assert not proved_bound(enclosed(double), np.array([1.0])).proved
    outside = NonlinearProblem(
        lambda z: [z[0] ** 2 - 4], lambda z: [[2 * z[0]]], lower=0, upper=2, x0=[1.0]
    )
    # A zero of F at the bound.
    assert not proved_bound(enclosed(outside), np.array([2 - 1e-17])).proved


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_solution_that_has_another_one_beside_it_is_not_called_the_only_one(side):
    """w = 1e-20 - z_2 at z_2 = 0, which is at its lower bound, and 0 at z_2 = 1e-20;
    and the mirror image."""
    beside = NonlinearProblem(
        lambda z: [z[0] ** 2 - 2, side * 1e-20 - z[1]],
        lambda z: [[2 * z[0], 0.0], [0.0, -1.0]],
        lower=[0.0, min(0.0, side * np.inf)],
        upper=[np.inf, max(0.0, side * np.inf)],
        x0=[1.0, 0.0],
    )
    bound = proved_bound(enclosed(beside), np.array([2.0**0.5, 0.0]))
    assert not bound.proved or bound.value < 1e-20


def test_without_intervals_nothing_is_proved():
    bound = run_nonlinear(literature.josephy(), proof=True).bound
    assert (bound.source, bound.proved) == (
        "F has no evaluation in interval arithmetic",
        False,
    )


def polynomial(coefficients, z):
    return sum(
        (Fraction(text) * z**power for power, text in enumerate(coefficients)),
        Fraction(0),
    )


def test_zeros_of_polynomials_are_where_they_are_proved_for_decimals_as_written():
    rng, proved = random.Random(1), 0
    for _ in range(15):
        texts = [f"{rng.uniform(-2, 2):.3f}" for _ in range(3)] + [
            f"{rng.uniform(1, 3):.3f}"
        ]
        terms = [("*", text, ("^", "v0", power)) for power, text in enumerate(texts)]
        content = model(1, [((5, 1, 1), {0: 0}, ("sum", *terms))], [(2, -9)])
        result = lcpcli.solve_mcp(problem_of(content, "cubic.nl"), proof=True)
        if not result.solved or result.bound is None or not result.bound.proved:
            continue
        proved += 1
        z, bound = Fraction(float(result.z[0])), Fraction(result.bound.value)
        assert 0 < bound < Fraction(1, 10**9)
        ends = (polynomial(texts, z - bound), polynomial(texts, z + bound))
        assert min(ends) <= 0 <= max(ends)
    assert proved >= 10
