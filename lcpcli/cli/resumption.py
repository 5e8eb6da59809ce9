"""How a run of many problems is resumed: which problems are in its log, and which are left."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import count, groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lcpcli.cli.declarations import STARTS
from lcpcli.cli.main import BAD_INPUT, NOT_SOLVED, of_status
from lcpcli.errors import OptionError
from lcpcli.files.contents import Source
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.inputs import QColumns, Work, digest
from lcpcli.files.log import Log
from lcpcli.methods.registry import NONLINEAR, OPTIONS
from lcpcli.options import AUTO
from lcpcli.report import result_formats
from lcpcli.report.wording import finite
from lcpcli.solving.answer import word_of
from lcpcli.solving.result import Status

if TYPE_CHECKING:
    from lcpcli.cli.request import Request
    from lcpcli.cli.workers import Task

HIDDEN = (*BOUND_OPTIONS, "game", *STARTS, "sequence", "bound", "trace", "every")  # options that a result does not show
MARKED_TOGETHER = 4096  # q of one M whose marks are made at once: many, to share the cost; few, not to delay the first
FARTHEST_AHEAD = 2**20  # problems by which a record may be ahead of all before it; more is damage, and takes memory
HINT = "give the same files, or begin a new log"


def hidden_options(request: Request) -> dict[str, str]:
    """Return the options on which a result depends without showing them, with digests of the files that they name."""
    given = {**request.inputs._asdict(), **request.own, **request._asdict()}
    texts = {name: str(given[name]) for name in HIDDEN if given.get(name) not in (None, False)}
    for name, text in texts.items():
        if text and Path(text).is_file():
            texts[name] = f"{text} (digest {digest(Path(text).read_bytes())})"
    return texts


def with_marks(works: Iterator[Work], options: Mapping[str, str]) -> Iterator[Work]:
    """Yield the inputs with the marks of their records in a log. options : as from `hidden_options`."""
    numbers = count(1)
    for whole in works:
        parts: Iterable[Work] = [whole]
        if isinstance(whole, QColumns):
            parts = (whole.part(at, at + MARKED_TOGETHER) for at in range(0, len(whole.names), MARKED_TOGETHER))
        for work in parts:
            marks = [{"number": next(numbers), "digest": each, "given": options} for each in work.digests]
            yield work._replace(marks=marks)


class Past:
    """The problems that a log has, by number: the place in the input, the digest, and how the run ended.

    files : of the input. kinds : the ways in which runs ended, a word and an exit code each. has_replaced : whether
    some of the problems are solved again, as they have changed.
    """

    def __init__(self, files: Sequence[str]) -> None:
        self.kinds: list[tuple[str, int] | None] = [None]
        self.has_replaced = False
        self._seen = 0  # problems in the input until now
        self._are_distinct = len(set(files)) == len(files)  # then each place has one number
        self._ends = array("B", [0])  # by number, as positions in kinds: 17 bytes for each problem
        self._places, self._digests = array("Q", [0]), array("Q", [0])

    @property
    def ends(self) -> Iterator[tuple[str, int]]:
        """Yield for each record that still counts, of the problems that `rest` has read, how its problem ended."""
        return (kind for at in self._ends[: self._seen + 1] if (kind := self.kinds[at]) is not None)

    def read(self, log: Log, task: Task, options: Mapping[str, str]) -> None:
        """Read the records of a log; raise OptionError if it belongs to another task or to other options."""
        request = task.request
        (variant,) = request.variants
        now: dict[str, Any] = {"method": variant.method, "exact": request.exact}
        now |= {name: value for name, value in request.own.items() if name in OPTIONS} | variant.options
        now |= {name: finite(value) for name, value in vars(request.limits).items()}
        for number, record in log.records():
            place = Source(record["file"], record["item"])
            try:
                kind = _kind(record)
                _refuse_other_options(record, now, options)
                self._add(number, place, int(record["digest"], 16), kind)
            except OptionError:
                raise
            except (KeyError, TypeError, ValueError, OverflowError, AttributeError):
                fault = f"has a record of {place} that is damaged"
                raise OptionError("--resume", fault, "begin a new log") from None

    def rest(self, works: Iterator[Work]) -> Iterator[Work]:
        """Yield the inputs whose marks the log does not have; raise OptionError if it is not a log of these inputs."""
        for work in works:
            missing = [not self._has(source) for source in work.sources]
            self._seen += len(missing)
            if isinstance(work, QColumns):
                stretches = groupby(range(len(missing)), missing.__getitem__)
                numbers = [list(stretch) for is_missing, stretch in stretches if is_missing]
                yield from (work.part(stretch[0], stretch[-1] + 1) for stretch in numbers)
            elif missing[0]:
                yield work
        if self._seen < len(self._ends) - 1:
            fault = f"has a result of problem {len(self._ends) - 1}, but the last problem is number {self._seen}"
            raise OptionError("--resume", fault, HINT)

    @cached_property
    def _later(self) -> frozenset[int]:
        """Return the places with higher numbers than the first problem that the log lacks."""
        return frozenset(self._places[self._seen :])

    def _add(self, number: int, place: Source, its_digest: int, kind: tuple[str, int]) -> None:
        more = number + 1 - len(self._ends)
        if number < 1 or more > FARTHEST_AHEAD:
            raise ValueError
        for values in (self._ends, self._places, self._digests):
            values.extend([0] * more)
        self.has_replaced |= self._ends[number] != 0
        if kind not in self.kinds:
            self.kinds.append(kind)
        self._ends[number] = self.kinds.index(kind)
        self._places[number], self._digests[number] = _hash(place), its_digest

    def _has(self, source: Source) -> bool:
        assert source.mark is not None
        number = source.mark["number"]
        if number >= len(self._ends) or not self._ends[number]:
            if self._are_distinct and _hash(source) in self._later:
                raise OptionError("--resume", f"has {source} as another problem than number {number}", HINT)
            return False
        if self._places[number] != _hash(source):
            fault = f"has a problem other than {source} as number {number}"
            raise OptionError("--resume", fault, HINT)
        if self._digests[number] == int(source.mark["digest"], 16):
            return True
        self.has_replaced, self._ends[number] = True, 0
        return False


def _hash(place: Source) -> int:
    return int(digest(repr((place.file, place.item)).encode()), 16)


def _refuse_other_options(record: Mapping[str, Any], now: Mapping[str, Any], options: Mapping[str, str]) -> None:
    given = record["given"]
    _refuse_differences({**dict.fromkeys(options), **given}, {**dict.fromkeys(given), **options})
    if record.get("method") is None:  # it was not solved
        return
    then = {**record, **record["options"], "exact": record["exact"] is not None}
    if now["method"] == AUTO and record["method"] in NONLINEAR:  # which auto stands for
        then["method"] = AUTO
    _refuse_differences(then, now)


def _refuse_differences(then: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    for name, value in now.items():
        if then[name] != value:
            before, here = ("none" if each is None else each for each in (then[name], value))
            fault = f"was written with {name.replace('_', ' ')} {before}, but here it is {here}"
            raise OptionError("--resume", fault, "give the same options, or begin a new log")


def _kind(record: Mapping[str, Any]) -> tuple[str, int]:
    """Return how the problem of a record ended, as a word and an exit code."""
    word = record["status"]
    if word == result_formats.BAD_INPUT:
        return word, BAD_INPUT
    unproved = record["exact"] is not None and record["exact"]["status"] is None
    code = NOT_SOLVED if unproved else of_status(Status[word.upper()])
    return word_of(word, (record.get("answer") or {}).get("proved")), code
