"""lcp compare: several methods side by side, on one problem or on several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from lcpcli.cli.command import EXITS, Command, argument
from lcpcli.cli.options import PROBLEM, chosen_variants, numeric, several_methods, solving, with_bounds
from lcpcli.cli.runs import Methods
from lcpcli.cli.session import Request, Solving, run
from lcpcli.files import shipped
from lcpcli.methods.registry import meanings
from lcpcli.methods.variants import Variant
from lcpcli.options import WARM
from lcpcli.report.formats import LEVELS

AS_PUBLISHED = ("fixed-point", "shi")


@click.command(
    cls=Command,
    short_help="Run methods side by side.",
    examples=(
        "lcp compare",
        "lcp compare tridiagonal-100 --every 10",
        "lcp compare --method newton --method lemke --method shi",
        "lcp compare --method shi --sweep k-star=1,5,20,100 --plot sweep.svg",
        "lcp compare --method shi --k-star 1 --format csv",
        "lcp compare paper-example-1 --plot errors.svg --warm 0.01",
    ),
    lists={"Methods": meanings()},
    exits={**EXITS, 0: "every method solved every problem"},
    epilog="An option applies to the methods that have it. Errors refer to a known solution, else to a computed one.",
)
@argument(
    "Problem",
    "files",
    {
        "FILE [Q_FILE]": "As for lcp solve; a file that contains M alone is followed by that of q.  "
        "[default: the paper's two examples]",
        "FOLDER": "All problem files in it, in order of their names.",
    },
    metavar="[FILE [Q_FILE]|FOLDER]...",
    nargs=-1,
    shell_complete=PROBLEM,
)
@with_bounds
@several_methods("Method", "compare", AS_PUBLISHED)
@numeric("Method", WARM)
@solving
def compare(files: Sequence[str], methods: Sequence[Variant], sweep: Sequence[str], **given: Any) -> int:
    """Run methods side by side on the problem in each FILE."""
    asked = Request.of(files, given, default=[shipped.path(name) for name in shipped.PAPER_EXAMPLES])
    variants = chosen_variants(methods, sweep, AS_PUBLISHED, asked.own)
    return run(asked, Solving(Methods(variants, asked), LEVELS))
