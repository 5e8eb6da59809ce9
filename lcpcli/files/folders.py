"""Folders in place of the names of the files in them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lcpcli.errors import OptionError
from lcpcli.files.formats import PROBLEMS


def files_in(paths: Iterable[str]) -> list[str]:
    """The paths, with the files of problems in each folder in its place, in the order of their names.

    Raises OptionError for a folder without any, or one that cannot be read.
    """
    return [file for path in paths for file in (_inside(path) if path and Path(path).is_dir() else [path])]


def _inside(folder: str) -> list[str]:
    try:
        inside = list(Path(folder).iterdir())
    except OSError as error:
        raise OptionError(folder, f"cannot be read ({error.strerror})", "make it readable") from None
    files = [str(file) for file in inside if file.name.casefold().endswith(PROBLEMS) and file.is_file()]
    if not files:
        raise OptionError(folder, "is a folder without problem files", f"they end in {', '.join(PROBLEMS)}")
    return sorted(files)
