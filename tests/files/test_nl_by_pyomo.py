"""Models that Pyomo writes, and their answers by an evaluator that is not the reader's: Pyomo's own expressions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli

pyomo = pytest.importorskip("pyomo.environ", reason="needs Pyomo")
mpec = pytest.importorskip("pyomo.mpec")


def kojima_shindo() -> Any:
    m = pyomo.ConcreteModel()
    m.z = pyomo.Var(range(4), bounds=(0, None), initialize=1.0)
    a, b, c, d = (m.z[i] for i in range(4))
    rows = [
        3 * a**2 + 2 * a * b + 2 * b**2 + c + 3 * d - 6,
        2 * a**2 + a + b**2 + 10 * c + 2 * d - 2,
        3 * a**2 + a * b + 2 * b**2 + 2 * c + 9 * d - 9,
        a**2 + 3 * b**2 + 2 * c + 3 * d - 3,
    ]
    return with_pairs(m, [(row, m.z[i]) for i, row in enumerate(rows)])


def nash_cournot() -> Any:
    m, costs, powers = pyomo.ConcreteModel(), (10, 8, 6, 4, 2), (1.2, 1.1, 1.0, 0.9, 0.8)
    m.q = pyomo.Var(range(5), bounds=(0, None), initialize=10.0)
    m.total = pyomo.Expression(expr=sum(m.q[i] for i in range(5)))
    price = (5000 / m.total) ** (1 / 1.1)
    rows = [costs[i] + (m.q[i] / 5) ** (1 / powers[i]) - price * (1 - m.q[i] / (1.1 * m.total)) for i in range(5)]
    return with_pairs(m, [(row, m.q[i]) for i, row in enumerate(rows)])


def of_all_kinds() -> Any:
    """An equation, a variable with a lower bound, one with an upper bound, and a fixed one; many operators."""
    m = pyomo.ConcreteModel()
    m.u = pyomo.Var(bounds=(0, None), initialize=1.0)
    m.v, m.w = pyomo.Var(bounds=(None, 2), initialize=1.0), pyomo.Var(initialize=1.0)
    m.fixed = pyomo.Var(initialize=3.0)
    m.fixed.fix()
    m.named = pyomo.Expression(expr=pyomo.exp(m.u / 4) + pyomo.atan(m.w))
    m.equation = pyomo.Constraint(expr=m.w**3 + pyomo.tanh(m.w) + m.w * m.fixed == m.named + pyomo.sin(m.v))
    of_u = m.named + pyomo.log(2 + m.u) + abs(m.v - 1) + pyomo.sqrt(4 + m.u) - 9
    of_v = m.v + pyomo.cos(m.u) / 2 - pyomo.log10(10 + m.w**2) - 3
    return with_pairs(m, [(of_u, m.u), (of_v, m.v)])


def with_pairs(m: Any, pairs: list[tuple[Any, Any]]) -> Any:
    """The model in which each row complements its variable, with the bounds of this one."""
    m.pairs, m.conditions = pairs, mpec.ComplementarityList()
    for row, own in pairs:
        is_lower = own.lb is not None
        m.conditions.add(
            mpec.complements(own >= own.lb if is_lower else own <= own.ub, row >= 0 if is_lower else row <= 0)
        )
    return m


def written(m: Any, folder: Path) -> Path:
    pyomo.TransformationFactory("mpec.nl").apply_to(m)
    m.write(str(folder / "model.nl"), format="nl", io_options={"symbolic_solver_labels": True})
    return folder / "model.nl"


def residual(m: Any) -> float:
    """The largest gap of a row, and of an equation."""
    gaps = []
    for row, own in m.pairs:
        low, high = (end if each is None else each for each, end in zip(own.bounds, (-np.inf, np.inf), strict=True))
        gaps.append(abs(own.value - min(max(own.value - pyomo.value(row), low), high)))
    equations = [
        each for each in m.component_data_objects(pyomo.Constraint) if each.equality and each.local_name == "equation"
    ]
    return max(*gaps, *(abs(pyomo.value(each.body) - pyomo.value(each.upper)) for each in equations), 0.0)


@pytest.mark.parametrize("make", [kojima_shindo, nash_cournot, of_all_kinds])
def test_residual_is_small_by_the_expressions_of_pyomo(make: Any, tmp_path: Path) -> None:
    m = make()
    file = written(m, tmp_path)
    result = lcpcli.solve_mcp(lcpcli.read_nl(file), tol=1e-12)
    assert result.solved, result.message
    for name in result.names:
        m.find_component(name).set_value(result[name])
    assert residual(m) <= 1e-8
    own = m.pairs[0][1]
    own.set_value(own.value + 0.01)
    assert residual(m) > 1e-4
