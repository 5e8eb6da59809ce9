"""The command lcp: its commands, and how it ends. Errors become one line on standard error and exit code 2."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from lcpcli import __version__
from lcpcli.cli.bench import bench
from lcpcli.cli.check import check
from lcpcli.cli.command import Group
from lcpcli.cli.compare import compare
from lcpcli.cli.completion import VARIABLE, completion
from lcpcli.cli.inspect import inspect
from lcpcli.cli.make import make
from lcpcli.cli.options import EXITS
from lcpcli.cli.solve import solve
from lcpcli.compiled import leave
from lcpcli.errors import LCPError

INTERRUPTED = 130


@click.group(
    cls=Group,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    invoke_without_command=True,
    examples=(
        "lcp solve problems/paper-example-1.json",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp compare",
        "lcp solve --help",
    ),
    exits={**EXITS, 141: "the reader of a pipe has closed it"},
)
@click.version_option(__version__, prog_name="lcp")
@click.pass_context
def lcp(context: click.Context) -> None:
    """Solve linear complementarity problems: find z >= 0 with w = Mz + q >= 0 and z'w = 0."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for command in (solve, compare, bench, check, inspect, make, completion):
    lcp.add_command(command)


def main() -> None:
    """Run the command line and exit with its code."""
    if sys.stdout is None:  # closed by the caller
        sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    leave(_run())


def _run() -> int:
    if VARIABLE in os.environ:
        from lcpcli.cli.shells import register

        register()
    try:
        code = lcp.main(standalone_mode=False, complete_var=VARIABLE)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.exceptions.Exit as ending:
        return ending.exit_code
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "lcp"
        return _complain(f"{where}: {_one_line(error.format_message())} (see {where} --help)")
    except click.ClickException as error:
        return _complain(f"lcp: {_one_line(error.format_message())}")
    except LCPError as error:
        return _complain(f"lcp: {error}")
    except (click.Abort, KeyboardInterrupt):
        return INTERRUPTED
    except MemoryError:
        _complain("lcp: not enough memory for this problem")
        return 1
    except OSError as error:  # of standard output: files turn theirs into an LCPError
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _complain(f"lcp: standard output cannot be written ({error.strerror}); choose another place with -o")


def _complain(message: str) -> int:
    readable = "".join(mark if mark.isprintable() else repr(mark)[1:-1] for mark in message)
    click.echo(readable, err=True)
    return 2


def _one_line(message: str) -> str:
    line = " ".join(message.split())
    return (line[0].lower() + line[1:]).rstrip(".") if line else line
