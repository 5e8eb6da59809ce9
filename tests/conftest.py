"""Shared by all tests: the paper's examples, and the command line run in this
process."""

import io
import json
import math
import os
import re
import shlex
import signal
import sys
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import pytest
from hypothesis import settings

from lcpcli import read
from lcpcli.cli import main as cli
from lcpcli.cli import output
from lcpcli.files import contents
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input
from lcpcli.files.reading import files_of
from lcpcli.linalg.matrices import is_sparse
from lcpcli.options import KERNELS, wants_kernels
from lcpcli.solving import driver

from .documents import assert_as_before, printf, shown, typed_in

# the same examples every time, so that a change is what makes a test fail;
# HYPOTHESIS_PROFILE=searching tries new ones
settings.register_profile("steady", derandomize=True, deadline=None)
settings.register_profile("searching", deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "steady"))

# the width of pipes is not that of whoever runs the tests; readline sets it where only
# processes started here see it
os.environ.pop("COLUMNS", None)
os.unsetenv("COLUMNS")

# a shell that starts the tests in the background has them, and all that they start,
# ignore Ctrl-C
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_xdist_setupnodes():
    """One thread of the BLAS in each process of the tests, unless the environment says
    otherwise: they share the processors, and threads that wait for each other take two
    thirds as much time again."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


MISSING_PACKAGE = re.compile(
    r"No module named '(\w+)|could not import '(?!lcpcli)(\w+)"
    r"|Skipped: (\w+) is not installed"
)
# A command that writes records, by --format or by the name of the output.
ASKS_FOR_JSON = re.compile(
    r"(-f|--format) json\b(?!.* -q)|^(?!make|convert).* -o [^ ]+\.jsonl?$(?!.* -q)"
)
A_TEST = re.compile(r"^def test_", re.MULTILINE)


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter):
    """Count what is skipped for want of a package under its name in the last line; all
    tests of a file that is skipped as a whole, parametrized ones once."""
    counted = {}
    for report in terminalreporter.stats.pop("skipped", []):
        path, _, reason = report.longrepr
        found = MISSING_PACKAGE.search(reason)
        kind = f"without {next(filter(None, found.groups()))}" if found else "skipped"
        number = 1
        if report.nodeid.endswith(".py"):
            number = len(A_TEST.findall(Path(path).read_text(encoding="utf-8")))
        counted.setdefault(kind, []).extend([report] * number)
    terminalreporter.stats |= counted


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def record(self):
        """The only object in JSON that was printed."""
        return json.loads(self.out)

    @property
    def records(self):
        """The objects in the lines of JSON that were printed."""
        return [json.loads(line) for line in self.out.splitlines()]


def save_json(path, data):
    """Write an object to a file in JSON."""
    path.write_text(json.dumps(data))


def read_exact(*paths):
    """The problem in one file or two with its numbers as they are written, as the
    commands take it."""
    work = Input(tuple(files_of(paths)))
    return work.exactly(work.read(as_written=True))


def problem_of(content, path):
    """The problem in the content of a file, which may be a model."""
    file = InputFile(path, content)
    return file.nonlinear or file.problem()


@pytest.fixture
def lcp(capfd, monkeypatch):
    """Run `lcp LINE` in this process, as the installed command does; words that are
    given beside the line are not split."""

    def run(line="", *more):
        monkeypatch.setattr("sys.argv", ["lcp", *shlex.split(line), *more])
        # A busy machine adds no line to tables.
        monkeypatch.setattr("lcpcli.report.outcome.WIDE_SPREAD", math.inf)
        # A call that was abandoned must not end the tests.
        monkeypatch.setattr("lcpcli.cli.main.leave", sys.exit)
        with pytest.MonkeyPatch.context() as passing:
            # The command sets the number of threads there.
            passing.setattr("os.environ", os.environ.copy())
            with pytest.raises(SystemExit) as ending:
                cli.main()
        out, err = capfd.readouterr()
        return Outcome(int(ending.value.code or 0), out, err)

    return run


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """An empty folder, entered."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def still(monkeypatch):
    """A clock that stands still."""
    monkeypatch.setattr("time.perf_counter", lambda: 0.0)
    for most in ("MAX_REPETITIONS", "FEW_REPETITIONS"):
        monkeypatch.setattr(f"lcpcli.solving.driver.{most}", 0)


@pytest.fixture
def document(
    lcp,
    in_folder,
    monkeypatch,
    still,  # noqa: ARG001
):
    """Type what is typed in a document, in an empty folder, and compare what is printed
    with the document."""

    def printed(typed):
        (program, *words), *parts = typed.parts
        out, err, code = b"", "", 0
        if program == "mkdir":
            Path(words[0]).mkdir()
        elif program == "cat":
            out = Path(words[0]).read_bytes()
        elif program == "printf":
            out = printf(words[1])
        if program == "lcp" or (parts and parts[0][0] == "lcp"):
            stdin = io.TextIOWrapper(io.BytesIO(out))
            monkeypatch.setattr(sys, "stdin", stdin)
            if program != "lcp":
                (_, *words), *parts = parts
            outcome = lcp(*(word.replace("FOLDER", str(in_folder)) for word in words))
            out, err, code = outcome.out.encode(), outcome.err, outcome.code
        if typed.signs[-1:] == [">"]:
            ((name,),) = parts
            Path(name).write_bytes(out)
            return ""
        text = out.decode()
        if typed.joined:
            text, err = text + err, ""
        for part in parts:
            text = shown(text, *part)
        return text + err + (f"exit code {code}\n" if code else "")

    def compare(name):
        text = "".join(f"{typed.line}\n{printed(typed)}" for typed in typed_in(name))
        assert_as_before(name, text.replace(str(in_folder), "FOLDER"))

    return compare


LONGEST_LINE = 1000
# Of the libraries that read a file, which users do not see; and functions that a hint
# may name.
FOREIGN_WORDS = [
    "numpy",
    "scipy",
    "Traceback",
    "dtype",
    "ufunc",
    "broadcast",
    "Expecting",
    "invalid literal",
    "could not convert",
]
OURS = re.compile(r"numpy\.savez|numpy\.save|scipy\.sparse\.save_npz")


def entries_of(folder):
    return {
        path: path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


FOLDERS = count()


@pytest.fixture
def refused(lcp, tmp_path_factory, monkeypatch):
    """Run a command line in a folder of files and return the line with which it is
    refused: all that is printed, readable and in words of this program, besides one
    record if the command line asks for JSON. Nothing is written, and nothing solved in
    vain."""

    def run(command, files, records=lambda _: None):
        # Without what tmp_path does for each of a thousand tests.
        (folder := tmp_path_factory.getbasetemp() / f"refused-{next(FOLDERS)}").mkdir()
        for name, content in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            if content is None:
                (folder / name).mkdir()
            elif isinstance(content, Path):
                (folder / name).symlink_to(content)
            elif name != "-":
                (folder / name).write_bytes(as_bytes(content))
        monkeypatch.chdir(folder)
        stdin = io.BytesIO(as_bytes(files.get("-", "")))
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(stdin))
        solved = []
        run = driver.run
        monkeypatch.setattr(
            driver,
            "run",
            lambda *given, **named: solved.append(run(*given, **named)) or solved[-1],
        )
        before = entries_of(folder)
        outcome = lcp(command)
        line = outcome.err.removesuffix("\n")
        assert outcome.code == 2
        assert outcome.err == f"{line}\n"
        made = [json.loads(text) for text in outcome.out.splitlines()]
        said = [line.removeprefix("lcp: ")] if ASKS_FOR_JSON.search(command) else []
        assert [each["message"] for each in made] == said
        records(made)
        assert line.isprintable()
        assert len(line) <= LONGEST_LINE
        own_words = OURS.sub("", line)
        assert [word for word in FOREIGN_WORDS if word in own_words] == [], line
        assert entries_of(folder) == before
        assert solved == []
        return line.removeprefix("lcp: ").replace(str(folder), "FOLDER")

    return run


def as_bytes(content):
    return content if isinstance(content, bytes) else str(content).encode()


@pytest.fixture
def kernels_by_default(monkeypatch):
    """The process does not ask for the compiled kernels, whatever a test does; a
    function that sets what it asks."""

    def ask(value):
        monkeypatch.setenv(KERNELS, value)
        wants_kernels.cache_clear()

    ask("")
    yield ask
    monkeypatch.undo()
    wants_kernels.cache_clear()


@pytest.fixture
def terminal(monkeypatch):
    """Make standard output a terminal of that width, with or without colour."""

    def become(width, color):
        monkeypatch.setattr(output, "terminal", lambda: (width, color))

    return become


@pytest.fixture(params=[1, 2], ids=["example-1", "example-2"])
def paper_example(request):
    return read(contents.shipped_path(f"paper-example-{request.param}.json"))


# Whose solutions with few digits are none in doubles.
FACE = '{"M": [[3, 3, 0], [1, -2, 3], [1, 0, 0]], "q": [-10, -3.3333333333333335, 0]}'
M = [[2.0, -1.0], [-0.5, 2.0]]
Q = [-1.0, 0.25]
JSON = '{"M": [[2, -1], [-0.5, 2]], "q": [-1, 0.25]}'


def numbers(problem):
    return (
        problem.M.toarray() if is_sparse(problem.M) else problem.M
    ).tolist(), problem.q.tolist()


BATCH = """
import sys
from lcpcli.cli import main as cli
cli.leave = sys.exit  # it would end the process
for line in sys.stdin:
    sys.argv = ["lcp", *line.split()]
    try:
        cli.main()
    except SystemExit as ending:
        assert not ending.code
    print(end="\\0", flush=True)
"""
