"""A path as CSV, as JSON lines and as one JSON object, written part by part as it is found, so that memory does not
limit its length."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from itertools import chain
from tempfile import SpooledTemporaryFile
from typing import Any, Generic, TypeAlias, TypeVar

from lcpcli.interrupts import in_time
from lcpcli.parametric.path import Path
from lcpcli.report import json_lines, path_words, result_csv, selection
from lcpcli.report.path_formats import data
from lcpcli.report.path_terms import Points, Terms

POINTWISE = {"t", "z", "w", "changes", "values", "x", "y", "objective"}  # keys of lists with an entry per breakpoint
IN_MEMORY, CHUNK = 2**22, 2**20  # characters of a list before it goes to a file on disk, and that are read from it
LATER = "the last line says how the path ends"

Key: TypeAlias = tuple[str, ...]  # of a value in nested objects
BASIS: Key = ("basis",)  # of the list that has an entry for each piece
Made = TypeVar("Made")  # what is made of breakpoints, to be written


class PathWriter(ABC, Generic[Made]):
    """A text of a path that is made while the path is found.

    at : further values of t, for which the text has the points too. files : of both problems. write : takes the text.
    names : of the unknowns that CSV has, as for `selection.places`; empty for all.
    """

    def __init__(
        self,
        at: Sequence[float | Fraction],
        files: Sequence[str],
        write: Callable[[str], object],
        names: Sequence[str] = (),
    ) -> None:
        self._at: dict[float | Fraction, list[tuple[Any, Any]]] = {t: [] for t in at}
        self._files, self._write, self._names = files, write, names
        self._kept: list[int] | None = None  # the indices of these unknowns
        self.count, self._jumps = 0, list[int]()  # the breakpoints that are written, and the jumps among the pieces

    def part(self, part: Path) -> Callable[[], None]:
        """Return what writes a part, as `following.follow` gives it to `take`, up to its last breakpoint."""
        terms, fresh = self._terms(part), self._fresh(part)[:-1]
        made = self._made(terms, fresh)
        return partial(self._keep, part, fresh, made)

    def end(self, last: Path) -> None:
        """Write the rest, from the last part, or from the path as a whole."""
        terms = self._terms(last)
        if self.count:
            self._write_rest(terms)
        else:
            self._write_whole(terms)

    def _terms(self, part: Path) -> Terms:
        """Return the terms of a part, whose points at the further values of t are noted."""
        terms = Terms(part)
        for t, found in self._at.items():
            found += [pair for pair in zip(*terms.at(t)[1:], strict=True) if pair not in found]
        return terms

    def _fresh(self, part: Path) -> range:
        """Return the breakpoints of a part that are not written yet."""
        return range(part.t.size)[bool(self.count) :]

    @property
    def _points(self) -> Points:
        """Return the points at the further values of t."""
        points = [(t, *pair) for t, found in self._at.items() for pair in found]
        t, z, w = ([point[k] for point in points] for k in range(3))
        return Points(t, z, w)

    def _keep(self, part: Path, fresh: range, made: Made) -> None:
        """Write what is made of breakpoints, and count these."""
        self._put(made)
        self._jumps += [k - fresh.start + self.count for k in part.jumps if k >= fresh.start]
        self.count += len(fresh)

    def _write_rest(self, terms: Terms) -> None:
        """Write the last part of a path."""
        fresh = self._fresh(terms.path)
        self._keep(terms.path, fresh, self._made(terms, fresh))
        self._write_end(terms)

    def _write_whole(self, terms: Terms) -> None:
        """Write a path that has one part only."""
        self._write_rest(terms)

    @abstractmethod
    def _made(self, terms: Terms, fresh: range) -> Made:
        """Return what is to be written of some breakpoints of a part."""

    @abstractmethod
    def _put(self, made: Made) -> None:
        """Write it."""

    @abstractmethod
    def _write_end(self, terms: Terms) -> None:
        """Write what follows the breakpoints."""


class CsvWriter(PathWriter[str]):
    """A row for each breakpoint, and then for each further point: its number, t, the number that moves, what changes, z
    (x and y of a program), w, and the objective of a program."""

    def _write_whole(self, terms: Terms) -> None:
        fresh = self._fresh(terms.path)
        opening = self._opening(terms, path_words.verdict(terms.path, len(fresh)))
        self._write(opening + self._rows(terms, fresh) + self._further_rows(terms))

    def _made(self, terms: Terms, fresh: range) -> str:
        return ("" if self.count else self._opening(terms, LATER)) + self._rows(terms, fresh)

    def _put(self, made: str) -> None:
        self._write(made)

    def _write_end(self, terms: Terms) -> None:
        self._write(self._further_rows(terms) + result_csv.written([], [path_words.verdict(terms.path, self.count)]))

    def _opening(self, terms: Terms, verdict: str) -> str:
        moving = [terms.moving.label] if terms.moving else []
        w_names = [f"w {name}" if name else f"w{i}" for i, name in enumerate(terms.path.problem.names, 1)]
        vectors = (self._chosen(terms, each) for each in (terms.names(), w_names))
        names = [*chain(*vectors), *["objective"] * bool(terms.program)]
        comments = [path_words.title(terms.path), verdict]
        return result_csv.written([["breakpoint", "t", *moving, "change", *names]], comments)

    def _rows(self, terms: Terms, fresh: range) -> str:
        notes, points = path_words.notes(terms.path, terms.names(), math.inf), terms.points
        numbers = range(self.count + 1, self.count + 1 + len(fresh))
        rows = (
            self._row(terms, number, notes[k], *(part[k] for part in points))
            for number, k in zip(numbers, fresh, strict=True)
        )
        return result_csv.written(in_time(rows))

    def _further_rows(self, terms: Terms) -> str:
        return result_csv.written(self._row(terms, "", "", *point) for point in zip(*self._points, strict=True))

    def _row(self, terms: Terms, number: Any, note: str, t: Any, z: Any, w: Any) -> list[Any]:
        moved = [terms.moved(t)] if terms.moving else []
        value = [terms.objective(t, z)] if terms.program else []
        vectors = (json_lines.plain(self._chosen(terms, vector)) for vector in (terms.values(z), w))
        return [*map(json_lines.plain, (number, t, *moved, note)), *chain(*vectors), *map(json_lines.plain, value)]

    def _chosen(self, terms: Terms, vector: Sequence[Any]) -> Sequence[Any]:
        """Return the entries of a vector for the unknowns that are chosen."""
        if not self._names:
            return vector
        if self._kept is None:
            self._kept = selection.places(terms.names(), self._names)
        return [vector[i] for i in self._kept]


class LinesWriter(PathWriter[str]):
    """A line of JSON for each breakpoint, with the states on the piece after it, and a last one for the path."""

    def _made(self, terms: Terms, fresh: range) -> str:
        own = data(terms.path)
        numbers, pieces = range(self.count + 1, self.count + 1 + len(fresh)), [*own["basis"], None]
        entries = zip(numbers, fresh, strict=True)
        lines = ({"breakpoint": i, **_nested(own, k), "basis": pieces[k]} for i, k in entries)
        return "".join(map(json_lines.line, in_time(lines)))

    def _put(self, made: str) -> None:
        self._write(made)

    def _write_end(self, terms: Terms) -> None:
        own = _without_lists(data(terms.path, self._points, self._files))
        self._write(json_lines.line({**own, "breakpoints": self.count, "jumps": self._jumps}))


class ObjectWriter(PathWriter[Mapping[Key, list[str]]]):
    """One object, as `Path.to_dict` returns it, in a line; its lists wait in files."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._lists: dict[Key, SpooledTemporaryFile[str]] = {}

    def _write_whole(self, terms: Terms) -> None:
        self._write(json_lines.line(data(terms.path, self._points, self._files)))

    def _made(self, terms: Terms, fresh: range) -> Mapping[Key, list[str]]:
        own = data(terms.path)
        lists = {key: [entries[k] for k in fresh] for key, entries in _lists(own)}
        lists[BASIS] = own["basis"][fresh.start :]
        return {key: list(map(json_lines.text, in_time(entries))) for key, entries in lists.items()}

    def _put(self, made: Mapping[Key, list[str]]) -> None:
        for key, entries in made.items():
            if key not in self._lists:
                self._lists[key] = SpooledTemporaryFile(IN_MEMORY, "w+", encoding="utf-8")  # noqa: SIM115
            file = self._lists[key]
            file.writelines(f"{', ' * (file.tell() > 0 or k > 0)}{entry}" for k, entry in enumerate(entries))

    def _write_end(self, terms: Terms) -> None:
        own = data(terms.path, self._points, self._files)
        self._write_object({**own, "jumps": self._jumps}, ())
        self._write("\n")

    def _write_object(self, value: Any, key: Key) -> None:
        """Write the text of a value, with the lists from their files."""
        if key in self._lists:
            file = self._lists[key]
            file.seek(0)
            self._write("[")
            for text in iter(lambda: file.read(CHUNK), ""):
                self._write(text)
            self._write("]")
            file.close()
        elif isinstance(value, dict):
            for number, (name, entry) in enumerate(value.items()):
                self._write(f"{', ' if number else '{'}{json_lines.text(name)}: ")
                self._write_object(entry, (*key, name))
            self._write("}")
        else:
            self._write(json_lines.text(value))


WRITERS: dict[str, type[PathWriter[Any]]] = {"csv": CsvWriter, "json": ObjectWriter, "jsonl": LinesWriter}


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
