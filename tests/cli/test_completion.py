"""The shells complete commands, options, names and problem files, and nothing else, without loading numpy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from lcpcli.bench import suites
from lcpcli.cli import help as completion
from lcpcli.cli.command import VARIABLE, lcp
from lcpcli.cli.help import SHELLS, TOPICS
from lcpcli.files import contents, formats
from lcpcli.gallery import families as gallery
from lcpcli.methods.registry import METHODS
from lcpcli.peers.registry import PEERS, select
from lcpcli.report.result_formats import FORMATS

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
CLASSES = {"bash": completion.Bash, "zsh": completion.Zsh, "fish": completion.Fish}


def offered(*words: str, shell: str = "bash") -> list[str]:
    """What is offered for the last of the words after lcp."""
    *args, incomplete = words
    found = CLASSES[shell](lcp, {}, "lcp", VARIABLE).get_completions(args, incomplete)
    return [item.value for item in found]


def answer(shell: str, words: str, current: str) -> list[str]:
    """The lines that a shell's script reads for the command line `words`, with the cursor on word number `current`."""
    os.environ.update(COMP_WORDS=words, COMP_CWORD=current)
    return CLASSES[shell](lcp, {}, "lcp", VARIABLE).complete().splitlines()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files and folders to choose from, as the current one."""
    for name in (
        "a.json",
        "b.csv",
        "c.npz",
        "d.mtx",
        "e.mtx.gz",
        "f.JSON",
        "g.txt",
        "h.py",
        "i.gz",
        "k.npy",
        "l.mat",
        ".hidden.json",
        "a\nb.json",
    ):
        (tmp_path / name).touch()
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "my own.json").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COMP_WORDS", "")
    monkeypatch.setenv("COMP_CWORD", "")
    return tmp_path


def test_commands() -> None:
    assert offered("") == sorted(lcp.commands)
    assert offered("co") == ["compare", "completion", "convert"]


@pytest.mark.parametrize("name", lcp.commands)
def test_options(name: str) -> None:
    command = lcp.commands[name]
    params = command.get_params(click.Context(command, help_option_names=["-h", "--help"]))
    own = [flag for param in params if isinstance(param, click.Option) for flag in (*param.opts, *param.secondary_opts)]
    assert sorted(offered(name, "-")) == sorted(own)  # click 8.1 has -h and --help in either order
    assert offered(name, "--he") == ["--help"]


@pytest.mark.parametrize("name", ["solve", "compare", "bench"])
def test_methods_are_all_and_only_those_that_can_be_given(name: str, lcp: Lcp) -> None:
    assert offered(name, "--method", "") == list(METHODS)
    assert offered(name, "--method", "ne") == ["newton"]
    for method in offered(name, "--method", ""):
        assert "--method" not in lcp(name, "--method", method, "missing.json").err


@pytest.mark.parametrize(
    ("words", "known"),
    [
        (["make", ""], list(gallery.FAMILIES)),
        (["make", "near-"], ["near-singular", "near-degenerate"]),
        (["solve", "x.json", "--format", ""], list(FORMATS)),
        (["check", "--format", ""], ["table", "json"]),
        (["completion", ""], list(SHELLS)),
        (["help", ""], [*TOPICS, *lcp.commands]),
        (["help", "me"], ["measuring", "methods"]),
        (["bench", "sp"], ["sparse", "speed"]),
        (["solve", "--tol", ""], []),
        (["nonsense", "x"], []),
    ],
)
def test_words(words: list[str], known: list[str]) -> None:
    assert offered(*words) == known


def test_every_peer_that_is_offered_can_be_selected() -> None:
    found = offered("bench", "--peer", "")
    assert set(found) == {*PEERS, "siconos"}
    assert all(select([name]) for name in found)


def test_files_are_those_that_can_be_read(folder: Path) -> None:
    problems = ["a.json", "b.csv", "c.npz", "d.mtx", "e.mtx.gz", "f.JSON", "inner/", "k.npy", "l.mat"]
    assert offered("solve", "") == offered("solve", "M.mtx", "") == offered("compare", "x.json", "") == problems
    assert offered("inspect", "") == problems
    assert {Path(name).suffix.casefold() for name in problems if name[0] not in "ei"} <= {*formats.FOR_ALL}
    assert offered("check", "a.json", "") == sorted([*problems, "g.txt"])
    assert offered("bench", "") == [*suites.SUITES, suites.ALL, *problems]
    assert offered("bench", "--resume", "") == ["a.json", "f.JSON", "inner/"]
    assert offered("solve", "a.json", "-o", "h") == ["h.py"]
    assert offered("inspect", "a.json", "b.csv", "") == []
    assert {path.name for path in folder.iterdir()} > {name.rstrip("/") for name in problems}


def test_shipped_problems_are_offered_once_a_word_has_begun_or_where_there_are_no_files(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert offered("solve", "paper") == ["paper-example-1", "paper-example-2"]
    assert offered("check", "winkels") == offered("bench", "winkels") == ["winkels"]
    assert offered("inspect", "a") == ["a.json"]
    (folder / "inner" / "my own.json").unlink()
    monkeypatch.chdir(folder / "inner")
    assert offered("convert", "") == list(contents.shipped_problems())


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("inner/", ["inner/my own.json"]),
        ("./in", ["./inner/"]),
        ("inner/../a", ["inner/../a.json"]),
        (".h", [".hidden.json"]),
        ("nowhere/", []),
        ("a.json/", []),
        ("~/in", ["~/inner/"]),
    ],
)
def test_paths_stay_as_they_are_typed(
    typed: str, found: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(folder))
    assert offered("solve", typed) == found


def test_lines_for_the_shells(folder: Path) -> None:
    assert folder.exists()
    newton = METHODS["newton"].meaning
    assert answer("bash", "lcp\nsolve\n--method\nne", "3") == ["plain,newton"]
    assert answer("bash", "lcp\nsolve\n--method\n=\nne", "4") == ["plain,newton"]
    assert answer("zsh", "lcp solve --method ne", "3") == ["plain", "newton", newton]
    assert answer("zsh", "lcp solve --method=ne", "2") == ["plain", "--method=newton", newton]
    assert answer("fish", "lcp solve --method=ne", "--method=ne") == [f"plain,--method=newton\t{newton}"]
    assert answer("bash", "lcp\nsolve\nin", "2") == answer("fish", "lcp solve in", "in") == ["file,inner/"]
    assert answer("zsh", "lcp solve in", "2") == ["file", "inner/", "_"]
    assert answer("fish", "lcp solve inner/", "inner/") == ["file,inner/my own.json"]


def test_what_words_mean_fits_into_the_lines() -> None:
    commands = [lcp.commands[name] for name in lcp.commands]
    items = [item for command in commands for item in command.shell_complete(click.Context(command), "-")]
    items += lcp.shell_complete(click.Context(lcp), "")
    assert all(item.help and "\n" not in item.help for item in items)


@pytest.mark.parametrize("words", ["lcp solve --method ", "lcp solve ", "lcp make ", "lcp bench --peer ", "lcp "])
def test_a_word_is_completed_without_numpy(words: str) -> None:
    code = (
        "import sys; sys.argv = ['lcp']\n"
        "from lcpcli.cli.main import main\n"
        "try: main()\n"
        "finally: print(sorted({m.split('.')[0] for m in sys.modules} & {'numpy', 'scipy', 'rich'}))"
    )
    asked = {VARIABLE: "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()))}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **asked})
    *lines, loaded = done.stdout.splitlines()
    assert (done.returncode, done.stderr, loaded) == (0, "", "[]")
    assert lines


@pytest.mark.parametrize("shell", SHELLS)
def test_script_is_printed_for_the_command(shell: str, lcp: Lcp) -> None:
    outcome = lcp("completion", shell)
    assert (outcome.code, outcome.err) == (0, "")
    assert f"{VARIABLE}={shell}_complete" in outcome.out or f"{VARIABLE} {shell}_complete" in outcome.out


BASH = """
complete() { :; }; compopt() { echo "compopt $*"; }
. ./script
offer() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _lcp_completion lcp; printf '%s\\n' "${COMPREPLY[@]}"; }
offer lcp solve --method ne; offer lcp solve inner/; offer lcp bench in
offer lcp solve none > /dev/null; echo ${#COMPREPLY[@]}
"""
ZSH = """
compdef() { :; }; _describe() { print -rl -- ${(P)3}; }; compadd() { print -r -- "$*"; }
. ./script
offer() { words=("$@"); CURRENT=$#; _lcp_completion; }
offer lcp solve --method ne; offer lcp solve inner/; offer lcp solve "~/in"
"""
FISH = """
source ./script
complete -C "lcp solve --method ne"; complete -C "lcp solve inner/"; complete -C "lcp solve ~/in"
"""
NEWTON = METHODS["newton"].meaning
REAL = [
    (
        "bash",
        ["--norc", "-c", BASH],
        ["newton", "compopt -o filenames", "inner/my own.json", "compopt -o filenames", "inner", "0"],
    ),
    ("zsh", ["-f", "-c", ZSH], [f"newton:{NEWTON}", "-Q -f -- inner/my\\ own.json", "-Q -f -S  -- ~/inner/"]),
    ("fish", ["--no-config", "-c", FISH], [f"newton\t{NEWTON}", "inner/my own.json", "~/inner/"]),
]


@pytest.mark.parametrize(("shell", "options", "shown"), REAL, ids=SHELLS)
def test_in_the_shell_itself(shell: str, options: list[str], shown: list[str], folder: Path, lcp: Lcp) -> None:
    """Without a terminal: bash and zsh run the script's function on words that stand for what is typed."""
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    (folder / "script").write_text(lcp("completion", shell).out)
    (folder / "bin").mkdir()
    command = folder / "bin" / "lcp"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lcpcli "$@"\n')
    command.chmod(0o755)
    environment = {**os.environ, "PATH": f"{command.parent}{os.pathsep}{os.environ['PATH']}", "HOME": str(folder)}
    done = subprocess.run([shell, *options], capture_output=True, text=True, env=environment, timeout=60)
    assert (done.stdout.splitlines(), done.stderr) == (shown, "")
