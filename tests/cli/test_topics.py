"""lcp help: the topics and commands, a page in a pipe and on a terminal, and the help of a command."""

from __future__ import annotations

import re

import pytest

from lcpcli.cli import command as group
from lcpcli.cli import help as command
from lcpcli.cli.help import FOLDER, TOPICS
from lcpcli.report import terminal
from lcpcli.version import VERSION

from .conftest import Lcp, assert_refused


def source(topic: str) -> str:
    return (FOLDER / f"{topic}.md").read_text(encoding="utf-8")


def words(text: str) -> list[str]:
    return re.findall(r"\w+", text)


def test_topics_and_commands_are_listed_with_their_meanings(lcp: Lcp) -> None:
    outcome = lcp("help")
    assert (outcome.code, outcome.err) == (0, "")
    for topic, meaning in TOPICS.items():
        assert f"\n  {topic} " in outcome.out
        assert source(topic).startswith(f"# {meaning}\n\n")
    assert all(f"\n  {name} " in outcome.out for name in group.lcp.commands if name != "help")
    assert not set(TOPICS) & set(group.lcp.commands)
    assert all(topic in lcp("--help").out for topic in TOPICS)


def test_help_on_a_command_is_its_own_help_and_on_a_topic_in_a_pipe_its_markdown(lcp: Lcp) -> None:
    for name in group.lcp.commands:
        assert lcp("help", name).out == lcp(name, "--help").out
    meant = {"exit": "statuses", "exit-codes": "statuses", "shi": "methods", "resume": "many", "residual": "statuses"}
    meant |= {"bounds": "mixed", "qp": "programs", "citing": "cite"}
    for word, topic in (meant | {topic: topic for topic in TOPICS}).items():
        assert lcp("help", word).out == source(topic)


def test_unknown_topic_suggests_the_likely_one(lcp: Lcp) -> None:
    told = "lcp help: no topic 'metods'; did you mean methods? (see lcp help --help)\n"
    assert_refused(lcp("help", "metods"), told)
    assert "choose one of changes, cite, derivatives, " in lcp("help", "zzz").err


def test_a_word_that_is_no_topic_is_looked_for_on_all_pages(lcp: Lcp) -> None:
    outcome = lcp("help", "duality gap")
    assert outcome.code == 0
    assert outcome.out.startswith("Pages with 'duality gap', and their sections:")
    shown = {line.split()[0] for line in outcome.out.splitlines()[1:] if re.match(r"  \w", line)}
    assert shown == {topic for topic in TOPICS if re.search(r"\bduality gap\b", source(topic))}


@pytest.mark.parametrize("topic", TOPICS)
def test_page_fits_a_terminal_with_every_line_of_code_and_name_of_a_page_whole(topic: str) -> None:
    shown = terminal.page(source(topic), 80, color=False)
    assert max(map(len, shown.splitlines())) <= 80
    assert sorted(words(shown)) == sorted(words(re.sub(r"^```\w*$", "", source(topic), flags=re.MULTILINE)))
    for block in re.findall(r"^```\w+\n(.*?)^```$", source(topic), flags=re.MULTILINE | re.DOTALL):
        assert all(f" {line}".rstrip() in shown.splitlines() for line in block.splitlines())
    narrow = terminal.page(source(topic), 60, color=False)
    sentences = [line for line in narrow.splitlines() if not re.match(r" {2,}|.*\S {2,}\S", line)]  # of no table
    assert [line for line in sentences if line.endswith("lcp help")] == []
    assert terminal.NO_BREAK not in narrow


@pytest.mark.parametrize("color", [False, True])
def test_terminal_shows_the_page_formatted(color: bool, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "terminal", lambda: (200, color))
    shown = lcp("help", "statuses").out
    assert ("```" in shown, "**" in shown, "\x1b[" in shown) == (False, False, color)
    plain = re.sub(r"\x1b\[[\d;]*m", "", shown)
    assert 80 < max(len(line.rstrip()) for line in plain.splitlines()) <= 100


def test_the_version_comes_with_its_citation_which_the_page_has_too(lcp: Lcp) -> None:
    first, blank, *citation = lcp("--version").out.splitlines()
    assert (first, blank) == (f"lcp, version {VERSION}", "")
    assert "\n".join(citation) in (FOLDER / "cite.md").read_text(encoding="utf-8")
