"""What a failed run says to try next works: followed, it leads to a solution or to a
proof that there is none."""

import re
from dataclasses import replace

import numpy as np
import pytest

from lcpcli import Problem, Status, Trace, read, run, solve_mcp
from lcpcli.files import contents, writing
from lcpcli.gallery import families as gallery
from lcpcli.solving.advice import suggestions

DECIDED = {0, 3}
FAILING = {
    "shi, badly scaled": ("ill-scaled", 10, "--method shi --max-iterations 300"),
    "shi, no P-matrix": ("bimatrix", 10, "--method shi --max-iterations 200"),
    "fixed-point, few iterations": (
        "tridiagonal",
        100,
        "--method fixed-point --max-iterations 50",
    ),
    "fixed-point, ill-conditioned": (
        "hilbert",
        10,
        "--method fixed-point --max-iterations 500",
    ),
    "fixed-point, badly scaled": (
        "ill-scaled",
        10,
        "--method fixed-point --max-iterations 500",
    ),
    "fixed-point, diverging": ("infeasible", 10, "--method fixed-point"),
    "fixed-point, singular": ("unsolvable", 10, "--method fixed-point"),
    "fixed-point, no step": (
        "kostreva",
        3,
        "--method fixed-point --max-iterations 0 --z0 .333333,.333333,.333333",
    ),
    "newton, singular": ("lp", 10, "--method newton"),
    "newton, few steps": ("murty", 20, "--method newton --max-iterations 15"),
    "newton, cycling": ("infeasible", 10, "--method newton --max-iterations 300"),
    "lemke, ray": ("bimatrix", 10, "--method lemke"),
    "lemke, no proof": ("ray", 10, "--method lemke"),
    "lemke, rounding": ("hilbert", 100, "--method lemke"),
    "auto, few iterations": ("harker-pang", 30, "--max-iterations 1"),
    "auto, short of time": ("harker-pang", 30, "--time-limit 1e-6"),
}


def followed(arguments, way):
    """The arguments with what the way adds, or puts in place of what they have."""
    words = way.removeprefix("lcp solve ").split()
    for word in words:
        if word.startswith("--") and word in arguments:
            place = arguments.index(word)
            arguments = arguments[:place] + arguments[place + 2 :]
    return arguments + words


def ways_in(out):
    """The ways that the line of advice names, each with what goes with all."""
    lines = [line for line in out.splitlines() if re.match(r"(\S+: )?try ", line)]
    assert len(lines) == 1
    assert len(lines[0]) <= 80
    ways, _, more = lines[0].split("try ", 1)[1].partition(", with ")
    return [f"{way} {more}" for way in ways.split(", or ")]


def refused(lcp, problem, words, folder):
    """The failed run, after each way that it advises has decided the problem."""
    arguments = words.split()
    file = folder / "problem.json"
    writing.write(problem, str(file))
    failed = lcp("solve", str(file), *arguments)
    assert failed.code == 1
    for way in ways_in(failed.out):
        assert lcp("solve", str(file), *followed(arguments, way)).code in DECIDED, way
    return failed


@pytest.mark.parametrize("name", FAILING)
def test_following_the_advice_decides_the_problem(name, lcp, tmp_path):
    family, n, words = FAILING[name]
    refused(lcp, gallery.make(family, n), words, tmp_path)


def test_following_the_advice_leads_away_from_a_stationary_point(lcp, tmp_path):
    """At x = (.5, .5) F = (1, -1) and J = 2M, so that grad f = J'F = 0 without any
    rounding; z = (0, 3) solves the problem."""
    problem = Problem([[1, 1], [1, 1]], [-1, -3])
    failed = refused(lcp, problem, "--method shi --x0 .5,.5", tmp_path)
    assert "stationary at a point that is not a zero of F~" in failed.out


def test_advice_in_python_can_be_followed():
    failed = run(read(contents.shipped_path("bimatrix.json")), "lemke")
    assert failed.advice == 'try method="auto"'
    assert run(failed.problem, **failed.suggestions.ways[0]).solved


def test_another_method_is_advised_after_few_iterations_not_an_interrupt():
    failed = run(gallery.make("harker-pang", 10), "shi", tol=1e-16, max_iterations=3)
    assert failed.advice == 'try method="auto", with max_iterations=10000'
    assert not suggestions(replace(failed, status=Status.INTERRUPTED)).ways


def test_at_the_time_limit_of_auto_the_method_that_came_near_is_named():
    near = run(gallery.make("qp", 60), "interior", max_iterations=6)
    assert 1e-10 < near.relative_residual < 1e-2
    late = replace(near, method="auto", status=Status.TIME_LIMIT, nearest="interior")
    assert [way.get("method") for way in suggestions(late).ways] == [None, "interior"]
    far = replace(late, point=run(near.problem, "interior", max_iterations=0).point)
    assert [way.get("method") for way in suggestions(far).ways] == [None]
    trace = Trace()
    result = run(gallery.make("hilbert", 60), max_iterations=10, trace=trace)
    reported = [row.method for row in trace.rows if np.array_equal(row.z, result.z)]
    assert (result.nearest or "auto") in reported, (
        "the method of the iterate that is reported, whichever rounding makes best"
    )


def test_more_iterations_are_advised_than_were_not_enough():
    stopped = replace(
        run(gallery.make("qp", 20), max_iterations=1), status=Status.ITERATION_LIMIT
    )
    for k in (1, 9_999, 10_000, 10_001):
        (way,) = suggestions(replace(stopped, iterations=k)).ways
        assert way["max_iterations"] > k


def test_other_starts_are_advised_where_stuck_and_what_may_be_wrong_with_f():
    stuck = solve_mcp(lambda z: 1 + z**2, lower=None, x0=[0.5], restarts=0)
    assert stuck.status is Status.STALLED
    assert re.fullmatch(r"try restarts=\d+, or another start", stuck.advice)
    outside = solve_mcp(lambda z: np.sqrt(z) + 1, lower=None, x0=[1.0], restarts=5)
    assert (
        outside.advice
        == "try restarts=25, or another start, or bounds within the domain of F"
    )
    scaled = solve_mcp(
        lambda z: [1 + z[0] ** 2, 1e9 * (z[1] - 1)],
        lower=None,
        x0=[0.5, 2.0],
        restarts=0,
    )
    assert "another scaling, as rows or columns of J differ by " in scaled.advice
    assert solve_mcp(lambda z: z - 1, x0=[0.0]).advice == ""
    assert (
        solve_mcp(lambda z: z**3 - 1, x0=[9.0], max_iterations=2).advice
        == "try max_iterations=10000"
    )
