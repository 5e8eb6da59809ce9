"""The linear complementarity problem: find z >= 0 with w = M z + q >= 0 and z'w = 0."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from lcpcli.errors import ProblemError, quoted
from lcpcli.products import product
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.origins import Origin

VERDICTS = ("infeasible", "unsolvable", "ray")
WITHOUT_SOLUTION = ("infeasible", "unsolvable")  # the verdicts that say so
ROWS = "a list of rows of numbers"


@dataclass(frozen=True, eq=False, init=False)
class Problem:
    """One LCP of n >= 1 unknowns, checked when it is made: every number is finite and every length fits.

    M : shape (n, n); nested sequences, a dense array or a scipy sparse matrix or array. Kept dense or in compressed
        sparse rows, without a copy where it is that already.
    q : shape (n,).
    name, source, note : what it is called, where it comes from, what is remarkable about it.
    x0, x1 : starting points for methods that iterate on x = (z - w) / 2, shape (n,), or None.
    solutions : the known solutions z*, each of shape (n,); empty if none is known.
    reference : "known", or how solutions that were not have been found: "exact" or "computed", `reference` tells.
    verdict : "infeasible", "unsolvable" or "ray" where it is known that there is no solution or none is found; else "".
    origin : the quadratic program or the game that the problem comes from, also as the object in a file; or None.

    Raises ProblemError, which names the field.

    >>> from lcpcli import Problem
    >>> problem = Problem([[2, 1], [1, 2]], [-5, -6], name="small")
    >>> problem
    <Problem small: n = 2, dense>
    >>> problem.w([0.0, 3.0]).tolist()
    [-2.0, 0.0]
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
    origin: Origin | None = None

    def __init__(
        self,
        M: Any,
        q: ArrayLike,
        name: str = "",
        x0: ArrayLike | None = None,
        x1: ArrayLike | None = None,
        solutions: Sequence[ArrayLike] = (),
        verdict: str = "",
        source: str = "",
        note: str = "",
        reference: str = "known",
        origin: Any = None,
    ) -> None:
        keep = partial(object.__setattr__, self)
        vector_q = as_vector("q", q)
        n = vector_q.size
        if not n:
            raise ProblemError("q", "is empty", "give a problem of at least one unknown")
        keep("q", vector_q)
        keep("M", as_square("M", M, n))
        keep("x0", None if x0 is None else as_vector("x0", x0, n))
        keep("x1", None if x1 is None else as_vector("x1", x1, n))
        names = [f"solution[{i}]" if len(solutions) > 1 else "solution" for i in range(len(solutions))]
        keep("solutions", tuple(as_vector(field, z, n) for field, z in zip(names, solutions, strict=True)))
        for field, text in (("name", name), ("verdict", verdict), ("source", source), ("note", note)):
            if not isinstance(text, str):
                raise ProblemError(field, f"is {kind(text)}", "give a text")
            keep(field, text)
        keep("reference", reference)
        keep("origin", None if origin is None else _as_origin(origin, self.M, self.q))
        if verdict and verdict not in VERDICTS:
            raise ProblemError("verdict", f"{quoted(verdict)} is unknown", f"use one of {', '.join(VERDICTS)}")

    def __repr__(self) -> str:
        from lcpcli.report.notebook import problem_text

        return problem_text(self)

    def _repr_html_(self) -> str:
        from lcpcli.report.notebook import problem_html

        return problem_html(self)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return int(self.q.size)

    def w(self, z: Vector) -> Vector:
        """w = M z + q for z of shape (n,)."""
        w = product(self.M, z)
        w += self.q
        return w


def is_sparse(M: Any) -> bool:
    """Whether M is a scipy sparse matrix or array, found out without importing scipy."""
    return type(M).__module__.startswith("scipy.sparse")


def as_vector(field: str, values: Any, n: int | None = None) -> Vector:
    """Values as a float64 vector of length n (any length if None), or a ProblemError about the field."""
    if isinstance(values, (list, tuple)):
        _refuse_other_than_numbers(field, values)
    v = _as_floats(field, values)
    if v.ndim != 1:
        raise ProblemError(field, f"has {count(v.ndim, 'dimension')}", "give a flat list of numbers")
    if n is not None and v.size != n:
        raise ProblemError(field, f"has {count(v.size, 'entry')} for {count(n, 'unknown')}", "make them agree")
    _refuse_infinite(field, v)
    return v


def as_square(field: str, values: Any, n: int, other: str = "q") -> Matrix:
    """As `as_matrix`, of shape (n, n) as the vector called `other` asks for."""
    M = _as_rows(field, values)
    if M.shape[0] != M.shape[1]:
        raise ProblemError(field, f"is {M.shape[0]} x {M.shape[1]}", "make it square")
    if M.shape[0] != n:
        shapes = f"is {M.shape[0]} x {M.shape[1]} but {other} has {count(n, 'entry')}"
        raise ProblemError(field, shapes, "make them agree")
    return _as_finite(field, M)


def as_matrix(field: str, values: Any) -> Matrix:
    """Values as a float64 matrix, dense or in compressed sparse rows, or a ProblemError."""
    M = _as_rows(field, values)
    if not M.shape[1]:
        raise ProblemError(field, "has empty rows", f"give {ROWS}")
    return _as_finite(field, M)


def count(n: int, noun: str) -> str:
    """A number with its noun: "1 entry", "3 entries"."""
    plural = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{n} {noun if n == 1 else plural}"


def kind(value: Any) -> str:
    """What the author of a file would call a value in it."""
    if isinstance(value, (bool, np.bool_)):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {quoted(value)}"
    names = {type(None): "null", dict: "an object", list: "a list", tuple: "a list", int: "a number", float: "a number"}
    return names.get(type(value), f"of type {type(value).__name__}")


def _as_origin(given: Any, M: Matrix, q: Vector) -> Origin:
    from lcpcli.origins import as_origin

    return as_origin(given, M, q)


def _as_rows(field: str, values: Any) -> Matrix:
    """Values as a dense array, or the sparse matrix that they are, of two dimensions."""
    if isinstance(values, (list, tuple)):
        _refuse_other_than_rows(field, values)
    M: Matrix = values if is_sparse(values) else _as_floats(field, values, ROWS)
    if M.shape and not M.shape[0]:
        raise ProblemError(field, "is empty", f"give {ROWS}")
    if M.ndim != 2:
        raise ProblemError(field, f"has {count(M.ndim, 'dimension')}", f"give {ROWS}")
    return M


def _as_finite(field: str, M: Matrix) -> Matrix:
    if not is_sparse(M):
        _refuse_infinite(field, M)
        return M
    M = _as_sparse(field, M)
    _refuse_infinite(field, M.data, lambda: np.column_stack((M.tocoo().row, M.tocoo().col)))
    return M


def _as_sparse(field: str, M: Any) -> Matrix:
    if M.dtype.kind not in "fiu":
        raise ProblemError(field, f"holds {M.dtype.name} values", "give real numbers")
    from scipy.sparse import csr_array

    compressed = csr_array(M, dtype=np.float64)
    if not compressed.has_canonical_format:
        compressed = compressed.copy()
        compressed.sum_duplicates()
    return compressed


def _as_floats(field: str, values: Any, expected: str = "a list of numbers") -> Vector:
    if not isinstance(values, (list, tuple, np.ndarray)):
        raise ProblemError(field, f"is {kind(values)}", f"give {expected}")
    if isinstance(values, np.ndarray) and values.dtype.kind not in "fiu":
        raise ProblemError(field, f"holds {values.dtype.name} values", "give real numbers")
    try:
        with np.errstate(over="ignore"):
            return np.asarray(values, dtype=np.float64)
    except OverflowError:
        raise ProblemError(
            field, "holds an integer beyond the range of double precision", "scale the problem"
        ) from None


def _refuse_other_than_rows(field: str, rows: Sequence[Any]) -> None:
    for i, row in enumerate(rows):
        if not isinstance(row, (list, tuple)):
            raise ProblemError(f"{field}[{i}]", f"is {kind(row)}", "give a row, a list of numbers")
        if len(row) != len(rows[0]):
            lengths = f"has {count(len(row), 'entry')} where {field}[0] has {len(rows[0])}"
            raise ProblemError(f"{field}[{i}]", lengths, "make all rows equally long")
        _refuse_other_than_numbers(f"{field}[{i}]", row)


def _refuse_other_than_numbers(field: str, values: Sequence[Any]) -> None:
    if {type(v) for v in values} <= {int, float}:
        return
    for i, v in enumerate(values):
        if isinstance(v, (bool, np.bool_)) or not isinstance(v, (int, float, np.integer, np.floating)):
            raise ProblemError(f"{field}[{i}]", f"is {kind(v)}", "give a number")


def _refuse_infinite(field: str, values: Vector, places: Callable[[], Any] | None = None) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()) or np.isfinite(values).all():
            return
    wrong = np.argwhere(~np.isfinite(values))[0]
    place = "".join(f"[{i}]" for i in (wrong if places is None else places()[wrong[0]]))
    raise ProblemError(f"{field}{place}", "is not a finite number in double precision", "give a finite number")
