"""Completion in bash, zsh and fish, by click's machinery with scripts of our own.

A script runs lcp with the words typed so far in the environment, as click defines it. Click's own scripts leave files
to the shell; these show the files that lcp would read alone, and go on into folders.
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
)

from lcpcli.cli.command import VARIABLE

if TYPE_CHECKING:
    Item = CompletionItem[Any]

SEPARATOR = "\t"

BASH = r"""_lcp_completion() {
    local type word meaning
    COMPREPLY=()
    while IFS=$'\t' read -r type word meaning; do
        [[ $type == file ]] && compopt -o filenames
        COMPREPLY+=("$word")
    done < <(IFS=$'\n'; COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD %(complete_var)s=bash_complete "$1")
}
complete -o nosort -F _lcp_completion %(prog_name)s
"""

ZSH = r"""#compdef %(prog_name)s
_lcp_completion() {
    local type word meaning
    local -a words_told files
    while IFS=$'\t' read -r type word meaning; do
        if [[ $type == file ]]; then
            files+=("${${(q)word}/#\\~/~}")
        else
            words_told+=("${word//:/\\:}:$meaning")
        fi
    done < <(COMP_WORDS="${words[*]}" COMP_CWORD=$((CURRENT-1)) %(complete_var)s=zsh_complete "${words[1]}")
    local failed=1
    (( $#words_told )) && _describe -V lcp words_told && failed=0
    (( $#files )) && compadd -Q -f -- $files && failed=0
    return $failed
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    _lcp_completion "$@"
else
    compdef _lcp_completion %(prog_name)s
fi
"""

FISH = r"""function _lcp_completion
    set -lx COMP_WORDS (commandline -cp)
    set -lx COMP_CWORD (commandline -t)
    set -lx %(complete_var)s fish_complete
    %(prog_name)s
end
complete --no-files --keep-order --command %(prog_name)s --arguments "(_lcp_completion)"
"""


def _line(item: Item) -> str:
    meaning = " ".join((item.help or "").split())
    return SEPARATOR.join((item.type, item.value, meaning))


class Bash(BashComplete):
    source_template = BASH

    def get_completion_args(self) -> tuple[list[str], str]:
        """As click does it, but bash makes three words of --method=ne."""
        args, incomplete = super().get_completion_args()
        return [word for word in args if word != "="], incomplete

    def format_completion(self, item: Item) -> str:
        return _line(item)


class _WholeWords(ShellComplete):
    """A shell to which --method=ne is one word, and so must be what completes it."""

    def get_completions(self, args: list[str], incomplete: str) -> list[Item]:
        found = super().get_completions(args, incomplete)
        option, equals, _ = incomplete.partition("=")
        if not (equals and option.startswith("--")):
            return found
        return [CompletionItem(f"{option}={item.value}", item.type, item.help) for item in found]


class Zsh(_WholeWords, ZshComplete):
    source_template = ZSH

    def format_completion(self, item: Item) -> str:
        return _line(item)


class Fish(_WholeWords, FishComplete):
    source_template = FISH

    def format_completion(self, item: Item) -> str:
        """A line for fish, which goes on after a slash, and takes any other word for complete."""
        folder = item.type == "file" and Path(item.value.partition("=")[2] or item.value).expanduser().is_dir()
        return _line(CompletionItem(item.value + "/" * folder, item.type, item.help)).partition(SEPARATOR)[2]


SHELLS: dict[str, type[ShellComplete]] = {"bash": Bash, "zsh": Zsh, "fish": Fish}


def register() -> None:
    """Let click answer what the scripts of these shells ask."""
    for name, answering in SHELLS.items():
        add_completion_class(answering, name)


def script(shell: str, command: click.Command) -> str:
    """The script that makes a shell complete the words of lcp, which is that command."""
    return SHELLS[shell](command, {}, "lcp", VARIABLE).source()
