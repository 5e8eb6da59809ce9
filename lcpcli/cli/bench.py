"""lcp bench: methods and other solvers on suites of problems."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from lcpcli.bench.formats import FORMATS
from lcpcli.bench.suites import ALL, SUITES
from lcpcli.cli import candidates, threads
from lcpcli.cli.command import Command, argument, option
from lcpcli.cli.methods import several_methods
from lcpcli.cli.options import format_option, numeric, output_file
from lcpcli.methods.registry import meanings
from lcpcli.options import ACCEPT, BUDGET, INFINITY, THREADS, TOL
from lcpcli.peers.registry import PEERS

DEFAULT_METHODS = ("auto", "newton", "lemke", "fixed-point", "shi")
DEFAULT_SUITE = "quick"
TIME_LIMIT = 10.0

MEANINGS = {**{name: suite.meaning for name, suite in SUITES.items()}, ALL: "all of these"}
OF_ONE_NAME = {peer.partition("-")[0]: "all of these" for peer in PEERS if "-" in peer}
EXITS = {
    0: "measured, even if runs failed",
    1: "a solver made a false claim",
    2: "usage or input error (one-line message)",
    130: "interrupted; --resume continues what -o has saved",
}
EPILOG = "Times are medians of repeated runs. A solution counts only if its recomputed residual is at most --accept."


@click.command(
    cls=Command,
    short_help="Measure methods on suites of problems.",
    examples=(
        "lcp bench",
        "lcp bench tridiagonal-100 --method shi --budget 0",
        "lcp bench dense --peer piqp -o dense.json --plot dense.svg",
        "lcp bench --resume dense.json --format markdown",
    ),
    lists={"Suites": MEANINGS, "Methods": meanings(), "Other solvers": PEERS},
    exits=EXITS,
    epilog=EPILOG,
)
@argument(
    "Problems",
    "suite",
    {
        "SUITE": f"One of the suites below.  [default: {DEFAULT_SUITE}]",
        "FILE [Q_FILE]": "A problem, as for lcp compare, but not standard input.",
        "FOLDER": "All problem files in it, in order of their names.",
    },
    metavar="[SUITE|FILE [Q_FILE]|FOLDER]...",
    nargs=-1,
    shell_complete=candidates.problems(candidates.one_of(MEANINGS)),
)
@numeric("Problems", INFINITY)
@several_methods("Solvers", "measure", DEFAULT_METHODS)
@option(
    "Solvers",
    "--peer",
    "peers",
    metavar="NAME",
    multiple=True,
    shell_complete=candidates.one_of({**PEERS, **OF_ONE_NAME}),
    help="Another solver to measure, if it is installed; repeatable. The part before a dash selects all of that name."
    "  [default: none]",
)
@numeric("Stopping", TOL)
@option(
    "Stopping",
    "--time-limit",
    type=click.FLOAT,
    help=f"Time limit of each run.  [seconds > 0; default {TIME_LIMIT:g}]",
)
@numeric("Measuring", ACCEPT)
@numeric("Measuring", BUDGET)
@numeric("Measuring", replace(THREADS, meaning="Threads for dense linear algebra, in all solvers; by default one."))
@option(
    "Measuring",
    "--resume",
    metavar="FILE",
    shell_complete=candidates.files(".json"),
    help="Resume the bench in this JSON file, written by -o.",
)
@format_option(FORMATS, "table")
@output_file("Also save the results to this file as they come, in the format of its suffix.")
@option(
    "Output",
    "--plot",
    metavar="FILE",
    shell_complete=candidates.files(),
    help="Draw performance profiles, error against time, and scaling with n, as .png, .svg or .pdf.",
)
@option("Output", "-q", "--quiet", is_flag=True, help="Print nothing, not even progress.")
def bench(**given: Any) -> int:
    """Measure methods, and other solvers, on the problems of suites or in files."""
    threads.settle((), given["threads"])
    from lcpcli.cli import bench_session

    return bench_session.run(given, DEFAULT_SUITE, DEFAULT_METHODS, TIME_LIMIT)
