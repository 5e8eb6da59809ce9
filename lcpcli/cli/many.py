"""Many problems with one method, from parsed options to an exit code: each is written as soon as it is solved."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from itertools import chain
from typing import TYPE_CHECKING, Any

import click

from lcpcli import options
from lcpcli.cli import exit_codes
from lcpcli.cli.output import Output, emit
from lcpcli.cli.pools import Cluster, Local, Pool
from lcpcli.cli.problems import tell
from lcpcli.cli.progress import Line, wanted
from lcpcli.cli.records import Record, Task
from lcpcli.cli.workers import elsewhere, here
from lcpcli.errors import OptionError, count
from lcpcli.files import log
from lcpcli.files.atomic_write import written_gradually
from lcpcli.files.formats import LINES
from lcpcli.files.inputs import QColumns, Work
from lcpcli.files.reading import place
from lcpcli.files.source import Source
from lcpcli.methods.registry import OPTIONS
from lcpcli.options import JOBS, LIMITS
from lcpcli.report import rows
from lcpcli.report.numbers import finite
from lcpcli.report.render import BAD_INPUT
from lcpcli.solving.result import Status

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
    form = "json" if given["resume"] else "" if output.silent else output.form
    width = rows.width_of([place(file) for file in files])
    every = (given["every"] or 1) if output.with_iterates else None
    task = Task(variant, given, exact, form, width, every)
    tally = _Tally()
    if given["resume"]:
        works = _left(works, log.records(given["resume"]), task, tally)
    with (
        _records(task, works, given) as records,
        _written(output, log_path, bool(given["resume"])) as write,
        Line() as line,
    ):
        write(rows.heading(task.form, task.width))
        try:
            for record in records:
                write(record.text)
                tally.add(record)
                for complaint in record.complaints:
                    tell(complaint)
                if wanted(given["quiet"]) and output.path:
                    line.tell_number(tally.total)
                if record.interrupted:
                    raise KeyboardInterrupt
        except KeyboardInterrupt:
            tally.interrupted = True
    if not given["quiet"]:
        click.echo(tally.told(log_path), err=True)
    return tally.exit_code


class _Tally:
    """How many problems ended how."""

    def __init__(self) -> None:
        self.words: Counter[str] = Counter()
        self.codes = {exit_codes.SOLVED}
        self.interrupted = False

    @property
    def total(self) -> int:
        return self.words.total()

    def add(self, record: Record) -> None:
        self.words[record.word] += 1
        self.codes.add(record.exit_code)

    @property
    def exit_code(self) -> int:
        return exit_codes.INTERRUPTED if self.interrupted else exit_codes.of_several(self.codes)

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
    if not output.silent and output.form not in rows.FORMS:
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
def _records(task: Task, works: Iterator[Work], given: Mapping[str, Any]) -> Iterator[Iterator[Record]]:
    """A context with the records, made by whom the options say."""
    pool: Pool
    if given["cluster"] is not None:
        pool = Cluster(given["cluster"])
    elif (given["jobs"] or 1) > 1:
        pool = Local(given["jobs"])
    else:
        yield here(task, works)
        return
    try:
        yield elsewhere(task, works, pool)
    finally:
        pool.close()


def _written(output: Output, log_path: str | None, resumed: bool) -> AbstractContextManager[Write]:
    """A context with a function that writes a text where the output goes."""
    if log_path:
        return log.appended(log_path, anew=not resumed)
    if output.path:
        return written_gradually(output.path)
    return _printed(output.silent)


@contextmanager
def _printed(silent: bool) -> Iterator[Write]:
    yield (lambda _: None) if silent else (lambda text: emit(text, color=False))


def _left(works: Iterator[Work], done: Iterator[Mapping[str, Any]], task: Task, tally: _Tally) -> Iterator[Work]:
    """The inputs without those that a log has; OptionError if it is not a log of these inputs, with these options."""
    rest: Work | None = None
    places: list[Source] = []
    at = 0
    for record in done:
        if at == len(places):
            rest, at = next(works, None), 0
            places = [] if rest is None else rest.sources
        source = Source(record["file"], record["item"])
        if not places or source != places[at]:
            raise OptionError("--resume", f"has a result of {source}, which does not come next", "give the same files")
        try:
            logged = _logged(record)
            _refuse_other_options(record, task)
            tally.add(logged)
        except (KeyError, TypeError, AttributeError):
            raise OptionError("--resume", f"has a record of {source} that is damaged", "begin a new log") from None
        at += 1
    return chain([rest.part(at, len(places))], works) if isinstance(rest, QColumns) and at < len(places) else works


def _refuse_other_options(record: Mapping[str, Any], task: Task) -> None:
    """Raise OptionError if a record was made by another method or with other limits."""
    if record.get("method") is None:  # it was not solved
        return
    then = {**record, **record["options"], "exact": record["exact"] is not None}
    now: dict[str, Any] = {"method": task.variant.method, "exact": task.exact}
    now |= {name: task.given[name] for name in OPTIONS if task.given[name] is not None} | task.variant.options
    for limit in LIMITS:
        value = limit.default if task.given[limit.name] is None else task.given[limit.name]
        now[limit.name] = finite(value)
    for name, value in now.items():
        if then[name] != value:
            fault = f"was written with {name.replace('_', ' ')} {then[name]}, here it is {value}"
            raise OptionError("--resume", fault, "give the same options, or begin a new log")


def _logged(record: Mapping[str, Any]) -> Record:
    """A record of a log, without its text."""
    word = record["status"]
    if word == BAD_INPUT:
        return Record("", word, exit_codes.BAD_INPUT)
    unproved = record["exact"] is not None and record["exact"]["status"] is None
    return Record("", word, exit_codes.NOT_SOLVED if unproved else Status[word.upper()].exit_code)
