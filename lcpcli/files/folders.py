"""Folders in place of the names of the files in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from lcpcli.errors import OptionError, count
from lcpcli.files.formats import PROBLEMS
from lcpcli.files.recognition import HEAD, is_result

SHOWN = 3  # results that a line names


def files_in(paths: Iterable[str], tell: Callable[[str], object]) -> list[str]:
    """The paths, with the files of problems in each folder in its place, in the order of their names.

    tell : is given a line on the results in a folder, which are left out.
    Raises OptionError for a folder without any problem, or one that cannot be read.
    """
    return [file for path in paths for file in (_inside(path, tell) if path and Path(path).is_dir() else [path])]


def _inside(folder: str, tell: Callable[[str], object]) -> list[str]:
    try:
        inside = sorted(Path(folder).iterdir())
    except OSError as error:
        raise OptionError(folder, f"cannot be read ({error.strerror})", "make it readable") from None
    files = [file for file in inside if file.name.casefold().endswith(PROBLEMS) and file.is_file()]
    results = [file for file in files if _is_result(file)]
    if len(results) == len(files):
        raise OptionError(folder, "is a folder without problem files", f"they end in {', '.join(PROBLEMS)}")
    if results:
        names = ", ".join(file.name for file in results[:SHOWN]) + ", ..." * (len(results) > SHOWN)
        tell(f"{folder}: {count(len(results), 'file')} left out, as results of lcp and no problems: {names}")
    return [str(file) for file in files if file not in results]


def _is_result(file: Path) -> bool:
    try:
        with file.open("rb") as opened:
            return is_result(opened.read(HEAD))
    except OSError:  # which is said when it is read
        return False
