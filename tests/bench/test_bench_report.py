"""How long a bench repeats a measurement, the statistics of the times, and what it
looks like in each format."""

import math
import re
from dataclasses import replace
from itertools import chain, cycle, repeat
from types import SimpleNamespace

import pytest

from lcpcli.bench import record as records
from lcpcli.bench import report as figure
from lcpcli.bench.record import (
    EXCLUDED,
    BenchRecord,
    median_interval,
    performance_ratios,
)
from lcpcli.bench.report import render
from lcpcli.bench.suites import SUITES, Grid, Kind, Suite, case
from lcpcli.bench.timing import (
    CURVES,
    MAX_REPEATS,
    MIN_REPEATS,
    WARM_UP,
    is_stable,
    measure,
)
from lcpcli.peers.registry import Claim
from lcpcli.report import plotting
from lcpcli.report.document import FORMATS

from ..documents import assert_as_before
from .bench_problems import MACHINE, SETTINGS, measurement

SECONDS = {
    ("auto", 100): [0.010, 0.011, 0.012, 0.013, 0.014],
    ("auto", 200): [0.020],
    ("auto", 400): [0.0401, 0.0402, 0.0403],
    ("lemke", 100): [0.5],
    ("lemke", 200): [2.0, 2.1, 1.9],
    ("lemke", 400): [8.0],
}


def row(solver, n, **changes):
    plain = {
        "family": "harker-pang",
        "seed": 0,
        "parameters": {"symmetric": False},
    }
    plain |= {
        "residual": 1.25e-11,
        "scaled_residual": 2.5e-12,
        "iterations": n // 10,
        "evaluations": n,
    }
    plain |= {"seconds": SECONDS.get((solver, n), [1.0]), "setup_seconds": 0.001}
    plain |= {"curve_of": "residual", "curve": [(0, 0.001, 1.0), (1, 0.01, 1e-11)]}
    return measurement(f"harker-pang {n}", solver, n, **plain | changes)


@pytest.fixture
def record():
    """Three sizes of one family by two methods and two peers, of which one lies once,
    and one takes nothing."""
    failed = {
        "status": "time_limit",
        "statement": "stopped | at_the 5% limit",
        "claimed": False,
        "success": False,
    }
    peer = {
        "kind": "peer",
        "status": "solved",
        "claimed": True,
        "iterations": None,
        "curve": None,
        "curve_of": None,
        "setup_seconds": None,
    }
    rows = []
    for n in (100, 200, 400):
        rows += [row("auto", n), row("lemke", n, **(failed if n == 400 else {}))]
        rows.append(row("liar", n, success=n != 200, false_success=n == 200, **peer))
        rows.append(
            row(
                "picky",
                n,
                **peer
                | {**failed, "status": EXCLUDED, "statement": "no", "seconds": []},
            )
        )
    cases = [case("harker-pang", n) for n in (100, 200, 400)]
    solvers = ["auto", "lemke"], ["liar", "picky"], ["absent"]
    return BenchRecord(
        ["dense"], cases, *solvers, SETTINGS, MACHINE, {"numpy": "2.0"}, rows
    )


def larger(record):
    """With a fourth size, at which one peer is the fastest and the other one takes its
    only problem."""
    rows = [row("auto", 800, seconds=[0.08, 0.081, 0.082]), row("lemke", 800)]
    rows += [
        row("liar", 800, seconds=[0.05]),
        row("picky", 800, seconds=[4.0], kind="peer"),
    ]
    return replace(
        record,
        cases=[*record.cases, case("harker-pang", 800)],
        measurements=[*record.measurements, *rows],
    )


RECORDS = {
    "whole": (lambda record: record, "table csv"),
    "larger": (larger, "table"),
    "hard": (lambda record: replace(record, suite=["hard", "dense"]), "table"),
    "unfinished": (
        lambda record: replace(record, measurements=record.measurements[:5]),
        "table",
    ),
}


def abridged(text, whole):
    """A text, with the title alone of each part that another one shows."""
    known, parts = (each.rstrip().split("\n\n") for each in (whole, text))
    shown = (part.partition("\n")[0] if part in known else part for part in parts)
    return "\n\n".join(shown) + "\n"


@pytest.mark.parametrize("name", RECORDS)
def test_a_bench_prints_what_the_document_shows(name, record):
    change, forms = RECORDS[name]
    whole = render(record, "table", None, False) if name != "whole" else ""
    text = (
        f"--format {form}\n{abridged(render(change(record), form, None, False), whole)}"
        for form in forms.split()
    )
    assert_as_before(f"bench/{name}", "\n".join(text))


def test_kinds_of_a_suite_have_rows_of_what_is_right_false_and_slower(
    record, monkeypatch
):
    """On one kind lemke is 20 and 100 times slower; on the other a peer lies."""
    rows = [
        measurement("harker-pang 10", "auto", seconds=[0.1]),
        measurement("harker-pang 10", "lemke", seconds=[2.0]),
        measurement("harker-pang 20", "auto", seconds=[0.1]),
        measurement("harker-pang 20", "lemke", seconds=[10.0]),
        measurement("ray 4", "auto", seconds=[0.1]),
        measurement("ray 4", "lemke", success=False, false_success=True, seconds=[1.0]),
    ]
    kinds = Kind("dense", Grid("harker-pang", 10, 20)), Kind("rays", Grid("ray", 4))
    monkeypatch.setitem(SUITES, "two kinds", Suite("made up", kinds))
    two = replace(
        record,
        suite=["two kinds"],
        cases=SUITES["two kinds"].cases,
        methods=["auto", "lemke"],
        peers=[],
        measurements=rows,
    )
    shown = render(two, "table", 80, False)
    _, _, table = shown.partition("By kind of problem")
    cells = [re.split("  +", line) for line in table.splitlines()[3:5]]
    assert cells == [
        ["dense", "2/2, 1", "2/2, 44.7"],  # the square root of 20 x 100
        ["rays", "1/1, 1", "0/1, 1 false"],
    ]


def test_an_empty_record_can_be_shown(record):
    record.measurements = []
    for form in FORMATS:
        assert render(record, form, None, False)


def test_json_is_the_record(record):
    assert records.parse(render(record, "json", None, False)) == record


@pytest.mark.parametrize("width", [None, 40, 80, 100])
def test_lines_are_no_wider_than_asked_for(record, width):
    text = render(record, "table", width, False)
    assert max(len(line) for line in text.splitlines()) <= (width or 80)
    assert "\x1b[" not in text
    assert "\x1b[" in render(record, "table", width, True)  # colours
    narrow = [line.split() for line in text.splitlines()]
    heads = [
        cells
        for cells in narrow
        if cells[:2] in (["problem", "auto"], ["problem", "picky"])
    ]
    # That repeat the problems.
    in_parts = [["problem", "auto", "lemke", "liar"], ["problem", "picky"]]
    assert (heads == in_parts) == (width == 40)
    assert (["harker-pang", "100", "-"] in narrow) == (width == 40)


def test_peer_is_a_point_in_the_picture_and_nothing_is_drawn_of_what_is_excluded(
    record, monkeypatch
):
    pictures = []

    def noted(*given):
        pictures.append(plotting.Picture(*given))
        return SimpleNamespace(content=lambda _: b"")

    monkeypatch.setattr(figure, "Picture", noted)
    figure.figure(record).content("png")
    _, (panel,) = pictures[0].data
    assert panel.title == "harker-pang 400"
    curves = {curve.name: curve for curve in panel.curves}
    assert list(curves) == ["auto", "lemke", "liar"]
    assert list(curves["auto"].k) == [0, 1]
    assert curves["liar"].k == (None,)
    assert curves["liar"].seconds == (1.0,)
    assert curves["liar"].errors == (1.25e-11,)
    assert [curve.solved for curve in panel.curves] == [True, False, True]


class Machine:
    """A solver, a clock and a sleep on one time line; each run takes the next of the
    given seconds."""

    def __init__(self, seconds, claim=True, curve=True):
        self.now, self.rested, self.curves = 0.0, 0.0, []
        self._seconds, self._claim, self._curve = seconds, claim, curve

    def solve(self, with_curve):
        taken = next(self._seconds)
        self.now += taken
        self.curves.append(with_curve)
        curve = [(0, taken, 1.0)] if with_curve and self._curve else None
        return Claim(None, self._claim, taken, "", None, taken / 2, curve=curve)

    def sleep(self, seconds):
        self.now += seconds
        self.rested += seconds

    def measure(self, budget, rest=0.0):
        return measure(self.solve, budget, rest, lambda: self.now, self.sleep)


def wild():
    return cycle((0.001, 0.003))


WARMED = [True, *[False] * MIN_REPEATS]
RUNS = {
    # by what is measured: the budget, the times, and whether each run recorded a curve
    "steady times": (
        Machine(chain([5.0], repeat(0.01))),
        1.0,
        [0.01] * MIN_REPEATS,
        [*WARMED, *[True] * CURVES],
    ),
    "a run longer than the budget": (
        Machine(chain([5.0], repeat(2.0))),
        1.0,
        [2.0],
        [True, False],
    ),
    "a failure": (Machine(repeat(0.001), claim=False), 1.0, [0.001], [True]),
    "a solver without a curve": (
        Machine(repeat(1.0), curve=False),
        10.0,
        [1.0] * MIN_REPEATS,
        WARMED,
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_runs_are_as_many_as_times_and_curve_need(name):
    machine, budget, expected, curves = RUNS[name]
    answer, times = machine.measure(budget)
    assert times == expected
    assert machine.curves == curves
    assert answer.setup_seconds == times[0] / 2
    assert (
        answer.curve is None
        if "without" in name
        else answer.curve == [(0, times[0], 1.0)]
    )


def test_unsettled_times_end_at_the_most_repeats_or_the_budget_with_rests():
    assert len(Machine(wild()).measure(budget=10.0)[1]) == MAX_REPEATS
    _, times = Machine(wild()).measure(budget=0.0085)
    assert len(times) == 5  # 3 + 1 + 3 + 1 ms have passed before the fifth
    machine = Machine(wild())
    _, times = machine.measure(budget=0.1, rest=0.06)
    assert len(times) == MIN_REPEATS
    assert machine.rested == pytest.approx(0.06 * (1 + MIN_REPEATS + CURVES))


def test_brief_runs_are_warmed_up_before_they_count():
    machine = Machine(repeat(0.0005), curve=False)
    _, times = machine.measure(budget=1.0)
    assert len(machine.curves) == 1 + round(WARM_UP / 0.0005) + len(times)


@pytest.mark.parametrize(
    ("times", "stable"),
    [
        ([0.96, 1.0, 1.04], True),
        ([0.94, 1.0, 1.06], False),
        # Outliers do not matter to the median of enough repeats.
        ([0.1, *[1.0] * 9, 9.0], True),
        ([0.1, 0.1, 1.0, 9.0, 9.0], False),
    ],
)
def test_median_is_stable_where_its_interval_is_narrow(times, stable):
    assert is_stable(times) is stable


@pytest.mark.parametrize(
    ("n", "ranks"),
    # The largest rank with P(Bin(n, 1/2) < rank) <= 0.025, as tables of the sign test
    # have it.
    [
        (1, (1, 1)),
        (5, (1, 5)),
        (8, (1, 8)),
        (9, (2, 8)),
        (12, (3, 10)),
        (25, (8, 18)),
    ],
)
def test_interval_of_the_median_has_the_ranks_of_the_sign_test(n, ranks):
    assert median_interval([float(i) for i in range(n, 0, -1)]) == ranks


def test_performance_ratios_by_hand():
    times = {
        "a": {"one": 1.0, "two": 4.0, "three": math.inf},
        "b": {"one": 2.0, "two": 2.0, "three": math.inf},
        "c": {"two": 3.0},
    }
    assert performance_ratios(times) == {
        "a": [1.0, 2.0, math.inf],
        "b": [1.0, 2.0, math.inf],
        "c": [1.5],
    }
