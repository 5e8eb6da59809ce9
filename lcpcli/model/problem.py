"""The linear complementarity problem: find z >= 0 with w = M z + q >= 0 and z'w = 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as declared
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from lcpcli.errors import ProblemError, kind, quoted
from lcpcli.linalg.doubles import largest
from lcpcli.linalg.products import product
from lcpcli.model.arrays import as_square, as_vector
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.model.reductions.kinds import Origin

VERDICTS = ("infeasible", "unsolvable", "ray")
WITHOUT_SOLUTION = ("infeasible", "unsolvable")  # the verdicts without a solution


@dataclass(frozen=True, eq=False, init=False)
class Problem:
    """An LCP with n >= 1 unknowns, validated on construction: all numbers are finite and all lengths agree.

    M : shape (n, n); nested sequences, a dense array or a scipy sparse matrix or array. Kept dense or in compressed
        sparse rows, without a copy if already in that form.
    q : shape (n,).
    name, source, note : its name, its source, a remark.
    x0, x1 : starting points for methods that iterate on x = (z - w) / 2, shape (n,), or None.
    solutions : the known solutions z*, each of shape (n,); empty if none is known.
    reference : "known" for given solutions, else how they were obtained: "exact" or "computed", see `reference`.
    verdict : "infeasible", "unsolvable" or "ray" if it is known that there is no solution or none is found; else "".
    origin : the quadratic program or the game behind the problem, or the object for it in a file; or None.
    row_maxima, largest : the largest |M_ij| of each row, shape (n,), and of all, found on construction.

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
    row_maxima: Vector = declared(init=False, repr=False)
    largest: float = declared(init=False, repr=False)

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
        vector_q = as_vector("q", q)
        n = vector_q.size
        if not n:
            raise ProblemError("q", "is empty", "give a problem with at least one unknown")
        matrix, row_maxima = as_square("M", M, n)
        for field, text in (("name", name), ("verdict", verdict), ("source", source), ("note", note)):
            if not isinstance(text, str):
                raise ProblemError(field, f"is {kind(text)}", "give a text")
        self.__dict__.update(  # as it is frozen
            M=matrix,
            q=vector_q,
            name=name,
            x0=None if x0 is None else as_vector("x0", x0, n),
            x1=None if x1 is None else as_vector("x1", x1, n),
            solutions=_solutions(solutions, n) if len(solutions) else (),
            verdict=verdict,
            source=source,
            note=note,
            reference=reference,
            origin=None if origin is None else _origin(origin, matrix, vector_q),
            row_maxima=row_maxima,
            largest=largest(row_maxima),
        )
        if verdict and verdict not in VERDICTS:
            raise ProblemError("verdict", f"{quoted(verdict)} is unknown", f"use one of {', '.join(VERDICTS)}")

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return int(self.q.size)

    def w(self, z: Vector) -> Vector:
        """w = M z + q for z of shape (n,)."""
        w = product(self.M, z)
        w += self.q
        return w


def as_problem(given: Any) -> Problem:
    """A Problem as it is; ProblemError for anything else, such as M alone or the name of a file."""
    if not isinstance(given, Problem):
        raise ProblemError("problem", f"is {kind(given)}", "make it by Problem(M, q), or by read(path) from a file")
    return given


def _solutions(given: Sequence[ArrayLike], n: int) -> tuple[Vector, ...]:
    names = ("solution",) if len(given) == 1 else (f"solution[{i}]" for i in range(len(given)))
    return tuple(as_vector(name, z, n) for name, z in zip(names, given, strict=False))


def _origin(given: Any, M: Matrix, q: Vector) -> Origin:
    from lcpcli.model.reductions.kinds import as_origin

    return as_origin(given, M, q)
