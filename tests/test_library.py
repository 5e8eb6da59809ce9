"""The commands as functions, what their results show to the interpreter, to notebooks
and to other programs; the examples in the docstrings run, and what has been pickled has
all its methods in a process that has imported nothing but pickle."""

import base64
import copy
import doctest
import gc
import inspect
import json
import pickle
import pydoc
import re
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array

import lcpcli
from lcpcli import Problem, Trace, run, solve
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.report import html_page

EXAMPLE = contents.shipped_path("paper-example-2.json")
M, Q = [[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]
INFEASIBLE = lcpcli.Problem([[-1.0]], [-2.0])


def test_result_and_inspection_are_what_the_command_writes(lcp):
    result = lcpcli.run(lcpcli.read(EXAMPLE), "shi", trace=True)
    ours = result.to_dict()
    theirs = lcp(f"solve {EXAMPLE} --method shi --format json").record
    assert json.loads(result.to_json()) == ours
    assert "\n" not in result.to_json()
    assert list(ours) == list(theirs)
    assert ours["z"] == theirs["z"]
    assert ours["status"] == theirs["status"]
    assert ours["options"] == theirs["options"]
    assert len(ours["trace"]) == result.iterations + 1
    assert (
        repr(lcpcli.inspect(result.problem))
        == lcp(f"inspect {EXAMPLE} --all").out.rstrip()
    )
    failed = lcpcli.run(result.problem, "shi", max_iterations=1)
    assert failed.to_dict()["advice"] == failed.advice


def test_check_reports_what_the_command_does_and_verifies_proofs(lcp):
    problem = lcpcli.read(EXAMPLE)
    assert (
        repr(lcpcli.check(problem, [0, 1, 1, 0]))
        == lcp(f"check {EXAMPLE} 0,1,1,0").out.rstrip()
    )
    assert lcpcli.check(problem, lcpcli.run(problem).z)
    assert not lcpcli.check(INFEASIBLE, [1.0], tol=1e-3)
    certificate = lcpcli.run(INFEASIBLE).certificate
    assert lcpcli.check(INFEASIBLE, y=certificate.vector).accepted
    assert not lcpcli.check(lcpcli.Problem(M, Q), y=[1.0, 1.0]).accepted
    # Without a name.
    assert str(lcpcli.check(lcpcli.Problem(M, Q), [4 / 3, 7 / 3])).startswith("n = 2\n")


@pytest.mark.slow("draws a figure")
def test_plot_writes_a_file_or_shows_in_a_notebook(tmp_path):
    pytest.importorskip("matplotlib")
    # Dense and sparse M are the same problem.
    results = [
        lcpcli.solve(M, Q, "shi", trace=True, scale=True),
        lcpcli.solve(csr_array(M), Q, "shi", trace=True),
        lcpcli.solve([[1.0]], [-1.0], trace=True),
    ]
    picture = lcpcli.plot(results, tmp_path / "errors.png")
    assert (tmp_path / "errors.png").read_bytes().startswith(b"\x89PNG")
    first, second = picture.data[0]
    assert [curve.label for curve in first.curves] == ["shi:scale=True", "shi"]
    assert len(second.curves) == 1
    assert "<svg" in picture._repr_svg_()
    assert repr(results[0].plot()) == "<Picture: 1 run on 1 problem>"
    with pytest.raises(
        OptionError,
        match="trace: newton has no recorded iterates; solve with trace=True",
    ):
        lcpcli.plot(lcpcli.solve(M, Q, "newton"))


def test_notebooks_show_the_answer_and_the_iterates_that_were_asked_for(monkeypatch):
    pytest.importorskip("matplotlib")
    shown = lcpcli.run(
        lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]])
    )._repr_html_()
    assert all(
        part in shown for part in ("solved by", "iterations", "residual", "payoffs")
    )
    assert "<img" not in shown
    traced = lcpcli.solve(M, Q, "shi", trace=True)
    picture = re.search(
        r'src="data:image/svg\+xml;base64,([^"]+)"', traced._repr_html_()
    )
    assert b"<svg" in base64.b64decode(picture[1])
    monkeypatch.setattr(html_page, "find_spec", lambda package: None)  # noqa: ARG005
    assert "<img" not in traced._repr_html_()


def test_the_method_of_solve_many_is_its_third_argument_as_of_solve():
    columns = np.array([[-5.0, -1], [-6, 2]])
    problems = [lcpcli.Problem(M, q) for q in columns.T]
    for results in (
        lcpcli.solve_many(M, columns, "newton"),
        lcpcli.solve_many(problems, "newton"),
        lcpcli.solve_many(problems, method="newton"),
    ):
        assert [result.method for result in results] == ["newton", "newton"]


@pytest.mark.parametrize("method", ["auto", "lemke", "interior"])
def test_solves_leave_no_garbage_in_cycles_which_the_command_searches_for_seldom(
    method,
):
    problems = [
        families.make("harker-pang", 5, 0),
        lcpcli.from_qp(np.eye(3), -np.ones(3)),
    ]
    found = []
    gc.disable()
    try:
        # What other threads of the tests leave is not there each time.
        for _ in range(3):
            gc.freeze()  # only what is made from here on is searched
            for problem in problems:
                lcpcli.run(problem, method)
            found.append(gc.collect())
    finally:
        gc.unfreeze()
        gc.enable()
    assert min(found) == 0


def test_errors_pass_between_processes():
    with pytest.raises(OptionError) as caught:
        lcpcli.solve(M, Q, tol=2)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


# What is done with an object of each class, and the beginning of what that says.
USES = {
    "Result": (
        "repr(it), it.to_dict()['status'], it.to_json()[:1], "
        "it._repr_html_()[:6], it.z.tolist()",
        "<Result: solved by newton, n = 2",
    ),
    "Problem": (
        "repr(it), it.q.tolist()",
        "<Problem small: n = 2, dense> [-5.0, -6.0]",
    ),
    "Trace": ("repr(it)", "<Trace: "),
    "Verification": ("repr(it).splitlines()[0], bool(it)", "small: n = 2 True"),
    "Inspection": ("repr(it).splitlines()[0]", "small: n = 2"),
}


def told(it, folder, code):
    """What a fresh process says of an object that is pickled."""
    (folder / "it").write_bytes(pickle.dumps(it))
    command = [
        sys.executable,
        "-c",
        f"import pickle\nit = pickle.load(open('it', 'rb'))\nprint({code})",
    ]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.returncode == 0
    return done.stdout


def objects():
    problem = lcpcli.Problem(M, Q, name="small")
    result = lcpcli.run(problem, "newton", trace=True)
    found = [
        problem,
        result,
        result.trace,
        lcpcli.check(problem, result.z),
        lcpcli.inspect(problem),
    ]
    return {type(it).__name__: it for it in found}


@pytest.mark.parametrize(
    "name",
    [
        name
        if name == "Result"
        else pytest.param(name, marks=pytest.mark.slow("a process"))
        for name in USES
    ],
)
def test_methods_are_there_in_a_fresh_process(name, tmp_path):
    code, says = USES[name]
    assert told(objects()[name], tmp_path, code).startswith(says)


def test_a_set_of_solutions_has_what_was_found_and_ends_with_it(tmp_path):
    """Also in a fresh process, in which its pieces are shown as here."""
    pieces = list(lcpcli.solutions(lcpcli.Problem([[0, 0], [0, 1]], [0, -1])))
    game = lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]])
    begun, ended = lcpcli.solutions(game), lcpcli.solutions(game)
    next(begun)
    assert len(list(ended)) == 3
    for search, others in ((begun, None), (ended, False)):
        deep = copy.deepcopy(search)
        assert list(map(str, deep)) == list(map(str, search.pieces))
        assert deep.others is others
    code = "*it[0], *(f'{len(list(each))} {each}' for each in it[1:])"
    said = " ".join([*map(str, pieces), f"1 {begun}", f"3 {ended}"])
    assert told((pieces, begun, ended), tmp_path, code) == f"{said}\n"
    assert len(list(begun)) == 3


# By the examples in the module.
NEEDED = {"lcpcli.report.plotting": "matplotlib", "lcpcli.solving.direct_run": "numba"}
HOMES = [
    "lcpcli",
    *sorted({getattr(lcpcli, name).__module__ for name in lcpcli.__all__}),
]


@pytest.mark.parametrize("module", HOMES)
@pytest.mark.usefixtures("in_folder")
def test_examples_run(module):
    if module in NEEDED:
        pytest.importorskip(NEEDED[module])
    found = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert found.attempted
    assert not found.failed


def test_every_public_name_has_an_example_and_stands_in_the_help():
    text = pydoc.plain(pydoc.render_doc(lcpcli))
    assert "find z >= 0" in text
    for name in lcpcli.__all__:
        assert ">>> " in (inspect.getdoc(getattr(lcpcli, name)) or ""), name
        assert name in text


def test_long_results_and_traces_are_shown_short():
    n = 10_000
    result = solve(eye_array(n), -np.ones(n), trace=True)
    assert len(repr(result)) < 200
    assert "1, ..., 1)" in repr(result)
    assert repr(result.trace).startswith("<Trace: ")
    assert len(repr(result.trace)) < 80
    assert repr(Trace(every=5)) == "<Trace: 0 iterates, every = 5>"
    assert repr(result.problem) == f"<Problem: n = {n}, sparse, {n} stored entries>"
    failed = run(Problem(M, Q), "fixed-point", max_iterations=1)
    assert repr(failed).startswith("<Result: iteration limit by fixed-point, n = 2, ")


def test_notebooks_show_results_in_which_names_are_harmless():
    problem = Problem(M, [-5.0, 1.25], name="<script>")
    shown = run(problem, "newton")._repr_html_()
    assert "<script>" not in shown
    assert "&lt;script&gt;" in shown
    assert "solved by newton" in shown
    assert "(2.5, 0)" in shown
    assert "<b>n = 2</b>" in run(Problem(M, Q))._repr_html_()
    failed = run(problem, "fixed-point", max_iterations=1)._repr_html_()
    assert "stopped at the iteration limit" in failed
    assert "try method=&quot;auto&quot;" in failed
