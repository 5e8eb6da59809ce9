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
from lcpcli.rational.numbers import approximate, brief, rounded
from lcpcli.report import plotting, wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.result_formats import (
    Report,
    keys_of,
    place,
    plain,
    record,
)
from lcpcli.report.tables import longest

HEADER: tuple[str, ...] = ("piece", "kind", "number", "component", "z", "w")
# rows; typesetting more takes longer than the search for the solutions.
MAX_LINES = 1000
MIN_LINES = 20  # however wide a table is
# Of a table; a terminal's takes a tenth of a millisecond for each, and more is hardly
# read.
MAX_CELLS = 6000
VERTICES = "vertices"  # the attribute of a piece

Values: TypeAlias = Sequence[Fraction]
Cells: TypeAlias = tuple[Any, ...]
Listed: TypeAlias = tuple[Table, list[str]]  # and remarks


def report(
    found: SolutionSet | Optimum,
    source: Source,
    exact: bool,
    names: Sequence[str] = (),
) -> Report:
    """Return the report on what was found."""
    made: Callable[..., dict[str, Any]] = (
        _best_record if isinstance(found, Optimum) else _record
    )
    return Report(
        lambda form, _: build(found, exact, form, names),
        lambda: [made(found, source, exact)],
        lambda: _rows(found, exact, names),
    )


def build(
    found: SolutionSet | Optimum, exact: bool, form: str, names: Sequence[str] = ()
) -> Document:
    """Return the report on a solution set, or on the best solution, for a format.
    exact : whether numbers are fractions instead of seven digits. names : of the
    unknowns shown, as for `wording.places`."""
    cell: Callable[..., str] = brief if exact else approximate
    problem, facts, remarks, figure = found.data.problem, list[str](), list[str](), None
    if isinstance(found, Optimum):
        message, settled = found.message(cell), found.status == OPTIMAL
        facts, tables, remarks = _best(found, cell, longest(form), names)
    else:
        message, settled = found.message, found.complete
        kept = wording.places(wording.labels_of(problem), names)
        own = found.arranged.table(kept, longest(form), cell)
        table, remarks = _listed(own or _pieces(found, cell, longest(form), kept))
        tables = [table]
        figure = partial(plotting.cones, found) if plotting.is_plane(problem) else None
    title = f"{wording.title(problem) or 'problem'}: {wording.size(problem)}"
    made_by = (
        f"{wording.PROGRAM}, in exact arithmetic{wording.took(found.seconds, form)}"
    )
    return Document(
        title,
        [Section(title, message, settled, facts, tables, remarks, made_by, figure)],
    )


def _best(
    found: Optimum, cell: Callable[..., str], most: float, names: Sequence[str]
) -> tuple[list[str], list[Table], list[str]]:
    """Return lines with the objective, its bound and what the best solution means, the
    tables of its numbers, and remarks."""
    problem = found.data.problem
    shown = (("objective", "value"), ("bound", "bound"), ("gap", "gap"))
    values = ((word, getattr(found, name), found.outward[name]) for word, name in shown)
    facts = [
        f"{word} {cell(value, toward)}"
        for word, value, toward in values
        if value is not None
    ]
    said, meant = meaning_of(found.data).best(found.z, cell) if found.z else ([], [])
    facts += said
    own, kept = (
        wording.headings(problem, most),
        wording.places(wording.labels_of(problem), names),
    )
    z, w = (in_stated_sense(problem, values or []) for values in (found.z, found.w))
    rows = ([own[i], cell(z[i]), cell(w[i])] for i in kept) if z else iter(())
    facts.append(f"{count(found.nodes, 'node')} of the tree over the states")
    listing = Listing(["", "z", "w"], [rows], len(kept) if z else 0, [])
    table, remarks = _listed(listing)
    return (
        facts,
        [*meant, table],
        remarks,
    )


def _parts(data: ExactProblem, piece: Piece) -> Iterator[tuple[str, Values, Values]]:
    for vertex in piece.vertices:
        yield "vertex", vertex, data.w(vertex)
    for kind, directions in (("ray", piece.rays), ("line", piece.lines)):
        constant = data.w([Fraction(0)] * data.n) if directions else []
        for direction in directions:
            yield (
                kind,
                direction,
                [a - b for a, b in zip(data.w(direction), constant, strict=True)],
            )


def _pieces(
    found: SolutionSet,
    cell: Callable[[Fraction], str],
    most: float,
    kept: Sequence[int],
) -> Listing:
    """Return a row for each vertex, ray and line, z and then w; the isolated solutions
    are a group, and so is each face."""
    data = found.data
    if not found.pieces:  # with many unknowns, a header alone would take a while
        return Listing([], [], 0, [])
    meaning = found.meaning
    names = wording.headings(data.problem, most)
    kept = meaning.shown(kept)
    header = ["piece", "", *(names[i] for i in kept), *meaning.headings(kept)]

    def rows(number: int, piece: Piece) -> Iterator[list[str]]:
        for k, (kind, z, w) in enumerate(_parts(data, piece)):
            shown, more = meaning.row(kind, z, w, kept, cell)
            shown = in_stated_sense(data.problem, shown)
            numbers = [*(cell(shown[i]) for i in kept), *more]
            yield ["" if k else str(number), kind, *numbers]

    pieces = list(enumerate(found.pieces, 1))
    points = chain.from_iterable(rows(*each) for each in pieces if each[1].is_point)
    groups = (points, *(rows(*each) for each in pieces if not each[1].is_point))
    total = sum(
        len(piece.vertices) + len(piece.rays) + len(piece.lines)
        for piece in found.pieces
    )
    remark = f"the solutions of a face are the averages of {meaning.vertices}"
    if any(piece.rays or piece.lines for piece in found.pieces):
        remark += (
            ", plus any nonnegative multiples of its rays and any multiples of its "
            "lines"
        )
    return Listing(header, groups, total, [remark] if len(groups) > 1 else [])


def _listed(listing: Listing) -> Listed:
    """Return the table of as many rows as are worth typesetting, and the remarks, also
    on rows that are left out."""
    header, groups, total, remarks = listing
    if not header:
        return Table([], []), remarks
    most = left = min(MAX_LINES, max(MAX_CELLS // len(header), MIN_LINES))
    shown: list[list[list[str]]] = []
    for group in groups:
        shown.append(list(islice(group, left)))
        left -= len(shown[-1])
    if total > most:
        remarks.append(
            f"the first {most} of {total} rows; --format json and csv have all of them"
        )
    words = (0, *[1] * (header[0] == "piece"))
    return Table(
        header, list(filter(None, shown)), words=words, name="Solutions"
    ), remarks


def _record(found: SolutionSet, source: Source, exact: bool) -> dict[str, Any]:
    points = found.arranged.points
    number = {point: k for k, point in enumerate(points)}
    own = {
        **place(source, found.data.problem),
        **found.arranged.record(),
        "solutions": [_solution(found.meaning, z) for z in points],
        "pieces": [
            vars(piece) | {VERTICES: list(map(number.get, piece.vertices))}
            for piece in found.pieces
        ],
    }
    return record(keys_of("solutions"), found, own, exact)


def _solution(meaning: Meaning, z: Values) -> dict[str, Any]:
    known = {"z": z, "w": meaning.data.w(z), "objective": None}
    return known | meaning.record(z)


def _rows(
    found: SolutionSet | Optimum, exact: bool, shown: Sequence[str]
) -> tuple[Iterable[Cells], list[str]]:
    """Return the solutions as rows of CSV, with a comment; the best one as `lcp check`
    reads it. There is a line for each component of each vertex, ray and line: z and w,
    or their changes for a direction, and what they mean. shown : as names for
    `build`."""
    problem, header = found.data.problem, HEADER
    meaning = meaning_of(found.data)
    has_names = isinstance(found, Optimum) or any(problem.names)
    message = found.message(brief) if isinstance(found, Optimum) else found.message
    rows: Iterable[Cells] = ()
    if isinstance(found, Optimum):
        header = HEADER[3:]
        if found.z:
            rows = _components(meaning, found.z, found.w or [], exact)
    elif (own := found.arranged.cells(exact=exact)) is not None:
        header, rows = tuple(own[0]), own[1]
    else:
        rows = (
            (number, kind, k, *cells)
            for number, piece in enumerate(found.pieces, 1)
            for k, (kind, z, w) in enumerate(_parts(found.data, piece), 1)
            for cells in _components(meaning, z, w, exact)
        )
    named = ["name"] * has_names
    kept = set(wording.places(wording.labels_of(problem), shown))
    # The rows of each solution are in the order of the unknowns.
    lines = zip(rows, cycle(enumerate(problem.names)), strict=False)
    chosen = ((*row, *[name] * has_names) for row, (i, name) in lines if i in kept)
    comment = ": ".join(filter(None, [problem.name, message]))
    return [(*header, *meaning.columns, *named), *chosen], [comment]


def _components(meaning: Meaning, z: Values, w: Values, exact: bool) -> Iterator[Cells]:
    """Yield for each component its number, z and w, and what they mean."""
    cells = plain(meaning.cells(z), exact)
    numbers = zip(plain(z, exact), plain(w, exact), cells, strict=True)
    for i, (a, b, own) in enumerate(numbers, 1):
        yield i, a, b, *own


def _best_record(found: Optimum, source: Source, exact: bool) -> dict[str, Any]:
    problem = found.data.problem
    own = dict.fromkeys(("x", "y", "equilibrium")) | place(source, problem)
    own |= {"message": found.message(brief if exact else approximate)}
    for name, toward in found.outward.items():
        number = getattr(found, name)
        own[name] = number if number is None or exact else _outward(number, toward)
    own |= meaning_of(found.data).record(found.z) if found.z else {}
    return record(keys_of("optimum"), found, own, exact)


def _outward(value: Fraction, toward: int) -> float:
    """Return the nearest double that is not below a number if `toward` is 1, and not
    above it if it is -1; an infinity where there is none."""
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
