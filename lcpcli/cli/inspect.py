"""lcp inspect: what a problem is, and which methods are therefore guaranteed."""

from __future__ import annotations

import click

from lcpcli import options
from lcpcli.cli.command import Command, option
from lcpcli.cli.options import format_option, output_file, problem_file
from lcpcli.cli.output import emit, form_of
from lcpcli.cli.session import refuse_clashes

FORMATS = {"table": "for people", "json": "one object, for scripts"}
SUFFIXES = {"": "table", ".txt": "table", ".json": "json"}


@click.command(
    cls=Command,
    short_help="Say what a problem is.",
    examples=(
        "lcp inspect problems/paper-example-2.json",
        "lcp make kostreva -n 5 | lcp inspect -",
        "lcp inspect problems/bimatrix.json --time-limit 10 -o bimatrix-classes.json",
    ),
    exits={0: "inspected", 2: "bad usage or bad input, told in one line"},
    epilog='A class is "yes" or "no" only where rounding cannot have decided it.',
)
@problem_file
@option(
    "Stopping",
    "--time-limit",
    type=click.FLOAT,
    default=options.INSPECTION_SECONDS,
    help="Begin nothing further that takes time after this many seconds.  "
    f"[seconds > 0; default {options.INSPECTION_SECONDS:g}]",
)
@format_option(FORMATS)
@output_file()
def inspect(file: str, q_file: str | None, time_limit: float, form: str | None, output: str | None) -> int:
    """Tell the classes of M, how well it is scaled, and which methods are guaranteed to solve the problem."""
    options.check((options.TIME_LIMIT,), {"time_limit": time_limit})
    output = None if output == "-" else output
    form = form or form_of(output, SUFFIXES)
    refuse_clashes([name for name in (file, q_file) if name], output)
    from lcpcli.files import atomic_write, reading

    if output is not None:
        atomic_write.refuse_unwritable(output)
    from lcpcli.diagnosis import inspection
    from lcpcli.report import inspection_json, inspection_text

    found = inspection.inspect(reading.read(file, q_file), time_limit)
    text = inspection_json.render(found) if form == "json" else inspection_text.render(found)
    if output is None:
        emit(text, color=False)
    else:
        atomic_write.write_whole(output, text)
    return 0
