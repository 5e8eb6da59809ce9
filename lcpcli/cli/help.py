"""lcp help, the reference, one page per topic; and lcp completion."""

from __future__ import annotations

import re
from pathlib import Path

import click
from click.shell_completion import CompletionItem, shell_complete

from lcpcli.cli.command import VARIABLE, WIDEST_LINE, Candidates, Choice, argument, command, lcp, write_tables
from lcpcli.cli.terminal import emit, terminal
from lcpcli.errors import OptionError, folded, likely, quoted
from lcpcli.methods.registry import METHODS

FOLDER = Path(__file__).parent.parent / "topics"  # one page per topic, in Markdown; its title is shown as its meaning
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted(FOLDER.glob("*.md"))}
TOPICS = {name: page.partition("\n")[0].removeprefix("# ").strip() for name, page in PAGES.items()}
OTHER_WORDS = {  # for topics
    **dict.fromkeys(METHODS, "methods"),
    **dict.fromkeys(("exit", "exit-code", "exit-codes", "ci", "scripts"), "statuses"),
    **dict.fromkeys(("jobs", "jsonl", "logs", "resume"), "many"),
    **dict.fromkeys(("files", "csv", "mtx", "npz", "npy", "mat", "gz"), "formats"),
    **dict.fromkeys(("citing", "citation", "bibtex"), "cite"),
    **dict.fromkeys(("residual", "residuals"), "statuses"),
    **dict.fromkeys(("bounds", "equations"), "mixed"),
    **dict.fromkeys(("qp", "lp", "mps", "game", "games", "nfg", "efg"), "programs"),
    **dict.fromkeys(("figures", "plot"), "measuring"),
    **dict.fromkeys(("ncp", "mcp", "josephy-newton"), "nonlinear"),
    **dict.fromkeys(("nl", "sol", "ampl", "pyomo", "jump", "gams"), "models"),
    "frontier": "paths",
}
SECTIONS = re.compile(r"^(?=#+ )", re.MULTILINE)
MOST_HEADINGS = 4  # of a page that has a word in many sections


def _candidates(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    return Candidates({**TOPICS, **lcp.meanings()})(context, parameter, incomplete)


@command(
    short_help=f"Explain a topic: {', '.join(TOPICS)}.",
    examples=("lcp help", "lcp help methods", "lcp help solve", "lcp help degenerate"),
    lists={"Topics": TOPICS},
    exits={0: "shown", 2: "the word is on no page (one-line message)"},
)
@argument(
    "Topic",
    "topic",
    {"TOPIC": "One of the topics below, a command, or a word to search for.  [default: list them]"},
    required=False,
    shell_complete=_candidates,
)
@click.pass_context
def help(context: click.Context, topic: str | None) -> None:
    """Show the page on TOPIC, or the sections on a word that has some, formatted on a terminal and as Markdown in a
    pipe; or list the pages that have a word."""
    commands = lcp.commands
    if topic is None:
        meanings = [row for row in lcp.meanings().items() if row[0] != context.info_name]
        formatter = context.make_formatter()
        write_tables(formatter, {"Topics": list(TOPICS.items()), "Commands": meanings})
        click.echo(f"Usage: {context.command_path} TOPIC\n\n{formatter.getvalue()}", nl=False)
    elif topic in commands:
        named = commands[topic]
        click.echo(named.get_help(click.Context(named, context.find_root(), topic)))
    elif (page := PAGES.get(topic, PAGES.get(OTHER_WORDS.get(topic, "")))) is not None:
        page = page if topic in PAGES else _sections(page, topic)
        width, color = terminal()
        if width is not None:
            from lcpcli.report.terminal import page as formatted

            page = formatted(page, min(width, WIDEST_LINE), color)
        emit(page, color)
    elif found := _places(topic):
        formatter = context.make_formatter()
        write_tables(formatter, {f"Pages with {quoted(topic)}, and their sections": found})
        click.echo(formatter.getvalue().lstrip("\n"), nl=False)
    else:
        hint = likely(topic, [*TOPICS, *commands], "lcp help lists the topics")
        raise OptionError("TOPIC", f"{quoted(topic)} is unknown", hint)


def _sections(page: str, word: str) -> str:
    """Return the sections of a page, without its title, whose headings have a word, or the page if none has."""
    has_word = re.compile(rf"(?<!\w){re.escape(folded(word))}(?!\w)")
    _, _, *parts = SECTIONS.split(page)
    own = [part for part in parts if has_word.search(folded(part.partition("\n")[0]))]
    return "\n".join(part.strip("\n") + "\n" for part in own) or page


def _places(word: str) -> list[tuple[str, str]]:
    """Return the pages that have a word, each with the sections that do."""
    has_word = re.compile(rf"(?<!\w){re.escape(folded(word))}(?!\w)")
    found = []
    for name, page in PAGES.items():
        sections = (
            part.partition("\n")[0].strip("# ") for part in SECTIONS.split(page) if has_word.search(folded(part))
        )
        if headings := list(sections):
            more = f"; {len(headings) - MOST_HEADINGS} more" if len(headings) > MOST_HEADINGS else ""
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
@argument("Shell", "shell", {"SHELL": "One of the shells below."}, metavar="SHELL", type=Choice(SHELLS))
def completion(shell: str) -> int:
    """Print a script with which SHELL completes commands, options, methods, names and problem files."""
    return shell_complete(lcp, {}, "lcp", VARIABLE, f"{shell}_source")
