"""Output files appear whole or not at all."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from lcpcli.errors import OptionError


def refuse_unwritable(path: str) -> None:
    """Raise OptionError if `write_whole` could not write there, so that no work is done in vain."""
    target = Path(path).resolve()
    if target.is_dir():
        raise OptionError(path, "is a directory", "name a file")
    if not target.parent.is_dir():
        raise OptionError(path, f"there is no folder {target.parent}", "make it first")
    if not os.access(target if _is_special(target) else target.parent, os.W_OK):
        raise OptionError(path, "cannot be written", "choose a folder that you may write to")


def write_whole(path: str, text: str) -> None:
    """Write a text file by way of a temporary one beside it; devices and pipes are written directly."""
    refuse_unwritable(path)
    target = Path(path).resolve()
    try:
        if _is_special(target):
            target.write_text(text, encoding="utf-8")
        else:
            _replace(target, text)
    except OSError as error:
        raise OptionError(path, f"cannot be written ({error.strerror})", "choose another place") from None


def _replace(target: Path, text: str) -> None:
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
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
