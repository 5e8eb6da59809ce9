"""The shape of the code: functions are short, subpackages use only those below them,
nothing runs in circles."""

import ast
import gc
import re
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from inspect import getattr_static
from itertools import pairwise
from pathlib import Path

import pytest

import lcpcli
from lcpcli.model import views

ROOT = Path(__file__).parent.parent
LONGEST_FUNCTION = 60  # lines: a function fits on a screen
# Functions that have more lines since lines have 88 columns. None may be added.
LONG = {
    "lcpcli.formulations.nonlinear_model.tape.Tape.__init__",
    "lcpcli.model.problem.Problem.__init__",
}
LOOSE = 10  # modules at the root of the package, which every subpackage may use

# Each subpackage with the subpackages that it uses, all of them above it in this table.
SUBPACKAGES = {
    name: set(used.split())
    for name, used in {
        "linalg": "",
        "model": "linalg",
        "basis": "linalg model",
        "presolve": "linalg model",
        "rational": "linalg model",
        "verify": "linalg model basis rational",
        "methods": "linalg model basis rational verify",
        "auto": "linalg model basis presolve rational verify methods",
        "inspection": "linalg model presolve rational verify methods auto",
        "kernels": "linalg model basis verify methods auto",
        "solving": "linalg model basis rational verify methods auto inspection kernels",
        "enumeration": "linalg model rational verify methods solving",
        "parametric": "linalg model rational verify inspection solving",
        "files": "linalg model rational",
        "gallery": "linalg model",
        "peers": "linalg model",
        "report": (
            "linalg model presolve rational verify methods inspection solving "
            "enumeration parametric files"
        ),
        "explanation": (
            "linalg model rational verify solving enumeration parametric files report"
        ),
        "bench": "linalg model verify methods solving files gallery peers report",
        "cli": (
            "linalg model rational verify methods inspection kernels solving "
            "enumeration parametric files gallery peers report explanation bench"
        ),
        "formulations": (
            "linalg model rational verify methods inspection solving enumeration "
            "files gallery report"
        ),
    }.items()
}
# Libraries that one subpackage alone imports.
LIBRARIES = {
    "click": "cli",
    "rich": "report",
    "matplotlib": "report",
    "flint": "rational",
    "threadpoolctl": "linalg",
}


def name_of(file):
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules():
    """Every node of each module, of which the first is its tree."""
    gc.disable()  # it would search among all nodes again and again, and later on
    try:
        trees = {
            name_of(file): ast.parse(file.read_text(encoding="utf-8"))
            for file in ROOT.glob("lcpcli/**/*.py")
        }
        return {name: [*ast.walk(tree)] for name, tree in trees.items()}
    finally:
        gc.freeze()
        gc.enable()


@cache
def nodes_by_kind():
    """The nodes of each type in all modules, with the names of these."""
    found = {}
    for name, own in modules().items():
        for node in own:
            found.setdefault(type(node), []).append((name, node))
    return found


def of_modules(kind, *, of_the_command=True):
    """The nodes of a type in the modules, perhaps without those of the command."""
    return [
        node
        for name, node in nodes_by_kind()[kind]
        if of_the_command or subpackage_of(name) != "cli"
    ]


def path_of(name):
    """The path of a module in the package."""
    file = ROOT / name.replace(".", "/")
    file = file / "__init__" if file.is_dir() else file
    return file.with_suffix(".py").relative_to(ROOT / "lcpcli").as_posix()


def body_of(name):
    tree = modules()[name][0]
    assert isinstance(tree, ast.Module)
    return tree.body


def subpackage_of(name):
    """The subpackage of a module; "" at the root of the package."""
    parts = name.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in SUBPACKAGES else ""


@cache
def imports():
    """What each module imports, anywhere in it, in functions and for annotations too;
    of a package, the modules that are taken from it."""
    found = {name: set() for name in modules()}
    for name, own in modules().items():
        for node in own:
            if isinstance(node, ast.Import):
                found[name] |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, "the package imports by full names"
                assert node.module is not None
                full = [f"{node.module}.{alias.name}" for alias in node.names]
                found[name] |= {
                    each if each in modules() else node.module for each in full
                }
    return found


def length_of(function):
    """The lines of a function without its docstring."""
    first = function.body[0]
    docstring = (
        (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(function) else 0
    )
    return (function.end_lineno or 0) - function.lineno + 1 - docstring


def may_be_long(text):
    """Whether so many lines follow each other of which none begins a function, as only
    then there is one to measure."""
    begin = [
        i
        for i, line in enumerate(text.splitlines())
        if line.startswith(("def ", "class ", "@"))
    ]
    return any(
        b - a > LONGEST_FUNCTION for a, b in pairwise([0, *begin, text.count("\n")])
    )


# An entry of a docstring: names, perhaps their shape, and what they are.
ENTRY = re.compile(r"(?:^|\. |; )\s*((?:[a-z]\w*, )*[a-z]\w*)(?:, [\w ]+)? : ", re.M)


def names_in(node):
    """The names, parameters, attributes and members in a function or a class."""
    return {
        str(getattr(each, field))
        for each in ast.walk(node)
        for field in ("id", "arg", "attr", "name")
        if hasattr(each, field)
    }


def takes_any_options(node):
    return isinstance(node, ast.FunctionDef) and node.args.kwarg is not None


def test_entries_of_docstrings_name_what_there_is():
    """Parameters, attributes and the like, whose names have not changed since."""
    missing = []
    for kind in (ast.FunctionDef, ast.ClassDef):
        for module, node in nodes_by_kind()[kind]:
            entries = ENTRY.findall(ast.get_docstring(node) or "")
            names = {name for entry in entries for name in entry.split(", ")}
            if names and not takes_any_options(node):
                unknown = names - names_in(node)
                missing += [f"{module}.{node.name}: {name}" for name in unknown]
    assert missing == []


def test_no_function_is_long():
    texts = {
        name_of(file): file.read_text(encoding="utf-8")
        for file in ROOT.glob("tests/**/*.py")
    }
    bodies = {name: body_of(name) for name in modules()}
    bodies |= {
        name: ast.parse(text).body for name, text in texts.items() if may_be_long(text)
    }
    for name, body in [*bodies.items()]:
        bodies |= {
            f"{name}.{node.name}": node.body
            for node in body
            if isinstance(node, ast.ClassDef)
        }
    functions = {
        f"{name}.{node.name}": length_of(node)
        for name, body in bodies.items()
        for node in body
        if isinstance(node, ast.FunctionDef)
    }
    assert len(functions) > 1000
    assert {
        name for name, length in functions.items() if length > LONGEST_FUNCTION
    } <= LONG


def test_no_modules_import_each_other_in_a_circle_not_even_for_annotations():
    # For annotations alone.
    assert "lcpcli.verify.error_theorems" in imports()["lcpcli.solving.result"]
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def test_every_module_is_in_a_subpackage_but_for_a_few_that_all_use():
    root = {name for name in modules() if not subpackage_of(name)}
    assert {name.count(".") for name in root} == {0, 1}, (
        "a folder is no subpackage of the table"
    )
    assert len(root) <= LOOSE
    below = {
        other
        for name in root - {"lcpcli", "lcpcli.__main__"}
        for other in imports()[name]
        if subpackage_of(other)
    }
    assert below == set(), "what every subpackage uses uses none of them"


def test_subpackages_use_those_of_the_table_which_are_above_them_in_it():
    used = {
        subpackage: {
            subpackage_of(other)
            for name in modules()
            if subpackage_of(name) == subpackage
            for other in imports()[name]
        }
        - {subpackage, ""}
        for subpackage in SUBPACKAGES
    }
    assert used == SUBPACKAGES
    order = list(SUBPACKAGES)
    assert all(
        order.index(other) < order.index(subpackage)
        for subpackage in SUBPACKAGES
        for other in used[subpackage]
    )


FORMULATIONS = sorted(
    file.parent.name for file in ROOT.glob("lcpcli/formulations/*/__init__.py")
)
# The table, and the names of the public functions.
NAMING = {"lcpcli.model.formulations", "lcpcli"}


@cache
def texts_of_modules():
    """The texts and names in each module."""
    return {
        name: {
            getattr(node, kind)
            for node in own
            for kind in ("value", "id", "attr", "module", "name")
            if isinstance(getattr(node, kind, None), str)
        }
        for name, own in modules().items()
    }


@pytest.mark.parametrize("folder", FORMULATIONS)
def test_only_a_table_names_the_folder_of_a_formulation(folder):
    path = f"formulations.{folder}"
    naming = {
        name
        for name, own in texts_of_modules().items()
        if not f"{name}.".startswith(f"lcpcli.{path}.")
        and any(path in each for each in own)
    }
    assert naming <= NAMING
    assert NAMING & naming, "the table has no row for it"


def test_the_table_of_the_page_on_development_has_all_subpackages_in_their_order():
    page = (ROOT / "lcpcli/development.md").read_text(encoding="utf-8")
    table = (
        page.partition("| subpackage | job |")[2].partition("\n\n")[0].splitlines()[2:]
    )
    assert [line.split("|")[1].strip() for line in table] == list(SUBPACKAGES)


def test_the_page_on_development_names_each_function_that_keeps_numbers():
    page = (ROOT / "lcpcli/development.md").read_text(encoding="utf-8")
    keeping = [
        f"`{node.name}` of `{path_of(name)}`"
        for name, node in nodes_by_kind()[ast.FunctionDef]
        if any("lru_cache" in ast.unparse(each) for each in node.decorator_list)
    ]
    assert len(keeping) >= 3
    assert not [name for name in keeping if name not in page]


def test_libraries_are_imported_by_their_subpackages_alone():
    importers = {
        library: {
            subpackage_of(name)
            for name, own in imports().items()
            if library in {each.split(".")[0] for each in own}
        }
        for library in LIBRARIES
    }
    assert importers == {
        library: {subpackage} for library, subpackage in LIBRARIES.items()
    }


def test_views_are_functions_of_named_modules_and_records_call_them_all():
    """Type checkers do not see them, as they are named by texts."""
    homes = {
        name: f"lcpcli.{subpackage}.{name}"
        for name, subpackage in views.SUBPACKAGES.items()
    }
    called = {
        (node.value.attr, node.attr)
        for node in of_modules(ast.Attribute)
        if isinstance(node.value, ast.Attribute)
        and ast.unparse(node.value.value) == "views"
    }
    assert {name for name, _ in called} == homes.keys()
    for name, function in called:
        assert callable(vars(import_module(homes[name]))[function])
    with pytest.raises(AttributeError, match="nonsense"):
        _ = views.nonsense


def test_nothing_is_patched_onto_a_class_from_outside():
    owners = [
        ast.unparse(target.value)
        for node in of_modules(ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Attribute)
    ]
    set_by_name = [
        ast.unparse(node.args[0])
        for node in of_modules(ast.Call)
        if isinstance(node.func, ast.Name) and node.func.id == "setattr"
    ]
    assert not [owner for owner in set_by_name if owner.startswith("getattr(")]
    classes = {node.name for node in of_modules(ast.ClassDef)}
    assert not {owner.split(".")[-1] for owner in owners + set_by_name} & classes


PLACES = {"__dict__", "__new__"}  # where a frozen record can be filled


def test_what_is_frozen_is_filled_by_its_own_class_alone():
    attributes, names = (nodes_by_kind()[kind] for kind in (ast.Attribute, ast.Name))
    filling = {name for name, node in attributes if node.attr in PLACES}
    filling |= {name for name, node in names if node.id == "vars"}
    assert len(filling) > 5
    for name in filling:
        outside = [
            node
            for top in body_of(name)
            if not isinstance(top, ast.ClassDef)
            for node in ast.walk(top)
        ]
        assert not PLACES & {getattr(node, "attr", "") for node in outside}, name
        changes = [
            node
            for node in outside
            if isinstance(node, (ast.Attribute, ast.Subscript))
            and isinstance(node.ctx, ast.Store)
        ]
        changes += [
            node
            for node in outside
            if getattr(node, "attr", "") in ("update", "setdefault", "pop")
        ]
        assert not [
            node for node in changes if ast.unparse(node).startswith("vars(")
        ], name


OF_THE_PROCESS = {"os.dup2", "os._exit", "sys.meta_path", "gc.set_threshold"}
NAMES = {name.split(".")[1] for name in OF_THE_PROCESS}


def test_no_generator_is_decorated_by_errstate_which_ends_before_its_first_step():
    """`doubles.each_step` stands for it."""
    quiet = [
        each
        for each in of_modules(ast.FunctionDef)
        if any("errstate" in ast.unparse(own) for own in each.decorator_list)
    ]
    assert len(quiet) > 10
    steps = [
        each.name
        for each in quiet
        if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in ast.walk(each))
    ]
    assert not steps


def test_only_the_command_changes_its_process_and_has_exit_codes():
    """What a result means to a shell is decided in one place; to other subpackages it
    says in words how it has ended.

    Only `interrupts.silent` moves standard output too, for the time of a call in a
    process with one thread.
    """
    owners = {
        subpackage_of(name)
        for name, node in nodes_by_kind()[ast.Attribute]
        if node.attr in NAMES and ast.unparse(node) in OF_THE_PROCESS
        if (name, node.attr) != ("lcpcli.interrupts", "dup2")
    }
    assert owners == {"cli"}
    texts = texts_of_modules().items()
    below = (own for name, own in texts if subpackage_of(name) != "cli")
    assert "exit_code" not in set().union(*below)


def test_errors_in_options_name_them_as_python_does():
    """The command alone writes their flags, `cli.main.as_written`."""
    calls = [node for node in of_modules(ast.Call, of_the_command=False) if node.args]
    raised = [
        ast.unparse(node.args[0])
        for node in calls
        if ast.unparse(node.func) in ("OptionError", "ParameterError")
    ]
    assert len(raised) > 50
    assert not [text for text in raised if text.lstrip("f").startswith("'-")]


IN_RUNS = (
    "linalg",
    "model",
    "rational",
    "verify",
    "methods",
    "inspection",
    "solving",
    "enumeration",
    "parametric",
)
# Whose functions are called after a run.
AFTER_RUNS = {"lcpcli.formulations.quadratic_program.solve_qp"}
LOADING = {"import_module", "find_spec"}
# Load parts of numpy, as np.unique does.
LATE_IN_NUMPY = {"np.random", "np.union1d", "np.setdiff1d", "np.setxor1d"}


def timed_loading(node, in_function=False):
    """What below a node may load modules while a run is timed: in functions, outside of
    `with imports`."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.With) and any(
            ast.unparse(item.context_expr) == "imports" for item in child.items
        ):
            continue
        if getattr(getattr(child, "test", None), "id", "") == "TYPE_CHECKING":
            continue
        if isinstance(child, (ast.Import, ast.ImportFrom)) and in_function:
            yield ast.unparse(child)
        called = getattr(child, "func", None)
        is_unique = getattr(called, "attr", "") == "unique" and not child.keywords
        if getattr(called, "id", "") in LOADING or is_unique:
            yield ast.unparse(child)
        is_late = f"np.{getattr(child, 'attr', '')}" in LATE_IN_NUMPY
        if is_late and ast.unparse(child) in LATE_IN_NUMPY:
            yield ast.unparse(child)
        yield from timed_loading(
            child, in_function or isinstance(child, ast.FunctionDef)
        )


def test_no_time_of_a_run_is_that_of_loading_a_module():
    names = [
        name
        for name in modules()
        if subpackage_of(name) in IN_RUNS and name not in AFTER_RUNS
    ]
    assert {
        name: found
        for name in names
        if (found := list(timed_loading(modules()[name][0])))
    } == {}


def test_packages_name_what_is_inside_and_do_no_work():
    packages = [
        name
        for name in modules()
        if name != "lcpcli" and (ROOT / name.replace(".", "/")).is_dir()
    ]
    assert {
        name
        for name in packages
        if not isinstance(body_of(name)[0], ast.Expr) or len(body_of(name)) > 1
    } == set()


def test_no_module_takes_the_place_of_a_public_name_when_it_is_imported():
    assert {name.split(".")[1] for name in modules() if "." in name} & {
        *lcpcli.__all__
    } == set()


def test_what_the_script_of_ablation_switches_off_is_there(monkeypatch):
    """Names and texts of the code, which may have changed since."""
    pytest.importorskip("numba")
    monkeypatch.setattr(sys, "path", [*sys.path, str(ROOT / "tests" / "benchmarks")])
    ablation = import_module("ablation")
    for switch in [*ablation.SWITCHES, *ablation.rows()]:
        owner, name = ablation.place(switch.target)
        switch.off(getattr_static(owner, name))
        for each in switch.used:
            assert callable(each) or hasattr(*ablation.place(each)), switch.name
