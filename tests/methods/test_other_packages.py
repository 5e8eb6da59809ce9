"""Methods of other packages that are wrong: their faults are the status of a run, or one line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
FAULTY = """
import numpy as np
from lcpcli.methods.registry import Method
from lcpcli.methods.stages import Finished, Iterate

RAISES, SHORT, NOTHING, DONE, NOWHERE = (
    Method("faulty", location=("faulty.methods", name)) for name in ("raises", "short", "nothing", "done", "nowhere")
)

def raises(problem, x0):
    yield Iterate(x0, None, "", 1)
    raise KeyError("no such key")

def short(problem, x0):
    yield Iterate(x0[:1], None, "", 1)

def nothing(problem, x0):
    yield Iterate(x0, None, "", 1)

def done(problem, x0):
    yield Iterate(x0, None, "", 1)
    return Finished("a sweep moved less than 1e-9")
"""


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an installed package whose methods are wrong, each in another way."""
    folder = tmp_path_factory.mktemp("faulty")
    installed = folder / "faulty-1.0.dist-info"
    installed.mkdir()
    (folder / "faulty").mkdir()
    (folder / "faulty" / "methods.py").write_text(FAULTY)
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    names = ("raises", "short", "nothing", "done", "nowhere")
    lines = [f"{name} = faulty.methods:{name.upper()}\n" for name in names]
    (installed / "entry_points.txt").write_text("".join(["[lcpcli.methods]\n", *lines]))
    return folder


def printed(faulty: Path, code: str) -> str:
    """What a program prints that finds the package."""
    path = os.pathsep.join([str(faulty), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=faulty,
        env=os.environ | {"PYTHONPATH": path},
    )
    return done.stdout


def command(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a folder whose packages it finds."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    return subprocess.run(
        [sys.executable, "-m", "lcpcli", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("raises", "broke down: the package faulty raises KeyError: 'no such key'"),
        ("short", "broke down: the package faulty yields an x of shape (1,) for 2 unknowns"),
        ("nothing", "broke down: the package faulty yields or returns None"),
        ("done", "a sweep moved less than 1e-9, but z does not solve the problem"),
    ],
)
def test_a_fault_of_another_package_is_the_status_of_its_run(method: str, message: str, faulty: Path) -> None:
    code = f"import lcpcli; r = lcpcli.solve([[2, 1], [1, 2]], [-5, -6], {method!r});print(r.message)"
    assert message in printed(faulty, code)


@pytest.mark.parametrize(
    ("method", "line"),
    [
        ("nowhere", "method: nowhere of another package cannot be loaded from faulty.methods: AttributeError: "),
        ("raisse", "method: 'raisse' is unknown; did you mean raises?"),
    ],
)
def test_a_method_of_another_package_that_is_not_there_is_one_line(method: str, line: str, faulty: Path) -> None:
    code = (
        "import lcpcli\n"
        f"try: lcpcli.solve([[2, 1], [1, 2]], [-5, -6], {method!r})\n"
        "except lcpcli.errors.OptionError as error: print(error)"
    )
    assert printed(faulty, code).startswith(line)


def test_a_record_names_the_package_of_the_method_and_its_version(faulty: Path) -> None:
    code = """if 1:
        import json, lcpcli
        for method in ("raises", "newton"):
            print(json.loads(lcpcli.solve([[2, 1], [1, 2]], [-5, -6], method).to_json())["package"])
    """
    assert printed(faulty, code).split("\n")[:2] == ["faulty 1.0", "None"]


def test_a_name_that_is_like_that_of_another_package_is_corrected_on_the_command_line(faulty: Path) -> None:
    done = command(faulty, "solve", "p.json", "--method", "nowher")
    assert done.returncode == 2
    assert "'nowher' is unknown; did you mean nowhere?" in done.stderr


def test_a_fault_of_a_format_of_another_package_is_the_line_of_its_file(tmp_path: Path) -> None:
    installed = tmp_path / "toys-1.0.dist-info"
    installed.mkdir()
    (tmp_path / "toys.py").write_text(
        'from lcpcli.files.formats import Kind\nRAISES, NOTHING = Kind("toys.raises", ""), Kind("toys.nothing", "")\n'
    )
    (tmp_path / "toys").mkdir()
    (tmp_path / "toys.py").rename(tmp_path / "toys" / "__init__.py")
    (tmp_path / "toys" / "raises.py").write_text(
        "def fields(content, number=float):\n    raise RuntimeError('line 3')\n"
    )
    (tmp_path / "toys" / "nothing.py").write_text("def fields(*_):\n    return None\n")
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text("[lcpcli.formats]\n.raises = toys:RAISES\n.nothing = toys:NOTHING\n")
    for name in ("p.raises", "p.nothing"):
        (tmp_path / name).write_text("1 2 3")
    (tmp_path / "good.json").write_text('{"M": [[2]], "q": [-1]}')
    done = command(tmp_path, "solve", "p.raises", "p.nothing", "good.json")
    assert done.returncode == 2
    assert "lcp: p.raises: cannot be read by the package toys: RuntimeError: line 3; correct the file" in done.stderr
    assert "lcp: p.nothing: has no M by the package of its format" in done.stderr
    assert "3 problems: 2 bad input, 1 solved" in done.stderr
