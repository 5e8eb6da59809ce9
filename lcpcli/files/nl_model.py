"""The complementarity problem of an .nl file: its unknowns, and the function that belongs to each of them.

F, its Jacobian and enclosures of both, for the unknowns of an .nl file.

Equations, and the free variables to which they belong in a mixed complementarity problem.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError, count
from lcpcli.expressions.graph import Graph
from lcpcli.expressions.tape import SUM, Arithmetic, Jacobian, Tape
from lcpcli.files.fields import LARGEST_DENSE
from lcpcli.files.nl_bounds import BOTH, Conditions, kinds_of
from lcpcli.files.nl_segments import MEANINGS, Header, Linear, Segments, Side, Term
from lcpcli.model.nonlinear import Enclosure
from lcpcli.typing import Indices, Matrix, Vector

_Parts = list[tuple[int, Any]]  # the nodes of a sum with their coefficients

COMPARING = {"min", "max", "<", "<=", "=", ">=", ">", "!=", "if", "and", "or", "not", "<==>"}  # with infinity, too
NAMES = {"*": "product", "/": "quotient", "and": "min", "or": "max", "<==>": "="}  # of operators in a graph
SQUARE = "lcp solves square systems: rows with a complementing variable, and as many equations as other variables"
UNCOMPLEMENTED = "lcp needs for each inequality the variable that complements it, as in 0 <= z complements F(z) >= 0"
DIVIDED = "correct it; the program that wrote the file may have divided by 0"
LOST = (
    "a variable with two bounds but no row may have lost it, as by inequality() in Pyomo: "
    "write Var(bounds=(l, u)) and complements(x >= l, F >= 0)"
)


class Objective(NamedTuple):
    """An expression, by its node, to be minimized or maximized: sense is "min" or "max"."""

    sense: str
    node: int


class NlModel(NamedTuple):
    """A complementarity problem in n unknowns.

    graph, complements, equations : the expressions of the rows that complement an unknown, by the unknown, and of the
    equations. lower, upper, start : bounds and first values of the unknowns. free : the unknowns without a row, as many
    as there are equations. unknowns : of each unknown the variable in the file. fixed : the values of all variables
    that are no unknowns, by number. objective : None if there is none, or a constant one. remark : on bounds that count
    though no condition states them, else "".
    """

    header: Header
    graph: Graph
    complements: Mapping[int, int]
    equations: Sequence[int]
    free: Sequence[int]
    lower: Sequence[Any]
    upper: Sequence[Any]
    start: Vector
    unknowns: Sequence[int]
    fixed: Mapping[int, float]
    objective: Objective | None
    remark: str

    @property
    def rows(self) -> list[int]:
        """Return the expressions of the rows that complement an unknown, in the order of these, then the equations."""
        return [*(self.complements[i] for i in sorted(self.complements)), *self.equations]

    @property
    def names(self) -> list[str]:
        """Return the unknowns as the file calls them: v and the number."""
        return [f"v{number}" for number in self.unknowns]

    @property
    def is_linear(self) -> bool:
        """Return whether all expressions are linear."""
        n = self.graph.n
        return all(part < n for row in self.rows for part, _ in self.graph.parts(row).terms)

    @property
    def operators(self) -> dict[str, int]:
        """Return how often each operator but sums occurs in the rows, the most frequent one first."""
        found = dict[str, int]()
        for group in Tape(self.graph, self.rows, Arithmetic()).groups:
            if group.operator != SUM:
                found[group.operator] = found.get(group.operator, 0) + len(group.nodes)
        return dict(sorted(found.items(), key=lambda each: -each[1]))

    def values(self, z: Vector) -> Vector:
        """Return the values of all variables in the file for those of the unknowns, shape (n,)."""
        found = np.empty(len(self.unknowns) + len(self.fixed))
        found[list(self.unknowns)] = z
        found[list(self.fixed)] = list(self.fixed.values())
        return found


def model_of(segments: Segments, is_exact: bool = False) -> NlModel:
    """Return the problem; raise ProblemError if it is no square complementarity problem. is_exact : whether the numbers
    in the segments are Fractions."""
    bounds = [_ends(f"v{i}", *side) for i, side in enumerate(segments.bounds)]
    partners = _partners(segments)
    fixed = {i: low for i, (low, high) in enumerate(bounds) if low == high and i not in partners}
    unknowns = [i for i in range(len(bounds)) if i not in fixed]
    graph = Graph(len(unknowns), is_exact)
    place = {variable: i for i, variable in enumerate(unknowns)}
    nodes = [place[i] if i in place else graph.constant(fixed[i]) for i in range(len(bounds))]
    expressions = _Expressions(graph, dict(enumerate(nodes)))
    for number, (linear, terms) in segments.common.items():
        expressions.define(len(bounds) + number, linear, terms)
    equations, complements = list[int](), dict[int, int]()
    row_of = {row: variable for variable, row in partners.items()}
    for row, (low, high) in enumerate(segments.sides):
        linear, terms = segments.linear.get(row, {}), segments.rows[row]
        if row in row_of:
            complements[place[row_of[row]]] = _in_row(row, expressions, linear, terms, 0)
        elif low is not None or high is not None:
            if low != high:
                raise ProblemError(f"C{row}", "is an inequality that complements no variable", UNCOMPLEMENTED)
            equations.append(_in_row(row, expressions, linear, terms, -low))
    names = [f"v{variable}" for variable in unknowns]
    stated = {place[variable]: segments.complements[row][1] for variable, row in partners.items()}
    conditions = Conditions(graph, complements, stated, equations, [bounds[i] for i in unknowns], names)
    conditions.settle()
    free = [i for i in range(len(unknowns)) if i not in complements]
    _refuse_others(conditions, free, len(equations))
    start = [float(segments.start.get(variable, 0)) for variable in unknowns]
    lower, upper = zip(*conditions.bounds, strict=True) if unknowns else ((), ())
    known = {variable: float(value) for variable, value in fixed.items()}
    return NlModel(
        segments.header,
        graph,
        complements,
        equations,
        free,
        lower,
        upper,
        np.array(start),
        unknowns,
        known,
        _objective(segments, expressions),
        conditions.remark(),
    )


def _ends(where: str, low: Any, high: Any) -> Side:
    low, high = -math.inf if low is None else low, math.inf if high is None else high
    if not low <= high or low == math.inf or high == -math.inf:
        raise ProblemError(where, f"has the bounds {float(low):g} and {float(high):g}", "correct them")
    return low, high


def _partners(segments: Segments) -> dict[int, int]:
    partners: dict[int, int] = {}
    for row, (variable, _) in segments.complements.items():
        if variable in partners:
            fault = f"complements v{variable}, and so does C{partners[variable]}"
            raise ProblemError(f"C{row}", fault, "give each row a variable of its own")
        partners[variable] = row
    return partners


def _objective(segments: Segments, expressions: _Expressions) -> Objective | None:
    """Return the objective that is not constant; raise ProblemError if there are several."""
    found = list[Objective]()
    for number, (is_maximized, terms) in segments.objectives.items():
        node = expressions.node(segments.slopes.get(number, {}), terms, 0)
        if not expressions.is_constant(node):
            found.append(Objective("max" if is_maximized else "min", node))
    if len(found) > 1:
        raise ProblemError("", f"has {len(found)} objectives", "keep one")
    return found[0] if found else None


def _refuse_others(conditions: Conditions, free: Sequence[int], equations: int) -> None:
    """Raise ProblemError unless there are as many equations as variables without a row, none of which has bounds."""
    bounded = [i for i in free if kinds_of(*conditions.bounds[i])]
    if len(free) != equations:
        fault = f"has {count(equations, 'equation')} for {count(len(free), 'variable')} that no row complements"
        is_lost = any(kinds_of(*conditions.bounds[i]) == BOTH for i in bounded) and equations < len(free)
        raise ProblemError("", fault, f"{SQUARE}; {LOST}" if is_lost else SQUARE)
    for i in bounded:
        hint = "complement it with a row, or take its bounds out: equations do not keep them"
        raise ProblemError(conditions.names[i], "has bounds but no row that it complements", hint)


def _in_row(row: int, expressions: _Expressions, linear: Linear, terms: Sequence[Term], constant: Any) -> int:
    try:
        return expressions.node(linear, terms, constant)
    except ProblemError as error:
        raise error.inside(f"C{row}") from None


class _Expressions:
    """The expressions of a file in a graph. nodes : of each variable the unknown, or the constant if it is fixed."""

    def __init__(self, graph: Graph, nodes: dict[int, int]) -> None:
        self._graph, self._nodes = graph, nodes

    def define(self, number: int, linear: Linear, terms: Sequence[Term]) -> None:
        """Add a common expression."""
        self._nodes[number] = self._graph.share(self.node(linear, terms, 0))

    def is_constant(self, node: int) -> bool:
        """Return whether an expression has the same value everywhere."""
        return self._graph.value(node) is not None

    def node(self, linear: Linear, terms: Sequence[Term], constant: Any) -> int:
        """Return the sum of an expression, of multiples of variables and of a constant."""
        parts = [(self._nodes[variable], factor) for variable, factor in linear.items()]
        return self._graph.sum([*parts, (self._expression(terms), 1)], constant)

    def _expression(self, terms: Sequence[Term]) -> int:
        found: list[_Parts] = []
        for letter, value, size in reversed(terms):
            if letter == "o":
                found.append(self._apply(MEANINGS[value][0], [found.pop() for _ in range(size)]))
            elif letter == "p":
                found.append([(self._piecewise_linear(value[::2], value[1::2], self._graph.sum(found.pop())), 1)])
            else:
                found.append([(self._nodes[value] if letter == "v" else self._graph.constant(value), 1)])
        return self._graph.sum(found.pop())

    def _apply(self, name: str, arguments: Sequence[_Parts]) -> _Parts:
        """Return the value of an operator as a sum, so that sums of sums become nodes only once."""
        graph = self._graph
        if name not in COMPARING:
            self._refuse_infinite(node for part in arguments for node, _ in part)
        if name in ("+", "-", "sum", "negative"):
            (first, *others), is_minus = arguments, name == "-"
            if name == "negative":
                return [(node, -factor) for node, factor in first]
            for part in others:
                first += [(node, -factor) for node, factor in part] if is_minus else part
            return first
        nodes = [graph.sum(part) for part in arguments]
        if name == "square":
            return [(graph.apply("^", nodes[0], graph.constant(2)), 1)]
        if name == "less":  # max(a - b, 0)
            return [(graph.apply("max", graph.sum([(nodes[0], 1), (nodes[1], -1)]), graph.constant(0)), 1)]
        if name == "not":
            return [(graph.apply("=", nodes[0], graph.constant(0)), 1)]
        name = NAMES.get(name, name)
        if name not in ("min", "max"):
            return [(graph.apply(name, *nodes), 1)]
        found, *others_nodes = nodes
        for other in others_nodes:
            found = graph.apply(name, found, other)
        return [(found, 1)]

    def _refuse_infinite(self, nodes: Iterable[int]) -> None:
        for value in filter(None, map(self._graph.value, nodes)):
            if not math.isfinite(value):
                fault = f"computes with the constant {float(value):g}, so that it is finite nowhere"
                raise ProblemError("", fault, DIVIDED)

    def _piecewise_linear(self, slopes: Sequence[Any], breakpoints: Sequence[Any], argument: int) -> int:
        """Return the function with these slopes between the breakpoints that is 0 at 0: a sum of kinks."""
        graph, zero = self._graph, self._graph.constant(0)
        parts, constant = [(argument, slopes[0])], 0
        for place, left, right in zip(breakpoints, slopes, slopes[1:], strict=False):
            kink = graph.apply("max", graph.sum([(argument, 1)], -place), zero)
            parts.append((kink, right - left))
            constant -= (right - left) * max(-place, 0)
        return graph.sum(parts, constant)


class Functions:
    """The functions of a model in an arithmetic; those of the rows that complement an unknown come first on the tape.

    order : of each unknown the place of its row on the tape; by default equations are paired with the unknowns that are
    left by the entries of the Jacobian at the start.
    """

    def __init__(self, model: NlModel, arithmetic: Arithmetic, order: Indices | None = None) -> None:
        self.n = model.graph.n
        self._tape = Tape(model.graph, model.rows, arithmetic)
        self._jacobian = Jacobian(self._tape)
        self.order = self._paired(model) if order is None else order
        row_of = np.empty(self.n, np.intp)
        row_of[self.order] = np.arange(self.n)
        rows = row_of[self._jacobian.rows]
        self._entries = np.lexsort((self._jacobian.columns, rows))
        self._rows, self._columns = rows[self._entries], self._jacobian.columns[self._entries]
        self._ends = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=self.n))])

    @np.errstate(all="ignore")
    def _paired(self, model: NlModel) -> Indices:
        free, first = np.array(model.free, np.intp), len(model.complements)
        place = np.full(self.n, -1)
        place[free] = np.arange(free.size)
        rows, columns = self._jacobian.rows - first, place[self._jacobian.columns]
        own = (rows >= 0) & (columns >= 0)
        values = self._jacobian.entries(model.start)[own] if own.any() else np.empty(0)
        order = np.empty(self.n, np.intp)
        order[sorted(model.complements)] = np.arange(first)
        order[free] = first + paired(free.size, rows[own], columns[own], values)
        return order

    def F(self, z: Vector) -> Vector:
        return self._tape.values(z)[..., self.order]

    def J(self, z: Vector) -> Matrix:
        return self._matrix(self._entries_at(z))

    def _entries_at(self, z: Vector) -> Vector:
        return self._jacobian.entries(z)[..., self._entries]

    def _matrix(self, entries: Vector) -> Matrix:
        if self.n <= LARGEST_DENSE:
            matrix = np.zeros((self.n, self.n))
            matrix[self._rows, self._columns] = entries
            return matrix
        from scipy.sparse import csr_array

        return csr_array((entries, self._columns, self._ends), shape=(self.n, self.n))

    @np.errstate(all="ignore")
    def enclosure(self, lower: Vector, upper: Vector) -> Enclosure:
        """Return bounds on F and on the Jacobian over a box, if the arithmetic is that of intervals."""
        box = np.stack([lower, upper])
        return Enclosure(*self.F(box), *map(self._matrix, self._entries_at(box)))


LEAST = 2.0**-500  # stands for entries that happen to be 0, or are undefined


def paired(n: int, rows: Indices, columns: Indices, values: Vector) -> Indices:
    """Return for each of n free variables its equation: as many pairs as possible at entries of the Jacobian, of which
    the product is as large as possible, relative to the largest entries of the rows; what is left is paired in order.

    rows, columns, values : the entries. Every pairing has the same solutions, as an equation has to hold whatever its
    variable is; entries on the diagonal help the methods. (I. S. Duff and J. Koster, On algorithms for permuting large
    entries to the diagonal of a sparse matrix, 2001.)
    """
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    # Integers, as with rounding errors in the costs the matching may not end.
    sizes = np.rint(np.log2(np.clip(np.nan_to_num(np.abs(values), nan=LEAST), LEAST, 1 / LEAST)))
    largest = np.full(n, np.log2(LEAST))
    np.maximum.at(largest, rows, sizes)
    costs = 1.0 + largest[rows] - sizes
    own = np.arange(n)
    unpaired = n * (1.0 + costs.max(initial=0.0))  # of a row, and of a column, without a partner
    i = np.concatenate([rows, own, n + own, n + columns])
    j = np.concatenate([columns, n + own, own, n + rows])
    weights = np.concatenate([costs, np.full(2 * n, unpaired), np.ones(len(rows))])
    _, found = min_weight_full_bipartite_matching(csr_array((weights, (i, j)), shape=(2 * n, 2 * n)))
    equations = np.full(n, -1)
    is_paired = found[:n] < n
    equations[found[:n][is_paired]] = own[is_paired]
    equations[equations < 0] = own[~is_paired]
    return equations
