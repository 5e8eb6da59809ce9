"""A log of results in JSON lines: it grows by one record at a time, and an interrupted run can be resumed from it.

The records are in the order in which the results became known. After the fields of a result, each has the number of its
problem in the run, a digest of the problem, and the options.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

from lcpcli.errors import OptionError, ProblemError
from lcpcli.files.atomic_write import naming, open_alone

OPENING = b'{"version":'
UNFINISHED = "interrupted"  # the status of a record that is made again
FIELDS = {"file", "item", "status", "exact", "number", "digest", "given"}  # of a record
EXPECTED = "name a file that lcp solve -o FILE.jsonl has begun"


class Log:
    """A log that no other run reads or writes until it is closed."""

    def __init__(self, path: str, file: IO[bytes]) -> None:
        self._path, self._file = path, file

    def add(self, text: str) -> None:
        """Add a record, which is in the file when the call returns."""
        with naming(self._path):
            self._file.write(text.encode("utf-8", errors="backslashreplace"))
            self._file.flush()

    def records(self) -> Iterator[Mapping[str, Any]]:
        """Yield the finished records; raise OptionError if the file is not a log.

        An unfinished end, which is a line that was cut off or the record of an interrupted run, is removed.
        """
        if not Path(self._path).is_file():
            raise OptionError(self._path, "is not a file", EXPECTED)
        finished = place = 0
        for at, line in enumerate(self._file, 1):
            text = line.rstrip(b"\0")  # a power failure may leave zeros
            if not line.endswith(b"\n") and (text.startswith(OPENING) or OPENING.startswith(text)):
                break  # the line is incomplete
            record = _object(line)
            if not record.keys() >= FIELDS:
                raise OptionError(self._path, f"is not a log of results (line {at})", EXPECTED)
            place += len(line)
            if record["status"] != UNFINISHED:
                finished = place
                yield record
        with naming(self._path):
            self._file.seek(finished)
            self._file.truncate()


@contextmanager
def open_log(path: str, anew: bool) -> Iterator[Log]:
    """Open a context with a log, which is created if it is missing. anew : whether OptionError is raised if it has
    records."""
    with naming(path):
        file = open_alone(path, path)
    is_empty = Path(path).is_file() and not Path(path).stat().st_size
    try:
        if anew and Path(path).is_file() and not is_empty:
            raise OptionError(path, "has results", f"go on with --resume {path}, or delete it to begin again")
        yield Log(path, file)
    except BaseException:
        with suppress(OSError):
            if is_empty and not Path(path).stat().st_size:
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
    lines = [line for line in text.split("\n") if line.strip()]
    if len(lines) < 2 or not all(line.lstrip().startswith("{") for line in lines[:2]):
        return text, ""
    own = all_records = [(_object(line), line) for line in lines]
    path = Path(problem.path)
    tests: list[tuple[str, Callable[[str], bool]]] = [
        ("file", lambda file: Path(file).absolute() == path.absolute()),
        ("digest", lambda digest: digest in problem.digests()),
        ("file", lambda file: Path(file).name == path.name),
        ("problem", lambda name: name == problem.name),
    ]
    is_found = False
    for key, is_own in tests:
        if matches := [each for each in own if is_own(str(each[0].get(key) or ""))]:
            own, is_found = matches, True
        if len(own) == 1:
            return own[0][1], ""
    if is_found or all(record.get("file") and record.get("digest") for record, _ in all_records):
        hint = "give the line of one as a file of its own"
        raise ProblemError("", f"has {len(own) if is_found else 'no'} results for {problem.name}", hint)
    first = first_of("\n".join(lines))
    which = f"for {_object(first).get('problem') or 'a problem'}: none is for {problem.name}"
    return first, f"the first of {len(lines)} results is checked, {which}"


def first_of(text: str) -> str:
    """Return the result of the first problem, the one with the least number, from results with one in each line; else
    the first line."""
    lines = text.split("\n")
    given = [_object(line).get("number") for line in lines]
    numbers = [own if isinstance(own, int) else at for at, own in enumerate(given, 1)]
    return lines[numbers.index(min(numbers))]


def _object(line: str | bytes) -> dict[str, Any]:
    """Return the object in a line; an empty one if there is none."""
    with suppress(ValueError, RecursionError):
        found = json.loads(line)
        return found if isinstance(found, dict) else {}
    return {}
