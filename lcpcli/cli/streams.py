"""Many problems solved by one method, each result written as soon as it is known; and how such a run is resumed."""

from __future__ import annotations

import os.path
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, closing, nullcontext, suppress
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from lcpcli.cli.declarations import COMPARE, STARTS, refuse, refuse_beside
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, NOT_SOLVED, SOLVED, of_several, of_status
from lcpcli.cli.output import Output
from lcpcli.cli.problems import tell
from lcpcli.cli.request import Request
from lcpcli.cli.terminal import STANDARD, Line, emit, shows_progress
from lcpcli.cli.workers import Task, TaskRecord, all_records
from lcpcli.errors import LCPError, OptionError, count
from lcpcli.files.atomic_write import gradual_writing, open_log, refuse_unwritable
from lcpcli.files.contents import Source, place
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import QColumns, Work, digest
from lcpcli.report import result_formats, wording
from lcpcli.solving import result

if TYPE_CHECKING:
    from lcpcli.cli.pools import Pool

READING_SECONDS = 0.5  # after an interruption, for the number of problems
Write = Callable[[str], object]
Kind = tuple[str, int]  # how a run ended: a word and an exit code


def run(works: Iterator[Work], output: Output, request: Request) -> int:
    """Solve the problems in the inputs, write each result, and return the exit code."""
    hint = "give --trace without a file, and JSON"
    refuse(output.trace_path is not None, "--trace", "writes the iterates of one problem only", hint)
    is_whole = not output.silent and output.form not in result_formats.FORMS
    refuse(is_whole, "--format", f"{output.form} is for one problem only", COMPARE)
    modes = {"several problems": True, "tables of several problems": output.form != "json"}
    modes |= {wording.flag(name): bool(getattr(request, name)) for name in ("resume", "cluster", "sequence")}
    for mode, is_asked in modes.items():
        refuse_beside(mode, request.given, is_asked)
    is_log = output.form == "json" and (output.path or "").casefold().endswith(LINES)
    log_path = request.resume or (output.path if is_log else None)
    if request.resume and not Path(request.resume).exists():
        if not request.resume.casefold().endswith(LINES):
            raise OptionError("--resume", f"there is no log {request.resume}", "name a log or a new FILE.jsonl")
        refuse_unwritable(request.resume)
    form = "json" if request.resume else "" if output.silent else output.form
    every = (request.every or 1) if output.with_iterates else None
    task = Task(request, form, result_formats.Layout.of(list(map(place, request.inputs.files)), output.width), every)
    if request.sequence:
        from lcpcli.solving.solver import Solver

        task = task._replace(steps=Solver.of(None, {**request.given_limits, "interrupts": "return"}))
    tally, ends = _Tally(), Counter[Kind]()  # of this run, and of problems with records, by the thread that reads
    with _pool(request) as pool, ExitStack() as stack:
        left, write = tally.counted(works), cast(Write, len if output.silent else partial(emit, color=False))
        if log_path is not None:  # each record as soon as it is known, but for problems that have one
            book = stack.enter_context(open_log(log_path, anew=not request.resume))
            given, write = options_of(request), book.add
            past = dict(_known(record, given) for record in book.records()) if request.resume else {}
            left = missing(left, given, past, ends)
        elif output.path is not None and not output.silent:
            write = stack.enter_context(gradual_writing(output.path))
        records = all_records(task, left, pool, in_order=log_path is None)
        if log_path is None:
            write(result_formats.heading(task.form, task.layout))
        is_to_file = log_path is not None or output.path is not None
        tally.write(records, write, with_progress=shows_progress(request.quiet) and is_to_file)
    tally.read_on(left, request)
    tally.ends = ends + tally.ends
    tell(tally.summary(log_path), request.quiet)
    return tally.ending or of_several({SOLVED, *(code for _, code in tally.ends)})


class _Tally:
    """The numbers of problems by how they ended, a word and an exit code; and the exit code of an interrupted run."""

    def __init__(self) -> None:
        self.ends = Counter[Kind]()
        self.ending = 0
        self._total, self._is_known = 0, False  # the problems that were read; whether these are all

    def counted(self, works: Iterator[Work]) -> Iterator[Work]:
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
        words = Counter(word for word, _ in self.ends.elements())
        numbers = ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in words.most_common())
        problems = count(words.total(), "problem")
        if self.ending and self._is_known:
            problems = f"{words.total()} of {count(self._total, 'problem')}"
        line = f"{problems}{': ' * bool(numbers)}{numbers}"
        hint = f"go on with --resume {log_path}" if log_path else "with -o FILE.jsonl it could be resumed"
        return f"{line}; interrupted; {hint}" if self.ending else line


def _pool(request: Request) -> AbstractContextManager[Pool | None]:
    """Return a context with the processes or the cluster that solve the problems, if it is not done here. Processes
    start before files are opened, which they could keep open."""
    cluster, jobs = request.cluster, request.jobs or 1
    if cluster is None and jobs == 1:
        return nullcontext(None)
    from lcpcli.cli.pools import Cluster, Local

    return closing(Local(jobs) if cluster is None else Cluster(cluster))


OF_RUN = (*BOUND_OPTIONS, "game", "exact", "bound", "sequence", "trace", "every")  # options on which records depend
MARKED_TOGETHER = 4096  # q of one M whose marks are made at once: many, to share the cost; few, not to delay the first
HINT = "give the same files, delete its line to solve it again, or begin a new log"

Past = dict[int, tuple[str, Kind, Source]]  # by the number of a problem, its digest, how its run ended, and its place


def options_of(request: Request) -> dict[str, str]:
    """Return the options on which records depend, as texts, with digests of the files that they name."""
    given = {**request.inputs._asdict(), **request._asdict()}
    given = {name: given[name] for name in OF_RUN if given[name] not in (None, False)}
    given |= {"method": request.variants[0], **request.own, **vars(request.limits)}
    texts = {name: str(value) for name, value in given.items()}
    for name in {*STARTS, *BOUND_OPTIONS} & texts.keys():
        if os.path.isfile(text := texts[name]):
            texts[name] = f"{text} (digest {digest(Path(text).read_bytes())})"
    return texts


def missing(works: Iterator[Work], given: Mapping[str, str], past: Past, ends: Counter[Kind]) -> Iterator[Work]:
    """Yield the inputs that a log lacks, with the marks of their records; raise OptionError if it is not a log of them.

    given : the options. past : what the log has. ends : counts how the runs of these problems ended.
    """
    number, places = 0, {source for _, _, source in past.values()}
    for whole in works:
        for work in whole.parts(MARKED_TOGETHER) if isinstance(whole, QColumns) else [whole]:
            marks: list[dict[str, Any]]
            marks = [{"number": i, "digest": own, "given": given} for i, own in enumerate(work.digests, number + 1)]
            are_new = [mark["number"] not in past for mark in marks]
            for source, mark in zip(work.sources, marks, strict=True):
                number = mark["number"]
                is_elsewhere = number not in past and source._replace(mark=None) in places
                own, kind, _ = past.pop(number, (mark["digest"], None, source))
                if is_elsewhere:
                    raise OptionError("--resume", f"has {source} under another number than {number}", HINT)
                if own != mark["digest"]:
                    raise OptionError("--resume", f"has a problem other than {source} as number {number}", HINT)
                ends.update([kind] if kind else [])
            marked = work._replace(marks=marks)
            if isinstance(marked, QColumns):
                stretches = [list(own) for is_new, own in groupby(range(len(marks)), are_new.__getitem__) if is_new]
                yield from (marked.part(own[0], own[-1] + 1) for own in stretches)
            elif are_new[0]:
                yield marked
    if past:
        fault = f"has a result of problem {max(past)}, but the last problem is number {number}"
        raise OptionError("--resume", fault, HINT)


def _known(record: Mapping[str, Any], given: Mapping[str, str]) -> tuple[int, tuple[str, Kind, Source]]:
    """Return the number of the problem of a record, its digest, how its run ended, and its place; raise OptionError if
    the record was written with other options."""
    number, word, exact = record["number"], record["status"], record["exact"]
    source = Source(record.get("file"), record.get("item"))
    try:
        then = {**dict.fromkeys(given, "none"), **record["given"]}
        now = {**dict.fromkeys(then, "none"), **given}
        if other := next((name for name in now if then[name] != now[name]), None):
            fault = f"was written with {other.replace('_', ' ')} {then[other]}, but here it is {now[other]}"
            raise OptionError("--resume", fault, "give the same options, or begin a new log")
        if number < 1:
            raise TypeError
        code = BAD_INPUT
        if word != result_formats.BAD_INPUT:
            code = of_status(result.Status[word.upper()]) if exact is None or exact["status"] else NOT_SOLVED
            word = result.word_of(word, (record["answer"] or {}).get("proved"))
        return number, (record["digest"], (word, code), source)
    except (KeyError, TypeError, AttributeError):
        fault = f"has a record of {source} that is damaged"
        raise OptionError("--resume", fault, "begin a new log") from None
