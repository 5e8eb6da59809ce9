"""lcp help: the reference, one page a topic, and the help of the commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lcpcli.cli.command import WIDEST_LINE, Command, Group, argument, write_tables
from lcpcli.cli.options import Candidates
from lcpcli.cli.output import emit, terminal
from lcpcli.errors import likely, quoted

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

FOLDER = Path(__file__).parent.parent / "topics"  # a page a topic, in Markdown; its title is its meaning in the list


def _title(page: Path) -> str:
    with page.open(encoding="utf-8") as lines:
        return lines.readline().removeprefix("# ").strip()


TOPICS = {page.stem: _title(page) for page in sorted(FOLDER.glob("*.md"))}


def _group(context: click.Context) -> Group:
    group = context.find_root().command
    assert isinstance(group, Group)
    return group


def _offered(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    return Candidates({**TOPICS, **_group(context).meanings()})(context, parameter, incomplete)


@click.command(
    cls=Command,
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
    shell_complete=_offered,
)
@click.pass_context
def help(context: click.Context, topic: str | None) -> None:
    """Show the page on TOPIC: formatted on a terminal, and as Markdown in a pipe."""
    commands = _group(context).commands
    if topic is None:
        meanings = [row for row in _group(context).meanings().items() if row[0] != context.info_name]
        formatter = context.make_formatter()
        write_tables(formatter, {"Topics": list(TOPICS.items()), "Commands": meanings})
        click.echo(f"Usage: {context.command_path} TOPIC\n\n{formatter.getvalue()}", nl=False)
    elif topic in commands:
        command = commands[topic]
        click.echo(command.get_help(click.Context(command, context.find_root(), topic)))
    elif topic in TOPICS:
        _show((FOLDER / f"{topic}.md").read_text(encoding="utf-8"))
    else:
        raise click.UsageError(f"no topic {quoted(topic)}; {likely(topic, [*TOPICS, *commands])}", context)


def _show(page: str) -> None:
    width, color = terminal()
    if width is not None:
        from lcpcli.report import pages

        page = pages.render(page, min(width, WIDEST_LINE), color)
    emit(page, color)
