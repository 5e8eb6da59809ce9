"""A log of results in JSON lines: it grows by one record at a time, and an interrupted run can be resumed from it.

The records are in the order in which the results became known. After the fields of a result, each has the number of its
problem in the run, a digest of the problem, and the options that the result does not show; the last record of a
complete run also has `complete`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

from lcpcli.errors import OptionError, ProblemError
from lcpcli.files.atomic_write import naming, open_alone, write_whole

OPENING = b'{"version":'
END, COMPLETE = b"}\n", b', "complete": true}\n'
NUMBER = re.compile(rb', ?"number": ?(\d{1,18}), ?"digest": ?"\w+", ?"given":[^\n]*$')  # jq -c drops the blanks
TEXT = r'"{}": ?("(?:[^"\\\x00-\x1f]|\\["\\/bfnrt]|\\u[0-9a-f]{{4}})*")'  # the text of a key in a line
UNFINISHED = "interrupted"  # the status of a record that is made again
FIELDS = {"file", "item", "status", "exact", "number", "digest", "given"}  # of a record
EXPECTED = "name a file that lcp solve -o FILE.jsonl has begun"


class Log:
    """A log that no other run reads or writes until it is closed."""

    def __init__(self, path: str, file: IO[bytes]) -> None:
        self._path, self._file, self._is_file = path, file, Path(path).is_file()

    def clear(self) -> None:
        if self._is_file:
            with naming(self._path):
                self._file.seek(0)
                self._file.truncate()

    def add(self, text: str) -> None:
        """Add a record, which is in the file when the call returns."""
        with naming(self._path):
            self._file.write(text.encode("utf-8", errors="backslashreplace"))
            self._file.flush()

    def records(self) -> Iterator[tuple[int, Mapping[str, Any]]]:
        """Yield the finished records, each with the number of its problem; raise OptionError if the file is not a log.

        An unfinished end, which is a line that was cut off or the record of an interrupted run, is removed.
        """
        if not self._is_file:
            raise OptionError(self._path, "is not a file", EXPECTED)
        finished = place = 0
        self._file.seek(0)
        for at, line in enumerate(self._file, 1):
            text = line.rstrip(b"\0")  # a power failure may leave zeros
            if not line.endswith(b"\n") and (text.startswith(OPENING) or OPENING.startswith(text)):
                break  # the line is incomplete
            record = None
            with suppress(ValueError, RecursionError):
                record = json.loads(line)
            if not isinstance(record, dict) or not record.keys() >= FIELDS:
                raise OptionError(self._path, f"is not a log of results (line {at})", EXPECTED)
            place += len(line)
            if record["status"] != UNFINISHED:
                finished = place
                yield record["number"], record
        with naming(self._path):
            self._file.seek(finished)
            self._file.truncate()

    def reopen(self) -> None:
        """Take the mark of a complete log away, as records are going to be added."""
        if self._is_file and _is_complete(self._file):
            with naming(self._path):
                self._file.truncate(self._file.seek(-len(COMPLETE), 2))
                self._file.write(END)
                self._file.flush()

    def end(self, has_replaced: bool) -> None:
        """Mark the last record as the end of a complete log. has_replaced : whether some records replace earlier ones
        of the same number, which are then removed."""
        if not self._is_file:
            return
        with naming(self._path):
            if self._file.seek(0, 2) and not _is_complete(self._file):
                self._file.seek(-len(END), 2)
                self._file.write(COMPLETE)
                self._file.flush()
            if has_replaced:  # only the last record of each number is kept; nothing can be added any more
                from tempfile import TemporaryFile

                self._file.seek(0)
                last = {_number(line, at): at for at, line in enumerate(self._file, 1)}
                self._file.seek(0)
                with TemporaryFile(dir=Path(self._path).resolve().parent) as kept:
                    kept.writelines(line for at, line in enumerate(self._file, 1) if last[_number(line, at)] == at)
                    kept.seek(0)
                    write_whole(self._path, kept)


@contextmanager
def open_log(path: str, anew: bool) -> Iterator[Log]:
    """Open a context with a log, which is created if it is missing. anew : whether its records are going to be
    replaced; OptionError is raised if they belong to an incomplete run."""
    is_made = not Path(path).exists()
    with naming(path):
        file = open_alone(path, path)
    try:
        if anew and Path(path).is_file() and NUMBER.search(file.readline()) and not _is_complete(file):
            hint = f"go on with --resume {path}, or delete it to begin anew"
            raise OptionError(path, "has results of a run that did not finish", hint)
        yield Log(path, file)
    except BaseException:
        with suppress(OSError):
            if is_made and not Path(path).stat().st_size:
                Path(path).unlink()
        raise
    finally:
        with naming(path):
            file.close()  # closing tries again to write what could not be written


class Sought(NamedTuple):
    """The problem whose result is sought. digests : returns those that its record in a log may have."""

    path: str = ""
    digests: Callable[[], Collection[str]] = list
    name: str = ""


def record_of(text: str, problem: Sought) -> tuple[str, str]:
    """Return one of several results, one per line: that of the problem by its file, else its digest, the name of its
    file or its own name; if none is, `first_of` them, with a remark. Raise ProblemError if several are, or if none is
    in a log. Return any other text as it is, without a remark."""
    lines = own = [line for line in text.split("\n") if line.strip()]
    if len(lines) < 2 or not all(line.lstrip().startswith("{") for line in lines[:2]):
        return text, ""
    path = Path(problem.path)
    tests: list[tuple[str, Callable[[str], bool]]] = [
        ("file", lambda file: Path(file).absolute() == path.absolute()),
        ("digest", lambda digest: digest in problem.digests()),
        ("file", lambda file: Path(file).name == path.name),
        ("problem", lambda name: name == problem.name),
    ]
    is_found = False
    for key, is_own in tests:
        if matches := [line for line in own if is_own(_text(key, line))]:
            own, is_found = matches, True
        if len(own) == 1:
            return own[0], ""
    if is_found or all(_text("file", line) and _text("digest", line) for line in lines):
        hint = "give the line of one as a file of its own"
        raise ProblemError("", f"has {len(own) if is_found else 'no'} results for {problem.name}", hint)
    first = first_of("\n".join(lines))
    which = f"for {_text('problem', first) or 'a problem'}: none is for {problem.name}"
    return first, f"the first of {len(lines)} results is checked, {which}"


def _text(key: str, line: str) -> str:
    found = re.search(TEXT.format(key), line)
    return str(json.loads(found[1])) if found else ""


def first_of(text: str) -> str:
    """Return the result of the first problem, the one with the least number, from results with one in each line; else
    the first line."""
    lines = text.split("\n")
    return min(enumerate(lines, 1), key=lambda each: _number(each[1].encode(errors="backslashreplace"), each[0]))[1]


def _number(line: bytes, otherwise: int) -> int:
    found = NUMBER.search(line)
    return int(found[1]) if found else otherwise


def _is_complete(file: IO[bytes]) -> bool:
    file.seek(-min(len(COMPLETE), file.seek(0, 2)), 2)
    return file.read() == COMPLETE
