"""lcp solve: one problem, one method."""

from __future__ import annotations

from typing import Any

import click

from lcpcli.cli import session
from lcpcli.cli.command import Command, option
from lcpcli.cli.methods import MethodChoice
from lcpcli.cli.options import EXITS, problem_file, solving
from lcpcli.methods.registry import meanings
from lcpcli.methods.variants import Variant


@click.command(
    cls=Command,
    short_help="Solve one problem.",
    examples=(
        "lcp solve problems/paper-example-1.json",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp solve problems/paper-example-2.json --method shi --every 10",
        "lcp solve problems/paper-example-2.json --exact",
        "lcp solve problems/tridiagonal-100.json --format json -o result.json",
        "lcp solve problems/tridiagonal-100.json --z0 result.json --quiet",
    ),
    lists={"Methods": meanings()},
    exits=EXITS,
)
@problem_file
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
def solve(file: str, q_file: str | None, method: Variant, exact: bool, **given: Any) -> int:
    """Solve the problem in FILE, or prove that it has no solution."""
    return session.run([file] if q_file is None else [file, q_file], [method], given, exact=exact)
