"""lcp bench sequences: a suite that is measured by itself, in comparison with another program."""

from __future__ import annotations

from functools import partial

from lcpcli import options
from lcpcli.bench.suites import SEQUENCES
from lcpcli.cli.main import INTERRUPTED
from lcpcli.cli.output import Destination, refuse, refuse_given
from lcpcli.cli.request import Request
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.files.atomic_write import reserve

BUDGET = 2.0  # seconds for the repeats of a case
REFUSED = ("sweep", "tol", "time_limit", "accept", "resume", "plot")


def run(request: Request, destination: Destination) -> int:
    """Measure the sequences and return the exit code."""
    from lcpcli.bench.sequence_report import render
    from lcpcli.bench.sequences import CASES, SequenceRow, measure

    _refuse_others(request)
    options.check((options.BUDGET,), {options.BUDGET.name: request.budget})
    rows, interrupted = list[SequenceRow](), False
    with reserve([] if destination.path is None else [destination.path]):
        try:
            with Line() as line:
                for case in CASES:
                    if shows_progress(request.quiet):
                        line.show(f"{len(rows)}/{len(CASES)}  {case.name}")
                    rows.append(measure(case, BUDGET if request.budget is None else request.budget))
        except KeyboardInterrupt:
            interrupted = True
        destination.show(partial(render, rows))
    return INTERRUPTED if interrupted else 0


def _refuse_others(request: Request) -> None:
    others = {"--method": request.variants, "--peer": request.peers, "--infinity": request.inputs.infinity}
    others |= {name: getattr(request, name) for name in REFUSED}
    refuse_given(others, f"has no effect on lcp bench {SEQUENCES}")
    refuse(len(request.inputs.files) > 1, SEQUENCES, "is measured alone", "leave out other suites and files")
