"""The shape of the code: files and functions are short, imports run one way, and each library has its place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FILES = sorted([*ROOT.glob("lcpcli/**/*.py"), *ROOT.glob("tests/**/*.py")])
LONGEST_FILE, LONGEST_FUNCTION = 300, 60  # lines

# What is imported, anywhere in a module, only by these parts of the package; "lcpcli" is its __init__.
# files -> Problem -> methods -> loop -> driver -> Result -> report -> cli. Problem, Result and Trace show themselves
# through report, origins name the keys of files, and proofs and reference solutions run methods through the driver.
ONLY_BY = {
    "lcpcli.cli": "__main__",
    "lcpcli.bench": "report cli",
    "lcpcli.report": "problem result trace bench cli",
    "lcpcli.files": "lcpcli origins bench cli",
    "lcpcli.gallery": "bench cli",
    "lcpcli.peers": "bench cli",
    "lcpcli.api": "lcpcli",
    "lcpcli.driver": "lcpcli api reference exact bench cli",
    "lcpcli.loop": "driver",
    "lcpcli.finish": "driver linear restarts sparse_route",
    "lcpcli.methods": "advice api cli driver exact exhaustion finish inspection krylov linear loop multilevel restarts "
    "scaled sparse_route",
    "click": "cli",
    "rich": "report cli",
    "matplotlib": "report",
    "plotext": "report",
    "flint": "exact sensitivity",
}


def name_of(file: Path) -> str:
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


TREES = {name_of(file): ast.parse(file.read_text(encoding="utf-8")) for file in FILES}
MODULES = {name: tree for name, tree in TREES.items() if name.startswith("lcpcli")}


def run_when_imported(body: list[ast.stmt]) -> Iterator[ast.AST]:
    """The statements of a module outside its functions and what is for type checkers alone."""
    for node in body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            yield from run_when_imported(node.orelse)
        elif isinstance(node, ast.ClassDef):
            yield from run_when_imported(node.body)
        elif not isinstance(node, ast.FunctionDef):
            yield from ast.walk(node)


def imported(nodes: Iterator[ast.AST]) -> Iterator[str]:
    """The modules that these statements import, and, where these are packages, the modules taken from them."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "the package imports by full names"
            assert node.module is not None
            full = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in MODULES else node.module for name in full)


def with_packages(name: str) -> set[str]:
    """A module and the packages that it lies in, which are imported with it."""
    parts = name.split(".")
    return {".".join(parts[: end + 1]) for end in range(len(parts))}


@pytest.mark.parametrize("file", FILES, ids=lambda file: name_of(file))
def test_no_file_and_no_function_is_long(file: Path) -> None:
    assert len(file.read_text(encoding="utf-8").splitlines()) <= LONGEST_FILE
    functions = [node for node in ast.walk(TREES[name_of(file)]) if isinstance(node, ast.FunctionDef)]
    lines = {node.name: (node.end_lineno or 0) - node.lineno + 1 for node in functions}
    assert {name: count for name, count in lines.items() if count > LONGEST_FUNCTION} == {}


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = {}
    for name, tree in MODULES.items():
        named = set(imported(run_when_imported(tree.body)))
        packages = set().union(*map(with_packages, named)) - with_packages(name)
        graph[name] = named | packages
    assert "lcpcli.loop" in graph["lcpcli.driver"]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


@pytest.mark.parametrize("what", ONLY_BY)
def test_only_its_own_layers_import(what: str) -> None:
    importers = {
        name.removeprefix("lcpcli.").partition(".")[0]
        for name, tree in MODULES.items()
        if what not in with_packages(name) and any(what in with_packages(other) for other in imported(ast.walk(tree)))
    }
    assert importers, "nothing imports it: is the name right?"
    assert importers - set(ONLY_BY[what].split()) == set()
