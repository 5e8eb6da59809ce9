"""lcp completion: print the script that sets up completion in a shell."""

from __future__ import annotations

import click

from lcpcli.cli.command import VARIABLE, Choice, Command, argument

SHELLS = {
    "bash": 'eval "$(lcp completion bash)" in ~/.bashrc; bash 4.4 or later',
    "zsh": 'eval "$(lcp completion zsh)" in ~/.zshrc, after compinit',
    "fish": "lcp completion fish > ~/.config/fish/completions/lcp.fish, once",
}


@click.command(
    cls=Command,
    short_help="Print a shell completion script.",
    examples=("lcp completion bash", "lcp completion zsh", "lcp completion fish"),
    lists={"Shells, and where the script belongs": SHELLS},
    exits={0: "printed", 2: "usage error (one-line message)"},
)
@argument("Shell", "shell", {"SHELL": "One of the shells below."}, metavar="SHELL", type=Choice(SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> int:
    """Print a script with which SHELL completes commands, options, methods, names and problem files."""
    from click.shell_completion import shell_complete

    from lcpcli.cli import shells as shells  # registers our scripts in place of click's

    return shell_complete(context.find_root().command, {}, "lcp", VARIABLE, f"{shell}_source")
