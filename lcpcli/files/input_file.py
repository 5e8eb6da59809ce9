"""A file that was read: its name, its kind, and its fields, each of which is computed
once, when it is first needed."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from lcpcli.errors import (
    IS_MISSING,
    ROW_OF_NUMBERS,
    File,
    LCPError,
    ProblemError,
    raised,
)
from lcpcli.files import contents
from lcpcli.files.contents import STANDARD_INPUT, content_of
from lcpcli.files.fields import A_RESULT, BOUNDS, is_whole, kind_of, made
from lcpcli.files.formats import (
    JSON_FILE,
    Kind,
    ModelFormat,
    Number,
    is_result,
    kind_in,
    load,
    package_of,
    refuse,
    uncompressed,
)
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.model.formulation import Objective
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.rational.exact_problem import ExactParts, ExactProblem

T = TypeVar("T")
# Returns the names of the unknowns, if they are needed.
Names: TypeAlias = "Callable[[], Sequence[str]]"
NOT_SECOND = (
    "leave it out; give a second problem a separate run, and for an index see lcp "
    "help formats"
)
# Hints for an empty file.
WHOLE, LINE = "give M and q, as JSON or CSV", ROW_OF_NUMBERS
FIRST_LINE = "line 1, "  # of a location; left out where a file has many problems
# A pattern of texts in which a number may be 0 in double precision without being 0: an
# exponent below -299, or any negative one after many zeros, 200 zeros, or a long
# denominator.
MAY_UNDERFLOW = re.compile(
    rb"[eE]-0*(?:[3-9][0-9]{2}|[1-9][0-9]{3})|[.,]0{20}[0-9]*[eE]-|[.,]0{200}"
    rb"|/[0-9]{200}"
)
# A pattern of texts in which a number may have more digits than the shortest decimal of
# its double, or be a fraction.
MAY_BE_LONG = re.compile(rb"[0-9.]{16}|[0-9]/[0-9]")
OF_PACKAGE = "correct the file, or that package"


@dataclass(frozen=True, eq=False)
class InputFile:
    """A file that was read, or a line of one. Errors name it.

    path : its name; "-" is standard input. content : uncompressed. line : the number of
    the line, from 1, if the file has a problem in each. error : the error if it could
    not be read; its content is then empty.
    """

    path: str
    content: bytes = b""
    line: int | None = None
    error: ProblemError | None = None

    # Another process computes the cached values again.
    def __reduce__(self) -> tuple[type[InputFile], tuple[Any, ...]]:
        return type(self), (self.path, self.content, self.line, self.error)

    @classmethod
    def read(cls, path: str, expected: str = LINE) -> InputFile:
        """Read a file. expected : the hint for an empty one."""
        return cls(path, content_of(path, expected))

    @property
    def source_name(self) -> File:
        return contents.source_name(self.path)

    @property
    def name(self) -> str:
        """Return the name for a problem whose file does not name it."""
        if self.path == STANDARD_INPUT:
            name: str = self.source_name
        else:
            name = os.path.splitext(os.path.basename(uncompressed(self.path)))[0]
        return name if self.line is None else f"{name}:{self.line}"

    def within(self, parse: Callable[..., T], *arguments: Any) -> T:
        """Call `parse` with the arguments; a ProblemError that it raises gets the
        location of this file in front."""
        try:
            return parse(*arguments)
        except (ProblemError, MemoryError) as error:
            raise self._named(error) from None

    def _named(self, error: ProblemError | MemoryError) -> LCPError:
        """Return an error with the location of this file. Where the file is one line of
        another, the line number 1 within it is omitted."""
        if isinstance(error, ProblemError) and error.parts[:1] == (self.source_name,):
            return error
        if self.line is None:
            return contents.inside(self.source_name, error)
        if isinstance(error, ProblemError) and error.where.startswith(FIRST_LINE):
            where = error.where.removeprefix(FIRST_LINE)
            error = ProblemError(where, error.fault, error.hint)
        return contents.inside((self.source_name, f"line {self.line}"), error)

    @property
    def kind(self) -> Kind:
        return JSON_FILE if self.line is not None else self._kind_of_file

    @cached_property
    def _kind_of_file(self) -> Kind:
        if self.error is not None:
            raise self.error
        return self.within(kind_in, self.path, self.content)

    @cached_property
    def data(self) -> Any:
        """Return the content as the module of the format parses it."""
        kind = self.kind
        if kind.is_model:
            return self._called("parse", self.content, self.path)
        has_parser = hasattr(self.within(load, kind.form), "parse")
        return self._called("parse", self.content) if has_parser else self.content

    @cached_property
    def fields(self) -> Mapping[str, Any]:
        """Return the fields of the problem in the file, or of M alone, with numbers
        rounded to double precision."""
        return self.fields_as(float)

    def fields_as(self, number: Number) -> Mapping[str, Any]:
        """Return the fields. number : converts the numbers in texts to floats."""
        if self.line is None:
            refuse(is_result(self.content), self.source_name, *A_RESULT)
        fields: dict[str, Any] = self._called("fields", self.data, number)
        is_problem = isinstance(fields, dict) and ("M" in fields or kind_of(fields))
        if not is_problem:
            reason = "has no M by the package of its format"
            raise ProblemError(self.source_name, reason, OF_PACKAGE)
        return fields

    @cached_property
    def nonlinear(self) -> NonlinearProblem | None:
        """Return the problem in the file; None if it is linear."""
        return (
            self._called("nonlinear", self.data, self.name)
            if self.kind.is_model
            else None
        )

    @property
    def has_doubles(self) -> bool:
        """Return whether its numbers are stored in double precision."""
        is_binary_model = self.kind.is_model and self.content.startswith(b"b")
        return self.kind.has_arrays or is_binary_model

    @cached_property
    def has_short_numbers(self) -> bool:
        """Return whether all numbers are the shortest decimals of their doubles, as
        those of at most 15 digits are."""
        patterns = (MAY_BE_LONG, MAY_UNDERFLOW)
        return not any(pattern.search(self.content) for pattern in patterns)

    @property
    def objective(self) -> Objective | None:
        """Return the objective of a linear model; None if it has none."""
        return self._called("objective", self.data) if self.kind.is_model else None

    def solution_in(self, path: str) -> list[Fraction] | None:
        """Return the solution of this model in a file of the format for these; None if
        the file has another one."""
        if not path.casefold().endswith(self.kind.beside[:1]):
            return None
        other = InputFile.read(path, WHOLE)
        model_format = cast(ModelFormat, load(self.kind.form))
        return other.within(model_format.solution, self.data, other.content)

    def _called(self, function: str, *arguments: Any) -> Any:
        """Call a function of the format. An error in the module of another package is
        reported as one of the file."""
        module_name = self.kind.form
        try:
            return getattr(load(module_name), function)(*arguments)
        except (ProblemError, MemoryError) as error:
            raise self._named(error) from None
        except Exception as error:
            package = package_of(module_name)
            if isinstance(error, LCPError) or not package:
                raise
            reason = f"cannot be read by the package {package}: {raised(error)}"
            raise self._named(ProblemError("", reason, OF_PACKAGE)) from None

    @property
    def names(self) -> Sequence[str]:
        """Return the names of the unknowns; none if the file has none."""
        if "names" in self.fields or not self.kind.is_table:
            return list(self.fields.get("names", ()))
        names: Sequence[str] = self.data.names
        return names

    def problem(self, q: InputFile | None = None, *, number: Number = float) -> Problem:
        """Return the problem in this file, or with M in this one and q in another one.
        number : converts the numbers in texts to floats."""
        is_kept = number is float and self.line is None  # a line is read once
        fields = self.fields if is_kept else self.fields_as(number)
        if q is not None:
            reason = f"is not needed: {self.source_name} contains M and q"
            refuse(is_whole(fields), q.source_name, reason, NOT_SECOND)
            names: Names = lambda: self.names  # noqa: E731
            fields = {**fields, "q": q.vector("q", number=number, names=names)}
        problem = self.within(made, fields)
        if isinstance(problem, Problem):
            return problem if problem.name else problem.named(self.name)
        if self.line is not None:
            self.within(refuse, True, "q", IS_MISSING, "add the key q")
        shape = " x ".join(map(str, problem.shape)) or "one number"
        raise ProblemError(
            self.source_name,
            f"contains M, {shape}, but no q",
            "add q, or name the file of q after it",
        )

    def refuse_underflow(
        self, field: str = "", in_columns: bool = False, may_be_exact: bool = True
    ) -> None:
        """Raise ProblemError if a number in the text is 0 in double precision without
        being 0.
        field : that of a file with a single vector; "" for a problem. in_columns :
        whether the file has several vectors. may_be_exact : whether --exact takes such
        numbers."""
        if self.kind.has_arrays or not MAY_UNDERFLOW.search(self.content):
            return
        from lcpcli.rational.numbers import KEEP_DIGITS, SCALE, double_unless_lost

        number = partial(
            double_unless_lost, hint=KEEP_DIGITS if may_be_exact else SCALE
        )
        if in_columns and self.kind.is_table:
            self.within(self.data.table, number)
        elif field:
            self.values(field, number)
        else:
            data = self.data
            if hasattr(load(self.kind.form), "without_rounded"):
                data = self._called("without_rounded", data)
            self._called("fields", data, number)

    def values(self, field: str, number: Number = float) -> Any:
        """Return the numbers of a file with a single field, or those of `field`."""
        reason = self.kind.has_no_vector
        hint = "name a file that holds a vector"
        self.within(refuse, reason, "", reason, hint)
        return self._called("values", field, self.data, number)

    def require_order(self, names: Names, field: str = "") -> None:
        """Raise ProblemError if the rows of a table are labelled by these names in
        another order."""
        if self.kind.is_table:
            self.within(self.data.require_order, names, field)

    def vector(
        self,
        field: str,
        n: int | None = None,
        number: Number = float,
        names: Names = tuple,
    ) -> Vector:
        """Return the vector in this file. n : its length; None for any. names : of its
        entries, as labels may be."""
        self.require_order(names, field)
        return self.within(as_vector, field, self.values(field, number), n)

    def exact_vector(
        self, field: str, n: int | None = None, names: Names = tuple
    ) -> list[Fraction]:
        """Return the vector with its numbers as written."""
        from lcpcli.rational.exact_problem import fractions_of
        from lcpcli.rational.numbers import written

        if self.kind.has_arrays:
            return fractions_of(self.vector(field, n, names=names))
        as_written = written(lambda number: self.vector(field, n, number, names))
        return [as_written.number(value) for value in as_written.distinct.tolist()]

    def exactly(self, problem: Problem, q: InputFile | None = None) -> ExactProblem:
        """Return the `problem` that was read from this file, and perhaps from one with
        q, with numbers as written: arrays in the type that they have, texts with all
        decimals."""
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.numbers import written

        # The formulation may keep its numbers as written.
        formulation: Any = problem.formulation
        if formulation.is_of_doubles and not self.kind.has_arrays:
            read = self.within(written, lambda number: made(self.fields_as(number)))
            formulation = read.distinct.formulation
            parts = self.within(formulation.exact_conditions, read.number)
        else:
            parts = formulation.exact_conditions()
        if parts is not None:
            return ExactProblem(problem, *parts)
        M, q_in_file, lower, upper = self._exact_parts(lacks_q=q is not None)
        exact_q = q_in_file if q is None else q.exact_vector("q")
        return ExactProblem(problem, M, exact_q, lower, upper)

    def _exact_parts(self, lacks_q: bool) -> ExactParts:
        """lacks_q : whether q is in another file; it is replaced by zeros here."""
        from lcpcli.rational import exact_problem

        def parse(number: Number) -> Any:
            fields = self.fields_as(number)
            if lacks_q:
                fields = {**fields, "q": np.zeros(np.shape(fields["M"])[0])}
            return made(fields)

        if not self.kind.has_arrays:
            return self.within(exact_problem.exact_parts, parse)
        fields = self.fields
        if kind_of(fields):
            return exact_problem.parts_of(self.within(made, fields))
        rows = exact_problem.rows_of(fields["M"])
        low, high = (
            exact_problem.bounds_of(np.broadcast_to(fields[key], len(rows)))
            if key in fields
            else None
            for key in BOUNDS
        )
        q = exact_problem.fractions_of(fields["q"]) if "q" in fields else None
        return rows, q, low, high
