"""lcp inspect: the classes and the diagnosis of a problem, and which methods are therefore guaranteed."""

from __future__ import annotations

from typing import Any

import click

from lcpcli import options
from lcpcli.cli import problems, threads
from lcpcli.cli.command import Command, option
from lcpcli.cli.options import format_option, output_file, problem_file
from lcpcli.cli.output import emit, form_of, terminal
from lcpcli.cli.session import refuse_clashes

FORMATS = {"table": "human-readable", "json": "one object, for scripts"}
SUFFIXES = {"": "table", ".txt": "table", ".json": "json"}


@click.command(
    cls=Command,
    short_help="Classify and diagnose a problem.",
    examples=(
        "lcp inspect paper-example-2",
        "lcp make kostreva -n 5 | lcp inspect -",
        "lcp inspect bimatrix --time-limit 10 -o bimatrix-classes.json",
    ),
    exits={0: "inspected", 2: "usage or input error (one-line message)"},
    epilog='A class is "yes" or "no" only where rounding errors cannot affect the answer. Rows and columns are counted '
    "from 1; the indices of the JSON, from 0.",
)
@problem_file
@option(
    "Stopping",
    "--time-limit",
    type=click.FLOAT,
    default=options.INSPECTION_SECONDS,
    help="Start no further expensive computation after this many seconds; measuring the factorization of a sparse M "
    "may take as long again.  "
    f"[seconds > 0; default {options.INSPECTION_SECONDS:g}]",
)
@format_option(FORMATS)
@output_file()
def inspect(
    file: str, q_file: str | None, time_limit: float, form: str | None, output: str | None, **given: Any
) -> int:
    """Report the classes of M, its scaling, and which methods are guaranteed to solve the problem."""
    files = [file] if q_file is None else [file, q_file]
    threads.settle(files)
    options.check((options.TIME_LIMIT,), {"time_limit": time_limit})
    output = None if output == "-" else output
    form = form or form_of(output, SUFFIXES)
    refuse_clashes(problems.inputs(files, given), {"--output": output})
    from lcpcli.files import atomic_write

    if output is not None:
        atomic_write.refuse_unwritable(output)
    from lcpcli.inspection.inspection import inspect as inspected
    from lcpcli.report import inspection

    found = inspected(problems.read(files, given), time_limit)
    width = None if output else terminal()[0]
    text = inspection.as_json(found) if form == "json" else inspection.as_text(found, width)
    if output is None:
        emit(text, color=False)
    else:
        atomic_write.write_whole(output, text)
    return 0
