"""A run of many problems that goes on with its log: what the log has, and which
problems are missing.

A record is found by the file of its problem and by a digest of the problem, wherever
this stands in the run, so that files, lines and columns may have been added since. A
log that has none of the files of the run, as when they have been moved, is followed by
the numbers of the problems, all of which must agree.
"""

from __future__ import annotations

import os.path
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from lcpcli.cli.declarations import STARTS
from lcpcli.cli.main import of_status
from lcpcli.cli.problems import Request
from lcpcli.errors import Exit, OptionError, count
from lcpcli.files.contents import Source, place
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.inputs import Input, QColumns, Work, digest
from lcpcli.report.result_formats import BAD_INPUT as UNREAD
from lcpcli.solving import result as results

Kind = tuple[str, Exit]  # how a run ended: a word and an exit code

# Options on which records depend.
OF_RUN = (
    *(*BOUND_OPTIONS, "exact", "bound", "sequence", "trace", "every"),
    "columns",
)
# q of one M whose marks are made at once: many, to share the cost; few, not to delay
# the first.
MARKED_TOGETHER = 4096
MAX_NAMED = 5  # problems that one line names
HINT = "give the same files, delete its line to solve it again, or begin a new log"


class Known(NamedTuple):
    """A record of a log: the number of its problem in the run, its place, its digest,
    and how its run ended."""

    number: int
    source: Source
    digest: str
    kind: Kind


class Past:
    """The records of a log, which `missing` takes out as their problems come.

    ends : counts how the runs of the problems ended that have come.
    """

    def __init__(self, records: Iterable[Mapping[str, Any]], request: Request) -> None:
        self._given = options_of(request)
        known = [_known(record, self._given) for record in records]
        files = set(map(place, request.inputs.files))
        self._is_moved = files.isdisjoint(each.source.file for each in known)
        self._left: dict[tuple[Any, str], list[Known]] = {}
        for each in known:
            key = self._key(each.source, each.number, each.digest)
            self._left.setdefault(key, []).append(each)
        self._numbers = {each.number for each in known}
        self._places = Counter(each.source for each in known)  # of those that are left
        self._last = max(self._numbers, default=0)
        self._added = 0  # the last number of a problem that has been added
        # Of a record that an earlier problem of the same content has taken: this one,
        # in whose place the problem is that has written the record.
        self._lent: dict[tuple[tuple[Any, str], Source], tuple[Source, int]] = {}
        self.ends = Counter[Kind]()

    def missing(self, works: Iterator[Work]) -> Iterator[Work]:
        """Yield the inputs that the log lacks, with the marks of their records; raise
        OptionError if it is not a log of them."""
        position = 0
        for whole in works:
            for work in (
                whole.parts(MARKED_TOGETHER) if isinstance(whole, QColumns) else [whole]
            ):
                marks: list[Mapping[str, Any]] = []
                are_new: list[bool] = []
                for source, content in zip(work.sources, work.digests, strict=True):
                    position += 1
                    source, number = self._stands_for(source, position, content)
                    known = self._take(source, number, content)
                    if isinstance(work, Input) and source.item != work.line:
                        work = work.in_line(source.item)
                    number = self._number(number) if known is None else known.number
                    marks.append(
                        {"number": number, "digest": content, "given": self._given}
                    )
                    are_new.append(known is None)
                # Of a line that differs, the log may have the next one instead; not of
                # the first of many columns, for which M may have changed.
                if isinstance(work, QColumns) and work.first == 1 and all(are_new):
                    for source in work.sources:
                        if self._places[source]:
                            raise _changed(source)
                yield from _parts(work, marks, are_new)

    def remarks(self) -> list[str]:
        """Return the line, if any, that names the problems with records that have not
        come: they are gone or have changed."""
        left = [each for records in self._left.values() for each in records]
        if not left:
            return []
        names = ", ".join(str(each.source) for each in left[:MAX_NAMED])
        more = ", ..." if len(left) > MAX_NAMED else ""
        return [
            f"--resume: the log has {count(len(left), 'result')} of problems that are "
            f"not given, or have changed: {names}{more}; delete their lines if they "
            "are not wanted"
        ]

    def _key(self, source: Source, number: int, digest: str) -> tuple[Any, str]:
        return number if self._is_moved else source.file, digest

    def _stands_for(
        self, source: Source, position: int, digest: str
    ) -> tuple[Source, int]:
        """Return the place and the position for which a problem stands: its own, unless
        an earlier one that the log lacks has taken its record, as of equal lines in a
        log that several processes have written."""
        own = self._key(source, position, digest), source
        return self._lent.pop(own, (source, position))

    def _take(self, source: Source, position: int, digest: str) -> Known | None:
        """Take out the record of a problem, that of the same item if there are several;
        None if there is none. Raise OptionError if the problem has changed."""
        key = self._key(source, position, digest)
        if records := self._left.get(key):
            alike = (at for at, each in enumerate(records) if each.source == source)
            known = records.pop(next(alike, 0))
            if not records:
                del self._left[key]
            if known.source != source:
                self._lent[key, known.source] = source, position
            self._places[known.source] -= 1
            self.ends[known.kind] += 1
            return known
        if self._is_moved and position in self._numbers:
            fault = f"has a problem other than {source} as number {position}"
            raise OptionError("--resume", fault, HINT)
        if source.item is None and self._places[source]:
            raise _changed(source)
        return None

    def _number(self, position: int) -> int:
        """Return the number of a problem that the log lacks: its position in the run,
        unless this is that of another one, as where problems have been added before."""
        if position in self._numbers or position <= self._added:
            self._added = self._last = self._last + 1
            return self._added
        self._last = max(self._last, position)
        return position


def _parts(
    work: Work, marks: Sequence[Mapping[str, Any]], are_new: Sequence[bool]
) -> Iterator[Work]:
    """Yield those parts of an input that are new."""
    marked = work._replace(marks=marks)
    if not isinstance(marked, QColumns):
        yield from [marked] * are_new[0]
        return
    for is_new, group in groupby(range(len(marks)), are_new.__getitem__):
        columns = list(group)
        if is_new:
            yield marked.part(columns[0], columns[-1] + 1)


def _changed(source: Source) -> OptionError:
    return OptionError(
        "--resume", f"has a result of {source} as it was before it changed", HINT
    )


def options_of(request: Request) -> dict[str, str]:
    """Return the options on which records depend, as texts, with digests of the files
    that they name."""
    given = {**request.inputs._asdict(), **vars(request)}
    nothing = None, False, ()
    given = {name: given[name] for name in OF_RUN if given[name] not in nothing}
    given |= {request.inputs.tables: True} if request.inputs.tables else {}
    if request.trace:
        given["trace"] = ""  # as logs of earlier versions have it
    given |= {"method": request.variants[0], **request.own, **vars(request.limits)}
    texts = {name: str(value) for name, value in given.items()}
    for name in {*STARTS, *BOUND_OPTIONS} & texts.keys():
        if os.path.isfile(text := texts[name]):
            texts[name] = f"{text} (digest {digest(Path(text).read_bytes())})"
    return texts


def _known(record: Mapping[str, Any], given: Mapping[str, str]) -> Known:
    """Return what is known of the problem of a record; raise OptionError if the record
    was written with other options."""
    number, word, exact = record["number"], record["status"], record.get("exact")
    source = Source(record.get("file"), record.get("item"))
    try:
        then = {**dict.fromkeys(given, "none"), **record["given"]}
        now = {**dict.fromkeys(then, "none"), **given}
        if other := next((name for name in now if then[name] != now[name]), None):
            fault = (
                f"was written with {other.replace('_', ' ')} {then[other]}, but "
                f"here it is {now[other]}"
            )
            raise OptionError(
                "--resume", fault, "give the same options, or begin a new log"
            )
        if number < 1:
            raise TypeError
        code = Exit.BAD_INPUT
        if word != UNREAD:
            code = (
                of_status(results.Status[word.upper()])
                if exact is None or exact["status"]
                else Exit.NOT_SOLVED
            )
            word = results.word_of(word, (record.get("answer") or {}).get("proved"))
        return Known(number, source, record["digest"], (word, code))
    except (KeyError, TypeError, AttributeError):
        fault = f"has a record of {source} that is damaged"
        raise OptionError("--resume", fault, "begin a new log") from None
