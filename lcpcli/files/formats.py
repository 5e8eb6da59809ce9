"""The formats of files, by suffix and by the beginning of a file. The error for an
unreadable file gives advice.

numpy is not loaded, so that shell completion responds at once.
"""

from __future__ import annotations

import os
import re
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, cast

from lcpcli.errors import ProblemError, Where
from lcpcli.model import formulations

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from fractions import Fraction

    from lcpcli.model.formulation import Objective
    from lcpcli.model.nonlinear import NonlinearProblem

Number: TypeAlias = "Callable[[str], float]"  # converts a number in a text to a float
# The exact number that a float represents, where its shortest decimal is not this.
Exact: TypeAlias = "Mapping[float, Fraction]"

ALL, BOUNDS, M_AND_Q = "everything", "M, q and bounds", "M and q"


class Kind(NamedTuple):
    # The module that reads and writes them, a `Format`: in lcpcli.files, or with its
    # full name.
    form: str
    # Of a problem: ALL, BOUNDS, M_AND_Q, or what it is made from, as of `of`; "" if
    # they are only read.
    keeps: str
    # Whether numbers are written with any number of digits, not in double precision.
    in_decimals: bool = False
    # Whether numbers that are no decimals are written too, as fractions.
    has_fractions: bool = False
    # Whether numbers are read as arrays of any type, not as texts.
    has_arrays: bool = False
    is_packed: bool = False  # whether a file with .gz after the suffix is read too
    # What such a file begins with, by which it is recognized whatever its suffix.
    beginning: bytes = b""
    has_no_vector: str = ""  # why such a file holds no vector; "" if it may hold one
    # Whether it is a table, whose rows and columns may have labels.
    is_table: bool = False
    # Whether results of lcp are written in it.
    has_results: bool = False
    # The kind of the formulation whose problems alone are in such files; "" for any.
    of: str = ""
    # A regular expression for the content of such a file, where its suffix is unknown.
    pattern: bytes = b""
    # Of a model, whose module is a `ModelFormat`: the suffix of files with solutions,
    # and those of other files that accompany it.
    beside: tuple[str, ...] = ()

    @property
    def is_model(self) -> bool:
        return bool(self.beside)


JSON_FILE = Kind(
    "json_format",
    ALL,
    in_decimals=True,
    has_fractions=True,
    is_packed=True,
    has_results=True,
)
CSV_FILE = JSON_FILE._replace(form="csv_format", keeps=BOUNDS, is_table=True)
NPZ_FILE = Kind("npz_format", ALL, has_arrays=True)
MAT_FILE = Kind("mat_format", ALL, has_arrays=True, beginning=b"MATLAB 5.0")
FORMATS = {
    ".json": JSON_FILE,
    ".csv": CSV_FILE,
    ".mtx": Kind("matrix_market_format", M_AND_Q, in_decimals=True, is_packed=True),
    ".npz": NPZ_FILE,
    ".npy": Kind("npy_format", M_AND_Q, has_arrays=True, beginning=b"\x93NUMPY"),
    ".mat": MAT_FILE,
}


def _of_formulations(rows: Iterable[tuple[str, formulations.Row]]) -> dict[str, Kind]:
    return {
        suffix: Kind(
            f"{row.home}.{file_format.module}",
            f"the {row.word}" if file_format.is_written else "",
            in_decimals=file_format.is_written,
            is_packed=True,
            beginning=file_format.beginning,
            has_no_vector=f"is {row.noun}",
            of=kind,
            pattern=file_format.pattern,
            beside=file_format.beside,
        )
        for kind, row in rows
        for suffix, file_format in row.files.items()
    }


# In the order in which messages and help list them.
FORMATS |= _of_formulations(formulations.TABLE.items())


def _suffixes(*contents: str) -> tuple[str, ...]:
    return tuple(suffix for suffix, kind in FORMATS.items() if kind.keeps in contents)


# The formats that any problem can be written to.
GENERAL_SUFFIXES = _suffixes(ALL, BOUNDS, M_AND_Q)
COMPLETE = _suffixes(ALL)
WITH_BOUNDS = _suffixes(ALL, BOUNDS)
# Compressed files are read as if they were not compressed.
COMPRESSED = tuple(f"{suffix}.gz" for suffix, kind in FORMATS.items() if kind.is_packed)
PROBLEMS = (*FORMATS, *COMPRESSED)  # all suffixes of files with one problem


def suffixes_of(kind: str) -> list[str]:
    """Return the formats that only problems of a kind of formulation can be written
    to."""
    return [
        suffix
        for suffix, file_kind in FORMATS.items()
        if file_kind.of == kind and file_kind.keeps
    ]


# What to add to a list of suffixes.
FOR_SOME = "".join(
    f", or {' or '.join(suffixes_of(kind))} for {row.noun}"
    for kind, row in formulations.TABLE.items()
    if suffixes_of(kind)
)
WRITTEN = f"{', '.join(GENERAL_SUFFIXES)}{FOR_SOME}"
LINES = (".jsonl", ".ndjson")  # one problem, or one result, in each line


class Format(Protocol):
    """Interface of a format's module. Errors do not name the file; the caller adds its
    name. content : what `parse(content: bytes)` of the module returns, which is called
    once for each file; the bytes of the file if there is no such function. number : the
    conversion of the numbers in a text, if it is not rounding to double precision.
    exact : what the numbers represent, as in `Exact`."""

    def fields(self, content: Any, number: Number = float, /) -> dict[str, Any]:
        """Return the fields in the file, as `lcpcli.files.fields` takes them; M alone
        if there is no q."""

    def values(self, field: str, content: Any, number: Number = float, /) -> Any:
        """Return the numbers of a file with a single field, or those of `field`: a list
        or an array."""

    def render(self, fields: Mapping[str, Any], exact: Exact, /) -> dict[str, bytes]:
        """Return the files to write: the file itself under "", others under what is
        inserted before its suffix."""

    def remarks(self, problem: Any, /) -> list[str]:
        """Return what had to be changed in a problem in order to write it; a format has
        this if only problems of one formulation are written in it."""

    def without_rounded(self, content: Any, /) -> Any:
        """Return the content without the numbers that may be rounded to 0; a format has
        this if it has keys for such numbers."""


class ModelFormat(Format, Protocol):
    """Interface of the module of a format whose problems may be nonlinear, or may have
    an objective. Its function `parse(content: bytes, path: str)` also takes the name of
    the file, as files with names may accompany it."""

    def nonlinear(self, content: Any, name: str, /) -> NonlinearProblem | None:
        """Return the problem with this name; None if it is linear, which `fields`
        has."""

    def objective(self, content: Any, /) -> Objective | None:
        """Return the objective of a linear problem; None if there is none."""

    def solution(self, content: Any, other: bytes, /) -> list[Fraction]:
        """Return z in the content of a file with a solution of this problem."""


@cache
def load(module_name: str) -> Format:
    for suffix, row in formulations.FILES.items():
        if FORMATS[suffix].form == module_name:
            module = row.files[suffix].module
            return cast(Format, formulations.module_of(row, module, suffix))
    return cast(
        Format,
        import_module(
            module_name if "." in module_name else f"lcpcli.files.{module_name}"
        ),
    )


def package_of(module_name: str) -> str:
    """Return the other package that has a format; "" for one of this package."""
    package = module_name.partition(".")[0] if "." in module_name else ""
    return "" if package == "lcpcli" else package


def kind_with(suffix: str) -> Kind | None:
    """Return the kind of the files with a suffix, in this package or in another one;
    None if there is none."""
    if suffix and suffix not in FORMATS:
        from lcpcli.additions import addition

        if kind := addition("formats", suffix):
            if not isinstance(kind, Kind) or "." not in kind.form:
                reason = (
                    f"{suffix} of another package is not a Kind whose module has "
                    "its full name"
                )
                raise ProblemError("", reason, "see lcp help development")
            FORMATS[suffix] = kind
    return FORMATS.get(suffix)


def kind_by_name(path: str) -> Kind | None:
    """Return the kind of the files with the suffix of a file; None if there is none."""
    return kind_with(os.path.splitext(uncompressed(path))[1].casefold())


def is_model(path: str) -> bool:
    kind = kind_by_name(path)
    return kind is not None and kind.is_model


def again(path: str) -> str:
    """Return the hint for an empty file, if its suffix shows what it should hold; else
    an empty text."""
    kind = kind_by_name(path)
    if kind is None or not (kind.of or kind.has_arrays):
        return ""
    if not kind.of:
        return "save its arrays again"
    word = "model" if kind.is_model else formulations.row_of(kind.of).word
    return f"write the {word} again"


def has_lines(path: str) -> bool:
    """Return whether a file has a problem, or a result, in each line, by its name."""
    return path.casefold().endswith(LINES)


ZIP, GZIP = b"PK\x03\x04", b"\x1f\x8b"
COMPRESSIBLE = tuple(ending.removesuffix(".gz") for ending in COMPRESSED)
# The five numbers with which a MAT file of version 4 begins, in either order of bytes:
# no text is like them.
MAT_4 = (
    rb"(?s)[\0-\x34]\0{3}.{8}[\0\1]\0{3}.{2}\0{2}|\0{2}[\3\4].{9}\0{3}[\0\1]\0{2}.{2}"
)
AS_ARRAYS = "save M and q with numpy.savez"
SPREADSHEET = ("is a spreadsheet", "save it as CSV")
PACKED = ("is compressed", "uncompress it first")
PICKLE = ("is a pickle, which may run any code when it is read", AS_ARRAYS)
SCRIPT = (
    "is a script or a model, which lcp does not run",
    "have it save M and q as .mat, .npz or .csv",
)
# Fault, hint, suffixes and beginnings of files.
FOREIGN: tuple[tuple[str, str, str, tuple[bytes, ...]], ...] = (
    (*SPREADSHEET, ".xlsx .xlsm .xls .ods .numbers", (b"\xd0\xcf\x11\xe0",)),
    (
        "is a MATLAB file of version 7.3",
        "save it with -v7: save('p.mat', 'M', 'q', '-v7')",
        "",
        (b"MATLAB 7.3",),
    ),
    ("is HDF5", f"{AS_ARRAYS}, or in MATLAB with -v7", ".h5 .hdf5", (b"\x89HDF",)),
    (
        *PICKLE,
        ".pkl .pickle .joblib",
        (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"),
    ),
    (
        "is a binary table",
        "save it as CSV",
        ".parquet .feather .dta .sav .rds .rdata",
        (b"PAR1", b"ARROW1"),
    ),
    (
        *PACKED,
        ".zip .gz .bz2 .xz .7z .tar .tgz .zst",
        (GZIP, b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"\x28\xb5\x2f\xfd"),
    ),
    (
        "is HTML or XML",
        "was a web page saved instead?",
        "",
        (b"<!DOCTYPE", b"<!doctype", b"<html", b"<?xml"),
    ),
    (
        "is a document",
        "copy M and q into a CSV file",
        ".pdf .docx .doc .tex",
        (b"%PDF",),
    ),
    (
        "is a document of Gambit's graphical interface",
        "save the game there as .efg or .nfg",
        ".gbt",
        (),
    ),
    (*SCRIPT, ".m .py .ipynb .jl .r .mod .gms", ()),
)

# Bytes of a file that show whether it is a result, whose pattern spans at most 1000 and
# comments before.
HEAD = 4096
RESULT = re.compile(  # of this program, in JSON or CSV
    rb'\s*(?:\[\s*)?\{"version": "|\s*(?:\[\s*)?\{"problem": .{0,999}?, "n": \d+, '
    rb'"(?:kind|bounds)": |\{\s*"suite": \[|'
    rb"(?:#[^\n]*\n)*(?:(?:problem,(?:method,)?)?component,z,w\b|"
    rb"piece,kind,number,component|equilibrium,player,strategy|problem,method,k,)"
)
RENDERED = rb"\blcp \d+\.\d[^\n]{0,30}, (?:tol \$?\d|in exact arithmetic)"
AS_TABLE = (
    "is a result of lcp as a table, which it does not read",
    "write it with -o to a .json or .csv file",
)


def kind_in(path: str, content: bytes) -> Kind:
    """Return the kind of a file; raise ProblemError for an unreadable one. With other
    suffixes, and with .csv, a text that opens with a brace or a bracket is JSON,
    everything else CSV."""
    ending = os.path.splitext(uncompressed(path))[1].casefold()
    if content.startswith(ZIP) and ending != ".npz":
        is_spreadsheet = b"xl/" in content or b"opendocument.spreadsheet" in content
        refuse(b".npy" not in content, "", *(SPREADSHEET if is_spreadsheet else PACKED))
        return NPZ_FILE
    if not (content.startswith(GZIP) and ending in COMPRESSIBLE):
        foreign = (
            advice
            for *advice, _, beginnings in FOREIGN
            if content.startswith(beginnings)
        )
        reason, hint = next(foreign, ("", ""))
        refuse(reason, "", reason, hint)
    begun = (
        kind
        for kind in FORMATS.values()
        if kind.beginning and content.startswith(kind.beginning)
    )
    kind = next(begun, None) or kind_with(ending)
    if kind is None and re.match(MAT_4, content):
        return MAT_FILE
    if kind is None:
        by_suffix = next(
            (advice for *advice, suffixes, _ in FOREIGN if ending in suffixes.split()),
            ("", ""),
        )
        reason, hint = AS_TABLE if re.search(RENDERED, content) else by_suffix
        refuse(reason, "", reason, hint)
    if kind is None:
        alike = (
            candidate
            for candidate in FORMATS.values()
            if candidate.pattern and re.match(candidate.pattern, content)
        )
        kind = next(alike, None)
    if kind is None or kind is CSV_FILE:
        return JSON_FILE if content.lstrip()[:1] in (b"{", b"[") else CSV_FILE
    return kind


def is_result(content: bytes) -> bool:
    return RESULT.match(content[:HEAD]) is not None


def uncompressed(path: str) -> str:
    return path[:-3] if path.casefold().endswith(COMPRESSED) else path


def refuse(is_wrong: Any, where: Where, reason: str, hint: str) -> None:
    if is_wrong:
        raise ProblemError(where, reason, hint)
