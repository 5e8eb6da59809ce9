"""lcp compare: several methods side by side.

lcp compare-runs: earlier runs compared with those of today.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lcpcli.cli import declarations
from lcpcli.cli.command import EXITS, argument, command
from lcpcli.cli.declarations import FILES, numeric, reporting
from lcpcli.cli.main import NOT_SOLVED, SOLVED
from lcpcli.cli.output import Destination
from lcpcli.cli.problems import Inputs
from lcpcli.cli.request import Request
from lcpcli.files import contents
from lcpcli.methods.registry import NONLINEAR
from lcpcli.methods.variants import Variant
from lcpcli.options import Option
from lcpcli.report.document import MEANINGS
from lcpcli.report.wording import LEVELS

AS_PUBLISHED: tuple[str, ...] = ("fixed-point", "shi")


@command(
    short_help="Run methods side by side.",
    examples=(
        "lcp compare",
        "lcp compare tridiagonal-100 --every 10",
        "lcp compare --method newton --method lemke --method shi",
        "lcp compare --method shi --sweep k-star=1,5,20,100 --plot sweep.svg",
        "lcp compare --method shi --k-star 1 --format csv",
        "lcp compare paper-example-1 --plot errors.svg",
    ),
    common=(*declarations.COMMON, "--sweep"),
    lists={"Methods": declarations.METHOD.meanings},
    exits={**EXITS, 0: "every method solved every problem"},
    epilog="An option applies to the methods that have it. Errors refer to a known solution, else to a computed one. "
    "By default auto runs too where neither of the paper's methods solves a problem; the exit code is theirs.",
)
@declarations.files_argument(
    "Problem",
    "files",
    "[FILE [Q_FILE]|FOLDER]...",
    {"FILE [Q_FILE]": f"As for lcp solve. {declarations.OTHERS}  [default: the paper's two examples]"},
)
@declarations.with_bounds
@declarations.several_methods("Method", "compare", AS_PUBLISHED)
@declarations.solving
def compare(files: Sequence[str], methods: Sequence[Variant], sweep: Sequence[str], **given: Any) -> int:
    """Run methods side by side on the problem in each FILE."""
    examples = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]
    request = Request.of(files, examples, levels=LEVELS, sweep=sweep, **given)
    from lcpcli.cli.session import run

    default, files = AS_PUBLISHED, request.inputs.files
    if not methods and all(file.casefold().endswith(".nl") for file in files):
        from lcpcli.files.inputs import nonlinear_in

        if all(nonlinear_in(file, contents.content_of(file, "")) for file in files):
            default = tuple(NONLINEAR)
    chosen = declarations.chosen_variants(methods, sweep, default, request.own)
    return run(request._replace(variants=chosen, adds_auto=not (methods or sweep or request.own)))


FORMATS = {**MEANINGS, "json": "an object for each run, for scripts", "csv": "a row for each run, all digits"}
SLOWER = Option(
    "slower",
    float,
    None,
    "ratio > 1",
    lambda ratio: 1 < ratio < math.inf,
    "Also fail if a run takes at least this many times as long, beyond its spread; by default times never fail.",
)


@command(
    short_help="Compare the runs in two files.",
    examples=(
        "lcp bench dense -o last-week.json",
        "lcp bench dense -o today.json",
        "lcp compare-runs last-week.json today.json",
        "lcp compare-runs last-week.json today.json --slower 1.5 --quiet",
    ),
    exits={
        0: "no run is worse",
        1: "a run is worse, contradicts the earlier one, or is slower than --slower allows",
        2: "usage or input error",
    },
    epilog="Unchanged runs appear only in JSON and CSV. lcp help measuring says when a time counts as different.",
)
@argument(
    "Runs",
    "old",
    {"OLD": "Earlier runs: a file of lcp bench -o FILE.json, or results of lcp solve or compare in JSON."},
    shell_complete=FILES,
)
@argument("Runs", "new", {"NEW": "Current runs, of the same methods on the same problems."}, shell_complete=FILES)
@numeric("Comparison", SLOWER)
@reporting(FORMATS)
def compare_runs(old: str, new: str, slower: float | None, **given: Any) -> int:
    """Compare how the runs in OLD and in NEW ended: status, iterations and time."""
    destination = Destination.taken(given)
    Inputs((old, new)).prepare({"--output": destination.path})
    from lcpcli.bench.comparison import Comparison

    comparison = Comparison((old, new), math.inf if slower is None else slower)
    destination.show(comparison.render)
    return NOT_SOLVED if comparison.failures else SOLVED
