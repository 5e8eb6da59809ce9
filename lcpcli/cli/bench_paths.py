"""lcp bench path: the paths of `bench.paths` beside those of other packages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lcpcli.bench.suites import PATH
from lcpcli.cli.main import INTERRUPTED
from lcpcli.cli.output import Line, emit, refuse, show, shows_progress, terminal
from lcpcli.cli.request import Request
from lcpcli.files.atomic_write import reserve

if TYPE_CHECKING:
    from lcpcli.bench.paths import Row

BUDGET = 2.0  # seconds for the repeats of a path


def run(request: Request, outputs: dict[str, str]) -> int:
    """Measure the paths and return the exit code. outputs : files with their formats."""
    from lcpcli.bench import paths
    from lcpcli.bench.path_report import render

    _refuse_others(request)
    rows: list[Row] = []
    interrupted = False
    with reserve(list(outputs)):
        try:
            with Line() as line:
                for case in paths.CASES:
                    if shows_progress(request.quiet):
                        line.show(f"{len(rows)}/{len(paths.CASES)}  {case.name}")
                    rows.append(paths.measure(case, BUDGET if request.budget is None else request.budget))
        except KeyboardInterrupt:
            interrupted = True
        for path, form in outputs.items():
            show(render(rows, form, None, False), path)
    if not request.quiet:
        width, color = terminal()
        emit(render(rows, str(request.form), width, color), color and request.form == "table")
    return INTERRUPTED if interrupted else 0


def _refuse_others(request: Request) -> None:
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
        refuse(value not in (None, ()), name, f"has no effect on lcp bench {PATH}")
    refuse(len(request.inputs.files) > 1, PATH, "is measured alone", "leave out other suites and files")
