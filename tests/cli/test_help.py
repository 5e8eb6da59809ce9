"""Help of commands and pages on topics: a sentence, examples that run, every option
once, in 80 columns."""

import inspect
import io
import itertools
import re
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import click
import pytest

from lcpcli.auto import attempts
from lcpcli.bench import suites
from lcpcli.cli import command as group
from lcpcli.cli import help as command
from lcpcli.cli.declarations import STARTS
from lcpcli.cli.help import FOLDER, PAGES, TOPICS
from lcpcli.methods.registry import (
    METHODS,
    NONLINEAR,
    OPTIONS,
    known_options,
    load,
)
from lcpcli.options import ACCEPT, BUDGET, EVERY, LIMITS
from lcpcli.peers.registry import PEERS
from lcpcli.report import terminal
from lcpcli.report.wording import flag
from lcpcli.solving.result import Status
from lcpcli.version import VERSION

from ..conftest import Outcome
from ..seeds import few_of
from .conftest import assert_refused

SHARED = {option.name: option for option in (*LIMITS, ACCEPT, BUDGET, EVERY)}
COMMANDS = {"": group.lcp, **group.lcp.commands}
HEADINGS = {
    name: headings.split("; ")
    for name, headings in {
        "": "Commands; Help; Exit codes",
        "why": "Problem; Explanation; Stopping; Output; Help; Exit codes",
        "solve": (
            "Problem; Method; Answer; Start; Stopping; Output; Help; Methods; Exit "
            "codes"
        ),
        "compare": (
            "Problem; Method; Start; Stopping; Answer; Output; Help; Methods; Exit "
            "codes"
        ),
        "path": "Problem; Path; Stopping; Output; Exit codes",
        "bench": "Problems; Solvers; Stopping; Measuring; Output",
        "check": "Problem and solution; Verification; Output",
        "inspect": "Problem; Stopping; Output",
        "kernels": "Help; Exit codes",
        "make": "Family; Problem; Output",
        "convert": "Problem; Output",
        "completion": "Shell; Shells, and where the script belongs",
        "help": "Topic; Topics",
    }.items()
}
WITHOUT_DEFAULT = {  # options that do nothing unless they are given
    **dict.fromkeys(COMMANDS, ("--plot",)),
    "bench": ("--plot", "--resume", "--output"),
    "make": ("--set",),
}


@pytest.fixture(params=COMMANDS, ids=lambda name: name or "lcp")
def name(request):
    return str(request.param)


def help_of(lcp, name):
    """The whole help, with all options."""
    outcome = lcp(f"help {name} --all") if name else lcp("--help")
    assert outcome.code == 0
    assert outcome.err == ""
    return outcome.out


def sections_of(text):
    parts = re.split(r"^(\S.*):\n", text, flags=re.MULTILINE)
    assert len(set(parts[1::2])) == len(parts[1::2])
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def terms_of(section):
    return re.findall(r"^  (\S.*?)(?:  +.*)?$", section, flags=re.MULTILINE)


def test_one_sentence_comes_first_and_examples_next_and_every_argument_is_explained(
    name, lcp
):
    text = help_of(lcp, name)
    usage, opening, examples, *_ = text.split("\n\n")
    assert usage.startswith("Usage: ")
    assert re.fullmatch(r"[A-Z][^.]*\.", opening.strip())
    assert examples.splitlines() == [
        "Examples:",
        *(f"  {line}" for line in COMMANDS[name].examples),
    ]
    assert any(
        line.startswith(f"lcp {name}".strip()) for line in COMMANDS[name].examples
    )
    terms = " ".join(
        term for section in sections_of(text).values() for term in terms_of(section)
    )
    words = set(re.findall(r"[A-Z_]{4,}", usage.replace("Usage", ""))) - {
        "OPTIONS",
        "COMMAND",
        "ARGS",
    }
    assert {word for word in words if word not in terms} == set()


def test_every_option_stands_once_under_a_heading(name, lcp):
    sections = sections_of(help_of(lcp, name))
    assert set(HEADINGS[name]) <= set(sections)
    terms = [
        term
        for heading, text in sections.items()
        if heading != "Examples"
        for term in terms_of(text)
    ]
    command = COMMANDS[name]
    for param in command.get_params(click.Context(command)):
        if isinstance(param, click.Option):
            named = [
                term for term in terms if param.opts[-1] in re.split(r"[ ,]+", term)
            ]
            assert len(named) == 1, param.opts


def test_defaults_are_shown(name):
    for param in COMMANDS[name].params:
        if not isinstance(param, click.Option) or (
            param.is_flag and not param.secondary_opts
        ):
            continue
        record = param.get_help_record(click.Context(COMMANDS[name]))
        assert record
        known = SHARED.get(str(param.name)) or OPTIONS.get(str(param.name))
        if isinstance(param.default, (str, float)):
            assert (
                f"default: {param.default}]" in record[1]
                or f"default {param.default:g}]" in record[1]
            )
        elif known and known.default is not None:
            assert re.search(r"; default (no limit|[\d.e-]+|[a-z]+)\]$", record[1])
        elif param.opts[-1] not in WITHOUT_DEFAULT[name]:
            assert "default" in record[1], param.opts


def test_lines_fit(name, lcp, monkeypatch):
    for columns, most in ((80, 80), (200, 100)):
        monkeypatch.setenv("COLUMNS", str(columns))
        assert (
            most // 2
            < max(len(line) for line in help_of(lcp, name).splitlines())
            <= most
        )


def run(line, lcp, monkeypatch):
    """Run a command line, a pipe too; every command of it must end with 0."""
    outcome = Outcome(0, "", "")
    for part in line.split(" | "):
        program, *arguments = shlex.split(part)
        assert program == "lcp"
        monkeypatch.setattr(
            sys, "stdin", io.TextIOWrapper(io.BytesIO(outcome.out.encode()))
        )
        outcome = lcp(*arguments)
        # Which finds today's runs slower by chance.
        assert outcome.code == 0, line
        told = (
            "solved|wrote|measurements succeeded|the path reaches|no class of "
            "M|exactly one"
        )
        assert re.fullmatch(rf"(lcp: .*({told}).*\n)*", outcome.err), line
    return outcome


@pytest.mark.slow("all examples of all commands")
def test_examples_run(name, lcp, in_folder, monkeypatch):
    """In their order, in an empty folder; a suite is one small problem, to be quick."""
    for suite, its in suites.SUITES.items():
        monkeypatch.setitem(
            suites.SUITES,
            suite,
            replace(its, grids=[suites.Grid("tridiagonal", 10)], budget=0.0),
        )
    for line in COMMANDS[name].examples:
        before = set(in_folder.iterdir())
        shown = run(line, lcp, monkeypatch).out
        assert shown or set(in_folder.iterdir()) > before or "--quiet" in line


def test_lcp_alone_prints_help(lcp):
    assert lcp().out == help_of(lcp, "")
    assert terms_of(sections_of(lcp().out)["Commands"]) == list(group.lcp.commands)


def test_names_that_can_be_given_are_listed(lcp):
    for name, heading, known in (
        *((name, "Methods", METHODS) for name in ("solve", "compare", "bench")),
        ("solve", "Exit codes", ["0", "1", "2", "3", "130", "143"]),
        ("bench", "Suites", (*suites.SUITES, suites.ALL)),
        ("bench", "Other solvers", PEERS),
    ):
        assert terms_of(sections_of(help_of(lcp, name))[heading]) == list(known)
    assert "lcp make --list" in sections_of(help_of(lcp, "make"))["Family"]


def test_a_method_declares_the_options_that_it_takes():
    for name, method in METHODS.items():
        parameters = inspect.signature(load(name)).parameters.values()
        taken = {p.name for p in parameters if p.kind is p.KEYWORD_ONLY}
        taken -= {*STARTS, "is_basic_start", "is_warm_start", "recorded_stages"}
        assert taken == {*(option.name for option in method.options), *method.switches}


def source(topic):
    return PAGES[topic]


def words(text):
    return re.findall(r"\w+", text)


def test_topics_and_commands_are_listed_with_their_meanings(lcp):
    outcome = lcp("help")
    assert outcome.code == 0
    assert outcome.err == ""
    for topic, meaning in TOPICS.items():
        assert f"\n  {topic} " in outcome.out
        assert source(topic).startswith(f"# {meaning}\n\n")
    assert all(
        f"\n  {name} " in outcome.out for name in group.lcp.commands if name != "help"
    )
    assert not set(TOPICS) & set(group.lcp.commands)
    assert all(topic in lcp("--help").out for topic in TOPICS)


@pytest.mark.parametrize("name", [name for name in COMMANDS if name])
def test_help_of_every_command_is_one_screen_and_leads_to_the_rest(name, lcp):
    text = lcp(f"{name} --help").out
    assert len(text.splitlines()) <= 60
    assert text == help_of(lcp, name) or f"lcp help {name} --all" in text
    assert lcp(f"{name} --help --all").out == help_of(lcp, name)


@pytest.mark.parametrize("method", [*METHODS, *NONLINEAR])
def test_help_on_a_method_ends_with_all_of_its_options(method, lcp):
    page = re.split(r"^(?=Options |Columns )", lcp(f"help {method}").out, flags=re.M)
    lists = [part for part in page if part.startswith("Options ")]
    names = re.findall(r"^  (?:--)?([a-z]\w*[\w-]*)", "".join(lists), re.MULTILINE)
    assert {*names} == {flag(name)[2:] for name in known_options(method)}


def test_help_on_a_command_is_its_own_help_and_on_a_topic_in_a_pipe_its_markdown(lcp):
    for name in group.lcp.commands:
        assert lcp(f"help {name}").out == lcp(f"{name} --help").out
    meant = {"exit-codes": "statuses", "bounds": "mixed", "citing": "cite"}
    for word, topic in (meant | {topic: topic for topic in TOPICS}).items():
        assert lcp(f"help {word}").out == source(topic)


def test_help_on_a_word_with_sections_of_its_own_is_these_sections(lcp):
    problems = "## Problems: .json, .jsonl, .mtx, .npz, .npy, .mat, .gz\n"
    headings = {"mps": "### Files: MPS, LP and arrays", "shi": "## shi"}
    for word, heading in (headings | {"npz": problems}).items():
        out = lcp(f"help {word}").out
        assert out.startswith(heading)
        assert out.count("\n#") == 0
    assert re.findall("^#.*", lcp("help csv").out, re.MULTILINE) == [
        "### Problems in CSV",
        "### Results in CSV",
    ]


@pytest.mark.parametrize("page", command.OF_THE_SOURCE)
def test_a_page_that_is_not_installed_is_named_in_a_line(page, lcp):
    path = command.OF_THE_SOURCE[page]
    root = Path(__file__).parents[2]
    assert (root / path).is_file()
    assert f'exclude = ["{path}"]' in (root / "pyproject.toml").read_text()
    outcome = lcp(f"help {page}")
    assert outcome.code == 0
    assert outcome.out == f"{page}: {path} of the source is this page\n"
    assert outcome.err == ""


def test_a_word_that_is_no_topic_is_looked_for_on_all_pages(lcp):
    outcome = lcp("help 'duality gap'")
    assert outcome.code == 0
    assert outcome.out.startswith("Pages with 'duality gap', and their sections:")
    shown = {
        line.split()[0]
        for line in outcome.out.splitlines()[1:]
        if re.match(r"  \w", line)
    }
    assert shown == {
        topic for topic in TOPICS if re.search(r"\bduality gap\b", source(topic))
    }


def test_words_are_found_on_pages_in_the_singular_and_in_the_plural(lcp):
    one, many = (lcp(f"help {words}").out for words in ("duality gap", "duality gaps"))
    assert one.partition("\n")[2] == many.partition("\n")[2] != ""


WORDS = {
    "american option": "sequences",
    "dantzig": "methods",
    "gauss-seidel": "methods",
    "IIS": "conflicts",
    "mpec": "solutions",
    "shadow prices": "programs",
    "Zero-Sum Game": "games",
    "gpus": "many",
}


@pytest.mark.parametrize(("words", "page"), WORDS.items())
def test_words_of_the_field_lead_to_a_page_or_to_what_comes_nearest(words, page, lcp):
    """Whether the shell has passed them as one word or as several."""
    for given in ([words], words.split()):
        outcome = lcp("help", *given)
        assert outcome.code == 0
        assert outcome.err == ""
        assert f"lcp help {page}" in outcome.out


# What `route` of an answer may have besides the names of attempts.
FURTHER_ROUTES = {"auto", "gradient", "krylov", "multilevel", "least-squares"}
FURTHER_ROUTES |= {"active set", "josephy-newton"}


def test_statuses_and_routes_that_answers_show_have_a_line_of_help(lcp):
    phases = attempts.FIRST, attempts.BRIEF, attempts.LATER, attempts.STEP
    single = attempts.PRESOLVE, attempts.EXACT, attempts.MILP
    routes = {row.method for row in (*itertools.chain(*phases), *single)}
    for name in routes | FURTHER_ROUTES:
        outcome = lcp(f"help {name}")
        assert outcome.code == 0, name
        has_section = outcome.out.startswith("#")
        assert has_section or outcome.out.startswith(f"{name}: "), name
        assert has_section or "\nlcp help methods " in outcome.out, name
    for status in Status:
        outcome = lcp(f"help {status.word}")
        assert outcome.out.startswith(f"{status.word}: "), status
        assert "\nlcp help statuses " in outcome.out


@pytest.mark.parametrize(
    "words", ["xyzzy", "shadow xyzzy", "csv xyzzy", "quadratic sorcery", "layr"]
)
def test_unknown_words_are_an_error(words, lcp):
    outcome = lcp(f"help {words}")
    assert_refused(outcome, f"lcp: TOPIC: {words!r} is unknown; ")
    assert ("did you mean layer?" in outcome.err) == (words == "layr")


def test_glossary_has_each_word_once_and_names_pages_and_sections_that_are_there(lcp):
    entries = command.glossary()
    known = [word for entry in entries for word in entry.words.split(", ")]
    assert len(entries) == source("words").count("` |\n")
    assert len(known) == len(set(known)) > 100
    for word in {page for entry in entries for page in entry.pages}:
        name, _, section = word.partition(" ")
        out = lcp(f"help {word}").out
        assert (out == source(name)) is (not section), word


# With wide tables, code and long words.
WIDE = ["formats", "json", "python", "stability", "tasks"]


@pytest.mark.parametrize(
    "topic", few_of([*WIDE, *sorted({*TOPICS} - {*WIDE})], len(WIDE))
)
def test_page_fits_a_terminal_with_every_word_and_every_line_of_code_whole(topic):
    shown = terminal.page(source(topic), 80, color=False)
    assert max(map(len, shown.splitlines())) <= 80
    assert sorted(words(shown)) == sorted(
        words(re.sub(r"^```\w*$", "", source(topic), flags=re.MULTILINE))
    )
    for block in re.findall(
        r"^```\w+\n(.*?)^```$", source(topic), flags=re.MULTILINE | re.DOTALL
    ):
        assert all(
            f" {line}".rstrip() in shown.splitlines() for line in block.splitlines()
        )


@pytest.mark.parametrize("color", [False, True])
def test_terminal_shows_the_page_formatted(color, lcp, monkeypatch):
    monkeypatch.setattr(command, "terminal", lambda: (200, color))
    shown = lcp("help statuses").out
    assert "```" not in shown
    assert "**" not in shown
    assert ("\x1b[" in shown) == color
    plain = re.sub(r"\x1b\[[\d;]*m", "", shown)
    assert 80 < max(len(line.rstrip()) for line in plain.splitlines()) <= 100


def test_the_version_is_that_of_the_page_on_citation(lcp):
    assert lcp("--version").out == f"lcp, version {VERSION}\n"
    assert f"note = {{Version {VERSION}}}" in (FOLDER / "cite.md").read_text(
        encoding="utf-8"
    )
