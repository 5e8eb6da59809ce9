"""Last week's runs against today's: two files of lcp bench, or of results of lcp solve
and compare, run by run.

    python tests/benchmarks/compare_runs.py last-week.json today.json --slower 1.5

--slower RATIO also counts a run as a failure that takes at least so many times as long,
beyond its spread. The exit code is 1 if a run is worse, contradicts the earlier one or
is slower by that, 2 if a file has no runs, else 0. Unchanged runs are only counted.
"""

import argparse
import json
import math
import sys
from collections import Counter
from contextlib import suppress
from itertools import count as count_from
from pathlib import PurePath
from statistics import geometric_mean
from typing import NamedTuple

from lcpcli.bench import record
from lcpcli.errors import Exit, LCPError, OptionError, count
from lcpcli.files.contents import content_of, decode, source_name, within
from lcpcli.files.json_format import objects_in
from lcpcli.report import wording
from lcpcli.report.document import Document, Section, Table, typeset
from lcpcli.solving.result import Status

# Medians within this factor are as before, as from one process to the next they differ
# by as much.
ALIKE = 1.1
# The same for runs that were made once, which other programs may have disturbed.
ALIKE_ONCE = 2.0
WORSE = "worse"
SLOWER = "slower"
BETTER = "better"
FASTER = "faster"
OTHER = "other status"
SAME = "as before"
GONE, NEW, CHANGED = "gone", "new", "another problem"
# One run solved the problem, the other one proved that it has no solution.
CONTRADICTION = "contradiction"
# The status of a problem that could not be read, whose digest is that of another text.
UNREAD = "bad_input"
SOLVED = Status.SOLVED.word
NAMES = ("problem", "method", "verdict", "status", "iterations", "seconds", "ratio")
EXPECTED = (
    "name a file of lcp bench -o FILE.json, or results of lcp solve or compare in JSON"
)

Key = tuple[str, str]  # a problem and a method


class Ending(NamedTuple):
    """How one run ended. is_good : whether it solved the problem or proved that it has
    no solution, and made no false claim. interval : of the median of repeated times.
    digest : of the problem, in a log."""

    status: str
    is_good: bool
    iterations: int | None
    seconds: float | None
    interval: tuple[float, float] | None = None
    digest: str | None = None


class Change(NamedTuple):
    key: Key
    old: Ending | None
    new: Ending | None

    @property
    def ratio(self):
        ends = [end for end in (self.old, self.new) if end and end.is_good]
        if len(ends) < 2 or not all(end.seconds for end in ends):
            return None
        return ends[1].seconds / ends[0].seconds

    @property
    def verdict(self):
        """Return what has changed: the ending first, then the time, if the intervals of
        both medians are apart."""
        old, new, ratio = self.old, self.new, self.ratio
        if old is None or new is None:
            return NEW if old is None else GONE
        if old.digest and new.digest and old.digest != new.digest:
            return CHANGED
        if old.is_good != new.is_good:
            return BETTER if new.is_good else WORSE
        if old.status != new.status:
            is_contradiction = old.is_good and SOLVED in (old.status, new.status)
            return CONTRADICTION if is_contradiction else OTHER
        if ratio is None:
            return SAME
        sooner, later = (old, new) if ratio > 1 else (new, old)
        factor, alike = max(ratio, 1 / ratio), ALIKE_ONCE
        if sooner.interval and later.interval:
            alike = ALIKE if later.interval[0] > sooner.interval[1] else math.inf
        return SAME if factor <= alike else SLOWER if ratio > 1 else FASTER


def changes_between(paths):
    """Return the changes of all runs from one file to another."""
    first, second = map(runs_in, paths)
    old, new = with_unread(first, second), with_unread(second, first)
    if not old.keys() & new.keys():
        fault = f"has no run in common with {source_name(paths[0])}"
        raise OptionError(source_name(paths[1]), fault, "name files of the same runs")
    return [Change(key, old.get(key), new.get(key)) for key in {**old, **new}]


def is_failure(change, limit):
    """Return whether a run is worse. limit : the ratio from which a slower one is."""
    return change.verdict in (WORSE, CONTRADICTION) or (
        change.verdict == SLOWER and (change.ratio or 0) >= limit
    )


def report(paths, changes):
    """Return the report on the changes, with a row for each run that is not as
    before."""
    counts = Counter(change.verdict for change in changes)
    ratios = [change.ratio for change in changes if change.ratio]
    verdict = (
        f"{count(len(changes), 'run')}: "
        f"{', '.join(f'{number} {kind}' for kind, number in counts.most_common())}"
    )
    if ratios:
        verdict += (
            "; geometric mean of the ratios of times, new over old: "
            f"{geometric_mean(ratios):.3g}"
        )
    shown = [_row(change) for change in changes if change.verdict != SAME]
    title = f"{source_name(paths[1])} against {source_name(paths[0])}"
    tables = [Table(NAMES, [shown], words=(0, 1, 2, 3))]
    return Document(title, [Section(title, verdict, tables=tables)])


def runs_in(path):
    """Return the endings of the runs in a file, by problem and method, "" for a problem
    that could not be read; raise an LCPError if it has none. A last line that was cut
    off counts as not written."""
    text = within(source_name(path), decode, content_of(path, EXPECTED))
    with suppress(ValueError, RecursionError, OverflowError):
        return {
            row.key: _of_row(row)
            for row in record.parse(text).measurements
            if not row.excluded
        }
    found = {}
    lines = objects_in(text)
    for number, line in enumerate(lines, 1):
        try:
            (name, method), ending = _of_result(json.loads(line))
        except (ValueError, KeyError, TypeError, RecursionError):
            if number == len(lines) and found:
                continue
            raise OptionError(
                source_name(path), "has neither a bench nor results", EXPECTED
            ) from None
        keys = (
            ((f"{name} ({number})" if number > 1 else name), method)
            for number in count_from(1)
        )
        found[next(key for key in keys if key not in found)] = ending
    return found


def with_unread(runs, others):
    """Return the runs with those of others that could not be made, as their problem
    could not be read."""
    unread = {
        problem: ending for (problem, method), ending in runs.items() if not method
    }
    missed = {key: unread[key[0]] for key in others if key[1] and key[0] in unread}
    taken = {problem for problem, _ in missed}
    return {
        key: ending for key, ending in runs.items() if key[1] or key[0] not in taken
    } | missed


def _of_row(row):
    interval = record.median_interval(row.seconds) if len(row.seconds) > 1 else None
    return Ending(
        row.status,
        row.success,
        row.iterations,
        record.summary(row.seconds).median,
        interval,
    )


def _of_result(result):
    """Return the file of a result, with the number of its item, or its problem; the
    method; and the ending."""
    name = PurePath(result["file"]).name if result["file"] else result["problem"]
    item = f":{result['item']}" if result["item"] else ""
    status, seconds = str(result["status"]), result.get("seconds")
    is_proved = (
        status.upper() in Status.__members__ and Status[status.upper()].has_no_solution
    )
    interval = (
        (seconds, seconds * result["spread"])
        if seconds is not None and result["spread"]
        else None
    )
    digest = None if status == UNREAD else result.get("digest")
    ending = Ending(
        status,
        bool(result["solved"]) or is_proved,
        result["iterations"],
        seconds,
        interval,
        digest,
    )
    return (f"{name}{item}", str(result["label"] or result["method"] or "")), ending


def _row(change):
    ends = [end for end in (change.old, change.new) if end is not None]

    def arrow(values):
        return " -> ".join(dict.fromkeys(values))

    return [
        *change.key,
        change.verdict,
        arrow(end.status.replace("_", " ") for end in ends),
        arrow(str(end.iterations) for end in ends if end.iterations is not None),
        " -> ".join(
            wording.duration(end.seconds) for end in ends if end.seconds is not None
        ),
        "" if change.ratio is None else f"{change.ratio:.2f}",
    ]


def main(arguments=None):
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", nargs=2, metavar="FILE")
    parser.add_argument("--slower", type=float, default=math.inf, metavar="RATIO")
    asked = parser.parse_args(arguments)
    if not asked.slower > 1:
        parser.error("--slower: give a ratio > 1")
    try:
        changes = changes_between(asked.files)
    except LCPError as error:
        print(error, file=sys.stderr)
        return Exit.BAD_INPUT
    has_failed = any(is_failure(change, asked.slower) for change in changes)
    print(typeset(report(asked.files, changes), "table", None, False), end="")
    return Exit.NOT_SOLVED if has_failed else Exit.SOLVED


if __name__ == "__main__":
    sys.exit(main())
