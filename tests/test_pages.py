"""README and the pages of `lcp help` hold: commands print what is shown, snippets work,
figures are measured again."""

import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from shutil import which

import pytest

import lcpcli
from lcpcli.bench import suites
from lcpcli.bench.timing import run_method
from lcpcli.cli import command as group
from lcpcli.cli import help as pages
from lcpcli.cli.declarations import STARTS
from lcpcli.cli.help import FOLDER, OF_THE_SOURCE, TOPICS
from lcpcli.cli.main import of_status
from lcpcli.files.formats import FORMATS
from lcpcli.gallery import families as gallery
from lcpcli.methods.registry import METHODS, OPTIONS
from lcpcli.report import document
from lcpcli.report.wording import flag
from lcpcli.solving import result

from .benchmarks.accuracy import ladders, rate_of_fixed_point

ROOT = Path(__file__).parent.parent
# Where the package is imported from: the checkout, or where it is installed.
PACKAGE = str(Path(lcpcli.__file__).parent.parent)
FILES = {
    "README": ROOT / "README.md",
    "development": ROOT / OF_THE_SOURCE["development"],
}
FILES |= {topic: FOLDER / f"{topic}.md" for topic in TOPICS}
PAGES = {page: file.read_text(encoding="utf-8") for page, file in FILES.items()}
PAGES |= pages.PAGES  # with the keys of records
README = PAGES["README"]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)
BLOCKS = {page: BLOCK.findall(text) for page, text in PAGES.items()}
SCRIPT = "esac\n"  # a block that has it is one command
DISTURBED = "x between repeats"
WRITING = re.compile("-o|--(plot|paths|trace)")  # options that name a file to write
# Of what goes to a file.
VERDICT = (
    r"(lcp: "
    r".*(solved|solves|solutions?|optimal|reaches|positive|succeeded|wrote).*\n)*"
)
# Of a residual, whose digits depend on the machine.
ROUNDING = re.compile(r"\b\d\.\de-1[5-9]\b")
TIMES = re.compile(r"\d[\d.]*(e[-+]\d+)? ?(us|ms|s)\b|time/\w+")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Where a reader of a page works: an empty folder, away from the checkout."""
    return cache(tmp_path_factory.mktemp)


def shell(command, folder, code=None):
    """What a command prints in a shell that finds this program as lcp; `code` is how it
    must end, if that matters."""
    programs = folder.with_name(f"{folder.name}-bin")
    programs.mkdir(exist_ok=True)
    program = programs / "lcp"
    python = shlex.quote(sys.executable)
    program.write_text(f'#!/bin/sh\nexec {python} -m lcpcli "$@"\n')
    program.chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": PACKAGE, "NO_COLOR": "1"}
    environment["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", command],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )
    assert re.fullmatch(VERDICT if WRITING.search(command) else "", done.stderr), (
        done.stderr
    )
    assert code in (None, done.returncode)
    return done.stdout


def sessions(block):
    """The commands of a block, each with what it prints; a line that begins with >
    continues a command."""
    found = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], ""))
        elif line.startswith("> ") and not found[-1][1]:
            found[-1] = (f"{found[-1][0]}\n{line[2:]}", "")
        else:
            found[-1] = (found[-1][0], f"{found[-1][1]}{line}\n")
    return found


def comparable(text):
    """Lines as cells, without times and without what `shi` computes, whose last digits
    depend on the machine."""
    lines, timed, method, times = [], False, "", []
    for line in text.splitlines():
        timed = "time/" in line or (timed and bool(line.strip()))
        cells = ROUNDING.sub("0", TIMES.sub("TIME", line)).split()
        if cells[-1:] == ["status"]:  # the head of a summary, with its columns of times
            heads = line.replace("to 1e", "to_1e").split()
            times = [i for i, head in enumerate(heads) if head in ("us", "ms", "s")]
            cells = [head for i, head in enumerate(heads) if i not in times]
        elif times and len(cells) == len(heads):
            cells = [cell for i, cell in enumerate(cells) if i not in times]
        if not cells or set(line) == {"-"} or DISTURBED in line:
            continue
        if timed and re.fullmatch(r"[\d.]+(e\+\d+)?", cells[-1]):
            cells[-1] = "TIME"
        method = cells[0] if not cells[0][0].isdigit() else method
        lines.append([cells[0]] if method == "shi" else cells)
    return [cells for cells in lines if not cells[0][0].isdigit() or len(cells) > 1]


@pytest.mark.slow("all commands of the pages, each in a process of its own")
@pytest.mark.parametrize("page", PAGES)
def test_commands_and_snippets_print_what_is_shown(page, folders):
    """In the order of the page: what one writes, another reads."""
    folder = folders(page)
    for language, text in BLOCKS[page]:
        if language == "console":
            for command, shown in sessions(text):
                assert comparable(shell(command, folder)) == comparable(shown), command
        elif language == "python":
            own = os.environ | {"PYTHONPATH": PACKAGE}
            subprocess.run(
                [sys.executable, "-c", text], check=True, cwd=folder, env=own
            )


@pytest.mark.slow("a run of mypy over the package")
@pytest.mark.skipif(find_spec("mypy") is None, reason="mypy is not installed")
def test_snippets_pass_mypy_in_its_strict_mode(tmp_path):
    snippets = {
        f"{page.lower()}_{i}": text
        for page, own in BLOCKS.items()
        for i, text in enumerate(text for language, text in own if language == "python")
    }
    assert {"python_0", "many_0"} <= snippets.keys()
    for name, text in snippets.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    (tmp_path / "mypy.ini").write_text(
        "[mypy]\n[mypy-scipy.*]\nignore_missing_imports = True\nfollow_imports = skip\n"
    )
    line = "-m mypy --strict --follow-imports=silent --config-file mypy.ini ."
    command = [sys.executable, *line.split()]
    own = os.environ | {"MYPYPATH": str(ROOT)}  # before an installed package
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, env=own
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout


def joined(text):
    """A text in which lines that end in a backslash are one with the next."""
    return text.replace("\\\n", " ")


def lines_of_shell(benches):
    """The commands in blocks that show no output, each with its page; of a bench, or
    others, without comments. Those that install the program are run by CI."""
    blocks = [
        (page, text)
        for page, own in BLOCKS.items()
        for language, text in own
        if language == "sh"
    ]
    lines = [
        (page, line)
        for page, text in blocks
        for line in ([text] if SCRIPT in text else joined(text).splitlines())
    ]
    return [
        (page, line)
        for page, line in lines
        if line.startswith("lcp bench") == benches
        and not line.startswith(("python -m pip install", "# "))
    ]


@pytest.mark.slow("all commands of the pages, each in a process of its own")
@pytest.mark.parametrize(("page", "line"), lines_of_shell(benches=False))
def test_command_runs(page, line, folders):
    if "jq" in line and which("jq") is None:
        pytest.skip("jq is not installed")
    shell(f"set -o pipefail; {{ {line}\n}} > /dev/null", folders(page), code=0)


@pytest.mark.slow("all commands of the pages, each in a process of its own")
@pytest.mark.parametrize(
    "job", [text for language, text in BLOCKS["ci"] if language == "yaml"]
)
def test_commands_of_a_job_of_ci_run(job, tmp_path):
    if find_spec("yaml") is not None:
        import yaml

        assert "lcp" in str(yaml.safe_load(job))
    commands = re.findall(r"^ +(?:- )?(lcp .*)$", job, re.MULTILINE)
    assert [command.split()[1] for command in commands] == ["make", "solve", "check"]
    for command in commands:
        shell(f"{command} > out.txt", tmp_path, code=0)
    assert json.loads((tmp_path / "result.json").read_text())["solved"]
    assert "z solves the problem" in (tmp_path / "out.txt").read_text()


@pytest.mark.slow("benches with other solvers and figures")
@pytest.mark.parametrize(("page", "line"), lines_of_shell(benches=True))
def test_benchmark_runs_on_one_small_problem_in_place_of_its_suite(
    page, line, lcp, monkeypatch, folders
):
    held = {
        name: replace(suite, grids=[suites.Grid("diagonal", 3)], budget=0.0)
        for name, suite in suites.SUITES.items()
    }
    monkeypatch.setattr(suites, "SUITES", held)
    monkeypatch.chdir(folders(page))
    words = shlex.split(line)
    assert lcp(*words[1:]).code == 0


@pytest.mark.parametrize("page", PAGES)
def test_commands_and_options_named_in_the_text_exist(page):
    commands = group.lcp.commands.items()
    flags = {name: {"--help"} for name, _ in commands}
    for name, its in commands:
        flags[name] |= {
            flag
            for param in its.params
            for flag in (*param.opts, *param.secondary_opts)
        }
    flags["help"] |= {*TOPICS, *METHODS, *flags, "TOPIC", "METHOD", "WORDS"}
    text = BLOCK.sub("", PAGES[page])
    for name, rest in re.findall(r"`lcp\s+([a-z]\w*)([^`]*)`", text):
        assert name in flags, name
        topic, _, section = rest.strip().partition(" ")
        if (
            name == "help" and section and topic in PAGES
        ):  # of the sections with this word
            headings = re.findall(r"^##.*", PAGES[topic], re.MULTILINE)
            assert section in " ".join(headings).casefold(), rest
            continue
        if page == "changes":  # which also names what has gone
            continue
        assert {
            word for word in rest.split() if word.startswith("--") or name == "help"
        } <= flags[name], rest
    gone = {flag(name) for name in OPTIONS} | {"--no-presolve", "--scale", "--q"}
    gone |= {"--warm", "--stop", "--from-qp", "--from-game"}
    gone = gone if page == "changes" else set()
    assert set(re.findall(r"`(--[a-z][\w-]*)", text)) <= set.union(
        *flags.values(), gone
    )


def test_there_are_two_commands_and_ci_runs_exactly_these():
    commands = [
        line
        for line in README.splitlines()
        if line.startswith("python -m pip install ")
    ]
    assert commands == [
        "python -m pip install '.[plot]' && lcp compare",
        "python -m pip install '.[test]' && pytest",
    ]
    assert "^python -m pip install " in (ROOT / ".ci" / "run").read_text()


@pytest.mark.parametrize(
    "text",
    [text for own in BLOCKS.values() for language, text in own if language == "json"],
)
def test_json_examples_are_solved(text, lcp, tmp_path):
    file = tmp_path / "problem.json"
    file.write_text(text)
    assert lcp(f"solve {file} -q").code == 0


def test_every_status_and_its_exit_code_is_documented():
    for status in result.Status:
        rows = [
            line
            for line in PAGES["statuses"].splitlines()
            if line.startswith("|") and f"`{status.word}`" in line
        ]
        assert len(rows) == 1
        assert rows[0].split("|")[1].strip() == str(of_status(status))


def test_every_start_and_every_option_of_a_described_method_is_documented():
    described = [
        method
        for name, method in METHODS.items()
        if f"\n## {name}\n" in PAGES["methods"]
    ]
    assert len(described) >= 7
    for name in (
        *STARTS,
        *(option.name for method in described for option in method.options),
    ):
        written = re.compile(rf"`(--)?{flag(name)[2:]}\b")
        assert any(map(written.search, PAGES.values())), name


def test_every_key_of_a_result_in_json_is_documented(lcp):
    page = PAGES["json"].partition("\n## ")[0]
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", page, re.MULTILINE)
    shown = [name for row in rows for name in re.findall(r"\w+", row)]
    keys = lcp(f"solve {ROOT / 'problems' / 'bimatrix.json'} --format json").record
    assert sorted(shown) == sorted(keys)


RATE = (
    r"^\| ([a-z][\w-]+) (\d+)(?: (\w+)=(\S+))? \| (\d+) \| (0\.\d+) \| (0\.\d+) \| "
    r"(\S+) \|$"
)
RATES = re.findall(RATE, PAGES["paper"], re.MULTILINE)


SLOWLY = pytest.mark.slow("takes hundreds of iterations many times")
MEASURED = [
    pytest.param(row, id=f"{row[0]}-{row[1]}", marks=[SLOWLY] * (int(row[4]) > 200))
    for row in RATES
]


@pytest.mark.parametrize(
    "row", [row for row in MEASURED if int(row.values[0][4]) < 2000]
)
def test_rates_of_fixed_point_are_what_the_bench_measures(row):
    family, n, parameter, value, iterations, *factors = row
    known = gallery.parameters_of(family)
    parameters = {parameter: type(known[parameter])(value)} if parameter else {}
    problem = suites.prepare(suites.case(family, int(n), **parameters))
    answer = run_method("fixed-point", problem, 1e-10, 60.0, with_curve=True)
    assert answer.iterations == pytest.approx(int(iterations), abs=2)
    found = rate_of_fixed_point(problem, answer.curve or [])
    shown = [found["measured"], found["local"], found["bound"]]
    assert shown == pytest.approx([float(factor) for factor in factors], abs=2e-4)


LADDER = r"^\| ([a-z-]+) \| (\w+) = (\S+) \| (?:all|-|\d+) \|"


def test_tables_have_rates_of_several_families_and_the_ladders_of_the_suites():
    """What auto does on them, test_bench_record holds; here it is that the table is
    about the same ladders."""
    assert len({row[0] for row in RATES}) >= 8
    shown = {
        family: (axis, float(value))
        for family, axis, value in re.findall(LADDER, PAGES["stability"], re.MULTILINE)
    }
    stiff = [
        each for name in ("stiff", "extreme") for each in suites.SUITES[name].cases
    ]
    assert shown == {
        family: (axis, float([*values.values()][-1]))
        for family, axis, values in ladders(stiff)
    }


def test_page_of_formats_has_those_of_problems_and_of_results():
    shown = set(re.findall(r"`([.\w]+)`", PAGES["formats"]))
    assert {suffix for suffix in FORMATS if suffix not in shown} == set()
    rows = [
        f"| `{name}` | `{form.suffix}` |" for name, form in document.FORMATS.items()
    ]
    assert not [row for row in rows if row not in PAGES["formats"]]


def test_readme_is_short_and_a_problem_of_ones_own_comes_first():
    assert len(README.splitlines()) <= 120
    assert README.index("lcp solve mine.json") < README.index(
        "lcp compare paper-example-1"
    )
    links = re.findall(r"(?<!!)\[[^\]]*\]\((.*?)\)", README)
    assert len(links) == 12
    assert all((ROOT / link).is_file() for link in links)
    assert not [
        topic
        for topic in TOPICS
        if topic != "tasks" and f"`{topic}`" not in README + PAGES["tasks"]
    ]
