"""lcp solve: one method, on one problem or on many."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli import candidates, problems, session
from lcpcli.cli.command import Command, option
from lcpcli.cli.methods import MethodChoice
from lcpcli.cli.options import EXITS, numeric, problem_files, solving
from lcpcli.errors import OptionError
from lcpcli.files.contents import files_in
from lcpcli.methods.registry import meanings
from lcpcli.methods.variants import Variant
from lcpcli.options import JOBS, MAX_SOLUTIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lcpcli.cli.output import Output
    from lcpcli.files.inputs import Work


@click.command(
    cls=Command,
    short_help="Solve one problem or many.",
    examples=(
        "lcp solve paper-example-1",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp solve paper-example-2 --method shi --every 10",
        "lcp solve paper-example-2 --exact",
        "lcp solve tridiagonal-100 --format json -o result.json",
        "lcp solve tridiagonal-100 --z0 result.json --quiet",
        "lcp solve bimatrix --all",
        "lcp solve bimatrix diode-bridge --jobs 2",
    ),
    lists={"Methods": meanings()},
    exits=EXITS,
)
@problem_files
@option(
    "Method",
    "--method",
    metavar="NAME",
    type=MethodChoice(),
    default="auto",
    show_default=True,
    help="Solution method, one of those listed below.",
)
@option("Proof", "--exact", is_flag=True, help="Prove the result in rational arithmetic, decimals taken as written.")
@solving
@option("All solutions", "--all", "all_of_them", is_flag=True, help="List every solution; see lcp help solutions.")
@numeric("All solutions", MAX_SOLUTIONS)
@numeric("Many problems", JOBS)
@option(
    "Many problems",
    "--cluster",
    metavar="ADDRESS",
    help="Have the workers of this Dask scheduler solve them, as in tcp://host:8786.  [default: none]",
)
@option(
    "Many problems",
    "--resume",
    metavar="FILE",
    shell_complete=candidates.files(".jsonl"),
    help="Go on with the log that -o FILE.jsonl has begun, given the same problems.  [default: none]",
)
def solve(files: tuple[str, ...], method: Variant, exact: bool, all_of_them: bool, **given: Any) -> int:
    """Solve the problem in each FILE, or prove that it has no solution."""
    paths = files_in(files, problems.teller(given["quiet"]))
    if all_of_them:
        from lcpcli.cli import all_solutions

        return all_solutions.run(paths, method, given, exact)
    if given[MAX_SOLUTIONS.name] is not None:
        raise OptionError("--max-solutions", "has no effect without --all", "add --all")

    def many(works: Iterator[Work], output: Output) -> int:
        from lcpcli.cli import many

        return many.run(works, output, paths, method, given, exact)

    return session.run(paths, [method], given, exact=exact, many=many)
