"""A path in each of the formats: as JSON and CSV, and as a table with a row for each breakpoint."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
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
from lcpcli.report.tables import (
    CELL,
    OTHER_COLUMNS,
    PIPE_COMPONENTS,
    PRINTED,
    longest,
    room,
    shown_components,
    with_gap,
)
from lcpcli.report.wording import ELLIPSIS
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
    terms, most = Terms(path), longest(form)
    notes = path_terms.notes(path, wording.all_visible(terms.names(most)), MOST_CHANGES)[:MOST_ROWS]
    found = terms.at_all(at)
    missed = [f"{float(t):.7g}" for t in at if t not in found.t]
    points = Points(*([*part[:MOST_ROWS], *more] for part, more in zip(terms.points, found, strict=True)))
    columns, elided = _columns(terms, points, [*notes, *["(--at)"] * len(found.t)], form, width, names)
    header, *rows = map(list, zip(*columns, strict=True))
    groups = list(filter(None, (rows[: len(notes)], rows[len(notes) :])))
    section = Section(
        path_terms.title(path),
        path_terms.verdict(path, path.t.size),
        path.verified and path.end == REACHED,
        [str(terms.moving)] if terms.moving else [],
        [Table(header, groups, words=[header.index("change")], name="Breakpoints")],
        [
            *_remarks(terms, form, elided),
            *[f"the path does not come to t = {', '.join(missed)}"] * bool(missed),
        ],
        f"{wording.PROGRAM}{wording.took(path.seconds, form)}",
        partial(_figure, path, names) if path.t.size else None,
    )
    return Document(section.title, [section])


def _figure(path: Path, names: Sequence[str]) -> bytes:
    from lcpcli.report import plotting

    return plotting.plot_path(path, show=names).content("svg")


def _columns(
    terms: Terms, points: Points, notes: Sequence[str], form: str, width: int | None, chosen: Sequence[str]
) -> tuple[list[list[str]], bool]:
    """Return the columns of a table with their headings, and whether unknowns are left out: t, the number that moves,
    what changes, as many components of z (x and y of a program) as the width has room for, w if there is room for all,
    and the objective of a program. chosen : as names for `build`."""
    path, program, moving, most = terms.path, terms.program, terms.moving, longest(form)
    n, names, ends = path.problem.n, wording.all_visible(terms.names(most)), (path.family.start, path.family.stop)
    of_z, *of_w = (float(np.abs(array).max(initial=0.0)) for array in (path.z, path.w, path.problem.q, path.to.q))
    vectors = list(map(terms.values, points.z))

    def column(name: str, values: Iterable[Any], largest: float = 0.0) -> list[str]:
        return [name, *(_cell(value, largest) for value in values)]

    def of_places(kept: Iterable[int | None]) -> list[list[str]]:
        gap = [ELLIPSIS] * (len(vectors) + 1)
        return [gap if i is None else column(names[i], (z[i] for z in vectors), of_z) for i in kept]

    before, after = [["change", *notes]], list[list[str]]()
    if moving:
        label = moving.label if len(visible(moving.label)) < most else "value"
        before.insert(0, column(label, map(terms.moved, points.t), max(map(abs, moving[2:]))))
    if moving is None or moving[2:] != tuple(map(float, ends)):
        before.insert(0, column("t", points.t, float(max(map(abs, ends)))))
    if program:
        after.append(column("objective", map(terms.objective, points.t, points.z)))
    if chosen:
        return [*before, *of_places(wording.places(terms.names(), chosen)), *after], False
    left = room(form, width)
    if left is not None:
        left -= CELL * (len(before) - 1 + len(after)) + max(map(len, notes), default=0)

    def fits(columns: Sequence[Sequence[str]]) -> bool:
        return len(columns) <= PIPE_COMPONENTS if left is None else sum(max(map(len, c)) + 1 for c in columns) <= left

    counts = [n] if program is None else [n - program.ranges, program.variables]
    shown: list[list[str]] | None = None
    if n <= (PIPE_COMPONENTS if left is None else left):
        shown = next(filter(fits, map(of_places, map(range, counts))), None)
    if shown is None:
        shown = of_places(
            with_gap(counts[-1], shown_components(counts[-1], None if left is None else left + OTHER_COLUMNS))
        )
    elif program is None:
        w = [column(f"w{i + 1}", (own[i] for own in points.w), max(of_w)) for i in range(n)]  # rounded as its terms are
        shown += w if fits([*shown, *w]) else []
    return [*before, *shown, *after], len(shown) < counts[0]


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
