"""Output files appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Mapping
from pathlib import Path

from lcpcli.errors import OptionError


def refuse_unwritable(path: str) -> None:
    """Raise OptionError if `write_whole` could not write there, so that no work is done in vain.

    A file is made and removed there, as nothing else tells: permissions do not hold for root, nor on a read-only disk.
    """
    from tempfile import TemporaryFile

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
            with TemporaryFile(dir=target.parent):
                pass
    except OSError as error:
        raise _unwritable(path, error) from None


def write_whole(path: str, content: str | bytes) -> None:
    """Write a file by way of a temporary one beside it; devices and pipes are written directly."""
    write_together({path: content})


def write_together(contents: Mapping[str, str | bytes]) -> None:
    """Write several files as `write_whole` does, none of them put in its place before all are complete."""
    for path in contents:
        refuse_unwritable(path)
    staged: list[tuple[str, Path, Path]] = []
    try:
        for path, content in contents.items():
            data = content.encode("utf-8", errors="backslashreplace") if isinstance(content, str) else content
            target = _target(path)
            if _is_special(target):
                target.write_bytes(data)
            else:
                staged.append((path, _temporary(target, data), target))
        for path, temporary, target in staged:  # noqa: B007 (path is for the message)
            temporary.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from None
    finally:
        for _, temporary, _ in staged:
            temporary.unlink(missing_ok=True)


def _target(path: str) -> Path:
    if _is_special(Path(path)):
        return Path(path)
    with contextlib.suppress(RuntimeError):  # what pathlib makes of a link to itself before Python 3.13
        target = Path(path).resolve()
        if not target.is_symlink():  # and this is what it makes of one since then
            return target
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _unwritable(path: str, error: OSError) -> OptionError:
    return OptionError(path, f"cannot be written ({error.strerror})", "choose another place")


def _temporary(target: Path, data: bytes) -> Path:
    """A complete file beside the target, ready to replace it."""
    from tempfile import mkstemp

    handle, name = mkstemp(dir=target.parent, prefix=".lcp-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
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
