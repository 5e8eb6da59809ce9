"""What exact solutions of the conditions of a program mean: x, y and the objective."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from lcpcli.enumeration.meaning import Meaning, Values
from lcpcli.formulations.quadratic_program.answers import NoOptimum
from lcpcli.formulations.quadratic_program.conclusions import data_of
from lcpcli.formulations.quadratic_program.no_minimum import undecided, without_minimum
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify.certificate import Proof


class Optima(Meaning):
    columns = ("part", "value")

    def __init__(self, data: ExactProblem, program: Program) -> None:
        super().__init__(data)
        self._program = program

    def headings(self, indices: Sequence[int]) -> list[str]:
        return [*super().headings(indices), "objective"]

    def row(
        self,
        kind: str,
        z: Values,
        w: Values,
        indices: Sequence[int],
        cell: Callable[[Fraction], str],
    ) -> tuple[Values, list[str]]:
        shown, cells = super().row(kind, z, w, indices, cell)
        objective = cell(self.objective(z)) if kind == "vertex" else ""
        return shown, [*cells, objective]

    def record(self, z: Values) -> dict[str, Any]:
        x, y, _ = self._program.unsigned_parts(z)
        return {"objective": self.objective(z), "x": x, "y": y, **super().record(z)}

    def cells(self, z: Values) -> Sequence[Sequence[Any]]:
        parts = zip("xys", self._program.unsigned_parts(z), strict=True)
        return [(letter, value) for letter, part in parts for value in part]

    def without_solution(self, proof: Proof | None) -> NoOptimum:
        program = self._program
        if proof is None:
            return NoOptimum.of(program, undecided(program))
        problem = self.data.problem
        data = data_of(problem, program)
        return NoOptimum.of(program, without_minimum(problem, proof, program, data))

    def objective(
        self, z: Values, shift: tuple[int, Fraction] | None = None
    ) -> Fraction:
        """Return the exact value of the objective at the x of z, in the sense of the
        program and with its constant.

        shift : an index i and a number that is added to the i-th coefficient of the
            linear term.
        """
        data = self.data
        k = self._program.variables
        total = Fraction(0)
        if shift is not None and shift[0] < k:
            total = shift[1] * z[shift[0]]
        for i, value in enumerate(z[:k]):
            curvature = sum(
                (Fraction(a) * z[j] for j, a in data.rows[i].items() if j < k),
                Fraction(0),
            )
            total += value * (curvature / 2 + data.constants[i]) / data.scales[i]
        constant = Fraction(repr(self._program.constant))
        return (total if self._program.sense == "min" else -total) + constant
