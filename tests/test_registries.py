"""An addition is one new file and one line of a table, and it passes the tests of all
of its kind."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lcpcli.cli.command import lcp
from lcpcli.cli.declarations import OF_METHODS
from lcpcli.inspection.verdict import CLASSES
from lcpcli.methods.registry import ANY, METHODS
from lcpcli.options import LIMITS

from .conftest import BATCH

ROOT = Path(__file__).parent.parent

METHOD = '''
"""Projected overrelaxation."""

import numpy as np

from lcpcli.linalg.matrices import dense
from lcpcli.methods.stages import Breakdown, Iterate, ended


def toy(problem, x0, *, omega, sweeps):
    M = dense(problem.M)
    return (
        _iterates(problem, M, 2 * x0, omega, sweeps)
        if (M.diagonal() > 0).all()
        else ended(Breakdown("no"))
    )


def _iterates(problem, M, z, omega, sweeps):
    while True:
        for i in [*range(problem.n)] * sweeps:
            z[i] = max(0.0, z[i] - omega * (M[i] @ z + problem.q[i]) / M[i, i])
        yield Iterate((z - np.maximum(M @ z + problem.q, 0)) / 2, None, "", 1)
'''
DECLARED = (
    'Method("overrelaxation", iterates=True, options=(OMEGA, Option('
    '"sweeps", int, 1, "integer >= 1", lambda v: v >= 1, "Sweeps in each '
    'iteration.")))'
)
FAMILY = '''
"""The identity."""

import numpy as np

from lcpcli.model.problem import Problem


def toy(n, _seed, *, load=1.0):
    """M = I and q = -load."""
    return Problem(
        np.eye(n),
        np.full(n, -load),
        solutions=[np.full(n, load)],
        note="M is the identity",
    )
'''
FORMAT = '''
"""A row of M in each line, with the component of q behind it."""

import numpy as np

from lcpcli.linalg.matrices import dense


def fields(content, number=float):
    lines = content.decode().splitlines()
    rows = [[number(text) for text in line.split()] for line in lines]
    parts = {"M": [row[:-1] for row in rows], "q": [row[-1] for row in rows]}
    return parts if len(rows[0]) > len(rows) else {"M": rows}


def values(field, content, number=float):
    return fields(content, number)[field]


def render(fields, exact):
    rows = np.column_stack([dense(fields["M"]), fields["q"]]).tolist()
    return {"": "".join(" ".join(map(repr, row)) + "\\n" for row in rows).encode()}
'''
REPORT = '''
"""The titles of sections."""


def render(document, width, color):
    return "".join(f"{section.title}\\n" for section in document.sections)
'''
PEER = '''
"""A solver that is our own."""

import lcpcli
from lcpcli.peers.packages import PackageSolver


def _solve(numpy, problem, program, tol, time_limit):
    result = lcpcli.run(problem, tol=tol, time_limit=time_limit)
    return result.z, None, result.solved, result.message


toy = PackageSolver("numpy", _solve, ())
'''
CLASS = '''
"""Matrices without a negative entry."""

from lcpcli.inspection.verdict import NO, YES, Verdict


def toy(context):
    return (
        Verdict(NO, "an entry is negative")
        if (context.M < 0).sum()
        else Verdict(YES, "no entry is negative")
    )
'''
PAGE = (
    "# What a toy is\n\nIt is what a test adds to a copy of this package, to see "
    "what an addition takes.\n"
)
# The file that is new, its text, the file and the table with one more line, and that
# line.
ADDITIONS = {
    "method": (
        "methods/toy.py",
        METHOD,
        "methods/registry.py",
        "METHODS",
        f'"toy": {DECLARED}',
    ),
    "family": (
        "gallery/toy.py",
        FAMILY,
        "gallery/families.py",
        "TABLE",
        "toy:\ntoy | the identity | P | this test",
    ),
    "file": (
        "files/toy.py",
        FORMAT,
        "files/formats.py",
        "FORMATS",
        '".toy": Kind("toy", M_AND_Q, in_decimals=True)',
    ),
    "report": (
        "report/toy.py",
        REPORT,
        "report/document.py",
        "FORMATS",
        '"toy": Form("titles", ".toys", "toy")',
    ),
    "peer": (
        "peers/toy.py",
        PEER,
        "peers/registry.py",
        "REGISTRY",
        '"toy": ("toy", "our own")',
    ),
    "class": (
        "inspection/toy.py",
        CLASS,
        "inspection/verdict.py",
        "CLASSES",
        '"toy": "toy"',
    ),
    "page": (
        "topics/toys.md",
        PAGE,
        "topics/tasks.md",
        "",
        "| what a toy is | `lcp help` | `toys` |",
    ),
}
GENERAL = ("help", "completion")  # tests of all of a kind
OF_ALL = (
    "inspect.py::test_modulus_iteration_is_not_guaranteed_for_the_matrix_of_kostreva",
    "pages.py::test_every_start_and_every_option_of_a_described_method_is_documented",
    "pages.py::test_readme_is_short_and_a_problem_of_ones_own_comes_first",
    "peers.py::test_quadratic_programming_solvers_get_the_bounds[boxes-toy]",
    "gallery.py::test_families_say_what_they_are_and_auto_comes_to_what_is_known[toy]",
    "make.py::test_numbers_are_the_same_in_all_formats",
    "make.py::test_complete_formats_keep_everything",
    "gallery.py::test_same_arguments_give_the_same_numbers_and_other_seeds_others[toy]",
    "driver.py::test_options_in_force_are_reported_defaults_too[toy]",
    "figures.py::test_looks_are_of_methods_and_peers_and_the_others_take_spare_ones",
    "clock.py::test_nothing_that_a_first_run_loads_is_part_of_it[toy]",
)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package and its tests with all additions."""
    root = tmp_path_factory.mktemp("copy")
    for name in ("lcpcli", "tests", "problems"):
        shutil.copytree(
            ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__")
        )
    for name in ("README.md", "pyproject.toml"):
        shutil.copy(ROOT / name, root)
    for new, text, registry, table, line in ADDITIONS.values():
        assert not (root / "lcpcli" / new).exists()
        (root / "lcpcli" / new).write_text(text)
        register((root / "lcpcli" / registry).resolve(), table, line)
    return root


def register(registry, table, line):
    """Add one line to the dictionary, or the table, of that name in a file, or to the
    end of a page."""
    text = registry.read_text()
    if table and f'\n{table} = """' in text:
        place = text.index('\n"""\n', text.index(f"\n{table} = ")) + 1
    elif table:
        place = text.index("\n}\n", text.index(f"\n{table} = {{")) + 1
        line = f"    {line},"
    else:
        place = len(text)
    registry.write_text(f"{text[:place]}{line}\n{text[place:]}")


def run(path, folder, *command, given=""):
    """The output of Python with that path in a folder, which is to succeed."""
    # No kernels are compiled for a copy.
    own = os.environ | {"PYTHONPATH": str(path), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, *command],
        input=given,
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=own,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout[-5000:] + done.stderr
    return done.stdout


def test_declarations_of_methods_name_known_classes():
    assert {name for method in METHODS.values() for name in method.guaranteed} <= {
        ANY,
        *CLASSES,
    }


@pytest.mark.slow("it runs two files of tests, and some of others, on a copy")
def test_what_is_added_passes_the_tests_of_all_of_its_kind(copy):
    files = {path.name: str(path) for path in (copy / "tests").rglob("test_*.py")}
    tests = [files[f"test_{name}.py"] for name in GENERAL]
    tests += [
        f"{files[f'test_{name}']}::{test}"
        for name, _, test in (one.partition("::") for one in OF_ALL)
    ]
    # Which is disabled for a copy.
    compiling = "--deselect=tests/cli/test_help.py::test_examples_run[kernels]"
    line = "-m pytest -n 0 -p no:cacheprovider -m"
    run(copy, copy, *line.split(), "", compiling, *tests)


COMMANDS = """\
solve toy.json --method toy:omega=1.5,sweeps=2 --format json
help solve --all
make toy -n 3 --set load=2
make diagonal -n 2 --set decades=0 -o problem.toy -q
solve problem.toy --exact --format json
solve toy.json -o result.toys -q
bench toy.json --method newton --peer toy --budget 0 --format json
inspect toy.json --format json
help toys
"""


@pytest.mark.slow("the quick suite has another package with a method and a format")
def test_what_is_added_does_its_work(copy, tmp_path):
    (tmp_path / "toy.json").write_text(
        '{"name": "toy", "M": [[2, 0], [0, 4]], "q": [-2, 4]}'
    )
    solved, shown, made, _, exact, _, bench, inspected, page, _ = run(
        copy, tmp_path, "-c", BATCH, given=COMMANDS
    ).split("\0")
    record = json.loads(solved)
    assert record["status"] == "solved"
    assert record["method"] == "toy"
    assert record["z"] == pytest.approx([1.0, 0.0])
    assert record["options"] == {"omega": 1.5, "sweeps": 2}
    assert "toy" in shown
    assert json.loads(made)["name"] == "toy-3"
    assert json.loads(made)["q"] == [-2, -2, -2]
    assert (tmp_path / "problem.toy").read_text() == "1.0 0.0 -1.0\n0.0 1.0 1.0\n"
    assert json.loads(exact)["exact"]["z"] == ["1", "0"]
    assert (tmp_path / "result.toys").read_text() == "toy: n = 2\n"
    (row,) = (
        row for row in json.loads(bench)["measurements"] if row["solver"] == "toy"
    )
    assert (row["success"], row["kind"]) == (True, "peer")
    assert json.loads(inspected)["classes"]["toy"]["verdict"] == "yes"
    assert page == PAGE


def test_another_package_adds_a_method_and_a_format(tmp_path):
    """By the entry points of a distribution on the path, as an installed one has
    them."""
    declared = DECLARED.replace("options=", 'location=("toys.toy", "toy"), options=')
    package, installed = tmp_path / "toys", tmp_path / "toys-1.0.dist-info"
    package.mkdir()
    installed.mkdir()
    (package / "toy.py").write_text(METHOD)
    (package / "format.py").write_text(FORMAT)
    (package / "__init__.py").write_text(
        "from lcpcli.files.formats import M_AND_Q, Kind\n"
        "from lcpcli.methods.registry import OMEGA, Method\nfrom lcpcli.options "
        "import Option\n"
        f"METHOD = {declared}\n"
        'FORMAT = Kind("toys.format", M_AND_Q, in_decimals=True)\n'
    )
    (installed / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n"
    )
    (installed / "entry_points.txt").write_text(
        "[lcpcli.methods]\ntoy = toys:METHOD\nbroken = "
        "toys.none:METHOD\n\n[lcpcli.formats]\n.toy = toys:FORMAT\n"
    )
    path = Path(f"{tmp_path}{os.pathsep}{ROOT}")
    given = """\
make diagonal -n 2 --set decades=0 -o problem.toy -q
solve problem.toy --method toy:sweeps=2 -f json
solve problem.toy --method broken
"""
    code = BATCH.replace("assert not ending.code", "print(ending.code or '')")
    code += (
        "import lcpcli; print(lcpcli.run(lcpcli.read('problem.toy'), 'toy', "
        "omega=1.5).solved)"
    )
    with_errors = f"import os; os.dup2(1, 2)\n{code}"
    _, solved, broken, in_python = run(
        path, tmp_path, "-c", with_errors, given=given
    ).split("\0")
    record = json.loads(solved)
    assert record["method"] == "toy"
    assert record["z"] == [1.0, 0.0]
    assert record["options"] == {"omega": 1.0, "sweeps": 2}
    assert in_python == "True\n"
    line, code = broken.splitlines()
    assert line.startswith(
        "lcp: broken: is toys.none:METHOD of another package, which cannot be loaded: "
    )
    assert code == "2"


SHIPPING = {"costs": [[1, 3], [2, 1]], "supply": [4, 5], "demand": [3, 4]}


@pytest.mark.slow  # in eight processes
def test_a_formulation_is_one_folder_and_one_row(tmp_path):
    """As the page on development has it."""
    page = (ROOT / "lcpcli/development.md").read_text()
    section = page.partition("## A formulation\n")[2]
    text = section.partition("```python\n")[2].partition("```")[0]
    (row,) = (line for line in section.splitlines() if '": Row(' in line)
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "lcpcli", tmp_path / "lcpcli", ignore=ignored)
    folder = tmp_path / "lcpcli/formulations/shipping"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "plans.py").write_text(text)
    table = tmp_path / "lcpcli/model/formulations.py"
    register(table, "TABLE", row.strip().removesuffix(","))
    (tmp_path / "s.json").write_text(json.dumps(SHIPPING))

    def of(line):
        return run(tmp_path, tmp_path, "-m", "lcpcli", *line.split())

    assert "the plan costs 7" in of("solve s.json")
    answer = json.loads(of("solve s.json --format json"))["answer"]
    assert answer["shipments"] == [[3, 0], [0, 4]]
    assert "1,3.0,0.0,1 to 1" in of("solve s.json --format csv")
    assert "z solves the problem" in of("check s.json 3,0,0,4,0,0,1,1")
    of("convert s.json -o written.json -q")
    assert json.loads((tmp_path / "written.json").read_text()) == SHIPPING
    of("convert s.json -o arrays.npz -q")
    assert "the plan costs 7" in of("solve arrays.npz")
    assert "Usage: lcp solve" in of("solve --help")


def test_a_request_has_the_values_of_all_options_of_its_command():
    requests = {name: lcp.commands[name].request for name in lcp.commands}
    requests = {name: made for name, made in requests.items() if made is not None}
    assert {"solve", "compare", "path", "check", "why", "bench"} < {*requests}
    for name, made in requests.items():
        names = {str(param.name) for param in lcp.commands[name].params}
        request = made(**dict.fromkeys(names))
        others = {*OF_METHODS, *(limit.name for limit in LIMITS)}
        fields = vars(request).keys()
        assert names - fields <= (others if "method_options" in fields else set()), name
        with pytest.raises(AttributeError):
            request.another  # noqa: B018
