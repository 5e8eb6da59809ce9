"""lcp as a solver that Pyomo calls: what its users write, and what they see."""

import os
import re
import sys
from typing import Any

import pytest

from lcpcli import read
from lcpcli.cli.help import PAGES

from .conftest import MAIN

pyomo: Any
mpec: Any
EXAMPLES = re.findall(
    r"^```pyomo\n(.*?)^```$", PAGES["models"], re.MULTILINE | re.DOTALL
)


@pytest.fixture(scope="module", autouse=True)
def loaded():
    """Load Pyomo, which takes a second, where these tests run."""
    global pyomo, mpec
    pyomo, mpec = (pytest.importorskip(f"pyomo.{name}") for name in ("environ", "mpec"))


@pytest.fixture(autouse=True)
def on_the_path(tmp_path, monkeypatch):
    executable = tmp_path / "lcp"
    executable.write_text(f"#!/bin/sh\nexec {sys.executable} -c '{MAIN}' \"$@\"\n")
    executable.chmod(0o755)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    monkeypatch.setenv("PATH", os.pathsep.join([str(tmp_path), os.environ["PATH"]]))
    return executable


def solved(model):
    ended = pyomo.SolverFactory("asl:lcp").solve(model).solver
    return str(ended.termination_condition)


@pytest.mark.usefixtures("in_folder")
def test_examples_of_the_page_print_what_they_say(capfd):
    """One after the other, as a reader would type them."""
    names = {}
    for example in EXAMPLES:
        exec(example, names)
        printed = capfd.readouterr().out.splitlines()
        said = re.findall(r"^print\(.*# (.*)$", example, re.MULTILINE)
        assert said
        assert said == [line for line in printed if line in said]
    assert len(EXAMPLES) == 3


def test_reason_of_a_failure_is_in_the_warning(caplog):
    model = pyomo.ConcreteModel()
    model.z = pyomo.Var(initialize=0.5)
    model.row = pyomo.Constraint(expr=1 + model.z**2 == 0)
    assert solved(model) == "maxIterations"
    assert "stationary point of the merit function" in caplog.text


def test_lcp_stands_in_the_place_of_path(on_the_path):
    model, values = forms()["variable first"]
    solver = pyomo.SolverFactory("path", executable=str(on_the_path))
    assert solver.available()
    ended = solver.solve(model, options={"tol": 1e-9}).solver
    assert str(ended.termination_condition) == "optimal"
    assert model.x.value == pytest.approx(values[0])


def forms():
    """The forms of complements, each as the conditions of x and y, and the solution of
    2 x + y = 5 and x + 2 y = 6, or of what bounds make of it."""
    inside, usual = pyomo.inequality, [4 / 3, 7 / 3]
    nonnegative = {"within": pyomo.NonNegativeReals}

    def of(condition, **bounds):
        model = pyomo.ConcreteModel()
        model.x = pyomo.Var(**bounds.get("x", {}))
        model.y = pyomo.Var(**bounds.get("y", {}))
        model.c = mpec.Complementarity(expr=mpec.complements(*condition(model)))
        other = mpec.complements(model.y >= 0, model.x + 2 * model.y >= 6)
        model.d = mpec.Complementarity(expr=other)
        return model

    def f(m):
        return 2 * m.x + m.y - 5

    return {
        "variable first": (of(lambda m: (m.x >= 0, f(m) >= 0)), usual),
        "sides": (of(lambda m: (m.x >= -1, 2 * m.x + m.y >= 5)), usual),
        "bounds of variables": (
            of(lambda m: (m.x >= 0, f(m) >= 0), x=nonnegative, y=nonnegative),
            usual,
        ),
        "upper bound": (of(lambda m: (m.x <= 1, f(m) <= 0)), [1, 2.5]),
        "equation": (of(lambda m: (f(m) == 0, m.x)), usual),
        "range of a function": (of(lambda m: (inside(0, f(m), 3), m.x)), usual),
        "two functions": (of(lambda m: (m.x + m.y >= 0, f(m) >= 0)), usual),
    }


def test_each_form_of_a_condition_is_solved_and_its_auxiliary_variable_comes_last(
    in_folder,
):
    for name, (model, values) in forms().items():
        assert solved(model) == "optimal", name
        assert [model.x.value, model.y.value] == pytest.approx(values), name
        other, _ = forms()[name]
        pyomo.TransformationFactory("mpec.nl").apply_to(other)
        other.write("model.nl", io_options={"symbolic_solver_labels": True})
        names = read(in_folder / "model.nl").names
        first = [text for text in names if not text.endswith(".bv")]
        assert list(names[: len(first)]) == first, name
        assert {"x", "y"} <= set(first)


def program(**options):
    model = pyomo.ConcreteModel()
    model.x = pyomo.Var(within=options.get("within", pyomo.NonNegativeReals))
    model.y = pyomo.Var(within=pyomo.NonNegativeReals)
    model.r = pyomo.Constraint(expr=options["row"](model))
    model.o = pyomo.Objective(
        expr=options["cost"](model), sense=options.get("sense", pyomo.minimize)
    )
    model.dual = pyomo.Suffix(direction=pyomo.Suffix.IMPORT)
    return model


def test_linear_and_quadratic_programs_are_solved_with_their_multipliers():
    model = program(
        row=lambda m: m.x + 2 * m.y <= 2,
        cost=lambda m: 3 * m.x + 4 * m.y,
        sense=pyomo.maximize,
    )
    assert solved(model) == "optimal"
    assert [model.x.value, model.y.value, model.dual[model.r]] == [2, 0, 3]
    model = program(
        row=lambda m: m.x + m.y == 1,
        cost=lambda m: (m.x - 0.1) ** 2 + 2 * m.y**2,
    )
    assert solved(model) == "optimal"
    found = [model.x.value, model.y.value, model.dual[model.r]]
    assert found == pytest.approx([0.7, 0.3, 1.2])


def test_program_without_a_minimizer_is_reported_as_such(caplog):
    cost = {"cost": lambda m: m.x + m.y}
    assert solved(program(row=lambda m: m.x + m.y <= -1, **cost)) == "infeasible"
    unbounded = program(row=lambda m: m.x <= 2, within=pyomo.Reals, **cost)
    assert solved(unbounded) == "unbounded"
    model = program(row=lambda m: m.x + m.y <= 1, cost=lambda m: m.x - m.x**2)
    assert solved(model) == "optimal"
    assert "stationary point and need not be a minimizer" in caplog.text


def test_what_is_not_solved_is_refused_with_the_right_advice(caplog):
    leader = forms()["variable first"][0]
    leader.u = pyomo.Var(bounds=(0, 1))
    leader.o = pyomo.Objective(expr=leader.x + leader.u)
    nonlinear = program(row=lambda m: m.x >= 1, cost=lambda m: pyomo.exp(m.x))
    for model, words in (
        (leader, "lcp help solutions bilevel"),
        (nonlinear, "so that this is no quadratic program"),
    ):
        caplog.clear()
        with pytest.raises(Exception, match="did not exit normally"):
            solved(model)
        assert words in caplog.text
        assert "inequality() in Pyomo" not in caplog.text
