"""lcp bench path and lcp bench sequences: the suites of `suites.ALONE`, which are measured beside other programs."""

from __future__ import annotations

from typing import Any

from lcpcli import options
from lcpcli.cli.main import INTERRUPTED
from lcpcli.cli.output import refuse, show
from lcpcli.cli.request import Request
from lcpcli.cli.terminal import Line, emit, shows_progress, terminal
from lcpcli.files.atomic_write import reserve

BUDGET = 2.0  # seconds for the repeats of a case


def run(suite: str, request: Request, outputs: dict[str, str]) -> int:
    """Measure the cases of a suite and return the exit code. outputs : files with their formats."""
    from lcpcli.bench.alone import load, render

    _refuse_others(suite, request)
    options.check((options.BUDGET,), {options.BUDGET.name: request.budget})
    module, rows = load(suite), list[Any]()
    interrupted = False
    with reserve(list(outputs)):
        try:
            with Line() as line:
                for case in module.CASES:
                    if shows_progress(request.quiet):
                        line.show(f"{len(rows)}/{len(module.CASES)}  {case.name}")
                    rows.append(module.measure(case, BUDGET if request.budget is None else request.budget))
        except KeyboardInterrupt:
            interrupted = True
        for path, form in outputs.items():
            show(render(suite, rows, form, None, False), path)
    if not request.quiet:
        width, color = terminal()
        emit(render(suite, rows, str(request.form), width, color), color and request.form == "table")
    return INTERRUPTED if interrupted else 0


def _refuse_others(suite: str, request: Request) -> None:
    others = {
        "--method": request.variants,
        "--sweep": request.sweep,
        "--peer": request.peers,
        "--tol": request.tol,
        "--time-limit": request.time_limit,
        "--accept": request.accept,
        "--infinity": request.inputs.infinity,
        "--resume": request.resume,
        "--plot": request.plot,
    }
    for name, value in others.items():
        refuse(value not in (None, ()), name, f"has no effect on lcp bench {suite}")
    refuse(len(request.inputs.files) > 1, suite, "is measured alone", "leave out other suites and files")
