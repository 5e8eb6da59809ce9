"""Bounds, starting points, bases and solutions in addition to a problem, as numbers or
words, or in files. Numbers may be typed instead of a file name: 1,0,15/29 or "1 0 2.5"
or "[1, 0]".

A proposed solution, a z to be verified or a Farkas vector, with all digits, is a result
in JSON or CSV as `lcp solve` writes it, a list in JSON, or a row, a column or a table
of numbers; the output of `lcp solve --all` has several. For a game, the solution may
consist of strategies, in JSON under row and column. Besides decimals, fractions like
15/29 are read, in JSON as strings. If a result has exact vectors, these are read.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import chain, repeat
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from lcpcli.errors import (
    EMPTY_ENTRY,
    IS_EMPTY,
    IS_MISSING,
    MAKE_AGREE,
    ParameterError,
    ProblemError,
    count,
    kind,
    listed,
    quoted,
)
from lcpcli.files.contents import STANDARD_INPUT, decode, source_name, within
from lcpcli.files.csv_format import Table, is_number
from lcpcli.files.fields import BOUNDS
from lcpcli.files.formats import refuse
from lcpcli.files.input_file import InputFile, Names
from lcpcli.files.json_format import load as load_json
from lcpcli.files.json_format import numbers_in, objects_in
from lcpcli.model import formulations
from lcpcli.model.arrays import FROM_0, as_vector
from lcpcli.model.box import WORDS, Box, in_words
from lcpcli.model.problem import Problem
from lcpcli.model.words import basis_of_words
from lcpcli.rational.exact_problem import Bounds, ExactProblem, fractions_of, number_of
from lcpcli.rational.numbers import (
    KEEP_DIGITS,
    Doubles,
    double_unless_lost,
    fraction,
    ratio,
    rounded,
)
from lcpcli.typing import Vector

NUMBER = r"(?:[-+.eE/]*\d[-+\d.eE/]*|[-+]?inf|nan)"
PARTING = r"(?:\s*[,;]\s*|\s+)"
LIST = re.compile(rf"\s*(?:\[\s*)?{NUMBER}(?:{PARTING}{NUMBER})*\s*(?:\]\s*)?")
STATES_HINT = (
    "give a JSON list of lower, basic and upper, or a result of lcp solve in JSON "
    "or CSV"
)
# Reason and hint for bounds of a problem that cannot have other ones.
REFUSALS = {
    kind: (row.noun, row.bounds)
    for kind, row in formulations.TABLE.items()
    if row.bounds
}


def with_bounds(
    problem: Problem,
    option_values: Mapping[str, Any],
    files: dict[str, InputFile] | None = None,
    doubles: Doubles | None = None,
    keeps_digits: bool = False,
) -> Problem:
    """Return the problem with other bounds, lower and upper; a bound that is None is
    not changed. Known solutions are dropped if bounds change. A bound is a number, inf,
    -inf or none, a list of these, or the name of a file with such a list; a bound of
    size infinity or more is infinite. files : the files of bounds that have been read,
    by name, to which this call adds those that it reads. doubles : the conversion of
    numbers as written, if it is not rounding to double precision. keeps_digits :
    whether the caller reads exact bounds too, so that a bound that is 0 in double
    precision alone is not lost."""
    read = {} if files is None else files
    number = float if doubles is None else doubles.of
    texts = {
        name: option_values[name] for name in BOUNDS if option_values[name] is not None
    }
    values = {
        name: _values(name, text, read, number, lambda: problem.names)
        for name, text in texts.items()
    }
    if doubles is None and not keeps_digits:
        for name, text in texts.items():
            _refuse_lost(name, text, read)
    kind, hint = problem.formulation.kind, problem.formulation.hint_for_bounds
    if values and (hint or kind in REFUSALS):
        what = formulations.row_of(kind).noun if hint else REFUSALS[kind][0]
        hint = hint or REFUSALS[kind][1]
        raise ProblemError(
            f"--{next(iter(values))}",
            f"is for problems defined by M and q, but this is {what}",
            hint,
        )
    if values and problem.origin is not None:
        values = dict(problem.origin.bounds(problem, values))
    try:
        problem = (
            replace(problem, solutions=(), verdict="", **values) if values else problem
        )
    except ProblemError as error:
        named_bound = next(
            (name for name in values if error.where.startswith(name)), ""
        )
        name = named_bound or next(iter(values))
        if not _is_typed(f"--{name}", texts[name]):
            raise error.inside((f"--{name}", source_name(texts[name]))) from None
        before = "--" if named_bound else f"--{name}: "
        raise ProblemError(f"{before}{error.where}", error.fault, error.hint) from None
    if option_values["infinity"] is None:
        return problem
    from lcpcli.model.changes import with_infinity

    return within("--infinity", with_infinity, problem, option_values["infinity"])


def with_exact_bounds(
    data: ExactProblem,
    problem: Problem,
    option_values: Mapping[str, Any],
    files: dict[str, InputFile],
) -> ExactProblem:
    """Return the exact data of the problem that `with_bounds` returned, with the bounds
    as written."""
    # The sides of its rows may be in M and q.
    if problem.origin is not None and problem is not data.problem:
        return (data.of_floats if data.are_floats() else data.of_decimals)(problem)
    for name in BOUNDS:
        bounds: Bounds = getattr(data, name)
        if option_values[name] is not None:
            values = _values(
                name, option_values[name], files, Fraction, lambda: problem.names
            )
            if not isinstance(values, list):
                values = repeat(values, data.n)
            bounds = [
                None if value in (None, math.inf, -math.inf) else number_of(value)
                for value in values
            ]
        rounded_bounds = np.broadcast_to(getattr(problem, name), data.n)
        setattr(
            data,
            name,
            [
                value if math.isfinite(rounded_bound) else None
                for value, rounded_bound in zip(bounds, rounded_bounds, strict=True)
            ],
        )
    return data


def _values(
    name: str,
    text: str,
    files: dict[str, InputFile],
    number: Callable[[Fraction], Any],
    names: Names,
) -> Any:
    """Return the value of a bound, or the list of values; None means no bound. files :
    the files that have been read. number : converts a number."""
    if _is_typed(f"--{name}", text):
        texts = re.split(PARTING, text.strip().strip("[]").strip())
        values = [
            None
            if entry.casefold() in ("none", "null")
            else _bound(name, entry, number)
            for entry in texts
        ]
        return values[0] if len(values) == 1 else values
    if text != STANDARD_INPUT and not os.path.exists(text):
        hint = "write -1,none,0.5 or name a file"
        raise ParameterError(
            name, f"{quoted(text)} is neither a file nor numbers", hint
        )

    if text not in files:
        hint = "give a number, none, or one number for each unknown"
        files[text] = InputFile.read(text, hint)
    file = files[text]
    file.require_order(names, name)
    as_written = partial(_bound, name, number=number)
    contents = file.values(f"--{name}", float if number is float else as_written)
    is_array = number is not float and isinstance(contents, np.ndarray)
    return contents.tolist() if is_array else contents


def _refuse_lost(name: str, text: str, files: Mapping[str, InputFile]) -> None:
    """Raise ProblemError if a bound is 0 in double precision without being 0."""
    if text in files:
        files[text].refuse_underflow(f"--{name}")
        return
    for number in re.findall(NUMBER, text.casefold()):
        within(f"--{name}", double_unless_lost, number, KEEP_DIGITS)


def _is_typed(field: str, text: str) -> bool:
    if os.path.exists(text):
        return False
    words = re.sub("none|null|infinity", "inf", text.casefold())
    return typed_numbers(field, words) is not None


def _bound(name: str, text: str, number: Callable[[Fraction], Any]) -> Any:
    try:
        is_infinite = "inf" in text.casefold() or text.casefold() == "nan"
        return float(text) if is_infinite else number(within(f"--{name}", ratio, text))
    except OverflowError:
        raise ProblemError(
            f"--{name}",
            f"has {text}",
            "give a finite number in double precision, or none",
        ) from None


def typed_numbers(field: str, text: str, may_be_file: bool = True) -> list[str] | None:
    """Return the numbers in a text, each as typed; None if the text is not a list of
    numbers or may name a file. Raise ProblemError if a number is missing before or
    behind a comma. field : the location of the error, by default the text."""
    if may_be_file and os.path.lexists(text):
        return None
    if LIST.fullmatch(text):
        return re.findall(NUMBER, text)
    entries = re.split("[,;]", text.strip().strip("[]"))
    others = [entry for entry in entries if entry.strip()]
    if 0 < len(others) < len(entries) and all(map(LIST.fullmatch, others)):
        raise ProblemError(field or text, *EMPTY_ENTRY)
    return None


def typed_vector(field: str, typed: list[str], n: int) -> Vector:
    return as_vector(field, rounded(_entries(field, typed)), n)


def read_start(
    field: str, path: str, n: int, box: Box | None = None, names: Names = tuple
) -> Vector:
    """Return a starting point of length n from typed numbers or from a file. The file
    has the vector itself, or results of `lcp solve -o`; then the starting point is the
    final iterate of the first result: x for the bounds in `box`, or z."""
    if (numbers := typed_numbers(field, path)) is not None:
        return typed_vector(field, numbers, n)
    file = InputFile.read(path)
    is_object = re.match(rb"\s*(\[\s*)?\{", file.content)
    if not (file.kind.has_results and (file.kind.is_table or is_object)):
        return file.vector(field, n, names=names)
    file.require_order(names)
    z, w = file.within(_result_in, file, n, field)
    return z if box is None or w is None else box.x_of(z, w)


def read_candidates(
    path: str, lengths: Mapping[int, str], problem: Sought, names: Names = tuple
) -> list[Candidate]:
    """Return the proposed solutions in typed numbers or in a file: a result, all
    solutions, or a vector in any format.

    lengths : what a vector is, by its length: z and, for a program, x and y, or x.
    problem : the problem whose result is chosen from several. names : of the unknowns,
    by which the rows of a table may be labelled.
    """
    if (numbers := typed_numbers("", path)) is not None:
        file = InputFile(path, " ".join(numbers).encode())
    else:
        file = InputFile.read(path)
    if not file.kind.has_results:
        candidates = [Candidate("solution", fractions_of(file.vector("z")))]
    elif not file.kind.is_table:
        return file.within(of_json, file.content, lengths, problem)
    else:
        file.require_order(names)
        in_table = file.within(of_table, file.within(file.data.grid, False))
        candidates = [each._replace(w=None) for each in in_table]
    for each in candidates:
        if not each.parts:
            file.within(of_length, "z", each.values, lengths)
    return candidates


def read_states(text: str, problem: Problem) -> list[str]:
    """Return the basis, a word for each variable, from typed words or from a file; it
    has to be one of the problem."""
    is_file, typed_words = os.path.exists(text), text.replace(",", " ").split()
    if not is_file and not set(typed_words) & set(WORDS.values()):
        reason = f"{quoted(text)} is neither a file nor a basis"
        raise ParameterError("basis", reason, "write lower,basic,upper or name a file")
    basis = typed_words
    if is_file:
        file = InputFile.read(text, STATES_HINT)
        basis = file.within(_states_in, file, problem)
    try:
        basis_of_words(problem, basis)
    except ProblemError as error:
        if is_file:
            raise error.inside(("--basis", source_name(text))) from None
        raise ProblemError(f"--{error.where}", error.fault, error.hint) from None
    return basis


@np.errstate(all="ignore")
def _states_in(file: InputFile, problem: Problem) -> list[str]:
    """Return the basis in a file: its list, the list in a result, or else the basis of
    z and w in a result."""
    refuse(not file.kind.has_results, "", "has no basis", STATES_HINT)
    if not file.kind.is_table:
        data = _first_in(file.content)
        basis: Any = data.get("basis") if isinstance(data, dict) else data
        if isinstance(basis, list):
            return basis
        is_result = basis is None and isinstance(data, dict) and {"z", "w"} <= set(data)
        refuse(
            not is_result,
            "basis",
            IS_MISSING if basis is None else f"is {kind(basis)}",
            STATES_HINT,
        )
    z, w = _result_in(file, problem.n)
    refuse(w is None, "", "has no column headed w", STATES_HINT)
    return in_words(problem.box.basis_at(z, cast(Vector, w)))


def _result_in(
    file: InputFile, n: int, field: str = ""
) -> tuple[Vector, Vector | None]:
    """Return z and w of a result, the first of several; w may be None in CSV. field :
    the one that messages name, before z or w, or alone if they name no other place."""
    try:
        return _vectors_in(file, n, f"{field}: " * bool(field))
    except ProblemError as error:
        raise error.inside(field) if field and not error.where else error from None


def _vectors_in(file: InputFile, n: int, before: str) -> tuple[Vector, Vector | None]:
    if file.kind.is_table:
        first = of_table(file.data.grid(False))[0]
        refuse(first.parts, "", "has no column headed z", HINT)
        both = [
            None if values is None else rounded(values)
            for values in (first.values, first.w)
        ]
    else:
        data = _first_in(file.content)
        refuse(
            not {"z", "w"} <= set(data),
            "",
            "is an object without z and w",
            EXPECTED_RESULT,
        )
        both = [numbers_in(data["z"]), numbers_in(data["w"])]
    z, w = (
        None if vector is None else as_vector(f"{before}{key}", vector, n)
        for key, vector in zip("zw", both, strict=True)
    )
    return cast(Vector, z), w


def _first_in(content: bytes) -> Any:
    """Return the content of a JSON text: of several objects, one per line, that of the
    first problem."""
    text = decode(content)
    several = objects_in(text)
    are_objects = all(part.lstrip().startswith("{") for part in several[:2])
    return load_json(first_of(several) if several and are_objects else text)


EXPECTED_RESULT = "give a list of numbers, or what lcp solve --format json prints"
# The columns of a table of all solutions.
VERTEX = {"piece", "kind", "number", "component", "z"}
# The columns of a table of all equilibria.
STRATEGY = {"equilibrium", "player", "strategy", "probability"}
HINT = "give one row or one column, a table with a column headed z, or a result in JSON"

Lengths = Mapping[int, str]  # what a vector may be, by its length
Rows = list[tuple[int, dict[str, str]]]  # the number of a line, and its cells by column


class Candidate(NamedTuple):
    """A proposed solution or proof of infeasibility, to be verified.

    kind : "solution" for a z, strategies of a game one after the other, or another
        vector, identified by its length; "answer" for x, or x and y, in the sense of
        the program; "farkas" for a y that should prove that there is none.
    """

    kind: Literal["solution", "answer", "farkas"]
    values: list[Fraction]  # the entries, with all digits
    exact: bool = False  # whether the values come from exact arithmetic, unrounded
    # w, where the file has it next to z; with values that are not exact, only in CSV.
    w: list[Fraction] | None = None
    # What the result claims, which the vector cannot verify; "" if it claims nothing.
    claim: str = ""
    # The values by the names of their parts, where the file has these separately.
    parts: Mapping[str, list[Fraction]] = {}
    # Which of several results this is, if another one may have been meant.
    remark: str = ""


Sought = tuple[str, str]  # the file and the name of the problem whose result is sought


def record_of(text: str, problem: Sought) -> tuple[str, str]:
    """Return one of several results, in lines or in a list: the result of the problem,
    which is recognized by its file, by the name of its file, or by its name. If no
    result matches, return `first_of` them, with a remark. Raise ProblemError if several
    match, or if none in a log does. Return any other text unchanged, without a
    remark."""
    lines = objects_in(text)
    if len(lines) == 1:
        return lines[0], ""
    if not lines or not all(line.lstrip().startswith("{") for line in lines[:2]):
        return text, ""
    file, name = problem
    records = [_object(line) for line in lines]

    def likeness(record: Mapping[str, Any]) -> tuple[bool, ...]:
        record_file = str(record.get("file") or "")
        are_same = (
            do(record_file) == do(file) for do in (os.path.abspath, os.path.basename)
        )
        return *are_same, str(record.get("problem") or "") == name

    best = max(map(likeness, records))
    own_records = [
        line
        for line, record in zip(lines, records, strict=True)
        if likeness(record) == best
    ]
    if len(own_records) == 1:
        return own_records[0], ""
    if any(best) or all(
        record.get("file") and record.get("digest") for record in records
    ):
        reason = f"has {len(own_records) if any(best) else 'no'} results for {name}"
        raise ProblemError("", reason, "give the line of one as a separate file")
    first = first_of(lines)
    which = f"for {_object(first).get('problem') or 'a problem'}: none is for {name}"
    return first, f"the first of {len(lines)} results is checked, {which}"


def first_of(lines: Sequence[str]) -> str:
    """Return the result with the smallest number; without numbers the first one."""
    record_numbers = [_object(line).get("number") for line in lines]
    numbers = [
        number if isinstance(number, int) else at
        for at, number in enumerate(record_numbers, 1)
    ]
    return lines[numbers.index(min(numbers))]


def _object(line: str | bytes) -> dict[str, Any]:
    with suppress(ValueError, RecursionError):
        data = json.loads(line)
        return data if isinstance(data, dict) else {}
    return {}


def of_json(content: bytes, lengths: Lengths, problem: Sought) -> list[Candidate]:
    """Return the candidates in a JSON text: several if it is the output of lcp solve
    --all. lengths : the possible lengths of a candidate, n first. problem : the
    problem, whose result is taken of several."""
    text, remark = record_of(decode(content), problem)
    data = load_json(text, fraction)
    solutions = (
        data.get("solutions") if isinstance(data, dict) and "z" not in data else None
    )
    if isinstance(data, list) and data and all(isinstance(x, list) for x in data):
        pair = _pair(data, lengths)
        solutions = data if pair is None else solutions
        data = data if pair is None else pair
    if not isinstance(solutions, list):
        return [_candidate(data, lengths)._replace(remark=remark)]
    field = "solutions" if isinstance(data, dict) else ""
    refuse(not solutions, field, IS_EMPTY, "give a solution to check")
    entries = (
        (each.get("equilibrium") or each) if isinstance(each, dict) else each
        for each in solutions
    )
    return [
        within(f"{field}[{i}]", _candidate, each, lengths)
        for i, each in enumerate(entries)
    ]


def _pair(lists: list[list[Any]], lengths: Lengths) -> dict[str, list[Any]] | None:
    """Return the object for two lists that are the strategies of a game, or the x and y
    of a program, by their lengths; None for other lists, each of which is a
    solution."""
    n, *others = lengths
    sizes = [len(part) for part in lists]
    if len(sizes) != 2 or n in sizes:
        return None
    if sum(sizes) in lengths and "x" in lengths.values() and sizes[0] == others[-1]:
        return dict(zip("xy", lists, strict=True))
    if sum(sizes) != n or lengths[n] == "z":
        return None
    parts = next(keys for keys in formulations.PARTS if len(keys) == len(lists))
    return dict(zip(parts, lists, strict=True))


def _candidate(data: Any, lengths: Lengths) -> Candidate:
    n = next(iter(lengths))
    if isinstance(data, list):
        return Candidate("solution", _numbers("", data, lengths))
    refuse(not isinstance(data, dict), "", f"is {kind(data)}", EXPECTED_RESULT)
    parts = next((keys for keys in formulations.PARTS if {*keys} <= {*data}), None)
    if "z" not in data and parts:
        return _joined({key: _entries(key, data[key]) for key in parts})
    if "z" not in data and isinstance(sets := data.get("information_sets"), list):
        probabilities = [
            each.get("probabilities") if isinstance(each, dict) else each
            for each in sets
        ]
        values_of_sets = [
            x
            for i, each in enumerate(probabilities)
            for x in _entries(f"information_sets[{i}].probabilities", each)
        ]
        return Candidate(
            "solution", of_length("information_sets", values_of_sets, lengths)
        )
    answer, exact, certificate = (
        data[key] if isinstance(data.get(key), dict) else {}
        for key in ("answer", "exact", "certificate")
    )
    if "x" in lengths.values() and not (
        isinstance(data.get("z"), list) and len(data["z"]) == n
    ):
        both, k = [*lengths, *lengths][-2:]
        for at, part in (("", data), ("answer.", answer)):
            if part.get("x") is not None:
                sizes = {"x": k, "y": both - k}
                present_keys = (key for key in sizes if part.get(key) is not None)
                values = [
                    _numbers(f"{at}{key}", part[key], {sizes[key]: key})
                    for key in present_keys
                ]
                return Candidate("answer", [*chain.from_iterable(values)])
    refuse("z" not in data, "", "is an object without z", EXPECTED_RESULT)
    of_z = {n: "z"}
    y, z, w = (
        _numbers(f"exact.{key}", exact[key], of_z)
        if exact.get(key) is not None
        else None
        for key in "yzw"
    )
    if y or z:
        return Candidate(
            "farkas" if y else "solution", y or z or [], exact=True, w=None if y else w
        )
    if certificate.get("kind") == "farkas":
        return Candidate(
            "farkas", _numbers("certificate.vector", certificate.get("vector"), of_z)
        )
    claim = (
        "the result says that there is none, by exhaustion, which has no "
        "certificate to check; solve it again"
    )
    claim *= certificate.get("kind") == "exhaustion"
    return Candidate("solution", _numbers("z", data["z"], of_z), claim=claim)


def _numbers(field: str, values: Any, lengths: Lengths) -> list[Fraction]:
    return of_length(field or "z", _entries(field, values), lengths)


def _entries(field: str, values: Any) -> list[Fraction]:
    refuse(
        not isinstance(values, list),
        field,
        f"is {kind(values)}",
        "give a list of numbers",
    )
    for i, value in enumerate(values):
        if not isinstance(value, (Fraction, str)):
            hint = f"give a number, or a fraction as a string {FROM_0}"
            raise ProblemError(f"{field}[{i}]", f"is {kind(value)}", hint)
    return [
        within(f"{field}[{i}]", ratio, x) if isinstance(x, str) else x
        for i, x in enumerate(values)
    ]


def of_length(field: str, values: list[Fraction], lengths: Lengths) -> list[Fraction]:
    if len(values) in lengths:
        return values
    n, meaning = next(iter(lengths.items()))
    reason = (
        f"has {count(len(values), 'entry')} for "
        f"{meaning if meaning.endswith('strategies') else count(n, 'unknown')}"
    )
    refuse(len(lengths) == 1, field, reason, MAKE_AGREE)
    choices = (f"{size} for {what}" for size, what in sorted(lengths.items()))
    raise ProblemError(field, reason, f"give {listed(choices, 'or')}")


def of_table(grid: Table) -> list[Candidate]:
    header = [name.casefold() for name in grid.header]

    def text_of(cell: str) -> str:
        number = cell.strip().replace(",", ".", 1)
        return number if is_number(number) else cell.strip()

    lines = [
        (k, [*map(text_of if grid.commas else str.strip, row)]) for k, row in grid.lines
    ]
    width = len(lines[0][1])
    reason = f"has {count(len(header), 'name')} above {count(width, 'column')}"
    refuse(
        header and len(header) != width,
        f"line {grid.top}",
        reason,
        "give each column one name",
    )
    if width == 1 or (len(lines) == 1 and "z" not in header):
        values = list[Fraction]()
        for k, cells in lines:
            for j, cell in enumerate(cells, 1):
                if cell:
                    values.append(within(f"line {k}, column {j}", ratio, cell))
        return [Candidate("solution", values)]
    header = header or _columns([row for _, row in lines])
    rows = [(k, dict(zip(header, row, strict=True))) for k, row in lines]
    for columns, keys, made in (
        (STRATEGY, ("equilibrium",), _strategies),
        (VERTEX, ("piece", "number"), _solution),
    ):
        if columns <= set(header):
            groups: dict[tuple[str, ...], Rows] = {}
            for k, row in rows:
                if row.get("kind", "vertex") == "vertex":
                    groups.setdefault(tuple(row[name] for name in keys), []).append(
                        (k, row)
                    )
            refuse(not groups, "", "has no solution", "give a solution to check")
            return [made(group) for group in groups.values()]
    runs = [(row.get("problem"), row.get("method")) for _, row in rows]
    return [
        _solution([row for row, run in zip(rows, runs, strict=True) if run == runs[0]])
    ]


def _columns(rows: list[list[str]]) -> list[str]:
    width, first = len(rows[0]), [row[0] for row in rows]
    indexed = any(
        first == [*map(str, range(start, start + len(rows)))] for start in (0, 1)
    )
    if width in (2, 3) and (indexed or not any(map(is_number, first))):
        return ["index", "z", "w"][:width]
    raise ProblemError(
        "", f"has {len(rows)} rows and {width} columns without a header", HINT
    )


def _strategies(rows: Rows) -> Candidate:
    first, other = next(keys for keys in formulations.PARTS if len(keys) == 2)
    rows_of_players: dict[str, Rows] = {first: [], other: []}
    for each in rows:
        rows_of_players[first if each[1]["player"] == first else other].append(each)
    refuse(
        not all(rows_of_players.values()),
        "",
        "has an equilibrium with the strategy of one player alone",
        "give both strategies",
    )
    return _joined(
        {
            player: _column("probability", _in_order("strategy", part))
            for player, part in rows_of_players.items()
        }
    )


def _joined(parts: dict[str, list[Fraction]]) -> Candidate:
    return Candidate("solution", [*chain(*parts.values())], parts=parts)


def _solution(rows: Rows) -> Candidate:
    refuse("z" not in rows[0][1], "", "has no column headed z", HINT)
    rows = _in_order("component", rows) if "component" in rows[0][1] else rows
    return Candidate(
        "solution",
        _column("z", rows),
        w=_column("w", rows) if "w" in rows[0][1] else None,
    )


def _column(name: str, rows: Rows) -> list[Fraction]:
    j = [*rows[0][1]].index(name) + 1
    return [within(f"line {k}, column {j}", ratio, row[name]) for k, row in rows]


def _in_order(name: str, rows: Rows) -> Rows:
    """Return the rows in the order of their components, which are in the column `name`,
    each once."""
    row_of_component: dict[str, Any] = {str(i): None for i in range(1, len(rows) + 1)}
    components = {row[name] for _, row in rows}
    for k, row in rows:
        if row_of_component.get(component := row[name], "") is not None:
            missing = next(i for i in row_of_component if i not in components)
            again = " again" if component in row_of_component else ""
            reason = f"has component {component!r}{again}, while {missing} is missing"
            where = f"line {k}, column {[*row].index(name) + 1}"
            raise ProblemError(where, reason, f"give each of 1 to {len(rows)} once")
        row_of_component[component] = k, row
    return [*row_of_component.values()]
