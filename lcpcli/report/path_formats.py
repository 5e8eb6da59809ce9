"""A path as a line, and as CSV and JSON; for tables see `path_table`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import chain, zip_longest
from typing import Any, TypeAlias

from lcpcli.errors import count
from lcpcli.files.contents import NO_SOURCE
from lcpcli.interrupts import in_time
from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_terms, selection
from lcpcli.report.path_terms import Points, Terms

KEYS = (
    "version file to_file problem to n names end message reached verified t z w basis changes jumps moving answer "
    "direction certificate exact at seconds"
)
NO_POINTS = Points([], [], [])

At: TypeAlias = Sequence["float | Fraction"]  # further values of t, for whose points a text has room too


def line(path: Path) -> str:
    """Return the path in a line."""
    span = f", t from {path.t[0]:.7g} to {path.t[-1]:.7g}" if path.t.size else ""
    proof = f", {path_terms.verified(path)}" if path.t.size else ""
    return f"<Path: {count(path.t.size, 'breakpoint')}{span}: {path.message}{proof}>"


def data(path: Path, points: Points = NO_POINTS, files: Sequence[str] = ()) -> dict[str, Any]:
    """Return a path as the object of its line in JSON.

    points : further points of the path, which the object has too. files : of the problems that were read.
    """
    terms, doubles = Terms(path), Points(path.t.tolist(), list(path.z), list(path.w))
    moving = terms.moving and {**terms.moving._asdict(), "values": [terms.moved(t) for t in doubles.t]}
    own = {
        **json_lines.place(NO_SOURCE, path.problem),
        **dict(zip_longest(("file", "to_file"), files)),
        "to": path.to.name,
        "changes": [[change._asdict() for change in changes] for changes in path_terms.changes(path)],
        "moving": moving,
        "answer": _answer(terms, doubles),
        "exact": path.exact and {**path.exact._asdict(), "answer": _answer(terms, terms.points)},
        "at": {**points._asdict(), "answer": _answer(terms, points)},
    }
    return json_lines.record(KEYS, path, own)


def _answer(terms: Terms, points: Points) -> dict[str, Any] | None:
    """Return x, y and the objective of the program at each of the points."""
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
    kept = selection.places(terms.names(), names) if names else None

    def chosen(vector: Sequence[Any]) -> Sequence[Any]:
        return vector if kept is None else [vector[i] for i in kept]

    def row(number: Any, note: str, t: Any, z: Any, w: Any) -> list[Any]:
        moved = [terms.moved(t)] if terms.moving else []
        value = [terms.objective(t, z)] if terms.program else []
        vectors = (json_lines.plain(chosen(vector)) for vector in (terms.values(z), w))
        return [*map(json_lines.plain, (number, t, *moved, note)), *chain(*vectors), *map(json_lines.plain, value)]

    moving = [terms.moving.label] if terms.moving else []
    w_names = [f"w {name}" if name else f"w{i}" for i, name in enumerate(path.problem.names, 1)]
    header = ["breakpoint", "t", *moving, "change", *chosen(terms.names()), *chosen(w_names)]
    notes = path_terms.notes(path, terms.names(), math.inf)
    breakpoints = (row(k + 1, notes[k], *(part[k] for part in terms.points)) for k in range(path.t.size))
    others = (row("", "", *point) for point in zip(*terms.at_all(at), strict=True))
    comments = [path_terms.title(path), path_terms.verdict(path, path.t.size)]
    return chain([[*header, *["objective"] * bool(terms.program)]], in_time(breakpoints), others), comments
