"""Linear and quadratic programs in MPS, fixed and free, with QUADOBJ, QSECTION or
QMATRIX; others are read as LP files, which HiGHS converts to MPS: files with warnings
are refused, and numbers have up to 15 digits.

What programs interpret differently is refused: an entry or a bound that occurs twice,
and a negative upper bound without a lower bound, which some take to mean no lower
bound. Bounds, right-hand sides and ranges of 1e20 or more are infinite. Programs are
written as free MPS: QUADOBJ has one triangle of Q, and the right-hand side of the
objective is minus its constant.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lcpcli.errors import (
    CUT_OFF,
    GIVE_NUMBER,
    KEEP_ONE,
    ONE_VARIABLE,
    ProblemError,
    count,
    missing,
    quoted,
    visible,
)
from lcpcli.files.fields import LARGEST_DENSE
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.files.json_format import number_text
from lcpcli.linalg.matrices import largest_asymmetry
from lcpcli.linalg.programs import solver
from lcpcli.model.block_form import symmetrized
from lcpcli.model.box import NO_BOUND
from lcpcli.model.formulation import unnamed
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import (
    Doubles,
    fraction,
    in_decimals,
    rounded,
    shortest_decimal,
)
from lcpcli.typing import Matrix, Vector

# Tells it from the LP format.
OTHER_NAME = "give each row another name"
MPS = re.compile(rb"^(?:ROWS|ENDATA)\b", re.MULTILINE | re.IGNORECASE)
END = re.compile(rb"^ENDATA\b", re.MULTILINE | re.IGNORECASE)
NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
INFINITE = re.compile(r"[-+]?inf(?:inity)?", re.IGNORECASE)
SENSES = {"MIN": "min", "MINIMIZE": "min", "MAX": "max", "MAXIMIZE": "max"}
SECTIONS = (
    "ROWS",
    "COLUMNS",
    "RHS",
    "RANGES",
    "BOUNDS",
    "QUADOBJ",
    "QSECTION",
    "QMATRIX",
)
QUADRATIC = SECTIONS[-3:]
# Headings that may be followed by words on the same line.
WITH_WORDS = ("NAME", "OBJSENSE", "QCMATRIX", "QSECTION", "CSECTION")
HEADING = (
    f"the sections are {', '.join(SECTIONS)}, ENDATA; quadratic constraints and "
    "ordered sets are not read"
)
LINE = "is the heading of the next section misspelt, or the first word of the line?"
CONTINUOUS = "lcp solves programs with continuous variables only"
# Which of the two bounds each kind of bound sets.
ENDS = {"LO": (0,), "UP": (1,), "FX": (0, 1), "MI": (0,), "PL": (1,), "FR": (0, 1)}
NOT_CONTINUOUS = {
    "BV": "an integer",
    "LI": "an integer",
    "UI": "an integer",
    "SC": "a semicontinuous",
}
NOT_NONE = (
    "has a bound of 1e20 or more, which means no bound, where one is needed",
    "give a smaller one",
)
# The columns that the words of a line occupy in fixed format.
FIXED = ((1, 3), (4, 12), (14, 22), (24, 36), (39, 47), (49, 61))


def fields(
    content: bytes,
    number: Number = float,
    expected: str = "in MPS or in the LP format",
) -> dict[str, Any]:
    """expected : the formats that an error names if the content has neither."""
    if not MPS.search(content):
        try:
            return fields(as_mps(content, expected), number)
        except ProblemError as error:  # in a line of another text file
            raise ProblemError("", error.fault, error.hint) from None
    refuse(not END.search(content), "", "has no ENDATA", CUT_OFF)
    return _Reader(number).program(content.decode("utf-8", "replace"))


class _Reader:
    """The parts of a program that have been read, by the names of rows and columns."""

    def __init__(self, number: Number) -> None:
        self._number, self._is_integer = number, False
        self._line = 0
        self._section = ""
        self._name = ""
        self._sense = "min"
        self._kinds: dict[str, str] = {}
        self._columns: dict[str, dict[str, float]] = {}
        self._sides: dict[str, dict[str, str]] = {"RHS": {}, "RANGES": {}}
        # By column and kind of bound, as in ENDS.
        self._bounds: dict[tuple[str, int], float] = {}
        self._lines: dict[str, int] = {}  # the line of the last bound of each column
        self._curvature: dict[tuple[str, str], float] = {}
        # The columns with an entry on the diagonal of Q, which need none in COLUMNS.
        self._squared: set[str] = set()

    def program(self, text: str) -> dict[str, Any]:
        readers = {
            "OBJSENSE": self._read_sense,
            "ROWS": self._read_row,
            "COLUMNS": self._read_column,
        }
        readers |= {
            "RHS": self._read_sides,
            "RANGES": self._read_sides,
            "BOUNDS": self._read_bound,
        }
        readers |= dict.fromkeys(QUADRATIC, self._read_curvature)
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        self._squared = _squared(lines)
        for self._line, line in enumerate(lines, 1):
            words = line.split()
            if "$" in line:
                words = self._without_remark(words)
            if not words or line.startswith("*"):
                continue
            is_sense = self._section == "OBJSENSE" and words[0].upper() in SENSES
            if (
                not line[0].isspace()
                and not is_sense
                and (len(words) == 1 or words[0].upper() in WITH_WORDS)
            ):
                words = self._begin_section(words, readers)
                if self._section == "ENDATA":
                    break
            if words and self._section != "NAME":
                read = readers.get(self._section, self._refuse)
                try:
                    read(words)
                except ProblemError:
                    # Names in fixed format may have spaces.
                    with suppress(ProblemError):
                        read(_fixed(line))
                        continue
                    raise
        return self._fields()

    def _without_remark(self, words: list[str]) -> list[str]:
        """Return the words of a line up to a remark, which begins with "$" and is not
        the name of a row or a column."""
        for index, word in enumerate(words[2:], 2):
            names = (self._kinds, self._columns)
            if word.startswith("$") and not any(word in each for each in names):
                return words[:index]
        return words

    def _begin_section(self, words: list[str], sections: Collection[str]) -> list[str]:
        """Begin the section with this heading; return the words of the heading's line
        that belong to its content."""
        self._section, words = words[0].upper(), words[1:]
        if self._section == "NAME":
            self._name = "".join(words[:1])
        elif self._section not in sections and self._section != "ENDATA":
            raise self._error(f"has the heading {quoted(self._section)}", HEADING)
        elif self._section == "QSECTION":
            reason = f"has a quadratic part of row {quoted(' '.join(words[:1]))}"
            is_objective = words[:1] in ([], [self._objective()])
            self._require(is_objective, reason, "only an objective may have one")
            return []
        return words

    def _require(self, is_right: bool, reason: str, hint: str) -> None:
        if not is_right:
            raise self._error(reason, hint)

    def _error(self, reason: str, hint: str) -> ProblemError:
        return ProblemError(f"line {self._line}", reason, hint)

    def _refuse(self, words: Sequence[str]) -> None:
        where = f" in {self._section}" if self._section else ""
        raise self._error(f"has {quoted(' '.join(words))}{where}", LINE)

    def _read_sense(self, words: Sequence[str]) -> None:
        reason = f"has {quoted(' '.join(words))} as the sense of the objective"
        self._require(" ".join(words).upper() in SENSES, reason, "give MIN or MAX")
        self._sense = SENSES[" ".join(words).upper()]

    def _read_row(self, words: Sequence[str]) -> None:
        self._require(
            len(words) < 3, "has a name with spaces", "write it without, as with _"
        )
        if len(words) < 2 or words[0].upper() not in ("N", "L", "G", "E"):
            self._refuse(words)
        if words[1] in self._kinds:
            raise self._error(f"declares {quoted(words[1])} a second time", OTHER_NAME)
        self._kinds[words[1]] = words[0].upper()

    def _read_column(self, words: Sequence[str]) -> None:
        if words[1:2] == ["'MARKER'"]:
            self._is_integer = words[2:] == ["'INTORG'"]
            return
        name, pairs = words[0], self._pairs(words[1:], self._kinds, "ROWS")
        if name not in self._columns:
            self._require(
                not self._is_integer,
                f"makes {quoted(name)} an integer variable",
                CONTINUOUS,
            )
            self._columns[name] = {}
        for row, value in pairs:
            if row in self._columns[name]:
                raise self._error(
                    f"gives {quoted(name)} a second entry in {quoted(row)}", KEEP_ONE
                )
            self._columns[name][row] = self._number(value)

    def _read_sides(self, words: Sequence[str]) -> None:
        sides = self._sides[self._section]
        for row, value in self._pairs(words[len(words) % 2 :], self._kinds, "ROWS"):
            self._require(
                row not in sides, f"has {quoted(row)} a second time", KEEP_ONE
            )
            is_ranged = self._section != "RANGES" or self._kinds[row] != "N"
            self._require(
                is_ranged,
                f"gives a range to {quoted(row)}",
                "only rows L, G and E have one",
            )
            sides[row] = value

    def _read_bound(self, words: Sequence[str]) -> None:
        kind, *others = words
        is_known = kind in ENDS or kind in NOT_CONTINUOUS
        self._require(
            is_known,
            f"has a bound of the type {quoted(kind)}",
            "use UP, LO, FX, FR, MI or PL",
        )
        has_number = kind in ("LO", "UP", "FX")
        if not has_number <= len(others) - 1 < 3:
            self._refuse(words)
        column = others[-2] if has_number else others[min(1, len(others) - 1)]
        self._declare(column)
        reason = f"makes {quoted(column)} {NOT_CONTINUOUS.get(kind)} variable"
        self._require(kind not in NOT_CONTINUOUS, reason, CONTINUOUS)
        value = others[-1] if has_number else ""
        self._require_number(value or "0", bool(INFINITE.fullmatch(value)))
        for side in ENDS[kind]:
            self._require(
                (column, side) not in self._bounds,
                f"has {quoted(column)} a second time",
                KEEP_ONE,
            )
            self._bounds[column, side] = (
                self._end(self._number(value)) if value else (-math.inf, math.inf)[side]
            )
            self._lines[column] = self._line

    def _declare(self, column: str) -> None:
        """Raise ProblemError for a column that is unknown, unless Q has a diagonal
        entry for it: some writers leave out columns without other entries.
        """
        if column not in self._columns:
            if column not in self._squared:
                raise self._unknown(column, "COLUMNS")
            self._columns[column] = {}

    def _read_curvature(self, words: Sequence[str]) -> None:
        for name in (
            words[0],
            *(name for name in words[1::2] if name in self._squared),
        ):
            self._declare(name)
        for name, value in self._pairs(words[1:], self._columns, "COLUMNS"):
            if (words[0], name) in self._curvature:
                raise self._error(
                    f"gives {quoted(words[0])} a second entry in {quoted(name)}",
                    KEEP_ONE,
                )
            both = [(words[0], name), (name, words[0])][
                : 1 if self._section == "QMATRIX" else 2
            ]
            self._curvature |= dict.fromkeys(both, self._number(value))

    def _pairs(
        self, words: Sequence[str], valid_names: Collection[str], where: str
    ) -> list[tuple[str, str]]:
        if not words or len(words) % 2:
            self._refuse(words)
        pairs = list(zip(words[::2], words[1::2], strict=True))
        for name, value in pairs:
            if name not in valid_names:
                raise self._unknown(name, where)
            if not NUMBER.fullmatch(value):
                self._require_number(value)
        return pairs

    def _unknown(self, name: str, where: str) -> ProblemError:
        return self._error(
            f"names {quoted(name)}, which is not in {where}",
            "correct it, or declare it there",
        )

    def _require_number(self, text: str, is_infinite: bool = False) -> None:
        if not (is_infinite or NUMBER.fullmatch(text)):
            raise self._error(f"has {quoted(text)} instead of a number", GIVE_NUMBER)

    def _objective(self) -> str:
        return next((row for row, kind in self._kinds.items() if kind == "N"), "")

    def _fields(self) -> dict[str, Any]:
        objective = self._objective()
        refuse(
            not objective, "", "has no objective, which is a row N", "add it to ROWS"
        )
        refuse(
            not self._columns,
            "",
            "has no columns",
            ONE_VARIABLE,
        )
        columns = list(self._columns)
        rows = [row for row, kind in self._kinds.items() if kind != "N"]
        is_dense = len(columns) + len(rows) <= LARGEST_DENSE
        constant = self._sides["RHS"].get(objective)
        fields: dict[str, Any] = {
            "name": self._name,
            "sense": self._sense,
            "rows": rows,
            "columns": columns,
        }
        fields["constant"] = 0.0 if constant is None else -self._number(constant)
        fields["c"] = np.array(
            [
                column_entries.get(objective, 0.0)
                for column_entries in self._columns.values()
            ]
        )
        fields["lower"], fields["upper"] = np.array(
            [self._bounds_of(column) for column in columns]
        ).T
        if rows:
            entries = {
                (row, name): value
                for name, column_entries in self._columns.items()
                for row, value in column_entries.items()
            }
            fields["A"] = _matrix(entries, rows, columns, is_dense)
            fields["row_lower"], fields["row_upper"] = np.array(
                [self._sides_of(row) for row in rows]
            ).T
        if any(self._curvature.values()):
            fields["Q"] = _matrix(self._curvature, columns, columns, is_dense)
            if symmetrized(fields["Q"]) is None:
                _, i, j = largest_asymmetry(fields["Q"])
                reason = (
                    "has a QMATRIX that is not symmetric at "
                    f"{quoted(columns[i])} and {quoted(columns[j])}"
                )
                hint = "give both entries, or one of them in QUADOBJ"
                raise ProblemError("", reason, hint)
        return fields

    def _bounds_of(self, column: str) -> tuple[float, float]:
        low = self._bounds.get((column, 0), 0.0)
        high = self._bounds.get((column, 1), math.inf)
        self._line = self._lines.get(column, 0)
        self._require(low < math.inf and high > -math.inf, *NOT_NONE)
        if low > high:
            reason = (
                f"gives {quoted(column)} the upper bound {high:g}, below its lower "
                f"bound {low:g}"
            )
            hint = (
                "make the lower bound the smaller one"
                if low
                else "give a lower bound too: LO, or MI for none"
            )
            raise self._error(reason, hint)
        return low, high

    def _sides_of(self, row: str) -> tuple[float, float]:
        """Return the lower and the upper bound of a row. A range is added in exact
        arithmetic, before rounding.
        """
        kind = self._kinds[row]
        side, width = (
            fraction(self._sides[section].get(row, "0"))
            for section in ("RHS", "RANGES")
        )
        sides: dict[str, tuple[Any, Any]]
        sides = {"G": (side, math.inf), "L": (-math.inf, side), "E": (side, side)}
        if row in self._sides["RANGES"] and abs(width) < NO_BOUND:
            sides = {"G": (side, side + abs(width)), "L": (side - abs(width), side)}
        if row in self._sides["RANGES"] and kind == "E":
            kind = "G" if width > 0 else "L"
        low, high = map(self._end, sides[kind])
        refuse(low == math.inf or high == -math.inf, f"row {row}", *NOT_NONE)
        return low, high

    def _end(self, value: Any) -> float:
        if isinstance(value, Fraction):
            value = (
                self._number.of(value)
                if isinstance(self._number, Doubles)
                else float(rounded([value])[0])
            )
        return value if abs(value) < NO_BOUND else math.copysign(math.inf, value)


def _squared(lines: Sequence[str]) -> set[str]:
    names, is_quadratic = set[str](), False
    for line in lines:
        words = line.split()
        if words and not line[0].isspace() and not line.startswith("*"):
            is_quadratic = words[0].upper() in QUADRATIC
        elif is_quadratic and len(words) > 2 and words[0] in words[1::2]:
            names.add(words[0])
    return names


def _fixed(line: str) -> list[str]:
    at = [0, *(position for each in FIXED for position in each), None]
    between = (line[begin:stop] for begin, stop in zip(at[::2], at[1::2], strict=True))
    refuse(any(map(str.strip, between)), "", "is not in fixed format", LINE)
    return [word for begin, stop in FIXED if (word := line[begin:stop].strip())]


def _matrix(
    entries: Mapping[tuple[str, str], float],
    rows: Sequence[str],
    columns: Sequence[str],
    is_dense: bool,
) -> Matrix:
    from scipy.sparse import csr_array

    i, j = (
        {name: index for index, name in enumerate(names)} for names in (rows, columns)
    )
    entries_of_matrix = [
        (value, i[row], j[column])
        for (row, column), value in entries.items()
        if row in i and value
    ]
    values, *positions = (
        zip(*entries_of_matrix, strict=True) if entries_of_matrix else ((), (), ())
    )
    matrix = csr_array(
        (np.array(values, np.float64), tuple(positions)),
        shape=(len(rows), len(columns)),
    )
    matrix.sort_indices()
    return matrix.toarray() if is_dense else matrix


WORDS = (
    "NAME",
    "ROWS",
    "COLUMNS",
    "RHS",
    "RANGES",
    "BOUNDS",
    "QUADOBJ",
    "QMATRIX",
    "OBJSENSE",
    "MAX",
    "MIN",
    "ENDATA",
)


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:
    """Return the program in free MPS. Raises ProblemError if a finite bound would be
    read as infinite.
    """
    number = partial(number_text, exact, exactly=in_decimals)
    k, m = fields["c"].size, fields["row_lower"].size if "A" in fields else 0
    low = fields.get("lower", np.zeros(k))
    high = fields.get("upper", np.full(k, np.inf))
    row_bounds = (
        fields.get("row_lower", np.zeros(0)),
        fields.get("row_upper", np.zeros(0)),
    )
    _refuse_lost_bounds(
        lower=low, upper=high, row_lower=row_bounds[0], row_upper=row_bounds[1]
    )
    columns = names(fields.get("columns", unnamed(k)), "x")
    rows = names(fields.get("rows", unnamed(m)), "r")
    objective = _free("obj", rows)
    lines = [f"NAME {_word(fields.get('name', ''))}".rstrip()]
    if "sense" in fields:
        lines += ["OBJSENSE", "    MAX"]
    pairs = zip(*(bound.tolist() for bound in row_bounds), strict=True)
    sides = [_side(exact, *pair) for pair in pairs]
    kinds = (f" {kind} {row}" for row, (kind, *_) in zip(rows, sides, strict=True))
    lines += ["ROWS", f" N {objective}", *kinds]
    lines += ["COLUMNS", *_columns(fields, columns, rows, objective, number)]
    lines.append("RHS")
    if "constant" in fields:
        lines.append(f" RHS {objective} {number(-fields['constant'])}")
    ranges = []
    for row, (_, side, size) in zip(rows, sides, strict=True):
        if side:
            lines.append(f" RHS {row} {number(side)}")
        if size:
            ranges.append(f" RNG {row} {size}")
    lines += ["RANGES", *ranges] if ranges else []
    intervals = zip(columns, low.tolist(), high.tolist(), strict=True)
    bounds = [line for each in intervals for line in _bounds(number, *each)]
    lines += ["BOUNDS", *bounds] if bounds else []
    if "Q" in fields:
        lines += ["QUADOBJ", *_triangle(fields["Q"], columns, number)]
    return {"": "\n".join([*lines, "ENDATA", ""]).encode()}


def _refuse_lost_bounds(**bounds: Vector) -> None:
    for field, values in bounds.items():
        is_lost = ((np.abs(values) >= NO_BOUND) & np.isfinite(values)).any()
        reason = f"has a bound of {NO_BOUND:g} or more, which means no bound in MPS"
        hint = "give --infinity 1e20 if it means that here too, or write .json"
        refuse(is_lost, field, reason, hint)


def _triangle(
    Q: Matrix, columns: Sequence[str], number: Callable[[float], str]
) -> Iterator[str]:
    """Yield the lines for the upper triangle of Q."""
    from scipy.sparse import coo_array

    upper = coo_array(Q)
    positions = zip(upper.row.tolist(), upper.col.tolist(), strict=True)
    for (i, j), value in zip(positions, upper.data.tolist(), strict=True):
        if i <= j and value:
            yield f" {columns[j]} {columns[i]} {number(value)}"


def remarks(problem: Problem) -> list[str]:
    changed = new_names(problem)
    if not changed:
        return []
    old, new = next(iter(changed.items()))
    needed = "as MPS needs unique names without spaces or control characters"
    others = ", and so on" if len(changed) > 1 else ""
    return [
        f"{count(len(changed), 'name')} had to be changed, {needed}: {quoted(old)} is "
        f"{quoted(new)}{others}"
    ]


def new_names(problem: Problem) -> dict[str, str]:
    old_names = (
        (getattr(problem.origin, key), letter)
        for key, letter in (("columns", "x"), ("rows", "r"))
    )
    both = (
        pair
        for names_of_kind, letter in old_names
        for pair in zip(names_of_kind, names(names_of_kind, letter), strict=True)
    )
    named = [(problem.name, _word(problem.name)), *both]
    return {name: other for name, other in named if name and name != other}


def names(old_names: Sequence[str], letter: str) -> list[str]:
    """Return names without spaces, which are all different and no keyword of the
    format. A missing name becomes the letter with its number.
    """
    free_names: dict[str, None] = {}
    for i, name in enumerate(old_names, 1):
        free_names[_free(_word(name) or f"{letter}{i}", WORDS, free_names)] = None
    return list(free_names)


def _word(name: str) -> str:
    return visible("_".join(name.split()))


def _free(name: str, *others: Any) -> str:
    while any(name in some for some in others):
        name += "_"
    return name


def _side(exact: Exact, low: float, high: float) -> tuple[str, float, str]:
    """Return the kind of a row, its right-hand side, and its range, which is "" if it
    has none.
    """
    if low == high:
        return "E", low, ""
    if math.isinf(low) and math.isinf(high):
        # A row without bounds gets a bound that every reader takes for infinite.
        return "G", -1e30, ""
    if math.isinf(low):
        return "L", high, ""
    if math.isinf(high):
        return "G", low, ""
    bounds = [
        exact[bound] if bound in exact else shortest_decimal(bound)
        for bound in (low, high)
    ]
    kind, side = ("L", high) if abs(low) >= abs(high) else ("G", low)
    return kind, side, in_decimals(bounds[1] - bounds[0])


def _bounds(
    number: Callable[[float], str], name: str, low: float, high: float
) -> Iterator[str]:
    if low == high or (low == -math.inf and high == math.inf):
        yield f" FX BND {name} {number(low)}" if low == high else f" FR BND {name}"
        return
    if low:
        yield f" MI BND {name}" if low == -math.inf else f" LO BND {name} {number(low)}"
    if high < math.inf:
        yield f" UP BND {name} {number(high)}"


def _columns(
    fields: Mapping[str, Any],
    columns: list[str],
    rows: list[str],
    objective: str,
    number: Callable[[float], str],
) -> Iterator[str]:
    from scipy.sparse import csc_array

    A = csc_array(fields["A"] if rows else (0, len(columns)))
    entries = zip(
        np.split(A.indices, A.indptr[1:-1]),
        np.split(A.data, A.indptr[1:-1]),
        strict=True,
    )
    for name, cost, (positions, values) in zip(
        columns, fields["c"].tolist(), entries, strict=True
    ):
        if cost or not positions.size:
            yield f" {name} {objective} {number(cost)}"
        yield from (
            f" {name} {rows[i]} {number(value)}"
            for i, value in zip(positions, values.tolist(), strict=True)
        )


# Messages about errors that are reported elsewhere.
TOLD = ("inconsistent bounds", "Parser error")
HINT = "correct it there; quadratic constraints and integer variables are not read"


def as_mps(text: bytes, expected: str) -> bytes:
    try:
        import highspy
    except ModuleNotFoundError:
        reason, hint = missing("highspy")
        reason = f"is in the LP format, which {reason}"
        raise ProblemError("", reason, hint) from None
    # By default, bounds of 1e20 or more would be read as infinite.
    options = {"log_to_console": False, "infinite_bound": math.inf}
    highs, events = solver(highspy, options), list[str]()
    highs.cbLogging.subscribe(lambda event: events.append(event.message))
    with tempfile.TemporaryDirectory() as folder:
        source_file, made = (
            Path(folder) / name for name in ("program.lp", "program.mps")
        )
        # HiGHS returns names as text, which other bytes are not.
        source_file.write_bytes(text.decode("utf-8", "replace").encode())
        try:
            status = highs.readModel(str(source_file))
        except UnicodeDecodeError:  # a message that quotes bytes that are no text
            status = highspy.HighsStatus.kError
        for line in events:
            if line.startswith(("WARNING", "ERROR")) and not any(
                words in line for words in TOLD
            ):
                first, _, rest = line.partition(":")[2].strip().partition("\n")
                # line and column after the name of the file, which follow since version
                # 1.16 of HiGHS
                location = re.search(r":(\d+):\d+$", rest, re.MULTILINE)
                where = "" if location is None else f"line {location[1]}: "
                raise ProblemError(
                    "", f"cannot be read ({where}{' '.join(first.split())})", HINT
                )
        if status == highspy.HighsStatus.kError or not highs.getNumCol():
            raise ProblemError("", f"is not a program {expected}", "is it complete?")
        # HiGHS writes invented names for all rows if two have the same one.
        names = Counter(filter(None, highs.getLp().row_names_))
        repeated = [name for name, times in names.items() if times > 1]
        if repeated:
            reason = f"declares {quoted(repeated[0])} a second time"
            raise ProblemError("", reason, OTHER_NAME)
        highs.writeModel(str(made))
        # Without the name, which is that of the temporary file.
        return made.read_bytes().partition(b"\n")[2]
