"""Output to files: completely or not at all, and by one run at a time where the system
has locks.

A log of results in JSON lines grows by one record at a time, and an interrupted run can
be resumed from it. After the fields of a result, each record has the number of its
problem in the run, a digest of the problem, and the options.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import IO, Any, TypeAlias

from lcpcli.errors import IS_DIRECTORY, NAME_FILE, File, OptionError
from lcpcli.files.contents import GONE, is_folder_gone
from lcpcli.interrupts import deferring_signals
from lcpcli.locks import lock

Content: TypeAlias = "str | bytes | IO[bytes]"


def refuse_unwritable(path: str) -> None:
    """Raise OptionError if `write_whole` could not write to this path, before anything
    is computed. The test creates a file and removes it, as permissions say nothing
    about root or read-only disks."""
    from tempfile import TemporaryFile

    if not path:
        raise OptionError("", "the name of the output is empty", NAME_FILE)
    with naming(path):
        target = _target(path)
        if target.is_dir():
            raise OptionError(File(path), IS_DIRECTORY, NAME_FILE)
        if not target.parent.is_dir():
            raise OptionError(
                File(path), f"there is no folder {target.parent}", "create it first"
            )
        if not _is_special(target):
            with suppress(FileNotFoundError):
                target.lstat()
            TemporaryFile(dir=target.parent).close()
        elif not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def write_whole(path: str, content: Content) -> None:
    write_together({path: content})


def write_together(contents: Mapping[str, Content]) -> None:
    """Write several files as `write_whole` does; none is moved to its final name before
    all are complete."""
    for path in contents:
        refuse_unwritable(path)
    files = {
        path: content for path, content in contents.items() if not _is_special(path)
    }
    for path in [path for path in contents if path not in files]:
        with naming(path), Path(path).open("wb") as file:
            _put(contents[path], file)
    staged: dict[str, Path] = {}
    with deferring_signals():
        try:
            for path, content in files.items():
                with naming(path):
                    staged[path] = _temporary(_target(path), content)
            for path, temporary in staged.items():
                with naming(path):
                    temporary.replace(_target(path))
        finally:
            for temporary in staged.values():
                temporary.unlink(missing_ok=True)


def append(path: str, text: str) -> None:
    """Append a text to a file; it is stored when the call returns."""
    with naming(path), Path(path).open("ab") as file:
        _put(text, file)


@contextmanager
def gradual_writing(path: str) -> Iterator[Callable[[str], object]]:
    """Open a context with a function that adds a text. The texts are written when it
    closes, even after an error."""
    from tempfile import TemporaryFile, gettempdir

    def add(text: str) -> None:
        with collecting():
            _put(text, file)

    refuse_unwritable(path)
    collecting = partial(
        naming,
        path,
        f"collected in {gettempdir()}",
        "set TMPDIR to a folder with enough space",
    )
    with collecting():
        file = TemporaryFile()  # noqa: SIM115
    try:
        yield add
    finally:
        try:
            with collecting():
                file.seek(0)  # which writes the rest
            write_whole(path, file)
        finally:
            # Closing attempts again to write what could not be written.
            with suppress(OSError):
                file.close()


@contextmanager
def naming(
    path: str, what: str = "written", hint: str = "choose another location"
) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        hint = GONE if is_folder_gone(path) else hint
        reason = f"cannot be {what} ({error.strerror})"
        raise OptionError(File(path), reason, hint) from None


def _put(content: Content, file: IO[bytes]) -> None:
    if isinstance(content, str):
        content = content.encode("utf-8", errors="backslashreplace")
    shutil.copyfileobj(
        BytesIO(content) if isinstance(content, bytes) else content, file
    )


def _target(path: str) -> Path:
    if _is_special(path):
        return Path(path)
    # Raised by pathlib for a link to itself before Python 3.13.
    with suppress(RuntimeError):
        target = Path(path).resolve()
        if not target.is_symlink():  # the result for such a link since then
            return target
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _temporary(target: Path, content: Content) -> Path:
    from tempfile import mkstemp

    handle, name = mkstemp(dir=target.parent, prefix=".lcp-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            _put(content, file)
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(
            stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~mask
        )
    except BaseException:
        temporary.unlink()
        raise
    return temporary


def _is_special(path: str | Path) -> bool:
    return Path(path).exists() and not Path(path).is_file()


def open_alone(path: str | Path, name: str) -> IO[bytes]:
    """Open a file, created if it is missing, that this run alone reads and writes until
    the file is closed; a device or a pipe is only written. Raise OptionError, with the
    name of the file, if another run holds it."""
    while not _is_special(path):
        # The stack closes every file but the one that is returned.
        with ExitStack() as stack:
            descriptor = os.open(
                path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666
            )
            file = stack.enter_context(os.fdopen(descriptor, "r+b"))
            _lock(file, name)
            # The run that had the lock may have removed or replaced the file.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file.fileno()), Path(path).stat()):
                    stack.pop_all()
                    return file
    return Path(path).open("ab")


@contextmanager
def reserve(paths: Iterable[str]) -> Iterator[None]:
    """Open a context in which no other run writes these files; raise OptionError if
    another run writes one of them. Each file is replaced as a whole, so the locks are
    on separate files in the same folder."""
    with ExitStack() as locks:
        targets = dict[Path, str]()
        for path in paths:
            with naming(path):
                if not _is_special(path):
                    targets[Path(path).resolve()] = path
        for target, path in targets.items():
            lock_file = target.with_name(f".{target.name}.lock")
            # The folder cannot be written: then the file cannot be replaced either.
            with suppress(OSError):
                locks.enter_context(open_alone(lock_file, path))
                # Some systems do not remove a file that is open.
                locks.enter_context(suppress(OSError))
                locks.callback(lock_file.unlink)  # before it is closed
        yield


def _lock(file: IO[bytes], name: str) -> None:
    if not lock(file):
        raise OptionError(
            File(name),
            "is being written by another run",
            "wait until it finishes, or name another file",
        )


OPENING = b'{"version":'
# A record with this status is made again, and one that has it as a key.
UNFINISHED = "interrupted"
FIELDS = {"file", "item", "status", "number", "digest", "given"}  # of a record
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
        """Yield the finished records; raise OptionError if the file is not a log. An
        unfinished last record, which is a line that was cut off or the record of an
        interrupted run, is removed."""
        if not Path(self._path).is_file():
            raise OptionError(File(self._path), "is not a file", EXPECTED)
        finished = n_bytes = 0
        for at, line in enumerate(self._file, 1):
            text = line.rstrip(b"\0")  # a power failure may leave zeros
            if not line.endswith(b"\n") and (
                text.startswith(OPENING) or OPENING.startswith(text)
            ):
                break  # the line is incomplete
            record = None
            with suppress(ValueError, RecursionError):
                record = json.loads(line)
            if not isinstance(record, dict) or not record.keys() >= FIELDS:
                raise OptionError(
                    File(self._path), f"is not a log of results (line {at})", EXPECTED
                )
            n_bytes += len(line)
            # A run that Ctrl-C ended at a solution may lack what follows from it.
            if record["status"] != UNFINISHED and not record.get(UNFINISHED):
                finished = n_bytes
                yield record
        with naming(self._path):
            self._file.seek(finished)
            self._file.truncate()


@contextmanager
def open_log(path: str, anew: bool) -> Iterator[Log]:
    """Open a context with a log, which is created if it is missing. anew : whether it
    is refused if it has records."""
    with naming(path):
        file = open_alone(path, path)
    is_empty = Path(path).is_file() and not Path(path).stat().st_size
    try:
        if anew and Path(path).is_file() and not is_empty:
            raise OptionError(
                File(path),
                "is not empty",
                f"use --resume {path} to continue, or delete it to begin again",
            )
        yield Log(path, file)
    except BaseException:
        with suppress(OSError):
            if is_empty and not Path(path).stat().st_size:
                Path(path).unlink()
        raise
    finally:
        with naming(path):
            file.close()  # closing attempts again to write what could not be written
