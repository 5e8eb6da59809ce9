"""Imports follow the work: nothing heavy is loaded before somebody needs it."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import contents, writing

EXAMPLE = contents.shipped_path("paper-example-1.json")
REPORT = """
import sys
sys.argv = ["lcp", *sys.argv[1:]]
import atexit
atexit.register(lambda: print("\\n" + " ".join(sorted(sys.modules))))
from lcpcli.cli.main import main
main()
"""


def modules_after(*arguments: str) -> set[str]:
    """The modules that are loaded when `lcp ARGUMENTS` is done."""
    done = subprocess.run([sys.executable, "-c", REPORT, *arguments], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


@cache
def modules_of_the_base() -> set[str]:
    """The modules that numpy and click load by themselves, which depends on their versions."""
    code = "import numpy, click, json, sys; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


def of_ours(names: set[str]) -> list[str]:
    return sorted(name for name in names if name.split(".")[0] == "lcpcli")


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["--version"],
        ["solve", "--help"],
        ["compare", "--help"],
        ["make", "--help"],
        ["inspect", "--help"],
        ["bench", "--help"],
        ["check", "--help"],
        ["path", "--help"],
        ["completion", "--help"],
        ["completion", "bash"],
        ["help"],
        ["help", "methods"],
        ["help", "solve"],
        [],
    ],
)
def test_help_and_version_load_neither_numpy_nor_scipy_nor_rich(arguments: list[str]) -> None:
    assert not modules_after(*arguments) & {"numpy", "scipy", "rich"}


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
@pytest.mark.parametrize("n", [4, 200])
def test_dense_solve_to_json_loads_neither_rich_nor_scipy(method: str, n: int, tmp_path: Path) -> None:
    file = tmp_path / "dense.json"
    writing.write(Problem(4 * np.eye(n), -np.ones(n)), str(file))
    loaded = modules_after("solve", str(file), "--method", method, "--format", "json")
    assert "numpy" in loaded
    assert not loaded & {"scipy", "rich"}


def test_table_loads_rich_but_not_scipy() -> None:
    loaded = modules_after("solve", EXAMPLE)
    assert "rich" in loaded
    assert "scipy" not in loaded


MOST_MODULES, MOST_OF_SEVERAL = 60, 73  # of ours, for a small solve in JSON; exact arithmetic finds the other solutions
UNUSED = {  # by a small solve whose solution is the only one by a theorem
    "scipy", "rich", "pathlib", "shutil", "hashlib", "zipfile", "gzip", "fractions", "decimal", "statistics",
    "numpy.ma", "lcpcli.enumeration.search", "lcpcli.rational.exact_problem", "lcpcli.solving.trace",
    "lcpcli.model.origins",
}  # fmt: skip
DOMINANT = Problem([[4, 1, 0, 0], [1, 4, 1, 0], [0, 1, 4, 1], [0, 0, 1, 4]], [-5, 3, -4, 1])
OF_SEVERAL = Problem([[1, 2, 0, 0], [2, 1, 0, 0], [0, 0, 1, 2], [0, 0, 2, 1]], [-1, -1, -1, -1])
UNSHOWN = Problem(np.kron(np.eye(10), [[1, 2], [2, 1]]), -np.ones(20))


@pytest.mark.parametrize("problem", [DOMINANT, OF_SEVERAL, UNSHOWN], ids=["dominant", "of several", "not shown"])
def test_small_solve_to_json_loads_what_it_uses(problem: Problem, tmp_path: Path) -> None:
    file = tmp_path / "small.json"
    writing.write(problem, str(file))
    loaded = modules_after("solve", str(file), "--format", "json")
    assert len(of_ours(loaded)) <= (MOST_OF_SEVERAL if problem is OF_SEVERAL else MOST_MODULES)
    unused = {"scipy", "rich", "zipfile", "gzip"} if problem is OF_SEVERAL else UNUSED
    assert sorted(loaded & unused - modules_of_the_base()) == []


def test_solve_does_not_declare_the_options_of_other_commands() -> None:
    commands = {
        f"lcpcli.cli.{name}" for name in ("compare", "path", "bench", "check", "make", "all_solutions", "streams")
    }
    assert not modules_after("solve", EXAMPLE, "--format", "json") & commands


def test_list_of_families_loads_no_scipy() -> None:
    assert "scipy" not in modules_after("make", "--list")


def test_package_itself_loads_nothing() -> None:
    code = "import sys, lcpcli; print([m for m in ('numpy', 'scipy', 'rich', 'click') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_python_m_runs_the_command(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "lcpcli", "compare", "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert [json.loads(line)["solved"] for line in done.stdout.splitlines()] == [True] * 4


def test_unknown_public_name_is_an_attribute_error() -> None:
    import lcpcli

    with pytest.raises(AttributeError, match="nonsense"):
        _ = lcpcli.nonsense


def test_every_public_name_can_be_loaded() -> None:
    import lcpcli

    assert all(getattr(lcpcli, name) is not None for name in lcpcli.__all__)


def test_names_and_descriptions_of_peers_load_nothing() -> None:
    code = "import sys; from lcpcli.peers.registry import select; select(['siconos']); print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
