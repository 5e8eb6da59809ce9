"""The package without the folder of a formulation."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import lcpcli

from .conftest import BATCH
from .files.nl_writing import model

PACKAGE = Path(lcpcli.__file__).parent
FOLDERS = sorted(
    path.name
    for path in (PACKAGE / "formulations").iterdir()
    if (path / "__init__.py").exists()
)
GAME = 'NFG 1 R "" { "one" "two" } { 2 1 }\n1 2 3 4\n'
TREE = 'EFG 2 R "" { "one" "two" }\nt "" 1 "" { 1 0 }\n'
PROGRAM = "NAME\nROWS\n N o\n G r\nCOLUMNS\n x o 1 r 1\nRHS\n R r 1\nENDATA\n"
MISSING = (
    "this installation has no formulation for {}, as the folder lcpcli/formulations/{} "
    "is missing; install the package again, with all of its files"
)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A folder with the package, without the folders of all formulations, and files;
    what is compiled of it need not be compiled again."""
    folder = tmp_path_factory.mktemp("alone")
    ignored = shutil.ignore_patterns(*FOLDERS)
    shutil.copytree(PACKAGE, folder / "lcpcli", ignore=ignored)
    (folder / "p.json").write_text('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}')
    (folder / "p.csv").write_text("2,1,-5\n1,2,-6\n")
    (folder / "A.csv").write_text("1,2\n3,4\n")
    (folder / "game.nfg").write_text(GAME)
    (folder / "game.json").write_text('{"A": [[1, 0]], "B": [["1/3", 0]]}')
    (folder / "tree.efg").write_text(TREE)
    (folder / "model.nl").write_bytes(model(1, [((5, 1, 1), {0: 1}, -1)], [(2, 0)]))
    (folder / "tree.json").write_text(json.dumps({"efg": TREE}))
    (folder / "fit.json").write_text('{"lsq": true, "A": [[1]], "b": [1]}')
    (folder / "contact.json").write_text('{"W": [[1]], "q": [1], "mu": 1}')
    (folder / "program.mps").write_text(PROGRAM)
    (folder / "program.json").write_text('{"c": [1, 2], "A": [[1, 1]], "b": [1]}')
    osqp = '{"P": null, "q": [1, 2], "A": [[1, 1]], "l": [1], "u": [2]}'
    (folder / "osqp.json").write_text(osqp)
    return folder


# Each line in the same process, as loading the package takes longer than what it does;
# the exit code of each comes behind its output.
EACH = BATCH.replace("assert not ending.code", 'print(end=f"\\0{ending.code or 0}")')


def python(folder, code, given=""):
    """Run a program with the package of a folder."""
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        input=given,
        capture_output=True,
        text=True,
        check=True,
    )


LINES = """\
solve p.json
solve p.csv --all
solve p.json --exact -f json
compare p.json
check p.json 1.3333333333333333,2.3333333333333335
inspect p.json
bench p.json --method auto --budget 0
make bimatrix -n 4
make --list
"""


def test_lcps_need_no_formulation_and_what_needs_a_missing_one_gets_one_line(alone):
    missing = {
        f"solve {file}": f"{file}: {MISSING.format(what, folder)}"
        for file, what, folder in (
            ("game.nfg", ".nfg", "bimatrix_game"),
            ("game.json", "a game", "bimatrix_game"),
            ("tree.efg", ".efg", "game_tree"),
            ("tree.json", "a game", "game_tree"),
            ("fit.json", "a least-squares problem", "least_squares"),
            ("contact.json", "contact with friction", "contact"),
            ("model.nl", ".nl", "nonlinear_model"),
            ("program.mps", ".mps", "quadratic_program"),
            ("program.json", "a program", "quadratic_program"),
            ("osqp.json", "a program", "quadratic_program"),
        )
    }
    missing["model.nl -AMPL"] = MISSING.format("-AMPL", "nonlinear_model")
    missing["solve A.csv A.csv --game"] = MISSING.format("--game", "bimatrix_game")
    given = "\n".join([*missing, "solve A.csv A.csv"])
    done = python(alone, EACH, f"{LINES}{given}")
    *solved, rest = done.stdout.split("\0", 2 * LINES.count("\n"))
    assert all(solved[::2])
    assert {*solved[1::2]} == {"0"}
    assert rest.split("\0") == ["", "2"] * len(missing) + ["", "2", ""]
    *lines, without_a_hint = done.stderr.splitlines()
    assert lines == [f"lcp: {told}" for told in missing.values()]
    assert "--game" not in without_a_hint


def test_each_public_name_without_its_formulation_is_an_error_of_one_line(alone):
    homes = {
        name: home.split(".")[2]
        for name in lcpcli.__all__
        if (home := getattr(lcpcli, name).__module__).startswith("lcpcli.formulations")
    }
    assert {*homes.values()} == {*FOLDERS}
    code = (
        "import lcpcli\n"
        "from lcpcli.errors import LCPError\n"
        f"for name in {[*homes]}:\n"
        "    try: exec(f'from lcpcli import {name}')\n"
        "    except ImportError as error: print(isinstance(error, LCPError), error)"
    )
    assert python(alone, code).stdout.splitlines() == [
        f"True {MISSING.format(f'lcpcli.{name}', folder)}"
        for name, folder in homes.items()
    ]
