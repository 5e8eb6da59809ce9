"""Hints at packages that are missing name distributions that an index has."""

import ast
import re
from importlib.metadata import packages_distributions
from importlib.util import find_spec
from pathlib import Path

from lcpcli.errors import DISTRIBUTIONS, missing
from lcpcli.peers.registry import PEERS, load

ROOT = Path(__file__).parent.parent
SOURCES = {
    file: file.read_text(encoding="utf-8") for file in (ROOT / "lcpcli").rglob("*.py")
}
# Of what users have already, as they ask for its objects.
OF_USERS = {"pandas", "qpsolvers"}


def modules_in_hints():
    found = {load(peer).module.partition(".")[0] for peer in PEERS}
    for text in SOURCES.values():
        for node in ast.walk(ast.parse(text)) if "missing(" in text else ():
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "missing":
                found |= {
                    argument.value
                    for argument in node.args
                    if isinstance(argument, ast.Constant)
                }
    return found | {"numba"}  # by its name in `options`


def requirements():
    """The distributions in the table of extras."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    table = text.partition("[project.optional-dependencies]")[2].partition("\n[")[0]
    return set(re.findall(r'"([a-zA-Z][\w-]*)', table))


def test_every_hint_names_a_distribution_of_an_extra():
    modules = modules_in_hints()
    assert {"flint", "matplotlib", "distributed", "quantecon"} <= modules
    named = {DISTRIBUTIONS.get(module, module) for module in modules - OF_USERS}
    assert named <= requirements()
    assert missing("quantecon.optimize", "quantecon.game_theory")[1] == (
        "pip install quantecon"
    )
    assert missing("flint") == ("needs python-flint", "pip install python-flint")


def test_hints_come_from_one_place_and_no_text_names_an_extra_of_an_index():
    texts = {file.name for file, text in SOURCES.items() if "pip install" in text}
    assert texts == {"errors.py"}
    pages = [*ROOT.glob("lcpcli/**/*.md"), ROOT / "README.md"]
    everything = "\n".join(
        [*SOURCES.values(), *(page.read_text(encoding="utf-8") for page in pages)]
    )
    names = r"(linear[-_]complementarity|lcpcli)(?![-_.\w]*\.(whl|tar\.gz))"
    assert not re.findall(rf"\bpip install .*\b{names}", everything)
    assert "linear-complementarity[" not in everything


def test_distributions_have_the_modules_in_whose_place_they_are_named():
    owners = packages_distributions()
    for module in modules_in_hints():
        if find_spec(module) is not None:
            names = [name.lower().replace("_", "-") for name in owners[module]]
            assert DISTRIBUTIONS.get(module, module).replace("_", "-") in names
