"""The mixed linear complementarity problem; the linear complementarity problem is the
case l = 0, u infinite."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as declared
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import GIVE_TEXT, ProblemError, kind, unknown
from lcpcli.linalg.doubles import FAR_FROM_ONE, are_moderate, size
from lcpcli.linalg.factors import Latest
from lcpcli.linalg.matrices import dense, is_sparse, product, row_maxima
from lcpcli.linalg.units import Base, Units, units
from lcpcli.model import arrays, views
from lcpcli.model.arrays import (
    as_sized_vector,
    as_solutions,
    as_square,
    as_vector,
    readonly_copy,
    readonly_matrix,
)
from lcpcli.model.box import MIN_FAR, ORTHANT, Box, Reference, box_of, reference
from lcpcli.typing import BoundLike, Matrix, Vector, VectorLike

if TYPE_CHECKING:
    from lcpcli.model.block_form import BlockForm
    from lcpcli.model.far_sides import FarSides
    from lcpcli.model.formulation import Conditions, Formulation
    from lcpcli.model.rounded_rows import RoundedRows

# Fields that are no data.
REMARKS = ("name", "solutions", "verdict", "source", "note", "reference", "origin")
# Fields that depend on M alone, and those that name and start a problem whatever its q
# and bounds are: a problem with the same M gets these, and no others.
M_FIELDS = ("M", "n", "largest", "facts", "latest")
LABELS = ("name", "source", "note", "origin", "names", "x0", "x1")
M_AND_LABELS = (*M_FIELDS, *LABELS)
NUMBERS = frozenset(("M", "q", "lower", "upper", "box"))  # fields with numbers
VERDICTS = ("infeasible", "unsolvable", "ray")
WITHOUT_SOLUTION = ("infeasible", "unsolvable")


LCP_BOUNDS = 0.0, math.inf

# Rows up to which the scaling factors of a sparse M take less time as a dense one.
MAX_UNITS_AS_DENSE = 150
# Counting the operations of a factorization ends here: it would take several seconds.
MAX_COUNTED_OPERATIONS = 1e10


class Facts:
    """Facts about the M of a problem, or of its block form, each computed when it is
    first read. All problems with this M and origin share them, whatever their q and
    bounds are, and each fact is the same whichever problem reads it first.

    kind : what a formulation knows about every solution of its conditions; None before
        it has computed that.
    """

    kind: Any = None
    # The facts about the last dense M of a sequence whose scaling factors are known.
    _before: Facts | None = None
    # The facts about the M of which this one is another form.
    _given: Facts | None = None

    def __init__(self, M: Matrix, block_form: BlockForm | None) -> None:
        self._M, self._form = M, block_form

    def in_other_form(self, M: Matrix) -> Facts:
        """Return the facts about this M, stored as a dense or as a sparse matrix."""
        other = Facts(M, self._form)
        other._given = self._given or self
        return other

    def __getstate__(self) -> dict[str, Any]:
        """Leave the M before out of copies and pickles."""
        without = "_before", "base"
        return {key: value for key, value in vars(self).items() if key not in without}

    def follow(self, before: Facts) -> None:
        """Let the units of M before in a sequence bound those of this one."""
        if is_sparse(self._M) or is_sparse(before._M):
            return
        self._before = before.known
        if self._before is before:
            before._before = None

    @property
    def known(self) -> Facts | None:
        """Return the facts about the last M of the sequence whose units are known."""
        return self if "units" in vars(self) else self._before

    @property
    def near_base(self) -> Base | None:
        """Return that M, with its units; None if it is sparse, or those of no M are
        known."""
        known = self.known
        return None if known is None or is_sparse(known._M) else known.base

    def after(self, M: Vector, sizes: tuple[float, float], change: float) -> Facts:
        """Return the facts about the next M of the sequence, which is dense, before
        they `follow` these. sizes : of its row maxima. change : that from the last M
        whose units are known, as for `Base.digits_for`."""
        facts, base = Facts(M, self._form), self.near_base
        near_units = None
        if base is not None and (digits := base.digits_for(change)) < math.inf:
            near_units = base.units, digits
        smallest, largest = sizes
        vars(facts).update(
            largest=largest,
            has_moderate_rows=largest <= FAR_FROM_ONE and smallest >= 1 / FAR_FROM_ONE,
            _units_before=near_units,
        )
        return facts

    @property
    def near_units(self) -> tuple[Units, float] | None:
        """Return the units of this M, if they are known, or of one before, and a bound
        on how many binary digits the quotients of two R_i differ from those of this
        one; None if no M before is near."""
        return (self.units, 0.0) if "units" in vars(self) else self._units_before

    @cached_property
    def _units_before(self) -> tuple[Units, float] | None:
        if self._before is None:
            return None
        base = self._before.base
        digits = base.digits_to(self._M)
        return (base.units, digits) if digits < math.inf else None

    @cached_property
    def base(self) -> Base:
        return Base(self._M, self.units)

    @cached_property
    def row_maxima(self) -> Vector:
        return row_maxima(self._M)

    @cached_property
    def largest(self) -> float:
        return float(self.row_maxima.max())

    @cached_property
    def row_means(self) -> Vector | None:
        """Return the binary logarithm of the geometric mean of each row of a dense M;
        None if some M_ij is 0."""
        if is_sparse(self._M) or not self._M.all():
            return None
        sums = np.log2(np.abs(self._M)).sum(axis=1)
        return np.asarray(sums / self._M.shape[0])

    @cached_property
    def has_moderate_rows(self) -> bool:
        return are_moderate(self.row_maxima)

    @cached_property
    def signs(self) -> Vector | None:
        """Return S = +-1 with S M symmetric, as for block forms; None if there is none,
        or M is dense."""
        if not is_sparse(self._M):
            return None
        if self._form is not None:
            return self._form.signs(self._M.shape[0])
        with imports:
            from lcpcli.linalg.patterns import signs
        return signs(self._M)

    @cached_property
    def elimination_operations(self) -> float:
        """Return the operations of factors of a sparse M + M' + I, as
        `patterns.elimination_operations` counts them, up to MAX_COUNTED_OPERATIONS."""
        with imports:
            from lcpcli.linalg.patterns import elimination_operations
        return elimination_operations(self._M, MAX_COUNTED_OPERATIONS)

    @cached_property
    def units(self) -> Units:
        """Return the units of the M that was given, whichever form is read first: those
        of another form differ by rounding."""
        if self._given is not None:
            return self._given.units
        if self._form is not None:
            return units(self._M, self._form.signs(self._M.shape[0]))
        is_small = self._M.shape[0] <= MAX_UNITS_AS_DENSE
        return units(dense(self._M) if is_small else self._M, None)


class TextNumbers(NamedTuple):
    """The numbers of the text that a problem was read from.

    exactly : reads them, with all digits, as a `rational.ExactProblem` of the problem.
    are_short : returns whether they are the shortest decimals of their doubles.
    """

    exactly: Callable[[Problem], Any]
    are_short: Callable[[], bool]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Problem:
    """An LCP with n >= 0 unknowns, or a mixed one: find l <= z <= u with w = M z + q,
    w_i >= 0 where z_i < u_i and w_i <= 0 where z_i > l_i.

    So w_i = 0 where l_i < z_i < u_i, and w_i is free where l_i = u_i. If z_i has
    neither bound, row i is an equation. All numbers except bounds must be finite,
    lengths must agree, and l <= u; else a ProblemError names the field.

    n, M : the number of unknowns, and the matrix, of shape (n, n): nested sequences, a
        list of arrays, anything that numpy calls array-like, or a scipy sparse matrix
        or array. M is stored dense or in compressed sparse rows. All arrays of the
        problem are read-only; arguments are copied unless they are read-only already.
    q : shape (n,); like any vector, it may be an array of shape (n, 1) or (1, n). Here
        and below, numbers in lists may be Fractions, which are rounded to double
        precision.
    lower, upper : l and u, each a number or of shape (n,), by default 0 and infinity,
        as in an LCP; minus infinity in l and infinity in u mean no bound. For an LCP
        they are stored as the numbers 0 and infinity, else as arrays.
    infinity : bounds of at least this size, often 1e20, are treated as infinite; by
        default only infinite bounds are.
    name, source, note : the name and the source of the problem, and a remark.
    x0, x1 : starting points for methods that iterate on x = (z - w) / 2, shape (n,), or
        None.
    solutions : the known solutions z*, each of shape (n,); empty if none is known.
    reference : "known" for solutions from the caller, else how they were computed:
        "exact" or "computed", see `solving.proof`.
    verdict : "infeasible" or "unsolvable" if known to have no solution, "ray" if
        Lemke's method terminates on a ray; else "".
    origin : the program or the game behind the problem, or the object for it in a file;
        or its `names`; or None.
    names : n texts, the names of the unknowns, instead of an origin; else those of the
        origin, "" where it has none.
    row_maxima, largest : the largest |M_ij| in each row, shape (n,), and in M.
        sizes_of_q : the smallest nonzero |q_i|, infinite if there is none, and the
        largest |q_i|.
    is_moderate : whether no row of M, and no q_i, is so large or small that a product
        of a few over- or underflows.
    is_mixed, box : whether there are bounds other than z >= 0; the bounds, with what
        depends on them.

    >>> from lcpcli import Problem
    >>> Problem([[2, 1], [1, 2]], [-5, -6], name="small")
    <Problem small: n = 2, dense>
    >>> Problem([[2, 1], [1, 2]], [-5, -6], lower=[0, float("-inf")], upper=1)
    <Problem: n = 2 (1 upper bound, 1 boxed), dense>
    """

    M: Matrix
    q: Vector
    name: str = ""
    x0: Vector | None = None
    x1: Vector | None = None
    solutions: tuple[Vector, ...] = ()
    verdict: str = ""
    source: str = ""
    note: str = ""
    reference: str = "known"
    origin: Formulation | None = None
    lower: Vector | float = 0.0
    upper: Vector | float = math.inf
    # The sums of the |terms| of which each q_i is the sum, or None.
    terms_of_q: Vector | None = declared(default=None, init=False, repr=False)
    # The numbers of the text that the problem was read from, as a
    # `TextNumbers`; None for a problem made from arrays.
    written: TextNumbers | None = declared(default=None, init=False, repr=False)
    box: Box = declared(init=False, repr=False)
    largest: float = declared(init=False, repr=False)
    sizes_of_q: tuple[float, float] = declared(init=False, repr=False)
    is_moderate: bool = declared(init=False, repr=False)
    n: int = declared(init=False, repr=False)

    def __init__(
        self,
        M: Any,
        q: VectorLike,
        name: str = "",
        x0: VectorLike | None = None,
        x1: VectorLike | None = None,
        solutions: Sequence[VectorLike] = (),
        verdict: str = "",
        source: str = "",
        note: str = "",
        reference: str = "known",
        origin: Any = None,
        lower: BoundLike = 0.0,
        upper: BoundLike = math.inf,
        infinity: float = math.inf,
        names: Sequence[str] = (),
    ) -> None:
        has_names = (
            bool(names) if isinstance(names, (tuple, list)) else np.size(names) > 0
        )
        if type(M) is not np.ndarray and hasattr(M, "columns"):
            if not (has_names or origin is not None):
                names = arrays.texts(M.columns)
                has_names = bool(names)
            solutions = _solutions_by_label(M, solutions)
            M, q, lower, upper, x0, x1 = arrays.by_label(
                M, M=M, q=q, lower=lower, upper=upper, x0=x0, x1=x1
            )
        vector_q, (smallest_q, largest_q) = as_sized_vector("q", q)
        n = vector_q.size
        matrix, (smallest_row, largest_entry) = as_square("M", M, n)
        texts = {"name": name, "verdict": verdict, "source": source, "note": note}
        are_plain = type(name) is type(verdict) is type(source) is type(note) is str
        if verdict or not are_plain:
            _check_texts(texts)
        box = ORTHANT
        if not (type(lower) is type(upper) is float and (lower, upper) == LCP_BOUNDS):
            box = box_of(lower, upper, n, infinity)
        x0 = None if x0 is None else as_vector("x0", x0, n)
        x1 = None if x1 is None else as_vector("x1", x1, n)
        known_solutions = (
            as_solutions(solutions, n)
            if type(solutions) is not tuple or solutions
            else ()
        )
        is_moderate = (
            min(smallest_row, smallest_q) >= 1 / FAR_FROM_ONE
            and max(largest_entry, largest_q) <= FAR_FROM_ONE
        )
        fields = self.__dict__  # set one by one, which is fastest
        fields["M"] = (
            readonly_copy(matrix, M)
            if type(matrix) is np.ndarray
            else readonly_matrix(matrix)
        )
        fields["q"] = vector_q
        fields["n"] = n
        fields["x0"] = x0
        fields["x1"] = x1
        fields.update(
            texts,
            lower=box.lower,
            upper=box.upper,
            box=box,
            solutions=known_solutions,
            reference=reference,
            origin=None,
            is_moderate=is_moderate,
        )
        fields["largest"], fields["sizes_of_q"] = largest_entry, (smallest_q, largest_q)
        if box is ORTHANT:
            fields["lower"], fields["upper"] = LCP_BOUNDS
        if box.has_zero_lower:
            fields.update(reference_z=None, q_ref=vector_q, q_error=0.0)
        if origin is not None or has_names:
            with imports:
                from lcpcli.model.origins import origin_of
            fields["origin"] = origin_of(origin, names, conditions_of(self))
            if self.block_form is not None:
                fields["M"] = readonly_matrix(self.block_form.symmetric(matrix))

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any], **changed_fields: Any) -> Problem:
        """Return the problem with these fields and known values, in a microsecond, as
        nothing is validated."""
        problem = cls.__new__(cls)
        problem.__dict__.update(fields, **changed_fields)
        return problem

    def fields_of_M(self) -> dict[str, Any]:
        """Return the fields of this problem that hold for any q and bounds: M_FIELDS
        and LABELS."""
        fields, facts = vars(self), self.facts
        shared = {name: fields[name] for name in M_AND_LABELS if name in fields}
        shared["facts"] = facts
        return shared

    def having(self, **values: Any) -> Problem:
        """Return the same problem with other values of these fields, which nothing
        validates. With another origin, facts are computed again; other numbers are not
        those of the text that the problem was read from."""
        fields = vars(self)
        old = set[str]()
        if "origin" in values:
            old |= {"facts", "block_form"}
        if "solutions" in values:
            old.add("size_of_solutions")
        if not NUMBERS.isdisjoint(values):
            old |= {"written", "exact_numbers"}
        if old:
            fields = {name: value for name, value in fields.items() if name not in old}
        return Problem.of_fields(fields, **values)

    def __repr__(self) -> str:
        return str(views.outcome.problem_text(self))

    @property
    def is_mixed(self) -> bool:
        return not self.box.is_orthant

    @property
    def bounds(self) -> dict[str, Vector]:
        """Return the bounds by name if the problem is mixed; else an empty dict."""
        return (
            {"lower": self.box.lower, "upper": self.box.upper} if self.is_mixed else {}
        )

    def named(self, name: str, origin: Formulation | None = None) -> Problem:
        """Return the same problem with another name and, unless it is None, another
        origin, whose names then apply."""
        fields = (
            {} if origin is None else {"origin": origin, "names": origin.names(self.n)}
        )
        return self.having(name=name, **fields)

    def anew(self) -> Problem:
        """Return the same problem, rebuilt from its arrays, without anything computed
        from them."""
        other = Problem(
            self.M, self.q, x0=self.x0, x1=self.x1, lower=self.lower, upper=self.upper
        )
        kept = (*REMARKS, "written")
        return other.having(**{field: getattr(self, field) for field in kept})

    @cached_property
    def names(self) -> Sequence[str]:
        """Return the names of the components, from the origin of the problem; "" where
        there is none."""
        return self.origin.names(self.n) if self.origin is not None else [""] * self.n

    @cached_property
    def facts(self) -> Facts:
        """Return the facts about M, which all problems with this M share."""
        return Facts(self.M, self.block_form)

    @cached_property
    def exact_numbers(self) -> Any:
        """Return the numbers of the text that the problem was read from, with all
        digits, as a `rational.ExactProblem`."""
        assert self.written is not None
        return self.written.exactly(self)

    @property
    def formulation(self) -> Formulation:
        """Return what the problem was made from, a plain one if that is M and q."""
        if self.origin is not None:
            return self.origin
        with imports:
            from lcpcli.model.formulation import PLAIN
        return PLAIN

    @property
    def signs(self) -> Vector | None:
        return self.facts.signs

    @cached_property
    def block_form(self) -> BlockForm | None:
        """Return where rows, multipliers and an objective are, if the problem has the
        conditions of one."""
        return None if self.origin is None else self.origin.block_form

    @property
    def start(self) -> Vector:
        """Return the x from which a run starts by default."""
        return np.zeros(self.n) if self.x0 is None else self.x0

    @property
    def has_far_sides(self) -> bool:
        """Return whether some sides are likely to mean infinite ones."""
        is_far = self.box.is_far
        if not is_far and self.origin is not None:  # a far row side
            is_far = self.sizes_of_q[1] >= MIN_FAR
        return is_far and self.far_sides is not None

    @cached_property
    def far_sides(self) -> tuple[FarSides, float, float] | None:
        """Return those sides, and the sizes of the smallest of them and of the largest
        one that is not far; None if there are none."""
        with imports:
            from lcpcli.model.far_sides import far_sides
        _, q, low, high = conditions_of(self)
        block_form = self.block_form
        if block_form is not None:
            y = slice(block_form.variables, self.n - block_form.ranges)
            return far_sides(q, low, high, y)
        # The size of z without bounds.
        is_used = self.row_maxima > 0
        size_of_z = np.abs(q[is_used]) / self.row_maxima[is_used]
        return far_sides(q, low, high, None, float(size_of_z.max(initial=0.0)))

    @cached_property
    def rounded_rows(self) -> RoundedRows | None:
        """Return the rows without entries whose sides are rounding of 0, so that the
        literal numbers have no solution; None if there are none."""
        block_form = self.block_form
        has_ranges = block_form is not None and block_form.ranges > 0
        if not has_ranges and np.count_nonzero(self.row_maxima) == self.n:
            return None
        with imports:
            from lcpcli.model.rounded_rows import rounded_rows
        return rounded_rows(
            conditions_of(self), self.row_maxima, block_form, self.names
        )

    @property
    def has_small_integers(self) -> bool:
        """Return whether all finite numbers are integers up to 2^20: sums of a few
        thousand products are then exact."""
        bounds = (bound[np.isfinite(bound)] for bound in self.box.vectors(self.n))
        numbers = (self.M.data if is_sparse(self.M) else self.M, self.q, *bounds)
        return all(
            (np.rint(v) == v).all() and np.abs(v).max(initial=0.0) <= 2**20
            for v in numbers
        )

    @property
    def row_maxima(self) -> Vector:
        return self.facts.row_maxima

    @cached_property
    def latest(self) -> Latest:
        return Latest()

    @property
    def units(self) -> Units:
        return self.facts.units

    @cached_property
    def _reference(self) -> Reference:
        return reference(self.M, self.q, self.box)

    @cached_property
    def reference_z(self) -> Vector | None:
        """Return the reference point (see `box.reference`); None if it is 0, as for an
        LCP."""
        return self._reference.z

    @property
    def is_shifted_lcp(self) -> bool:
        """Return whether z - l, for finite lower bounds alone, solves an LCP, whose q
        is q_ref."""
        box = self.box
        if box.is_orthant:
            return True
        is_bounded_below = box.lower.min() > -math.inf and box.upper.min() == math.inf
        return bool(
            is_bounded_below and np.array_equal(self.reference_point, box.lower)
        )

    @property
    def reference_point(self) -> Vector:
        return np.zeros(self.n) if self.reference_z is None else self.reference_z

    @cached_property
    def q_ref(self) -> Vector:
        """Return w = M z + q at the reference point: the scale of the rows, which no
        shift of bounds changes."""
        return self._reference.q

    @cached_property
    def q_error(self) -> Vector | float:
        """Return bounds on the rounding errors in q_ref: 0 for an LCP, else of shape
        (n,), at most 1e-11 of q_ref."""
        return self._reference.error

    def error(self, z: Vector) -> float | None:
        """Return |z - z*|_inf to the nearest known solution, infinite if z is not
        finite; None if none is known."""
        return min((size(z - solution) for solution in self.solutions), default=None)

    @cached_property
    def size_of_solutions(self) -> float:
        """Return the largest component of the known solutions, 1 if all are 0; errors
        are relative to it."""
        return max((size(solution) for solution in self.solutions), default=0.0) or 1.0

    def from_reference(self, z: Vector) -> Vector:
        return z if self.reference_z is None else z - self.reference_z

    def w(self, z: Vector) -> Vector:
        """Return w = M z + q for z of shape (n,), computed from the reference point."""
        w = product(self.M, self.from_reference(z))
        w += self.q_ref
        return w


def _solutions_by_label(M: Any, solutions: Any) -> list[Any]:
    """Return known solutions in the order of the labels of a data frame."""
    plain_solutions = arrays.plain("solutions", solutions, arrays.SOLUTIONS)
    return [arrays.by_label(M, solution=each)[0] for each in plain_solutions]


def _check_texts(texts: Mapping[str, Any]) -> None:
    """Raise ProblemError for a field that is no text, and an unknown verdict."""
    for field, text in texts.items():
        if not isinstance(text, str):
            raise ProblemError(field, f"is {kind(text)}", GIVE_TEXT)
    verdict = texts["verdict"]
    if verdict and verdict not in VERDICTS:
        hint = f"use one of {', '.join(VERDICTS)}"
        raise ProblemError("verdict", unknown(verdict), hint)


def as_problem(argument: Any) -> Problem:
    """Return a Problem as it is; raise ProblemError for anything else, such as M alone
    or the name of a file."""
    if not isinstance(argument, Problem):
        raise ProblemError(
            "problem",
            f"is {kind(argument)}",
            "make it by Problem(M, q), or by read(path) from a file",
        )
    return argument


def conditions_of(problem: Problem) -> Conditions:
    """Return the problem with both bounds as vectors."""
    with imports:
        from lcpcli.model.formulation import Conditions
    bounds = (
        np.full(problem.n, bound, dtype=float)
        for bound in (problem.lower, problem.upper)
    )
    return Conditions(problem.M, problem.q, *bounds)
