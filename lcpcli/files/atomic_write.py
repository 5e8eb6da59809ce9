"""Atomic output: files are written completely or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, TypeAlias

from lcpcli.errors import OptionError

Content: TypeAlias = "str | bytes | IO[bytes]"


def refuse_unwritable(path: str) -> None:
    """Raise OptionError if `write_whole` could not write there, before anything is computed.

    A file is created and removed there, the only reliable test: permissions say nothing about root or read-only disks.
    """
    from tempfile import TemporaryFile

    if not path:
        raise OptionError("", "the name of the output is empty", "name a file")
    try:
        target = _target(path)
        if target.is_dir():
            raise OptionError(path, "is a directory", "name a file")
        if not target.parent.is_dir():
            raise OptionError(path, f"there is no folder {target.parent}", "create it first")
        if _is_special(target):
            if not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        else:
            with contextlib.suppress(FileNotFoundError):
                target.lstat()
            with TemporaryFile(dir=target.parent):
                pass
    except OSError as error:
        raise _unwritable(path, error) from None


def write_whole(path: str, content: Content) -> None:
    """Write a file through a temporary one beside it; devices and pipes are written directly."""
    write_together({path: content})


def write_together(contents: Mapping[str, Content]) -> None:
    """Write several files as `write_whole` does; none is moved into place before all are complete."""
    for path in contents:
        refuse_unwritable(path)
    staged: dict[str, Path] = {}
    for path, content in contents.items():
        with telling_of(path):
            if _is_special(Path(path)):
                with Path(path).open("wb") as file:
                    _put(content, file)
    with _undisturbed():
        try:
            for path, content in contents.items():
                with telling_of(path):
                    if not _is_special(Path(path)):
                        staged[path] = _temporary(_target(path), content)
            for path, temporary in staged.items():
                with telling_of(path):
                    temporary.replace(_target(path))
        finally:
            for temporary in staged.values():
                temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def written_gradually(path: str) -> Iterator[Callable[[str], object]]:
    """A context with a function that adds a text to what is written when the context is left, whatever with."""
    from tempfile import TemporaryFile

    def add(text: str) -> None:
        with _collecting(path):
            file.write(_encoded(text))

    refuse_unwritable(path)
    with _collecting(path):
        file = TemporaryFile()  # noqa: SIM115
    try:
        yield add
    finally:
        try:
            with _collecting(path):
                file.seek(0)  # which writes the rest
            write_whole(path, file)
        finally:
            with contextlib.suppress(OSError):  # it tries again to write what could not be written
                file.close()


@contextlib.contextmanager
def _collecting(path: str) -> Iterator[None]:
    """A context in which a fault of the system becomes an OptionError that names the folder of temporary files."""
    from tempfile import gettempdir

    try:
        yield
    except OSError as error:
        fault = f"cannot be collected in {gettempdir()} ({error.strerror})"
        raise OptionError(path, fault, "set TMPDIR to a folder with room") from None


@contextlib.contextmanager
def telling_of(path: str) -> Iterator[None]:
    """A context in which a fault of the system becomes an OptionError for the output to that file."""
    try:
        yield
    except OSError as error:
        raise _unwritable(path, error) from None


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Defer Ctrl-C and SIGTERM, which would leave temporary files behind, until these are gone."""
    received: list[int] = []
    usual: dict[signal.Signals, Any] = {}
    with contextlib.suppress(ValueError):  # only the main thread may set handlers, and only it receives signals
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not None:  # else it was not set from Python, and could not be restored
                usual[number] = signal.signal(number, lambda number, _: received.append(number))
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
        for late in received:
            signal.raise_signal(late)


def _put(content: Content, file: IO[bytes]) -> None:
    if isinstance(content, (str, bytes)):
        file.write(_encoded(content))
    else:
        shutil.copyfileobj(content, file)


def _encoded(content: str | bytes) -> bytes:
    return content.encode("utf-8", errors="backslashreplace") if isinstance(content, str) else content


def _target(path: str) -> Path:
    if _is_special(Path(path)):
        return Path(path)
    with contextlib.suppress(RuntimeError):  # raised by pathlib for a link to itself before Python 3.13
        target = Path(path).resolve()
        if not target.is_symlink():  # the result for such a link since then
            return target
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _unwritable(path: str, error: OSError) -> OptionError:
    return OptionError(path, f"cannot be written ({error.strerror})", "choose another location")


def _temporary(target: Path, content: Content) -> Path:
    """A complete temporary file beside the target, ready to replace it."""
    from tempfile import mkstemp

    handle, name = mkstemp(dir=target.parent, prefix=".lcp-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            _put(content, file)
        temporary.chmod(_mode(target))
    except BaseException:
        temporary.unlink()
        raise
    return temporary


def _mode(target: Path) -> int:
    """The permissions of the file that is replaced, or those of a new file."""
    if target.exists():
        return stat.S_IMODE(target.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _is_special(target: Path) -> bool:
    return target.exists() and not target.is_file()
