"""lcp help, the reference, one page per topic; lcp completion; and lcp kernels, which
compiles ahead of use."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

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
from lcpcli.cli.declarations import argument, option, refuse
from lcpcli.cli.terminal import Line, emit, shows_progress, terminal
from lcpcli.errors import OptionError, count, folded, quoted
from lcpcli.methods.registry import (
    METHODS,
    NONLINEAR,
    OTHER_NAMES,
    known_options,
    suggestion,
)
from lcpcli.options import MISSING, has_numba
from lcpcli.report import columns

# One page per topic, in Markdown; its title is shown as its meaning.
FOLDER = Path(__file__).parent.parent / "topics"
PAGES = {
    page.stem: page.read_text(encoding="utf-8") for page in sorted(FOLDER.glob("*.md"))
}
TOPICS = {
    name: page.partition("\n")[0].removeprefix("# ").strip()
    for name, page in PAGES.items()
}
OF_THE_SOURCE = {"development": "lcpcli/development.md"}  # pages that are not installed
OTHER_WORDS = {  # for topics
    **dict.fromkeys(METHODS, "methods"),
    **dict.fromkeys(("exit", "exit-code", "exit-codes", "ci", "scripts"), "statuses"),
    **dict.fromkeys(("jobs", "jsonl", "logs", "resume"), "many"),
    **dict.fromkeys(("files", "csv", "mtx", "npz", "npy", "mat", "gz"), "formats"),
    **dict.fromkeys(("citing", "citation", "bibtex"), "cite"),
    **dict.fromkeys(("residual", "residuals"), "statuses"),
    **dict.fromkeys(("bounds", "equations"), "mixed"),
    **dict.fromkeys(
        ("qp", "lp", "mps", "qps", "game", "games", "nfg", "efg"), "programs"
    ),
    **dict.fromkeys(("figures", "plot"), "measuring"),
    **dict.fromkeys(("ncp", "mcp", "josephy-newton"), "nonlinear"),
    **dict.fromkeys(("nl", "sol", "ampl", "pyomo", "jump", "gams"), "models"),
    "frontier": "paths",
}
SECTIONS = re.compile(r"^(?=#+ )", re.MULTILINE)
LAST = ("changes", "sources")  # of the pages that have a word: those that explain none
MOST_HEADINGS = 4  # of a page that has a word in many sections


@command(
    short_help=f"Explain a topic: {', '.join(TOPICS)}.",
    examples=(
        "lcp help",
        "lcp help methods",
        "lcp help lemke",
        "lcp help solve --all",
        "lcp help degenerate",
    ),
    lists={"Topics": TOPICS},
    exits={0: "shown", 2: "the word is on no page (one-line message)"},
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
    "section",
    {"SECTION": "Only the sections of a page whose headings have this word."},
    required=False,
)
@option(
    "Topic", "--all whole  Show all options of a command, and all names that they take."
)
@click.pass_context
def help(
    context: click.Context, topic: str | None, section: str | None, whole: bool
) -> None:
    """Show the page on TOPIC, or the sections on a word that has some, formatted on a
    terminal and as Markdown in a pipe; or list the pages that have a word."""
    commands = lcp.commands
    refuse(
        whole and topic not in commands,
        "--all",
        "shows all options of a command",
        "name one: lcp help solve --all",
    )
    refuse(
        section is not None and topic not in PAGES,
        "SECTION",
        f"{quoted(topic or '')} is no page",
        "leave it out",
    )
    if topic is None:
        meanings = [
            row for row in lcp.meanings().items() if row[0] != context.info_name
        ]
        formatter = context.make_formatter()
        tabulate(formatter, {"Topics": list(TOPICS.items()), "Commands": meanings})
        click.echo(
            f"Usage: {context.command_path} TOPIC\n\n{formatter.getvalue()}", nl=False
        )
    elif topic in commands:
        named = click.Context(commands[topic], context.find_root(), topic)
        if whole:
            named.meta[WHOLE] = True
        click.echo(named.command.get_help(named))
    elif (page := PAGES.get(topic, PAGES.get(OTHER_WORDS.get(topic, "")))) is not None:
        # The sections, without the title, whose headings have the word.
        if topic not in PAGES or section is not None:
            has_word, (_, _, *parts) = _pattern(section or topic), SECTIONS.split(page)
            own = [
                part
                for part in parts
                if has_word.search(folded(part.partition("\n")[0]))
            ]
            page = "\n".join(part.strip("\n") + "\n" for part in own) or page
        width, color = terminal()
        if width is not None:
            from lcpcli.report.terminal import page as formatted

            page = formatted(page, min(width, WIDEST), color)
        emit(page, color)
        if topic not in PAGES and (topic in METHODS or topic in NONLINEAR):
            emit("\n" + _lists_of(topic, commands["solve"], context), False)
    elif topic in OF_THE_SOURCE:
        click.echo(f"{topic}: {OF_THE_SOURCE[topic]} of the source is this page")
    elif topic.casefold() not in OTHER_NAMES and (found := _places(topic)):
        formatter = context.make_formatter()
        tabulate(formatter, {f"Pages with {quoted(topic)}, and their sections": found})
        click.echo(formatter.getvalue().lstrip("\n"), nl=False)
    else:
        hint = suggestion(topic, [*TOPICS, *commands], "lcp help lists the topics")
        raise OptionError("TOPIC", f"{quoted(topic)} is unknown", hint)


def _lists_of(method: str, solve: click.Command, context: click.Context) -> str:
    """Return the options and the columns of a method as lists for help."""
    records = [
        param.get_help_record(context)
        for param in solve.params
        if param.name in known_options(method)
    ]
    lists = {
        f"Options of lcp solve for {method}": list(filter(None, records)),
        f"Columns of the iterates of {method}": columns.meanings(method),
    }
    formatter = context.make_formatter()
    tabulate(formatter, {title: rows for title, rows in lists.items() if rows})
    return str(formatter.getvalue())


def _pattern(word: str) -> re.Pattern[str]:
    return re.compile(rf"(?<!\w){re.escape(folded(word))}(?!\w)")


def _places(word: str) -> list[tuple[str, str]]:
    """Return the pages that have a word, each with the sections that do."""
    has_word, found = _pattern(word), []
    frequent = sorted(
        PAGES,
        key=lambda name: (name in LAST, -len(has_word.findall(folded(PAGES[name])))),
    )
    for name in frequent:
        parts = [
            part
            for part in SECTIONS.split(PAGES[name])
            if has_word.search(folded(part))
        ]
        headings = [part.partition("\n")[0].strip("# ") for part in parts]
        if headings:
            more = (
                f"; {len(headings) - MOST_HEADINGS} more"
                if len(headings) > MOST_HEADINGS
                else ""
            )
            found.append((name, "; ".join(headings[:MOST_HEADINGS]) + more))
    return found


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
        0: "all are compiled",
        2: "numba is missing, or cannot write its cache (one-line message)",
    },
)
def kernels() -> None:
    """Compile the kernels of the extra fast that numba does not have in its cache, and
    say where that is."""
    refuse(not has_numba(), "kernels", *MISSING)
    try:
        from lcpcli.kernels.announcement import KERNELS, compile_all

        begun, shown = itertools.count(1), shows_progress(False)
        with Line() as line:

            def tell(name: str) -> None:
                if shown:
                    line.show(f"{next(begun)}/{KERNELS}  {name}")

            now, before, folder = compile_all(tell)
    except RuntimeError as error:  # the cache has no place
        raise OptionError(
            "numba", str(error), "set NUMBA_CACHE_DIR to a folder that can be written"
        ) from None
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
