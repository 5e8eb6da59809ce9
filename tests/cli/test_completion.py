"""Words are completed by the shells without numpy, and an unknown one is answered with
the likely one."""

import os
import re
import shutil
import subprocess
import sys

import click
import pytest
from click.shell_completion import get_completion_class

from lcpcli.cli import command as group
from lcpcli.cli.command import VARIABLE, lcp
from lcpcli.cli.help import SHELLS, TOPICS
from lcpcli.errors import likely
from lcpcli.gallery import families as gallery
from lcpcli.gallery.families import FAMILIES
from lcpcli.methods.registry import METHODS
from lcpcli.peers.registry import PEERS, select
from lcpcli.report.document import FORMATS

from ..wordings import DID_YOU_MEAN, NO_OPTION
from .conftest import assert_refused, python


@pytest.fixture
def run(lcp):
    """The fixture, as lcp is the group of commands here."""
    return lcp


def items(line):
    """What is offered for the last of the words after lcp, which may be empty."""
    *args, incomplete = line.split(" ")
    complete = get_completion_class("bash")
    assert complete is not None
    return complete(lcp, {}, "lcp", VARIABLE).get_completions(args, incomplete)


def offered(line):
    return [item.value for item in items(line) if item.type == "plain"]


@pytest.mark.parametrize("name", lcp.commands)
def test_options(name):
    command = lcp.commands[name]
    params = command.get_params(
        click.Context(command, help_option_names=["-h", "--help"])
    )
    own = [
        flag
        for param in params
        if isinstance(param, click.Option)
        for flag in (*param.opts, *param.secondary_opts)
    ]
    # Click 8.1 has -h and --help in either order.
    assert sorted(offered(f"{name} -")) == sorted(own)
    assert offered(f"{name} --he") == ["--help"]


@pytest.mark.parametrize(
    ("words", "known"),
    [
        ("", sorted(lcp.commands)),
        ("solve --method ", list(METHODS)),
        ("make ", list(gallery.FAMILIES)),
        ("solve x.json --format ", list(FORMATS)),
        ("completion ", list(SHELLS)),
        ("help ", [*TOPICS, *lcp.commands]),
        *(
            (f"{name} port", ["portfolio"])
            for name in ("solve", "compare", "inspect", "convert", "check", "path")
        ),
        ("bench pap", ["paper", "paper-example-1", "paper-example-2"]),
        ("solve --x0 port", []),
        ("solve --tol ", []),
        ("nonsense x", []),
    ],
)
def test_words(words, known):
    assert offered(words) == known


def test_what_is_offered_can_be_given(run):
    found = offered("bench --peer ")
    assert set(found) == {*PEERS, "path"}
    assert all(select([name]) for name in found)
    for method in METHODS:
        assert "--method" not in run("solve", "--method", method, "missing.json").err


@pytest.mark.parametrize(
    ("words", "files"),
    [
        ("solve M.mtx x", True),
        ("check a.json x", True),
        ("bench sp", True),
        ("solve a.json --lower ", True),
        ("inspect a.json b.csv ", False),
        ("solve --method ", False),
    ],
)
def test_files_are_offered_where_a_word_may_name_one(words, files):
    assert [item.value for item in items(words) if item.type == "file"] == [
        words.split(" ")[-1]
    ] * files


def test_what_words_mean_fits_into_the_lines():
    commands = [lcp.commands[name] for name in lcp.commands]
    shown = [
        item
        for command in commands
        for item in command.shell_complete(click.Context(command), "-")
    ]
    shown += lcp.shell_complete(click.Context(lcp), "")
    assert all(item.help and "\n" not in item.help for item in shown)


COMPLETING = """
import contextlib, os, sys
from lcpcli.cli import main as cli
cli.leave = sys.exit  # it would end the process
sys.argv = ["lcp"]
for words in ("lcp solve --method ", "lcp make ", "lcp bench --peer "):
    os.environ |= {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split()))}
    with contextlib.suppress(SystemExit):
        cli.main()
print({"numpy", "scipy", "rich", "flint"} & {*sys.modules})
"""


def test_words_are_completed_without_numpy():
    done = python(COMPLETING, env=os.environ | {VARIABLE: "bash_complete"})
    assert (done.code, done.err) == (0, "")
    *lines, loaded = done.out.splitlines()
    assert {"plain,newton", "plain,murty", "plain,piqp"} <= {*lines}
    assert loaded == "set()"


BASH = """
complete() { :; }; compopt() { echo files; }
. ./script
offer() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _lcp_completion lcp
  printf '%s\\n' "${COMPREPLY[@]}"; }
offer lcp solve --method ne; offer lcp bench sp; offer lcp convert in
"""


def test_script_is_printed_for_each_shell_and_works_in_bash(tmp_path, monkeypatch, run):
    """Without a terminal: bash runs the script's function on words that stand for what
    is typed."""
    for shell in SHELLS:
        outcome = run("completion", shell)
        assert (outcome.code, outcome.err) == (0, "")
        assert re.search(rf"{VARIABLE}[= ]{shell}_complete", outcome.out)
    if shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    (tmp_path / "script").write_text(run("completion", "bash").out)
    command = tmp_path / "lcp"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lcpcli "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    done = subprocess.run(
        ["bash", "--norc", "-c", BASH],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    shown = ["newton", "files", "sparse", "speed", "files", ""]
    assert done.stdout.splitlines() == shown


KINDS = {
    "command": list(group.lcp.commands),
    "family": list(FAMILIES),
    "topic": list(TOPICS),
    "option": [
        param.opts[-1]
        for param in group.lcp.commands["solve"].params
        if isinstance(param, click.Option)
    ],
}


def misspelt(word):
    """The word with two neighbours exchanged, or with a letter too many."""
    for k in range(1, len(word)):
        yield word[: k - 1] + word[k] + word[k - 1] + word[k + 1 :]
        yield word[:k] + word[k - 1] + word[k:]


@pytest.mark.parametrize("kind", KINDS)
def test_a_slip_of_the_finger_is_corrected(kind):
    known = KINDS[kind]
    for word in known:
        if len(set(word)) >= 4:  # --x0 is as near to --z0
            wrong = {slip for slip in misspelt(word) if slip not in known}
            assert {slip: likely(slip, known) for slip in wrong} == dict.fromkeys(
                wrong, DID_YOU_MEAN.format(word)
            )


def test_capitals_and_beginnings_are_understood():
    assert likely("SHI", METHODS) == DID_YOU_MEAN.format("shi")
    assert likely("har", FAMILIES) == DID_YOU_MEAN.format("harker-pang")
    assert likely("", METHODS).startswith("choose one of auto")
    assert likely("zzz", METHODS, "look") == "look"


def test_every_command_suggests_the_likely_option(lcp):
    for name in group.lcp.commands:
        fault, hint = NO_OPTION.format(f"lcp {name}"), DID_YOU_MEAN.format("--help")
        assert_refused(lcp(f"{name} --hepl"), f"lcp: --hepl: {fault}; {hint}")
