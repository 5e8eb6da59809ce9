"""Output files appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import tempfile
from pathlib import Path

from lcpcli.errors import OptionError


def refuse_unwritable(path: str) -> None:
    """Raise OptionError if `write_whole` could not write there, so that no work is done in vain.

    A file is made and removed there, as nothing else tells: permissions do not hold for root, nor on a read-only disk.
    """
    if not path:
        raise OptionError("", "the name of the output is empty", "name a file")
    try:
        target = _target(path)
        if target.is_dir():
            raise OptionError(path, "is a directory", "name a file")
        if not target.parent.is_dir():
            raise OptionError(path, f"there is no folder {target.parent}", "make it first")
        if _is_special(target):
            if not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        else:
            with contextlib.suppress(FileNotFoundError):
                target.lstat()
            with tempfile.TemporaryFile(dir=target.parent):
                pass
    except OSError as error:
        raise _unwritable(path, error) from None


def write_whole(path: str, text: str) -> None:
    """Write a text file by way of a temporary one beside it; devices and pipes are written directly."""
    refuse_unwritable(path)
    try:
        target = _target(path)
        if _is_special(target):
            target.write_text(text, encoding="utf-8", errors="backslashreplace")
        else:
            _replace(target, text)
    except OSError as error:
        raise _unwritable(path, error) from None


def _target(path: str) -> Path:
    if _is_special(Path(path)):
        return Path(path)
    try:
        return Path(path).resolve()
    except RuntimeError:  # what pathlib makes of a link to itself before Python 3.13
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from None


def _unwritable(path: str, error: OSError) -> OptionError:
    return OptionError(path, f"cannot be written ({error.strerror})", "choose another place")


def _replace(target: Path, text: str) -> None:
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=".lcp-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
            file.write(text)
        temporary.chmod(_mode(target))
        temporary.replace(target)
    except BaseException:
        temporary.unlink()
        raise


def _mode(target: Path) -> int:
    """The permissions of the file that is replaced, or those of a new file."""
    if target.exists():
        return stat.S_IMODE(target.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _is_special(target: Path) -> bool:
    return target.exists() and not target.is_file()
