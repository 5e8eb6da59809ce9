"""lcp bench: methods and other solvers on suites of problems."""

from __future__ import annotations

from typing import Any

import click

from lcpcli.bench.suites import ALL, SUITES
from lcpcli.cli.options import numeric
from lcpcli.methods import METHODS
from lcpcli.peers import PEERS
from lcpcli.report.bench import FORMATS

DEFAULT_METHODS = ("auto", "newton", "lemke", "fixed-point", "shi")
DEFAULT_SUITE = "quick"
TIME_LIMIT = 10.0

SUITES_HELP = "\n".join(f"    {name:8} {suite.meaning}" for name, suite in SUITES.items())
HELP = f"""Run methods, and other solvers, on a SUITE of problems or on problems in files.

    \b
{SUITES_HELP}
    {ALL:8} all of these

    Default: {DEFAULT_SUITE}. Times are medians of repeats. A solution counts only if its residual, recomputed
    from M and q, is at most --accept. -o FILE.json keeps what is measured as it comes, and --resume goes on from there.

    Exits with 0 whatever failed, with 1 if a solver claimed what is not so, with 130 if interrupted.

    \b
    lcp bench
    lcp bench dense --peer quantecon -o dense.json --plot dense.svg
    lcp bench --resume dense.json --format markdown
    """


def _forms() -> str:
    return ", ".join(f"{name} ({meaning})" for name, meaning in FORMATS.items())


@click.command(short_help="Measure methods on suites of problems.", help=HELP)
@click.argument("suite", metavar="[SUITE|FILE]...", nargs=-1)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(list(METHODS)),
    help=f"A method to measure; repeat it for more. Default: {', '.join(DEFAULT_METHODS)}.",
)
@click.option(
    "--peer",
    "peers",
    multiple=True,
    metavar="NAME",
    help=f"Another solver to measure, if it is installed; repeat it for more: {', '.join(PEERS)}. What stands before a "
    "dash means all of that name.",
)
@numeric("tol")
@click.option(
    "--time-limit", type=click.FLOAT, help=f"Seconds that a run may take.  [seconds > 0; default {TIME_LIMIT:g}]"
)
@numeric("accept")
@numeric("budget")
@click.option("--resume", metavar="FILE", help="Go on with the bench in this file, which -o has written as JSON.")
@click.option(
    "--format", "form", type=click.Choice(list(FORMATS)), default="table", help=f"{_forms()}.  [default: table]"
)
@click.option(
    "-o", "--output", metavar="FILE", help="Keep the results there too, as they come, in the format of its ending."
)
@click.option("--plot", metavar="FILE", help="Draw profiles, errors against time and growth, as .png, .svg or .pdf.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing, not even what runs.")
def bench(**given: Any) -> int:
    from lcpcli.cli import bench_session

    return bench_session.run(given, DEFAULT_SUITE, DEFAULT_METHODS, TIME_LIMIT)
