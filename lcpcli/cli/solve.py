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
@click.option("--method", type=click.Choice(list(METHODS)), default="auto", show_default=True, help="How to solve it.")
@click.option("--exact", is_flag=True, help="Prove the answer in rational arithmetic, decimals taken as written.")
@solving
def solve(file: str, q_file: str | None, method: str, exact: bool, **given: Any) -> int:
    """Solve the problem in FILE: JSON, NPZ, CSV with the columns [M | q], or M alone with q in Q_FILE.

    M and q may also be in Matrix Market files (.mtx). A FILE of "-" is standard input. Exits with 0 if solved, 1 if
    not, 2 for bad input, 3 if it is proved that there is no solution.

    \b
    lcp solve problem.json
    lcp solve M.csv q.csv --method fixed-point
    lcp solve M.mtx q.mtx --z0 result.json
    lcp solve problem.json --format json --trace | jq .z
    lcp solve problem.json --exact
    """
    return session.run([(file, q_file)], [method], given, exact=exact)
