"""Linear and quadratic programs in MPS (fixed and free, with QUADOBJ or QMATRIX) and in the LP format, read by HiGHS;
MPS is written without HiGHS.

Whatever HiGHS warns of, or repairs silently, is refused: a malformed number, a column or an entry given twice, and a
negative upper bound without a lower bound, which some programs take for an infinite lower bound. Bounds, right-hand
sides and ranges of 1e20 or more are infinite. Reading needs highspy.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, quoted
from lcpcli.files.contents import unpacked
from lcpcli.files.formats import Number
from lcpcli.files.mps_lines import (
    MPS,
    NUMBER,
    as_written,
    line_of,
    lines,
    range_sides,
    refuse_misread,
    spaced_row,
    unknown_row,
)
from lcpcli.files.mps_lines import render as render
from lcpcli.model.box import NO_BOUND
from lcpcli.rational.numbers import Doubles
from lcpcli.typing import Matrix

Interval = tuple[float, float]

PACKAGE = "highspy"
HINT = "pip install 'linear-complementarity[mps]'"
IGNORED = ("inconsistent bounds", "Parser error", "switching to fixed format")  # complaints: harmless, or reported here
LARGEST_DENSE = 200  # unknowns up to which matrices are kept dense: 320 kB each, for which dense arithmetic is faster
NAME = re.compile(rb"^NAME[ \t]+(\S+)", re.MULTILINE)


def fields(content: bytes, number: Number = float) -> dict[str, Any]:
    """Return the program in a file, under the native keys. number : converts the numbers in MPS; a `Doubles` gives each
    number a double of its own."""
    text = unpacked(content)
    if not MPS.search(text):
        return _fields(_read(text, ".lp"), text, {}, is_mps=False)
    refuse_misread(text)
    sides = {row: (_double(low, number), _double(high, number)) for row, (low, high) in range_sides(text).items()}
    return _fields(_read(text if number is float else as_written(text, number), ".mps"), text, sides, is_mps=True)


def _read(text: bytes, ending: str) -> Any:
    """Return HiGHS with the program; raise ProblemError for the first complaint of HiGHS."""
    try:
        import highspy
    except ModuleNotFoundError:
        raise ProblemError("", f"is read by {PACKAGE}, which is not installed", HINT) from None
    highs = highspy.Highs()
    highs.setOptionValue("log_to_console", False)
    highs.setOptionValue("infinite_bound", NO_BOUND)
    events: list[str] = []
    highs.cbLogging.subscribe(lambda event: events.append(event.message))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"program{ending}"
        file.write_bytes(text)
        try:
            status = highs.readModel(str(file))
        except UnicodeDecodeError:  # a complaint that quotes what is no text
            status = highspy.HighsStatus.kError
    complaints = [" ".join(line.partition(":")[2].split()) for line in events if line.startswith(("WARNING", "ERROR"))]
    complaints = [line for line in complaints if not any(words in line for words in IGNORED)]
    is_error = status == highspy.HighsStatus.kError
    if (complaints or is_error) and ending == ".mps" and (place := spaced_row(text)):
        raise ProblemError(place, "has a name with spaces", "write it without, as with _")
    if complaints and ending == ".mps" and (unknown := unknown_row(text)):
        place = line_of(text, f'"{unknown}"')
        raise ProblemError(place, f"names {quoted(unknown)}, which is not in ROWS", "correct it, or declare it there")
    if complaints:
        raise fault_of(text, complaints[0])
    if is_error:
        raise ProblemError("", "is not a program in MPS or in the LP format", "is it complete?")
    return highs


def _fields(highs: Any, text: bytes, ranges: Mapping[str, Interval], is_mps: bool) -> dict[str, Any]:
    from scipy.sparse import csc_array, csr_array, diags_array

    model = highs.getModel()
    lp, hessian = model.lp_, model.hessian_
    k, names = lp.num_col_, list(lp.col_names_)
    if not k:
        raise ProblemError("", "has no columns", "give a program with at least one variable")
    _refuse_integers(lp, names, text)
    low, high = np.array(lp.col_lower_), np.array(lp.col_upper_)
    by_columns = lp.a_matrix_.format_.name == "kColwise"
    A = csr_array(_matrix(csc_array if by_columns else csr_array, lp.a_matrix_, (lp.num_row_, k)))
    Q = None
    if hessian.dim_:  # its lower triangle
        triangle = _matrix(csc_array, hessian, (k, k))
        Q = (triangle + triangle.T - diags_array(triangle.diagonal())).tocsr()
    if is_mps:
        _refuse_undeclared(lp, A, names, text)
    for j in np.flatnonzero(low > high)[:1]:
        place = line_of(text, f'"{names[j]}" in BOUNDS section')
        fault = f"gives {quoted(names[j])} the upper bound {high[j]:g}, below its lower bound {low[j]:g}"
        hint = "make the lower bound the smaller one" if low[j] else "give a lower bound too: LO, or MI for none"
        raise ProblemError(place, fault, hint)
    ends = np.array([lp.row_lower_, lp.row_upper_])
    places = {name: i for i, name in enumerate(lp.row_names_)} if ranges else {}
    for row in ranges.keys() & places.keys():  # which HiGHS rounds twice, and takes for finite beyond NO_BOUND
        ends[:, places[row]] = ranges[row]
    if k + lp.num_row_ <= LARGEST_DENSE:
        A, Q = A.toarray(), None if Q is None else Q.toarray()
    found = {} if Q is None else {"Q": Q}
    found |= {"c": np.array(lp.col_cost_), "lower": low, "upper": high, "columns": names, "rows": list(lp.row_names_)}
    found |= {"A": A, "row_lower": ends[0], "row_upper": ends[1]} if lp.num_row_ else {}
    name = NAME.search(text)
    found["name"] = name[1].decode("utf-8", "replace") if name else ""
    return found | {"sense": "max" if "Max" in lp.sense_.name else "min", "constant": lp.offset_}


def _double(side: Fraction | float, number: Number) -> float:
    """Return a side of a row as a double, infinite if it is at least NO_BOUND."""
    double = side if isinstance(side, float) else number.of(side) if isinstance(number, Doubles) else float(side)
    return double if abs(double) < NO_BOUND else math.copysign(math.inf, double)


def _matrix(form: Any, matrix: Any, shape: tuple[int, int]) -> Any:
    """Return a matrix of HiGHS in a sparse form of scipy."""
    return form((np.array(matrix.value_), np.array(matrix.index_, np.intc), np.array(matrix.start_, np.intc)), shape)


def _refuse_integers(lp: Any, names: list[str], text: bytes) -> None:
    for name, kind in zip(names, lp.integrality_, strict=False):
        if kind.name != "kContinuous":
            what = "an integer" if kind.name == "kInteger" else "a semicontinuous"
            hint = "lcp solves programs with continuous variables only"
            raise ProblemError(line_of(text, f'"{name}"'), f"makes {quoted(name)} {what} variable", hint)


def _refuse_undeclared(lp: Any, A: Matrix, names: list[str], text: bytes) -> None:
    """Refuse a column that only BOUNDS name: HiGHS adds it to the program."""
    used = (np.array(lp.col_cost_) != 0) | (np.bincount(A.indices, minlength=len(names)) > 0)
    if used.all():
        return
    declared = {line.split(None, 1)[0] for _, section, line in lines(text) if section == b"COLUMNS" and line.strip()}
    unknown = next((names[j] for j in np.flatnonzero(~used) if names[j].encode() not in declared), "")
    if unknown:
        hint = "correct the name, or declare it there"
        raise ProblemError(line_of(text, f'"{unknown}"'), f"names {quoted(unknown)}, which is not in COLUMNS", hint)


SMALLEST_ENTRY, LARGEST_ENTRY = 1e-9, 1e15  # in absolute value: HiGHS drops smaller entries and refuses larger ones
NOT_OF_SIZE = "not of a size between 1e-9 and 1e15"
IN_ROWS, IN_COLUMNS = "ROWS section", "COLUMNS section"
LINEAR = "lcp solves programs with linear constraints and continuous variables only"
# A complaint, what is wrong with the names that it quotes, how to fix it, and the section if the complaint has none.
COMPLAINTS = (
    (r'of type "(\S+)"', "has a bound of the type {}", "use UP, LO, FX, FR, MI or PL", ""),
    (r'Row name "(.*)" in \w+ section is not defined', "names {}, which is not in ROWS", "declare it there", ""),
    (r'Row name "(.*)" in RANGES section is not valid', "gives a range to {}", "only rows L, G and E have one", ""),
    (r'"(.*)" in \w+ section has duplicate', "has {} a second time", "keep one", ""),
    (r'Column "(.*)" has duplicate nonzero \S+ in row "(.*)"', "gives {} a second entry in {}", "keep one", IN_COLUMNS),
    (r'Variables .* same name "(.*)"', "has {} again", "put all entries of a column together", IN_COLUMNS),
    (r'constraints .* same name "(.*)"', "declares {} a second time", "give each row a name of its own", IN_ROWS),
    (
        r"(?:Row|Col) \S+ has (?:lower|upper) bound of",
        "has a bound of 1e20 or more, which means no bound, where one is needed",
        "give a smaller one",
        "",
    ),
    (r"No objective", "has no objective, which is a row N", "add it to ROWS", ""),
    (r"Quadratic (?:rows|constraints)", "has quadratic constraints", LINEAR, ""),
    (r"SOS", "has special ordered sets", LINEAR, ""),
    (r"not symmetric", "has a QMATRIX that is not symmetric", "give both entries, or one of them in QUADOBJ", ""),
)
SECTIONS = (b"ROWS", b"COLUMNS", b"RHS", b"RANGES", b"BOUNDS", b"QUADOBJ", b"QMATRIX", b"ENDATA", b"NAME", b"OBJSENSE")
UNIDENTIFIED = re.compile(r'Entry "(.*)" in (\w+) section')


def fault_of(text: bytes, complaint: str) -> ProblemError:
    """Return the error for a complaint of HiGHS about a program."""
    if "|value|" in complaint:
        for number, _, line in lines(text):
            for word in line.split()[1:]:
                if re.fullmatch(NUMBER, word) and float(word) and not SMALLEST_ENTRY < abs(float(word)) < LARGEST_ENTRY:
                    hint = "change the units of its row or its column, or write the program as .json"
                    return ProblemError(f"line {number}", f"has the entry {quoted(word.decode())}, {NOT_OF_SIZE}", hint)
        return ProblemError("", f"has an entry {NOT_OF_SIZE}", "change the units")
    if match := UNIDENTIFIED.search(complaint):
        entry = match[1].encode().split()
        places = [f"line {number}" for number, _, line in lines(text) if line.split() == entry]
        hint = "is the heading of the next section misspelt, or the first word of the line?"
        return ProblemError("".join(places[:1]), f"has {quoted(match[1])} in {match[2]}", hint)
    for pattern, wrong, hint, section in COMPLAINTS:
        if match := re.search(pattern, complaint):
            place = line_of(text, f"{complaint} in {section}" if section else complaint)
            return ProblemError(place, wrong.format(*map(quoted, match.groups())), hint)
    for number, heading, line in lines(text):
        if line[:1].isalpha() and heading not in SECTIONS and MPS.search(text):
            fault = f"has the heading {quoted(heading.decode('utf-8', 'replace'))}"
            hint = f"the sections are {', '.join(map(bytes.decode, SECTIONS[:8]))}"
            return ProblemError(f"line {number}", fault, hint)
    about = [quoted(name) for name in re.findall(r'"([^"]+)"', complaint)]
    because = f" because of {', '.join(about)}" if about else ""
    return ProblemError(line_of(text, complaint), f"cannot be read{because}", "compare it with a file that is read")
