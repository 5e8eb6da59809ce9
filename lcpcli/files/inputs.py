"""Many problems, read one after another: files, JSON lines, and several q for one M.

An input that cannot be read is kept with its error, so that the other problems are
still solved.
"""

from __future__ import annotations

import io
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import IO, TYPE_CHECKING, Any, NamedTuple, TypeAlias, cast

import numpy as np

from lcpcli.errors import IS_EMPTY, ProblemError
from lcpcli.files import contents
from lcpcli.files.contents import STANDARD_INPUT, Source, checked, source_name, within
from lcpcli.files.fields import BOUNDS, is_whole, made
from lcpcli.files.formats import has_lines, refuse
from lcpcli.files.input_file import LINE, WHOLE, InputFile
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.arrays import as_matrix
from lcpcli.model.formulations import TEXTS
from lcpcli.model.problem import Problem, TextNumbers
from lcpcli.typing import Matrix

if TYPE_CHECKING:
    from lcpcli.rational.exact_problem import ExactProblem

# The fields of a file without q that belong to each of several q.
SHARED = (*BOUNDS, "names")
FIRST_NAME = "q1"  # of several q without names


class Input(NamedTuple):
    files: tuple[InputFile, ...]  # the file of its problem, or those of M and of q
    # The further fields of the record of the problem in a log, or none.
    log_entries: Sequence[Mapping[str, Any]] = ()

    @property
    def line(self) -> int | None:  # that of the problem in its file
        return self.files[0].line

    @property
    def sources(self) -> list[Source]:  # the source of its problem
        file = self.files[0]
        return [Source(file.source_name, file.line, *self.log_entries)]

    @property
    def paths(self) -> Sequence[str]:
        """Return its files as another command may name them; none if one is standard
        input, or if the problem is in a line."""
        paths = [file.path for file in self.files]
        is_nameable = self.line is None and STANDARD_INPUT not in paths
        return paths if is_nameable else ()

    @property
    def digests(self) -> list[str]:  # the digest of its problem as written
        return [digest(*(file.content for file in self.files if file.error is None))]

    @property
    def size(self) -> int:  # in bytes
        return sum(len(file.content) for file in self.files)

    def read(self, as_written: bool = False) -> Problem:
        """Return the problem; a ProblemError names the file. as_written : whether the
        numbers are also read by `exactly`, so that those of M, q and bounds may be 0 in
        double precision."""
        return problem_of(self.files, as_written)

    def length(self) -> int:
        """Return the number of bytes of the texts among the contents, whose numbers may
        have any number of digits."""
        texts = (file.content for file in self.files if b"\0" not in file.content)
        return sum(map(len, texts))

    def exactly(self, problem: Problem) -> ExactProblem:
        """Return the problem that `read` has returned with its numbers as written."""
        return _exactly(self.files, problem)

    def compact(self) -> Input:
        """Return the input without its cached values, to free memory."""
        return self._replace(files=tuple(map(replace, self.files)))

    def in_line(self, line: int | None) -> Input:
        """Return the input as if it were in another line of its file."""
        return self._replace(files=(replace(self.files[0], line=line),))


class QColumns(NamedTuple):
    paths: tuple[str, str]  # the files of M and of Q
    M: Matrix
    Q: Matrix  # of shape (n, k), with a q in each column
    names: Sequence[str]  # of the columns
    # The bounds, and the names of the unknowns, that the file of M has.
    shared: Mapping[str, Any] = {}
    first: int = 1  # the number of the first column in the file, from 1
    log_entries: Sequence[
        Mapping[str, Any]
    ] = ()  # as in Input, for all problems or none

    @property
    def sources(self) -> list[Source]:  # the sources of its problems
        file, log_entries = source_name(self.paths[1]), self.log_entries
        return [
            Source(file, self.first + j, log_entries[j] if log_entries else None)
            for j in range(len(self.names))
        ]

    @property
    def size(self) -> int:  # in bytes
        return int(self.Q.nbytes)

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
        shared_digest = digest(
            *parts, *([json.dumps(shared, default=str).encode()] if shared else [])
        )
        return [digest(shared_digest.encode(), q.tobytes()) for q in self.Q.T]

    def first_problem(self) -> Problem:
        """Return the problem with the first q; a ProblemError names the file of M."""
        fields = {"M": self.M, "q": self.Q[:, 0], "name": self.names[0], **self.shared}
        return within(source_name(self.paths[0]), lambda: cast(Problem, made(fields)))

    def part(self, begin: int, end: int) -> QColumns:
        names, log_entries = self.names[begin:end], self.log_entries[begin:end]
        return self._replace(
            Q=self.Q[:, begin:end],
            names=names,
            first=self.first + begin,
            log_entries=log_entries,
        )

    def parts(self, max_columns: int) -> Iterator[QColumns]:
        return (
            self.part(begin, begin + max_columns)
            for begin in range(0, len(self.names), max_columns)
        )


InputItem: TypeAlias = Input | QColumns


def problem_of(files: Sequence[InputFile], as_written: bool = False) -> Problem:
    """Return the problem in one file, or in those of M and of q. as_written : as for
    `Input.read`; a formulation computes its answers from double precision too."""
    first, *others = files
    problem = first.problem(*others)
    origin = problem.origin
    is_plain = origin is None or origin.is_names_alone
    if not (as_written and is_plain):
        first.refuse_underflow(may_be_exact=is_plain)
        for other in others:
            other.refuse_underflow("q")
    if all(file.has_doubles for file in files):
        return problem
    compact = tuple(map(replace, files))
    numbers = TextNumbers(partial(_exactly, compact), partial(_are_short, compact))
    return problem.having(written=numbers)


def _exactly(files: Sequence[InputFile], problem: Problem) -> ExactProblem:
    first, *others = files
    return first.exactly(problem, *others)


def _are_short(files: Sequence[InputFile]) -> bool:
    return all(not file.has_doubles and file.has_short_numbers for file in files)


def digest(*parts: bytes) -> str:
    from hashlib import blake2b

    hasher = blake2b(digest_size=8)
    for part in parts:
        hasher.update(len(part).to_bytes(8, "big"))
        hasher.update(part)
    return hasher.hexdigest()


def inputs(
    paths: Sequence[str],
    streams: bool = False,
    of_folders: Collection[str] = (),
    ahead: Mapping[str, InputFile] | None = None,
) -> Iterator[InputItem]:
    """Yield the inputs in the files, in order; "-" is standard input. A file with M
    alone is followed by the file of q.

    streams : whether a first line of standard input that is an object is a problem,
    whatever follows. of_folders : the files that come from folders, where the next one
        is q only if it can be nothing else. ahead : the files that have been read
        already, by their names.
    """
    return _Files(paths, of_folders, ahead or {}).inputs(streams)


class _Files:
    """Files that are read in order, each once, although the next one may decide what
    one before it is.

    paths, of_folders, ahead : as in `inputs`.
    """

    def __init__(
        self,
        paths: Sequence[str],
        of_folders: Collection[str],
        ahead: Mapping[str, InputFile],
    ) -> None:
        self._remaining, self._ahead = list(paths), dict(ahead)
        self._of_folders = of_folders

    def inputs(self, streams: bool) -> Iterator[InputItem]:
        while self._remaining:
            path = self._remaining.pop(0)
            input_file = self._ahead.pop(path, None)
            try:
                contents.refuse_folder(path)
                with (
                    contents.open_file(path)
                    if input_file is None
                    else nullcontext(io.BytesIO(input_file.content))
                ) as file:
                    is_stream = streams and path == STANDARD_INPUT
                    head, are_lines = _head(path, file, is_stream)
                    if are_lines:
                        yield from _lines(path, chain(head, file))
                        continue
                    if input_file is None:
                        content = b"".join([*head, file.read()])
                        input_file = InputFile(path, checked(path, content, WHOLE))
                yield self._with_next(input_file)
            except ProblemError as error:
                if self._remaining and self._is_q():
                    self._take(LINE)
                yield Input((InputFile(path, error=error),))

    def _take(self, expected: str) -> InputFile:
        """Return the next file. expected : the hint for an empty one."""
        path = self._remaining.pop(0)
        return self._ahead.pop(path, None) or InputFile.read(path, expected)

    def _with_next(self, file: InputFile) -> InputItem:
        """Return the problem in a file. The next file is used as q if this one has M
        alone, or if the next one has a vector and no problem, so that the error can
        name both; in a folder, only if M is alone and the next file can only be q."""
        if not self._remaining:
            return Input((file,))
        M, shared = _without_q(file)
        both = {file.path, self._remaining[0]}
        are_named = both.isdisjoint(self._of_folders)
        if M is None:
            takes = are_named and self._is_q()
        else:
            takes = are_named or self._is_q(M.shape[0])
        if not takes:
            if shared is None and are_named:
                self._refuse_swapped(file)
            return Input((file,))
        q = self._take(LINE)
        if M is None:
            return Input((file, q))
        q.require_order(lambda: file.names)
        columns = _columns(q, M.shape[0])
        if columns is None:
            return Input((file, q))
        if file.kind.is_table and q.kind.is_table:
            from lcpcli.files.csv_format import refuse_two_meanings

            q.within(refuse_two_meanings, q.data, file.data)
        first_columns = columns[0][:, : len(columns[0])]
        has_M = 1 < len(first_columns) >= len(columns[1]) - 1 and np.array_equal(
            first_columns, dense(M)
        )
        reason = f"begins with M of {file.source_name}"
        hint = "if it holds M and q, name it alone"
        refuse(has_M, q.source_name, reason, hint)
        file.refuse_underflow()
        q.refuse_underflow("q", in_columns=True)
        return QColumns((file.path, q.path), M, *columns, shared or {})

    def _refuse_swapped(self, file: InputFile) -> None:
        """Raise ProblemError if a file holds q, and the next one the M that should come
        before it."""
        if (path := self._remaining[0]) == STANDARD_INPUT:
            return
        M = q = None
        with suppress(ProblemError):
            q = file.vector("q")
            self._ahead[path] = self._ahead.get(path) or InputFile.read(path, WHOLE)
            M, _ = _without_q(self._ahead[path])
        if q is not None and M is not None and len(q) == M.shape[0]:
            other = self._take(WHOLE).path
            reason = f"holds q, and {other} M"
            hint = f"name M first: {other} {file.path}"
            raise ProblemError(file.source_name, reason, hint)

    def _is_q(self, n: int | None = None) -> bool:
        """Return whether the next file holds q and cannot be a problem, or M alone. n :
        the rows of the M before it, if any; then a vector of n entries is q whatever
        else it could be, and a table may have several q in columns."""
        path = self._remaining[0]
        if path == STANDARD_INPUT or has_lines(path):
            return False
        with suppress(ProblemError):
            if path not in self._ahead and (content := _unless_problem(path)):
                self._ahead[path] = InputFile(path, content)
            if (file := self._ahead.get(path)) is None:
                return False
            problem_or_matrix: Problem | Matrix | None = None
            with suppress(ProblemError):
                problem_or_matrix = made(file.fields)
            with suppress(ProblemError):
                return file.vector("q").size == n or not isinstance(
                    problem_or_matrix, Problem
                )
            return (
                problem_or_matrix is None
                and n is not None
                and _columns(file, n) is not None
            )
        return False


def _unless_problem(path: str) -> bytes:
    """Return the content of a file; b"" if it begins as an object that may have M."""
    with contents.open_file(path) as file:
        head = file.read(1024)  # few files begin with more blanks
        is_object = head.lstrip().startswith(b"{")
        if is_object and not head.lstrip(b"{ \t\r\n").startswith(b'"q"'):
            return b""
        return checked(path, head + file.read(), LINE)


def _lines(path: str, lines: Iterator[bytes]) -> Iterator[Input]:
    """Yield the problems in the lines; raise ProblemError if all lines are blank."""
    is_empty = True
    for number, line in enumerate(lines, 1):
        text = (contents.without_mark(line) if number == 1 else line).strip()
        if text:
            is_empty = False
            yield Input((InputFile(path, text, number),))
    refuse(is_empty, source_name(path), IS_EMPTY, WHOLE)


def _head(path: str, file: IO[bytes], streams: bool) -> tuple[list[bytes], bool]:
    """Return the lines of a file up to the second one that is not blank, and whether
    each line is a problem; of a stream only the first line is awaited if it is enough
    to decide."""
    head = list[bytes]()
    nonblank = list[bytes]()
    for line in file:
        head.append(line)
        if has_lines(path):
            return head, True
        if not (text := line.strip()):
            continue
        nonblank.append(text)
        with suppress(ValueError, RecursionError):
            first = (
                contents.without_mark(nonblank[0])
                if streams and len(nonblank) == 1
                else b"0"
            )
            if isinstance(json.loads(first, parse_int=float), dict):
                return head, True
        is_whole_object = nonblank[0].startswith(b"{") and nonblank[0].endswith(b"}")
        if len(nonblank) == 2 or not is_whole_object:
            return head, len(nonblank) == 2 and nonblank[1].startswith(b"{")
    return head, False


def _without_q(
    file: InputFile,
) -> tuple[Matrix | None, Mapping[str, Any] | None]:
    """Return M and what several q share with it in a file; None if it has q, and None
    twice if it is no problem."""
    # This is a guess, so that the process that solves the problem parses a large file.
    has_q = file.content.lstrip().startswith(b"{") and b'"q"' in file.content
    with suppress(ProblemError):
        fields: Mapping[str, Any] = {} if has_q else file.fields
        if not is_whole(fields) and {"M"} <= fields.keys() <= {"M", *SHARED, *TEXTS}:
            M = fields["M"]
            M = as_matrix("M", M) if isinstance(M, list) else M
            shared = {key: fields[key] for key in SHARED if key in fields}
            return (M if M.ndim == 2 else None), shared
        return None, {}
    return None, None


def _columns(file: InputFile, n: int) -> tuple[Matrix, list[str]] | None:
    """Return Q of shape (n, k) and the names of its columns; None if the file has a
    single vector, or no such table."""
    if file.kind.has_no_vector:
        return None
    names = list[str]()
    if file.kind.is_table:
        parsed = file.within(file.data.table, float)
        table, names = parsed.rows, parsed.header
    else:
        table = file.values("q")
    shape = np.shape(table) if isinstance(table, (list, np.ndarray)) else ()
    if n == 1 and len(shape) == 1:
        table, shape = [table], (1, *shape)
    if len(shape) != 2 or shape[1] == 1 or (shape[0] == 1 and n > 1):
        return None
    Q = file.within(as_matrix, "q", table)
    transposed = "transpose it: " if shape[1] == n else ""
    hint = f"{transposed}give one column for each problem, of as many rows as M has"
    reason = f"is {shape[0]} x {shape[1]} but M is {n} x {n}"
    file.within(refuse, shape[0] != n, "q", reason, hint)
    return Q, names or [FIRST_NAME, *(f"q{j}" for j in range(2, shape[1] + 1))]
