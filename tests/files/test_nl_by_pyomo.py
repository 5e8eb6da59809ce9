"""Models that Pyomo writes, and their answers by evaluators that are not the reader's: Pyomo's own expressions, and
CasADi, which reads the same file."""

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
    m.v, m.w, m.fixed = (
        pyomo.Var(bounds=(None, 2), initialize=1.0),
        pyomo.Var(initialize=1.0),
        pyomo.Var(initialize=3.0),
    )
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


def gap(value: float, bounds: tuple[float | None, float | None], z: float) -> float:
    """The natural residual of a row."""
    low, high = (end if each is None else each for each, end in zip(bounds, (-np.inf, np.inf), strict=True))
    return abs(z - min(max(z - value, low), high))


def by_pyomo(m: Any, _: Path) -> float:
    gaps = [gap(pyomo.value(row), own.bounds, own.value) for row, own in m.pairs]
    equations = [
        each for each in m.component_data_objects(pyomo.Constraint) if each.equality and each.local_name == "equation"
    ]
    return max(*gaps, *(abs(pyomo.value(each.body) - pyomo.value(each.upper)) for each in equations), 0.0)


def by_casadi(m: Any, file: Path) -> float:
    casadi = pytest.importorskip("casadi", reason="needs CasADi")
    lines, partners = [line.split("#")[0].strip() for line in file.read_text().splitlines()], dict[int, int]()
    begin = next(i for i, line in enumerate(lines) if line == "r") + 1
    for row in range(int(lines[1].split()[1])):
        kind, *numbers = lines[begin + row].split()
        if kind == "5":  # which CasADi does not read
            partners[row] = int(numbers[1]) - 1
            lines[begin + row] = "3"
    file.write_text("\n".join(lines) + "\n")
    builder = casadi.NlpBuilder()
    builder.import_nl(str(file), {"verbose": False})
    F = casadi.Function("F", [casadi.vertcat(*builder.x)], [casadi.vertcat(*builder.g)])
    names = file.with_suffix(".col").read_text().split()
    z = [m.find_component(name).value for name in names]
    values, bounds = np.array(F(z)).ravel(), [*zip(builder.x_lb, builder.x_ub, strict=True)]
    gaps = [gap(values[row], bounds[j], z[j]) for row, j in partners.items()]
    others = [i for i in range(values.size) if i not in partners]
    return max(*gaps, *(abs(values[i] - builder.g_lb[i]) for i in others), 0.0)


@pytest.mark.parametrize("evaluator", [by_pyomo, by_casadi])
@pytest.mark.parametrize("make", [kojima_shindo, nash_cournot, of_all_kinds])
def test_residual_is_small_by_other_evaluators(make: Any, evaluator: Any, tmp_path: Path) -> None:
    m = make()
    file = written(m, tmp_path)
    result = lcpcli.solve_mcp(lcpcli.read_nl(file), tol=1e-12)
    assert result.solved, result.message
    for name in result.names:
        m.find_component(name).set_value(result[name])
    assert evaluator(m, file) <= 1e-8
    own = m.pairs[0][1]
    own.set_value(own.value + 0.01)
    assert evaluator(m, file) > 1e-4, "the evaluator sees nothing"
