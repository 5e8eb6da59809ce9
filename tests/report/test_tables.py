"""What people and programs get: every kind of answer in every format of text, tables,
columns, widths and colours."""

import re
from dataclasses import replace

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Status, Trace, read
from lcpcli.cli import terminal as cli_terminal
from lcpcli.files import contents
from lcpcli.formulations.quadratic_program import answers
from lcpcli.report import outcome, tables, wording
from lcpcli.report.result_formats import Layout, ProblemRow
from lcpcli.solving.driver import run
from lcpcli.solving.result import Exact

EXAMPLE = contents.shipped_path("paper-example-1.json")
TRIDIAGONAL = contents.shipped_path("tridiagonal-100.json")
ESCAPE = "\x1b["


def test_long_z_fits_the_terminal_and_is_whole_in_files(lcp, terminal, tmp_path):
    terminal(60, False)
    head, _ = lcp(f"solve {TRIDIAGONAL}").out.split("\n\n")
    (line,) = (line for line in head.splitlines() if line.startswith("z = "))
    assert line.endswith(", ..., 0)")
    assert 50 < len(line) <= 60
    assert "see all 100 components of z with --format csv" in head
    assert "all 5 components of z" not in lcp("solve bimatrix").out
    file = tmp_path / "result.txt"
    lcp(f"solve {TRIDIAGONAL} -o {file}")
    (whole,) = re.findall(
        r"^z = \((.*?)\)$", file.read_text(), flags=re.MULTILINE | re.DOTALL
    )
    assert [float(cell) for cell in whole.split(",")] == [1.0, 0.0] * 50


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (None, "0.3333333"),
        (0.4, "0.3"),
        (2.0, "0"),
        (1e-12, "0.3333333"),
    ],
)
def test_z_is_rounded_to_what_is_known(error, shown):
    solutions = () if error is None else ([1 / 3 + error],)
    result = run(Problem([[3.0]], [-1.0], solutions=solutions), "newton")
    assert outcome.facts(result, 80, False)[-1] == f"z = ({shown})"


def test_the_shortest_time_to_each_level_has_a_star_if_there_are_several():
    results = [
        run(read(EXAMPLE), method, curve=Trace(levels=wording.LEVELS))
        for method in ("newton", "shi")
    ]
    made = tables.summary_of_costs(results, None)
    assert [sum(row[j].startswith("*") for row in made.rows) for j in (2, 4, 6, 8)] == [
        1
    ] * 4
    assert "*" not in str(tables.summary_of_costs(results[:1], None))


def test_no_colour_is_lost_on_a_light_or_a_dark_ground(lcp, terminal):
    """Only red, green and magenta, which stand out on both; yellow, white, black and
    the bright ones do not."""
    terminal(80, False)
    assert ESCAPE not in lcp(f"solve {EXAMPLE}").out
    terminal(80, True)
    runs = [
        lcp(f"solve {EXAMPLE}"),
        lcp(f"solve {EXAMPLE} --max-iterations 1"),
        lcp(f"compare {EXAMPLE}"),
    ]
    used = {
        code
        for run in runs
        for codes in re.findall(r"\x1b\[([\d;]*)m", run.out)
        for code in codes.split(";")
    }
    assert used <= {"0", "1", "31", "32", "35"}
    assert {"1", "31", "32", "35"} <= used


def test_disturbed_times_are_said_to_be_over_the_least_of_their_ratios():
    result = run(Problem([[3.0]], [-1.0]), "newton")
    runs = [
        replace(result, spread=ratio, label=str(ratio)) for ratio in (1.5, 4.0, 2.5)
    ]
    warning = outcome.spread(runs)
    assert warning.startswith(
        "times of 4.0 and 2.5 vary by more than 2.5x between repeats"
    )


def test_a_printed_bound_is_rounded_upwards():
    assert [wording.above(v) for v in (0.0, 9.91e-10, 1.25, 3.0)] == [
        "0",
        "1.0e-09",
        "1.3e+00",
        "3.0e+00",
    ]


def test_long_runs_are_thinned_unless_every_is_given(lcp):
    long = "solve bimatrix --method shi --max-iterations 100 --k-star 10"
    assert 30 < len(lcp(long).out.splitlines()) < 75
    assert len(lcp(f"{long} --every 1").out.splitlines()) > 100


@pytest.mark.parametrize(
    ("environment", "colored"),
    [
        ({"NO_COLOR": "1"}, False),
        ({"NO_COLOR": ""}, True),
        ({"TERM": "dumb"}, False),
    ],
)
def test_no_color_is_obeyed(environment, colored, monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert cli_terminal.terminal()[1] is colored


def test_a_vector_is_told_to_be_a_proof_by_its_products_only_without_bounds():
    products = ": M'y = (0) and q'y = -1, so y'(Mz + q) < 0 for every z >= 0"
    for bounds, y in (({}, f"(1){products}"), ({"lower": -np.inf}, "(-1)")):
        problem = Problem([[0]], [1 if bounds else -1], **bounds)
        assert outcome.proofs(run(problem, "auto")) == [f"Farkas certificate y = {y}"]


def test_durations_have_a_unit_that_fits():
    shown = {
        0.0: "0 us",
        1.5e-6: "1.5 us",
        0.0123: "12.3 ms",
        1.0: "1 s",
        75.25: "75.2 s",
        0.9997: "1 s",
    }
    assert {seconds: wording.duration(seconds) for seconds in shown} == shown
    assert wording.duration(1234.0) == "1234 s"


def test_zero_has_no_sign():
    assert wording.vector([-0.0, -1.0]) == "(0, -1)"


def test_components_beyond_seven_decimals_are_shown_with_their_exponent():
    assert wording.components([1.0, 2e6], largest=1.0) == ["1.0000000", "2.000000e+06"]
    assert wording.components([1e-9, 0.0], 1e-9) == ["1.000000e-09", "0.000000e+00"]
    assert wording.components([-1e-9, -2.0, -3e7], 2.0) == [
        "0.0000000",
        "-2.0000000",
        "-3.000000e+07",
    ]


SECOND = contents.shipped_path("paper-example-2.json")
BIMATRIX = contents.shipped_path("bimatrix.json")
COMMANDS = {
    "solve": f"solve {EXAMPLE}",
    "solve, stalled": f"solve {SECOND} --method shi --p 10",
    "solve, proved": f"solve {BIMATRIX} --exact --bound",
    "solve, large": f"solve {TRIDIAGONAL} --method fixed-point --max-iterations 20",
    "compare": f"compare {SECOND}",
    "compare, large": f"compare {TRIDIAGONAL} --max-iterations 20",
    "compare, a sweep": f"compare {EXAMPLE} --method shi --sweep p=10,1e5",
    "check": f"check {EXAMPLE} 1,0,1,0.5",
    "inspect": f"inspect {SECOND}",
    "bench": f"bench {EXAMPLE} --budget 0 --method newton --method shi",
    "list": "make --list",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_is_wider_than_the_screen(name, lcp, monkeypatch):
    monkeypatch.setenv("COLUMNS", "50")
    lines = lcp(COMMANDS[name]).out.splitlines()
    assert lines
    assert not [line for line in lines if len(line) > 50]


@pytest.mark.parametrize(
    "size", ["9" * 4400, "-5", "\u00b2", "0"], ids=lambda size: size[:3]
)
def test_sizes_of_the_environment_may_be_none(size, lcp, monkeypatch):
    for variable in ("COLUMNS", "LINES"):
        monkeypatch.setenv(variable, size)
    ran = lcp(f"solve {EXAMPLE}")
    assert bool(ran.out)
    assert ran.err == ""


@pytest.mark.parametrize(("width", "numbers"), [(100, {3}), (66, {1, 2}), (50, {1})])
def test_a_narrow_screen_drops_levels_but_the_finest_and_splits_no_row_of_the_summary(
    width, numbers, lcp, monkeypatch
):
    monkeypatch.setenv("COLUMNS", str(width))
    (header,) = (
        line.split()
        for line in lcp(f"compare {EXAMPLE}").out.splitlines()
        if line.endswith("status")
    )
    shown = [word for word in header if word[-1] != "s"]
    number = shown.count("to")  # the widths of times differ
    kept = ("1e-3", "1e-6", "1e-9")[-number:]
    assert number in numbers
    assert shown == [
        "method",
        *(word for level in kept for word in ("to", level)),
        "end",
        "error",
    ]


def heading_and_first(lcp, file):
    """The words of the heading of the iterates and the line of the first."""
    out = lcp(f"solve {file} --method fixed-point").out
    lines = out.partition("\n\n")[2].splitlines()
    return lines[0].split(), lines[2]


@pytest.mark.parametrize(("width", "method"), [(80, "fixed-point "), (40, "fixed- ")])
def test_the_name_of_a_method_is_folded_where_a_table_is_wide(
    width, method, lcp, terminal
):
    terminal(width, False)
    heading, first = heading_and_first(lcp, EXAMPLE)
    assert first.startswith(method)
    assert "..." not in heading or width < 80


@pytest.mark.parametrize(("width", "shown"), [(50, 2), (80, 4), (200, 15), (None, 12)])
def test_large_n_shows_first_and_last_components(width, shown, lcp, terminal):
    if width is not None:
        terminal(width, False)
    heading, _ = heading_and_first(lcp, TRIDIAGONAL)
    names = heading[2 : heading.index("error")]
    assert names[-2:] == ["...", "z100"]
    assert names[0] == ("z1" if width != 50 else "...")
    assert len(names) == shown


@pytest.mark.parametrize(("k", "m"), [(3, 1), (4, 1), (1, 4)])
def test_a_table_that_is_cut_says_so_whether_rows_or_variables_are_many(
    k, m, monkeypatch
):
    result = lcpcli.run(lcpcli.from_qp(None, np.ones(k), np.ones((m, k)), np.ones(m)))
    monkeypatch.setattr(answers, "MAX_ON_SCREEN", 3)
    (table,) = result.answer.tables(whole=False)
    assert [len(group) for group in table.groups] == [min(m, 3), min(k, 3)]
    assert bool(table.notes) is (max(k, m) > 3)


def test_no_number_in_the_row_of_one_of_many_is_cut_off():
    cells = ["1000", "iteration limit", "1.2e-10", "538 us", "12345"]
    ways = ["lemke", "newton", "objective 123.4567"]
    for width in range(40, 140):
        row = Layout.of(["problem" * 9], width).row(
            ProblemRow("problem" * 9, *cells, ways)
        )
        _, *shown = re.split(" {2,}", row.strip())
        assert len(row.rstrip()) <= width
        assert (shown[:5], shown[5:]) in [
            *((cells[:k], []) for k in range(6)),
            *((cells, [", ".join(ways[i:])]) for i in range(3)),
        ]
    assert shown[5:] == [", ".join(ways)]


def test_why_a_point_solves_is_said_beside_a_search_that_proved_nothing():
    """With --exact the same evidence is named as without it, once."""
    reason, nothing = "close to an exact solution", "no exact proof is known"
    solved = run(read(EXAMPLE), "auto")
    plain = replace(solved, message=f"solved: {reason}")
    message, unproved = f"solved: {reason}; {nothing}", Exact(None, nothing)
    exact = replace(solved, message=message, exact=unproved)
    assert outcome.verdict(plain).endswith(f"; {reason}")
    assert outcome.verdict(exact) == outcome.verdict(plain)
    proved = replace(exact, exact=Exact(Status.SOLVED, "in fractions"))
    assert reason not in outcome.verdict(proved), "as the proof says it"
