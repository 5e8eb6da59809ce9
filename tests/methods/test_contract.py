"""The methods of this package keep the contract of methods, and each way to break it is
found; faults of methods and formats of other packages are the status of a run, or one
line.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from lcpcli import Status, solve
from lcpcli.errors import OptionError
from lcpcli.methods.registry import METHODS, Method
from lcpcli.methods.stages import Finished, Iterate
from lcpcli.options import Option
from lcpcli.solving.contract import check_method

# ruff: noqa: ARG001 (every method has both arguments)


@pytest.mark.parametrize("name", METHODS)
def test_the_methods_of_this_package_keep_it(name):
    check_method(name)


def yielding(*made):
    """A method that yields what these make of the problem and the start, and has then
    finished."""

    def steps(problem, x0):
        for make in made:
            yield make(problem, x0)
        return Finished()

    return steps


def step(change, evaluations=1):
    return lambda _, x0: Iterate(x0 + change, None, "", evaluations)


def changes_q(problem, x0):
    problem.q.flags.writeable = True
    problem.q[0] += 1.0
    return step(1.0)(problem, x0)


def changes_x(problem, x0):
    x0 += 1.0
    return Iterate(x0, None, "", 1)


def raises(problem, x0):
    raise KeyError("no such key")


def returns_nothing(problem, x0):
    yield Iterate(x0, None, "", 1)


def takes_an_option(problem, x0, *, sweeps):
    return yielding(step(1.0))(problem, x0)


FAULTS = {
    "changes M or q": yielding(changes_q),
    "changes an array that it has yielded": yielding(changes_x, changes_x),
    "counts fewer evaluations than before": yielding(step(1.0, 2), step(2.0, 1)),
    "yields other iterates when it is run again": yielding(
        lambda *_: step(np.random.default_rng().random())(*_)
    ),
    "yields an x with nan": yielding(step(np.nan)),
    "yields an x that is not an array of numbers": yielding(
        lambda _, x0: Iterate(x0.tolist(), None, "", 1)
    ),
    "counts None evaluations": yielding(step(0.0, None)),
    "raises KeyError: 'no such key'": yielding(step(1.0), raises),
    "takes the options ['sweeps'], but declares []": takes_an_option,
    "yields or returns None": returns_nothing,
}


def declare(monkeypatch, function, **declared):
    """Declare a method of a package toys as a function of a module of it."""
    module = ModuleType("toys.methods")
    function.__module__ = "toys.methods"
    setattr(module, "toy", function)  # noqa: B010
    monkeypatch.setitem(sys.modules, "toys.methods", module)
    monkeypatch.setitem(
        METHODS, "toy", Method("a toy", location=("toys.methods", "toy"), **declared)
    )


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named(fault, monkeypatch):
    declare(monkeypatch, FAULTS[fault], uses_start=True)
    with pytest.raises(AssertionError, match=re.escape(fault)):
        check_method("toy")


def test_a_start_that_matters_is_declared(monkeypatch):
    def steps(problem, x0):
        while True:
            yield Iterate(x0 + 1.0, None, "", 1)

    declare(monkeypatch, steps)
    with pytest.raises(
        AssertionError, match="depends on the start, but does not declare uses_start"
    ):
        check_method("toy")
    declare(monkeypatch, steps, uses_start=True)
    check_method("toy")


def test_a_method_is_not_begun_with_more_unknowns_than_it_declares(monkeypatch):
    declare(
        monkeypatch,
        yielding(lambda problem, _: Iterate(-np.ones(problem.n), None, "", 1)),
        max_unknowns=2,
    )
    few, many = (solve(-np.eye(n), -np.ones(n), "toy") for n in (2, 3))
    assert few.iterations == 1
    assert many.status == Status.BREAKDOWN
    assert many.iterations == 0
    assert "it takes at most 2 unknowns; this problem has 3" in many.message


def test_a_default_is_in_its_range(monkeypatch):
    def steps(problem, x0, *, sweeps):
        while True:
            yield Iterate(x0 + sweeps, None, "", 1)

    right, wrong = (
        Option("sweeps", int, n, "integer >= 1", lambda own: own >= 1, "Sweeps.")
        for n in (1, 0)
    )
    declare(monkeypatch, steps, uses_start=True, options=(right,))
    check_method("toy")
    declare(monkeypatch, steps, uses_start=True, options=(wrong,))
    with pytest.raises(AssertionError, match="sweeps: 0 "):
        check_method("toy")


ROOT = Path(__file__).parent.parent.parent
NAMES = ("raises", "short", "nothing", "done", "inverts", "nowhere")
CODE = f"""
import numpy as np
from lcpcli.methods.registry import Method
from lcpcli.methods.stages import Finished, Iterate

{", ".join(NAMES).upper()} = (\
Method("faulty", location=("faulty.methods", name)) for name in {NAMES})

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

def inverts(problem, x0):
    yield Iterate(x0, None, "", 1)
    np.linalg.inv(0 * problem.M)
"""
FORMATS = """
from lcpcli.files.formats import Kind

RAISES, NOTHING = Kind("faulty.raising", ""), Kind("faulty.nothing", "")
"""
# What becomes of each method: a message and the package in the record, or an error.
RUNS = """
import json, lcpcli
seen = {}
methods = "raises", "short", "nothing", "done", "inverts", "newton", "nowhere", "raisse"
for method in methods:
    try:
        result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6], method)
        seen[method] = [result.message, json.loads(result.to_json())["package"]]
    except lcpcli.errors.OptionError as error:
        seen[method] = [str(error), None]
print(json.dumps(seen))
"""


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    """A folder with an installed package whose methods and formats are wrong, each in
    another way."""
    folder = tmp_path_factory.mktemp("faulty")
    methods = "".join(f"{name} = faulty.methods:{name.upper()}\n" for name in NAMES)
    formats = ".raises = faulty.formats:RAISES\n.nothing = faulty.formats:NOTHING\n"
    files = {
        "faulty-1.0.dist-info/METADATA": (
            "Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n"
        ),
        "faulty-1.0.dist-info/entry_points.txt": (
            f"[lcpcli.methods]\n{methods}[lcpcli.formats]\n{formats}"
        ),
        "faulty/methods.py": CODE,
        "faulty/formats.py": FORMATS,
        "faulty/raising.py": (
            "def fields(content, number=float):\n    raise RuntimeError('line 3')\n"
        ),
        "faulty/nothing.py": "def fields(*_):\n    return None\n",
        "p.raises": "1 2 3",
        "p.nothing": "1 2 3",
        "good.json": '{"M": [[2]], "q": [-1]}',
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    return folder


def python(folder, *arguments):
    """What Python does in that folder, whose packages it finds."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )


def test_a_fault_of_a_method_of_another_package_is_the_status_of_its_run_or_one_line(
    faulty,
):
    """The record names the package and its version."""
    own = "broke down: the package faulty "
    told = {
        "raises": own
        + f"raises KeyError: 'no such key' ({faulty / 'faulty' / 'methods.py'}, "
        "line 10)",
        "short": own + "yields an x of shape (1,) for 2 unknowns",
        "nothing": own + "yields or returns None",
        "done": "a sweep moved less than 1e-9, but z does not solve the problem",
        "inverts": (
            "broke down: a linear system that is singular or not finite in double "
            "precision after 1 iteration"
        ),
        "nowhere": (
            "method: nowhere of another package cannot be loaded from "
            "faulty.methods: AttributeError: "
        ),
        "raisse": "method: 'raisse' ",
    }
    seen = json.loads(python(faulty, "-c", RUNS).stdout)
    assert {
        method: text for method, text in told.items() if text not in seen[method][0]
    } == {}
    packages = {method: package for method, (_, package) in seen.items()}
    assert packages == dict.fromkeys(NAMES, "faulty 1.0") | dict.fromkeys(
        ["newton", "nowhere", "raisse"]
    )


def test_a_fault_of_a_format_of_another_package_is_the_line_of_its_file(faulty):
    done = python(faulty, "-m", "lcpcli", "solve", "p.raises", "p.nothing", "good.json")
    assert done.returncode == 2
    assert re.search(
        r"lcp: p.raises: cannot be read by the package faulty: RuntimeError: "
        r"line 3 \(.*raising.py, line 2\); correct",
        done.stderr,
    )
    assert "lcp: p.nothing: has no M by the package of its format" in done.stderr
    assert "3 problems: 2 bad input, 1 solved" in done.stderr


def test_a_method_is_known_by_its_author():
    for name, method in {
        "schaefer": "fixed-point",
        "vector-division": "shi",
        "Mehrotra": "interior",
    }.items():
        with pytest.raises(OptionError, match=rf"; .*{method}"):
            solve([[2]], [-1], name)
