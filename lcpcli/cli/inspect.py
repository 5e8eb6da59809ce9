"""lcp inspect: the classes and the diagnosis of a problem, and which methods are therefore guaranteed."""

from __future__ import annotations

from typing import Any

import click

from lcpcli import options
from lcpcli.cli.command import Command, option
from lcpcli.cli.options import format_option, output_file, problem_file
from lcpcli.cli.output import form_of, show, terminal
from lcpcli.cli.problems import Inputs

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
    inputs = Inputs([file] if q_file is None else [file, q_file], **given)
    inputs.prepare({"--output": output})
    options.check((options.TIME_LIMIT,), {"time_limit": time_limit})
    form = form or form_of(output, SUFFIXES)
    if output is not None:
        from lcpcli.files.atomic_write import refuse_unwritable

        refuse_unwritable(output)
    from lcpcli.diagnosis import inspection
    from lcpcli.report import inspection_json, inspection_text

    found = inspection.inspect(inputs.read().problem, time_limit)
    width = None if output else terminal()[0]
    show(inspection_json.render(found) if form == "json" else inspection_text.render(found, width), output)
    return 0
