"""lcp as a solver that Pyomo calls: what its users write, and what they see."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from lcpcli.cli.help import PAGES

from .conftest import MAIN

pyomo: Any
mpec: Any
(EXAMPLE,) = re.findall(
    r"^```pyomo\n(.*?)^```$", PAGES["models"], re.MULTILINE | re.DOTALL
)


@pytest.fixture(scope="module", autouse=True)
def loaded() -> None:
    """Load Pyomo, which takes a second, where these tests run."""
    global pyomo, mpec
    pyomo, mpec = (pytest.importorskip(f"pyomo.{name}") for name in ("environ", "mpec"))


@pytest.fixture(autouse=True)
def on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    executable = tmp_path / "lcp"
    executable.write_text(f"#!/bin/sh\nexec {sys.executable} -c '{MAIN}' \"$@\"\n")
    executable.chmod(0o755)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    monkeypatch.setenv("PATH", os.pathsep.join([str(tmp_path), os.environ["PATH"]]))
    return executable


def solved(model: Any, **options: Any) -> str:
    return str(
        pyomo.SolverFactory("asl:lcp")
        .solve(model, options=options)
        .solver.termination_condition
    )


def test_example_of_the_page_is_solved(capfd: pytest.CaptureFixture[str]) -> None:
    exec(EXAMPLE, {})
    printed = capfd.readouterr().out
    assert re.search(r"^lcp .*: solved", printed, re.MULTILINE)
    assert printed.endswith("3.0 7.0\n")


def test_both_bounds_count_beside_a_given_multiplier_and_a_slack_variable() -> None:
    """Three plants at their bounds and between them; one with the multiplier of its
    bound, and one whose condition is that of a slack variable."""
    model = pyomo.ConcreteModel()
    costs = {1: -10, 2: -4, 3: 1}
    model.x = pyomo.Var([1, 2, 3, 4, 5], bounds=(0, 3), initialize=1.0)
    model.mu, model.w = pyomo.Var(within=pyomo.NonNegativeReals), pyomo.Var()
    conditions = [
        *((model.x[k] >= 0, 2 * model.x[k] + cost >= 0) for k, cost in costs.items())
    ]
    conditions += [
        (model.x[4] >= 0, 2 * model.x[4] - 10 + model.mu >= 0),
        (model.mu >= 0, 3 - model.x[4] >= 0),
    ]
    model.slack = pyomo.Constraint(expr=model.w == 2 * model.x[5] - 10)
    conditions.append((model.x[5] >= 0, model.w >= 0))
    model.c = mpec.ComplementarityList(
        rule=(mpec.complements(*each) for each in conditions)
    )
    assert solved(model) == "optimal"
    values = [*(model.x[k].value for k in range(1, 6)), model.mu.value, model.w.value]
    assert values == pytest.approx([3, 2, 0, 3, 3, 4, -4])


def test_objective_chooses_among_solutions() -> None:
    model = pyomo.ConcreteModel()
    model.x, model.y = (pyomo.Var(within=pyomo.NonNegativeReals) for _ in range(2))
    model.c = mpec.Complementarity(
        expr=mpec.complements(model.x >= 0, model.x + 2 * model.y - 2 >= 0)
    )
    model.d = mpec.Complementarity(
        expr=mpec.complements(model.y >= 0, 2 * model.x + model.y - 2 >= 0)
    )
    model.objective = pyomo.Objective(expr=model.x - model.y, sense=pyomo.maximize)
    assert solved(model) == "optimal"
    assert (model.x.value, model.y.value) == pytest.approx((2, 0))


def test_reason_of_a_failure_is_in_the_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    model = pyomo.ConcreteModel()
    model.z = pyomo.Var(initialize=0.5)
    model.row = pyomo.Constraint(expr=1 + model.z**2 == 0)
    assert solved(model) == "maxIterations"
    assert "stationary point of the merit function" in caplog.text


def test_error_in_the_model_is_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    model = pyomo.ConcreteModel()
    model.x = pyomo.Var(bounds=(0, 3), initialize=1.0)
    model.c = mpec.Complementarity(
        expr=mpec.complements(model.x >= 0, 2 * model.x - 10 >= 0)
    )
    model.objective = pyomo.Objective(expr=model.x**2)
    with pytest.raises(Exception, match="did not exit normally"):
        solved(model)
    assert "has an objective that is not linear; write a linear one" in caplog.text


def test_lcp_stands_in_the_place_of_path(on_the_path: Path) -> None:
    model = pyomo.ConcreteModel()
    model.p, model.s = pyomo.Var(initialize=1.0), pyomo.Var(initialize=1.0)
    model.supply = pyomo.Constraint(expr=model.s == model.p + model.p**2 / 4)
    model.clears = mpec.Complementarity(
        expr=mpec.complements(model.p >= 0, model.s - 9 / (1 + model.p) >= 0)
    )
    solver = pyomo.SolverFactory("path", executable=str(on_the_path))
    assert solver.available()
    assert (
        str(solver.solve(model, options={"tol": 1e-9}).solver.termination_condition)
        == "optimal"
    )
    assert model.p.value == pytest.approx(2, rel=1e-8)
