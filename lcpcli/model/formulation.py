"""What a problem may be made from: a formulation has the transformation to M and q, and
its inverse (the "source problems" of R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear
Complementarity Problem (1992), section 1.2).

The rest of the package knows a formulation by the class `Formulation` alone, and by a
row of the table in `model/formulations.py`, which says what has to be known of it
before it is imported.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import MAKE_AGREE, ProblemError, kind, numbers_for, quoted
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import compressed
from lcpcli.model.arrays import FROM_0
from lcpcli.typing import BasisStatus, Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction
    from types import ModuleType

# Purposes of names: to be complete, to choose components by, to head narrow columns, to
# be listed with the components in CSV.
FULL = "full"
LABELS = "labels"
HEADINGS = "headings"
CELLS = "cells"
LEFT_OUT = "its objective counts only in lcp solve, for a single model"


@cache  # as problems in many lines need the same module
def _module(name: str) -> Any:
    with imports:
        return import_module(name)


def unnamed(n: int) -> list[str]:
    """Return the names of n items that have none."""
    return [""] * n


class Conditions(NamedTuple):
    """A mixed problem."""

    M: Matrix
    q: Vector
    lower: Vector
    upper: Vector


class Proposal(NamedTuple):
    """A z that may be a solution, the number of steps that led there, and the name of
    the method.

    reason : why it is a solution, as a clause for the user, if that is certain and the
        relative residual does not show it; else "".
    is_certain : whether kernels have decided that z meets the tolerance, and passes the
        check of `Formulation.accepted`.
    basis : that of z, if it is known.
    """

    z: Vector
    steps: int
    method: str
    reason: str = ""
    is_certain: bool = False
    basis: BasisStatus | None = None


class Objective(NamedTuple):
    """costs'z + constant, of which the smallest or the largest value over all solutions
    is sought: sense is "min" or "max"."""

    costs: list[Fraction]
    sense: str
    constant: Fraction


class Answer:
    """What a solution, or the absence of one, means in the users' words.

    Text, CSV and JSON are made from it. All methods have defaults; a dataclass that
    derives from it is an object in JSON with its fields as keys, but for those that are
    no part of its repr.
    """

    statement: str = ""  # the first or the last sentence of the answer
    exact: Any = None  # the same in fractions, if the solution is proved
    # What is proved, in a word that may say more than the status of the problem.
    word: str | None = None
    # The seconds that it took, in addition to the time of the run, if they are worth
    # reporting.
    seconds: float | None = None

    @property
    def headline(self) -> str:
        """Return what the line on a result that is solved says of the answer; "" for
        nothing."""
        return ""

    def lines(self) -> list[str]:
        """Return lines of text, the statement among them."""
        return [self.statement] if self.statement else []

    def compared_lines(self) -> list[str]:
        """Return lines of text where results are compared, without a line on each of
        them."""
        return self.lines()

    def tables(self, *, whole: bool = True) -> list[Any]:  # noqa: ARG002
        """Return tables, each a `report.document.Table`. whole : whether they may be
        longer than a screen."""
        return []

    def cells(self) -> Mapping[str, Sequence[Any]]:
        """Return columns of CSV by their headings, each with a cell for each
        component of z; empty if there are none. Numbers may be fractions."""
        return {}

    def picture(self, title: str) -> Any:  # noqa: ARG002
        """Return a `report.plotting.Picture` of the answer, which a single run draws
        instead of its errors; None if there is none."""
        return None

    def record(self) -> Mapping[str, Any] | None:
        """Return the keys and values of the answer in JSON; by default, for None, the
        fields of the dataclass."""
        return None


class Formulation:
    """What a problem was made from, stored with it as `Problem.origin`.

    To add one, derive a class from this one and add its row to the table. The package
    calls nothing but these. A class has to define `of_fields`, `data` and `parse`,
    which make problems from files and keep them in files; the others have defaults,
    which treat the problem as one that consists of M and q.

    The transformation to M and q:
        of_fields    the problem for the keys of a file
        remark       a note on keys that other programs read otherwise
        data, parse  this object as JSON, for files with M and q, and back
        fits         whether M and q are those of this object
        of_conditions  the object for another q with the same M
        exact_conditions  M, q and the lower bounds in fractions, where doubles may be
                          too short for them
        is_of_doubles  whether these are made from doubles, which round what a text has
        fields       the keys of `of_fields` for a problem, to be written to a file
        names        of the components of z

    On the way:
        bounds       of z, for those that are set by an option
        proposed     a point by a special method for such problems
        followed     the same, in a sequence, from the basis of the last solution
        in_other_form  a stage of `auto` that solves the problem in another form
        block_form   where rows, multipliers and an objective are

    Its inverse:
        answer       what a result means: an `Answer`, for text, CSV and JSON
        accepted     the result, if the answer passes a check of the formulation
        retried      a better result than one that is not solved
        update       the next problem of a sequence
        lengths      what `lcp check` takes, besides z, by its length
        joined       the same, from parts that are named in a file
        verified     the verification of one of these
        meaning      what exact solutions mean, for lists of all solutions

    Files in a special format are read by modules as `files/formats.py` describes them;
    a function `from_...` for Python is best a thin one, called by `of_fields`. A family
    of problems is a function as in `gallery`, and named in FAMILIES of the folder.

    kind : the word for it in files and answers, as in the table.
    """

    kind: ClassVar[str] = ""
    has_picture: ClassVar[bool] = False  # whether --plot draws the answer of a run
    # What lcp make and lcp convert call its conditions, and what files without the
    # object leave out.
    form: ClassVar[str] = "the format keeps only"
    left_out: ClassVar[Sequence[str]] = ()
    # What to do instead of setting bounds of z for a file; "" if these may be set.
    hint_for_bounds: ClassVar[str] = ""
    # Whether it is nothing but names, and whether it is worth saying of an answer that
    # the problem has others.
    is_names_alone: ClassVar[bool] = False
    counts_solutions: ClassVar[bool] = False
    is_of_doubles: ClassVar[bool] = False
    # The module in the folder of the class with functions `answer` and `verified`, of
    # the object and the arguments of these methods; "" if there is none.
    inverse: ClassVar[str] = ""

    @classmethod
    @cache
    def sibling(cls, name: str) -> Any:
        """Return a module in the folder of this class, which is loaded on first use: as
        for the inverse transformation, which reading a file does not need."""
        return _module(f"{cls.__module__.rpartition('.')[0]}.{name}")

    def remark(self, fields: Mapping[str, Any]) -> str:  # noqa: ARG002
        """Return a note on keys of a file that other programs read otherwise, and how
        they were read; "" if there are none."""
        return ""

    @classmethod
    def of_fields(cls, fields: Mapping[str, Any]) -> Any:
        """Return the Problem with the keys of a file, or raise ProblemError."""
        raise NotImplementedError

    def data(self) -> dict[str, Any]:
        """Return this object for JSON, with its kind under the key kind."""
        raise NotImplementedError

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Any:  # noqa: ARG003
        """Return the object with this data, or raise ProblemError."""
        raise ProblemError("kind", f"is {quoted(cls.kind)}", "leave origin out")

    def of_conditions(self, conditions: Conditions) -> Formulation | None:
        """Return what a problem with the same M, but another q or other bounds, is made
        from; None if it is not of this kind. By default that is this object where it
        fits; an object that holds data of q returns another one."""
        return self if self.fits(conditions) else None

    @property
    def block_form(self) -> Any:
        """Return the object as a `model.block_form.BlockForm` if its conditions are the
        optimality conditions of an objective x'Qx / 2 + c'x, with Q symmetric, which
        algorithms make use of; else None."""
        return None

    def fits(self, conditions: Conditions) -> bool:  # noqa: ARG002
        """Return whether the problem may be made from this object."""
        return True

    def exact_conditions(self) -> Any:
        """Return the rows of M, each with its entries by their columns, and q, as
        fractions, with the lower bounds behind them if these are not all 0, and then
        the upper ones if some are finite; None if they are the floating-point numbers
        of the problem, or the decimals in its file."""
        return None

    def fields(
        self,
        problem: Any,  # noqa: ARG002
        *,
        in_text: bool,  # noqa: ARG002
    ) -> dict[str, Any] | None:
        """Return the keys of a file for a problem, but for TEXTS; None if M and q have
        to be written instead. in_text : whether the format is a text, so that numbers
        may be fractions and objects."""
        return None

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        """Return the names of the n components, "" where there is none. purpose : FULL,
        LABELS, HEADINGS or CELLS."""
        return unnamed(n)

    def bounds(
        self,
        problem: Any,  # noqa: ARG002
        user_bounds: Mapping[str, Any],
    ) -> Mapping[str, Any]:
        """Return bounds of z for those that a user sets: lower and upper, or one of
        them, each a number or a list, in which None means no bound."""
        return user_bounds

    def proposed(self, problem: Any) -> Proposal | None:  # noqa: ARG002
        """Return a point that may be a solution, which `auto` tests first; None if
        there is no method for that, or it does not converge."""
        return None

    def followed(
        self,
        problem: Any,  # noqa: ARG002
        states: BasisStatus,  # noqa: ARG002
        tol: float,  # noqa: ARG002
        fast: ModuleType | None = None,  # noqa: ARG002
    ) -> Proposal | None:
        """Return a point that may be a solution, to which the basis of the last one
        leads in a sequence; None if there is no method for that, or it does not
        converge. fast : the module of the compiled kernels, which may decide whether
        the point meets the tolerance; None without kernels."""
        return None

    def answer(self, result: Any) -> Answer | None:
        """Return what a result means. This is computed when it is first read."""
        if not self.inverse:
            return None
        answer: Answer = self.sibling(self.inverse).answer(self, result)
        return answer

    def update(
        self,
        like: Any,  # noqa: ARG002
        states: BasisStatus | None,  # noqa: ARG002
        data: Mapping[str, Any],
        fast: ModuleType | None = None,  # noqa: ARG002
    ) -> tuple[Any, BasisStatus | None]:
        """Return the next problem of a sequence, with other data, and the basis from
        which it starts. like : the last problem, whose M the next one may share.
        states : the basis of the last solution, None if there is none. data : by name,
            as the calls that make such problems have them. fast : as for `followed`."""
        reason = "is no data of the problem of this Solver"
        raise ProblemError(", ".join(data) or "M", reason, "give M, or another problem")

    def accepted(self, result: Any) -> Any:
        """Return a solved result, as it is if its answer is right, too; else a better
        one, or the same with the status `stalled` and the reason."""
        return result

    def retried(self, result: Any) -> Any:
        """Return a result that is not solved, or a better one, as by another form of
        the problem."""
        return result

    def in_other_form(self, problem: Any, stage_of: Any) -> Any:  # noqa: ARG002
        """Return the stage that the function `stage_of` makes for another form of the
        problem, in the variables of the problem; None if there is no such form."""
        return None

    def lengths(self, problem: Any) -> dict[int, str]:
        """Return what may be verified, in words, by its number of entries."""
        return {problem.n: "z"}

    def joined(self, parts: Mapping[str, Sequence[Any]]) -> list[Any]:
        """Return what may be verified, from parts by their names, such as the
        strategies of players, as one list; or raise ProblemError."""
        reason = "is a strategy, but the problem is not a game"
        raise ProblemError(next(iter(parts)), reason, "give z")

    def verified(self, proposed: Any) -> Any:
        """Return the Verification of what was proposed. proposed : a
        `verify.verification.Proposed`, with the problem, the values, the tolerance or
        the exact data, and the verification of a z."""
        if not self.inverse:
            return proposed.of_z(proposed.values)
        return self.sibling(self.inverse).verified(self, proposed)

    def meaning(self, data: Any) -> Any:  # noqa: ARG002
        """Return what exact solutions of a problem mean: an
        `enumeration.meaning.Meaning`. data : the problem in exact numbers."""
        return None


class Named(Formulation):
    """No formulation, but names of the unknowns, for tables and CSV."""

    kind = "names"
    is_names_alone = counts_solutions = True

    def __init__(self, texts: tuple[str, ...]) -> None:
        self.texts = texts

    def data(self) -> dict[str, Any]:
        return {"kind": self.kind, "names": list(self.texts)}

    def fits(self, conditions: Conditions) -> bool:
        return len(self.texts) == conditions.q.size

    def names(self, n: int, purpose: str = FULL) -> Sequence[str]:  # noqa: ARG002
        return self.texts


class InFractions(Formulation):
    """A game whose mixed problem is computed in fractions: `exact_conditions` has rows,
    q and the lower bounds, 0 or none.

    sizes : the numbers of components of z, for each player or part.
    max_dense : the number of unknowns up to which M is dense.
    """

    max_dense: ClassVar[float] = math.inf
    if TYPE_CHECKING:

        @property
        def sizes(self) -> tuple[int, ...]: ...

    def parts(self, z: Any) -> list[Any]:
        """Return the parts of z, or those of its first components."""
        stops = np.cumsum(self.sizes).tolist()
        pairs = zip(stops, self.sizes, strict=True)
        return [z[stop - size : stop] for stop, size in pairs]

    def conditions(self) -> Conditions:
        rows, q, lower = self.exact_conditions()
        # This is what `float` computes, in half the time.
        values = np.array(
            [a.numerator / a.denominator for row in rows for a in row.values()]
        )
        positions = (
            [i for i, row in enumerate(rows) for _ in row],
            [j for row in rows for j in row],
        )
        if len(q) > self.max_dense:
            with imports:
                from scipy.sparse import csr_array
            M: Any = csr_array((values, positions), shape=(len(q), len(q)))
        else:
            M = np.zeros((len(q), len(q)))
            M[positions] = values
        low = np.array([-np.inf if bound is None else 0.0 for bound in lower])
        return Conditions(M, np.array(q, dtype=float), low, np.full(len(q), np.inf))

    def fits(self, conditions: Conditions) -> bool:
        """Return whether these are the conditions: M up to rounding, and q and the
        bounds exactly, as their entries are only 0, -1 and infinite.
        """
        expected = self.conditions()
        if conditions.M.shape != expected.M.shape or not all(
            map(np.array_equal, conditions[1:], expected[1:])
        ):
            return False
        return bool(
            abs(compressed(conditions.M) - compressed(expected.M)).max()
            <= 8 * EPS * abs(expected.M).max()
        )

    def accepted(self, result: Any) -> Any:
        return self.sibling(self.inverse).accepted(self, result)


PLAIN = Formulation()  # of a problem that consists of M and q


def named(raw_names: Sequence[str], n: int) -> Named:
    """Return the names of n unknowns, or raise ProblemError."""
    texts = names_of("names", raw_names, n, "unknown")
    for name, times in Counter(texts).items():
        if name and times > 1:
            reason = f"has {quoted(name)} for {times} unknowns"
            hint = "give each another name, or an empty one"
            raise ProblemError("names", reason, hint)
    return Named(texts)


def names_of(
    field: str, raw_value: Any, size: int | None = None, of: str = ""
) -> tuple[str, ...]:
    """Return a list of names, one for each of `size` things of a kind, or none; or
    raise ProblemError."""
    if not isinstance(raw_value, (list, tuple)):
        raise ProblemError(field, f"is {kind(raw_value)}", "give a list of names")
    for i, name in enumerate(raw_value):
        if not isinstance(name, str):
            raise ProblemError(
                f"{field}[{i}]", f"is {kind(name)}", f"give a text {FROM_0}"
            )
    if raw_value and size is not None and len(raw_value) != size:
        raise ProblemError(
            field,
            numbers_for(len(raw_value), "name", size, of),
            MAKE_AGREE,
        )
    return tuple(raw_value)
