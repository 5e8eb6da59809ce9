"""A path as a line, as CSV, as JSON lines and as one JSON object; for tables see `path_table`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import chain, zip_longest
from typing import Any, TypeAlias

from lcpcli.errors import count
from lcpcli.files.contents import NO_SOURCE
from lcpcli.interrupts import in_time
from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_terms, result_csv, selection
from lcpcli.report.path_terms import Points, Terms

KEYS = (
    "version file to_file problem to n names end message reached verified t z w basis changes jumps moving answer "
    "direction certificate exact at seconds"
)
NO_POINTS = Points([], [], [])
POINTWISE = {"t", "z", "w", "changes", "values", "x", "y", "objective"}  # keys of lists with an entry per breakpoint

At: TypeAlias = Sequence["float | Fraction"]  # further values of t, for whose points a text has room too
Key: TypeAlias = tuple[str, ...]  # of a value in nested objects


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


def write_csv(path: Path, at: At, files: Sequence[str] = (), names: Sequence[str] = ()) -> str:  # noqa: ARG001
    """Return a row for each breakpoint, and then for each further point: its number, t, the number that moves, what
    changes, z (x and y of a program), w, and the objective of a program. names : of the unknowns; empty for all."""
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
    further = (row("", "", *point) for point in zip(*_further(terms, at), strict=True))
    comments = [path_terms.title(path), path_terms.verdict(path, path.t.size)]
    table = chain([[*header, *["objective"] * bool(terms.program)]], in_time(breakpoints), further)
    return result_csv.written(table, comments)


def write_json(path: Path, at: At, files: Sequence[str] = (), names: Sequence[str] = ()) -> str:  # noqa: ARG001
    """Return one object, as `Path.to_dict` does, in a line."""
    return json_lines.line(data(path, _further(Terms(path), at), files))


def write_lines(path: Path, at: At, files: Sequence[str] = (), names: Sequence[str] = ()) -> str:  # noqa: ARG001
    """Return a line of JSON for each breakpoint, with the states on the piece after it, and a last one for the path."""
    own = data(path, _further(Terms(path), at), files)
    pieces = [*own["basis"], None]
    lines = ({"breakpoint": k + 1, **_nested(own, k), "basis": pieces[k]} for k in range(path.t.size))
    whole = {**_without_lists(own), "breakpoints": path.t.size}
    return "".join(map(json_lines.line, in_time(chain(lines, [whole]))))


WRITERS: dict[str, Callable[[Path, At, Sequence[str], Sequence[str]], str]] = {
    "csv": write_csv,
    "json": write_json,
    "jsonl": write_lines,
}


def _further(terms: Terms, at: At) -> Points:
    """Return the points at further values of t."""
    found = [(t, *pair) for t in at for pair in zip(*terms.at(t)[1:], strict=True)]
    t, z, w = ([point[k] for point in found] for k in range(3))
    return Points(t, z, w)


def _lists(own: dict[str, Any], key: Key = ()) -> Iterator[tuple[Key, list[Any]]]:
    """Yield the lists that have an entry for each breakpoint."""
    for name, value in own.items():
        if isinstance(value, dict) and name != "at":
            yield from _lists(value, (*key, name))
        elif name in POINTWISE and isinstance(value, list):
            yield (*key, name), value


def _nested(own: dict[str, Any], k: int) -> dict[str, Any]:
    """Return the entries of breakpoint k."""
    entries: dict[str, Any] = {}
    for key, values in _lists(own):
        place = entries
        for name in key[:-1]:
            place = place.setdefault(name, {})
        place[key[-1]] = values[k]
    return entries


def _without_lists(own: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are those of the whole path."""
    return {
        name: _without_lists(value) if isinstance(value, dict) and name != "at" else value
        for name, value in own.items()
        if name not in {*POINTWISE, "basis"} or not isinstance(value, list)
    }
