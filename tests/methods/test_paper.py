"""The tables of El foutayeni and Khaladi (2012): what comes out to the last printed digit, and what does not; their
smoothed modulus and equation, which are what the formulas say wherever doubles reach; and the merit function of Fischer
and Burmeister with its smoothed form.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import contents
from lcpcli.methods.smoothing import Smoothed, excess, phi, slope, slopes
from lcpcli.model.box import Box

TABLE_1 = {
    1: "0.0000000 0.0000000 0.0000000 0.0000000",
    5: "0.7883251 0.0000000 1.3448593 0.0000000",
    10: "1.0197946 0.0000000 0.9884737 0.0000000",
    15: "0.9985643 0.0000000 1.0012907 0.0000000",
    20: "1.0001030 0.0000000 0.9999377 0.0000000",
    25: "0.9999918 0.0000000 1.0000058 0.0000000",
    30: "1.0000005 0.0000000 0.9999997 0.0000000",
    33: "0.9999999 0.0000000 1.0000001 0.0000000",
    34: "1.0000001 0.0000000 1.0000000 0.0000000",
    35: "1.0000000 0.0000000 1.0000000 0.0000000",
}
TABLE_2 = {
    1: "0.0000000 0.0000000 0.0000000 0.0000000",
    5: "0.1115059 0.6300237 0.3146258 0.0000000",
    10: "0.0000000 0.4906849 0.6581657 0.0000000",
    15: "0.0000000 0.5309163 0.5863067 0.0000000",
    20: "0.0000000 0.5192743 0.5936312 0.0000000",
    25: "0.0000000 0.5188339 0.5869623 0.0000000",
    30: "0.0000000 0.5173795 0.5862876 0.0000000",
    35: "0.0000000 0.5171712 0.5859293 0.0000000",
    40: "0.0000000 0.5171411 0.5860432 0.0000000",
    45: "0.0000000 0.5171911 0.5861363 0.0000000",
    50: "0.0000000 0.5172239 0.5861902 0.0000000",
    55: "0.0000000 0.5172388 0.5862079 0.0000000",
    60: "0.0000000 0.5172428 0.5862107 0.0000000",
    65: "0.0000000 0.5172428 0.5862093 0.0000000",  # printed 0,5860930: digits transposed
    70: "0.0000000 0.5172421 0.5862079 0.0000000",
    75: "0.0000000 0.5172416 0.5862071 0.0000000",
    79: "0.0000000 0.5172414 0.5862069 0.0000000",  # printed 0,5172424
}


def rows_of(lcp: Callable[..., Any], number: int, method: str, *start: str) -> dict[int, str]:
    """The rows of the trace with as many digits as are printed."""
    example = contents.shipped_path(f"paper-example-{number}.json")
    outcome = lcp("solve", example, f"--method={method}", "--format=json", "--trace", *start)
    return {row["k"]: " ".join(f"{z:.7f}" for z in row["z"]) for row in json.loads(outcome.out)["trace"]}


@pytest.mark.parametrize(("number", "printed"), [(1, TABLE_1), (2, TABLE_2)])
def test_fixed_point_rows_are_the_printed_ones(number: int, printed: dict[int, str], lcp: Callable[..., Any]) -> None:
    rows = rows_of(lcp, number, "fixed-point")
    assert {k: rows[k] for k in printed} == printed


def test_printed_start_of_example_1_does_not_give_its_table(lcp: Callable[..., Any]) -> None:
    rows = rows_of(lcp, 1, "fixed-point", "--x0", "1.1,0.1,1.2,0.2")
    assert rows[5] == "0.9336092 0.0000000 0.9309409 0.0000000"
    assert rows[5] != TABLE_1[5]


def exact_modulus(p: float, x: float) -> tuple[Decimal, Decimal]:
    """phi and phi' to 400 digits, so that phi + x and phi - x have 60 and more."""
    with localcontext() as context:
        context.prec, context.Emax, context.Emin = 400, 10**9, -(10**9)
        up, down = (Decimal(p) * Decimal(x)).exp(), (-Decimal(p) * Decimal(x)).exp()
        return (1 + up + down).ln() / Decimal(p), (up - down) / (1 + up + down)


def computed_split(p: float, x: float) -> tuple[float, float]:
    """z~ and w~ at one x."""
    z, w, _ = Smoothed(Problem([[1.0]], [0.0]), p).split(np.array([x]))
    return float(z[0]), float(w[0])


@pytest.mark.parametrize("p", [2.0**-10, 1.0, 8.0, 2.0**40, 2.0**996])  # so that p x is exact
def test_phi_and_its_slope_agree_with_60_digits_and_neither_smoothed_z_nor_w_cancels(p: float) -> None:
    for x in np.array([0.0, 1e-9, 1e-3, 0.5, -0.5, 3.0, -30.0, 300.0, -700.0, 700.0]) / p:
        phi, steepness = exact_modulus(p, float(x))
        assert abs(x) + excess(p, np.array([abs(x)]))[0] == pytest.approx(float(phi), rel=1e-15)
        assert slope(p, np.array([x]))[0] == pytest.approx(float(steepness), rel=4e-16, abs=0)
        with localcontext() as context:
            context.prec = 400
            split = float(phi + Decimal(float(x))), float(phi - Decimal(float(x)))
        assert computed_split(p, float(x)) == pytest.approx(split, rel=1e-14, abs=0)


def exact_half_square(M: list[list[int]], q: list[int], p: float, x: list[Decimal]) -> Decimal:
    """f = |F~|^2 / 2 in decimal arithmetic of the surrounding context."""
    P = Decimal(p)
    phi = [(1 + (P * t).exp() + (-P * t).exp()).ln() / P for t in x]
    z, w = [a + b for a, b in zip(phi, x, strict=True)], [a - b for a, b in zip(phi, x, strict=True)]
    F = [sum((m * zj for m, zj in zip(row, z, strict=True)), -wi + qi) for row, wi, qi in zip(M, w, q, strict=True)]
    return sum((Fi * Fi for Fi in F), Decimal(0)) / 2


@pytest.mark.parametrize("p", [0.1, 1.0, 50.0, 1e4])
def test_gradient_agrees_with_differences_in_high_precision(p: float) -> None:
    M, q = [[8, -1, 0, -5], [1, 5, -1, 0], [2, -1, 6, -1], [6, 0, -1, 7]], [1, -2, -3, 4]
    x = [0.25, -1e-3, 2e-5, -0.75]
    smoothed = Smoothed(Problem(M, q), p)
    gradient = smoothed.gradient(smoothed.at(np.array(x)))
    with localcontext() as context:
        context.prec, context.Emax, context.Emin = 80, 10**9, -(10**9)
        h = Decimal("1e-25")
        for i in range(4):
            ahead, behind = ([Decimal(t) + (sign * h if j == i else 0) for j, t in enumerate(x)] for sign in (1, -1))
            difference = (exact_half_square(M, q, p, ahead) - exact_half_square(M, q, p, behind)) / (2 * h)
            assert gradient[i] == pytest.approx(float(difference), rel=1e-12)


BOX = Box(np.array([0.0, -np.inf, 1.0, -np.inf, 2.0]), np.array([np.inf, 3.0, 4.0, np.inf, 2.0]))


@pytest.mark.parametrize("mu", [0.0, 1e-3, 1.0])
def test_slopes_are_the_derivatives(mu: float) -> None:
    random = np.random.default_rng(0)
    J, z, F, step = random.normal(size=(5, 5)), np.array([0.3, 2.5, 1.7, -1.0, 2.0]), random.normal(size=5), 1e-6
    G = slopes(BOX, z, F, J, mu)
    for j in range(4):  # the last variable is fixed
        ends = [phi(BOX, z + t * np.eye(5)[j], F + t * J[:, j], mu) for t in (step, -step)]
        assert np.abs((ends[0] - ends[1]) / (2 * step) - G[:, j]).max() <= 1e-6


def test_zeros_are_the_solutions_and_smoothed_ones_tend_to_them() -> None:
    z, F = np.array([0.0, 3.0, 1.5, -7.0, 2.0]), np.array([2.0, -1.0, 0.0, 0.0, 5.0])
    assert not phi(BOX, z, F).any()
    sizes = [np.abs(phi(BOX, z, F, mu)).max() for mu in (1e-2, 1e-4, 1e-6)]
    assert sizes[0] > sizes[1] > sizes[2] > 0
    assert sizes[2] <= 1e-5


@pytest.mark.parametrize("start", [(), ("--x0", "1.1,0.1,1.2,0.2")])
def test_the_printed_vector_divisions_do_not_come_out(start: tuple[str, ...], lcp: Callable[..., Any]) -> None:
    """The printed table is at the solution of example 1 after 3 iterations, from z = (4, 0, 4, 0)."""
    rows = rows_of(lcp, 1, "shi", *start)
    assert max(rows) > 3
    assert all(np.abs(np.array(row.split(), dtype=float) - [4, 0, 4, 0]).max() > 0.1 for row in rows.values())
