"""Many problems solved by one method, in this process or others; each result is written as soon as it is known.

How a run of many problems is resumed: which problems are in its log, and which are left.
"""

from __future__ import annotations

import itertools
import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext, suppress
from functools import cached_property, partial
from itertools import groupby
from pathlib import Path
from typing import Any

from lcpcli.cli.declarations import COMPARE, STARTS, refuse_beside
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, NOT_SOLVED, SOLVED, of_several, of_status
from lcpcli.cli.output import Output, refuse
from lcpcli.cli.problems import tell
from lcpcli.cli.request import Request
from lcpcli.cli.terminal import STANDARD, Line, emit, shows_progress
from lcpcli.cli.workers import Task, TaskRecord, elsewhere
from lcpcli.errors import LCPError, OptionError, count
from lcpcli.files import log
from lcpcli.files.atomic_write import gradual_writing, refuse_unwritable
from lcpcli.files.contents import Source, place
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import QColumns, Work, digest
from lcpcli.files.log import Log
from lcpcli.methods.registry import NONLINEAR, OPTIONS
from lcpcli.options import AUTO
from lcpcli.report import result_formats
from lcpcli.report.wording import finite
from lcpcli.solving.answer import word_of
from lcpcli.solving.result import Status

READING_SECONDS = 0.5  # after an interruption, for the number of problems
Write = Callable[[str], object]


def run(works: Iterator[Work], output: Output, request: Request) -> int:
    """Solve the problems in the inputs, write each result, and return the exit code."""
    _refuse_without_effect(output, request)
    is_log = output.form == "json" and (output.path or "").casefold().endswith(LINES)
    log_path = request.resume or (output.path if is_log else None)
    if request.resume and not Path(request.resume).exists():
        if not request.resume.casefold().endswith(LINES):
            raise OptionError("--resume", f"there is no log {request.resume}", "name a log or a new FILE.jsonl")
        refuse_unwritable(request.resume)
    form = "json" if request.resume else "" if output.silent else output.form
    every = (request.every or 1) if output.with_iterates else None
    layout = result_formats.Layout.of(list(map(place, request.inputs.files)), output.width)
    task = Task(request, form, layout, every)
    if request.sequence:
        from lcpcli.solving.solver import SequenceSteps

        task = task._replace(steps=SequenceSteps({**request.given_limits, "interrupts": "return"}))
    tally = _Tally()
    if log_path is None:
        destination: AbstractContextManager[Write] = nullcontext(partial(emit, color=False))
        if output.silent:
            destination = nullcontext(len)
        elif output.path is not None:
            destination = gradual_writing(output.path)
        works = tally.counted(works)
        with _records(task, works, in_order=True) as records, destination as write:
            write(result_formats.heading(task.form, task.layout))
            tally.write(records, write, with_progress=shows_progress(request.quiet) and output.path is not None)
        tally.read_on(works, request)
    else:
        _log(works, log_path, task, tally)
    if not request.quiet:
        tell(tally.summary(log_path))
    return tally.ending or of_several({SOLVED, *(code for _, code in tally.ends)})


def _log(works: Iterator[Work], path: str, task: Task, tally: _Tally) -> None:
    """Write records to a log, each as soon as it is known; skip the problems with records in a resumed log."""
    request = task.request
    options, past = hidden_options(request), Past(request.inputs.files)
    with log.open_log(path, anew=not request.resume) as book:
        if request.resume:
            past.read(book, task, options)
        left = _beginning(past.rest(with_marks(tally.counted(works), options)), book.reopen)
        with _records(task, left, in_order=False) as records:
            if not request.resume:
                book.clear()
            tally.write(records, book.add, with_progress=shows_progress(request.quiet))
        tally.read_on(left, request)
        tally.ends = Counter(past.ends) + tally.ends
        if not tally.ending:
            book.end(past.has_replaced)


def _beginning(works: Iterator[Work], begin: Callable[[], object]) -> Iterator[Work]:
    """Yield the inputs; call `begin` before the first one."""
    for number, work in enumerate(works):
        if not number:
            begin()
        yield work


class _Tally:
    """The numbers of problems by how they ended, a word and an exit code; and the exit code of an interrupted run."""

    def __init__(self) -> None:
        self.ends: Counter[tuple[str, int]] = Counter()
        self.ending = 0
        self._total, self._is_known = 0, False  # the problems that were read; whether these are all

    def counted(self, works: Iterator[Work]) -> Iterator[Work]:
        """Yield the inputs, and count their problems."""
        for work in works:
            self._total += len(work.sources)
            yield work
        self._is_known = True

    def read_on(self, works: Iterator[Work], request: Request) -> None:
        """Read the inputs that an interrupted run has not come to, for the number of problems, where that takes at most
        half a second and neither another thread nor whoever writes them."""
        if not self.ending or request.cluster is not None or (request.jobs or 1) > 1:
            return
        files = list(map(Path, request.inputs.files))
        if Path(STANDARD) in files or any(file.exists() and not file.is_file() for file in files):
            return
        end = time.monotonic() + READING_SECONDS
        with suppress(LCPError, KeyboardInterrupt):
            while time.monotonic() < end and next(works, None) is not None:
                pass

    def write(self, records: Iterator[TaskRecord], write: Write, with_progress: bool) -> None:
        """Write all records and count them. with_progress : whether their number is shown meanwhile."""
        with Line() as line:
            try:
                for number, record in enumerate(records, 1):
                    write(record.text)
                    self.ends[record.word, record.exit_code] += 1
                    for complaint in record.complaints:
                        tell(complaint)
                    if with_progress:
                        line.tell_number(number)
                    if record.interrupted:
                        raise KeyboardInterrupt
            except KeyboardInterrupt:
                self.ending = INTERRUPTED

    def summary(self, log_path: str | None) -> str:
        words: Counter[str] = Counter()
        for (word, _), number in self.ends.items():
            words[word] += number
        numbers = ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in words.most_common())
        problems = count(words.total(), "problem")
        if self.ending and self._is_known:
            problems = f"{words.total()} of {count(self._total, 'problem')}"
        line = f"{problems}{': ' * bool(numbers)}{numbers}"
        hint = f"go on with --resume {log_path}" if log_path else "with -o FILE.jsonl it could be resumed"
        return f"{line}; interrupted; {hint}" if self.ending else line


def _refuse_without_effect(output: Output, request: Request) -> None:
    hint = "give --trace without a file, and JSON"
    refuse(output.trace_path is not None, "--trace", "writes the iterates of one problem only", hint)
    is_whole = not output.silent and output.form not in result_formats.FORMS
    refuse(is_whole, "--format", f"{output.form} is for one problem only", COMPARE)
    modes = {"tables of several problems": output.form != "json", "--resume": request.resume is not None}
    modes |= {"--cluster": request.cluster is not None, "--sequence": request.sequence}
    for mode in ("several problems", *(mode for mode, is_asked in modes.items() if is_asked)):
        refuse_beside(mode, request.given)


@contextmanager
def _records(task: Task, works: Iterator[Work], in_order: bool) -> Iterator[Iterator[TaskRecord]]:
    """Open a context with the records, made here, by processes or by a cluster, in order or as they become known."""
    cluster, jobs = task.request.cluster, task.request.jobs or 1
    if cluster is None and jobs == 1:
        yield (record for work in works for record in task.records(work))
        return
    from lcpcli.cli.pools import Cluster, Local

    with closing(Local(jobs) if cluster is None else Cluster(cluster)) as pool:
        yield elsewhere(task, works, pool, in_order)


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
    numbers = itertools.count(1)
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
    word = record["status"]
    if word == result_formats.BAD_INPUT:
        return word, BAD_INPUT
    unproved = record["exact"] is not None and record["exact"]["status"] is None
    code = NOT_SOLVED if unproved else of_status(Status[word.upper()])
    return word_of(word, (record.get("answer") or {}).get("proved")), code
