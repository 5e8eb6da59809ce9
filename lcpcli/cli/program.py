"""The command group lcp, with options and help. Nothing that its commands compute with is loaded here."""

from __future__ import annotations

import click

from lcpcli import __version__
from lcpcli.cli.command import WIDEST_LINE, Commands, Group
from lcpcli.cli.options import EXITS


@click.group(
    cls=Group,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": WIDEST_LINE},
    invoke_without_command=True,
    examples=(
        "lcp solve paper-example-1",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp compare",
        "lcp solve --help",
        "lcp help methods",
    ),
    exits={**EXITS, 141: "the reader of a pipe has closed it"},
)
@click.version_option(__version__, prog_name="lcp")
@click.pass_context
def lcp(context: click.Context) -> None:
    """Solve linear complementarity problems: find z >= 0 with w = Mz + q >= 0 and z'w = 0; and mixed ones."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


lcp.commands = Commands(("solve", "compare", "bench", "check", "inspect", "make", "convert", "completion", "help"))
