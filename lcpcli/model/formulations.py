"""The table of formulations, each imported when a file or a call needs it.

A row says what has to be known before: the keys by which an object in a file is
recognized as one, and the suffixes of its special formats. The folder may be missing;
what needs it is then refused in one line. Other packages add rows by entry points of
the group lcpcli.formulations. numpy is not loaded, so that shell completion responds at
once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cache, lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.clock import imports
from lcpcli.errors import LEAVE_OUT, LCPError, MissingFolderError

if TYPE_CHECKING:
    from lcpcli.model.formulation import Formulation

TEXTS = ("name", "source", "note")  # keys of any problem, and of what it is made from
INSTALL = "install the package again, with all of its files"


class FileForm(NamedTuple):
    """A format of files that only this formulation has.

    module : in its folder, a `files.formats.Format`. beginning : what such a file
    begins with, by which it is recognized whatever its suffix; b"" if there is no such
    text. pattern
    : the same as a regular expression, for a suffix that is unknown. beside : as in
    `files.formats.Kind`.
    is_written : whether problems are also written, in decimals of any number of digits.
    """

    module: str
    beginning: bytes = b""
    beside: tuple[str, ...] = ()
    pattern: bytes = b""
    is_written: bool = False


class OfTables(NamedTuple):
    """An option of the command line by which files are tables of this formulation.

    meaning : the text of help. module : a module in its folder, in which `input_of`
    returns the input in files with these names, and `hint`, if it has one, a line on
    two files that may be such tables.
    """

    option: str
    meaning: str
    module: str
    hints: bool = False


class Row(NamedTuple):
    """A formulation before it is imported.

    home : its folder, as a package, or the module of another package that has all of
        it.
    location : the module in this folder and the name of its `Formulation` in it, as
        "module:name"; the name alone if it is in home. "" if its problems are plain
        ones, and only their files are special.
    noun : what a file of it is, in messages.
    tells : texts with keys that show that an object in a file is one: where all keys of
        one of these texts are there, and none of those with ! before them.
    texts : keys whose values have no numbers. others : further keys.
    files : its special formats, by suffix.
    words : words of the command line, each with the module whose function `run` is then
        called with the first word and the words behind it, and returns the exit code.
    matrices : the keys whose values may be sparse matrices.
    page : its page of help.
    unrounded : the noun for its numbers, if JSON keeps those that are no shortest
        decimals of floating-point numbers as fractions.
    meant : keys that are understood as attempts at its keys, or texts with several keys
        that together are, and what to write instead.
    parts : keys of a proposed solution in parts.
    bounds : the hint for bounds of z, if it cannot have them; "" if it can.
    tables : the option for files that are tables.
    """

    home: str
    location: str
    noun: str
    tells: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()
    files: Mapping[str, FileForm] = {}
    others: tuple[str, ...] = ()
    words: Mapping[str, str] = {}
    matrices: tuple[str, ...] = ()
    page: str = "development"
    unrounded: str = ""
    meant: tuple[tuple[str, ...], str] = ((), "")
    parts: tuple[str, ...] = ()
    bounds: str = ""
    tables: OfTables | None = None

    @property
    def word(self) -> str:
        """Return the noun without its article."""
        return self.noun.partition(" ")[2]

    def told_by(self, keys: frozenset[str]) -> int:
        """Return by how many of these keys it is known; 0 if it is not."""
        numbers = (
            len(required) + len(excluded)
            for required, excluded in _conditions(self.tells)
            if required <= keys and excluded.isdisjoint(keys)
        )
        return max(numbers, default=0)


@cache
def _conditions(
    tells: tuple[str, ...],
) -> list[tuple[frozenset[str], frozenset[str]]]:
    """Return the keys that are required, and those that are excluded, for each text of
    `Row.tells`."""
    conditions = []
    for keys in map(str.split, tells):
        excluded = frozenset(key[1:] for key in keys if key[0] == "!")
        required = frozenset(key for key in keys if key[0] != "!")
        conditions.append((required, excluded))
    return conditions


MPS = FileForm(
    "mps_format",
    pattern=rb"(?mi)(?:\*[^\n]*\n|[^\S\n]*\n)*(?:NAME|ROWS|OBJSENSE)\b[^;,{\n]*\r?\n"
    rb"(?s:.){0,1000}?^[^\S\n]*N[^\S\n]+\S",
    is_written=True,
)
# None of the keys of programs, and of rows and right-hand sides.
OF_NO_PROGRAM = (
    "!b !q !Q !c !P !G !h !row_lower !row_upper !H !Aeq !beq !A_eq !b_eq !A_ub !b_ub"
)
# The formulations, by their words in files under the key kind of origin.
TABLE = {
    "qp": Row(
        "lcpcli.formulations.quadratic_program",
        "program:Program",
        "a program",
        (
            "Q",
            "c",
            "P",
            "G",
            "h",
            "row_lower",
            "row_upper",
            "H",
            "Aeq",
            "beq",
            "A_eq",
            "b_eq",
            "A_ub",
            "b_ub",
            "A q b",
            "A q l",
            "A q u",
        ),
        files={".mps": MPS, ".qps": MPS, ".lp": FileForm("lp_format")},
        others=(
            "rows",
            "lower",
            "upper",
            "free",
            "columns",
            "sense",
            "constant",
            "lb",
            "ub",
            "f",
            *TEXTS,
        ),
        matrices=("Q", "P", "A", "G"),
        page="programs",
    ),
    "game": Row(
        "lcpcli.formulations.bimatrix_game",
        "game:Game",
        "a game",
        (f"A {OF_NO_PROGRAM}", f"B {OF_NO_PROGRAM}"),
        ("rows", "columns", "players", "sense"),
        {".nfg": FileForm("nfg_format", b"NFG ")},
        others=TEXTS,
        matrices=("A", "B"),
        page="games",
        unrounded="payoff",
        meant=(
            ("payoff", "payoffs", "payoff_matrix", "payoff_matrices", "players"),
            "payoffs of two players as A and B; those by pairs of players need the key "
            "players too",
        ),
        parts=("row", "column"),
        bounds=LEAVE_OUT,
        tables=OfTables(
            "--game",
            "The two files are tables of the payoffs A and B of a game.",
            "tables",
            hints=True,
        ),
    ),
    "nl": Row(
        "lcpcli.formulations.nonlinear_model",
        "",
        "a model",
        files={".nl": FileForm("nl_format", beside=(".sol", ".row", ".col"))},
        words={"-AMPL": "ampl"},
        page="models",
    ),
    "contact": Row(
        "lcpcli.formulations.contact",
        "friction:Contact",
        "contact with friction",
        ("findex", "W !Q !P !c"),
        others=(
            "b",
            "lo",
            "hi",
            "q",
            "mu",
            "dimension",
            "facets",
            "restitution",
            "before",
        ),
        matrices=("A", "W"),
        page="contact",
    ),
    "efg": Row(
        "lcpcli.formulations.game_tree",
        "game:ExtensiveGame",
        "a game",
        ("efg",),
        ("efg",),
        {".efg": FileForm("efg_format", b"EFG ")},
        page="games",
    ),
    "avi": Row(
        "lcpcli.formulations.variational_inequality",
        "inequality:Inequality",
        "a variational inequality",
        ("H h !f !q",),
        matrices=("H",),
        page="equilibria",
    ),
    "lsq": Row(
        "lcpcli.formulations.least_squares",
        "fit:LeastSquares",
        "a least-squares problem",
        ("A b lsq",),
        others=("lower", "upper", "E", "d", "columns"),
        matrices=("A", "E"),
        page="fits",
        meant=(
            ("A b",),
            "key lsq, true, for a fit, findex for contact, or M and q in their place",
        ),
        tables=OfTables(
            "--lsq",
            "They are tables of A and b of a fit, min |Ax - b|; bounds are those of x.",
            "tables",
        ),
    ),
    "players": Row(
        "lcpcli.formulations.players",
        "quadratic:Players",
        "a game of players",
        ("sizes H c",),
        ("owner", "shared"),
        others=("owner", "shared"),
        matrices=("H", "A"),
        page="equilibria",
    ),
    "polymatrix": Row(
        "lcpcli.formulations.players",
        "polymatrix:Polymatrix",
        "a polymatrix game",
        ("payoffs players !A !B !q",),
        ("payoffs", "actions"),
        others=("actions",),
    ),
}


def row_of(kind: str) -> Row:
    """Return the row of a kind that is known, or raise LCPError."""
    if kind not in TABLE:
        with imports:
            from lcpcli import additions
        row = additions.addition("formulations", kind)
        if not isinstance(row, Row):
            reason = "of another package is no Row of lcpcli.model.formulations"
            raise LCPError(kind, reason, "see lcp help development")
        TABLE[kind] = row
    return TABLE[kind]


def told_by(keys: Collection[str]) -> str:
    """Return the kind of the formulation that has these keys in a file, the one that is
    recognized by the largest number of them; "" if there is none, as for a problem that
    consists of M and q."""
    if "M" in keys:
        return ""
    names = frozenset(keys)
    return _told_among(tuple(TABLE), names) or _told_among(_others(), names)


# The cache is for the many lines of a file, which have the same keys.
@lru_cache(maxsize=64)
def _told_among(kinds: tuple[str, ...], keys: frozenset[str]) -> str:
    told = {kind: row_of(kind).told_by(keys) for kind in kinds}
    best = max(told.values(), default=0)
    return next((kind for kind, number in told.items() if best and number == best), "")


FILES = {suffix: row for row in TABLE.values() for suffix in row.files}
WORDS = {word: row for row in TABLE.values() for word in row.words}
# The kinds of objects under the key origin.
ORIGINS = [kind for kind, row in TABLE.items() if row.location]
WORDED = {key for row in TABLE.values() for key in row.texts}
# All keys by which a formulation is recognized, and the other ones.
_LISTS_OF_KEYS = [keys for row in TABLE.values() for keys in (*row.tells, *row.others)]
KEYS = WORDED | {key for key in " ".join(_LISTS_OF_KEYS).split() if key[0] != "!"}
MATRICES = tuple(dict.fromkeys(key for row in TABLE.values() for key in row.matrices))
PARTS = [row.parts for row in TABLE.values() if row.parts]


def kinds() -> Iterator[str]:
    """Yield the kinds in the table, then those of other packages."""
    yield from [*TABLE]
    yield from _others()


def _others() -> tuple[str, ...]:
    return tuple(sorted(_added() - TABLE.keys()))


def _added() -> frozenset[str]:
    with imports:
        from lcpcli import additions
    return additions.names("formulations")


def is_known(kind: str) -> bool:
    return kind in ORIGINS or kind in _added()


def load(kind: str) -> type[Formulation]:
    """Return the formulation of a kind, or raise MissingFolderError."""
    row = row_of(kind)
    module, _, name = row.location.rpartition(":")
    loaded = module_of(row, module, row.noun)
    formulation: type[Formulation] = getattr(loaded, name)
    return formulation


def module_of(row: Row, module: str, asked: str) -> Any:
    """Return a module in the home of a formulation, or home itself for "". asked : what
    needs it, in the message if the formulation is not installed."""
    return module_at(f"{row.home}.{module}" if module else row.home, asked)


@cache
def module_at(module_name: str, asked: str) -> Any:
    """Return a module of a formulation; raise MissingFolderError if its folder is
    missing. asked : as for `module_of`."""
    try:
        with imports:
            return import_module(module_name)
    except ModuleNotFoundError as error:
        if not (error.name and f"{module_name}.".startswith(f"{error.name}.")):
            raise
        folder = error.name.replace(".", "/")
        reason = (
            f"this installation has no formulation for {asked}, as the folder {folder} "
            "is missing"
        )
        raise MissingFolderError("", reason, INSTALL) from None
