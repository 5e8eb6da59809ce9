"""Proofs that a solution of a model is near, checked in rational arithmetic."""

from __future__ import annotations

import random
from fractions import Fraction

import lcpcli
from lcpcli.files.nl_format import Model

from ..files.nl_writing import model


def polynomial(coefficients: list[str], z: Fraction) -> Fraction:
    return sum((Fraction(text) * z**power for power, text in enumerate(coefficients)), Fraction(0))


def test_zeros_of_polynomials_are_where_they_are_proved_for_decimals_as_written() -> None:
    rng, proved = random.Random(1), 0
    for _ in range(40):
        texts = [f"{rng.uniform(-2, 2):.3f}" for _ in range(3)] + [f"{rng.uniform(1, 3):.3f}"]
        terms = [("*", text, ("^", "v0", power)) for power, text in enumerate(texts)]
        problem = Model(model(1, [((5, 1, 1), {0: 0}, ("sum", *terms))], [(2, -9)]), "cubic.nl").nonlinear
        result = lcpcli.solve_mcp(problem, proof=True)
        if not result.solved or result.bound is None or not result.bound.proved:
            continue
        proved += 1
        z, bound = Fraction(float(result.z[0])), Fraction(result.bound.value)
        assert 0 < bound < Fraction(1, 10**9)
        ends = (polynomial(texts, z - bound), polynomial(texts, z + bound))
        assert min(ends) <= 0 <= max(ends)
    assert proved >= 30
