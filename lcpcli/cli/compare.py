"""lcp compare: several methods side by side, on one problem or on several."""

from __future__ import annotations

from typing import Any

import click

from lcpcli import shipped
from lcpcli.cli import session
from lcpcli.cli.options import numeric, solving
from lcpcli.methods import METHODS
from lcpcli.report import LEVELS

AS_PUBLISHED = ("fixed-point", "shi")


@click.command(short_help="Run methods side by side.")
@click.argument("files", metavar="[FILE]...", nargs=-1)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(list(METHODS)),
    help=f"A method to compare; repeat it for more. Default: {' and '.join(AS_PUBLISHED)}.",
)
@numeric("warm")
@solving
def compare(files: tuple[str, ...], methods: tuple[str, ...], **given: Any) -> int:
    """Run methods side by side on the problem in each FILE, by default on the paper's two examples.

    An option goes to the methods that have it. Errors are against the known solution, or one computed beforehand. Exits
    with 0 if every method solved every problem, with 1 if not.

    \b
    lcp compare
    lcp compare problem.json --every 10
    lcp compare problem.json --plot errors.svg --warm 0.01
    lcp compare --method shi --k-star 1 --format csv
    """
    paths = files or tuple(shipped.path(name) for name in shipped.PAPER_EXAMPLES)
    return session.run([(path, None) for path in paths], methods or AS_PUBLISHED, given, levels=LEVELS)
