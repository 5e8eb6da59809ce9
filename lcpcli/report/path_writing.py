"""A path as CSV, as JSON lines and as one object of JSON, part by part as it is found, so that its length is limited by
no memory."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain
from tempfile import SpooledTemporaryFile
from typing import Any, TypeAlias

from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_words, result_csv, wording
from lcpcli.report.path_formats import data
from lcpcli.report.path_terms import Points, Terms

POINTWISE = {"t", "z", "w", "changes", "values", "x", "y", "objective"}  # keys of lists with an entry per breakpoint
IN_MEMORY, CHUNK = 2**22, 2**20  # characters of a list before it goes to a file on disk, and that are read from it
LATER = "the last line says how the path ends"

Key: TypeAlias = tuple[str, ...]  # of a value in nested objects


class PathWriter(ABC):
    """A text of a path that is made while the path is found.

    at : further values of t, for which the text has the points too. files : of both problems.
    """

    def __init__(self, at: Sequence[float | Fraction], files: Sequence[str]) -> None:
        self._at: dict[float | Fraction, list[tuple[Any, Any]]] = {t: [] for t in at}
        self._files, self.count = files, 0  # of breakpoints that the text has

    def part(self, part: Path) -> str:
        """Return the text of a part, as `following.follow` gives it to `take`, up to its last breakpoint."""
        return "".join(self._added(part, is_last=False))

    def end(self, last: Path) -> Iterator[str]:
        """Yield the rest of the text, from the last part, or from the path as a whole."""
        yield from self._added(last, is_last=True)

    def _added(self, part: Path, is_last: bool) -> Iterator[str]:
        terms = Terms(part)
        for t, found in self._at.items():
            found += [pair for pair in zip(*terms.at(t)[1:], strict=True) if pair not in found]
        fresh = range(part.t.size)[bool(self.count) :]
        yield from self._text(terms, fresh if is_last else fresh[:-1], is_last)

    @property
    def _points(self) -> Points:
        """Return the points at the further values of t."""
        points = [(t, *pair) for t, found in self._at.items() for pair in found]
        t, z, w = ([point[k] for point in points] for k in range(3))
        return Points(t, z, w)

    @abstractmethod
    def _text(self, terms: Terms, fresh: range, is_last: bool) -> Iterator[str]:
        """Yield the text for these breakpoints of a part, and count them."""


class CsvWriter(PathWriter):
    """A row for each breakpoint, and then for each further point: its number, t, the number that moves, what changes, z
    (x and y of a program), w, and the objective of a program."""

    def _text(self, terms: Terms, fresh: range, is_last: bool) -> Iterator[str]:
        path, names = terms.path, [wording.in_a_line(name) for name in terms.names()]
        if not self.count:
            self._has_verdict = is_last
            verdict = path_words.verdict(path, len(fresh)) if is_last else LATER
            yield result_csv.written([self._header(terms, names)], [path_words.title(path), verdict])
        notes, points = path_words.notes(path, names, math.inf), terms.points
        yield result_csv.written(
            self._row(terms, self.count + k + 1 - fresh.start, notes[k], *(part[k] for part in points)) for k in fresh
        )
        self.count += len(fresh)
        if is_last:
            yield result_csv.written(self._row(terms, "", "", *point) for point in zip(*self._points, strict=True))
            yield result_csv.written([], [path_words.verdict(path, self.count)] * (not self._has_verdict))

    def _header(self, terms: Terms, names: Sequence[str]) -> list[str]:
        w_names = [f"w{i}" for i in range(1, terms.path.problem.n + 1)]
        moving = [terms.moving.label] if terms.moving else []
        return ["breakpoint", "t", *moving, "change", *names, *w_names, *["objective"] * bool(terms.program)]

    def _row(self, terms: Terms, number: Any, note: str, t: Any, z: Any, w: Any) -> list[Any]:
        moved = [terms.moved(t)] if terms.moving else []
        value = [terms.objective(t, z)] if terms.program else []
        vectors = (json_lines.plain(vector) for vector in (terms.values(z), w))
        return [*map(json_lines.plain, (number, t, *moved, note)), *chain(*vectors), *map(json_lines.plain, value)]


class LinesWriter(PathWriter):
    """A line of JSON for each breakpoint, with the states on the piece after it, and a last one for the path."""

    _jumps: list[int]

    def _text(self, terms: Terms, fresh: range, is_last: bool) -> Iterator[str]:
        own = data(terms.path, self._points, self._files)
        self._jumps = [*(self._jumps if self.count else []), *_jumps(own, fresh, self.count)]
        for k in fresh:
            self.count += 1
            basis = own["basis"][k] if k < len(own["basis"]) else None
            yield json_lines.line({"breakpoint": self.count, **_nested(own, k), "basis": basis})
        if is_last:
            yield json_lines.line({**_without_lists(own), "breakpoints": self.count, "jumps": self._jumps})


class ObjectWriter(PathWriter):
    """One object, as `Path.to_dict` returns it, in a line; its lists wait in files."""

    def __init__(self, at: Sequence[float | Fraction], files: Sequence[str]) -> None:
        super().__init__(at, files)
        self._lists: dict[Key, SpooledTemporaryFile[str]] = {}

    def _text(self, terms: Terms, fresh: range, is_last: bool) -> Iterator[str]:
        own = data(terms.path, self._points, self._files)
        if is_last and not self.count:
            yield json_lines.line(own)
            return
        pieces = own["basis"][fresh.start :]
        lists = {key: [entries[k] for k in fresh] for key, entries in _lists(own)}
        lists |= {("basis",): pieces, ("jumps",): _jumps(own, fresh, self.count)}
        texts = {key: [json_lines.text(entry) for entry in entries] for key, entries in lists.items()}
        for key, entries in texts.items():
            file = self._lists.setdefault(key, SpooledTemporaryFile(IN_MEMORY, "w+", encoding="utf-8"))  # noqa: SIM115
            file.writelines(f"{', ' * (file.tell() > 0 or k > 0)}{entry}" for k, entry in enumerate(entries))
        self.count += len(fresh)
        if is_last:
            yield from self._object(own, ())
            yield "\n"

    def _object(self, value: Any, key: Key) -> Iterator[str]:
        """Yield the text of a value, with the lists from their files."""
        if key in self._lists:
            file = self._lists[key]
            file.seek(0)
            yield "["
            yield from iter(lambda: file.read(CHUNK), "")
            yield "]"
            file.close()
        elif isinstance(value, dict):
            for number, (name, entry) in enumerate(value.items()):
                yield f"{', ' if number else '{'}{json_lines.text(name)}: "
                yield from self._object(entry, (*key, name))
            yield "}"
        else:
            yield json_lines.text(value)


WRITERS: dict[str, type[PathWriter]] = {"csv": CsvWriter, "json": ObjectWriter, "jsonl": LinesWriter}


def _jumps(own: dict[str, Any], fresh: range, count: int) -> list[int]:
    """Return the new jumps of a part, numbered as in the whole path."""
    return [k - fresh.start + count for k in own["jumps"] if k >= fresh.start]


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
