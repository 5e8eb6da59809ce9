"""A path as an object of JSON and as a line; for a table see `path_table`, for texts of long paths `path_writing`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from lcpcli.errors import count
from lcpcli.files.contents import NOWHERE
from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_table, path_words, result_csv, result_formats
from lcpcli.report.path_terms import Points, Terms

KEYS = (
    "version file to_file problem to n names end message reached verified t z w basis changes jumps moving answer "
    "direction certificate exact at seconds"
)
NO_POINTS = Points([], [], [])


def line(path: Path) -> str:
    """Return the path in a line."""
    span = f", t from {path.t[0]:.7g} to {path.t[-1]:.7g}" if path.t.size else ""
    proof = f", {path_words.verified(path)}" if path.t.size else ""
    return f"<Path: {count(path.t.size, 'breakpoint')}{span}: {path.message}{proof}>"


def data(path: Path, points: Points = NO_POINTS, files: Sequence[str] = ()) -> dict[str, Any]:
    """Return a path as the object of its line in JSON.

    points : further points of the path, which the object has too. files : of the problems that were read.
    """
    terms, doubles = Terms(path), Points(path.t.tolist(), list(path.z), list(path.w))
    moving = terms.moving and {**terms.moving._asdict(), "values": [terms.moved(t) for t in doubles.t]}
    own = {
        **json_lines.place(NOWHERE, path.problem),
        **dict(zip_longest(("file", "to_file"), files)),
        "to": path.to.name,
        "changes": [[change._asdict() for change in changes] for changes in path_words.changes(path)],
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


def text(path: Path, form: str, at: Sequence[float | Fraction], width: int | None, color: bool) -> str:
    """Return a path in a format that shows tables, or in CSV."""
    if form == "csv":
        return _csv(path, at)
    return result_formats.typeset([path_table.build(path, form, at, width)], form, width, color)


def _csv(path: Path, at: Sequence[float | Fraction]) -> str:
    """Return a row for each breakpoint, and then for each further point: its number, t, the number that moves, what
    changes, z (x and y of a program), w, and the objective of a program."""
    terms = Terms(path)
    n, moving, program = path.problem.n, terms.moving, terms.program
    names = terms.names()
    w_names = [f"w{i}" for i in range(1, n + 1)]
    header = ["breakpoint", "t", *([moving.label] if moving else []), "change", *names, *w_names]
    rows: list[Sequence[Any]] = [[*header, *["objective"] * bool(program)]]
    notes = path_words.notes(path, names, math.inf)
    for points, own in ((terms.points, notes), (terms.at_all(at), None)):
        for k, (t, z, w) in enumerate(zip(*points, strict=True)):
            moved = [terms.moved(t)] if moving else []
            value = [terms.objective(t, z)] if program else []
            first = [k + 1 if own else "", t, *moved, own[k] if own else ""]
            rows.append([*map(json_lines.plain, (*first, *terms.values(z), *w, *value))])
    return result_csv.written(rows, [path_words.title(path), path_words.verdict(path)])
