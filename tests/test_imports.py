"""Imports follow the work: nothing heavy is loaded before somebody needs it."""

import subprocess
import sys
from functools import cache

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.files import contents, writing

from .conftest import BATCH

EXAMPLE = contents.shipped_path("paper-example-1.json")


def loaded_by(code, given=""):
    """The names in the last line that a process prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=given,
        capture_output=True,
        text=True,
        check=True,
    )
    found = set(done.stdout.splitlines()[-1].split())
    assert "sys" in found
    return found


def modules_after(*commands):
    """The modules that are loaded when these commands of lcp are done, one after the
    other."""
    return loaded_by(f"{BATCH}print('', *sys.modules)", "\n".join(commands))


@cache
def modules_of_the_base():
    """The modules that numpy and click load by themselves, which depends on their
    versions."""
    return loaded_by("import numpy, click, json, sys; print(*sys.modules)")


HELP = (
    ", --help, --version, solve --help, compare --help, make --help, inspect "
    "--help, bench --help, check --help, "
    "path --help, completion --help, completion bash, help, help methods, help solve"
)


def test_package_names_of_peers_help_and_version_load_neither_numpy_nor_rich():
    """Of the package alone, not even the command."""
    code = (
        "import sys, lcpcli; assert 'click' not in sys.modules\n"
        "from lcpcli.peers.registry import select; select(['path'])\n"
    )
    given = HELP.replace(", ", "\n")
    loaded = loaded_by(f"{code}{BATCH}print('', *sys.modules)", given)
    assert not loaded & {"numpy", "scipy", "rich"}


def test_table_loads_rich_but_not_scipy_nor_do_a_list_of_families_and_the_methods(
    tmp_path,
):
    file = tmp_path / "dense.json"
    writing.write(Problem(4 * np.eye(200), -np.ones(200)), file)
    quiet = (f"solve {file} --method {name} -q" for name in ("shi", "fixed-point"))
    loaded = modules_after(f"solve {EXAMPLE}", "make --list", *quiet)
    assert "rich" in loaded
    assert "scipy" not in loaded


# Of ours, for a small solve in JSON; exact arithmetic finds the other solutions.
MAX_MODULES, MAX_OF_SEVERAL = 65, 75
UNUSED = {  # by a small solve whose solution is the only one by a theorem
    "scipy", "rich", "pathlib", "shutil", "hashlib", "zipfile", "gzip", "fractions",
    "decimal", "statistics", "numpy.ma", "lcpcli.enumeration.search",
    "lcpcli.rational.exact_problem", "lcpcli.solving.trace", "lcpcli.model.origins",
    "lcpcli.additions",
}  # fmt: skip
OTHER_COMMANDS = {
    f"lcpcli.cli.{name}"
    for name in ("path", "bench", "check", "make", "all_solutions", "streams")
}
DOMINANT = Problem(
    [[4, 1, 0, 0], [1, 4, 1, 0], [0, 1, 4, 1], [0, 0, 1, 4]], [-5, 3, -4, 1]
)
OF_SEVERAL = Problem(
    [[1, 2, 0, 0], [2, 1, 0, 0], [0, 0, 1, 2], [0, 0, 2, 1]], [-1, -1, -1, -1]
)
UNSHOWN = Problem(np.kron(np.eye(10), [[1, 2], [2, 1]]), -np.ones(20))


@pytest.mark.parametrize(
    ("problems", "most", "unused"),
    [
        ([DOMINANT, UNSHOWN], MAX_MODULES, UNUSED),
        ([OF_SEVERAL], MAX_OF_SEVERAL, {"scipy", "rich", "zipfile", "gzip"}),
    ],
    ids=["one solution or not shown", "of several"],
)
def test_small_solve_to_json_loads_what_it_uses(problems, most, unused, tmp_path):
    lines = []
    for k, problem in enumerate(problems):
        writing.write(problem, tmp_path / f"{k}.json")
        lines.append(f"solve {tmp_path / f'{k}.json'} --format json")
    loaded = modules_after(*lines)
    ours = {name for name in loaded if name.split(".")[0] == "lcpcli"}
    assert not [name for name in ours if name.startswith("lcpcli.formulations")]
    assert len(ours) <= most
    assert sorted(loaded & (unused | OTHER_COMMANDS) - modules_of_the_base()) == []


def test_python_m_runs_the_command(tmp_path):
    command = [sys.executable, "-m", "lcpcli", "--version"]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert lcpcli.__version__ in done.stdout


def test_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = lcpcli.nonsense
