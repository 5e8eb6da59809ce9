"""lcp compare --vary shows and draws where runs end, and when, against options that
vary one at a time; where neither iteration solves a problem, comparisons say why; and a
p that smooths nothing is named as such."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from lcpcli import Problem, read, run, write
from lcpcli.errors import ParameterError
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.inspection.failure import explanation
from lcpcli.methods.registry import Variant, vary
from lcpcli.methods.shi import default_p
from lcpcli.report import plotting
from lcpcli.report.document import typeset
from lcpcli.report.variations import document, variations

from ..cli.conftest import assert_refused
from ..seeds import few_of

EXAMPLE = "paper-example-1"


def rows(out):
    return [line.split() for line in out.splitlines()]


def test_options_vary_one_at_a_time_in_methods_that_have_them():
    methods = [Variant("fixed-point"), Variant("shi"), Variant("shi", (("p", "9"),))]
    found = vary(methods[:2], ["p=1,10", "sigma=0.5"])
    assert list(map(str, found)) == ["shi:p=1", "shi:p=10", "shi:sigma=0.5"]
    with pytest.raises(ParameterError, match="p is also set by shi:p=9"):
        vary(methods, ["p=1"])


@pytest.fixture
def degenerate(in_folder):
    write(families.make("degenerate", 10), str(in_folder / "degenerate.json"))
    return "degenerate.json"


def test_error_at_the_end_follows_the_theory_on_a_degenerate_problem(degenerate, lcp):
    """Where z_i = w_i = 0 it is of the order of ln 3 / p, and elsewhere exponentially
    small."""
    values = "1e2,1e4,1e6"
    asked = f"compare {degenerate} {EXAMPLE} --method shi --max-iterations 1000"
    outcome = lcp(f"{asked} --tol 1e-14 --vary p={values} --vary k-star=5")
    assert outcome.code == 1
    text = rows(outcome.out)
    assert text[0][:2] == ["p:", "error"]
    assert text[1] == ["p", "ln", "3", "/", "p", "degenerate-10", EXAMPLE]
    shown = text[3:6]
    assert [row[0] for row in shown] == values.split(",")
    for value, theory, error, other in shown:
        expected = math.log(3) / float(value)
        assert float(theory) == pytest.approx(expected, rel=0.05)
        assert 0.1 < float(error) / expected < 3
        assert float(other) < 1e-12
    # Whether k* = 5 reaches it depends on the kernels of the BLAS.
    with_p, _, _ = outcome.out.partition("k-star: error")
    assert with_p.count("in parentheses: the run has not reached") == 1
    times = text[8:11]
    assert [re.sub(r"[\d.]", "", row[1]) for row in times] == ["()"] * 3
    assert "shi: k-star=100, rho=0.0001, sigma=0.9" in " ".join(outcome.out.split())


def test_runs_are_those_of_a_sweep_in_json_and_csv(lcp):
    asked = f"compare {EXAMPLE} --method shi"
    swept = lcp(f"{asked} --sweep k-star=1,20 -f json").records
    varied = lcp(f"{asked} --vary k-star=1,20 --vary sigma=0.5 -f json").records
    assert [found["label"] for found in varied] == [
        *("shi:k-star=1", "shi:k-star=20", "shi:sigma=0.5")
    ]
    for own, other in zip(varied, swept, strict=False):
        assert own["z"] == other["z"]
        assert own["iterations"] == other["iterations"]
    lines = lcp(f"{asked} --vary k-star=1,20 -f csv").out.splitlines()
    assert [line.split(",")[:2] for line in lines if line[0] != "#"][1:] == [
        [EXAMPLE, "shi:k-star=1"],
        [EXAMPLE, "shi:k-star=20"],
    ]


def test_figure_has_a_row_for_each_option_and_a_line_for_each_problem(
    degenerate, lcp, in_folder, monkeypatch
):
    pytest.importorskip("matplotlib")
    drawn = []
    usual = plotting.variations

    def record(data, runs):
        drawn.extend(data)
        return usual(data, runs)

    monkeypatch.setattr(plotting, "variations", record)
    asked = f"compare {degenerate} {EXAMPLE} --method shi"
    options = "--vary p=10,1e3,1e5 --vary sigma=0.1,0.5,0.9"
    lcp(f"{asked} {options} --plot figure.svg -o table.md")
    assert [own.option for own in drawn] == ["p", "sigma"]
    first, second = drawn
    assert [line.label for line in first.lines] == ["degenerate-10", EXAMPLE]
    assert first.theory == [math.log(3) / float(value) for value in first.values]
    assert second.theory == []
    assert first.lines[0].solved == [False, False, False]
    figure = (in_folder / "figure.svg").read_text()
    assert figure.count('<g id="axes_') == 4
    table = (in_folder / "table.md").read_text()
    assert "| p | ln 3 / p | degenerate-10 | paper-example-1 |" in table


def test_words_are_shown_and_not_drawn(lcp, in_folder):
    pytest.importorskip("matplotlib")
    asked = f"compare {EXAMPLE} --vary omega=1,2,auto"
    assert [row[0] for row in rows(lcp(asked).out)[3:6]] == ["1", "2", "auto"]
    told = "--plot: draws numbers, and omega=auto is none; leave one out"
    assert_refused(lcp(f"{asked} --plot f.svg"), told)
    lcp(f"{asked} -o page.html")
    assert "<figure>" not in (in_folder / "page.html").read_text()


def test_runs_that_ctrl_c_has_prevented_stay_empty():
    problem, runs = read(contents.shipped_path(f"{EXAMPLE}.json")), []
    for values in ((1, 5), (1,)):
        made = [run(problem, "shi", k_star=k, max_iterations=5) for k in values]
        labels = [f"shi:k-star={k}" for k in values]
        runs.append(
            [replace(one, label=own) for one, own in zip(made, labels, strict=True)]
        )
    assert [len(line.values) for line in variations(runs)[0].lines] == [2, 1]
    shown = rows(typeset(document(runs), "table"))
    assert [row[0] for row in shown[3:5]] == ["1", "5"]
    assert [len(row) for row in shown[3:5]] == [3, 2]


REASONS = {
    "no P-matrix": (
        read("bimatrix"),
        "M is not a P-matrix (M(1, 1) = 0 is not positive)",
        "auto solves it",
    ),
    "scaling": (
        families.make("diagonal", 20),
        "the largest entries of rows or columns of M differ by 12 decades",
        "the option scale equilibrates M, and auto solves it",
    ),
    "condition": (
        families.make("hilbert", 12),
        "the condition of M is about 4e+16, and linear convergence slows down with it",
        "auto solves it",
    ),
    "no solution": (families.make("infeasible", 6), "as it has no solution", ""),
}


@pytest.mark.parametrize("name", REASONS)
def test_a_comparison_in_which_neither_solves_says_why_and_what_does(
    name, lcp, in_folder
):
    problem, cause, remedy = REASONS[name]
    write(problem, in_folder / "hard.json")
    asked = "compare hard.json --max-iterations 30"
    out = lcp(asked).out
    (line,) = [line for line in out.splitlines() if line.startswith("neither ")]
    assert line.startswith("neither fixed-point nor shi solves the problem")
    assert cause in line
    assert remedy in line
    if name == "no P-matrix":
        alone = lcp(f"{asked} --method shi").out
        assert f"shi does not solve the problem: {cause}" in alone


def test_a_comparison_says_nothing_where_it_knows_nothing(lcp):
    for limit in ("3", "1000"):
        out = lcp(f"compare {EXAMPLE} --max-iterations {limit}").out
        assert "the problem" not in out
    alone = lcp("solve bimatrix --method shi --max-iterations 30").out
    assert "solve the problem" not in alone


def test_kinks_count_where_z_and_w_are_both_0():
    problem = families.make("degenerate", 20)
    found = explanation(problem, ["shi"])
    assert found.causes == ["z_i = w_i = 0 for 10 of 20 i, close to which F has a kink"]
    assert found.guarantee == "newton is guaranteed to solve it, as M is a P-matrix"
    assert explanation(problem, ["fixed-point"]).causes == []


@pytest.mark.parametrize("seed", few_of(range(40), 10))
def test_a_method_named_as_guaranteed_solves_the_problem_or_proves_it_has_none(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    problem = Problem(
        rng.integers(-1, 4, (n, n)).astype(float),
        rng.integers(-3, 3, n).astype(float),
        lower=rng.choice([0, 0, -np.inf], n),
        upper=rng.choice([np.inf, np.inf, 3], n),
    )
    guarantee = explanation(problem, ["fixed-point"]).guarantee
    if guarantee:
        name = guarantee.split()[0]
        result = run(problem, method=name)
        proved = " or to prove that it has no solution" in guarantee
        assert result.status.name in ("SOLVED", "INFEASIBLE" if proved else "SOLVED")


@pytest.mark.parametrize("family", ["degenerate", "harker-pang", "growth", "obstacle"])
def test_the_default_p_smooths_nothing(family):
    """phi differs from |x| by less than the rounding of the largest of z and w."""
    problem = families.make(family, 10)
    result = run(problem)
    largest = max(np.abs(result.z).max(), np.abs(result.w).max())
    assert math.log(3) / default_p(problem) <= 2.0**-52 * largest
