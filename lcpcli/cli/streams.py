"""Many problems solved by one method, each result written as soon as it is known; and how such a run is resumed."""

from __future__ import annotations

import os.path
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from lcpcli.cli.declarations import COMPARE, STARTS, refuse, refuse_beside
from lcpcli.cli.main import BAD_INPUT, INTERRUPTED, NOT_SOLVED, SOLVED, of_several, of_status
from lcpcli.cli.output import Output
from lcpcli.cli.problems import tell
from lcpcli.cli.request import Request
from lcpcli.cli.terminal import Line, emit, shows_progress
from lcpcli.cli.workers import Task, TaskRecord, all_records
from lcpcli.errors import OptionError, count
from lcpcli.files.atomic_write import gradual_writing, open_log, refuse_unwritable
from lcpcli.files.contents import Source, place
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import QColumns, Work, digest
from lcpcli.report import result_formats, wording
from lcpcli.solving import result

if TYPE_CHECKING:
    from lcpcli.cli.pools import Pool

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
    refuse_beside(modes, request.given)
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

        task = task._replace(steps=Solver.of(None, {**request.numbers, "interrupts": "return"}))
    past_ends = Counter[Kind]()  # of problems with records, by the thread that reads
    with ExitStack() as stack:
        pool: Pool | None = None
        if request.cluster is not None or (request.jobs or 1) > 1:  # processes would keep files that are open
            from lcpcli.cli import pools

            pool = pools.Local(request.jobs or 1) if request.cluster is None else pools.Cluster(request.cluster)
            stack.enter_context(closing(pool))
        left, write = works, cast(Write, len if output.silent else partial(emit, color=False))
        if log_path is not None:  # each record as soon as it is known, but for problems that have one
            book = stack.enter_context(open_log(log_path, anew=not request.resume))
            given, write = options_of(request), book.add
            past = dict(_known(record, given) for record in book.records()) if request.resume else {}
            left = missing(left, given, past, past_ends)
        elif output.path is not None and not output.silent:
            write = stack.enter_context(gradual_writing(output.path))
        records = all_records(task, left, pool, in_order=log_path is None)
        if log_path is None:
            write(result_formats.heading(task.form, task.layout))
        is_to_file = log_path is not None or output.path is not None
        ends, is_interrupted = _written(records, write, shows_progress(request.quiet) and is_to_file)
    ends = past_ends + ends
    words = Counter(word for word, _ in ends.elements())
    numbers = ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in words.most_common())
    line = f"{count(words.total(), 'problem')}{': ' * bool(numbers)}{numbers}"
    hint = f"go on with --resume {log_path}" if log_path else "with -o FILE.jsonl it could be resumed"
    tell(f"{line}; interrupted; {hint}" if is_interrupted else line, request.quiet)
    return INTERRUPTED if is_interrupted else of_several({SOLVED, *(code for _, code in ends)})


def _written(records: Iterator[TaskRecord], write: Write, with_progress: bool) -> tuple[Counter[Kind], bool]:
    """Write all records; return how many problems ended how, and whether Ctrl-C ended that. with_progress : whether
    their number is shown meanwhile."""
    ends = Counter[Kind]()
    with Line() as line:
        try:
            for record in records:
                write(record.text)
                ends[record.word, record.exit_code] += 1
                for complaint in record.complaints:
                    tell(complaint)
                if with_progress:
                    line.tell_number(ends.total())
                if record.interrupted:
                    return ends, True
        except KeyboardInterrupt:
            return ends, True
    return ends, False


OF_RUN = (*BOUND_OPTIONS, "game", "exact", "bound", "sequence", "trace", "every")  # options on which records depend
MARKED_TOGETHER = 4096  # q of one M whose marks are made at once: many, to share the cost; few, not to delay the first
HINT = "give the same files, delete its line to solve it again, or begin a new log"

Past = dict[int, tuple[str, Kind, Source]]  # by the number of a problem, its digest, how its run ended, and its place


def options_of(request: Request) -> dict[str, str]:
    """Return the options on which records depend, as texts, with digests of the files that they name."""
    given = {**request.inputs._asdict(), **vars(request)}
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
