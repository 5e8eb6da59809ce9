"""What the solutions of the conditions of a program are for the program."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lcpcli.model.program import Program
from lcpcli.rational.problem import ExactProblem


def objective(data: ExactProblem, program: Program, z: Sequence[Fraction]) -> Fraction:
    """The exact value of the program's objective at the x of z, in its own sense and with its constant."""
    x, k = z[: program.variables], program.variables
    total = Fraction(0)
    for i, value in enumerate(x):
        curvature = sum((Fraction(a) * x[j] for j, a in data.rows[i].items() if j < k), Fraction(0))
        total += value * (curvature / 2 + data.constants[i]) / data.scales[i]
    return (total if program.sense == "min" else -total) + Fraction(repr(program.constant))
