"""A log of results in JSON lines: it grows by one record at a time, and a run that was cut off goes on from it.

Its records are in the order in which they became known. Each has, behind what a result has, the number of its problem
in the run, a digest of the problem and the options that the result does not show; the last one of a run that came to
its end has `complete` too. Logs of version 0.1.0 have none of these, and are in the order of the problems.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from lcpcli.errors import OptionError
from lcpcli.files.atomic_write import opened_alone, telling_of, write_whole

OPENING = b'{"version": '
END, COMPLETE = b"}\n", b', "complete": true}\n'
NUMBER = re.compile(rb', "number": (\d+), "digest": "\w+", "given": [^\n]*$')
NAME = re.compile(r'"problem": ("(?:[^"\\\x00-\x1f]|\\["\\/bfnrt])*")')
UNFINISHED = "interrupted"  # the status of a record that is made again
EXPECTED = "name a file that lcp solve -o FILE.jsonl has begun"


class Log:
    """A log that this run alone has, from before it is read until it is closed."""

    def __init__(self, path: str, file: IO[bytes]) -> None:
        self._path, self._file, self._is_file = path, file, Path(path).is_file()

    def clear(self) -> None:
        """Make it empty."""
        if self._is_file:
            with telling_of(self._path):
                self._file.seek(0)
                self._file.truncate()

    def add(self, text: str) -> None:
        """Add a record, which is there as soon as this returns."""
        with telling_of(self._path):
            self._file.write(text.encode("utf-8", errors="backslashreplace"))
            self._file.flush()

    def records(self) -> Iterator[tuple[int, Mapping[str, Any]]]:
        """The finished records, each with the number of its problem; OptionError if it is no log. What is not finished
        at the end, a line that was cut off or a record of an interrupted run, is removed."""
        if not self._is_file:
            raise OptionError(self._path, "is not a file", EXPECTED)
        finished = place = 0
        self._file.seek(0)
        for at, line in enumerate(self._file, 1):
            text = line.rstrip(b"\0")  # a failure of power may leave zeros
            if not line.endswith(b"\n") and (text.startswith(OPENING) or OPENING.startswith(text)):
                break  # it is torn
            record = None
            with suppress(ValueError, RecursionError):
                record = json.loads(line)
            if not isinstance(record, dict) or not {"file", "item", "status", "exact"} <= record.keys():
                raise OptionError(self._path, f"is not a log of results (line {at})", EXPECTED)
            place += len(line)
            if record["status"] != UNFINISHED:
                finished = place
                yield record.get("number", at), record
        with telling_of(self._path):
            self._file.seek(finished)
            self._file.truncate()

    def end(self, has_replaced: bool) -> None:
        """Say in the last record that all are there. has_replaced : whether records have taken the place of others of
        the same number, which are removed."""
        if not self._is_file:
            return
        with telling_of(self._path):
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
def opened(path: str, anew: bool) -> Iterator[Log]:
    """A context with a log, which is made where it is missing. anew : whether its records are going to be replaced;
    OptionError if they are of a run that did not come to its end."""
    is_made = not Path(path).exists()
    with telling_of(path):
        file = opened_alone(path, path)
    try:
        if anew and Path(path).is_file() and NUMBER.search(file.readline()) and not _is_complete(file):
            hint = f"go on with --resume {path}, or delete it to begin anew"
            raise OptionError(path, "has results of a run that did not come to its end", hint)
        yield Log(path, file)
    except BaseException:
        with suppress(OSError):
            if is_made and not Path(path).stat().st_size:
                Path(path).unlink()
        raise
    finally:
        with telling_of(path):
            file.close()  # which tries again to write what could not be written


def record_of(text: str, name: str) -> tuple[str, str]:
    """Return, of several results with one in each line, the only one of the problem of that name, else the first as
    `first_of`, with a remark that says so; and any other text as it is, without a remark."""
    lines = [line for line in text.split("\n") if line.strip()]
    if len(lines) < 2 or not all(line.lstrip().startswith("{") for line in lines[:2]):
        return text, ""
    own = [line for line in lines if _name(line) == name]
    if len(own) == 1:
        return own[0], ""
    first = first_of("\n".join(lines))
    which = f"{len(own)} are" if own else "none is"
    return first, f"the first of {len(lines)} results is checked, of {_name(first) or 'a problem'}: {which} of {name}"


def _name(line: str) -> str:
    """The name of the problem of a record; "" if there is none."""
    found = NAME.search(line)
    return str(json.loads(found[1])) if found else ""


def first_of(text: str) -> str:
    """Return, of several results with one in each line, that of the first problem: the least number, else the first."""
    lines = text.split("\n")
    return min(enumerate(lines, 1), key=lambda each: _number(each[1].encode(errors="backslashreplace"), each[0]))[1]


def _number(line: bytes, otherwise: int) -> int:
    found = NUMBER.search(line)
    return int(found[1]) if found else otherwise


def _is_complete(file: IO[bytes]) -> bool:
    file.seek(-min(len(COMPLETE), file.seek(0, 2)), 2)
    return file.read() == COMPLETE
