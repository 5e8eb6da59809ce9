"""lcp help, the reference, one page per topic; lcp completion; and lcp kernels, which
compiles ahead of use."""

from __future__ import annotations

import itertools
import re
from collections import UserDict
from collections.abc import Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import click
from click.shell_completion import shell_complete

from lcpcli.cli.command import (
    VARIABLE,
    WHOLE,
    WIDEST,
    Candidates,
    Choice,
    command,
    lcp,
    tabulate,
)
from lcpcli.cli.declarations import argument, of_variants, option, refuse
from lcpcli.cli.terminal import Line, emit, shows_progress, terminal
from lcpcli.errors import (
    IS_EMPTY,
    LEAVE_OUT,
    Exit,
    OptionError,
    count,
    folded,
    quoted,
    unknown,
)
from lcpcli.methods.registry import (
    ADDITIONS,
    METHODS,
    NONLINEAR,
    OPTIONS,
    OTHER_NAMES,
    SWITCHES,
    known_options,
    suggestion,
)
from lcpcli.model import formulations
from lcpcli.options import MISSING, Option, has_numba
from lcpcli.report import columns

# One page per topic, in Markdown; its title is shown as its meaning.
FOLDER = Path(__file__).parent.parent / "topics"
# The row of a table that is replaced by the keys of a record, as its schema explains
# them.
KEYS = re.compile(r"^\| keys of \| `schemas/(.+)\.json` \|$", re.MULTILINE)


def _keys(match: re.Match[str]) -> str:
    """Return rows with the keys of a record that have a description, neighbours of the
    same meaning in one."""
    from lcpcli.report.result_formats import keys_of

    meanings = groupby(
        keys_of(match[1]).items(), lambda each: each[1].get("description", "")
    )
    rows = [
        (", ".join(f"`{key}`" for key, _ in keys_with_text), text)
        for text, keys_with_text in meanings
    ]
    return "\n".join(f"| {keys} | {text} |" for keys, text in rows if text)


class Pages(UserDict[str, str]):
    """The texts of the pages, by name. Those with the keys of records get them when
    they are read, as schemas are rarely needed."""

    def __getitem__(self, name: str) -> str:
        return KEYS.sub(_keys, self.data[name])


PAGES = Pages(
    {
        page.stem: page.read_text(encoding="utf-8")
        for page in sorted(FOLDER.glob("*.md"))
    }
)
FIRST = "tasks"  # the page that lists the others, in the order of tasks
TOPICS = {
    name: PAGES.data[name].partition("\n")[0].removeprefix("# ").strip()
    for name in dict.fromkeys(
        [FIRST, *re.findall(r"`(\w+)`", PAGES.data[FIRST]), *PAGES.data]
    )
    if name in PAGES.data
}
OF_THE_SOURCE = {"development": "lcpcli/development.md"}  # pages that are not installed
OTHER_WORDS = {  # for topics
    **dict.fromkeys(METHODS, "methods"),
    **dict.fromkeys(("exit", "exit-code", "exit-codes"), "statuses"),
    **dict.fromkeys(("scripts", "github", "gitlab"), "ci"),
    **dict.fromkeys(("jobs", "jsonl", "logs", "resume"), "many"),
    **dict.fromkeys(("files", "csv", "mtx", "npz", "npy", "mat", "gz"), "formats"),
    **dict.fromkeys(("citing", "citation", "bibtex"), "cite"),
    **dict.fromkeys(("residual", "residuals"), "statuses"),
    **dict.fromkeys(("bounds", "equations"), "mixed"),
    **dict.fromkeys(("game", "nfg"), "games"),
    **{
        word: row.page
        for kind, row in formulations.TABLE.items()
        for word in (kind, *(suffix[1:] for suffix in row.files))
    },
    **dict.fromkeys(("figures", "plot"), "measuring"),
    **dict.fromkeys(("ncp", "mcp", "josephy-newton"), "nonlinear"),
    **dict.fromkeys(("nl", "sol", "ampl", "pyomo", "jump", "gams"), "models"),
    **dict.fromkeys(("nnls", "lsq", "bvls"), "fits"),
    "frontier": "paths",
}
SECTIONS = re.compile(r"^(?=#+ )", re.MULTILINE)
LAST = ("changes", "sources")  # pages that explain no words, listed after the others
MAX_HEADINGS = 4  # shown of a page that has a word in many sections


GLOSSARY = "words"  # the page with a table of words, what they are here, and pages
ROW = re.compile(r"^\| (.+?) \| (.+) \| (`.+`) \|$", re.MULTILINE)


# A row that explains names: keys, routes and, after their exit codes, statuses.
NAMES = re.compile(
    r"^\| (?:\d+ \| )?(`[^`|]+`(?:, `[^`|]+`)*) \| ((?:[^|]|\\\|)+) \|$", re.MULTILINE
)


class Entry(NamedTuple):
    """A row of the glossary: words that mean the same or almost the same, what they are
    here, and the word for lcp help that leads on."""

    words: str
    meaning: str
    pages: list[str]


@command(
    short_help=f"Explain a topic: {', '.join(TOPICS)}.",
    examples=(
        "lcp help",
        "lcp help methods",
        "lcp help lemke",
        "lcp help solve --all",
        "lcp help shadow price",
    ),
    lists={"Topics": TOPICS},
    exits={
        Exit.SOLVED: "shown",
        Exit.BAD_INPUT: "the words are on no page (one-line message)",
    },
)
@argument(
    "Topic",
    "topic",
    {
        "TOPIC": (
            "A topic below, a command, a method, or a word to search for.  "
            "[default: list them]"
        )
    },
    required=False,
    shell_complete=lambda *given: Candidates({**TOPICS, **lcp.meanings()})(*given),
)
@argument(
    "Topic",
    "words",
    {
        "WORDS": (
            "After a page, only its sections whose headings have these words; else "
            "further words to search for."
        )
    },
    nargs=-1,
)
@option(
    "Topic",
    "--all shows_all  Show all options of a command, and all names that they take.",
)
@click.pass_context
def help(
    context: click.Context, topic: str | None, words: Sequence[str], shows_all: bool
) -> None:
    """Show the page on TOPIC, or its sections on a word; or say what words of the field
    are here, and list the pages that have them."""
    commands, rest = lcp.commands, " ".join(words)
    is_empty = topic is not None and not topic.strip()
    refuse(is_empty, "TOPIC", IS_EMPTY, "lcp help lists the topics")
    refuse(
        shows_all and topic not in commands,
        "--all",
        "shows all options of a command",
        "name one: lcp help solve --all",
    )
    refuse(
        bool(rest) and topic in commands,
        "WORDS",
        f"{quoted(topic or '')} is no page",
        LEAVE_OUT,
    )
    if topic is None:
        _list(context)
    elif topic in commands:
        named = click.Context(commands[topic], context.find_root(), topic)
        if shows_all:
            named.meta[WHOLE] = True
        click.echo(named.command.get_help(named))
    elif topic in PAGES:
        _show(_sections(topic, rest) if rest else PAGES[topic])
    elif topic in OTHER_WORDS and not rest:
        _show(_sections(OTHER_WORDS[topic], topic))
        if topic in METHODS or topic in NONLINEAR:
            emit(_lists_of(topic, commands["solve"], context), False)
    elif topic in OF_THE_SOURCE and not rest:
        click.echo(f"{topic}: {OF_THE_SOURCE[topic]} of the source is this page")
    else:
        _search(context, f"{topic} {rest}".strip())


def _list(context: click.Context) -> None:
    meanings = [row for row in lcp.meanings().items() if row[0] != context.info_name]
    formatter = context.make_formatter()
    tabulate(formatter, {"Topics": list(TOPICS.items()), "Commands": meanings})
    click.echo(
        f"Usage: {context.command_path} TOPIC\n\n{formatter.getvalue()}", nl=False
    )


def _sections(name: str, phrase: str) -> str:
    """Return the sections of a page, without its title, whose headings have the words;
    the page if none has."""
    has_words, (_, _, *parts) = _pattern(phrase), SECTIONS.split(PAGES[name])
    sections = [
        part.strip("\n") + "\n"
        for part in parts
        if has_words.search(folded(part.partition("\n")[0]))
    ]
    return "\n".join(sections) or PAGES[name]


def _show(page: str) -> None:
    width, color = terminal()
    if width is not None:
        from lcpcli.report.terminal import page as formatted

        page = formatted(page, min(width, WIDEST), color)
    emit(page, color)


def _lists_of(method: str, solve: click.Command, context: click.Context) -> str:
    """Return the options and the columns of a method as lists for help."""
    records = [
        param.get_help_record(context)
        for param in solve.params
        if param.name in known_options(method)
    ]
    flags = {param.name for param in solve.params}
    declared: dict[str, Option | str] = {**OPTIONS, **ADDITIONS, **SWITCHES}
    settings = [
        of_variants(name.replace("_", "-"), option)
        for name, option in declared.items()
        if name in known_options(method) - flags
    ]
    lists = {
        f"Options of lcp solve for {method}": list(filter(None, records)),
        f"Options in {method}:OPTION=VALUE,...": settings,
        f"Columns of the iterates of {method}": columns.meanings(method),
    }
    formatter = context.make_formatter()
    tabulate(formatter, {title: rows for title, rows in lists.items() if rows})
    return str(formatter.getvalue())


def _search(context: click.Context, phrase: str) -> None:
    """Show what words are here, by the glossary, and the pages that have them; raise
    OptionError if nothing has."""
    formatter, entries = context.make_formatter(), glossary()
    for page, meaning in _rows_on(phrase):
        formatter.write_text(f"{phrase}: {meaning}.")
        formatter.write_dl([(f"lcp help {page}", _title(page))])
        formatter.write("\n")
    about = [entry for entry in entries if _is_about(entry, phrase)]
    for entry in about:
        formatter.write_text(f"{entry.words}: {entry.meaning}.")
        more = [(f"lcp help {page}", _title(*page.split(" "))) for page in entry.pages]
        formatter.write_dl(more)
        formatter.write("\n")
    is_other_name = phrase.casefold() in OTHER_NAMES
    if not about and not is_other_name and (pages_with_phrase := _pages_with(phrase)):
        heading = f"Pages with {quoted(phrase)}, and their sections"
        tabulate(formatter, {heading: pages_with_phrase})
    if shown := formatter.getvalue().strip("\n"):
        click.echo(shown)
        return
    glossary_words = [
        word for entry in entries for word in entry.words.casefold().split(", ")
    ]
    hint = suggestion(
        phrase, [*TOPICS, *lcp.commands, *glossary_words], "lcp help lists the topics"
    )
    raise OptionError("TOPIC", unknown(phrase), hint)


@cache
def glossary() -> list[Entry]:
    return [
        Entry(words, meaning.replace("`", ""), re.findall("`(.+?)`", pages))
        for words, meaning, pages in ROW.findall(PAGES[GLOSSARY])
    ]


def _rows_on(name: str) -> list[tuple[str, str]]:
    """Return what the tables of the pages say about a name, each with its page."""
    name = folded(name).replace(" ", "_")
    rows = []
    for page in TOPICS:
        for names, meaning in NAMES.findall(PAGES[page]):
            if name in re.findall("`(.+?)`", names.replace(" ", "_")):
                rows.append((page, meaning.replace("`", "").replace("\\|", "|")))
    return rows


def _is_about(entry: Entry, phrase: str) -> bool:
    """Return whether the words have those of an entry among them."""
    entry_words = map(_plain, entry.words.split(", "))
    return any(
        re.search(rf"\b{re.escape(word)}\b", _plain(phrase)) for word in entry_words
    )


def _plain(phrase: str) -> str:
    """Return words in lower case, without hyphens and the s of a plural."""
    return re.sub(r"(?<=\w{3})s\b", "", folded(phrase).replace("-", " "))


def _title(name: str, phrase: str = "") -> str:
    """Return the title of a page, or that of its first section with a word."""
    page = _sections(name, phrase) if phrase else PAGES[name]
    return page.partition("\n")[0].strip("# ")


def _pattern(phrase: str, plural: str = "") -> re.Pattern[str]:
    """Return a pattern that matches words in a text. plural : a pattern for the ending
    of each of them."""
    parts = (re.escape(part) + plural for part in re.split(r"[-\s]+", folded(phrase)))
    return re.compile(r"(?<!\w)" + r"[-\s]+".join(parts) + r"(?!\w)")


def _pages_with(phrase: str) -> list[tuple[str, str]]:
    """Return the pages that have a word, as one or in the plural, each with the
    sections that do."""
    has_word, pages = _pattern(_plain(phrase), plural="s?"), []

    def rank(name: str) -> tuple[bool, int, int]:
        """Return a key by which pages with many exact occurrences come first."""
        page = folded(PAGES[name])
        as_asked = len(_pattern(phrase).findall(page))
        return name in LAST, -as_asked, -len(has_word.findall(page))

    frequent = sorted(PAGES, key=rank)
    for name in frequent:
        parts = [
            part
            for part in SECTIONS.split(PAGES[name])
            if has_word.search(folded(part))
        ]
        headings = [part.partition("\n")[0].strip("# ") for part in parts]
        if headings:
            more = (
                f"; {len(headings) - MAX_HEADINGS} more"
                if len(headings) > MAX_HEADINGS
                else ""
            )
            pages.append((name, "; ".join(headings[:MAX_HEADINGS]) + more))
    return pages


SHELLS = {
    "bash": 'eval "$(lcp completion bash)" in ~/.bashrc; bash 4.4 or later',
    "zsh": 'eval "$(lcp completion zsh)" in ~/.zshrc, after compinit',
    "fish": "lcp completion fish > ~/.config/fish/completions/lcp.fish, once",
}


@command(
    short_help="Print a shell completion script.",
    examples=("lcp completion bash", "lcp completion zsh", "lcp completion fish"),
    lists={"Shells, and where the script belongs": SHELLS},
    exits={Exit.SOLVED: "printed"},
)
@argument(
    "Shell",
    "shell",
    {"SHELL": "One of the shells below."},
    metavar="SHELL",
    type=Choice(SHELLS),
)
def completion(shell: str) -> int:
    """Print a script with which SHELL completes commands, options, methods, names and
    problem files."""
    return shell_complete(lcp, {}, "lcp", VARIABLE, f"{shell}_source")


@command(
    short_help="Compile the kernels of the extra fast ahead of time.",
    examples=("lcp kernels",),
    epilog=(
        "LCPCLI_KERNELS=1 in the environment makes all runs use them: see lcp help "
        "speed."
    ),
    exits={
        Exit.SOLVED: "all are compiled",
        Exit.BAD_INPUT: (
            "numba is missing, or cannot write its cache (one-line message)"
        ),
    },
)
def kernels() -> None:
    """Compile the kernels of the extra fast that numba does not have in its cache, and
    say where that is."""
    refuse(not has_numba(), "kernels", *MISSING)
    from lcpcli.kernels.loading import KERNELS, compile_all

    begun = itertools.count(1)
    with Line(total=KERNELS, is_shown=shows_progress(False)) as line:

        def tell(name: str) -> None:
            line.show(name, next(begun))

        now, before, folder = compile_all(tell)
    refuse(
        not folder,
        "NUMBA_DISABLE_JIT",
        "is set, so that nothing is compiled",
        "unset it",
    )
    click.echo(
        f"{count(now, 'kernel')} compiled, {before} already there; the cache is "
        f"in {folder}"
    )
