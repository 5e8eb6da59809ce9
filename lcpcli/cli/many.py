"""Many problems with one method, from parsed options to an exit code: each is written as soon as it is solved."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lcpcli import options
from lcpcli.cli import exit_codes, resumption
from lcpcli.cli.output import Output, emit
from lcpcli.cli.pools import Cluster, Local, Pool, Terminated, ending_on_request
from lcpcli.cli.problems import tell
from lcpcli.cli.progress import Line, wanted
from lcpcli.cli.records import Record, Task
from lcpcli.cli.workers import elsewhere, here
from lcpcli.errors import OptionError, count
from lcpcli.files import log
from lcpcli.files.atomic_write import refuse_unwritable, written_gradually
from lcpcli.files.contents import place
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import Work
from lcpcli.options import JOBS
from lcpcli.report import formats

if TYPE_CHECKING:
    from lcpcli.methods.variants import Variant

COMPARE = "leave it out, or use lcp compare"
Write = Callable[[str], object]


def run(
    works: Iterator[Work],
    output: Output,
    files: Sequence[str],
    variant: Variant,
    given: dict[str, Any],
    exact: bool,
) -> int:
    """Solve the problems in the inputs, which come from these files; write each result; return the exit code."""
    _refuse_without_effect(output, given)
    is_log = output.form == "json" and (output.path or "").casefold().endswith(LINES)
    log_path = given["resume"] or (output.path if is_log else None)
    if given["resume"] and not Path(given["resume"]).exists():
        if not given["resume"].casefold().endswith(LINES):
            raise OptionError("--resume", f"there is no log {given['resume']}", "name one, or a new FILE.jsonl")
        refuse_unwritable(given["resume"])
    form = "json" if given["resume"] else "" if output.silent else output.form
    width = formats.width_of([place(file) for file in files])
    every = (given["every"] or 1) if output.with_iterates else None
    task = Task(variant, given, exact, form, width, every)
    tally = _Tally()
    if log_path is None:
        with _records(task, works, given, in_order=True) as records, _written(output) as write:
            write(formats.heading(task.form, task.width))
            _finish(records, write, tally, is_told=wanted(given["quiet"]) and output.path is not None)
    else:
        _log(works, log_path, task, tally)
    if not given["quiet"]:
        click.echo(tally.told(log_path), err=True)
    return tally.exit_code


def _log(works: Iterator[Work], path: str, task: Task, tally: _Tally) -> None:
    """Write records to a log, each as soon as it is known; leave out those that a log to be resumed has."""
    given = task.given
    options, past = resumption.unshown(given), resumption.Past()
    with log.opened(path, anew=not given["resume"]) as book:
        if given["resume"]:
            past.read(book, task, options)
        left = past.left(resumption.marked(works, options))
        with _records(task, left, given, in_order=False) as records:
            if not given["resume"]:
                book.clear()
            _finish(records, book.add, tally, is_told=wanted(given["quiet"]))
        tally.add_before(past.records)
        if not tally.interrupted:
            book.end(past.has_replaced)


def _finish(records: Iterator[Record], write: Write, tally: _Tally, is_told: bool) -> None:
    """Write all records and count them. is_told : whether their number is shown meanwhile."""
    with Line() as line:
        try:
            for record in records:
                write(record.text)
                tally.add(record)
                for complaint in record.complaints:
                    tell(complaint)
                if is_told:
                    line.tell_number(tally.total)
                if record.interrupted:
                    raise KeyboardInterrupt
        except KeyboardInterrupt as request:
            tally.interrupted = True
            tally.ending = exit_codes.TERMINATED if isinstance(request, Terminated) else exit_codes.INTERRUPTED


class _Tally:
    """How many problems ended how."""

    def __init__(self) -> None:
        self.words: Counter[str] = Counter()
        self.codes = {exit_codes.SOLVED}
        self.interrupted, self.ending = False, exit_codes.INTERRUPTED

    @property
    def total(self) -> int:
        return self.words.total()

    def add(self, record: Record) -> None:
        self.words[record.word] += 1
        self.codes.add(record.exit_code)

    def add_before(self, records: Iterable[Record]) -> None:
        """Count those of a log, which were there before."""
        past = Counter(records)
        self.words = sum((Counter({record.word: past[record]}) for record in past), Counter()) + self.words
        self.codes.update(record.exit_code for record in past)

    @property
    def exit_code(self) -> int:
        return self.ending if self.interrupted else exit_codes.of_several(self.codes)

    def told(self, log_path: str | None) -> str:
        """The summary, in one line."""
        numbers = ", ".join(f"{number} {word.replace('_', ' ')}" for word, number in self.words.most_common())
        line = f"lcp: {count(self.total, 'problem')}{': ' * bool(numbers)}{numbers}"
        if not self.interrupted:
            return line
        hint = f"go on with --resume {log_path}" if log_path else "with -o FILE.jsonl it could be resumed"
        return f"{line}; interrupted; {hint}"


def _refuse_without_effect(output: Output, given: Mapping[str, Any]) -> None:
    """Raise OptionError for what is not done with many problems, or not together."""
    if given["plot"] is not None:
        raise OptionError("--plot", "draws one problem only", COMPARE)
    if output.trace_path is not None:
        raise OptionError("--trace", "writes the iterates of one problem only", "give --trace without a file, and JSON")
    if not output.silent and output.form not in formats.FORMS:
        raise OptionError("--format", f"{output.form} is for one problem only", COMPARE)
    if output.with_iterates and output.form != "json":
        raise OptionError("--trace", "has no effect on several problems but in JSON", "give --format json")
    if given["every"] is not None and not output.with_iterates:
        raise OptionError("--every", "has no effect on several problems", "leave it out")
    if given["resume"] is not None:
        for name in ("output", "form"):
            if given[name] is not None:
                flag = {"output": "--output", "form": "--format"}[name]
                raise OptionError(flag, "has no effect with --resume, which goes on with its file", "leave it out")
    if given["jobs"] is not None and given["cluster"] is not None:
        raise OptionError("--jobs", "has no effect with --cluster, which has workers of its own", "leave it out")
    options.check((JOBS,), given)


@contextmanager
def _records(task: Task, works: Iterator[Work], given: Mapping[str, Any], in_order: bool) -> Iterator[Iterator[Record]]:
    """A context with the records, made by whom the options say, in the order of the problems or as they are known."""
    pool: Pool
    with ExitStack() as open_until_then:
        if given["cluster"] is not None:
            pool = Cluster(given["cluster"])
        elif (given["jobs"] or 1) > 1:
            open_until_then.enter_context(ending_on_request())
            pool = Local(given["jobs"])
        else:
            yield here(task, works)
            return
        open_until_then.callback(pool.close)
        yield elsewhere(task, works, pool, in_order)


def _written(output: Output) -> AbstractContextManager[Write]:
    """A context with a function that writes a text where the output goes."""
    if output.path:
        return written_gradually(output.path)
    return _printed(output.silent)


@contextmanager
def _printed(silent: bool) -> Iterator[Write]:
    yield (lambda _: None) if silent else (lambda text: emit(text, color=False))
