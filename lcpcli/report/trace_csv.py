"""The iterates as CSV with all digits, by the clock of the figures: comments, a header, then one line per iterate."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from lcpcli.model.origins import Game
from lcpcli.report import provenance, strategies, summary
from lcpcli.solving.result import Result

OPENING = "# iterates, "  # by which a file is recognised as a trace


def render(results: Sequence[Result]) -> str:
    """Columns problem, method, k, z1 ... zn, residual, error, seconds, step, status; missing values are empty.

    Of one game, or several with the same strategies, the columns are the strategies and payoffs in place of z.
    status : in the last row of a run, how it ended; else empty.
    """
    n = max(result.problem.n for result in results)
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    measures = ["residual", "error", "seconds", "step", "status"]
    games = [result.problem.origin for result in results]
    own = [strategies.headings(game) if isinstance(game, Game) else [] for game in games]
    of_games = bool(own[0]) and all(each == own[0] for each in own)
    columns = own[0] if of_games else [f"z{i + 1}" for i in range(n)]
    writer.writerow(["problem", "method", "k", *columns, *measures])
    for result, game in zip(results, games, strict=True):
        blanks = [""] * (n - result.problem.n)
        rows = result.trace.rows if result.trace else []
        for row in rows:
            numbers = [_cell(value) for value in (row.residual, row.error, row.seconds)]
            status = result.status.word if row is rows[-1] else ""
            start = [result.problem.name, summary.name(result), row.k]
            values = strategies.of_iterate(game, row.z) if of_games and isinstance(game, Game) else row.z.tolist()
            writer.writerow([*start, *map(_cell, values), *blanks, *numbers, row.step, status])
    head, *told = provenance.lines(results)
    return "".join(f"{line}\n" for line in (f"{OPENING}{head}", *(f"# {line}" for line in told))) + out.getvalue()


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)
