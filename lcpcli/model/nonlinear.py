"""The nonlinear complementarity problem: find l <= z <= u with F(z)_i >= 0 where z_i <
u_i and F(z)_i <= 0 where z_i > l_i."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import MAKE_AGREE, ProblemError, count, kind, numbers_for
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.arrays import as_solutions, as_vector, readonly_copy, refuse_masked
from lcpcli.model.box import Box, as_intervals
from lcpcli.model.formulation import Named
from lcpcli.typing import BoundLike, Matrix, Vector, VectorLike

# Beginnings of ValueErrors of module math.
DOMAIN_ERRORS = ("math domain error", "math range error", "expected a")


class Enclosure(NamedTuple):
    """Bounds, rounded outward, on F and J for all z in a box.

    F_lower, F_upper : shape (n,). J_lower, J_upper : shape (n, n), both dense or both
    csr arrays of one pattern. Infinite bounds, or bounds that are nan, mean no bound.
    """

    F_lower: Vector
    F_upper: Vector
    J_lower: Matrix
    J_upper: Matrix


Interval: TypeAlias = Callable[[Vector, Vector], Enclosure]
"""A function that is called with the lower and the upper bounds of a box, each of shape
(n,), and returns an Enclosure of F and J over the box."""


class Composition(NamedTuple):
    """What the text of F consists of.

    operators : how often each operator but sums occurs, the most frequent one first.
    common_expressions, fixed_variables : how many there are; variables that are fixed
        are no unknowns.
    """

    operators: Mapping[str, int]
    common_expressions: int
    fixed_variables: int


class NonlinearProblem:
    """A nonlinear complementarity problem with n unknowns; row i is an equation if z_i
    has neither bound.

    n : the number of unknowns, the length of x0 or of a bound that is a vector.
    F : a function from z of shape (n,) to shape (n,). Outside its domain it may return
        nan or infinity.
    J : a function from z to the Jacobian of F, shape (n, n), dense or a scipy sparse
        matrix or array; None means finite differences.
    lower, upper : l and u, each a number or of shape (n,), by default 0 and infinity,
        stored as arrays of shape (n,).
    infinity : bounds of at least this size, often 1e20, are treated as infinite; by
        default only infinite bounds are.
    x0 : the z to start from, of shape (n,), moved within the bounds; by default the z
        within the bounds that is closest to 0.
    name : the name of the problem. names : n texts, the names of the unknowns; "" where
        there is none.
    note : a remark on how the problem has been read.
    interval : a function that encloses F and J over a box, for proofs; or None.
    composition : a function that returns what the text of F consists of; None if F has
        no text.
    solutions : the known solutions, each of shape (n,); empty if none is known.
    box : the bounds of z.

    >>> import numpy as np
    >>> from lcpcli.model.nonlinear import NonlinearProblem
    >>> problem = NonlinearProblem(lambda z: np.exp(z) - [2.0, 0.5], x0=[0.0, 0.0])
    >>> problem.values(np.zeros(2)).tolist()
    [-1.0, 0.5]
    """

    origin: ClassVar[None] = None  # as of a Problem that consists of M and q
    start_name = "x0"  # the name of the start in errors

    @property
    def formulation(self) -> Named:
        """Return the names of the unknowns as those of a Problem."""
        return Named(self.names)

    def __init__(
        self,
        F: Callable[[Vector], Any],
        J: Callable[[Vector], Any] | None = None,
        *,
        lower: BoundLike = 0.0,
        upper: BoundLike = math.inf,
        x0: VectorLike | None = None,
        name: str = "",
        note: str = "",
        names: Sequence[str] = (),
        interval: Interval | None = None,
        composition: Callable[[], Composition] | None = None,
        solutions: Sequence[VectorLike] = (),
        infinity: float = math.inf,
    ) -> None:
        for field, function in (("F", F), ("J", J)):
            if not (callable(function) or (function is None and field == "J")):
                raise ProblemError(
                    field,
                    f"is {kind(function)}",
                    f"give a function of z that returns {field}(z)",
                )
        vectors: tuple[Any, ...] = x0, lower, upper, tuple(names) or None
        if (vector := next(filter(np.ndim, vectors), None)) is None:
            reason = (
                f"{'is missing' if x0 is None else f'is {kind(x0)}'}, so that the "
                "number of unknowns is unknown"
            )
            raise ProblemError("x0", reason, "give x0, a list of numbers")
        self.n = n = int(np.size(vector))
        self.F = F
        self.J = J
        self.name = name
        self.note = note
        self.interval, self.composition = interval, composition
        self.box = Box(
            *map(
                readonly_copy,
                as_intervals(("lower", "upper"), lower, upper, n, infinity=infinity),
            )
        )
        self.lower, self.upper = self.box.lower, self.box.upper
        if len(names) not in (0, n):
            reason = numbers_for(len(names), "entry", n, "unknown")
            raise ProblemError("names", reason, MAKE_AGREE)
        self.names = tuple(map(str, names)) or ("",) * n
        self.x0 = readonly_copy(
            self.box.project(np.zeros(n) if x0 is None else as_vector("x0", x0, n))
        )
        self.solutions = as_solutions(solutions, n) if len(solutions) else ()

    def __repr__(self) -> str:
        name = f" {self.name}" if self.name else ""
        return f"<NonlinearProblem{name}: n = {self.n}>"

    def starting_at(self, z: VectorLike) -> NonlinearProblem:
        """Return the problem with another start, moved within the bounds."""
        other = copy(self)
        other.start_name = "z0"
        other.x0 = readonly_copy(self.box.project(as_vector("z0", z, self.n)))
        return other

    def values(self, z: Vector) -> Vector:
        """Return F(z), shape (n,), with nan where F is undefined; raise ProblemError if
        F returns anything else."""
        values = _reals("F", _called("F", self.F, z, self.n))
        if values.size != self.n:
            reason = (
                f"returns {count(values.size, 'number')} for {count(self.n, 'unknown')}"
            )
            raise ProblemError("F", reason, "return as many as there are unknowns")
        return values.reshape(self.n)

    def undefined(self, z: Vector) -> tuple[int, str] | None:
        """Return the first row in which F is not finite at z, and what it is there;
        None if there is none."""
        for i in (~np.isfinite(self.values(z))).nonzero()[0][:1].tolist():
            raw = np.ravel(np.asarray(_called("F", self.F, z, self.n)))
            is_real = not np.iscomplexobj(raw) or np.isnan(raw[i])
            return (
                i,
                f"{self.values(z)[i]:g}"
                if is_real
                else f"the complex number {raw[i]:g}",
            )
        return None

    def jacobian(self, z: Vector) -> Matrix:
        """Return J(z) by the J of the problem, dense or a csr array, possibly with nan;
        raise ProblemError for anything else."""
        assert self.J is not None
        raw_jacobian = _called("J", self.J, z, (self.n, self.n))
        if hasattr(raw_jacobian, "matvec"):
            hint = "return a matrix, dense or sparse, since its entries are needed"
            raise ProblemError("J", "returns a linear operator", hint)
        if is_sparse(raw_jacobian):
            with imports:
                from scipy.sparse import csr_array
            matrix: Matrix = csr_array(raw_jacobian)
            matrix.data = _reals("J", matrix.data)
        else:
            matrix = _reals("J", raw_jacobian)
        if matrix.shape != (self.n, self.n):
            reason = f"returns shape {matrix.shape} for {count(self.n, 'unknown')}"
            raise ProblemError("J", reason, f"return shape ({self.n}, {self.n})")
        return matrix


def _called(
    field: str,
    function: Callable[[Vector], Any],
    z: Vector,
    shape: int | tuple[int, int],
) -> Any:
    """Return what F or J returns at z; nan in this shape where it is undefined."""
    argument = z.copy()
    try:
        with np.errstate(all="ignore"):
            returned = function(argument)
        if argument.tobytes() != z.tobytes():
            raise ProblemError(
                field,
                "changes its argument z",
                "let it change a copy, such as z.copy()",
            )
        return returned
    except ArithmeticError:
        pass
    except ValueError as error:
        if not str(error).startswith(DOMAIN_ERRORS):
            raise
    return np.full(shape, np.nan)


def _reals(field: str, raw_value: Any) -> Vector:
    """Return a copy of numbers as float64, with nan for those that are not real, such
    as roots of negative numbers."""
    if raw_value is None:
        raise ProblemError(field, "returns nothing", "add a return statement")
    refuse_masked(field, raw_value)
    try:
        numbers = np.asarray(raw_value)
        if numbers.dtype.kind == "c":
            numbers = np.where(numbers.imag == 0, numbers.real, np.nan)
        return np.array(numbers, dtype=float)
    except (TypeError, ValueError):
        raise ProblemError(
            field, f"returns {kind(raw_value)}", "return an array of real numbers"
        ) from None
