"""A path as a JSON object and as a line; for tables see `path_table`, for output of long paths `path_writing`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from lcpcli.errors import count
from lcpcli.files.contents import NO_SOURCE
from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_words
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
        **json_lines.place(NO_SOURCE, path.problem),
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
