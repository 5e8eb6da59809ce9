"""Families with a parameter that moves q or bounds alone, so that a path goes from one member to another."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lcpcli import Status, run
from lcpcli.gallery import families as gallery
from lcpcli.gallery import programs
from lcpcli.parametric.following import path

from .matrix_classes import dense

MOVES = [
    ("frontier", 12, {"target": (0.0, 0.08)}),
    ("frontier", 12, {"weight": (0.0, 64.0)}),
    ("frontier", 12, {"most": (0.2, 0.5)}),
    ("lasso", 12, {"penalty": (1.0, 0.0)}),
    ("two-obstacles", 25, {"load": (0.0, 4.0)}),
    ("two-obstacles", 25, {"gap": (0.3, 0.1)}),
    ("torsion", 25, {"angle": (0.0, 8.0)}),
    ("american-put", 25, {"strike": (1.0, 1.2)}),
    ("spatial-prices", 24, {"tax": (0.0, 18.0)}),
    ("spatial-prices", 24, {"capacity": (1.0, 3.0)}),
    ("all-cones", 5, {"t": (-1.0, 31.0)}),
]


@pytest.mark.parametrize(("family", "n", "moved"), MOVES)
def test_the_parameter_leaves_m_as_it_is_and_a_verified_path_goes_from_one_value_to_the_other(
    family: str, n: int, moved: dict[str, tuple[float, float]]
) -> None:
    values: list[dict[str, Any]] = [{name: ends[k] for name, ends in moved.items()} for k in (0, 1)]
    first, last = (gallery.make(family, n, **given) for given in values)
    assert np.array_equal(dense(first), dense(last))
    moves_bounds = set(moved) & {"most", "gap", "capacity"}
    assert np.array_equal(first.q, last.q) == bool(moves_bounds)
    assert np.array_equal(first.upper, last.upper) != bool(moves_bounds)
    found = path(first, last)
    assert (found.end, found.verified) == ("reached", True)


def test_the_line_of_murty_crosses_all_cones_at_whole_numbers() -> None:
    first, last = (gallery.make("all-cones", 8, t=t) for t in (-1.0, 255.0))
    found = path(first, last, start=-1, stop=255)
    assert found.t.tolist() == list(range(-1, 256))
    assert len({tuple(piece) for piece in found.states.tolist()}) == 2**8


def test_the_frontier_has_the_return_of_its_target_or_more_where_less_risk_has_more() -> None:
    problem = gallery.make("frontier", 22, 3)
    returns = problem.M[-1, :20]
    least, best = float(returns @ run(problem).z[:20]), float(np.sort(returns)[-5:].mean())
    for target in (0.0, 0.9 * least, 1.1 * least, best - 1e-6):
        z = run(gallery.make("frontier", 22, 3, target=target)).z
        assert z[:20].sum() == pytest.approx(1)
        assert returns @ z[:20] == pytest.approx(max(least, target))
        # a target is met with the multiplier of its row as the weight
        other = run(gallery.make("frontier", 22, 3, weight=float(z[-1]))).z
        assert other[:20] == pytest.approx(z[:20], abs=1e-9)
    assert run(gallery.make("frontier", 22, 3, target=best + 1e-6)).status is Status.INFEASIBLE


def test_the_lasso_satisfies_its_optimality_conditions_in_the_features() -> None:
    X, y = programs.regression(30, 1, 12)
    for penalty, least in ((1.0, 0), (0.999, 1), (0.2, 1), (0.0, 1)):
        result = run(gallery.make("lasso", 60, 1, penalty=penalty, samples=12))
        b = result.z[:30] - result.z[30:]
        slopes, level = X.T @ (y - X @ b), penalty * abs(X.T @ y).max()
        assert np.abs(slopes).max() <= level * (1 + 1e-12) + 1e-12
        assert slopes[b != 0] == pytest.approx(level * np.sign(b[b != 0]), abs=1e-12)
        assert least <= np.count_nonzero(b) <= 12 * least
        assert result.answer.objective == pytest.approx(((y - X @ b) ** 2).sum() / 2 + level * abs(b).sum())


def test_a_tax_ends_trade_and_leaves_the_prices_without_it() -> None:
    names = gallery.make("spatial-prices", 24).names
    flows = [i for i, name in enumerate(names) if name.startswith("flow")]
    volumes = [run(gallery.make("spatial-prices", 24, tax=tax)).z[flows].sum() for tax in (0.0, 2.0, 6.0, 18.0)]
    assert volumes == sorted(volumes, reverse=True)
    assert volumes[0] > 0
    assert volumes[-1] == 0


def test_contact_grows_with_the_load() -> None:
    solutions = [run(gallery.make("two-obstacles", 225, load=load)).z for load in (0.0, 0.1, 1.0, 4.0)]
    touched = [np.count_nonzero(abs(z) == 0.15) for z in solutions]
    assert touched[:2] == [0, 0]
    assert 0 < touched[2] < touched[3]


def test_the_price_below_which_a_put_is_exercised_grows_with_its_strike() -> None:
    """In proportion, up to the grid: the put's value is homogeneous in both."""
    x = np.linspace(-2, 2, 801)[1:-1]
    values = {strike: run(gallery.make("american-put", 799, strike=strike)).z for strike in (1.0, 1.25)}
    one, other = (np.exp(x[np.flatnonzero(z > 0)[0]]) / strike for strike, z in values.items())
    assert other == pytest.approx(one, rel=0.01)
