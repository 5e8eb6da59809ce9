"""Linear and quadratic programs: R. W. Cottle, G. B. Dantzig, Complementary pivot
theory of mathematical programming, Linear Algebra Appl. 1 (1968) 103-125; with bounds
on both sides as in F. Facchinei, J.-S. Pang, Finite-Dimensional Variational
Inequalities and Complementarity Problems (2003), section 1.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lcpcli.errors import (
    GIVE_FINITE,
    GIVE_NUMBER,
    ProblemError,
    kind,
    refuse_unknown,
)
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.block_form import SENSES, BlockForm, sense_of, size_of, symmetrized
from lcpcli.model.formulation import Conditions, names_of
from lcpcli.model.problem import Problem, conditions_of

PROGRAM_KEYS = ("kind", "variables", "ranges", "sense", "constant", "rows", "columns")


@dataclass(frozen=True)
class Program(BlockForm):
    """The program that belongs to the conditions of `Blocks`; it maps their solution z
    = (x, y, s) back to x and y.

    variables, ranges : the lengths of x and of s, which is the number of rows with two
        different finite bounds.
    sense : "min" or "max". For "max" the blocks contain the objective multiplied by -1.
    constant : is added to the objective.
    rows, columns : the names of the rows of A and of its columns, the variables; empty
        if they have none.
    """

    variables: int
    ranges: int = 0
    sense: str = "min"
    constant: float = 0.0
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    kind = "qp"
    form = "written as the program's optimality conditions,"
    left_out = ("objective",)
    inverse = "answers"
    hint_for_bounds = "give the bounds of its variables in the file"

    def remark(self, fields: Mapping[str, Any]) -> str:
        remark: str = self.sibling("keys").remark(fields)
        return remark

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Problem:
        problem: Problem = cls.sibling("keys").problem_of(fields)
        return problem

    def fields(self, problem: Problem, *, in_text: bool) -> dict[str, Any] | None:
        """Return the fields of the program, in its original sense, without default
        values."""
        del in_text
        data = self.blocks(conditions_of(problem))
        if data is None:
            return None
        Q, c = self.sign * data.Q, self.sign * data.c
        entries = Q.data if is_sparse(Q) else Q
        entries += 0.0  # -0 becomes 0
        fields = self.fields_of(data._replace(Q=Q, c=c), "Q", "c")
        if not (data.Q != 0).sum():
            del fields["Q"]
        sense = {} if self.sign > 0 else {"sense": self.sense}
        constant = {"constant": self.constant} if self.constant else {}
        names = {key: fields.pop(key) for key in ("rows", "columns") if key in fields}
        return sense | fields | constant | names

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Program:
        refuse_unknown("", data, PROGRAM_KEYS)
        rows, columns = (
            names_of(key, data.get(key, ())) for key in ("rows", "columns")
        )
        k = size_of(data, "variables", 1)
        ranges = size_of(data, "ranges", 0)
        sense = sense_of(data.get("sense", "min"))
        constant = constant_of(data.get("constant", 0.0))
        return cls(k, ranges, sense, constant, rows, columns)

    def data(self) -> dict[str, Any]:
        fields = {
            "kind": self.kind,
            "variables": self.variables,
            "ranges": self.ranges,
            "constant": self.constant,
        }
        fields |= {"rows": list(self.rows), "columns": list(self.columns)}
        fields |= {"sense": self.sense if self.sense != "min" else ""}
        return {key: value for key, value in fields.items() if value}

    def fits(self, conditions: Conditions) -> bool:
        """Return whether the problem has the conditions of a program of this size with
        a symmetric Q, and as many rows and columns as there are names.
        """
        blocks = self.blocks_that_fit(conditions)
        return blocks is not None and symmetrized(blocks.Q) is not None

    @property
    def block_form(self) -> Program:
        return self

    def with_ranges(self, ranges: int) -> Program:
        return replace(self, ranges=ranges)

    @property
    def sign(self) -> float:
        return SENSES[self.sense]

    def verified(self, proposed: Any) -> Any:
        return self.sibling("checks").verified(self, proposed)

    def meaning(self, data: Any) -> Any:
        return self.sibling("meaning").Optima(data, self)


def constant_of(raw_value: Any) -> float:
    if isinstance(raw_value, (bool, np.bool_)) or not isinstance(
        raw_value, (int, float, np.integer, np.floating)
    ):
        raise ProblemError("constant", f"is {kind(raw_value)}", GIVE_NUMBER)
    if not math.isfinite(raw_value):
        raise ProblemError("constant", "is not a finite number", GIVE_FINITE)
    return float(raw_value)
