"""The linear complementarity problem: find z >= 0 with w = M z + q >= 0 and z'w = 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.typing import Matrix, Vector

VERDICTS = ("infeasible", "unsolvable", "ray")


@dataclass(frozen=True, eq=False)
class Problem:
    """One LCP of n >= 1 unknowns, checked when it is made: every number is finite and every length fits.

    M : shape (n, n); nested sequences, a dense array or a scipy sparse matrix or array. Kept dense or in compressed
        sparse rows, without a copy where it is that already.
    q : shape (n,).
    name, source, note : what it is called, where it comes from, what is remarkable about it.
    x0, x1 : starting points for methods that iterate on x = (z - w) / 2, shape (n,), or None.
    solutions : the known solutions z*, each of shape (n,); empty if none is known.
    verdict : "infeasible", "unsolvable" or "ray" where it is known that there is no solution or none is found; else "".

    Raises ProblemError, which names the field.
    """

    M: Matrix
    q: Vector
    name: str = ""
    x0: Vector | None = None
    x1: Vector | None = None
    solutions: Sequence[Vector] = field(default=())
    verdict: str = ""
    source: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        q = as_vector("q", self.q)
        if not q.size:
            raise ProblemError("q", "is empty", "give a problem of at least one unknown")
        keep = object.__setattr__
        keep(self, "q", q)
        keep(self, "M", as_square("M", self.M, q.size))
        for name in ("x0", "x1"):
            if getattr(self, name) is not None:
                keep(self, name, as_vector(name, getattr(self, name), q.size))
        keep(self, "solutions", tuple(as_vector("solution", z, q.size) for z in self.solutions))
        if self.verdict and self.verdict not in VERDICTS:
            raise ProblemError("verdict", f"{self.verdict!r} is unknown", f"use one of {', '.join(VERDICTS)}")

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return int(self.q.size)

    def w(self, z: Vector) -> Vector:
        """w = M z + q for z of shape (n,)."""
        w: Vector = self.M @ z
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
        raise ProblemError(field, f"has {v.ndim} dimensions", "give a flat list of numbers")
    if n is not None and v.size != n:
        raise ProblemError(field, f"has {count(v.size, 'entry')} for {count(n, 'unknown')}", "make them agree")
    _refuse_infinite(field, v)
    return v


def as_square(field: str, values: Any, n: int) -> Matrix:
    """Values as a float64 matrix of shape (n, n), dense or in compressed sparse rows, or a ProblemError."""
    if isinstance(values, (list, tuple)):
        _refuse_other_than_rows(field, values)
    M: Matrix = _as_sparse(field, values) if is_sparse(values) else _as_floats(field, values)
    if M.ndim != 2:
        raise ProblemError(field, f"has {M.ndim} dimensions", "give a list of rows of numbers")
    if M.shape[0] != M.shape[1]:
        raise ProblemError(field, f"is {M.shape[0]} x {M.shape[1]}", "make it square")
    if M.shape[0] != n:
        raise ProblemError(field, f"is {M.shape[0]} x {M.shape[1]} but q has {count(n, 'entry')}", "make them agree")
    entries: Vector = M.data if is_sparse(M) else M
    _refuse_infinite(field, entries)
    return M


def count(n: int, noun: str) -> str:
    """A number with its noun: "1 entry", "3 entries"."""
    plural = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{n} {noun if n == 1 else plural}"


def kind(value: Any) -> str:
    """What the author of a file would call a value in it."""
    if isinstance(value, (bool, np.bool_)):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {value!r}" if len(value) <= 40 else "a text"
    names = {type(None): "null", dict: "an object", list: "a list", tuple: "a list", int: "a number", float: "a number"}
    return names.get(type(value), f"of type {type(value).__name__}")


def _as_sparse(field: str, M: Any) -> Matrix:
    if M.dtype.kind not in "fiu":
        raise ProblemError(field, f"holds {M.dtype.name} values", "give real numbers")
    from scipy.sparse import csr_array

    compressed = csr_array(M, dtype=np.float64)
    if not compressed.has_canonical_format:
        compressed = compressed.copy()
        compressed.sum_duplicates()
    return compressed


def _as_floats(field: str, values: Any) -> Vector:
    if not isinstance(values, (list, tuple, np.ndarray)):
        raise ProblemError(field, f"is {kind(values)}", "give a list of numbers")
    if isinstance(values, np.ndarray) and values.dtype.kind not in "fiu":
        raise ProblemError(field, f"holds {values.dtype.name} values", "give real numbers")
    try:
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


def _refuse_infinite(field: str, values: Vector) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()) or np.isfinite(values).all():
            return
    place = "".join(f"[{i}]" for i in np.argwhere(~np.isfinite(values))[0])
    raise ProblemError(f"{field}{place}", "is not a finite number in double precision", "give a finite number")
