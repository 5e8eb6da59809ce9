"""Files by name, including shipped problems and folders, and their contents before
parsing."""

from __future__ import annotations

import codecs
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import IO, TYPE_CHECKING, Any, NamedTuple, TypeVar

from lcpcli.errors import (
    IS_DIRECTORY,
    IS_EMPTY,
    NAME_FILE,
    NO_SUCH_FILE,
    File,
    LCPError,
    ProblemError,
    Where,
    count,
)
from lcpcli.files.formats import (
    COMPRESSIBLE,
    FORMATS,
    GZIP,
    HEAD,
    PROBLEMS,
    again,
    is_result,
    refuse,
)

if TYPE_CHECKING:
    from pathlib import Path

STANDARD_INPUT = "-"
GONE = "the working folder has been removed: change to another one"
PAPER_EXAMPLES = ("paper-example-1.json", "paper-example-2.json")
# Numbers of entries of a declared shape that a file may leave out: in any case, and for
# each entry that it has.
FEW_ABSENT, MAX_ABSENT = 2**22, 1000

T = TypeVar("T")


class Source(NamedTuple):
    file: str | None = None  # the file of the problem, or of q
    # In a file with several problems, the number of the line or of the column of q,
    # from 1.
    item: int | None = None
    # The further fields of its record in a log (`files/atomic_write.py`)
    mark: Mapping[str, Any] | None = None

    def __str__(self) -> str:
        return f"{self.file}{'' if self.item is None else f':{self.item}'}"


NO_SOURCE = Source()


def shipped_path(name: str) -> str:
    from pathlib import Path

    package = Path(__file__).parent.parent
    installed, in_source = (
        folder / "problems" / name for folder in (package, package.parent)
    )
    return str(installed if installed.exists() else in_source)


def shipped_problems() -> dict[str, Path]:
    """Return the files of the shipped problems, by the names under which every command
    reads them."""
    from pathlib import Path

    folders = map(shipped_path, (".", "programs", "games"))
    files = (file for folder in folders for file in sorted(Path(folder).glob("*")))
    return {file.stem: file for file in files if file.suffix in FORMATS}


def shipped_file(name: str) -> Path | None:
    """Return the file of the shipped problem with this name; None if there is none, or
    the user has one so named."""
    file = (
        None
        if os.path.lexists(name)
        else shipped_problems().get(os.path.splitext(os.path.basename(name))[0])
    )
    return file if file is not None and name in (file.stem, file.name) else None


def files_in(paths: Iterable[str], tell: Callable[[str], object]) -> list[str]:
    """Return the paths, with each folder replaced by its problem files, in the order of
    their names. Hidden files, results and other entries of a folder are skipped, and
    `tell` is called with a line about the last two. A folder without problems, or an
    unreadable one, stays: its error comes when it is read, so the other files are not
    affected.
    """
    return [
        file
        for path in paths
        for file in (path and os.path.isdir(path) and _inside(path, tell)) or [path]
    ]


def _inside(folder: str, tell: Callable[[str], object]) -> list[str]:
    from pathlib import Path

    inside: list[Path] = []
    with suppress(OSError):
        inside = [
            entry
            for entry in sorted(Path(folder).iterdir())
            if not entry.name.startswith(".")
        ]
    named = [entry for entry in inside if entry.name.casefold().endswith(PROBLEMS)]
    files = [file for file in named if file.is_file() or file.is_symlink()]
    # The suffixes of files that accompany a model, such as its names.
    of_models = [suffix for kind in FORMATS.values() for suffix in kind.beside]
    others = [
        entry
        for entry in inside
        if entry not in files and entry.suffix not in of_models
    ]
    results = []
    for file in files:
        # An error is reported when the file is read.
        with suppress(OSError), file.open("rb") as content:
            results += [file] * is_result(content.read(HEAD))
    kinds = (
        ("entry", "folders, or without the suffix of a problem"),
        ("file", "results of lcp, not problems"),
    )
    for left_out, (noun, kind) in zip(
        (others if files else [], results), kinds, strict=True
    ):
        if left_out:
            names = ", ".join(file.name for file in left_out[:3])
            if len(left_out) > 3:
                names += ", ..."
            tell(f"{folder}: {count(len(left_out), noun)} left out ({kind}): {names}")
    return [str(file) for file in files if file not in results]


def refuse_folder(path: str) -> None:
    try:
        is_folder = os.path.isdir(path) and os.listdir(path) is not None
    except OSError as error:
        raise ProblemError(
            source_name(path), f"cannot be read ({error.strerror})", "make it readable"
        ) from None
    refuse(
        is_folder,
        source_name(path),
        "is a folder without problem files",
        f"their suffixes are {', '.join(PROBLEMS)}",
    )


def source_name(path: str) -> File:
    return File("standard input" if path == STANDARD_INPUT else path)


def within(where: Where, parse: Callable[..., T], *arguments: Any) -> T:
    """Call `parse` with the arguments; a ProblemError that it raises gets the location
    in front."""
    try:
        return parse(*arguments)
    except (ProblemError, MemoryError) as error:
        raise inside(where, error) from None


def inside(where: Where, error: ProblemError | MemoryError) -> LCPError:
    """Return an error in a file with its location; a lack of memory becomes an error of
    this file, so that the other files are still read."""
    if isinstance(error, MemoryError):
        reason = "takes more memory than there is"
        return ProblemError(where, reason, "give matrices in sparse form")
    return error.inside(where)


def content_of(path: str, expected: str) -> bytes:
    with open_file(path) as file:
        return checked(path, file.read(), expected)


def checked(path: str, content: bytes, expected: str) -> bytes:
    if path.casefold().removesuffix(".gz").endswith(COMPRESSIBLE):
        content = within(source_name(path), unpacked, content)
    content = without_mark(content)
    is_empty = not content or content.isspace()
    refuse(is_empty, source_name(path), IS_EMPTY, again(path) or expected)
    return content


@contextmanager
def open_file(path: str) -> Iterator[IO[bytes]]:
    """Open a context with a file to read from, or with standard input; a name without a
    file may be the name of a shipped problem. Raises ProblemError if the file cannot be
    read."""
    name = source_name(path)
    refuse(not path, "", "the name of a file is empty", NAME_FILE)
    refuse(path == STANDARD_INPUT and sys.stdin is None, name, "is closed", NAME_FILE)
    try:
        if path == STANDARD_INPUT:
            yield sys.stdin.buffer
        else:
            with open(shipped_file(path) or path, "rb") as file:
                yield file
    except FileNotFoundError:
        hint = GONE if is_folder_gone(path) else _likely_file(path)
        raise ProblemError(name, NO_SUCH_FILE, hint) from None
    except IsADirectoryError:
        raise ProblemError(name, IS_DIRECTORY, "name a file in it") from None
    except OSError as error:
        raise ProblemError(
            name, f"cannot be read ({error.strerror})", "make it readable"
        ) from None


def is_folder_gone(path: str = "") -> bool:
    """Return whether a path is relative to a working folder that has been removed."""
    try:
        if not os.path.isabs(path):
            os.getcwd()
    except FileNotFoundError:
        return True
    return False


def _likely_file(path: str) -> str:
    from difflib import get_close_matches
    from pathlib import Path

    folder, name = Path(path).parent, Path(path)
    with suppress(OSError):
        names = [entry.name for entry in folder.iterdir() if entry.exists()]
        if close := get_close_matches(name.name, names, n=1, cutoff=0.75):
            return f"did you mean {folder / close[0]}?"
    if close := get_close_matches(name.stem, shipped_problems(), n=1, cutoff=0.75):
        return f"did you mean {close[0]}, which is shipped?"
    return "check the path" if folder.is_dir() else f"there is no folder {folder}"


def without_mark(content: bytes) -> bytes:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        with suppress(UnicodeError):
            return content.decode("utf-16").encode()
    return content.removeprefix(codecs.BOM_UTF8)


def decode(content: bytes) -> str:
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"
    refuse("\0" in text, "", "is not UTF-8 text", "save it as UTF-8")
    return text


def unpacked(content: bytes) -> bytes:
    if not content.startswith(GZIP):
        return content
    parts = list[bytes]()
    while content:  # a file may consist of several compressed ones
        part, content = uncompressed(content, 31, sum(map(len, parts)))
        parts.append(part)
        content = content.lstrip(b"\0")
    return b"".join(parts)


def uncompressed(content: bytes, wbits: int, size: int = 0) -> tuple[bytes, bytes]:
    """Return what zlib uncompresses, and the bytes behind it; raise ProblemError if
    these are damaged, or if the result takes more than a quarter of the memory of this
    machine. wbits : of zlib, 31 for gzip. size : of earlier parts."""
    import zlib

    max_bytes = (memory() or 0) // 4 or sys.maxsize
    unpacking = zlib.decompressobj(wbits)
    try:
        data = unpacking.decompress(content, max(max_bytes - size, 1))
    except zlib.error:
        raise ProblemError(
            "", "cannot be uncompressed, as it is damaged", "compress it again"
        ) from None
    reason = f"is more than {max_bytes / 1e9:.3g} GB when it is uncompressed"
    refuse(
        unpacking.unconsumed_tail,
        "",
        reason,
        "uncompress it, and leave out what is not needed",
    )
    refuse(
        not unpacking.eof,
        "",
        "cannot be uncompressed, as it is cut off",
        "compress it again",
    )
    return data, unpacking.unused_data


def memory() -> int | None:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def refuse_beyond_memory(field: str, shape: tuple[int, ...], itemsize: int = 8) -> None:
    """Raise ProblemError if an array of the shape that a file declares is larger than
    the memory of this machine."""
    size = math.prod(shape) * itemsize
    reason = (
        f"is {' x '.join(map(str, shape))}, {size / 1e9:.3g} GB, more than this "
        "machine's memory"
    )
    refuse(size > (memory() or math.inf), field, reason, "give it in sparse form")


def refuse_mostly_absent(
    field: str, shape: tuple[int, ...], size: int, n_entries: int
) -> None:
    """Raise ProblemError if a file declares a shape that needs `size` numbers, and has
    entries for only a small part of it: a few bytes could otherwise take all memory.
    n_entries : the number of entries in the file."""
    reason = (
        f"is declared as {' x '.join(map(str, shape))} with {count(n_entries, 'entry')}"
    )
    is_wrong = size > FEW_ABSENT and size > MAX_ABSENT * n_entries
    refuse(is_wrong, field, reason, f"give at least one of {MAX_ABSENT} entries")
