"""lcp bench: methods and other solvers on suites of problems."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from lcpcli.bench.suites import ALL, DEFAULT_METHODS, SUITES, Suite, methods_of
from lcpcli.cli import declarations, output
from lcpcli.cli.command import Candidates, command
from lcpcli.cli.declarations import (
    RESUMED_BENCH,
    Reporting,
    option,
    refuse,
    reject_conflicting_options,
)
from lcpcli.cli.main import of_end, refused
from lcpcli.cli.problems import Inputs, pop_options, same_file, settle_threads, tell
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.errors import (
    OTHER_OUTPUT,
    Exit,
    File,
    OptionError,
    ProblemError,
    count,
    listed,
    missing,
)
from lcpcli.methods.registry import Variant, meanings
from lcpcli.options import ACCEPT, BUDGET, INFINITY, THREADS, TIME_LIMIT, TOL
from lcpcli.peers.registry import PEERS, load
from lcpcli.report.document import MEANINGS as MEANINGS_OF_FORMATS

if TYPE_CHECKING:
    from lcpcli.bench.record import BenchRecord
    from lcpcli.bench.suites import Case

FORMATS = {
    **MEANINGS_OF_FORMATS,
    "json": "the record, to resume from",
    "csv": "one row per measurement, all digits",
}
DEFAULT_SUITE = "quick"
THREADS_OF_ALL = THREADS._replace(
    meaning="Threads for dense linear algebra, in all solvers; by default one."
)
OF_EACH_RUN = TIME_LIMIT._replace(default=10.0, meaning="Time limit of each run.")

MEANINGS = {
    **{name: suite.meaning for name, suite in SUITES.items()},
    ALL: "all of these",
}
MEASURING = (TOL, OF_EACH_RUN, ACCEPT, BUDGET)


@dataclass(eq=False, repr=False)
class Bench(Reporting):
    """The request of lcp bench."""

    suite: Sequence[str] = ()
    infinity: float | None = None
    methods: Sequence[Variant] = ()
    sweep: Sequence[str] = ()
    peers: Sequence[str] = ()
    tol: float | None = None
    time_limit: float | None = None
    accept: float | None = None
    budget: float | None = None
    threads: int | None = None
    resume: str | None = None
    plot: str | None = None


@command(
    request=Bench,
    short_help="Measure methods on suites of problems.",
    examples=(
        "lcp bench",
        "lcp bench tridiagonal-100 --method shi --budget 0",
        "lcp bench dense --peer piqp -o dense.json --plot dense.svg",
        "lcp bench --resume dense.json --format markdown",
    ),
    common=(
        "--method",
        "--sweep",
        "--peer",
        "--tol",
        "--time-limit",
        "--budget",
        "--resume",
        "--format",
        "--output",
        "--plot",
        "--quiet",
    ),
    lists={"Suites": MEANINGS, "Methods": meanings(), "Other solvers": PEERS},
    exits={
        Exit.SOLVED: "measured, even if runs failed",
        Exit.NOT_SOLVED: "a solver made a false claim",
        Exit.INTERRUPTED: "interrupted; --resume continues what -o has saved",
    },
    epilog=(
        "Times are medians of repeated runs. A solution counts only if its "
        "recomputed residual is at most --accept."
    ),
)
@declarations.files_argument(
    "Problems",
    "suite",
    "[SUITE|FILE [Q_FILE]|FOLDER]...",
    {
        "SUITE": f"{listed(MEANINGS, 'or')}.  [default: {DEFAULT_SUITE}]",
        "FILE [Q_FILE]": (
            f"As for lcp compare, but not standard input. {declarations.OTHERS}"
        ),
    },
    declarations.PROBLEM_FILES._replace(words=MEANINGS),
)
@option("Problems", INFINITY)
@declarations.several_methods("Solvers", "measure", DEFAULT_METHODS)
@option(
    "Solvers",
    "--peer peers NAME  Another solver to measure, if it is installed; "
    f"repeatable: {listed(PEERS, 'or')}. The part of "
    "a name before a dash selects all solvers whose names begin with it.  "
    "[default: none]",
    multiple=True,
    shell_complete=Candidates(
        {
            **PEERS,
            **{peer.partition("-")[0]: "all of these" for peer in PEERS if "-" in peer},
        }
    ),
)
@option("Stopping", TOL, OF_EACH_RUN)
@option(
    "Measuring",
    ACCEPT,
    BUDGET,
    THREADS_OF_ALL,
    "--resume FILE  Resume the bench in this JSON file, written by -o.",
)
@declarations.reporting(
    FORMATS,
    declarations.figure_options("bench"),
    file=(
        f"{declarations.TO_FILE} JSON is saved after each measurement, to resume from."
    ),
    quiet="Print neither results nor progress, only errors.",
)
def bench(request: Bench) -> int:
    """Measure methods, and other solvers, on the problems of suites or in files."""
    settle_threads((), request.threads)
    from lcpcli.files.atomic_write import refuse_unwritable, reserve

    destination = output.Destination.of(request)
    for path in filter(None, (request.output, request.plot)):
        refuse_unwritable(path)
    output.require_plot(request.plot)
    is_resumed = request.resume is not None and bool(_read_record(request).pending())
    with reserve(
        filter(None, [request.output, request.resume if is_resumed else None])
    ):
        return _run(request, destination)


def _run(request: Bench, destination: output.Destination) -> int:
    from lcpcli.bench import report

    record, saved = _record_and_files(request, destination)
    files = [file for case in record.cases for file in (case.file, case.q_file)]
    outputs = {"--output": destination.path, "--plot": request.plot}
    Inputs([file for file in files if file]).refuse(outputs)
    if not record.cases:
        for file, _, reason in (each.partition(": ") for each in record.unread):
            refused(ProblemError(File(file), reason))
        return Exit.BAD_INPUT
    for reason in record.unread:
        tell(reason)
    if record.missing and not request.quiet:
        _, hint = missing(*(load(name).module for name in record.missing))
        tell(f"not installed, left out: {', '.join(record.missing)}; {hint}")
    n_pending = sum(len(solvers) for _, solvers in record.pending())
    rows, number = record.measurements, len(record.measurements) + n_pending
    line = Line(total=n_pending, is_shown=shows_progress(request.quiet))
    is_interrupted = _measured(record, saved, line)
    if rows:
        destination.draw(request.plot, "bench", record)
    false = sum(row.false_success for row in rows)
    good, measured = sum(row.success for row in rows), count(len(rows), "measurement")
    verdict = f"{good} of {measured} succeeded" + f"; {count(false, 'false claim')}" * (
        false > 0
    )
    destination.show(partial(report.render, record), verdict)
    if not is_interrupted:
        return Exit.BAD_INPUT if record.unread else of_end(not false)
    hint = (
        f"resume with lcp bench --resume {saved[0]}"
        if saved
        else "with -o FILE.json it could be resumed"
    )
    tell(f"interrupted after {len(rows)} of {number} measurements; {hint}")
    return Exit.INTERRUPTED


def _record_and_files(
    request: Bench, destination: output.Destination
) -> tuple[BenchRecord, list[str]]:
    """Return the record, new or to be resumed, and the files in which it is saved."""
    path = destination.path
    saved = [path] if path is not None and destination.kind.has_records else []
    if request.resume is None:
        return _new_record(request), saved
    record = _read_record(request)
    if path is not None and not saved:
        holds = same_file(path, request.resume)
        refuse(holds, File(path), "holds the record to resume", OTHER_OUTPUT)
    return record, [*[request.resume] * bool(record.pending()), *saved]


def _measured(record: BenchRecord, saved: Sequence[str], line: Line) -> bool:
    """Make the measurements that are pending, and save each; return whether Ctrl-C has
    ended that."""
    from lcpcli.bench import report, timing
    from lcpcli.files.atomic_write import append
    from lcpcli.report import result_formats

    files = [path for path in saved if Path(path).is_file() or not Path(path).exists()]
    before = len(record.measurements)

    def save() -> None:
        for path in files:
            output.show(report.render(record, "json", None, False), path)

    # Only between measurements, whose times it would disturb.
    def starting(case: Case, solver: str) -> None:
        line.show(f"{case.name}: {solver}", len(record.measurements) - before)

    save()
    is_interrupted = False
    with line:
        try:
            for row in timing.run(record, starting):
                for path in files:
                    append(path, result_formats.line(result_formats.plain(row)))
        except KeyboardInterrupt:
            is_interrupted = True
    save()  # the measurements so far
    return is_interrupted


def _new_record(request: Bench) -> BenchRecord:
    from lcpcli.bench import timing
    from lcpcli.bench.record import Settings

    suites, infinity = request.suite or (DEFAULT_SUITE,), request.infinity
    if request.time_limit == math.inf:
        raise OptionError(
            "--time-limit",
            "is infinite",
            "give a number of seconds, the time counted for a failure",
        )
    budget = max(SUITES.get(name, Suite).budget for name in suites)
    numbers = {
        **{number.name: number.default for number in MEASURING},
        "budget": budget,
        **pop_options(vars(request).copy(), [number.name for number in MEASURING]),
    }
    variants = declarations.chosen_variants(
        request.methods, request.sweep, methods_of(suites)
    )
    settings = Settings(**{name: float(value) for name, value in numbers.items()})
    how = partial(tell, quiet=request.quiet), None if infinity == math.inf else infinity
    return timing.start(
        suites, [str(variant) for variant in variants], request.peers, settings, *how
    )


def _read_record(request: Bench) -> BenchRecord:
    from lcpcli.bench import record, timing

    reject_conflicting_options(request.option_values, RESUMED_BENCH)
    past = record.read(str(request.resume))
    if past.pending():
        timing.refuse_elsewhere(past)
    return past
