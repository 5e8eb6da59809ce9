"""A run of many problems that continues its log: what the log has, and which problems
are missing.

A record is recognized by the file of its problem and by a digest of the problem, at any
position in the run, so that files, lines and columns may have been added since. If the
log has none of the files of the run, as when they have been moved, records are
recognized by the numbers of the problems, and all digests must agree.
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
from lcpcli.files.contents import Source, source_name
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.inputs import Input, InputItem, QColumns, digest
from lcpcli.report.result_formats import BAD_INPUT as UNREAD
from lcpcli.solving import result as results

Kind = tuple[str, Exit]  # how a run ended: a word and an exit code

# Options on which records depend.
OF_RUN = (
    *BOUND_OPTIONS,
    "exact",
    "bound",
    "sequence",
    "trace",
    "every",
    "columns",
)
# The number of q with one M whose digests are computed at once: many share the cost for
# M, but the first one has to wait for all of them.
MARKED_TOGETHER = 4096
MAX_NAMED = 5  # problems that one line names
HINT = "give the same files, delete its line to solve it again, or begin a new log"


class LogRecord(NamedTuple):
    """A record of a log: the number of its problem in the run, where the problem was
    read, its digest, and how its run ended."""

    number: int
    source: Source
    digest: str
    kind: Kind


class Past:
    """The records of a log, which `missing` takes out as their problems come.

    outcomes : counts how the runs of the problems ended that have come.
    """

    def __init__(self, records: Iterable[Mapping[str, Any]], request: Request) -> None:
        self._options = options_of(request)
        log_records = [_log_record(record, self._options) for record in records]
        files = set(map(source_name, request.inputs.files))
        self._is_moved = files.isdisjoint(each.source.file for each in log_records)
        self._unmatched: dict[tuple[Any, str], list[LogRecord]] = {}
        for each in log_records:
            key = self._key(each.source, each.number, each.digest)
            self._unmatched.setdefault(key, []).append(each)
        self._numbers = {each.number for each in log_records}
        self._places = Counter(
            each.source for each in log_records
        )  # of the remaining records
        self._last = max(self._numbers, default=0)
        self._added = 0  # the last number of a problem that has been added
        # For a problem whose record an earlier problem of the same content has taken:
        # the source and the position of that earlier one.
        self._lent: dict[tuple[tuple[Any, str], Source], tuple[Source, int]] = {}
        self.outcomes = Counter[Kind]()

    def missing(self, input_items: Iterator[InputItem]) -> Iterator[InputItem]:
        """Yield the inputs that the log lacks, with the marks of their records; raise
        OptionError if it is not a log of them."""
        position = 0
        for unsplit in input_items:
            for input_item in (
                unsplit.parts(MARKED_TOGETHER)
                if isinstance(unsplit, QColumns)
                else [unsplit]
            ):
                log_entries: list[Mapping[str, Any]] = []
                are_new: list[bool] = []
                for source, content in zip(
                    input_item.sources, input_item.digests, strict=True
                ):
                    position += 1
                    source, number = self._stands_for(source, position, content)
                    log_record = self._take(source, number, content)
                    if isinstance(input_item, Input) and source.item != input_item.line:
                        input_item = input_item.in_line(source.item)
                    number = (
                        self._number(number)
                        if log_record is None
                        else log_record.number
                    )
                    log_entries.append(
                        {"number": number, "digest": content, "given": self._options}
                    )
                    are_new.append(log_record is None)
                # Of a line that differs, the log may have the next one instead; not of
                # the first of many columns, for which M may have changed.
                if (
                    isinstance(input_item, QColumns)
                    and input_item.first == 1
                    and all(are_new)
                ):
                    for source in input_item.sources:
                        if self._places[source]:
                            raise _changed(source)
                yield from _parts(input_item, log_entries, are_new)

    def remarks(self) -> list[str]:
        """Return the line, if any, on records whose problems are no longer in the files
        of the run, or have changed."""
        unmatched = [each for records in self._unmatched.values() for each in records]
        if not unmatched:
            return []
        names = ", ".join(str(each.source) for each in unmatched[:MAX_NAMED])
        more = ", ..." if len(unmatched) > MAX_NAMED else ""
        return [
            f"--resume: the log has {count(len(unmatched), 'result')} of problems that "
            f"are not among the inputs, or have changed: {names}{more}; delete their "
            "lines if they are not wanted"
        ]

    def _key(self, source: Source, number: int, digest: str) -> tuple[Any, str]:
        return number if self._is_moved else source.file, digest

    def _stands_for(
        self, source: Source, position: int, digest: str
    ) -> tuple[Source, int]:
        """Return the source and the position to record for a problem: those of the
        problem, unless an earlier problem of the same content, which the log lacks, has
        taken its record. So it is for equal lines in a log that several processes have
        written."""
        key = self._key(source, position, digest), source
        return self._lent.pop(key, (source, position))

    def _take(self, source: Source, position: int, digest: str) -> LogRecord | None:
        """Take out the record of a problem, that of the same item if there are several;
        None if there is none. Raise OptionError if the problem has changed."""
        key = self._key(source, position, digest)
        if records := self._unmatched.get(key):
            alike = (at for at, each in enumerate(records) if each.source == source)
            log_record = records.pop(next(alike, 0))
            if not records:
                del self._unmatched[key]
            if log_record.source != source:
                self._lent[key, log_record.source] = source, position
            self._places[log_record.source] -= 1
            self.outcomes[log_record.kind] += 1
            return log_record
        if self._is_moved and position in self._numbers:
            reason = f"has a problem other than {source} as number {position}"
            raise OptionError("--resume", reason, HINT)
        if source.item is None and self._places[source]:
            raise _changed(source)
        return None

    def _number(self, position: int) -> int:
        """Return the number of a problem that the log lacks: its position in the run,
        unless this number is that of another one, as where problems have been added
        before."""
        if position in self._numbers or position <= self._added:
            self._added = self._last = self._last + 1
            return self._added
        self._last = max(self._last, position)
        return position


def _parts(
    input_item: InputItem,
    log_entries: Sequence[Mapping[str, Any]],
    are_new: Sequence[bool],
) -> Iterator[InputItem]:
    """Yield those parts of an input that are new."""
    marked = input_item._replace(log_entries=log_entries)
    if not isinstance(marked, QColumns):
        yield from [marked] * are_new[0]
        return
    for is_new, group in groupby(range(len(log_entries)), are_new.__getitem__):
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
    options = {**request.inputs._asdict(), **vars(request)}
    nothing = None, False, ()
    options = {name: options[name] for name in OF_RUN if options[name] not in nothing}
    options |= {request.inputs.tables: True} if request.inputs.tables else {}
    if request.trace:
        options["trace"] = ""  # as logs of earlier versions have it
    options |= {
        "method": request.variants[0],
        **request.method_options,
        **vars(request.limits),
    }
    texts = {name: str(value) for name, value in options.items()}
    for name in {*STARTS, *BOUND_OPTIONS} & texts.keys():
        if os.path.isfile(text := texts[name]):
            texts[name] = f"{text} (digest {digest(Path(text).read_bytes())})"
    return texts


def _log_record(record: Mapping[str, Any], options: Mapping[str, str]) -> LogRecord:
    """Return what is known of the problem of a record; raise OptionError if the record
    was written with other options."""
    number = record["number"]
    status = record["status"]
    exact = record.get("exact")
    source = Source(record["file"], record["item"])
    try:
        then = {**dict.fromkeys(options, "none"), **record["given"]}
        now = {**dict.fromkeys(then, "none"), **options}
        if other := next((name for name in now if then[name] != now[name]), None):
            reason = (
                f"was written with {other.replace('_', ' ')} {then[other]}, but "
                f"here it is {now[other]}"
            )
            raise OptionError(
                "--resume", reason, "give the same options, or begin a new log"
            )
        hash((source.file, source.item, record["digest"]))  # may raise TypeError
        if number < 1:
            raise TypeError
        code = Exit.BAD_INPUT
        if status != UNREAD:
            code = (
                of_status(results.Status[status.upper()])
                if exact is None or exact["status"]
                else Exit.NOT_SOLVED
            )
            status = results.word_of(status, (record.get("answer") or {}).get("proved"))
        return LogRecord(number, source, record["digest"], (status, code))
    except (KeyError, TypeError, AttributeError):
        reason = f"has a record of {source} that is damaged"
        raise OptionError("--resume", reason, "begin a new log") from None
