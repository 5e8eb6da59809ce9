"""lcp inspect: what a problem is, and which methods are therefore guaranteed."""

from __future__ import annotations

from pathlib import Path

import click

from lcpcli import options
from lcpcli.cli.output import emit
from lcpcli.cli.session import refuse_clashes
from lcpcli.errors import OptionError

FORMATS = {"table": "for people", "json": "one object, for scripts"}
SUFFIXES = {"": "table", ".txt": "table", ".json": "json"}


@click.command(short_help="Say what a problem is.")
@click.argument("file")
@click.argument("q_file", required=False)
@click.option(
    "--time-limit",
    type=click.FLOAT,
    default=options.INSPECTION_SECONDS,
    show_default=True,
    help="Seconds after which nothing further is begun that takes time.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(list(FORMATS)),
    help=", ".join(f"{name} ({meaning})" for name, meaning in FORMATS.items())
    + ".  [default: by the ending of -o, else table]",
)
@click.option("-o", "--output", metavar="FILE", help="Write to a file instead, whole or not at all.")
def inspect(file: str, q_file: str | None, time_limit: float, form: str | None, output: str | None) -> int:
    """Say what the problem in FILE is: the classes of M, with what shows it, how well M is scaled and conditioned, and
    which methods are therefore guaranteed to solve it.

    FILE and Q_FILE are as for lcp solve. A class is "yes" or "no" only where rounding cannot have decided it. Exits
    with 0, or 2 for bad input.

    \b
    lcp inspect problem.json
    lcp inspect M.mtx q.mtx --time-limit 60
    lcp inspect problem.json --format json | jq .classes.p_matrix
    """
    options.check(time_limit=time_limit)
    output = None if output == "-" else output
    form = form or _form_of(output)
    refuse_clashes([name for name in (file, q_file) if name], output)
    from lcpcli import files

    if output is not None:
        files.refuse_unwritable(output)
    from lcpcli import inspection
    from lcpcli.report import inspection_json, inspection_text

    found = inspection.inspect(files.read(file, q_file), time_limit)
    text = inspection_json.render(found) if form == "json" else inspection_text.render(found)
    if output is None:
        emit(text, color=False)
    else:
        files.write_whole(output, text)
    return 0


def _form_of(output: str | None) -> str:
    ending = Path(output or "").suffix.lower()
    if ending not in SUFFIXES:
        raise OptionError(str(output), f"the ending {ending} is no format", "use .txt, .json or give --format")
    return SUFFIXES[ending]
