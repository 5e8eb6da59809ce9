"""Candidates for shell completion: words, and files with certain suffixes.

Nothing heavy is imported. A completer is the `shell_complete` of an option or argument; files among its candidates are
items of the type "file".
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

import click

from lcpcli.files import contents
from lcpcli.files.formats import PROBLEMS

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

VECTORS = (*PROBLEMS, ".txt")  # the suffixes of files that hold a vector

Completer = Callable[[click.Context, click.Parameter, str], "list[CompletionItem]"]


def words(meanings: Mapping[str, str], incomplete: str) -> list[CompletionItem]:
    """The words that begin like this, with their meanings."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(word, help=told) for word, told in meanings.items() if word.startswith(incomplete)]


def one_of(meanings: Mapping[str, str], endings: Iterable[str] = ()) -> Completer:
    """Complete one of the words, or a file with one of the suffixes if there are any."""

    def complete(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return words(meanings, incomplete) + (_paths(incomplete, tuple(endings)) if endings else [])

    return complete


def problems(*before: Completer, endings: tuple[str, ...] = PROBLEMS) -> Completer:
    """Complete what the completers before do, a file with one of the suffixes, or the name of a shipped problem.

    The latter are offered once a word has begun, or where nothing else is.
    """

    def complete(context: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        others = [item for each in (*before, files(*endings)) for item in each(context, param, incomplete)]
        names = dict.fromkeys(contents.shipped_problems(), "shipped problem")
        return others + (words(names, incomplete) if incomplete or not others else [])

    return complete


def files(*endings: str) -> Completer:
    """Complete a file with one of the suffixes, or any file if there are none."""
    return lambda _, __, incomplete: _paths(incomplete, endings)


def _paths(incomplete: str, endings: tuple[str, ...]) -> list[CompletionItem]:
    """The folders, and files with one of the suffixes, whose path begins like this; hidden ones only after a dot."""
    folder, start = os.path.split(incomplete)
    try:
        with os.scandir(os.path.expanduser(folder) or ".") as entries:  # noqa: PTH111 (Path drops a leading ./)
            found = [
                entry.name + "/" * entry.is_dir()
                for entry in entries
                if entry.name.startswith(start)
                and (start or not entry.name.startswith("."))
                and entry.name.isprintable()  # the reply to the shell consists of lines
                and (entry.is_dir() or not endings or entry.name.casefold().endswith(endings))
            ]
    except OSError:
        return []
    from click.shell_completion import CompletionItem

    before = incomplete[: len(incomplete) - len(start)]
    return [CompletionItem(before + name, type="file") for name in sorted(found)]
