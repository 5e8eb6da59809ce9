"""lcp help, the reference, one page per topic; and lcp completion, by click with own scripts for bash, zsh and fish.

Importing this module registers the scripts. They differ from click's: only files that lcp can read are offered, beside
the words; --method=ne completes; fish keeps the order of words and the commas in descriptions, and knows ~; in zsh, lcp
need not be on PATH.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
    shell_complete,
)

from lcpcli.cli.command import VARIABLE, WIDEST_LINE, argument, command, lcp, write_tables
from lcpcli.cli.declarations import Candidates, Choice
from lcpcli.cli.output import emit, terminal
from lcpcli.errors import likely, quoted

if TYPE_CHECKING:
    Item = CompletionItem[Any]

FOLDER = Path(__file__).parent.parent / "topics"  # a page a topic, in Markdown; its title is its meaning in the list
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted(FOLDER.glob("*.md"))}
TOPICS = {name: page.partition("\n")[0].removeprefix("# ").strip() for name, page in PAGES.items()}


def _candidates(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[Item]:
    return Candidates({**TOPICS, **lcp.meanings()})(context, parameter, incomplete)


@command(
    short_help=f"Explain a topic: {', '.join(TOPICS)}.",
    examples=("lcp help", "lcp help methods", "lcp help solve", "lcp help json"),
    lists={"Topics": TOPICS},
    exits={0: "shown", 2: "unknown topic (one-line message)"},
)
@argument(
    "Topic",
    "topic",
    {"TOPIC": "One of the topics below, or a command.  [default: list them]"},
    required=False,
    shell_complete=_candidates,
)
@click.pass_context
def help(context: click.Context, topic: str | None) -> None:
    """Show the page on TOPIC: formatted on a terminal, and as Markdown in a pipe."""
    commands = lcp.commands
    if topic is None:
        meanings = [row for row in lcp.meanings().items() if row[0] != context.info_name]
        formatter = context.make_formatter()
        write_tables(formatter, {"Topics": list(TOPICS.items()), "Commands": meanings})
        click.echo(f"Usage: {context.command_path} TOPIC\n\n{formatter.getvalue()}", nl=False)
    elif topic in commands:
        named = commands[topic]
        click.echo(named.get_help(click.Context(named, context.find_root(), topic)))
    elif topic in TOPICS:
        width, color = terminal()
        page = PAGES[topic]
        if width is not None:
            from lcpcli.report.terminal import page as formatted

            page = formatted(page, min(width, WIDEST_LINE), color)
        emit(page, color)
    else:
        raise click.UsageError(f"no topic {quoted(topic)}; {likely(topic, [*TOPICS, *commands])}", context)


SHELLS = {
    "bash": 'eval "$(lcp completion bash)" in ~/.bashrc; bash 4.4 or later',
    "zsh": 'eval "$(lcp completion zsh)" in ~/.zshrc, after compinit',
    "fish": "lcp completion fish > ~/.config/fish/completions/lcp.fish, once",
}


@command(
    short_help="Print a shell completion script.",
    examples=("lcp completion bash", "lcp completion zsh", "lcp completion fish"),
    lists={"Shells, and where the script belongs": SHELLS},
    exits={0: "printed", 2: "usage error (one-line message)"},
)
@argument("Shell", "shell", {"SHELL": "One of the shells below."}, metavar="SHELL", type=Choice(SHELLS))
def completion(shell: str) -> int:
    """Print a script with which SHELL completes commands, options, methods, names and problem files."""
    return shell_complete(lcp, {}, "lcp", VARIABLE, f"{shell}_source")


class Bash(BashComplete):
    source_template = r"""_lcp_completion() {
    local item
    COMPREPLY=()
    while IFS= read -r item; do
        [[ $item == file,* ]] && compopt -o filenames && item=${item%%/}
        [[ $item ]] && COMPREPLY+=("${item#*,}")
    done < <(IFS=$'\n'; COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD %(complete_var)s=bash_complete "$1")
}
complete -o nosort -F _lcp_completion %(prog_name)s
"""

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the arguments as click does, except that bash splits --method=ne into three words."""
        args, incomplete = super().get_completion_args()
        return [word for word in args if word != "="], incomplete


class _WholeWords(ShellComplete):
    """A shell that treats --method=ne as one word, which a candidate has to replace as a whole."""

    def get_completions(self, args: list[str], incomplete: str) -> list[Item]:
        found = super().get_completions(args, incomplete)
        option, equals, _ = incomplete.partition("=")
        if not (equals and option.startswith("--")):
            return found
        return [CompletionItem(f"{option}={item.value}", item.type, item.help) for item in found]


class Zsh(_WholeWords, ZshComplete):
    source_template = r"""#compdef %(prog_name)s
_lcp_completion() {
    local type word meaning typed failed=1
    local -a described files folders
    while IFS= read -r type && IFS= read -r word && IFS= read -r meaning; do
        typed="${${(q)word}/#\\~/~}"
        case $type:$word in
            plain:*) described+=("$word:${meaning:#_}") ;;
            *:*/) folders+=("$typed") ;;
            *) files+=("$typed") ;;
        esac
    done < <(COMP_WORDS="${words[*]}" COMP_CWORD=$((CURRENT-1)) %(complete_var)s=zsh_complete "${words[1]}")
    (( $#described )) && _describe -V lcp described && failed=0
    (( $#files )) && compadd -Q -f -- $files && failed=0
    (( $#folders )) && compadd -Q -f -S '' -- $folders && failed=0
    return $failed
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    _lcp_completion "$@"
else
    compdef _lcp_completion %(prog_name)s
fi
"""


class Fish(_WholeWords, FishComplete):
    source_template = r"""function _lcp_completion
    set -lx COMP_WORDS (commandline -cp)
    set -lx COMP_CWORD (commandline -t)
    set -lx %(complete_var)s fish_complete
    %(prog_name)s | string replace -r '^\w+,' ''
end
complete --no-files --keep-order --command %(prog_name)s --arguments "(_lcp_completion)"
"""


for _shell in (Bash, Zsh, Fish):
    add_completion_class(_shell)  # as a decorator, click 8.1.0 loses the class
