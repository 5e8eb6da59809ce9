"""The tables of El foutayeni and Khaladi (2012): what comes out to the last printed digit, and what does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from lcpcli.files import contents

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


@pytest.mark.parametrize("start", [(), ("--x0", "1.1,0.1,1.2,0.2")])
def test_vector_division_rows_do_not_come_out_of_the_printed_algorithm(
    start: tuple[str, ...], lcp: Callable[..., Any]
) -> None:
    """The printed table reaches the solution of example 1 in 3 iterations, from (4, 0, 4, 0)."""
    rows = rows_of(lcp, 1, "shi", *start)
    assert max(rows) > 3
    for row in rows.values():
        assert max(abs(float(z) - z_printed) for z, z_printed in zip(row.split(), (4, 0, 4, 0), strict=True)) > 0.1
