"""The command lcp: its commands, and how it ends. Errors become one line on standard error and exit code 2."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from lcpcli import __version__
from lcpcli.cli.bench import bench
from lcpcli.cli.check import check
from lcpcli.cli.compare import compare
from lcpcli.cli.inspect import inspect
from lcpcli.cli.make import make
from lcpcli.cli.solve import solve
from lcpcli.compiled import leave
from lcpcli.errors import LCPError

INTERRUPTED = 130


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}, invoke_without_command=True
)
@click.version_option(__version__, prog_name="lcp")
@click.pass_context
def lcp(context: click.Context) -> None:
    """Solve linear complementarity problems: z >= 0, w = Mz + q >= 0, z'w = 0.

    \b
    lcp solve problem.json      solve one problem
    lcp compare                 both methods side by side on the paper's examples
    lcp bench                   methods and other solvers on suites of problems, with statistics
    lcp check FILE SOLUTION     judge an answer, whoever gave it
    lcp make obstacle           write a problem of the gallery
    lcp inspect problem.json    what the problem is, and which methods are guaranteed to solve it

    Exit codes: 0 solved, 1 not solved, 2 bad usage or bad input, 3 proved to have no solution, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


lcp.add_command(solve)
lcp.add_command(compare)
lcp.add_command(bench)
lcp.add_command(check)
lcp.add_command(make)
lcp.add_command(inspect)


def main() -> None:
    """Run the command line and exit with its code."""
    if sys.stdout is None:  # closed by the caller
        sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    leave(_run())


def _run() -> int:
    try:
        code = lcp.main(standalone_mode=False)
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
