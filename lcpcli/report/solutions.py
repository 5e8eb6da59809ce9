"""All solutions of a problem, or the best one by a linear objective, as a report, as
JSON and as CSV."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from itertools import chain, cycle, islice
from typing import Any, TypeAlias

from lcpcli.enumeration.meaning import Listing, Meaning, meaning_of
from lcpcli.enumeration.optimum import OPTIMAL, Optimum
from lcpcli.enumeration.pieces import Piece
from lcpcli.enumeration.search import SolutionSet
from lcpcli.errors import count
from lcpcli.files.contents import Source
from lcpcli.linalg.doubles import LARGEST_DOUBLE
from lcpcli.model.words import in_stated_sense
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate, brief, rounded, zeros
from lcpcli.report import plotting, wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.result_formats import (
    Report,
    keys_of,
    plain,
    record,
    source_record,
)
from lcpcli.report.tables import longest

HEADER: tuple[str, ...] = ("piece", "kind", "number", "component", "z", "w")
# rows; typesetting more takes longer than the search for the solutions.
MAX_LINES = 1000
MIN_LINES = 20  # however wide a table is
# Cells of a table; on a terminal each takes a tenth of a millisecond, and nobody reads
# more.
MAX_CELLS = 6000
VERTICES = "vertices"  # the attribute of a piece

Values: TypeAlias = Sequence[Fraction]
Cells: TypeAlias = tuple[Any, ...]
Listed: TypeAlias = tuple[Table, list[str]]  # and remarks


def solutions_report(
    search_result: SolutionSet | Optimum,
    source: Source,
    exact: bool,
    names: Sequence[str] = (),
) -> Report:
    """Return the report on a solution set, or on the best solution."""
    made: Callable[..., dict[str, Any]] = (
        _best_record if isinstance(search_result, Optimum) else _record
    )
    return Report(
        lambda format_name, _: build(search_result, exact, format_name, names),
        lambda: [made(search_result, source, exact)],
        lambda: _rows(search_result, exact, names),
    )


def build(
    search_result: SolutionSet | Optimum,
    exact: bool,
    format_name: str,
    names: Sequence[str] = (),
) -> Document:
    """Return the report on a solution set, or on the best solution, for a format.
    exact : whether numbers are fractions instead of seven digits. names : those of the
        unknowns that are shown, as for `wording.selected_components`."""
    cell: Callable[..., str] = brief if exact else approximate
    problem, figure = search_result.data.problem, None
    facts, remarks = list[str](), list[str]()
    if isinstance(search_result, Optimum):
        message = search_result.message(cell)
        is_complete = search_result.status == OPTIMAL
        facts, tables, remarks = _best(search_result, cell, longest(format_name), names)
    else:
        message, is_complete = search_result.message, search_result.complete
        selected = wording.selected_components(wording.labels_of(problem), names)
        special_listing = search_result.arranged.table(
            selected, longest(format_name), cell
        )
        table, remarks = _listed(
            special_listing
            or _pieces(search_result, cell, longest(format_name), selected)
        )
        tables = [table]
        figure = (
            partial(plotting.cones, search_result)
            if plotting.is_plane(problem)
            else None
        )
    title = f"{wording.title(problem) or 'problem'}: {wording.size(problem)}"
    took = wording.took(search_result.seconds, format_name)
    made_by = f"{wording.PROGRAM}, in exact arithmetic{took}"
    return Document(
        title,
        [Section(title, message, is_complete, facts, tables, remarks, made_by, figure)],
    )


def _best(
    best_solution: Optimum,
    cell: Callable[..., str],
    max_length: float,
    names: Sequence[str],
) -> tuple[list[str], list[Table], list[str]]:
    """Return lines with the objective, its bound and what the best solution means, the
    tables of its numbers, and remarks."""
    problem = best_solution.data.problem
    shown = (("objective", "value"), ("bound", "bound"), ("gap", "gap"))
    values = (
        (word, getattr(best_solution, name), best_solution.outward[name])
        for word, name in shown
    )
    facts = [
        f"{word} {cell(value, toward)}"
        for word, value, toward in values
        if value is not None
    ]
    statements, meaning_tables = (
        meaning_of(best_solution.data).best(best_solution.z, cell)
        if best_solution.z
        else ([], [])
    )
    facts += statements
    headings = wording.headings(problem, max_length)
    selected = wording.selected_components(wording.labels_of(problem), names)
    z, w = (
        in_stated_sense(problem, values or [])
        for values in (best_solution.z, best_solution.w)
    )
    rows = ([headings[i], cell(z[i]), cell(w[i])] for i in selected) if z else iter(())
    facts.append(
        f"{count(best_solution.nodes, 'node')} of the tree over the basis statuses"
    )
    listing = Listing(["", "z", "w"], [rows], len(selected) if z else 0, [])
    table, remarks = _listed(listing)
    return (
        facts,
        [*meaning_tables, table],
        remarks,
    )


def _parts(data: ExactProblem, piece: Piece) -> Iterator[tuple[str, Values, Values]]:
    for vertex in piece.vertices:
        yield "vertex", vertex, data.w(vertex)
    for kind, directions in (("ray", piece.rays), ("line", piece.lines)):
        constant = data.w(zeros(data.n)) if directions else []
        for direction in directions:
            yield (
                kind,
                direction,
                [a - b for a, b in zip(data.w(direction), constant, strict=True)],
            )


def _pieces(
    solution_set: SolutionSet,
    cell: Callable[[Fraction], str],
    max_length: float,
    selected: Sequence[int],
) -> Listing:
    """Return a row for each vertex, ray and line, z and then w; the isolated solutions
    are a group, and so is each face."""
    data = solution_set.data
    if not solution_set.pieces:  # with many unknowns, a header alone would take a while
        return Listing([], [], 0, [])
    meaning = solution_set.meaning
    names = wording.headings(data.problem, max_length)
    selected = meaning.shown(selected)
    header = ["piece", "", *(names[i] for i in selected), *meaning.headings(selected)]

    def rows(number: int, piece: Piece) -> Iterator[list[str]]:
        for k, (kind, z, w) in enumerate(_parts(data, piece)):
            shown, more = meaning.row(kind, z, w, selected, cell)
            shown = in_stated_sense(data.problem, shown)
            numbers = [*(cell(shown[i]) for i in selected), *more]
            yield ["" if k else str(number), kind, *numbers]

    pieces = list(enumerate(solution_set.pieces, 1))
    points = chain.from_iterable(rows(*each) for each in pieces if each[1].is_point)
    groups = (points, *(rows(*each) for each in pieces if not each[1].is_point))
    total = sum(
        len(piece.vertices) + len(piece.rays) + len(piece.lines)
        for piece in solution_set.pieces
    )
    remark = f"the solutions of a face are the averages of {meaning.vertices}"
    if any(piece.rays or piece.lines for piece in solution_set.pieces):
        remark += (
            ", plus any nonnegative multiples of its rays and any multiples of its "
            "lines"
        )
    return Listing(header, groups, total, [remark] if len(groups) > 1 else [])


def _listed(listing: Listing) -> Listed:
    """Return the table of as many rows as are worth typesetting, and the remarks, also
    on rows that are omitted."""
    header, groups, total, remarks = listing
    if not header:
        return Table([], []), remarks
    max_rows = rows_left = min(MAX_LINES, max(MAX_CELLS // len(header), MIN_LINES))
    shown: list[list[list[str]]] = []
    for group in groups:
        shown.append(list(islice(group, rows_left)))
        rows_left -= len(shown[-1])
    if total > max_rows:
        remarks.append(
            f"the first {max_rows} of {total} rows; --format json and csv have all of "
            "them"
        )
    word_columns = (0, 1) if header[0] == "piece" else (0,)
    return Table(
        header, list(filter(None, shown)), words=word_columns, name="Solutions"
    ), remarks


def _record(solution_set: SolutionSet, source: Source, exact: bool) -> dict[str, Any]:
    points = solution_set.arranged.points
    number = {point: k for k, point in enumerate(points)}
    overrides = {
        **source_record(source, solution_set.data.problem),
        **solution_set.arranged.record(),
        "solutions": [_solution(solution_set.meaning, z) for z in points],
        "pieces": [
            vars(piece) | {VERTICES: list(map(number.get, piece.vertices))}
            for piece in solution_set.pieces
        ],
    }
    return record(keys_of("solutions"), solution_set, overrides, exact)


def _solution(meaning: Meaning, z: Values) -> dict[str, Any]:
    values = {"z": z, "w": meaning.data.w(z), "objective": None}
    return values | meaning.record(z)


def _rows(
    search_result: SolutionSet | Optimum, exact: bool, shown: Sequence[str]
) -> tuple[Iterable[Cells], list[str]]:
    """Return the solutions as rows of CSV, with a comment; the best one as `lcp check`
    reads it. There is a line for each component of each vertex, ray and line: z and w,
    or their changes for a direction, and what they mean. shown : as names for
    `build`."""
    problem, header = search_result.data.problem, HEADER
    meaning = meaning_of(search_result.data)
    has_names = isinstance(search_result, Optimum) or any(problem.names)
    message = (
        search_result.message(brief)
        if isinstance(search_result, Optimum)
        else search_result.message
    )
    rows: Iterable[Cells] = ()
    if isinstance(search_result, Optimum):
        header = HEADER[3:]
        if search_result.z:
            rows = _components(meaning, search_result.z, search_result.w or [], exact)
    elif (special_cells := search_result.arranged.cells(exact=exact)) is not None:
        header, rows = tuple(special_cells[0]), special_cells[1]
    else:
        rows = (
            (number, kind, k, *cells)
            for number, piece in enumerate(search_result.pieces, 1)
            for k, (kind, z, w) in enumerate(_parts(search_result.data, piece), 1)
            for cells in _components(meaning, z, w, exact)
        )
    named = ["name"] if has_names else []
    selected = set(wording.selected_components(wording.labels_of(problem), shown))
    # The rows of each solution are in the order of the unknowns.
    lines = zip(rows, cycle(enumerate(problem.names)), strict=False)
    selected_rows = (
        (*row, name) if has_names else tuple(row)
        for row, (i, name) in lines
        if i in selected
    )
    comment = ": ".join(filter(None, [problem.name, message]))
    return [(*header, *meaning.columns, *named), *selected_rows], [comment]


def _components(meaning: Meaning, z: Values, w: Values, exact: bool) -> Iterator[Cells]:
    """Yield for each component its number, z and w, and what they mean."""
    cells = plain(meaning.cells(z), exact)
    numbers = zip(plain(z, exact), plain(w, exact), cells, strict=True)
    for i, (a, b, further_cells) in enumerate(numbers, 1):
        yield i, a, b, *further_cells


def _best_record(best_solution: Optimum, source: Source, exact: bool) -> dict[str, Any]:
    problem = best_solution.data.problem
    overrides = dict.fromkeys(("x", "y", "equilibrium")) | source_record(
        source, problem
    )
    overrides |= {"message": best_solution.message(brief if exact else approximate)}
    for name, toward in best_solution.outward.items():
        number = getattr(best_solution, name)
        overrides[name] = (
            number if number is None or exact else _outward(number, toward)
        )
    overrides |= (
        meaning_of(best_solution.data).record(best_solution.z)
        if best_solution.z
        else {}
    )
    return record(keys_of("optimum"), best_solution, overrides, exact)


def _outward(value: Fraction, toward: int) -> float:
    """Return the closest float that is not below a number if `toward` is 1, and not
    above it if `toward` is -1; an infinity if there is none."""
    nearest = float(rounded([value])[0])
    if math.isinf(nearest):
        return (
            nearest if toward * nearest > 0 else math.copysign(LARGEST_DOUBLE, nearest)
        )
    return (
        nearest
        if toward * (Fraction(nearest) - value) >= 0
        else math.nextafter(nearest, toward * math.inf)
    )
