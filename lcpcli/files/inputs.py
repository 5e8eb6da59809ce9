"""Many problems, read one after another: files, JSON lines, and several q for one M.

An input that cannot be read is kept with its error, so that the other problems are
still solved.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import IO, TYPE_CHECKING, Any, NamedTuple, TypeAlias, cast

import numpy as np

from lcpcli.errors import IS_MISSING, ProblemError
from lcpcli.files import contents, json_format, reading
from lcpcli.files.contents import (
    STANDARD_INPUT,
    Source,
    checked,
    content_of,
    place,
    within,
)
from lcpcli.files.fields import BOUNDS, TEXTS, is_whole, made
from lcpcli.files.formats import LINES, form_of, kind_in, load, refuse
from lcpcli.files.reading import LINE, WHOLE
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.arrays import as_matrix
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix

if TYPE_CHECKING:
    from lcpcli.files.nl_format import Model
    from lcpcli.rational.exact_problem import ExactParts

# The fields of a file without q that belong to each of several q.
SHARED = (*BOUNDS, "names")
FIRST_NAME = "q1"  # of several q without names


class Input(NamedTuple):
    paths: tuple[str, ...]  # its file, or the files of M and of q
    contents: tuple[bytes, ...] = ()  # of these files
    # The number of its line, from 1, in a file with a problem in each line.
    line: int | None = None
    fault: ProblemError | None = None  # the error if its files could not be read
    marks: Sequence[Mapping[str, Any]] = ()  # the mark of the problem in a log, or none

    @property
    def sources(self) -> list[Source]:  # the place of its problem
        return [Source(place(self.paths[0]), self.line, *self.marks)]

    @property
    def digests(self) -> list[str]:  # the digest of its problem as written
        return [digest(*self.contents)]

    def read(self) -> Problem:
        """Read the problem; a ProblemError names the file."""
        if self.fault is not None:
            raise self.fault
        if self.line is None:
            return reading.problem_of(self.paths, self.contents)
        try:
            problem = made(json_format.fields(self.contents[0]))
            if not isinstance(problem, Problem):
                raise ProblemError("q", IS_MISSING, "add the key q")
        except ProblemError as error:
            error.where = error.where.removeprefix("line 1, ")
            raise error.inside(f"{place(self.paths[0])}: line {self.line}") from None
        return (
            problem
            if problem.name
            else problem.named(f"{reading.name_of(self.paths[0])}:{self.line}")
        )

    def length(self) -> int:
        """Return the number of bytes of the texts among the contents, whose numbers may
        have any number of digits."""
        return sum(len(text) for text in self.contents if b"\0" not in text)

    def exact_parts(self) -> ExactParts:
        """Return the numbers of the problem as written, once `read` has accepted it."""
        if self.line is not None:
            return reading.exact_parts_in("json_format", self.contents[0])
        return reading.exact_parts_of(self.paths, self.contents)


class QColumns(NamedTuple):
    paths: tuple[str, str]  # the files of M and of Q
    M: Matrix
    Q: Matrix  # of shape (n, k), with a q in each column
    names: Sequence[str]  # of the columns
    # The bounds, and the names of the unknowns, that the file of M has.
    shared: Mapping[str, Any] = {}
    first: int = 1  # the number of the first column in the file, from 1
    marks: Sequence[Mapping[str, Any]] = ()  # as in Input, for all problems or none

    @property
    def sources(self) -> list[Source]:  # the places of its problems
        file, marks = place(self.paths[1]), self.marks
        return [
            Source(file, self.first + j, marks[j] if marks else None)
            for j in range(len(self.names))
        ]

    @property
    def digests(self) -> list[str]:  # the digests of its problems
        M = self.M.tocsr() if is_sparse(self.M) else self.M
        parts = [
            part.tobytes()
            for part in ((M.indptr, M.indices, M.data) if is_sparse(M) else (M,))
        ]
        shared = {
            key: np.asarray(value, dtype=object).tolist()
            for key, value in sorted(self.shared.items())
        }
        whole = digest(
            *parts, *([json.dumps(shared, default=str).encode()] if shared else [])
        )
        return [digest(whole.encode(), q.tobytes()) for q in self.Q.T]

    def first_problem(self) -> Problem:
        """Return the problem with the first q; a ProblemError names the file of M."""
        fields = {"M": self.M, "q": self.Q[:, 0], "name": self.names[0], **self.shared}
        return within(place(self.paths[0]), lambda: cast(Problem, made(fields)))

    def part(self, begin: int, end: int) -> QColumns:
        names, marks = self.names[begin:end], self.marks[begin:end]
        return self._replace(
            Q=self.Q[:, begin:end], names=names, first=self.first + begin, marks=marks
        )

    def parts(self, most: int) -> Iterator[QColumns]:
        return (
            self.part(begin, begin + most) for begin in range(0, len(self.names), most)
        )


Work: TypeAlias = Input | QColumns


def nonlinear_in(path: str, content: bytes) -> Model | None:
    if within(place(path), form_of, path, content) != "nl_format":
        return None
    from lcpcli.files.nl_format import Model

    model = within(place(path), Model, content, path)
    return (
        None
        if within(place(path), lambda: isinstance(model.problem, Problem))
        else model
    )


def digest(*parts: bytes) -> str:
    from hashlib import blake2b

    found = blake2b(digest_size=8)
    for part in parts:
        found.update(len(part).to_bytes(8, "big"))
        found.update(part)
    return found.hexdigest()


def inputs(
    paths: Sequence[str],
    streams: bool = False,
    of_folders: Collection[str] = (),
    has_q: bool = False,
) -> Iterator[Work]:
    """Yield the inputs in the files, in order; "-" is standard input. A file with M
    alone is followed by the file of q.

    streams : whether a first line of standard input that is an object is a problem,
    whatever follows. of_folders : the files that come from folders, where the next one
    is q only if it can be nothing else. has_q : whether the second of two files has q,
    whatever it looks like.
    """
    left = list(paths)
    while left:
        path = left.pop(0)
        try:
            contents.refuse_folder(path)
            with contents.open_file(path) as file:
                head, are_lines = _head(path, file, streams and path == STANDARD_INPUT)
                if are_lines and has_q:
                    raise ProblemError(
                        left.pop(),
                        "is not needed",
                        f"{place(path)} has problems in its lines",
                    )
                if are_lines:
                    for number, line in enumerate(chain(head, file), 1):
                        if text := (
                            contents.without_mark(line) if number == 1 else line
                        ).strip():
                            yield Input((path,), (text,), line=number)
                    continue
                content = checked(path, b"".join([*head, file.read()]), WHOLE)
            yield _with_next(path, content, left, of_folders, has_q)
        except ProblemError as fault:
            if left and _is_q(left[0]):
                del left[0]
            yield Input((path,), fault=fault)


def _head(path: str, file: IO[bytes], streams: bool) -> tuple[list[bytes], bool]:
    """Return the lines of a file up to the second one that is not blank, and whether
    each line is a problem; of a stream only the first line is awaited if it is enough
    to decide."""
    head = []
    for line in file:
        head.append(line)
        nonblank = [part for part in map(bytes.strip, head) if part]
        if path.casefold().endswith(LINES):
            return head, True
        with suppress(ValueError, RecursionError):
            first = (
                contents.without_mark(nonblank[0])
                if streams and len(nonblank) == 1
                else b"0"
            )
            if isinstance(json.loads(first, parse_int=float), dict):
                return head, True
        if len(nonblank) == 2 or (
            nonblank
            and not (nonblank[0].startswith(b"{") and nonblank[0].endswith(b"}"))
        ):
            return head, len(nonblank) == 2 and nonblank[1].startswith(b"{")
    return head, False


def _with_next(
    path: str, content: bytes, left: list[str], of_folders: Collection[str], has_q: bool
) -> Work:
    """Return the problem in a file. The next file is taken as q if it `has_q`, if this
    one has M alone, or if the next one has a vector and no problem, so that the error
    can name both; of a folder only if M is alone and it can only be q."""
    if not left:
        return Input((path,), (content,))
    M, shared = _without_q(path, content)
    are_named = path not in of_folders and left[0] not in of_folders
    takes = (
        (are_named and _is_q(left[0]))
        if M is None
        else (are_named or _is_q(left[0], M.shape[0]))
    )
    if not (takes or has_q):
        if shared is None and are_named:
            _refuse_swapped(path, content, left)
        return Input((path,), (content,))
    q_path = left.pop(0)
    q_content = content_of(q_path, LINE)
    columns = None
    if M is not None:
        names = partial(reading.names_in, path, content, shared or {})
        within(place(q_path), reading.require_order, q_path, q_content, names)
        columns = within(place(q_path), _columns, q_path, q_content, M.shape[0])
    if (
        columns is not None
        and form_of(path, content) == form_of(q_path, q_content) == "csv_format"
    ):
        from lcpcli.files.csv_format import refuse_two_meanings

        within(place(q_path), refuse_two_meanings, q_content, content)
    if columns is None or M is None:
        return Input((path, q_path), (content, q_content))
    own = columns[0][:, : len(columns[0])]
    has_M = 1 < len(own) >= len(columns[1]) - 1 and np.array_equal(own, dense(M))
    refuse(
        has_M,
        place(q_path),
        f"begins with M of {place(path)}",
        "if it holds M and q, name it alone",
    )
    return QColumns((path, q_path), M, *columns, shared or {})


def _refuse_swapped(path: str, content: bytes, left: list[str]) -> None:
    """Raise ProblemError if a file holds q, and the next one the M that should come
    before it."""
    M = q = None
    with suppress(ProblemError):
        q = reading.vector_in("q", path, content)
        M = (
            None
            if left[0] == STANDARD_INPUT
            else _without_q(left[0], content_of(left[0], WHOLE))[0]
        )
    if q is not None and M is not None and len(q) == M.shape[0]:
        other = left.pop(0)
        raise ProblemError(
            place(path), f"holds q, and {other} M", f"name M first: {other} {path}"
        )


def _without_q(
    path: str, content: bytes
) -> tuple[Matrix | None, Mapping[str, Any] | None]:
    """Return M and what several q share with it in a file; None if it has q, and None
    twice if it is no problem."""
    # A guess that spares reading it twice.
    has_q = content.lstrip().startswith(b"{") and b'"q"' in content
    with suppress(ProblemError):
        fields = {} if has_q else reading.fields_in(path, content)
        if not is_whole(fields) and {"M"} <= fields.keys() <= {"M", *SHARED, *TEXTS}:
            M = (
                as_matrix("M", fields["M"])
                if isinstance(fields["M"], list)
                else fields["M"]
            )
            return (M if M.ndim == 2 else None), {
                key: fields[key] for key in SHARED if key in fields
            }
        return None, {}
    return None, None


def _is_q(path: str, n: int | None = None) -> bool:
    """Return whether a file holds q and cannot be a problem, or M alone. n : the rows
    of the M before it, if any; then a vector of n entries is q whatever else it could
    be, and several q may be given in columns."""
    if path == STANDARD_INPUT or path.casefold().endswith(LINES):
        return False
    own: Problem | Matrix | None = None
    with suppress(ProblemError):
        with contents.open_file(path) as file:
            head = file.read(1024)  # few files begin with more blanks
            is_other = head.lstrip().startswith(b"{") and not head.lstrip(
                b"{ \t\r\n"
            ).startswith(b'"q"')
            content = b"" if is_other else checked(path, head + file.read(), LINE)
        if not content:
            return False
        with suppress(ProblemError):
            own = within(place(path), made, reading.fields_in(path, content))
        with suppress(ProblemError):
            return reading.vector_in("q", path, content).size == n or not isinstance(
                own, Problem
            )
        return own is None and n is not None and _columns(path, content, n) is not None
    return False


def _columns(path: str, content: bytes, n: int) -> tuple[Matrix, list[str]] | None:
    """Return Q of shape (n, k) and the names of its columns; None if the file has a
    single vector, or no such table."""
    form, names = form_of(path, content), list[str]()
    if form == "matrix_market_format" or kind_in(form).has_no_vector:
        return None
    if form == "csv_format":
        from lcpcli.files.csv_format import table_of

        own = table_of(content)
        table, names = own.rows, own.header
    else:
        table = load(form).values("q", content)
    shape = np.shape(table) if isinstance(table, (list, np.ndarray)) else ()
    if n == 1 and len(shape) == 1:
        table, shape = [table], (1, *shape)
    if len(shape) != 2 or shape[1] == 1 or (shape[0] == 1 and n > 1):
        return None
    Q = as_matrix("q", table)
    if shape[0] != n:
        transposed = "transpose it: " * (shape[1] == n)
        hint = f"{transposed}give one column for each problem, of as many rows as M has"
        raise ProblemError("q", f"is {shape[0]} x {shape[1]} but M is {n} x {n}", hint)
    return Q, names or [FIRST_NAME, *(f"q{j}" for j in range(2, shape[1] + 1))]
