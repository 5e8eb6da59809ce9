"""A path in each of the formats: as JSON and CSV, and as a table with a row for each breakpoint."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from itertools import chain, zip_longest
from typing import Any, TypeAlias

import numpy as np

from lcpcli.errors import visible
from lcpcli.files.contents import NO_SOURCE
from lcpcli.interrupts import in_time
from lcpcli.parametric.path import INFEASIBLE, REACHED, TURN, Path
from lcpcli.report import path_terms, programs_and_games, result_formats, wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.path_terms import Points, Terms
from lcpcli.report.result_formats import Report
from lcpcli.report.tables import CELL, OTHER_COLUMNS, PRINTED, longest, room, shown_components, with_ellipsis
from lcpcli.typing import Vector

KEYS = (
    "version file to_file problem to n names end message reached verified t z w basis changes jumps moving answer "
    "direction certificate exact at seconds"
)
NO_POINTS = Points([], [], [])
MOST_ROWS = 500  # of a table; typesetting takes a millisecond a row, and nobody reads on
MOST_CHANGES = 3  # named at a breakpoint; more, where pieces of no length have been left out, would make a wide column
NOISE = 1e-12  # relative to the largest entry: what is shown as 0

At: TypeAlias = Sequence["float | Fraction"]  # further values of t, for whose points a text has room too


def data(path: Path, points: Points = NO_POINTS, files: Sequence[str] = ()) -> dict[str, Any]:
    """Return a path as the object of its line in JSON, with further points. files : of the problems that were read."""
    terms, doubles = Terms(path), Points(path.t.tolist(), list(path.z), list(path.w))
    moving = terms.moving and {**terms.moving._asdict(), "values": [terms.moved(t) for t in doubles.t]}
    own = {
        **result_formats.place(NO_SOURCE, path.problem),
        **dict(zip_longest(("file", "to_file"), files)),
        "to": path.to.name,
        "changes": [[change._asdict() for change in changes] for changes in path_terms.changes(path)],
        "moving": moving,
        "answer": _answer(terms, doubles),
        "exact": path.exact and {**path.exact._asdict(), "answer": _answer(terms, terms.points)},
        "at": {**points._asdict(), "answer": _answer(terms, points)},
    }
    return result_formats.record(KEYS, path, own)


def _answer(terms: Terms, points: Points) -> dict[str, Any] | None:
    if terms.program is None:
        return None
    parts = [terms.program.parts(terms.values(z)) for z in points.z]
    return {
        "kind": "qp",
        "x": [x for x, _ in parts],
        "y": [y for _, y in parts],
        "objective": list(map(terms.objective, points.t, points.z)),
        "rows": list(terms.program.rows),
        "columns": list(terms.program.columns),
    }


def rows(path: Path, at: At, names: Sequence[str]) -> tuple[Iterable[Sequence[Any]], list[str]]:
    """Return a row for each breakpoint, and then for each further point: its number, t, the number that moves, what
    changes, z (x and y of a program), w, and the objective of a program; and comments. names : as for `report`."""
    terms = Terms(path)
    kept = wording.places(terms.names(), names) if names else None

    def chosen(vector: Sequence[Any]) -> Sequence[Any]:
        return vector if kept is None else [vector[i] for i in kept]

    def row(number: Any, note: str, t: Any, z: Any, w: Any) -> list[Any]:
        moved = [terms.moved(t)] if terms.moving else []
        value = [terms.objective(t, z)] if terms.program else []
        vectors = (result_formats.plain(chosen(vector)) for vector in (terms.values(z), w))
        return [
            *map(result_formats.plain, (number, t, *moved, note)),
            *chain(*vectors),
            *map(result_formats.plain, value),
        ]

    moving = [terms.moving.label] if terms.moving else []
    w_names = [f"w {name}" if name else f"w{i}" for i, name in enumerate(path.problem.names, 1)]
    header = ["breakpoint", "t", *moving, "change", *chosen(terms.names()), *chosen(w_names)]
    notes = path_terms.notes(path, terms.names(), math.inf)
    breakpoints = (row(k + 1, notes[k], *(part[k] for part in terms.points)) for k in range(path.t.size))
    others = (row("", "", *point) for point in zip(*terms.at_all(at), strict=True))
    comments = [path_terms.title(path), path_terms.verdict(path, path.t.size)]
    return chain([[*header, *["objective"] * bool(terms.program)]], in_time(breakpoints), others), comments


def report(path: Path, at: At, files: Sequence[str] = (), names: Sequence[str] = ()) -> Report:
    """Return the report on a path, with the points at further t. files : of the problems that were read. names : as for
    `build`; JSON has all."""
    return Report(
        lambda form, width: build(path, form, at, width, names),
        lambda: [data(path, Terms(path).at_all(at), files)],
        lambda: rows(path, at, names),
    )


def build(path: Path, form: str, at: At, width: int | None, names: Sequence[str] = ()) -> Document:
    """Return the report on a path for a format: a row for each breakpoint, and the further points below them. names :
    of the unknowns that are shown, as for `wording.places`; empty for as many as fit."""
    terms = Terms(path)
    notes = path_terms.notes(path, wording.all_visible(terms.names(longest(form))), MOST_CHANGES)
    columns = _Columns(terms, form, width, notes, names)
    found = terms.at_all(at)
    missed = [f"{float(t):.7g}" for t in at if t not in found.t]
    groups = [
        columns.rows(Points(*(part[:MOST_ROWS] for part in terms.points)), notes),
        columns.rows(found, ["(--at)"] * len(found.t)),
    ]
    section = Section(
        path_terms.title(path),
        path_terms.verdict(path, path.t.size),
        path.verified and path.end == REACHED,
        [str(terms.moving)] if terms.moving else [],
        [Table(columns.header, list(filter(None, groups)), words=[columns.header.index("change")], name="Breakpoints")],
        [
            *_remarks(terms, form, columns.elided),
            *[f"the path does not come to t = {', '.join(missed)}"] * bool(missed),
        ],
        f"{wording.PROGRAM}{wording.took(path.seconds, form)}",
        partial(_figure, path, names) if path.t.size else None,
    )
    return Document(section.title, [section])


def _figure(path: Path, names: Sequence[str]) -> bytes:
    from lcpcli.report import plotting

    return plotting.plot_path(path, show=names).content("svg")


class _Columns:
    """The columns of a table: t, the number that moves, what changes, as many components of z (x and y of a program)
    as the width has room for, w if there is room for all, and the objective of a program.

    notes : what changes at the breakpoints. chosen : as names for `build`.
    """

    def __init__(self, terms: Terms, form: str, width: int | None, notes: Sequence[str], chosen: Sequence[str]) -> None:
        self.terms, most, path = terms, longest(form), terms.path
        n, program, moving = path.problem.n, terms.program, terms.moving
        arrays = (path.z, path.w, path.problem.q, path.to.q)
        of_z, *of_w = (float(np.abs(array).max(initial=0.0)) for array in arrays)
        self._largest = [of_z, max(of_w)]  # w is rounded as its terms are
        self._has_t = moving is None or moving[2:] != (float(path.family.start), float(path.family.stop))
        moved = [moving.label if len(visible(moving.label)) < most else "value"] if moving else []
        names = wording.all_visible(terms.names(most))
        left = room(form, width)
        if left is not None:
            left -= CELL * (self._has_t + len(moved) + bool(program)) + max(map(len, notes), default=0)
        usual = None if left is None else left + OTHER_COLUMNS
        widths = [] if left is None or n > left else self._widths(names)

        def fits(count: int) -> bool:
            return sum(widths[:count]) <= (left or 0) if widths else shown_components(count, usual) is None

        counts = [n] if program is None else [n - program.ranges, program.variables]
        count = next(filter(fits, counts), counts[-1])
        self._kept = wording.places(terms.names(), chosen) if chosen else range(count)
        self._components = None if chosen or fits(count) else shown_components(count, usual)
        self._has_w = not chosen and program is None and fits(2 * n)
        self.elided = self._components is not None or (not chosen and count < counts[0])
        names = self._of_shown(names)
        w = [f"w{i}" for i in range(1, n + 1)] if self._has_w else []
        self.header = [*["t"] * self._has_t, *moved, "change", *names, *w, *["objective"] * bool(program)]

    def _of_shown(self, values: Sequence[Any], cell: Callable[[Any], str] = str) -> list[str]:
        return with_ellipsis([values[i] for i in self._kept], self._components, cell)

    def _widths(self, names: Sequence[str]) -> list[int]:
        """Return the widths of the columns of z, and then of w, with the gap after each."""
        points = [part[:MOST_ROWS] for part in self.terms.points]
        vectors = zip((list(map(self.terms.values, points[1])), points[2]), self._largest, strict=True)
        columns = ((column, largest) for own, largest in vectors for column in zip(names, *own, strict=True))
        return [max(map(len, (name, *(_cell(v, largest) for v in own)))) + 1 for (name, *own), largest in columns]

    def rows(self, points: Points, notes: Sequence[str]) -> list[list[str]]:
        """Return the rows of some points, each with a note on what changes there."""
        return [list(self._row(*each)) for each in zip(notes, *points, strict=False)]

    def _row(self, note: str, t: Any, z: Sequence[Any], w: Sequence[Any]) -> Iterator[str]:
        terms = self.terms
        if self._has_t:
            yield _cell(t, float(max(map(abs, (terms.path.family.start, terms.path.family.stop)))))
        if terms.moving:
            yield _cell(terms.moved(t), max(map(abs, terms.moving[2:])))
        yield note
        yield from self._of_shown(terms.values(z), lambda value: _cell(value, self._largest[0]))
        if self._has_w:
            yield from (_cell(value, self._largest[1]) for value in w)
        if terms.program:
            yield _cell(terms.objective(t, z))


def _cell(value: Any, largest: float = 0.0) -> str:
    return wording.number(0.0 if isinstance(value, float) and abs(value) <= NOISE * largest else value)


def _remarks(terms: Terms, form: str, elided: bool) -> list[str]:
    path, remarks = terms.path, []
    if path.certificate is not None:
        which = "first" if path.end == INFEASIBLE else "second"
        y = _named(terms, path.certificate, wording.multiplier)
        remarks.append(f"proof that the {which} problem has no solution: y = {y}")
    if path.direction is not None:
        largest = float(np.abs(path.direction).max())
        along = _named(terms, np.round(path.direction / largest, 12) * largest, "{:.7g}".format)
        remarks.append(f"direction of z on the ray: {along}")
    if path.jumps:
        remarks.append("at a jump all points between the two rows solve the problem")
    if path.t.size > MOST_ROWS:
        remarks.append(f"the first {MOST_ROWS} of {path.t.size} rows; --format json and csv have all of them")
    if path.end == TURN and form not in PRINTED:
        remarks.append("with --turns the path goes on, with t decreasing")
    if elided and form not in PRINTED:
        remarks.append(f"see all {path.problem.n} components with --format csv")
    return remarks


def _named(terms: Terms, values: Vector, cell: Callable[[Any], str]) -> str:
    has_names = any(terms.path.problem.names)
    return programs_and_games.named(values.tolist(), terms.names() if has_names else (), cell, sparing=has_names)
