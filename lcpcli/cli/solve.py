"""lcp solve: one problem, one method."""

from __future__ import annotations

from typing import Any

import click

from lcpcli.cli import session
from lcpcli.cli.options import solving
from lcpcli.methods import METHODS


@click.command(short_help="Solve one problem.")
@click.argument("file")
@click.argument("q_file", required=False)
@click.option("--method", type=click.Choice(list(METHODS)), default="shi", show_default=True, help="How to solve it.")
@solving
def solve(file: str, q_file: str | None, method: str, **given: Any) -> int:
    """Solve the problem in FILE: JSON, CSV with the columns [M | q], or the rows of M with q in Q_FILE.

    A FILE of "-" is standard input. Exits with 0 if solved, 1 if not, 2 for bad input.

    \b
    lcp solve problem.json
    lcp solve M.csv q.csv --method fixed-point
    lcp solve problem.json --format json --trace | jq .z
    """
    return session.run([(file, q_file)], [method], given)
