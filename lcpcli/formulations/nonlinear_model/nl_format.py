"""Models in AMPL's .nl format, in text or binary: complementarity conditions, and
equations for free variables.

D. M. Gay, Writing .nl files (2005), and Hooking your solver to AMPL (1997). Section 5
of the latter describes .sol files, in which solvers answer AMPL and other programs that
write .nl files.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from fractions import Fraction
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError, count
from lcpcli.files.contents import decode
from lcpcli.files.fields import LARGEST_DENSE
from lcpcli.files.formats import Number, refuse
from lcpcli.files.input_file import WHOLE, InputFile
from lcpcli.formulations.nonlinear_model.conditions import NlModel
from lcpcli.formulations.nonlinear_model.graph import Arithmetic, Intervals
from lcpcli.formulations.nonlinear_model.program import NlProgram, is_program
from lcpcli.formulations.nonlinear_model.segments import (
    Header,
    in_names,
    named,
    names_from_sibling,
    segments_in,
    whole,
    with_names,
)
from lcpcli.formulations.nonlinear_model.tape import Jacobian, Tape
from lcpcli.model.formulation import LEFT_OUT, Objective
from lcpcli.model.nonlinear import Composition, Enclosure, NonlinearProblem
from lcpcli.rational.numbers import Doubles, fraction
from lcpcli.typing import Indices, Matrix, Vector

NO_OBJECTIVE = (
    "take the objective out to find one solution, or write its optimality "
    "conditions as complementarity conditions; "
    "lcp minimizes over the solutions of linear models only"
)


class Model:
    """A model in the content of a file, with errors that name variables and rows.

    path : the name of the file. The names of variables and rows are read from files in
        the same directory, if there are any.
    """

    def __init__(self, content: bytes, path: str) -> None:
        self._content, self.path = content, path

    @cached_property
    def conditions(self) -> NlModel | NlProgram:
        return self._with_numbers(float)

    @cached_property
    def exact(self) -> NlModel | NlProgram:
        """Return the same conditions with their numbers as fractions."""
        return self._with_numbers(
            lambda text: fraction(text) if isfinite(double := float(text)) else double
        )

    def _with_numbers(self, constant: Callable[[str], Any]) -> NlModel | NlProgram:
        try:
            segments = segments_in(self._content, constant)
            if is_program(segments):
                return NlProgram(segments)
            return NlModel(segments, is_exact=constant is not float)
        except ProblemError as error:
            raise named(self.path, error) from None

    @property
    def remark(self) -> str:
        return in_names(self.path, self.conditions.remark)

    @cached_property
    def functions(self) -> Functions:
        return Functions(_without_program(self.conditions), Arithmetic())

    @cached_property
    def intervals(self) -> Functions:
        exact = _without_program(self.exact)
        return Functions(exact, Intervals(), self.functions.order)


def _without_program(conditions: NlModel | NlProgram) -> NlModel:
    if isinstance(conditions, NlModel):
        return conditions
    hint = "read it by lcpcli.read, and solve it by run"
    raise ProblemError("", "is a program", hint)


parse = Model


def fields(model: Model, number: Number = float) -> dict[str, Any]:
    """Return M, q, the bounds, and the variables as names of a linear model, or the
    fields of a program. Raises ProblemError for a nonlinear model.
    """
    conditions = model.exact if isinstance(number, Doubles) else model.conditions
    of = number.of if isinstance(number, Doubles) else float
    if isinstance(conditions, NlProgram):
        return with_names(model.path, conditions.fields(of))
    refuse(
        not conditions.is_linear,
        "",
        "is a nonlinear model",
        "see lcp help models for what takes it",
    )
    from scipy.sparse import csr_array

    graph = conditions.graph
    order = order_of(conditions, Jacobian(graph, conditions.rows, Arithmetic()))
    rows = [graph.parts(conditions.rows[position]) for position in order]
    entries = [(i, *term) for i, row in enumerate(rows) for term in row.terms]
    i, j, numbers = zip(*entries, strict=True) if entries else ((), (), ())
    values = np.array(list(map(of, numbers)), float)
    M = csr_array((values, (i, j)), shape=(graph.n, graph.n))
    lower, upper = (
        np.array([of(bound) if isfinite(bound) else float(bound) for bound in bounds])
        for bounds in (conditions.lower, conditions.upper)
    )
    remark = in_names(model.path, conditions.remark)
    remarks = remark, LEFT_OUT if conditions.objective else ""
    return {
        "M": M.toarray() if graph.n <= LARGEST_DENSE else M,
        "q": np.array([of(row.constant) for row in rows]),
        "lower": lower,
        "upper": upper,
        "names": names_from_sibling(model.path, conditions.names),
        "note": "; ".join(filter(None, remarks)),
    }


def read_nl(path: str | os.PathLike[str]) -> NonlinearProblem:
    """Read a model of AMPL in an .nl file, in text or in binary, as a nonlinear problem
    for `solve_mcp`.

    The model must be square: each row either complements a variable, or is an equation,
    of which there are as many as other variables that are not fixed; these must be
    free, and are paired with them. Names are taken from a file .col next to it. Fixed
    variables that no row complements are no unknowns. `lcpcli.read` reads linear
    models.

    Raises ProblemError, which says where the error is, what is wrong, and how to fix
    it.

    >>> from lcpcli import read_nl
    >>> read_nl("missing.nl")
    Traceback (most recent call last):
    lcpcli.errors.ProblemError: missing.nl: ...
    """
    file = InputFile.read(os.fspath(path), WHOLE)
    return file.within(problem_of, file.data, file.name)


def nonlinear(model: Model, name: str) -> NonlinearProblem | None:
    """Return the problem of a model that is not linear; None if it is linear."""
    return None if model.conditions.is_linear else problem_of(model, name)


def problem_of(model: Model, name: str) -> NonlinearProblem:
    conditions = _without_program(model.conditions)
    refuse(
        conditions.objective is not None,
        "",
        "has an objective, and is not linear",
        NO_OBJECTIVE,
    )
    return NonlinearProblem(
        model.functions.F,
        model.functions.J,
        lower=np.array(conditions.lower, float),
        upper=np.array(conditions.upper, float),
        x0=conditions.start,
        name=name,
        note=model.remark,
        names=names_from_sibling(model.path, conditions.names),
        interval=lambda *box: model.intervals.enclosure(*box),
        composition=lambda: Composition(
            conditions.operators, conditions.header.common, len(conditions.fixed)
        ),
    )


def objective(model: Model) -> Objective | None:
    """Return the objective of a linear model, with its exact decimals; None if there is
    no objective, or a constant one.
    """
    if not model.conditions.is_linear or model.conditions.objective is None:
        return None
    exact = _without_program(model.exact)
    assert exact.objective is not None
    sense, node = exact.objective
    terms, constant = exact.graph.parts(node)
    costs, n = dict(terms), exact.graph.n
    reason = "has an objective that is not linear"
    hint = "write a linear one, or take it out to find one solution"
    refuse(any(part >= n for part in costs), "", reason, hint)
    values = [Fraction(costs.get(i, 0)) for i in range(n)]
    return Objective(values, sense, Fraction(constant))


def solution(model: Model, content: bytes) -> list[Fraction]:
    """Return the solution in the content of a .sol file, with all decimals. Raises
    ProblemError if it is not a solution of this model.
    """
    variables = model.conditions.header.variables
    lines = [line.strip() for line in decode(content).split("\n")]
    try:
        at = lines.index("Options") + 1
        at += 1 + whole(lines[at]) - (lines[at + 2] == WITH_TOLERANCE)
        _, duals, n_variables, values = map(whole, lines[at : at + 4])
        first = at + 4 + duals
        read_values = [fraction(line) for line in lines[first : first + values]]
    except (ValueError, IndexError):
        raise ProblemError(
            "",
            "is no .sol file in text",
            "write it as solvers for AMPL do, in text",
        ) from None
    reason = (
        f"has {count(len(read_values), 'value')} of "
        f"{count(n_variables, 'variable')} for {variables} of the model"
    )
    refuse(
        n_variables != variables or len(read_values) != n_variables,
        "",
        reason,
        "solve the model again",
    )
    return [read_values[variable] for variable in model.conditions.unknowns]


class Functions:
    """F and its Jacobian for a model, in an arithmetic.

    order : for each unknown the position of its row in the rows of the model. By
        default, `order_of` pairs the equations with the free unknowns, by the entries
        of the Jacobian at the start.
    """

    def __init__(
        self, model: NlModel, arithmetic: Arithmetic, order: Indices | None = None
    ) -> None:
        graph, rows_of_model = model.graph, model.rows
        self.n = graph.n
        self._jacobian = Jacobian(graph, rows_of_model, arithmetic)
        self.order = order_of(model, self._jacobian) if order is None else order
        in_order = [rows_of_model[position] for position in self.order]
        self.F = Tape(graph, in_order, arithmetic).values
        rows = np.argsort(self.order)[self._jacobian.rows]
        self._entries = np.lexsort((self._jacobian.columns, rows))
        self._places = rows[self._entries], self._jacobian.columns[self._entries]

    def J(self, z: Vector) -> Matrix:
        return self._matrix(self._jacobian.entries(z))

    def _matrix(self, entries: Vector) -> Matrix:
        rows, columns = self._places
        if self.n <= LARGEST_DENSE:
            matrix = np.zeros((self.n, self.n))
            matrix[rows, columns] = entries[self._entries]
            return matrix
        from scipy.sparse import csr_array

        row_starts = np.searchsorted(rows, np.arange(self.n + 1))
        return csr_array(
            (entries[self._entries], columns, row_starts), shape=(self.n, self.n)
        )

    @np.errstate(all="ignore")
    def enclosure(self, lower: Vector, upper: Vector) -> Enclosure:
        """Return bounds of F and of its Jacobian over a box. The arithmetic has to be
        `Intervals`.
        """
        box = np.stack([lower, upper])
        return Enclosure(*self.F(box), *map(self._matrix, self._jacobian.entries(box)))


@np.errstate(all="ignore")
def order_of(model: NlModel, jacobian: Jacobian) -> Indices:
    free, first = np.array(model.free, np.intp), len(model.complements)
    position = np.full(model.graph.n, -1)
    position[free] = np.arange(free.size)
    rows, columns = jacobian.rows - first, position[jacobian.columns]
    is_inside = (rows >= 0) & (columns >= 0)
    order = np.empty(model.graph.n, np.intp)
    order[sorted(model.complements)] = np.arange(first)
    order[free] = first + paired(
        free.size,
        rows[is_inside],
        columns[is_inside],
        jacobian.entries(model.start)[is_inside],
    )
    return order


LEAST = 2.0**-500  # replaces entries that are 0 at the start, or undefined there


def paired(n: int, rows: Indices, columns: Indices, values: Vector) -> Indices:
    """Return for each of n free variables the index of its equation.

    As many pairs as possible have an entry of the Jacobian, and the product of these
    entries is as large as possible, relative to the largest entries of the rows; the
    remaining variables and equations are paired in order. (I. S. Duff and J. Koster, On
    algorithms for permuting large entries to the diagonal of a sparse matrix, 2001.)
    Every pairing has the same solutions, as an equation has to hold whatever its
    variable is; large entries on the diagonal help the methods.

    rows, columns, values : the entries of the Jacobian.
    """
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    # The costs are integers: with rounding errors in them, the matching may not
    # terminate.
    sizes = np.rint(
        np.log2(np.clip(np.nan_to_num(np.abs(values), nan=LEAST), LEAST, 1 / LEAST))
    )
    largest, indices = np.full(n, np.log2(LEAST)), np.arange(n)
    np.maximum.at(largest, rows, sizes)
    costs = 1.0 + largest[rows] - sizes
    # The cost of a row or a column without a partner exceeds that of any matching.
    unpaired = n * (1.0 + costs.max(initial=0.0))
    i = np.concatenate([rows, indices, n + indices, n + columns])
    j = np.concatenate([columns, n + indices, indices, n + rows])
    weights = np.concatenate([costs, np.full(2 * n, unpaired), np.ones(len(rows))])
    _, matching = min_weight_full_bipartite_matching(
        csr_array((weights, (i, j)), shape=(2 * n, 2 * n))
    )
    equations, is_paired = np.full(n, -1), matching[:n] < n
    equations[matching[:n][is_paired]] = indices[is_paired]
    equations[equations < 0] = indices[~is_paired]
    return equations


WITH_TOLERANCE = "3"  # as the second option it says that a tolerance follows


def solution_text(
    header: Header, message: str, values: Vector, number: int, duals: Vector
) -> str:
    """Return the text of a .sol file with the values of all variables, and the
    multipliers of all rows or of none.

    number : the solve_result_num.
    """
    size, *options = header.options
    # The number of options is two more if a tolerance follows.
    size = str(int(size) + 2 * (options[1:2] == [WITH_TOLERANCE]))
    lines = [
        message,
        "",
        "Options",
        size,
        *options,
        header.rows,
        len(duals),
        header.variables,
        len(values),
    ]
    numbers = [*duals.tolist(), *values.tolist()]
    return "\n".join(map(str, [*lines, *numbers, f"objno 0 {number}", ""]))
